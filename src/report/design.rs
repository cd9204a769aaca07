//! A [`Design`] → tables, design.json and a figure.

use std::path::Path;

use super::content::{self, Block, Section, Table};
use super::document::{self, DesignDocument};
use super::write::Staged;
use super::{ReportError, plot};
use crate::design::Design;
use crate::measurement::number::plain;
use crate::measurement::parameter::Parameter;
use crate::physics::collision::Coefficients;

/// Writes design.json and the figure of a design.
pub(crate) fn write(design: &Design, out: &Path) -> Result<(), ReportError> {
    let figure = plot::design(design);
    let text = document::text(&DesignDocument::new(design))?;
    Staged::new(out)?.figure("design", &figure)?.add("design.json", text)?.put()
}

/// Returns the text that `caromfit design` prints.
pub(crate) fn text(design: &Design) -> String {
    let (document, expected) = (DesignDocument::new(design), &design.expected);
    let Coefficients { mu, mu_s, e } = expected.coefficients;
    let camera = &expected.camera;
    let balls = document.object.as_ref();
    let balls =
        balls.map_or(String::new(), |object| format!("; {}", super::two_balls(&document.ball, object)));
    let wanted = Parameter::COEFFICIENTS.into_iter().zip(expected.wanted);
    let wanted = wanted.filter_map(|(p, wanted)| Some(format!("{} ± {}", p.symbol(), plain(wanted?, 3))));
    let text = format!(
        "Expected μ = {mu}, μ_s = {mu_s}, e = {e}{balls}; filmed at {} fps, positions ± {} mm, {} ms before and {} ms after the \
         impact.\nWanted: {} (standard errors; none of the three has a unit).\n",
        plain(camera.fps, 4),
        plain(1e3 * camera.position_sd_m, 3),
        plain(camera.before_ms, 3),
        plain(camera.after_ms, 3),
        wanted.collect::<Vec<_>>().join(", ")
    );
    let errors = [("± μ", "/std_error/mu"), ("± μ_s", "/std_error/mu_s"), ("± e", "/std_error/e")];
    let kinds = [
        ("kind", "/name"),
        ("topspin", "/topspin"),
        ("side", "/side"),
        ("markers, ± rad/s", "/spin_sd_rad_s/0"),
        ("object", "/spin_sd_rad_s/1"),
        ("m/s", "/speed_m_s"),
        ("cut, °", "/cut_deg"),
        ("shots", "/shots"),
    ];
    let together = [
        ("shots", "/shots"),
        ("± μ", "/std_error/mu"),
        ("± μ_s", "/std_error/mu_s"),
        ("± e", "/std_error/e"),
        ("difference in μ", "/detectable_difference/mu"),
        ("in μ_s", "/detectable_difference/mu_s"),
        ("in e", "/detectable_difference/e"),
    ];
    let fewest = document.fewest_shots.iter().map(|mixture| {
        let shots = mixture.shots.iter().map(|own| format!("{} {}", own.shots, own.kind));
        vec![
            super::symbol(mixture.r#for).to_owned(),
            mixture.total.to_string(),
            shots.collect::<Vec<_>>().join(", "),
        ]
    });
    let about = "topspin, side: in parts of the natural roll's; markers: errors of the cue and the object ball's spin; ±: standard error; –: not determined";
    let found = "difference: between two such data sets, found in 80 % of cases at 5 %";
    let sections = [
        Section::new(
            "Shots of a kind, spread evenly over its speeds and cut angles",
            about,
            [Table::of(&document.kinds, &[&kinds[..], &errors].concat())],
        ),
        Section::new("All shots together", found, [Table::of([&document.together], &together)]),
        Section::new(
            "Fewest shots for what is wanted",
            "",
            [Block::Table(Table::new(["for", "shots", "of which"], fewest))],
        ),
        Section::new("In words", "", [Block::Lines(document.in_words)]),
    ];
    let notes: String = document.notes.iter().map(|note| format!("\nNote: {note}\n")).collect();
    text + &content::sections(&sections)
        + &notes
        + "\nNote: these are errors of chance. A scale, a radius, a frame rate or a spin that is wrong adds its own, however many \
           the shots.\n"
}
