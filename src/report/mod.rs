//! A [`Fit`] → what people and programs read of it. What people read is made once, as a value ([`content`]), and walked by
//! [`text`] and [`html`]; programs read [`json`] and [`csv`]. All are pure: a fit goes in, text or bytes come out. Only
//! [`write`](mod@write) touches the disk.

pub mod accuracy;
mod aligned;
pub mod compare;
pub mod content;
pub mod csv;
pub mod design;
mod diagnostics;
mod digits;
mod disc_section;
pub mod discs;
pub mod export;
pub mod extracted;
pub mod fit;
pub mod frame_table;
pub mod html;
pub mod json;
pub mod overview;
pub mod plot;
pub mod regression;
pub mod regression_table;
pub mod shot_table;
pub mod shots;
pub mod table;
pub mod text;
mod trust;
pub mod write;

use std::path::PathBuf;

pub use write::{fit_folder, folder_name, group_folders, write, write_all};

use crate::fit::Fit;
use crate::measurement::number;
use crate::measurement::observable::Observable;
use crate::measurement::parameter::Parameter;

/// `format_version` of the JSON documents: raised when a key is renamed or dropped, or changes its meaning.
pub const FORMAT_VERSION: u32 = 1;

/// Why a report cannot be made.
#[derive(Debug, thiserror::Error)]
pub enum ReportError {
    /// A file cannot be written.
    #[error("{}: cannot be written: {source}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// Why it cannot be written.
        source: std::io::Error,
    },
    /// The JSON of a fit cannot be made.
    #[error("fit.json of {dataset} cannot be made: {source}")]
    Json {
        /// The name of the data set.
        dataset: String,
        /// Why it cannot be made.
        source: serde_json::Error,
    },
    /// The drawing library or the PNG encoder failed.
    #[error("the residual plot of {dataset} cannot be drawn: {reason}")]
    Draw {
        /// The name of the data set.
        dataset: String,
        /// Why it cannot be drawn.
        reason: String,
    },
}

/// What a reader calls the fit: the data set and, where labels are fitted apart, the label.
#[must_use]
pub fn title(fit: &Fit) -> String {
    match &fit.group {
        Some((column, label)) => format!("{}, {column} = {label}", fit.dataset),
        None => fit.dataset.clone(),
    }
}

/// `full (friction, not flight)`: the collision model and its effects.
fn model(fit: &Fit) -> String {
    let effects: Vec<String> = fit
        .effects
        .iter()
        .map(|(effect, used)| if *used { (*effect).to_owned() } else { format!("not {effect}") })
        .collect();
    if effects.is_empty() {
        fit.fidelity.to_owned()
    } else {
        format!("{} ({})", fit.fidelity, effects.join(", "))
    }
}

/// What a reader calls the bodies that collided, and their size and mass.
fn bodies(fit: &Fit) -> (&'static str, String) {
    let millimetres = |radius: f64| number::plain(1e3 * radius, 5);
    let grams = |mass: f64| number::plain(1e3 * mass, 4);
    let Some(discs) = fit.discs else {
        return (
            "balls",
            format!("radius {} mm, mass {} g", millimetres(fit.ball.radius), grams(fit.ball.mass)),
        );
    };
    let radii = match discs.radii {
        Some([first, second]) => format!("radii {} and {} mm", millimetres(first), millimetres(second)),
        None => format!(
            "radii not stated ({} mm is half the distance of the centres at the impact)",
            millimetres(fit.ball.radius)
        ),
    };
    let masses = match discs.masses {
        Some([first, second]) => format!("masses {} and {} g", grams(first), grams(second)),
        None => "masses not stated".to_owned(),
    };
    ("discs", format!("{radii}, {masses}"))
}

/// Smaller probabilities are not told apart.
const LEAST_P: f64 = 1e-4;

/// A probability in words.
fn p_text(p: f64) -> String {
    if p < LEAST_P { format!("below {LEAST_P}") } else { number::plain(p, 2) }
}

/// χ² per degree of freedom, where there is one.
fn reduced_chi2(fit: &Fit) -> Option<f64> {
    (fit.dof > 0).then(|| fit.chi2 / fit.dof as f64)
}

/// Whether the noise of some observable was estimated from the residuals of this very fit, which
/// draws χ²/dof towards 1 whatever the model.
fn noise_estimated(fit: &Fit) -> bool {
    fit.noise.iter().any(|noise| noise.estimated_sd.is_some())
}

/// The unit of a parameter in files for programs: `1` where it has none.
pub fn unit_of(parameter: Parameter) -> &'static str {
    if parameter.unit().is_empty() { "1" } else { parameter.unit() }
}

/// The unit of an observable's column in files for programs: plain ASCII, `1` for a ratio.
fn unit_name(observable: Observable) -> &'static str {
    match observable.unit() {
        "°" => "deg",
        "" => "1",
        unit => unit,
    }
}
