//! residuals.svg and residuals.png: what a reader looks at before believing a fit. Both come from the
//! same drawing; neither needs a font of the machine for its layout, and the PNG none at all.

mod axis;
pub(super) mod camera;
pub(super) mod compare;
pub(super) mod contours;
pub(super) mod design;
pub(super) mod discs;
mod frame;
mod panels;
pub mod paths;
mod picture;
mod points;
pub mod precision;
mod series;
pub(super) mod track;

use super::number::{count_of, plain};
use super::table::{chi2_text, estimate, with_unit};
use super::{noise_estimated, reduced_chi2, title};
use crate::fit::Fit;
use frame::Rect;
use panels::{CUT, SPEED};
pub use picture::Picture;
use picture::{ALARM, Anchor, INK, LARGE, MEDIUM, SMALL, shortened};
use points::Points;
use series::Legend;

/// Width of the picture, pixels.
pub const WIDTH: u32 = 1200;

/// Height of a row of panels, pixels.
const ROW: i32 = 440;

/// Free space at the edges of the picture, pixels.
const MARGIN: i32 = 22;

/// The residuals of a fit, below its title, model, estimates, χ², and what the reader must know first. Panels stand two by two; where
/// measured against predicted takes several of them, these fill the upper row.
#[must_use]
pub fn residuals(fit: &Fit) -> Picture {
    let width = WIDTH as i32 - 2 * MARGIN;
    let points = Points::of(fit);
    let legend = Legend::new(points.legend(), width);
    let (summary, warning) = (summary(fit), warning(fit));
    let below = 60 + 30 * summary.len() as i32 + if warning.is_some() { 28 } else { 0 };
    let upper = below + legend.height() + 14;
    let mut picture = Picture::new(&fit.dataset, WIDTH as i32, upper + 2 * ROW);
    picture.title(&shortened(&title(fit), LARGE, width), 34);
    for (line, y) in summary.iter().zip((72..).step_by(30)) {
        picture.text(&shortened(line, MEDIUM, width), (MARGIN, y), Anchor::Left, MEDIUM, INK);
    }
    if let Some(warning) = warning {
        picture.label(&shortened(&warning, SMALL, width), (MARGIN, below - 16), ALARM);
    }
    legend.draw(&mut picture, (MARGIN, below), 0.9);
    let lower = upper + ROW;
    let groups = panels::groups(&points.observables);
    let columns = if groups.len() < 2 { 2 } else { groups.len() };
    for (column, group) in groups.iter().enumerate() {
        panels::measured(&mut picture, Rect::of_row(upper, ROW, column, columns), &points, group);
    }
    if groups.is_empty() {
        let text = "No observations.";
        frame::message(&mut picture, Rect::of_row(upper, ROW, 0, 2), "Measured against predicted", text);
    }
    let places =
        if groups.len() < 2 { [(upper, 1), (lower, 0), (lower, 1)] } else { [0, 1, 2].map(|i| (lower, i)) };
    let columns = if groups.len() < 2 { 2 } else { 3 };
    let [cut, speed, quantiles] = places.map(|(top, column)| Rect::of_row(top, ROW, column, columns));
    panels::against(&mut picture, cut, &points, &CUT);
    panels::against(&mut picture, speed, &points, &SPEED);
    panels::quantiles(&mut picture, quantiles, &points);
    picture
}

fn summary(fit: &Fit) -> Vec<String> {
    let estimates: Vec<String> = fit
        .estimates
        .iter()
        .map(|one| {
            let value = with_unit(&estimate(fit, one), one.parameter.unit(), " ");
            let equal = if value.starts_with(['≥', '≤']) { "" } else { "= " };
            format!("{} {equal}{value}", one.parameter.symbol())
        })
        .collect();
    let chi2 = match reduced_chi2(fit) {
        Some(chi2) => {
            let how = if noise_estimated(fit) { "; noise estimated from these residuals" } else { "" };
            let counted = match fit.frames {
                Some(_) => format!(" of {}", fit.counted().words()),
                None => String::new(),
            };
            let value = plain(fit.chi2, 4);
            format!("χ²/dof{counted} = {} (χ² = {value}, {} dof{how})", chi2_text(chi2), fit.dof)
        }
        None => "no degrees of freedom".to_owned(),
    };
    vec![
        estimates.join(",   "),
        format!("model {},   {},   {chi2}", fit.fidelity, count_of(fit.shots_used, "shot")),
    ]
}

/// The first warning, and how many more there are.
fn warning(fit: &Fit) -> Option<String> {
    let stopped = (!fit.converged).then(|| format!("Not converged: {}", fit.termination));
    let mut warnings = stopped.iter().chain(&fit.warnings);
    let first = warnings.next()?;
    Some(match warnings.count() {
        0 => first.clone(),
        more => format!("(+{more} more) {first}"),
    })
}
