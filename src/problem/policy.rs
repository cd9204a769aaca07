//! The choices of a fit, those of statistics all with their reasons.

use crate::measurement::dataset::Dataset;
use crate::measurement::loss::Loss;
use crate::physics::collision::{Fidelity, Model};

/// Decrease of χ² below which a step is not made: 0.1 standard deviations; and if other descents
/// follow, or are compared: 0.3.
pub(super) const STALL: f64 = 0.01;
pub(super) const ROUGH: f64 = 0.1;

/// Steps of descents whose ends are compared.
pub(super) const COMPARED_STEPS: usize = 12;

/// Choices of a fit that its data set does not state.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Choices {
    /// How closely collisions are computed; `None`: in closed form, with the effects beyond it that
    /// the data show.
    pub(crate) fidelity: Option<Fidelity>,
    /// Tolerance of fidelities that integrate; `None`: the usual one.
    pub(crate) tolerance: Option<f64>,
    /// How outlying shots count; `None`: as the data set states.
    pub(crate) loss: Option<Loss>,
    /// Whether intervals of profiles are left out.
    pub(crate) without_profiles: bool,
}

impl Choices {
    /// Returns the model of the collisions of a data set.
    pub(crate) fn model(&self, dataset: &Dataset) -> Model {
        let model = dataset.model(self.fidelity.unwrap_or(Fidelity::Full));
        Model { tolerance: self.tolerance.unwrap_or(model.tolerance), ..model }
    }
}

/// Statistical choices.
pub(crate) struct Policy {
    /// Tail probability of a frame, or of a run of frames at the end of a track, that is left out.
    /// One good frame in a million is lost.
    pub(crate) frame_tail: f64,
    /// Tail probability of a shot that is left out.
    pub(crate) shot_tail: f64,
    /// Largest part of the shots that may be left out: beyond, the model is wrong and not the
    /// shots.
    pub(crate) max_lost: f64,
    /// Size of a conflict between a prior and the frames, in standard deviations, that makes a fit
    /// doubtful: level 1 % of a family of a dozen (Holm 1979).
    pub(crate) conflict: f64,
    /// Relative standard deviation of a frame rate that is stated without an error. With it five of
    /// 154 films of 15 shots at 240 frames/s whose rate was 8 to 11 % off were called good with e more
    /// than three errors off (at most 3.6); with 0.02, and 0.05 after a conflict, 12 were (at most
    /// 3.9). The error of e grows by 8 to 15 % in films whose rate is right, by 1 % at 1000 frames/s.
    pub(crate) rate_sd: f64,
    /// Decrease of −2 log L that names a cause: likelihood ratio e⁵, level 1 % of a family of a
    /// dozen with one unknown each.
    pub(crate) cause: f64,
    /// Decrease of −2 log L that adopts an effect beyond the equations that define the parameters:
    /// odds of 20 to 1.
    pub(crate) adopt: f64,
    /// Variance of slow motions over that of the noise before the impacts, beyond which the model
    /// does not describe the paths.
    pub(crate) misfit: f64,
    /// Ratio of the variances of `misfit` beyond which the model does not describe the paths at
    /// all: residuals of five times the noise.
    pub(crate) refuted: f64,
    /// χ² per degree of freedom of a table beyond which the model does not describe it at all:
    /// residuals of more than twice the stated noise, which is stated too small by half at most.
    pub(crate) refuted_rows: f64,
    /// Standard deviation of side spins Rω_z/U that nobody stated, beyond which a fit is doubtful.
    /// Shots at the middle of the ball have at most 0.06; films of balls whose friction differs
    /// from shot to shot, of which side spins took it up, had 0.1 to 0.3, and μ far off.
    pub(crate) side_spins: f64,
    /// Standard deviation of topspins about the stated ones, over natural roll, beyond which a fit is
    /// doubtful: 20 films of stun and 20 of measured spins have less, others more
    /// (`tests/reference/studies.md`).
    pub(crate) topspins: f64,
    /// Level of a test of several differences or trends (Holm 1979).
    pub(crate) level: f64,
    /// Probability of a χ² at either end, of a trend, or of a difference between the noises of
    /// columns, below which model or noise are other than assumed.
    pub(crate) improbable: f64,
    /// Standard error of μ_s beyond which it is not identified: the published range is 0.2 to 0.4
    /// (Kim 2024).
    pub(crate) undetermined_mu_s: f64,
}

/// The statistical choices.
pub(crate) const POLICY: Policy = Policy {
    frame_tail: 1e-6,
    shot_tail: 1e-6,
    max_lost: 0.34,
    conflict: 3.3,
    rate_sd: 0.04,
    cause: 10.0,
    adopt: 6.0,
    misfit: 2.0,
    refuted: 25.0,
    refuted_rows: 5.0,
    side_spins: 0.1,
    topspins: 0.2,
    level: 0.05,
    improbable: 0.001,
    undetermined_mu_s: 0.15,
};

impl Policy {
    /// Returns whether a part of the shots are so many that the others may be left out.
    pub(crate) fn are_most(&self, part: usize, of: usize) -> bool {
        (of - part) as f64 <= self.max_lost * of as f64
    }

    /// Returns which shots are kept: all if too many were to be left out.
    pub(crate) fn keep_most(&self, keep: Vec<bool>) -> Vec<bool> {
        let kept = keep.iter().filter(|keep| **keep).count();
        if self.are_most(kept, keep.len()) { keep } else { vec![true; keep.len()] }
    }
}
