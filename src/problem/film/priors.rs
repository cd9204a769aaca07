//! The priors of the shared unknowns of a film.
//!
//! Every quantity that the data set does not state exactly is an unknown with a prior: the largest
//! errors of real films are not noise. The widths were chosen by Cramér–Rao bounds of ten kinds of
//! film and 2 000 fits of an independent simulator.

use super::spins::{ROLL_SD, ShotSpin};
use crate::measurement::correction::Correction;
use crate::measurement::dataset::{Measured, Tracks};
use crate::measurement::parameter::{Compliance, Parameter, Settings};
use crate::problem::unknowns::{Id, Mode, Normal, Unknown};

/// Relative standard deviation of a stated radius of balls: new ones differ by 0.05 mm from their
/// nominal size.
const RADIUS_SD: f64 = 0.05 / 28.575;

/// Relative standard deviation of a frame rate that is stated without an error, while causes of
/// residuals are looked for.
pub(super) const RATE_SD: f64 = 0.02;

/// Standard deviation of the aspect of a film whose scale is that of its balls, which a phone may
/// take at a slant: cos 45° is 0.71.
const SLANTED_ASPECT_SD: f64 = 0.3;

/// The approach of balls that touch, over that of a contact which lasts 280 µs at 1 m/s: 1 of real
/// ones, 0 of those of programs without one.
const APPROACH: [f64; 2] = [0.5, 0.5];

/// Standard deviation of the slope of a table, 1 mm/m.
const TILT_SD: f64 = 1e-3;

/// Standard deviations of the mean topspin over natural roll: of shots stated as stun, and of shots
/// of unknown spin that slide.
const STUN_SD: f64 = 0.02;
const UNKNOWN_SD: f64 = 1.0;

/// The prior of μ_s in films of unknown spin, which determine it weakly (Kim 2024: 0.2 to 0.4).
const UNKNOWN_MU_S: Normal = Normal { mean: 0.3, sd: 0.1 };

/// Returns every shared unknown in the order of [`Id`].
pub(super) fn list_unknowns(settings: &Settings, tracks: &Tracks, spins: &[ShotSpin]) -> Vec<Unknown> {
    let mut all = Unknown::list();
    list_contact(&mut all, settings);
    let masses = &mut all[Id::MassRatio as usize];
    if masses.mode == Mode::Fixed {
        masses.mode = Mode::Tested;
    }
    list_cloth(&mut all, tracks);
    list_camera(&mut all, tracks);
    list_spins(&mut all, settings, tracks.topspin_sd, spins);
    all
}

/// Makes an unknown free with a prior that it starts from.
pub(in crate::problem) fn known(all: &mut [Unknown], id: Id, mean: f64, sd: f64) {
    let unknown = &mut all[id as usize];
    (unknown.start, unknown.prior, unknown.mode) = (mean, Some(Normal { mean, sd }), Mode::Free);
}

/// Sets what is stated of the contact.
pub(in crate::problem) fn list_contact(all: &mut [Unknown], settings: &Settings) {
    for parameter in Parameter::ALL {
        let setting = &settings[parameter];
        let is_free = settings.has(parameter) && !setting.fixed;
        // the start of a search does not depend on what is stated
        let is_stated = parameter.is_of_balls() || !is_free;
        let start = if is_stated { setting.initial } else { parameter.default_setting().initial };
        let unknown = &mut all[Id::from(parameter) as usize];
        unknown.start = start.clamp(setting.lower, setting.upper);
        unknown.bounds = [setting.lower, setting.upper];
        unknown.prior = setting.prior.map(|prior| Normal { mean: prior.mean, sd: prior.sd });
        unknown.mode = if is_free { Mode::Free } else { Mode::Fixed };
    }
    let falling = [(Id::FallB, settings.falls), (Id::ESlope, settings.e_falls)];
    for (id, _) in falling.into_iter().filter(|(_, falls)| !falls) {
        (all[id as usize].start, all[id as usize].mode) = (0.0, Mode::Tested);
    }
    if settings.compliance != Compliance::Stated {
        all[Id::Kappa as usize].start = 0.0;
    }
}

fn list_cloth(all: &mut [Unknown], tracks: &Tracks) {
    let tilt = [0.0, tracks.tilt_sd.unwrap_or(TILT_SD)];
    let unbounded = [f64::NEG_INFINITY, f64::INFINITY];
    for (id, [mean, sd], bounds) in [
        (Id::MuK, [0.2, 1.0], [0.01, 2.0]),
        (Id::MuR, [0.01, 0.005], unbounded),
        (Id::Bounce, [0.5, 0.2], [0.05, 0.9]),
        (Id::Rate, [1.0, tracks.rate_sd.unwrap_or(RATE_SD)], [0.5, 2.0]),
        (Id::Approach, APPROACH, unbounded),
        (Id::TiltX, tilt, unbounded),
        (Id::TiltY, tilt, unbounded),
    ] {
        known(all, id, mean, sd);
        all[id as usize].bounds = bounds;
    }
}

pub(crate) fn list_camera(all: &mut [Unknown], tracks: &Tracks) {
    let stated = |which: Correction| tracks.camera[which as usize];
    // both lists have the same order
    for correction in Correction::ALL {
        let id = Id::ALL[Id::Scale as usize + correction as usize];
        match stated(correction) {
            Some(Measured { value, sd: None }) => all[id as usize].start = value,
            Some(Measured { value, sd: Some(sd) }) => known(all, id, value, sd),
            None => known(all, id, correction.neutral(), correction.usual()),
        }
    }
    for id in [Id::Scale, Id::Aspect] {
        all[id as usize].bounds = [0.1, 10.0];
    }
    if stated(Correction::Scale).is_none() {
        let prior = tracks.scale_sd.map(|sd| Normal { mean: 1.0, sd: sd.hypot(RADIUS_SD) });
        all[Id::Scale as usize].prior = prior;
    }
    if tracks.from_balls && stated(Correction::Aspect).is_none() {
        known(all, Id::Aspect, 1.0, SLANTED_ASPECT_SD);
    }
    // an axis of the lens at c bends the picture as a decentring of −l c
    let held = |which: Correction| stated(which).filter(|stated| stated.sd.is_none()).map(|held| held.value);
    for (id, correction) in [(Id::LensX, Correction::LensX), (Id::LensY, Correction::LensY)] {
        match (held(Correction::Lens), held(correction)) {
            (Some(lens), Some(axis)) => {
                let unknown = &mut all[id as usize];
                (unknown.start, unknown.prior, unknown.mode) = (-lens * axis, None, Mode::Fixed);
            }
            _ => known(all, id, 0.0, 0.01),
        }
    }
}

fn list_spins(all: &mut [Unknown], settings: &Settings, topspin_sd: Option<f64>, spins: &[ShotSpin]) {
    let rolls = spins.iter().any(|spin| spin.is_stated(Id::Roll));
    let slides = spins.iter().any(|spin| spin.is_stated(Id::Slide));
    let is_unknown = spins.iter().any(ShotSpin::is_unknown);
    let presses = spins.iter().any(|spin| spin.mean != Some(Id::Slide));
    all[Id::Roll as usize].start = 1.0;
    if rolls {
        known(all, Id::Roll, 1.0, topspin_sd.unwrap_or(ROLL_SD));
    }
    if is_unknown {
        known(all, Id::Slide, 0.0, UNKNOWN_SD);
    } else if slides {
        known(all, Id::Slide, 0.0, topspin_sd.unwrap_or(STUN_SD));
    }
    let mu_s = &mut all[Id::MuS as usize];
    if !presses {
        (mu_s.mode, mu_s.start) = (Mode::Fixed, settings[Parameter::MuS].initial);
    } else if is_unknown && mu_s.mode == Mode::Free && mu_s.prior.is_none() {
        mu_s.prior = Some(UNKNOWN_MU_S);
    }
}

/// Returns the unknowns of a film whose spins are not as stated.
pub(super) fn of_unknown_spins(unknowns: &[Unknown]) -> Vec<Unknown> {
    let mut all = unknowns.to_vec();
    known(&mut all, Id::Slide, 0.0, UNKNOWN_SD);
    let roll = &mut all[Id::Roll as usize];
    (roll.start, roll.prior, roll.mode) = (1.0, None, Mode::Fixed);
    let mu_s = &mut all[Id::MuS as usize];
    mu_s.start = UNKNOWN_MU_S.mean;
    if mu_s.prior.is_none() {
        (mu_s.mode, mu_s.prior) = (Mode::Free, Some(UNKNOWN_MU_S));
    }
    all
}
