//! Outputs of a [`Fit`] for people and for programs. Programs read [`document`] and [`csv`];
//! `templates` render documents as text and HTML for people. Only `write` touches the disk.

pub(crate) mod accuracy;
pub mod compare;
pub mod csv;
pub(crate) mod design;
pub mod document;
pub(crate) mod export;
pub(crate) mod extracted;
pub mod fit;
mod plot;
mod shots;
pub mod stored;
mod templates;
pub mod terminal;
pub(crate) mod write;

#[cfg(feature = "cli")]
pub(crate) use write::fit_folder;
pub use write::{folder_name, group_folders, write};

use document::Body;

use crate::fit::{Counted, Fit};
#[cfg(feature = "cli")]
pub(crate) use crate::measurement::number::count_of;
use crate::measurement::number::{plain, with_error};
use crate::measurement::parameter::Parameter;
use crate::physics::ball::UNIFORM_SPHERE;
use crate::physics::disc::{Discs, UNIFORM_DISC};
use crate::problem::{self, Id};

/// Why a report cannot be made: a file that cannot be written, or a figure, a page or a JSON
/// document that cannot be made.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub struct ReportError(String);

impl ReportError {}

impl From<serde_json::Error> for ReportError {
    fn from(error: serde_json::Error) -> Self {
        Self(format!("the result cannot be written as JSON: {error}"))
    }
}

impl From<minijinja::Error> for ReportError {
    fn from(error: minijinja::Error) -> Self {
        Self(format!("the report cannot be rendered: {error:#}"))
    }
}

/// Returns the title of the fit: the data set and, if labels are fitted separately, the label.
pub(crate) fn title(fit: &Fit) -> String {
    match &fit.group {
        Some((column, label)) => format!("{}, {column} = {label}", fit.dataset),
        None => fit.dataset.clone(),
    }
}

/// Returns what a reader calls the bodies that collided, and their size and mass.
fn bodies(fit: &Fit) -> (&'static str, String) {
    let [first, second] = [0, 1].map(|which| document::body(fit, which));
    match fit.discs {
        Some(discs) if discs.radii.is_none() => {
            ("discs", format!("radii not stated (half the distance of the centres: {})", size(&first)))
        }
        Some(_) => ("discs", format!("first: {}; second: {}", size(&first), size(&second))),
        None if fit.object.is_none() => ("balls", size(&first)),
        None => ("balls", two_balls(&first, &second)),
    }
}

fn two_balls(cue: &Body, object: &Body) -> String {
    format!("cue ball: {}; object ball: {}", size(cue), size(object))
}

/// Returns radius and mass of a body in words, with the errors that are stated, and a moment of
/// inertia that is not a uniform ball's.
fn size(body: &Body) -> String {
    let milli = |value: f64, sd: Option<f64>, digits: usize| match sd {
        Some(sd) => with_error(1e3 * value, 1e3 * sd),
        None => plain(1e3 * value, digits),
    };
    let mass = body.mass_kg.map(|mass| format!(", mass {} g", milli(mass, body.mass_kg_sd, 4)));
    let is_usual = [UNIFORM_SPHERE, UNIFORM_DISC].contains(&body.inertia);
    let inertia = if is_usual { String::new() } else { format!(", inertia {} MR²", plain(body.inertia, 4)) };
    format!("radius {} mm{}{inertia}", milli(body.radius_m, body.radius_m_sd, 5), mass.unwrap_or_default())
}

/// Returns `p = 0.013`; small probabilities are not distinguished.
fn p_text(p: f64) -> String {
    const LEAST_P: f64 = 1e-4;
    if p < LEAST_P { format!("p < {LEAST_P}") } else { format!("p = {}", plain(p, 2)) }
}

/// Returns χ² per degree of freedom, what it counts, and whether the noise of some observable was
/// estimated from the residuals of this very fit, which draws χ²/dof towards 1 for any the model.
fn chi2_words(fit: &Fit) -> String {
    chi2_of(fit.counted(), fit.chi2, fit.dof, fit.noise.iter().any(|noise| noise.estimated_sd.is_some()))
}

/// Returns χ² per degree of freedom in words.
fn chi2_of(counted: Counted, chi2: f64, dof: usize, is_estimated: bool) -> String {
    if dof == 0 {
        return "no degrees of freedom: the fit passes through the data and cannot be tested".to_owned();
    }
    let reduced = chi2 / dof as f64;
    // three digits if two decimals are 0
    let text = if (0.01..100.0).contains(&reduced) { format!("{reduced:.2}") } else { plain(reduced, 3) };
    let how = if is_estimated { "; noise estimated from the residuals" } else { "" };
    format!("χ²/dof of {} = {text} (χ² = {}, {dof} dof{how})", counted.words(), plain(chi2, 4))
}

/// Returns a unit in files for programs: plain ASCII, `1` for a ratio.
fn ascii(unit: &'static str) -> &'static str {
    match unit {
        "°" => "deg",
        "" => "1",
        unit => unit,
    }
}

fn speed_unit(discs: &Discs) -> &'static str {
    if discs.in_seconds { "m/s" } else { "m per frame" }
}

/// Sources of the standard error of a parameter, by their symbols, the largest first, without those
/// below a tenth of the standard error.
struct Budget {
    of: Id,
    std_error: f64,
    parts: Vec<(String, f64)>,
}

fn budgets(fit: &Fit) -> Vec<Budget> {
    let budget = |found: &problem::Budget| {
        let parts = document::budget(found).into_iter();
        let parts = parts.filter_map(|part| Some((symbol(&part.source).to_owned(), part.std_error?)));
        let mut parts: Vec<_> = parts.collect();
        let std_error = parts.iter().map(|(_, error)| error.powi(2)).sum::<f64>().sqrt();
        parts.retain(|(_, error)| *error >= 0.1 * std_error);
        Budget { of: found.id, std_error, parts }
    };
    fit.budget.iter().map(budget).collect()
}

/// Returns the symbol of an unknown, by its name; without one the name.
fn symbol(name: &str) -> &str {
    match (name, Parameter::ALL.into_iter().find(|parameter| parameter.name() == name)) {
        ("mu_k", _) => "μ_k",
        ("mu_r", _) => "μ_r",
        (_, Some(parameter)) => parameter.symbol(),
        (_, None) => name,
    }
}
