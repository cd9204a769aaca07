//! A [`Fit`] → what people and programs read of it. What people read is made once, as a value ([`content`]), and walked by
//! [`text`] and [`html`]; programs read [`document`] and [`csv`]. All are pure: a fit goes in, text or bytes come out. Only
//! [`write`](mod@write) touches the disk.

pub mod accuracy;
mod aligned;
pub mod compare;
pub mod compare_words;
pub mod content;
pub mod csv;
pub mod design;
mod disc_section;
pub mod discs;
pub mod document;
pub mod export;
pub mod extracted;
pub mod fit;
pub mod frame_table;
pub mod html;
pub mod overview;
mod plot;
pub mod regression;
pub mod shot_table;
mod shots;
pub mod table;
pub mod text;
mod trust;
pub mod write;

use std::path::PathBuf;

pub use plot::{WIDTH, residuals};
pub use write::{fit_folder, folder_name, group_folders, write};

use crate::fit::Fit;
use crate::measurement::dataset::ObjectBall;
use crate::measurement::number;
pub use crate::measurement::number::count_of;
use crate::measurement::observable::Observable;
use crate::measurement::parameter::Parameter;
use crate::physics::ball::Ball;

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
    /// A result cannot be written as JSON.
    #[error("the result cannot be written as JSON: {0}")]
    Json(#[from] serde_json::Error),
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

/// The label that was fitted apart; empty of a whole data set.
fn label(fit: &Fit) -> String {
    fit.group.as_ref().map_or_else(String::new, |(_, label)| label.clone())
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
    let Some(discs) = fit.discs else { return ("balls", two_balls(&fit.ball, fit.object.as_ref())) };
    let milli = |value: f64, digits: usize| number::plain(1e3 * value, digits);
    let radii = match discs.radii {
        Some([first, second]) => format!("radii {} and {} mm", milli(first, 5), milli(second, 5)),
        None => format!(
            "radii not stated ({} mm is half the distance of the centres at the impact)",
            milli(fit.ball.radius, 5)
        ),
    };
    let masses = match discs.masses {
        Some([first, second]) => format!("masses {} and {} g", milli(first, 4), milli(second, 4)),
        None => "masses not stated".to_owned(),
    };
    ("discs", format!("{radii}, {masses}"))
}

/// Both balls in words, with the errors of what is stated of them.
fn two_balls(cue: &Ball, object: Option<&ObjectBall>) -> String {
    let with_error = |value: f64, sd: f64, digits: usize| match sd {
        sd if sd > 0.0 => number::with_error(1e3 * value, 1e3 * sd),
        _ => number::plain(1e3 * value, digits),
    };
    let one = |ball: &Ball, mass_sd: f64, radius_sd: f64| {
        let (radius, mass) = (with_error(ball.radius, radius_sd, 5), with_error(ball.mass, mass_sd, 4));
        format!("radius {radius} mm, mass {mass} g")
    };
    let Some(object) = object else { return one(cue, 0.0, 0.0) };
    let [cue, object] = [0, 1].map(|which| {
        let (name, ball) = [("cue ball", cue), ("object ball", &object.ball)][which];
        let both = one(ball, object.mass_sd.unwrap_or_default()[which], object.radius_sd[which]);
        let differs = cue.inertia != object.ball.inertia;
        let inertia = differs.then(|| format!(", inertia {} MR²", number::plain(ball.inertia, 4)));
        format!("{name}: {both}{}", inertia.unwrap_or_default())
    });
    format!("{cue}; {object}")
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

/// Returns the symbol of an unknown, by its name; without one the name in words.
fn symbol(name: &str) -> String {
    let parameter = Parameter::ALL.into_iter().find(|parameter| parameter.name() == name);
    match (parameter, name) {
        (Some(parameter), _) => parameter.symbol().to_owned(),
        (None, "mu_k") => "μ_k".to_owned(),
        (None, "mu_r") => "μ_r".to_owned(),
        (None, other) => other.replace('_', " "),
    }
}
