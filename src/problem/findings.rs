//! Everything that can be wrong or worth saying of a fit, as data. The verdict is the worst one.

use serde::Serialize;

use super::unknowns::Id;

/// How far a finding affects the trust in a fit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Severity {
    /// Good to know.
    Note,
    /// A reader should look at it; the estimates stand.
    Warning,
    /// The estimates may be off by more than their errors.
    Doubtful,
    /// The estimates are meaningless.
    Unusable,
}

/// A finding of a fit. `shots` and `of` are numbers of shots, those that the finding is of and all;
/// `sd` is a standard error, `fall` the decrease of −2 log L with what was found, and `adopted`
/// whether the estimates include it.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub(crate) enum Finding {
    /// Lengths are in another unit than metres: the size of the balls sets the scale.
    OtherUnit {
        /// Metres in a unit of length.
        factor: f64,
        /// Whether the data set states another one.
        stated: bool,
    },
    /// The stated frame rate is one at which films are played, and something else is wrong.
    Playback { fps: f64 },
    /// Frames were dropped, or put in, that the numbers do not show; the others were moved in time.
    Drops { shots: usize, drops: usize },
    /// Cue balls come off a cushion or are struck before the impact: their frames up to there are
    /// left out.
    Corners { shots: usize, of: usize },
    /// A ball meets a cushion or another ball after the impact: its frames from there on are left
    /// out.
    Ends { shots: usize, of: usize },
    /// The noise lasts from frame to frame.
    NoiseLasts {
        /// Correlation of neighbouring frames.
        rho: f64,
        sd: f64,
    },
    /// Neighbouring frames scatter by more than the stated noise, which is not used; or by less.
    NoiseRefuted {
        /// Their scatter over the stated noise.
        times: f64,
    },
    /// Frames next to the impacts are off in all shots, so many before and after, and left out.
    Spoiled { before: usize, after: usize },
    /// Balls are off their paths in the first frames after the impacts: the tracker lags.
    Lags,
    /// A contact that is compliant along its surface.
    Compliance { kappa: f64, shots: usize, fall: f64, adopted: bool },
    /// The effect of weight and cloth during the contact.
    Weight { shots: usize, fall: f64, adopted: bool },
    /// The frames contradict what is stated or known of a quantity, whose prior was then left out.
    Conflict {
        id: Id,
        stated: f64,
        /// Its estimate from the frames alone.
        estimate: f64,
        sd: f64,
        /// Difference in its standard deviations.
        size: f64,
    },
    /// An effect that the model left out explains residuals; it was then let in.
    Cause { id: Id, estimate: f64, sd: f64, fall: f64 },
    /// The cue balls do not spin as stated; their spins were then found from the frames.
    Spins { fall: f64 },
    /// The side spins of the shots, over the speed, scatter more than players make them, so that they
    /// may take up friction.
    SideSpins { sd: f64 },
    /// The topspins of shots that do not roll, over natural roll, scatter more about what is stated
    /// than is usual.
    Topspins { sd: f64 },
    /// The frames scatter about the paths by more than their noise. If the model does not describe
    /// them at all, the estimates are meaningless.
    Misfit {
        /// Variance of slow motions over that of the noise before the impacts.
        ratio: f64,
        /// Whether the model does not describe the frames.
        refutes: bool,
    },
    /// The frames determine a wanted unknown less well than it is known without them.
    Undetermined { id: Id, sd: f64 },
    /// A wanted unknown is at a bound.
    AtBound { id: Id, bound: f64 },
    /// The outcomes of the shots scatter more than the noise of the frames makes them: what the shots
    /// share differs from shot to shot, which the errors include.
    Dispersed { spreads: Vec<Differing> },
    /// Shots whose frames fit no collision were left out.
    LostShots { names: Vec<String> },
    /// The descent did not end at a minimum.
    NotConverged,
}

/// An unknown that differs from shot to shot.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct Differing {
    pub(crate) id: Id,
    /// Standard deviation.
    pub(crate) sd: f64,
}

impl Finding {
    /// Returns how far it affects the trust in a fit.
    pub fn severity(&self) -> Severity {
        match self {
            Self::NoiseRefuted { times } if *times > 1.0 => Severity::Note,
            Self::Undetermined { .. }
            | Self::LostShots { .. }
            | Self::OtherUnit { stated: false, .. }
            | Self::Drops { .. }
            | Self::Corners { .. }
            | Self::Ends { .. }
            | Self::NoiseLasts { .. }
            | Self::Spoiled { .. }
            | Self::Compliance { .. }
            | Self::Weight { .. } => Severity::Note,
            Self::Dispersed { .. } => Severity::Warning,
            Self::OtherUnit { .. }
            | Self::NoiseRefuted { .. }
            | Self::Playback { .. }
            | Self::Conflict { .. }
            | Self::Cause { .. }
            | Self::Spins { .. }
            | Self::SideSpins { .. }
            | Self::Topspins { .. }
            | Self::Misfit { refutes: false, .. }
            | Self::AtBound { .. }
            | Self::Lags => Severity::Doubtful,
            Self::NotConverged | Self::Misfit { refutes: true, .. } => Severity::Unusable,
        }
    }
}
