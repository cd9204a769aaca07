//! Findings of a film, in words.

use super::camera::scale_of_balls;
use super::film::FittedFilm;
use super::{About, Explanation, Remark, Scatter};
use crate::measurement::number::{count_of, plain, with_error};
use crate::measurement::spin::Spin;
use crate::problem::{Finding, Id, Severity, Solution};

/// Difference of a topspin from the stated one, as a part of natural roll, that counts as another
/// spin.
pub(super) const DIFFERS: f64 = 0.2;

/// Part of the shots that have the same spin, so that one word states it.
const MIN_ALIKE_PART: f64 = 0.75;

/// Returns a finding as a remark, of a table if `film` is `None`; `None` for one that stands
/// elsewhere.
pub(super) fn remark(finding: &Finding, film: Option<&FittedFilm>) -> Option<Remark> {
    let sentence = sentence(finding, film)?;
    Some(Remark { about: About::Found(finding.clone()), severity: finding.severity(), sentence })
}

/// Returns a finding as a sentence, of a table if `film` is `None`; `None` for one that stands
/// elsewhere.
pub(crate) fn sentence(finding: &Finding, film: Option<&FittedFilm>) -> Option<String> {
    let radius_and_sd = film.map_or([f64::NAN, 0.0], |film| [film.radius(), film.scale_sd]);
    Some(match finding {
        // the list of rejected shots says it
        Finding::LostShots { .. } if film.is_none() => return None,
        Finding::Misfit { ratio, .. } if film.is_none() => format!(
            "No collision of such balls with constant friction describes these shots: χ²/dof is {}, where 1 is expected.",
            plain(*ratio, 3)
        ),
        Finding::OtherUnit { factor, stated: false } => scale_of_balls(*factor),
        Finding::OtherUnit { factor, stated: true } => scale(factor.recip(), radius_and_sd),
        Finding::Playback { fps } => format!(
            "{fps} frames/s is a rate at which films are played: [video] capture_fps is to be what the camera recorded at, in slow \
             motion 120, 240 or more."
        ),
        Finding::Drops { shots, drops } => format!(
            "The camera dropped frames that the frame numbers do not show ({drops} times, in {}): the frames after them were moved \
             in time.",
            count_of(*shots, "shot")
        ),
        Finding::Corners { shots, of } => format!(
            "In {shots} of {of} shots the path of the cue ball has a corner before the impact, as where it is struck, or comes off \
             a cushion: its frames up to there are left out."
        ),
        Finding::Ends { shots, of } => format!(
            "In {shots} of {of} shots a ball comes off a cushion or another ball after the impact: its frames from there on are left out."
        ),
        Finding::NoiseLasts { rho, sd } => format!(
            "Neighbouring frames have errors that are correlated by {}; the errors of the estimates include it.",
            with_error(*rho, *sd)
        ),
        Finding::NoiseRefuted { times } => format!(
            "Neighbouring frames scatter by {times:.1} times the stated noise (position_sd_m, or the columns of standard \
             deviations): {}.",
            if *times < 1.0 { "the errors are too large" } else { "what they scatter by was taken in its place" }
        ),
        Finding::Spoiled { before, after } if finding.severity() == Severity::Note => format!(
            "Next to the impacts the positions are off in all shots, as where balls hide each other or an exposure lasts: {} \
             before and {after} after were left out.",
            count_of(*before, "frame")
        ),
        Finding::Lags | Finding::Spoiled { .. } => {
            "Both balls are off their paths in the first frames after the impacts, and not before: the tracker lags, as one \
             does that smooths or predicts positions; export them as they were measured."
                .to_owned()
        }
        Finding::Compliance { kappa, shots, fall, adopted } => effect(
            &format!(
                "A contact between the balls that is compliant along its surface (κ = {}, as follows from Poisson's ratio; kappa = {{ fixed \
                 = 0 }} under [fit] takes a rigid one)",
                plain(*kappa, 4)
            ),
            (*shots, *fall, *adopted),
        ),
        Finding::Weight { shots, fall, adopted } => effect(
            "What the balls' weight and the cloth do during the impact (--fidelity contact)",
            (*shots, *fall, *adopted),
        ),
        Finding::Conflict { id, stated, estimate, sd, size } => {
            conflict(*id, [*stated, *estimate, *sd, *size], radius_and_sd)
        }
        Finding::Cause { id, estimate, sd, fall } => {
            let (name, note) = match id {
                Id::FallB => (
                    "The decrease, from slow to fast, of friction between the balls that decreases with their slip",
                    ": μ is its limit for fast slips. --falling fit takes it",
                ),
                id => (id.name(), ""),
            };
            let found = with_error(*estimate, *sd);
            format!(
                "{name} = {found} explains residuals (−2 log L lower by {fall:.0}), and is in the estimates{note}."
            )
        }
        Finding::Spins { fall, .. } => spins(film?, *fall),
        Finding::Misfit { ratio, refutes } => {
            let so_that = if *refutes {
                "no collision of such balls describes these shots, and the estimates are meaningless"
            } else {
                "the model leaves something out, or the frames are worse than they seem"
            };
            format!(
                "The frames scatter about the paths by {} times their noise: {so_that}. Check the radius, capture_fps, which track \
                 is which ball, whether the tracks were smoothed, and how the cue balls spin.",
                plain(ratio.sqrt(), 2)
            )
        }
        Finding::LostShots { names } => format!(
            "Left out, since no collision like that of the others describes them: {}, the first {}.",
            count_of(names.len(), "shot"),
            names.first()?
        ),
        // the fit and the statuses of its estimates say it
        Finding::NotConverged | Finding::Undetermined { .. } | Finding::AtBound { .. } => return None,
    })
}

/// Returns on how many shots an effect acts, the decrease of −2 log L with it, and whether it was
/// adopted.
fn effect(what: &str, (shots, fall, adopted): (usize, f64, bool)) -> String {
    let (way, size) = if fall < 0.0 { ("higher", -fall) } else { ("lower", fall) };
    format!(
        "{what} acts on {}: {} (−2 log L {way} by {size:.1} with it).",
        count_of(shots, "shot"),
        if adopted { "the estimates include it" } else { "the shots do not decide, and it is left out" }
    )
}

/// Diameters of balls, m, with what they are played at (rules of WPA, UMB, WPBSA and of pyramid).
const DIAMETERS: [(&str, f64); 4] =
    [("pool", 0.057_15), ("carom", 0.0615), ("snooker", 0.0525), ("pyramid", 0.068)];

/// Largest relative difference of a diameter from that of a game: balls wear, and scales are off,
/// by less.
const SAME_DIAMETER: f64 = 0.01;

/// Returns that balls of a radius appear `factor` times as large as stated, with the relative
/// standard deviation of the stated scale.
fn scale(factor: f64, [radius, sd]: [f64; 2]) -> String {
    let diameter = 2.0 * radius * factor;
    let game = DIAMETERS.iter().find(|(_, other)| (diameter / other - 1.0).abs() < SAME_DIAMETER);
    let game = game.map_or(String::new(), |(game, other)| {
        format!(" ({}/{}: {game} balls?)", plain(1e3 * other, 4), plain(2e3 * radius, 4))
    });
    format!(
        "The balls are {} % {} than stated{game}, where {} % is expected: either the radius (radius_m of [ball]) or the scale of the \
         film ([scale]) is wrong, which the frames cannot distinguish. A scale that is known worse takes its relative standard \
         deviation as sd under [scale].",
        plain(100.0 * (factor - 1.0).abs(), 2),
        if factor > 1.0 { "larger" } else { "smaller" },
        plain(100.0 * sd, 2)
    )
}

/// Returns what a fit without a prior says of a quantity: stated value, estimate, error, and the
/// difference in standard deviations.
fn conflict(id: Id, [stated, estimate, sd, size]: [f64; 4], radius_and_sd: [f64; 2]) -> String {
    let (name, unit, advice) = match id {
        Id::Scale => return scale(estimate, radius_and_sd),
        Id::MassRatio => {
            return format!(
                "The shots show a cue ball {} % {} than the object ball, where {} is stated or typical: weigh both; mass_kg under [ball] \
                 and [object] takes it.",
                with_error(100.0 * (estimate - 1.0).abs(), 100.0 * sd),
                if estimate > 1.0 { "heavier" } else { "lighter" },
                plain(stated, 4)
            );
        }
        Id::TiltX | Id::TiltY => {
            return format!(
                "The table falls by {} mm/m along {} of the film: level it, unless the nap of the cloth does it.",
                with_error(1e3 * estimate, 1e3 * sd),
                if id == Id::TiltX { "x" } else { "y" }
            );
        }
        Id::Rate => (
            "a frame rate",
            " times the stated one",
            "check [video] capture_fps, which is what the camera recorded at, not what it is played at",
        ),
        Id::RadiusRatio => (
            "a radius of the cue ball",
            " times the object ball's",
            "measure both; radius_m under [ball] and [object] takes it",
        ),
        Id::Roll | Id::Slide => (
            if id == Id::Roll {
                "a topspin of cue balls that are stated to roll"
            } else {
                "a topspin of stun shots"
            },
            " of natural roll",
            "[cue_spin] assume = \"unknown\" lets every shot determine its own spin",
        ),
        Id::MuK => (
            "a sliding friction of the cloth",
            "",
            "the spin of the cue balls, the scale or the times may not be as stated",
        ),
        Id::MuR => (
            "a rolling resistance of the cloth",
            "",
            "cue balls that are said to roll may slide (cue_spin), or the times or the scale of the film are wrong",
        ),
        other => (other.name(), "", "check what is stated of the camera and the cloth"),
    };
    format!(
        "The frames show {name} of {}{unit}, where {} is stated or typical ({} standard deviations off): {advice}.",
        with_error(estimate, sd),
        plain(stated, 4),
        plain(size.abs(), 2)
    )
}

/// Returns how the cue balls spin, if not as stated.
fn spins(film: &FittedFilm, fall: f64) -> String {
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
    let (were, assume) = if differ && are_most(rolling) {
        (format!("{rolling} of {shots} roll naturally"), "natural-roll")
    } else if differ && are_most(stun) {
        (format!("{stun} of {shots} have next to no topspin"), "stun")
    } else {
        let mean = all.iter().map(|(_, found)| found).sum::<f64>() / shots.max(1) as f64;
        (format!("on average their topspin is {mean:.2} of natural roll"), "unknown")
    };
    format!(
        "The cue balls do not spin as stated: {were}, which explains the residuals (−2 log L lower by {fall:.0}); the estimates have \
         it. [cue_spin] assume = \"{assume}\" states it."
    )
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

/// Returns what shots of discs scatter by.
pub(crate) fn scatter(found: &Scatter) -> String {
    let of_ratio = if found.impulse_ratio > 0.0 {
        format!(" and {} in J_t/J_n", plain(found.impulse_ratio, 2))
    } else {
        String::new()
    };
    format!(
        "beyond the errors of their frames shots scatter by {} in e{of_ratio}, which the errors include",
        plain(found.restitution, 2)
    )
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
