//! A [`Design`] → tables, design.json and a figure.

use std::path::Path;

use super::content::{self, Block, Section, Table};
use super::write::Staged;
use super::{ReportError, document, plot};
use crate::design::{Design, Mixture, OfKind, PlayedKind, SpinFrom};
use crate::measurement::number::plain;
use crate::measurement::parameter::Parameter;
use crate::physics::collision::Coefficients;

/// Writes design.json and the figure of a design.
pub(crate) fn write(design: &Design, out: &Path) -> Result<(), ReportError> {
    let figure = plot::design(design);
    Staged::new(out)?.figure("design", &figure)?.add("design.json", document::text(design)?)?.put()
}

/// Returns a standard error, or – for what is not determined.
fn error(value: Option<f64>) -> String {
    value.map_or("–".to_owned(), |value| plain(value, 2))
}

/// `μ ± 0.001, e ± 0.001`
fn wishes(wanted: &[Option<f64>; 3]) -> String {
    let each = Parameter::COEFFICIENTS.into_iter().zip(wanted);
    let each = each.filter_map(|(p, wanted)| Some(format!("{} ± {}", p.symbol(), plain((*wanted)?, 3))));
    each.collect::<Vec<_>>().join(", ")
}

/// `20 to 50`, `30`
fn range([from, to]: [f64; 2]) -> String {
    if from == to { plain(from, 3) } else { format!("{} to {}", plain(from, 3), plain(to, 3)) }
}

/// Returns the text that `caromfit design` prints.
pub(crate) fn text(design: &Design) -> String {
    let expected = &design.expected;
    let Coefficients { mu, mu_s, e } = expected.coefficients;
    let camera = &expected.camera;
    let body = |object, which| document::Body::of_balls(&expected.ball, Some(object), which);
    let balls = expected.object.as_ref().map_or(String::new(), |object| {
        format!("; {}", super::two_balls(&body(object, 0), &body(object, 1)))
    });
    let mut text = format!(
        "Expected μ = {mu}, μ_s = {mu_s}, e = {e}{balls}; filmed at {} fps, positions ± {} mm, {} ms before and {} ms after the \
         impact.\nWanted: {} (standard errors; none of the three has a unit).\n",
        plain(camera.fps, 4),
        plain(1e3 * camera.position_sd_m, 3),
        plain(camera.before_ms, 3),
        plain(camera.after_ms, 3),
        wishes(&expected.wanted)
    );
    let words = Section::of_lines("In words", "", design.words.clone());
    let sections = [kinds(design), mixtures(design), words];
    text += &content::sections(&sections);
    text.extend(design.notes.iter().map(|note| format!("\nNote: {note}\n")));
    text + "\nNote: these are errors of chance. A scale, a radius, a frame rate or a spin that is wrong adds its own, however many \
            the shots.\n"
}

fn kinds(design: &Design) -> Section {
    let row = |(kind, found): (&PlayedKind, &OfKind)| {
        let spin = match (kind.source(), kind.spin_sd_rad_s) {
            (SpinFrom::Known, _) => "known".to_owned(),
            (SpinFrom::Motion, _) => "from the paths".to_owned(),
            (SpinFrom::Markers, sd) => {
                let [cue, object] = sd.unwrap_or([f64::NAN; 2]).map(|sd| plain(sd, 2));
                format!("markers, ± {cue} and {object} rad/s")
            }
        };
        let mut row = vec![kind.name.clone(), range(kind.topspin), plain(kind.side, 3), spin];
        row.extend([range(kind.speed_m_s), range(kind.cut_deg), kind.shots.to_string()]);
        row.extend(found.std_errors.map(error));
        row
    };
    let planned = &design.planned;
    let mut together = vec![String::new(); 7];
    (together[0], together[6]) = ("together".to_owned(), planned.shots.to_string());
    together.extend(planned.std_errors.map(error));
    let rows = design.expected.kinds.iter().zip(&design.kinds).map(row).chain([together]);
    let head = ["kind", "topspin", "side", "spin", "m/s", "cut, °", "shots"].map(str::to_owned);
    let head = head.into_iter().chain(Parameter::COEFFICIENTS.map(|p| format!("± {}", p.symbol())));
    let mut lines = vec![
        "topspin, side: in parts of the natural roll's; spin: how it is known; ±: standard error; –: not determined"
            .to_owned(),
    ];
    let seen = Parameter::COEFFICIENTS.into_iter().zip(document::detectable(design));
    let seen = seen.filter_map(|(p, d)| Some(format!("{} {}", p.symbol(), plain(d?, 2))));
    let seen = seen.collect::<Vec<_>>().join(", ");
    if !seen.is_empty() {
        lines.push(format!(
            "Between two such data sets (all shots together) a difference is found in 80 % of cases, at 5 %, from: {seen}"
        ));
    }
    let title = "What so many shots of a kind tell, spread evenly over its speeds and cut angles";
    Section::new(title, "", [Table::new(head, rows).into(), Block::Lines(lines)])
}

/// Returns the mixtures of kinds, spread over their speeds and cut angles, that need the fewest shots.
fn mixtures(design: &Design) -> Section {
    let row = |mixture: &Mixture| {
        let mut wanted = design.expected.wanted;
        for (i, wanted) in wanted.iter_mut().enumerate() {
            let is_meant = mixture.parameter.is_none_or(|p| p as usize == i);
            *wanted = wanted.filter(|_| is_meant && mixture.std_errors[i].is_some());
        }
        let each = mixture.shots.iter().map(|(kind, n)| format!("{n} {}", design.expected.kinds[*kind].name));
        vec![wishes(&wanted), mixture.total().to_string(), each.collect::<Vec<_>>().join(", ")]
    };
    let rows = design.mixtures.iter().map(row);
    Section::new("Fewest shots", "", [Table::new(["for", "shots", "of which"], rows).into()])
}
