//! Unknowns of films of discs: the own unknowns of each shot, in SI units and the frame of the
//! table, what scatters from shot to shot, and the priors of the unknowns that all shots share.

use std::ops::Range;

use crate::measurement::dataset::{Dataset, Tracks};
use crate::physics::disc::Discs;
use crate::physics::name::worded;
use crate::problem::film::priors::{known, list_camera, list_contact};
use crate::problem::sums::Spread;
use crate::problem::unknowns::{Id, Mode, Unknown};

/// Instant of the impact, s.
pub(crate) const TIME: usize = 0;
/// Coordinates x and y of the first disc's centre then, m from the middle of the film.
pub const X: usize = 1;
/// Direction of the line of centres from the first disc to the second, rad.
pub(crate) const DIRECTION: usize = 3;
/// Distance of the centres less that of all shots, m.
pub(crate) const DISTANCE: usize = 4;
/// Velocities before the impact: x and y of the first disc, x and y of the second.
pub(crate) const VELOCITY: usize = 5;
/// Angular velocities of both discs before the impact.
pub(crate) const SPIN: usize = 9;
/// Offset of e from the law.
pub(crate) const RESTITUTION: usize = 11;
/// Offset of J_t/J_n from the law.
pub(crate) const RATIO: usize = 12;
/// Momentum gained along and across the line of centres, over the normal impulse.
pub(crate) const MOMENTUM: usize = 13;
/// J_t/J_n by the spin of each disc less that by the paths.
pub(crate) const SPIN_RATIO: usize = 15;
/// Decelerations less that of all shots: the first disc before and after, the second likewise.
pub(crate) const SLOWING: usize = 17;
/// Time by which friction acts earlier than the normal force, s.
pub(crate) const LEAD: usize = 21;
/// Number of own unknowns besides those of markers: direction and distance from the centre of each
/// marker at the impact.
pub(crate) const CORE: usize = 22;

/// How much the four decelerations of a single shot differ before the frames are seen, m/s². It
/// counts as one shot.
const EVEN_SLOWING: f64 = 0.002;

/// Slowest and fastest common frame rate, frames/s: if the rate is unknown, priors are those of the
/// slowest, so that they are not narrower than of others, and the least that frames determine that
/// of the fastest.
const RATES: [f64; 2] = [30.0, 1000.0];

/// Relative standard deviations of the sum of stated radii, rubber bands and the give of rims
/// included, and of the ratio of stated masses.
const RADII_SD: f64 = 0.01;
const MASS_SD: f64 = 0.01;

/// Standard deviation of the deceleration at any speed, m/s²: g/100, as on ice or a poor air table.
const SLOWING_SD: f64 = 0.1;
/// Standard deviation of the deceleration over the speed, 1/s.
const DRAG_SD: f64 = 1.0;

/// Unknowns of the law of the impact.
pub(super) const LAW: [Id; 6] = [Id::Mu, Id::E, Id::FallB, Id::FallC, Id::Kappa, Id::ESlope];

/// Number of shots that determine a camera, or how a deceleration depends on speed, at least.
pub(super) const LEAST_SHOTS: usize = 3;

worded! {
    /// A quantity that differs from shot to shot beyond the noise of the frames.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub(crate) enum Component {
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
    /// Returns the places of its own unknowns, and its standard deviations: that from shot to shot
    /// before the frames are seen, as large as hands and tables make it (data/pucks-chalmers-2023),
    /// since estimates decrease faster than they grow; and the smallest that frames determine.
    pub(super) fn describe(self) -> (Range<usize>, [f64; 2]) {
        match self {
            Self::Restitution => (RESTITUTION..RATIO, [0.05, 2e-4]),
            Self::Ratio => (RATIO..MOMENTUM, [0.05, 2e-4]),
            Self::Momentum => (MOMENTUM..SPIN_RATIO, [0.03, 1e-4]),
            Self::SpinRatio => (SPIN_RATIO..SLOWING, [0.05, 2e-4]),
            Self::Distance => (DISTANCE..VELOCITY, [1e-3, 3e-6]),
            Self::Slowing => (SLOWING..LEAD, [1.0, 5e-4]),
        }
    }
}

/// Returns how much each [`Component`] differs before the frames are seen. A single shot shows it
/// of its four decelerations alone, and poorly: its own values are then those of its discs.
pub(super) fn spreads(discs: &Discs, shots: usize) -> Vec<Spread> {
    let of_component = |component: Component| {
        let (_, [first, least]) = component.describe();
        let is_slowing = component == Component::Slowing;
        let [slow, fast] =
            if is_slowing { RATES.map(|rate| unit_of_time(discs, rate).powi(2)) } else { [1.0; 2] };
        match shots {
            1 => Spread::first(if is_slowing { EVEN_SLOWING * slow } else { least }, least * fast),
            _ => Spread { weight: 0.0, ..Spread::first(first * slow, least * fast) },
        }
    };
    Component::ALL.into_iter().map(of_component).collect()
}

/// Returns the unit of time of a film in seconds: a frame at this rate if its own is unknown.
fn unit_of_time(discs: &Discs, rate: f64) -> f64 {
    if discs.in_seconds { 1.0 } else { rate.recip() }
}

/// Returns every shared unknown in the order of [`Id`]. `guessed`: the median distance of the
/// centres at the impacts, m, and the median mass ratio that momentum gives.
pub(super) fn list_unknowns(
    dataset: &Dataset,
    tracks: &Tracks,
    discs: &Discs,
    [distance, mass_ratio]: [f64; 2],
    (shots, is_flat): (usize, bool),
) -> Vec<Unknown> {
    let mut all = Unknown::list();
    list_contact(&mut all, &dataset.settings);
    all[Id::MuS as usize].mode = Mode::Fixed;
    all[Id::RadiusRatio as usize].mode = Mode::Fixed;
    for (id, start) in [(Id::MassRatio, mass_ratio), (Id::ContactDistance, distance)] {
        all[id as usize] = Unknown { start, mode: Mode::Free, prior: None, ..all[id as usize] };
    }
    if is_flat {
        all[Id::ContactDistance as usize].mode = Mode::Fixed;
    }
    if let Some([first, second]) = discs.masses {
        known(&mut all, Id::MassRatio, first / second, MASS_SD * first / second);
    }
    if let Some([first, second]) = discs.radii {
        known(&mut all, Id::ContactDistance, first + second, RADII_SD * (first + second));
    }
    let second = unit_of_time(discs, RATES[0]);
    known(&mut all, Id::Slowing, 0.0, SLOWING_SD * second * second);
    // few shots do not distinguish it from a deceleration at any speed
    if shots >= LEAST_SHOTS {
        known(&mut all, Id::Drag, 0.0, DRAG_SD * second);
    }
    // a table slows discs down
    for id in [Id::Slowing, Id::Drag] {
        all[id as usize].bounds[0] = 0.0;
    }
    list_camera(&mut all, tracks);
    for unknown in &mut all[Id::Scale as usize..=Id::Nearness as usize] {
        let is_shown = match unknown.id {
            Id::Scale => discs.radii.is_some(),
            // a delay has no meaning without a unit of time
            Id::ShutterX | Id::ShutterY => discs.in_seconds,
            // discs do not hop
            Id::ParallaxX | Id::ParallaxY | Id::Nearness => false,
            _ => true,
        };
        if is_flat || shots < LEAST_SHOTS || !is_shown {
            unknown.mode = Mode::Fixed;
        }
    }
    all
}
