//! What is known of the shared unknowns of a film before its frames are seen.
//!
//! Every quantity that the data set does not state exactly is an unknown with a prior: the largest
//! errors of real films are not noise. The widths were chosen by Cramér–Rao bounds of ten kinds of
//! film and 2 000 fits of an independent simulator.

use super::spins::{ShotSpin, TOPSPIN_SPREAD};
use crate::measurement::correction::Correction;
use crate::measurement::dataset::{Dataset, Measured, Tracks};
use crate::measurement::parameter::{Compliance, Parameter, Settings};
use crate::problem::sums::OwnPrior;
use crate::problem::unknowns::{Id, Mode, Normal, Unknown};

/// Relative standard deviation of a stated radius of balls: new ones differ by 0.05 mm from their
/// nominal size.
const RADIUS_SD: f64 = 0.05 / 28.575;

/// Relative standard deviation of a frame rate that is stated without an error. With 0.005, films
/// of 15 shots whose rate was 10 % off had e 3.2 errors off without a conflict; 0.02 costs e a tenth
/// of its error.
pub(super) const RATE_SD: f64 = 0.02;

/// Standard deviation of the aspect of a film whose scale is that of its balls, which a phone may
/// take at a slant: cos 45° is 0.71.
const SLANTED_ASPECT_SD: f64 = 0.3;

/// Standard deviation of the slope of a table, 1 mm/m.
const TILT_SD: f64 = 1e-3;

/// Standard deviation of the mean topspin of shots stated as natural roll, over natural roll…
const ROLL_SD: f64 = 0.01;
/// …of shots stated as stun…
const STUN_SD: f64 = 0.02;
/// …and of shots of unknown spin that slide.
const UNKNOWN_SD: f64 = 1.0;

/// What is known of μ_s in films of unknown spin, which hardly determine it (Kim 2024: 0.2 to 0.4).
const UNKNOWN_MU_S: Normal = Normal { mean: 0.3, sd: 0.1 };

/// Returns every shared unknown in the order of [`Id`].
pub(super) fn list_unknowns(
    dataset: &Dataset,
    settings: &Settings,
    tracks: &Tracks,
    spins: &[ShotSpin],
) -> Vec<Unknown> {
    let mut all = Unknown::list();
    list_contact(&mut all, settings);
    let masses = &mut all[Id::MassRatio as usize];
    if masses.mode == Mode::Fixed {
        masses.mode = Mode::Tested;
    }
    list_cloth(&mut all, dataset, tracks);
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
        // where a search begins does not depend on what is stated
        let is_stated = parameter.is_of_balls() || !is_free;
        let start = if is_stated { setting.initial } else { parameter.default_setting().initial };
        let unknown = &mut all[Id::from(parameter) as usize];
        unknown.start = start.clamp(setting.lower, setting.upper);
        unknown.bounds = [setting.lower, setting.upper];
        unknown.prior = setting.prior.map(|prior| Normal { mean: prior.mean, sd: prior.sd });
        unknown.mode = if is_free { Mode::Free } else { Mode::Fixed };
    }
    if !settings.falls {
        let fall = &mut all[Id::FallB as usize];
        (fall.start, fall.mode) = (0.0, Mode::Tested);
    }
    if settings.compliance != Compliance::Stated {
        all[Id::Kappa as usize].start = 0.0;
    }
    if !settings.e_falls {
        all[Id::ESlope as usize].start = 0.0;
    }
}

fn list_cloth(all: &mut [Unknown], dataset: &Dataset, tracks: &Tracks) {
    let stated =
        |measured: Option<Measured>| measured.and_then(|measured| Some((measured.value, measured.sd?)));
    let (mean, sd) = stated(dataset.sliding).unwrap_or((0.2, 1.0));
    known(all, Id::MuK, mean, sd);
    all[Id::MuK as usize].bounds = [0.01, 2.0];
    let (mean, sd) = stated(dataset.rolling).unwrap_or((0.01, 0.005));
    known(all, Id::MuR, mean, sd);
    known(all, Id::Bounce, 0.5, 0.2);
    all[Id::Bounce as usize].bounds = [0.05, 0.9];
    known(all, Id::Rate, 1.0, tracks.rate_sd.unwrap_or(RATE_SD));
    all[Id::Rate as usize].bounds = [0.5, 2.0];
    for id in [Id::TiltX, Id::TiltY] {
        known(all, id, 0.0, tracks.tilt_sd.unwrap_or(TILT_SD));
    }
}

pub(crate) fn list_camera(all: &mut [Unknown], tracks: &Tracks) {
    for (id, correction) in [
        (Id::Scale, Correction::Scale),
        (Id::Aspect, Correction::Aspect),
        (Id::Shear, Correction::Shear),
        (Id::PerspectiveX, Correction::PerspectiveX),
        (Id::PerspectiveY, Correction::PerspectiveY),
        (Id::Lens, Correction::Lens),
        (Id::ShutterX, Correction::ShutterX),
        (Id::ShutterY, Correction::ShutterY),
        (Id::ParallaxX, Correction::ParallaxX),
        (Id::ParallaxY, Correction::ParallaxY),
        (Id::Nearness, Correction::Nearness),
    ] {
        match tracks.camera[correction as usize] {
            Some(Measured { value, sd: None }) => all[id as usize].start = value,
            Some(Measured { value, sd: Some(sd) }) => known(all, id, value, sd),
            None => known(all, id, correction.neutral(), correction.usual()),
        }
    }
    let stated = |which: Correction| tracks.camera[which as usize];
    let scale = &mut all[Id::Scale as usize];
    scale.bounds = [0.1, 10.0];
    if stated(Correction::Scale).is_none() {
        scale.prior = tracks.scale_sd.map(|sd| Normal { mean: 1.0, sd: sd.hypot(RADIUS_SD) });
    }
    let aspect = &mut all[Id::Aspect as usize];
    aspect.bounds = [0.1, 10.0];
    if let Some(prior) =
        aspect.prior.as_mut().filter(|_| tracks.from_balls && stated(Correction::Aspect).is_none())
    {
        prior.sd = SLANTED_ASPECT_SD;
    }
    // an axis of the lens at c bends the picture as a decentring of −l c
    let held = |which: Correction| stated(which).filter(|stated| stated.sd.is_none()).map(|held| held.value);
    for (id, correction) in [(Id::LensX, Correction::LensX), (Id::LensY, Correction::LensY)] {
        match (held(Correction::Lens), held(correction)) {
            (Some(lens), Some(axis)) => all[id as usize].start = -lens * axis,
            _ => known(all, id, 0.0, 0.01),
        }
    }
}

fn list_spins(all: &mut [Unknown], settings: &Settings, topspin_sd: Option<f64>, spins: &[ShotSpin]) {
    let (mut rolls, mut stuns, mut unknown, mut presses) = (false, false, false, false);
    for spin in spins {
        rolls |= spin.stated.mean == Some(Id::Roll) && !spin.is_unknown();
        stuns |= spin.topspin == OwnPrior::Spread(TOPSPIN_SPREAD);
        unknown |= spin.is_unknown();
        presses |= spin.stated.mean != Some(Id::Slide);
    }
    all[Id::Roll as usize].start = 1.0;
    if rolls {
        known(all, Id::Roll, 1.0, topspin_sd.unwrap_or(ROLL_SD));
    }
    if unknown {
        known(all, Id::Slide, 0.0, UNKNOWN_SD);
    } else if stuns {
        known(all, Id::Slide, 0.0, topspin_sd.unwrap_or(STUN_SD));
    }
    let mu_s = &mut all[Id::MuS as usize];
    if !presses {
        (mu_s.mode, mu_s.start) = (Mode::Fixed, settings[Parameter::MuS].initial);
    } else if unknown && mu_s.mode == Mode::Free && mu_s.prior.is_none() {
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
