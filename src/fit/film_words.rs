//! Findings of the problem as remarks, and the causes among them.

use minijinja::value::Serde;
use minijinja::{Value as Values, context};

use super::film::FittedFilm;
use super::{Explanation, Remark};
use crate::measurement::spin::Spin;
use crate::problem::{Finding, Id, Solution};

/// Difference of a topspin from the stated one, as a part of natural roll, that counts as another
/// spin.
pub(super) const DIFFERS: f64 = 0.2;

/// Part of the shots that have the same spin, so that one word states it.
const MIN_ALIKE_PART: f64 = 0.75;

/// Returns a finding as a remark, of a table if `film` is `None`; `None` for one that stands
/// elsewhere.
pub(super) fn remark(finding: &Finding, film: Option<&FittedFilm>) -> Option<Remark> {
    let [radius, scale_sd] = film.map_or([f64::NAN, 0.0], |film| [film.radius(), film.scale_sd]);
    let game = match finding {
        Finding::OtherUnit { factor, .. } => game(2.0 * radius / factor),
        Finding::Conflict { id: Id::Scale, estimate, .. } => game(2.0 * radius * estimate),
        _ => None,
    };
    let spins = film.filter(|_| matches!(finding, Finding::Spins { .. })).map(spins);
    let beside = context! { film => film.is_some(), radius, scale_sd, game, spins };
    let values = Values::from(Serde(finding));
    let kind = values.get_attr("kind").unwrap_or_default();
    Remark::new(finding.severity(), kind.as_str().unwrap_or_default(), values, beside)
}

/// Returns a finding as a sentence, of a table if `film` is `None`; `None` for one that stands
/// elsewhere.
pub(crate) fn sentence(finding: &Finding, film: Option<&FittedFilm>) -> Option<String> {
    Some(remark(finding, film)?.sentence)
}

/// Diameters of balls, m, with what they are played at (rules of WPA, UMB, WPBSA and of pyramid).
const DIAMETERS: [(&str, f64); 4] =
    [("pool", 0.057_15), ("carom", 0.0615), ("snooker", 0.0525), ("pyramid", 0.068)];

/// Largest relative difference of a diameter from that of a game: balls wear, and scales are off,
/// by less.
const SAME_DIAMETER: f64 = 0.01;

/// Returns the game whose balls have a diameter, m, and their diameter.
fn game(diameter: f64) -> Option<(&'static str, f64)> {
    DIAMETERS.into_iter().find(|(_, other)| (diameter / other - 1.0).abs() < SAME_DIAMETER)
}

/// Returns how the cue balls spin, if not as stated.
fn spins(film: &FittedFilm) -> Values {
    let stated = |spin: Spin| match spin {
        Spin::Stun => Some(0.0),
        Spin::NaturalRoll => Some(1.0),
        _ => None,
    };
    let tracks = film.tracks().iter().zip(film.solution.topspins());
    let all: Vec<(f64, f64)> =
        tracks.filter_map(|(track, (_, found))| Some((stated(track.spin)?, found))).collect();
    let shots = all.len();
    let near = |spin: f64| all.iter().filter(|(_, found)| (found - spin).abs() < DIFFERS).count();
    let are_most = |count: usize| count as f64 > MIN_ALIKE_PART * shots as f64;
    let (rolling, stun) = (near(1.0), near(0.0));
    let differ = all.iter().any(|(stated, found)| (found - stated).abs() > DIFFERS);
    let found = match differ {
        true if are_most(rolling) => "natural-roll",
        true if are_most(stun) => "stun",
        _ => "unknown",
    };
    let mean = all.iter().map(|(_, found)| found).sum::<f64>() / shots.max(1) as f64;
    context! { shots, rolling, stun, mean, found }
}

/// Returns causes of residuals that the estimates include, the best first.
pub(super) fn explanations(solution: &Solution, film: Option<&FittedFilm>) -> Vec<Explanation> {
    let of = |finding: &Finding| {
        let (cause, estimate, std_error, fall) = match finding {
            Finding::Conflict { id, estimate, sd, size, .. } => (cause_of(*id)?, *estimate, *sd, size * size),
            Finding::Cause { id, estimate, sd, fall } => (cause_of(*id)?, *estimate, *sd, *fall),
            Finding::Spins { fall, topspin, .. } => ("cue-spin", *topspin, f64::NAN, *fall),
            Finding::Compliance { kappa, fall, adopted: true, .. } => {
                let sd = solution.get(Id::Kappa).and_then(|kappa| kappa.std_error);
                ("compliance", *kappa, sd.unwrap_or(f64::NAN), *fall)
            }
            Finding::OtherUnit { factor, stated: true } => ("scale", factor.recip(), f64::NAN, f64::NAN),
            _ => return None,
        };
        Some(Explanation {
            cause,
            estimate,
            std_error,
            delta_2logl: -fall,
            adopted: true,
            sentence: sentence(finding, film).unwrap_or_default(),
        })
    };
    let mut all: Vec<Explanation> = solution.findings.iter().filter_map(of).collect();
    all.sort_by(|a, b| a.delta_2logl.total_cmp(&b.delta_2logl));
    all
}

/// Returns the name in fit.json of an unknown that explains residuals.
fn cause_of(id: Id) -> Option<&'static str> {
    Some(match id {
        Id::Scale | Id::RadiusRatio => "radius",
        Id::Aspect => "aspect",
        Id::Shear => "shear",
        Id::PerspectiveX | Id::PerspectiveY => "perspective",
        Id::Lens | Id::LensX | Id::LensY => "lens",
        Id::ShutterX | Id::ShutterY => "rolling-shutter",
        Id::ParallaxX | Id::ParallaxY | Id::Nearness => "parallax",
        Id::Rate => "frame-rate",
        Id::Roll | Id::Slide => "cue-spin",
        Id::MassRatio => "mass-ratio",
        Id::Kappa => "compliance",
        Id::FallB | Id::FallC => "falling-friction",
        Id::TiltX | Id::TiltY => "tilt",
        _ => return None,
    })
}
