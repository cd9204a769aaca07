//! Everything that can be wrong or worth saying of a fit, as data. The verdict is the worst one.

use serde::Serialize;

use super::unknowns::Id;

/// How far a finding affects the trust in a fit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
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

/// Number of frames that are off after the impacts, beyond those before them, if a tracker lags:
/// what balls that touch or an exposure do to positions is similar before and after.
const LATE: usize = 2;

/// A finding of a fit.
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
    Playback {
        /// Frames per second.
        fps: f64,
    },
    /// The camera dropped frames that the numbers do not show; the others were moved in time.
    Drops {
        /// Number of shots.
        shots: usize,
        /// Number of drops.
        drops: usize,
    },
    /// Cue balls come off a cushion or are struck before the impact: their frames up to there are
    /// left out.
    Corners {
        /// Number of shots.
        shots: usize,
        /// Number of all shots.
        of: usize,
    },
    /// A ball meets a cushion or another ball after the impact: its frames from there on are left
    /// out.
    Ends {
        /// Number of shots.
        shots: usize,
        /// Number of all shots.
        of: usize,
    },
    /// The noise lasts from frame to frame.
    NoiseLasts {
        /// Correlation of neighbouring frames.
        rho: f64,
        /// Its standard error.
        sd: f64,
    },
    /// Neighbouring frames scatter by more than the stated noise, which is not used; or by less.
    NoiseRefuted {
        /// Their scatter over the stated noise.
        times: f64,
    },
    /// Frames next to the impacts are off in all shots, and left out.
    Spoiled {
        /// Number of frames before each impact.
        before: usize,
        /// Number of frames after it.
        after: usize,
    },
    /// Both balls are off their paths in the first frames after the impacts, and not before: the
    /// tracker lags.
    Lags,
    /// A contact that is compliant along its surface.
    Compliance {
        /// κ.
        kappa: f64,
        /// Number of shots in which it shows.
        shots: usize,
        /// Decrease of −2 log L.
        fall: f64,
        /// Whether it was adopted.
        adopted: bool,
    },
    /// The effect of weight and cloth during the contact.
    Weight {
        /// Number of shots on which they act.
        shots: usize,
        /// Decrease of −2 log L.
        fall: f64,
        /// Whether it was adopted.
        adopted: bool,
    },
    /// The frames contradict what is stated or known of a quantity, whose prior was then left out.
    Conflict {
        /// The quantity.
        id: Id,
        /// Its stated value.
        stated: f64,
        /// Its estimate from the frames alone.
        estimate: f64,
        /// Standard error of the estimate.
        sd: f64,
        /// Difference in its standard deviations.
        size: f64,
    },
    /// An effect that the model left out explains residuals; it was then let in.
    Cause {
        /// The effect's unknown.
        id: Id,
        /// Its estimate.
        estimate: f64,
        /// Standard error of the estimate.
        sd: f64,
        /// Decrease of −2 log L.
        fall: f64,
    },
    /// The cue balls do not spin as stated; their spins were then found from the frames.
    Spins {
        /// Decrease of −2 log L.
        fall: f64,
        /// Mean topspin of the shots that slide, over natural roll; 1 without such shots.
        topspin: f64,
        /// Number of shots that slide.
        sliding: usize,
    },
    /// The frames scatter about the paths by more than their noise. If the model does not describe
    /// them at all, the estimates are meaningless.
    Misfit {
        /// Variance of slow motions over that of the noise before the impacts.
        ratio: f64,
        /// Whether the model does not describe the frames.
        refutes: bool,
    },
    /// The frames determine a wanted unknown less well than it is known without them.
    Undetermined {
        /// The unknown.
        id: Id,
        /// Its standard error.
        sd: f64,
    },
    /// A wanted unknown is at a bound.
    AtBound {
        /// The unknown.
        id: Id,
        /// The bound.
        bound: f64,
    },
    /// Shots whose frames fit no collision were left out.
    LostShots {
        /// Their names.
        names: Vec<String>,
    },
    /// The descent did not end at a minimum.
    NotConverged,
}

impl Finding {
    /// Returns how far it affects the trust in a fit.
    pub fn severity(&self) -> Severity {
        match self {
            Self::NoiseRefuted { times } if *times > 1.0 => Severity::Note,
            Self::Spoiled { before, after } if *after >= before + LATE => Severity::Doubtful,
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
            Self::OtherUnit { .. }
            | Self::NoiseRefuted { .. }
            | Self::Playback { .. }
            | Self::Conflict { .. }
            | Self::Cause { .. }
            | Self::Spins { .. }
            | Self::Misfit { refutes: false, .. }
            | Self::AtBound { .. }
            | Self::Lags => Severity::Doubtful,
            Self::NotConverged | Self::Misfit { refutes: true, .. } => Severity::Unusable,
        }
    }
}

/// Returns the worst severity of some findings.
pub fn worst(findings: &[Finding]) -> Severity {
    findings.iter().map(Finding::severity).max().unwrap_or(Severity::Note)
}
