//! residuals.svg and residuals.png: what a reader looks at before believing a fit. Both come from the
//! same drawing; neither needs a font of the machine for its layout, and the PNG none at all.

mod axis;
pub(super) mod camera;
mod canvas;
pub(super) mod compare;
pub(super) mod contours;
pub(super) mod design;
pub(super) mod discs;
mod drawing;
mod frame;
mod panels;
pub mod paths;
mod points;
pub mod precision;
mod series;
pub(super) mod track;

use plotters::prelude::*;

use super::number::{count_of, plain};
use super::table::{chi2_text, estimate, with_unit};
use super::{ReportError, noise_estimated, reduced_chi2, title};
use crate::fit::{Fit, Method};
use canvas::{ALARM, Anchor, Canvas, INK, LARGE, MEDIUM, SMALL, shortened};
use drawing::Area;
use frame::Rect;
use points::Points;
use series::Legend;

/// Where points of the data are on a picture: pixels from the left and from the top, and the index of the residual.
pub(crate) type Spots = Vec<(i32, i32, usize)>;

/// Width of the picture, pixels.
pub const WIDTH: u32 = 1200;

/// Height of a row of panels, pixels.
const ROW: i32 = 440;

/// Free space at the edges of the picture, pixels.
const MARGIN: i32 = 22;

/// residuals.svg as text.
pub fn svg(fit: &Fit) -> Result<String, ReportError> {
    svg_with_spots(fit).map(|(text, _)| text)
}

/// residuals.svg, and where its points are: x, y, index of the residual.
pub(crate) fn svg_with_spots(fit: &Fit) -> Result<(String, Spots), ReportError> {
    let drawn = Picture::of(fit).and_then(|picture| drawing::svg(picture.size(), |area| picture.draw(area)));
    drawn.map_err(|reason| failed(fit, reason))
}

/// residuals.png as bytes.
pub fn png(fit: &Fit) -> Result<Vec<u8>, ReportError> {
    let drawn = Picture::of(fit).and_then(|picture| drawing::png(picture.size(), |area| picture.draw(area)));
    drawn.map_err(|reason| failed(fit, reason))
}

fn failed(fit: &Fit, reason: String) -> ReportError {
    ReportError::Draw { dataset: fit.dataset.clone(), reason }
}

/// Everything that is drawn, laid out.
struct Picture {
    title: String,
    /// Model, estimates, χ².
    summary: Vec<String>,
    /// What the reader must know first.
    warning: Option<String>,
    legend: Legend,
    points: Points,
    groups: Vec<panels::Group>,
}

impl Picture {
    fn of(fit: &Fit) -> Result<Self, String> {
        canvas::register()?;
        let width = WIDTH as i32 - 2 * MARGIN;
        let points = Points::of(fit);
        Ok(Self {
            title: shortened(&title(fit), LARGE, width),
            summary: summary(fit).iter().map(|line| shortened(line, MEDIUM, width)).collect(),
            warning: warning(fit).map(|text| shortened(&text, SMALL, width)),
            legend: Legend::new(&points, width),
            groups: panels::groups(&points.observables),
            points,
        })
    }

    /// Width and height in pixels.
    fn size(&self) -> (u32, u32) {
        (WIDTH, u32::try_from(self.head() + 2 * ROW).unwrap_or(WIDTH))
    }

    /// Height of what stands above the panels.
    fn head(&self) -> i32 {
        let warning = if self.warning.is_some() { 28 } else { 0 };
        60 + 30 * self.summary.len() as i32 + warning + self.legend.height() + 14
    }

    fn draw<DB: DrawingBackend>(&self, area: &Area<DB>) -> Result<Spots, String> {
        let canvas = Canvas::new(area)?;
        canvas.text(&self.title, (MARGIN, 34), Anchor::Left, LARGE, INK)?;
        let mut y = 72;
        for line in &self.summary {
            canvas.text(line, (MARGIN, y), Anchor::Left, MEDIUM, INK)?;
            y += 30;
        }
        if let Some(warning) = &self.warning {
            canvas.text(warning, (MARGIN, y), Anchor::Left, SMALL, ALARM)?;
            y += 28;
        }
        self.legend.draw(&canvas, (MARGIN, y - 12))?;
        self.panels(&canvas)?;
        Ok(canvas.spots())
    }

    /// Two by two; where measured against predicted takes several panels, these fill the upper row.
    fn panels<DB: DrawingBackend>(&self, canvas: &Canvas<DB>) -> Result<(), String> {
        let [upper, lower] = [0, 1].map(|row| self.head() + ROW * row);
        let points = &self.points;
        match &self.groups[..] {
            [] | [_] => {
                match self.groups.first() {
                    Some(group) => panels::measured(canvas, cell(upper, 0, 2), points, group)?,
                    None => frame::message(
                        canvas,
                        cell(upper, 0, 2),
                        "Measured against predicted",
                        "No observations.",
                    )?,
                }
                panels::against_cut(canvas, cell(upper, 1, 2), points)?;
                panels::against_speed(canvas, cell(lower, 0, 2), points)?;
                panels::quantiles(canvas, cell(lower, 1, 2), points)
            }
            groups => {
                for (column, group) in groups.iter().enumerate() {
                    panels::measured(canvas, cell(upper, column, groups.len()), points, group)?;
                }
                panels::against_cut(canvas, cell(lower, 0, 3), points)?;
                panels::against_speed(canvas, cell(lower, 1, 3), points)?;
                panels::quantiles(canvas, cell(lower, 2, 3), points)
            }
        }
    }
}

/// One of `columns` panels side by side.
fn cell(top: i32, column: usize, columns: usize) -> Rect {
    let left = |column: usize| 6 + (WIDTH as i32 - 12) * column as i32 / columns as i32;
    Rect { left: left(column), top, right: left(column + 1), bottom: top + ROW - 8 }
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
            let counted = match fit.method {
                Method::Joint => format!(" of {}", fit.counted().words()),
                Method::TwoStage => String::new(),
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
