//! The measured impact of two discs, and its doubts.

use statrs::distribution::{ContinuousCDF, Normal};

use super::lines::Stuck;
use super::own::LEAST_SHOTS;
use super::quantities::Quantity;
use crate::extraction::Unusable;
use crate::measurement::dataset::Measured;
use crate::measurement::number::with_error;
use crate::numerics::median;
use crate::problem::film::camera::Point;
use crate::problem::frames::PicturePaths;
use crate::problem::policy::Policy;

/// Part of the distance of the centres by which the frames of a collision are off the paths at
/// most.
const MAX_FRAME_DEVIATION: f64 = 0.02;

/// Part by which distances at the contact differ: that of a camera's scale over the table, rubber
/// bands and the give of rims.
const DISTANCE_SD: f64 = 0.01;

/// The measured impact of a shot, without a law of friction. Velocities are in m/s and
/// spins in rad/s in the frame of the table; if the frame rate is not known, per frame.
#[derive(Clone, Debug)]
pub struct DiscImpact {
    /// Name of the shot.
    pub(crate) name: String,
    /// Value of each [`Quantity`]; `None` if the tracks do not determine it.
    pub(crate) values: [Option<Measured>; Quantity::COUNT],
    /// Standard deviation of a coordinate of the disc that is followed worse, m.
    pub(crate) position_sd: f64,
    /// Variance of the frames about the paths over that of their noise before anything was fitted.
    pub(crate) misfit: f64,
    /// Number of frames that were used, of both discs.
    pub(crate) frames: usize,
    /// Number of frames that were left out as wrong.
    pub(crate) outliers: usize,
    /// First and last instant that was used, s.
    pub(crate) window: [f64; 2],
    /// Number of frames on either side of the impact in which the discs still touch; 0 if the
    /// frames next to it are on the paths.
    pub(crate) touching: usize,
    /// Radii of the discs; if they are not stated, half the distance of the centres at the impact,
    /// m.
    pub(crate) radii: [f64; 2],
    /// How the discs stick together after the impact, if they do.
    pub(crate) stuck: Option<Stuck>,
    /// Doubts of the measurements.
    pub(crate) doubts: Vec<Doubt>,
    pub(super) paths: PicturePaths,
    /// Metres in a unit of length of the film, and its middle in that unit.
    pub(super) film: (f64, Point),
}

/// A doubt of the measurements of a shot, as a clause.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub(crate) enum Doubt {
    /// Momentum is out of balance by more than its errors.
    #[error(
        "its momentum is not conserved: {} the line of centres both discs together {} {:.1} ± {:.1} % of the impulse; the masses, \
         the scale or the frames are wrong, or something else pushed a disc",
        if *.across { "across" } else { "along" }, if *gained < 0.0 { "lose" } else { "gain" }, 100.0 * gained.abs(), 100.0 * sd
    )]
    Momentum {
        /// Whether it is that across the line of centres.
        across: bool,
        /// Momentum gained over the normal impulse.
        gained: f64,
        /// Its standard error.
        sd: f64,
    },
    /// The frames are off the paths: their variance about the paths, over the variance of their
    /// noise.
    #[error(
        "its paths are not straight before and after one instant: they are off by {:.0} times the noise of the frames (χ²/dof is \
         {:.0}); the contact lasts for several frames, or points were mistaken", .0.sqrt(), .0
    )]
    Bent(f64),
    /// e, with this standard error, is not that of an impact.
    #[error("its e of {} is not between 0 and 1, as that of any passive impact is", with_error(*.0, *.1))]
    Impossible(f64, f64),
    /// The distance at the contact is not that of the other shots.
    #[error(
        "its discs are {:.1} mm apart at the contact, where the median of all shots is {:.1} mm: the same discs touch at the same \
         distance, so that these are others, or the scale or the tracked points are", 1e3 * distance, 1e3 * typical
    )]
    Distance {
        /// Distance of the centres, m.
        distance: f64,
        /// Median of all shots, m.
        typical: f64,
    },
}

impl DiscImpact {
    /// Returns the value of a quantity if the tracks determine it.
    #[must_use]
    pub fn get(&self, quantity: Quantity) -> Option<Measured> {
        self.values[quantity as usize]
    }

    /// Returns the place of the centre of a disc (0 or 1) in the film at a time (s), in its unit.
    #[must_use]
    pub fn place(&self, disc: usize, time: f64) -> [f64; 2] {
        let (unit, middle) = self.film;
        (Point::from(self.paths.place(disc, time)) / unit + middle).into()
    }

    /// Returns the reason for which no law can be fitted to the shot, if there is one.
    pub(crate) fn find_fault(&self, policy: &Policy) -> Option<String> {
        if self.stuck.is_some() {
            return Some("the discs stick together".to_owned());
        }
        let misfit = self.find_misfit().map(|misfit| misfit.to_string());
        misfit.or_else(|| self.find_impossible_restitution(policy).map(|doubt| doubt.to_string()))
    }

    /// Returns the reason for which the frames show no single collision, if they do not.
    pub(super) fn find_misfit(&self) -> Option<Unusable> {
        let distance = self.get(Quantity::ContactDistance).map_or(0.0, |distance| distance.value.abs());
        let is_seen_across = self.get(Quantity::ImpulseRatio).is_some();
        let is_off = distance > 0.0 && is_seen_across && self.position_sd > MAX_FRAME_DEVIATION * distance;
        is_off.then_some(Unusable::BadFit { reduced_chi2: self.misfit, rms_mm: 1e3 * self.position_sd })
    }

    /// Returns the reason for which the discs are others than those with these radii, if their
    /// distance shows it.
    pub(super) fn find_separation(&self, radii: [f64; 2], policy: &Policy) -> Option<Unusable> {
        let expected = radii[0] + radii[1];
        let Measured { value: measured, sd } = self.get(Quantity::ContactDistance)?;
        let error = sd.filter(|_| self.get(Quantity::ImpulseRatio).is_some())?;
        let differs = is_significant(measured - expected, error.hypot(DISTANCE_SD * expected), policy);
        differs.then_some(Unusable::Separation { measured, expected, error })
    }

    /// Returns the doubt of an e that is not that of an impact.
    pub(crate) fn find_impossible_restitution(&self, policy: &Policy) -> Option<Doubt> {
        let Measured { value: e, sd } = self.get(Quantity::Restitution)?;
        let (outside, sd) = ((e - 1.0).max(-e), sd?);
        (outside > 0.0 && is_significant(outside, sd, policy)).then_some(Doubt::Impossible(e, sd))
    }

    fn find_imbalance(&self, policy: &Policy) -> Option<Doubt> {
        let gain = |across: bool, quantity: Quantity| {
            let Measured { value: gained, sd } = self.get(quantity)?;
            sd.filter(|sd| is_significant(gained, *sd, policy)).map(|sd| Doubt::Momentum {
                across,
                gained,
                sd,
            })
        };
        gain(false, Quantity::MomentumAlong).or_else(|| gain(true, Quantity::MomentumAcross))
    }
}

/// Returns whether a number with this standard error differs from 0 as seldom as an outlying shot
/// does.
fn is_significant(value: f64, sd: f64, policy: &Policy) -> bool {
    Normal::new(0.0, sd).is_ok_and(|normal| normal.sf(value.abs()) < policy.shot_tail)
}

/// Adds what speaks against the impacts of a film.
pub(super) fn find_doubts(impacts: &mut [DiscImpact], policy: &Policy) {
    let distance = |impact: &DiscImpact| impact.get(Quantity::ContactDistance);
    let all: Vec<f64> = impacts.iter().filter_map(|impact| Some(distance(impact)?.value)).collect();
    let typical = (all.len() >= LEAST_SHOTS).then(|| median(all));
    for impact in impacts {
        let other = distance(impact).zip(typical).filter(|(found, typical)| {
            let sd = found.sd.unwrap_or(0.0).hypot(DISTANCE_SD * typical);
            is_significant(found.value - typical, sd, policy)
        });
        let doubts = [
            impact.find_imbalance(policy),
            (impact.misfit > policy.refuted).then_some(Doubt::Bent(impact.misfit)),
            impact.find_impossible_restitution(policy),
            other.map(|(found, typical)| Doubt::Distance { distance: found.value, typical }),
        ];
        impact.doubts.extend(doubts.into_iter().flatten());
    }
}
