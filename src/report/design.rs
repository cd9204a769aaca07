//! A [`Design`] → tables, design.csv, design.json and pictures.

use super::aligned::sections;
use super::content::{Block, Section, Table};
use super::number::plain;
use super::plot;
use super::{ReportError, csv, document};
use crate::design::information::std_errors;
use crate::design::{Cell, Design, Mixture, OfKind, PlayedKind, SpinFrom};
use crate::measurement::parameter::Parameter;

/// The files of a design: name and content.
///
/// # Errors
/// A figure or document that cannot be made.
pub fn files(design: &Design) -> Result<Vec<(String, Vec<u8>)>, ReportError> {
    let texts = [("design.csv", csv(design)), ("design.json", document::text(design)?)];
    let texts = texts.map(|(name, text)| (name.to_owned(), text.into_bytes()));
    Ok(plot::design::figure(design).files("design")?.into_iter().chain(texts).collect())
}

/// A standard error, or – for what is not told.
fn error(value: Option<f64>) -> String {
    value.map_or("–".to_owned(), |value| plain(value, 2))
}

fn count(value: Option<u64>) -> String {
    value.map_or("–".to_owned(), |value| value.to_string())
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

fn spin_from(from: SpinFrom) -> String {
    match from {
        SpinFrom::Known => "known".to_owned(),
        SpinFrom::Motion => "from the paths".to_owned(),
        SpinFrom::Markers { sd: None } => "markers".to_owned(),
        SpinFrom::Markers { sd: Some([cue, object]) } => {
            format!("markers, ± {} and {} rad/s", plain(cue, 2), plain(object, 2))
        }
    }
}

/// The text that `caromfit design` prints.
#[must_use]
pub fn text(design: &Design) -> String {
    let expected = &design.expected;
    let [mu, mu_s, e] = [expected.coefficients.mu, expected.coefficients.mu_s, expected.coefficients.e];
    let camera = &expected.camera;
    let balls = match &expected.object {
        Some(_) => format!("; {}", super::two_balls(&expected.ball, expected.object.as_ref())),
        None => String::new(),
    };
    let words = Section::new("In words", "", [Block::Lines(design.words.clone())]);
    let mut text = format!(
        "Expected μ = {mu}, μ_s = {mu_s}, e = {e}{balls}; filmed at {} fps, positions ± {} mm, {} ms before and {} ms after the \
         impact.\nWanted: {} (standard errors; none of the three has a unit).\n",
        plain(camera.fps, 4),
        plain(1e3 * camera.position_sd_m, 3),
        plain(camera.before_ms, 3),
        plain(camera.after_ms, 3),
        wishes(&expected.wanted)
    );
    text += &sections(
        kinds(design)
            .iter()
            .chain(&needed(design))
            .chain(&cells(design))
            .chain(&mixtures(design))
            .chain(&words),
    );
    for note in &design.notes {
        text += &format!("\nNote: {note}\n");
    }
    text + "\nNote: these are errors of chance. A scale, a radius, a frame rate or a spin that is wrong adds its own, however many \
            the shots.\n"
}

/// What the planned shots of each kind tell, and all of them together.
fn kinds(design: &Design) -> Option<Section> {
    let head = ["kind", "topspin", "side", "spin", "m/s", "cut, °", "shots"].map(str::to_owned);
    let head = head.into_iter().chain(Parameter::COEFFICIENTS.map(|p| format!("± {}", p.symbol())));
    let row = |(kind, found): (&PlayedKind, &OfKind)| {
        let own = [
            kind.name.clone(),
            range(kind.topspin),
            plain(kind.side, 3),
            spin_from(kind.from),
            range(kind.speed_m_s),
            range(kind.cut_deg),
            kind.shots.to_string(),
        ];
        own.into_iter().chain(found.std_errors.map(error)).collect()
    };
    let planned = &design.planned;
    let mut together = vec!["together".to_owned()];
    together.extend(vec![String::new(); 5]);
    together.push(planned.shots.to_string());
    together.extend(planned.std_errors.map(error));
    let rows = design.expected.kinds.iter().zip(&design.kinds).map(row).chain([together]);
    let mut lines = vec![
        "topspin, side: in parts of the natural roll's; spin: how it is known; ±: standard error; –: not told"
            .to_owned(),
    ];
    let seen = Parameter::COEFFICIENTS.into_iter().zip(document::detectable(design));
    let seen: Vec<String> =
        seen.filter_map(|(p, d)| Some(format!("{} {}", p.symbol(), plain(d?, 2)))).collect();
    if !seen.is_empty() {
        lines.push(format!(
            "Between two such data sets (all shots together) a difference is found in 80 % of cases, at 5 %, from: {}",
            seen.join(", ")
        ));
    }
    let title = "What so many shots of a kind tell, spread evenly over its speeds and cut angles";
    Section::new(title, "", [Table::new(head, rows).into(), Block::Lines(lines)])
}

/// How many shots of each kind alone are needed.
fn needed(design: &Design) -> Option<Section> {
    let symbols = Parameter::COEFFICIENTS.map(Parameter::symbol);
    let wanted: Vec<usize> = (0..3).filter(|i| design.expected.wanted[*i].is_some()).collect();
    let mut head = vec!["kind".to_owned()];
    head.extend(wanted.iter().map(|i| format!("for {}", symbols[*i])));
    head.push("for all".to_owned());
    head.extend(symbols.map(|symbol| format!("one more: {symbol}")));
    let row = |(kind, found): (&PlayedKind, &OfKind)| {
        let mut row = vec![kind.name.clone()];
        row.extend(wanted.iter().map(|i| count(found.needed[*i])));
        row.push(count(found.needed_all));
        row.extend(found.gain.map(|gain| gain.map_or("–".to_owned(), |g| format!("{:.2} %", 100.0 * g))));
        row
    };
    let rows = design.expected.kinds.iter().zip(&design.kinds).map(row);
    let line =
        "one more: by how much one more such shot narrows the standard error of all together".to_owned();
    let blocks = [Table::new(head, rows).into(), Block::Lines(vec![line])];
    Section::new("Shots of one kind alone that reach what is wanted", "", blocks)
}

/// One small table for each parameter: rows are kinds and speeds, columns cut angles.
fn cells(design: &Design) -> Vec<Section> {
    let near = |a: f64, b: f64| (a - b).abs() < 0.05;
    let mut cuts: Vec<f64> = design.cells.iter().map(|cell| cell.cut_deg).collect();
    cuts.sort_by(f64::total_cmp);
    cuts.dedup_by(|a, b| near(*a, *b));
    let section = |parameter: Parameter| {
        let told = |cell: &Cell| cell.std_errors[parameter as usize];
        let mut rows = Vec::new();
        for (index, kind) in design.expected.kinds.iter().enumerate() {
            let own: Vec<&Cell> = design.cells.iter().filter(|cell| cell.kind == index).collect();
            if own.iter().all(|cell| told(cell).is_none()) {
                continue;
            }
            for speed in design.speeds(index) {
                let mut row = vec![kind.name.clone(), plain(speed, 3), kind.shots.to_string()];
                row.extend(cuts.iter().map(|cut| {
                    let at = |c: &&&Cell| c.speed_m_s == speed && near(c.cut_deg, *cut);
                    own.iter().find(at).map_or(String::new(), |cell| error(told(cell)))
                }));
                rows.push(row);
            }
        }
        let head = ["kind", "m/s", "shots"].map(str::to_owned).into_iter();
        let head = head.chain(cuts.iter().map(|cut| format!("{}°", plain(*cut, 3))));
        let title = format!(
            "Standard error of {} ({}) by cut angle, from so many shots of one cut and speed alone",
            parameter.symbol(),
            parameter.meaning()
        );
        Section::new(title, "", [Table::new(head, rows).into()])
    };
    Parameter::COEFFICIENTS.into_iter().filter_map(section).collect()
}

/// What a mixture is for.
fn target(design: &Design, mixture: &Mixture) -> String {
    let mut wanted = design.expected.wanted;
    for (i, wanted) in wanted.iter_mut().enumerate() {
        let meant = mixture.parameter.is_none_or(|p| p as usize == i);
        *wanted = wanted.filter(|_| meant && mixture.std_errors[i].is_some());
    }
    wishes(&wanted)
}

/// `24 roll, 3 draw at 30° and 4 m/s`
fn shots(design: &Design, mixture: &Mixture) -> String {
    let name = |kind: usize| design.expected.kinds[kind].name.as_str();
    let each = mixture.shots.iter().map(|(index, shots)| {
        if mixture.of_cells {
            let Cell { kind, speed_m_s, cut_deg, .. } = &design.cells[*index];
            format!("{shots} {} at {}° and {} m/s", name(*kind), plain(*cut_deg, 3), plain(*speed_m_s, 3))
        } else {
            format!("{shots} {}", name(*index))
        }
    });
    each.collect::<Vec<_>>().join(", ")
}

fn mixtures(design: &Design) -> Vec<Section> {
    let section = |(of_cells, title): (bool, &str)| {
        let own = design.mixtures.iter().filter(|m| m.of_cells == of_cells);
        let row = |m: &Mixture| vec![target(design, m), m.total().to_string(), shots(design, m)];
        Section::new(title, "", [Table::new(["for", "shots", "of which"], own.map(row)).into()])
    };
    let both = [
        (false, "Fewest shots, of kinds spread over their speeds and cut angles"),
        (true, "Fewest shots, of the best cut angles and speeds alone"),
    ];
    both.into_iter().filter_map(section).collect()
}

/// One row per kind (without a cut angle and speed of its own) and per cell.
#[must_use]
pub fn csv(design: &Design) -> String {
    let mut table = csv::Table::default();
    let kinds = design.kinds.iter().enumerate().map(|(kind, found)| (kind, None, &found.information));
    let cells = design.cells.iter().map(|cell| (cell.kind, Some(cell), &cell.information));
    for (kind, cell, information) in kinds.chain(cells) {
        let PlayedKind { name, topspin, side, shots, .. } = &design.expected.kinds[kind];
        table.begin();
        table.add("kind", name);
        table.add("topspin", (0.5 * (topspin[0] + topspin[1])).to_string());
        table.add("side", side.to_string());
        table.add("speed_m_s", cell.map_or(String::new(), |cell| plain(cell.speed_m_s, 6)));
        table.add("cut_deg", cell.map_or(String::new(), |cell| plain(cell.cut_deg, 6)));
        table.add("shots", shots.to_string());
        for (of, shots) in [("sd", *shots as f64), ("sd_of_one", 1.0)] {
            let errors = std_errors(&(information * shots));
            for (parameter, error) in Parameter::COEFFICIENTS.into_iter().zip(errors) {
                table.add_number(&format!("{}_{of}", parameter.name()), error.unwrap_or(f64::NAN));
            }
        }
    }
    table.text()
}
