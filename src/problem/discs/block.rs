//! The frames of the discs of some shots as a block.

use std::ops::Range;
use std::sync::Arc;

use super::frames::{NOISES, ROW, ShotFrames};
use super::own;
use super::priors::unit_of_time;
use crate::physics::disc::Discs;
use crate::physics::name::worded;
use crate::problem::frames::Sight;
use crate::problem::sums::{Contribution, Noise, OwnPrior, Spread};
use crate::problem::unknowns::{Normal, Own, Shared};

/// How much the four decelerations of a single shot differ before the frames are seen, m/s². It counts as
/// one shot.
const EVEN_SLOWING: f64 = 0.002;

/// Fastest common frame rate, frames/s: if the rate is unknown, the least that frames determine is that of
/// this one.
const FASTEST_RATE: f64 = 1000.0;

/// An offset of which nothing is known, over the normal impulse or the closing speed.
pub(super) const ANY: Normal = Normal { mean: 0.0, sd: 3.0 };

worded! {
    /// What differs from shot to shot beyond the noise of the frames.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum Component {
        /// e.
        Restitution = "e",
        /// J_t/J_n.
        Ratio = "impulse_ratio",
        /// Momentum gained along and across the line of centres, over the normal impulse.
        Momentum = "momentum",
        /// J_t/J_n by the spins of the discs less that by their paths.
        SpinRatio = "spin_ratio",
        /// Distance of the centres at the impact, m.
        Distance = "contact_distance_m",
        /// Deceleration of a disc on one side of the impact, m/s².
        Slowing = "slowing_m_s2",
    }
    /// The name in output.
    pub fn name;
}

impl Component {
    /// Returns the places of its own unknowns.
    pub(super) fn places(self) -> Range<usize> {
        match self {
            Self::Restitution => own::RESTITUTION..own::RATIO,
            Self::Ratio => own::RATIO..own::MOMENTUM,
            Self::Momentum => own::MOMENTUM..own::SPIN_RATIO,
            Self::SpinRatio => own::SPIN_RATIO..own::SLOWING,
            Self::Distance => own::DISTANCE..own::VELOCITY,
            Self::Slowing => own::SLOWING..own::LEAD,
        }
    }

    /// Returns its standard deviation from shot to shot before the frames are seen: as large as hands and
    /// tables make it (data/pucks-chalmers-2023), since estimates decrease faster than they grow; and the
    /// smallest that frames determine.
    fn spread(self, discs: &Discs) -> Spread {
        let [mut first, mut least] = match self {
            Self::Restitution | Self::Ratio | Self::SpinRatio => [0.05, 2e-4],
            Self::Momentum => [0.03, 1e-4],
            Self::Distance => [1e-3, 3e-6],
            Self::Slowing => [1.0, 5e-4],
        };
        if self == Self::Slowing && !discs.in_seconds {
            first *= unit_of_time(discs).powi(2);
            least *= FASTEST_RATE.powi(-2);
        }
        Spread { weight: 0.0, ..Spread::first(first, least) }
    }
}

/// Which outcome of an impact each shot may have besides that of the law.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Freedom {
    /// What scatters from shot to shot.
    Law,
    /// Any e and J_t/J_n; momentum and spins scatter.
    Outcome,
    /// Any e and J_t/J_n, with any balance of momentum, and any spins.
    Everything,
}

/// Frames of discs.
#[derive(Clone)]
pub(crate) struct DiscBlock {
    pub shots: Arc<Vec<ShotFrames>>,
    pub discs: Discs,
    /// Of each shot: of each disc along x and along y.
    pub noise: Vec<Noise>,
    /// Of each [`Component`].
    pub spreads: Vec<Spread>,
    pub freedom: Freedom,
}

impl DiscBlock {
    pub fn new(shots: Vec<ShotFrames>, discs: Discs, noise: Vec<Noise>) -> Self {
        let spreads = Component::ALL.map(|component| component.spread(&discs)).to_vec();
        let mut block = Self { shots: Arc::new(shots), discs, noise, spreads, freedom: Freedom::Outcome };
        block.hold_spreads();
        block
    }

    /// Returns the noises of shot `i`.
    pub fn noise_of(&self, i: usize) -> &[Noise] {
        &self.noise[NOISES * i..NOISES * (i + 1)]
    }

    /// Returns the used frames of each track of shot `i`, whitened; none if the discs do not approach.
    pub fn sights(&self, i: usize, own: &Own, shared: &Shared) -> Vec<Vec<Sight<ROW>>> {
        self.shots[i].sights(own, shared, &self.discs, self.noise_of(i))
    }

    /// Returns the sums of shot `i`, with what is known of its own unknowns.
    pub fn contribute(&self, i: usize, own: &Own, shared: &Shared) -> Contribution {
        let noise = (self.noise.as_slice(), NOISES * i);
        let mut sums = self.shots[i].contribute(own, shared, &self.discs, noise);
        for (place, prior) in self.own_priors(i) {
            sums.add_prior(place, prior.normal(&self.spreads), own[place]);
        }
        sums
    }

    /// Returns what is known of own unknowns of shot `i`.
    pub fn own_priors(&self, i: usize) -> Vec<(usize, OwnPrior)> {
        let known = &self.shots[i].own_known;
        let mut priors = known.clone();
        for (which, component) in Component::ALL.into_iter().enumerate() {
            let is_free = match component {
                Component::Restitution => self.freedom != Freedom::Law,
                // a single shot shows no law
                Component::Ratio => self.freedom != Freedom::Law || self.shots.len() == 1,
                Component::Momentum | Component::SpinRatio => self.freedom == Freedom::Everything,
                Component::Distance | Component::Slowing => false,
            };
            let prior = if is_free { OwnPrior::Stated(ANY) } else { OwnPrior::Spread(which) };
            let is_open = |place: &usize| !known.iter().any(|(known, _)| known == place);
            priors.extend(component.places().filter(is_open).map(|place| (place, prior)));
        }
        priors
    }

    /// Takes shots in the place of all, one may be taken several times.
    pub fn take(&mut self, indices: &[usize]) {
        self.noise = indices.iter().flat_map(|i| self.noise_of(*i).to_vec()).collect();
        self.shots = Arc::new(indices.iter().map(|i| self.shots[*i].clone()).collect());
        self.hold_spreads();
    }

    /// Holds the spreads of a single shot, which shows none but that of its four decelerations, and that
    /// poorly: its own values are then those of its discs.
    fn hold_spreads(&mut self) {
        let even = EVEN_SLOWING * unit_of_time(&self.discs).powi(2);
        if self.shots.len() == 1 {
            for (spread, component) in self.spreads.iter_mut().zip(Component::ALL) {
                let first = if component == Component::Slowing { even } else { spread.least };
                *spread = Spread::first(first, spread.least);
            }
        }
    }
}
