//! Remarks on a fit or a comparison in words: findings of its problem, the causes among them, and
//! notes.

use std::sync::LazyLock;

use minijinja::value::Serde;
use minijinja::{Value as Values, context};

use super::film::FittedFilm;
use super::{Explanation, Fit};
use crate::film::frame_noise::constant_axis;
use crate::measurement::dataset::Measured;
use crate::measurement::spin::Spin;
use crate::measurement::track::TrackShot;
use crate::numerics::median;
use crate::physics::ball::Ball;
use crate::problem::{DiscImpact, Finding, Id, POLICY, Severity, Solution};
use crate::words::Sentences;

/// The words of every remark, by its kind.
static WORDS: LazyLock<Sentences> = LazyLock::new(|| Sentences::of(include_str!("words.jinja")));

/// Something to know of a fit or a comparison: a finding of its problem, or what follows from its
/// results.
#[derive(Clone, Debug)]
pub(crate) struct Remark {
    /// How far it affects the trust in the fit.
    pub(crate) severity: Severity,
    pub(crate) kind: String,
    /// Its numbers, with some that only its words need as `beside`.
    pub(crate) values: Values,
    pub(crate) sentence: String,
}

impl Remark {
    /// Returns a remark with its numbers. The name is its kind, or its kind and behind `/` that of
    /// its words. What stands elsewhere has no words.
    pub(crate) fn new(severity: Severity, name: &str, values: Values) -> Self {
        let (kind, of_words) = name.split_once('/').unwrap_or((name, name));
        let words = context! { kind => of_words, severity => Serde(severity), ..values.clone() };
        Self { severity, kind: kind.to_owned(), sentence: WORDS.sentence(words), values }
    }
}

/// Returns the sentences of remarks of some severities.
pub(crate) fn sentences(remarks: &[Remark], wanted: impl Fn(Severity) -> bool) -> Vec<&str> {
    let wanted = remarks.iter().filter(|remark| wanted(remark.severity));
    wanted.map(|remark| remark.sentence.as_str()).collect()
}

/// Returns a note.
pub(crate) fn note(name: &str, values: Values) -> Remark {
    Remark::new(Severity::Note, name, values)
}

/// Returns a doubt.
pub(crate) fn doubt(name: &str, values: Values) -> Remark {
    Remark::new(Severity::Doubtful, name, values)
}

/// Returns the words of a remark alone.
pub(crate) fn words_of(name: &str, values: Values) -> String {
    note(name, values).sentence
}

/// Difference of a topspin from the stated one, over natural roll, that counts as another spin;
/// half of it is next to no topspin.
pub(super) const DIFFERS: f64 = 0.2;

/// Returns a finding as a remark, of a table if `film` is `None`.
pub(super) fn remark(finding: &Finding, film: Option<&FittedFilm>) -> Remark {
    let [radius, scale_sd] = film.map_or([f64::NAN, 0.0], |film| [film.solution.radius(), film.scale_sd]);
    let spins = film.filter(|_| matches!(finding, Finding::Spins { .. })).map(spins);
    let (games, same_radius) = (Ball::GAMES.to_vec(), SAME_RADIUS);
    let beside = context! { film => film.is_some(), radius, scale_sd, games, same_radius, spins };
    let values = Values::from(Serde(finding));
    let kind = values.get_attr("kind").unwrap_or_default();
    let with_beside = context! { beside, ..values.clone() };
    // with the numbers in their order
    Remark { values, ..Remark::new(finding.severity(), kind.as_str().unwrap_or_default(), with_beside) }
}

/// Returns the sentence of a finding; `None` if it stands elsewhere.
pub(crate) fn sentence(finding: &Finding, film: Option<&FittedFilm>) -> Option<String> {
    Some(remark(finding, film).sentence).filter(|sentence| !sentence.is_empty())
}

/// Largest relative difference of a radius from that of a game, by wear and scale.
const SAME_RADIUS: f64 = 0.01;

/// Returns how the cue balls spin, if not as stated.
fn spins(film: &FittedFilm) -> Values {
    let stated = |spin: Spin| match spin {
        Spin::Stun => Some(0.0),
        Spin::NaturalRoll => Some(1.0),
        _ => None,
    };
    let tracks = film.tracks.iter().zip(film.solution.topspins());
    let all: Vec<(f64, f64)> =
        tracks.filter_map(|(track, found)| Some((stated(track.spin)?, found))).collect();
    let shots = all.len();
    let near = |spin: f64| all.iter().filter(|(_, found)| (found - spin).abs() < DIFFERS).count();
    let are_most = |count: usize| POLICY.are_most(count, shots);
    let (rolling, stun) = (near(1.0), near(0.0));
    let most = all.iter().map(|(stated, found)| (found - stated).abs()).fold(0.0, f64::max);
    let word = match most > DIFFERS {
        true if are_most(rolling) => "natural-roll",
        true if are_most(stun) => "stun",
        _ => "unknown",
    };
    let mean = all.iter().map(|(_, found)| found).sum::<f64>() / shots.max(1) as f64;
    context! { shots, rolling, stun, mean, most, found => word }
}

impl Fit {
    /// Returns causes of residuals that the estimates include, the best first.
    pub(crate) fn explanations(&self) -> Vec<Explanation> {
        let solution = &self.solution;
        let cause_of = |id: Id| Some(id.cause()).filter(|cause| !cause.is_empty());
        let explain = |finding: &Finding| {
            let (cause, estimate, std_error, fall) = match finding {
                Finding::Conflict { id, estimate, sd, size, .. } => {
                    (cause_of(*id)?, *estimate, *sd, size * size)
                }
                Finding::Cause { id, estimate, sd, fall } => (cause_of(*id)?, *estimate, *sd, *fall),
                Finding::Spins { fall } => ("cue-spin", median(solution.topspins()), f64::NAN, *fall),
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
                sentence: remark(finding, self.frames.as_ref()).sentence,
            })
        };
        let mut all: Vec<Explanation> = solution.record.findings.iter().filter_map(explain).collect();
        all.sort_by(|a, b| a.delta_2logl.total_cmp(&b.delta_2logl));
        all
    }
}

/// Returns what the frames of a film of balls show besides the parameters.
pub(super) fn of_film(film: &FittedFilm) -> Vec<Remark> {
    let rate = film.solution.get(Id::Rate).and_then(|found| {
        let (rate, sd, prior_sd) = (found.value, found.std_error?, found.prior?.sd);
        Some(note("measured/frame-rate", context! { rate, sd, prior_sd }))
    });
    unknown_spins(film).into_iter().chain(rate).collect()
}

/// Returns what cue balls of unknown spin were found to do, if there are any.
pub(super) fn unknown_spins(film: &FittedFilm) -> Option<Remark> {
    let is_unknown = |track: &TrackShot| track.spin == Spin::Unknown && track.markers.is_empty();
    let shots = film.tracks.iter().zip(film.solution.topspins());
    let unknown: Vec<f64> = shots.filter(|(track, _)| is_unknown(track)).map(|(_, found)| found).collect();
    let rolling = unknown.iter().filter(|topspin| **topspin == 1.0).count();
    let stun = unknown.iter().filter(|topspin| topspin.abs() < 0.5 * DIFFERS).count();
    let balls = Some(unknown.len()).filter(|balls| *balls > 0)?;
    Some(note("measured/unknown-spins", context! { balls, rolling, stun }))
}

/// Returns how the discs slow down, if it was estimated.
pub(super) fn slowing(solution: &Solution) -> Option<Remark> {
    let Measured { value: slowing, sd } = solution.measured(Id::Slowing)?;
    Some(note("measured/slowing", context! { slowing, sd }))
}

/// Returns a note on some of all shots; `None` if these are none.
pub(super) fn of_shots(name: &str, shots: usize, of: usize) -> Option<Remark> {
    (shots > 0).then(|| note(name, context! { shots, of }))
}

/// Returns what was found on the way to the impacts of discs.
pub(super) fn of_discs(solution: &Solution, shots: &[(TrackShot, DiscImpact)]) -> Vec<Remark> {
    let of = shots.len();
    let touching = shots.iter().filter(|(_, impact)| impact.touches).count();
    let missing = shots.iter().filter(|(track, impact)| misses_frames(track, impact)).count();
    let flat = shots.iter().filter(|(track, _)| constant_axis(track).is_some()).count();
    let all = [
        slowing(solution),
        of_shots("measured/touching", touching, of),
        of_shots("measured/missing-frames", missing, of),
        of_shots("measured/one-dimension", flat, of),
    ];
    all.into_iter().flatten().collect()
}

/// Returns whether frames about an impact are missing.
fn misses_frames(track: &TrackShot, impact: &DiscImpact) -> bool {
    let Some(time) = impact.get("impact_time_s") else { return false };
    [&track.cue, &track.object].into_iter().any(|samples| {
        let after = samples.partition_point(|sample| sample.t < time.value);
        let before = after.checked_sub(1).and_then(|i| samples.get(i));
        before.zip(samples.get(after)).is_some_and(|(a, b)| ((b.t - a.t) * track.fps).round() > 2.0)
    })
}
