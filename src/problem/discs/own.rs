//! Unknowns of films of discs: those of each shot, in SI units and the frame of the table, what
//! scatters from shot to shot, and the priors of those that all shots share.

use std::ops::Range;

use crate::measurement::dataset::{Dataset, Tracks};
use crate::physics::disc::Discs;
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
/// e.
pub(crate) const RESTITUTION: usize = 11;
/// J_t/J_n; of discs that stick, what they turn beyond their angular momentum, over the closing
/// speed and times their distance.
pub(crate) const RATIO: usize = 12;
/// Momentum gained along and across the line of centres, over the normal impulse.
pub(crate) const MOMENTUM: usize = 13;
/// J_t/J_n by the spin of each disc less that by the paths.
pub(crate) const SPIN_RATIO: usize = 15;
/// Decelerations less that of all shots: the first disc before and after, the second likewise.
pub(crate) const SLOWING: usize = 17;
/// Time by which friction acts earlier than the normal force, s.
pub(crate) const LEAD: usize = 21;
/// μ less that of all shots.
pub(crate) const FRICTION: usize = 22;
/// Number of own unknowns besides those of markers: direction and distance from the centre of each
/// marker at the impact.
pub(crate) const CORE: usize = 23;

/// A quantity that differs from shot to shot beyond the noise of the frames.
pub(crate) struct Component {
    /// Its name in output.
    pub(crate) name: &'static str,
    /// Places of its own unknowns.
    pub(super) places: Range<usize>,
    /// Standard deviation before the frames are seen, as large as hands and tables make it
    /// (data/pucks-chalmers-2023); and the smallest that frames determine.
    sds: [f64; 2],
}

impl Component {
    /// All components, e first, then J_t/J_n, which scatter about the law of the impact; the last is
    /// μ, by which J_t/J_n of contacts that slide varies.
    pub(crate) const ALL: [Self; 7] = [
        Self { name: "e", places: RESTITUTION..RATIO, sds: [0.05, 2e-4] },
        Self { name: "impulse_ratio", places: RATIO..MOMENTUM, sds: [0.05, 2e-4] },
        Self { name: "momentum", places: MOMENTUM..SPIN_RATIO, sds: [0.03, 1e-4] },
        Self { name: "spin_ratio", places: SPIN_RATIO..SLOWING, sds: [0.05, 2e-4] },
        Self { name: "contact_distance_m", places: DISTANCE..VELOCITY, sds: [1e-3, 3e-6] },
        Self { name: "slowing_m_s2", places: SLOWING..LEAD, sds: [1.0, 5e-4] },
        Self { name: "mu", places: FRICTION..CORE, sds: [0.05, 2e-4] },
    ];
}

/// Number of unknowns of the law of the impact: [`Id::Mu`] to [`Id::ESlope`].
pub(super) const LAW: usize = Id::ESlope as usize + 1;

/// How much the four decelerations of a single shot differ, m/s².
const EVEN_SLOWING: f64 = 0.002;

/// Slowest and fastest common frame rate, frames/s: if the rate is unknown, priors are those of the
/// slowest, so that they are not narrower than of others, and the least that frames determine that
/// of the fastest.
const RATES: [f64; 2] = [30.0, 1000.0];

/// Part by which distances of the centres at the contact differ: that of a camera's scale over the
/// table, rubber bands and the give of rims. Stated masses are as uncertain.
pub(super) const DISTANCE_SD: f64 = 0.01;

/// Standard deviations of the deceleration at any speed, m/s²: g/5, as of coins on wood, where air
/// tables have g/1000 to g/100; and of the deceleration over the speed, 1/s.
const SLOWING_SD: f64 = 2.0;
const DRAG_SD: f64 = 1.0;

/// Number of shots that determine a camera, or how a deceleration depends on speed, at least.
pub(super) const LEAST_SHOTS: usize = 3;

/// Returns how much each [`Component`] differs before the frames are seen. A single shot does not
/// show it: its own values are then those of its discs.
pub(super) fn spreads(discs: &Discs, shots: usize) -> Vec<Spread> {
    let spread = |component: &Component| {
        let ([mut first, mut least], is_slowing) = (component.sds, component.places.start == SLOWING);
        if shots == 1 {
            first = if is_slowing { EVEN_SLOWING } else { least };
        }
        if is_slowing {
            first *= unit_of_time(discs, RATES[0]).powi(2);
            least *= unit_of_time(discs, RATES[1]).powi(2);
        }
        // the largest weight holds it
        Spread { sd: first, first, weight: if shots == 1 { f64::MAX } else { 0.0 }, least }
    };
    Component::ALL.iter().map(spread).collect()
}

/// Returns the unit of time of a film in seconds: a frame at this rate if its own is unknown.
fn unit_of_time(discs: &Discs, rate: f64) -> f64 {
    if discs.in_seconds { 1.0 } else { rate.recip() }
}

/// Returns every shared unknown in the order of [`Id`]. `typical`: the median distance of the
/// centres at the impacts, m, and the median mass ratio that momentum gives.
pub(super) fn list_unknowns(
    dataset: &Dataset,
    tracks: &Tracks,
    discs: &Discs,
    typical: [f64; 2],
    (shots, is_flat): (usize, bool),
) -> Vec<Unknown> {
    let mut all = Unknown::list();
    list_contact(&mut all, &dataset.settings);
    let sum = discs.radii.map(|[first, second]| first + second);
    let ratio = discs.masses.map(|[first, second]| first / second);
    let shown = [(Id::ContactDistance, sum), (Id::MassRatio, ratio)];
    for ((id, stated), start) in shown.into_iter().zip(typical) {
        all[id as usize] = Unknown { start, mode: Mode::Free, prior: None, ..all[id as usize] };
        if let Some(stated) = stated {
            known(&mut all, id, stated, DISTANCE_SD * stated);
        }
    }
    let second = unit_of_time(discs, RATES[0]);
    known(&mut all, Id::Slowing, 0.0, SLOWING_SD * second * second);
    known(&mut all, Id::Drag, 0.0, DRAG_SD * second);
    // a table slows discs down
    for id in [Id::Slowing, Id::Drag] {
        all[id as usize].bounds[0] = 0.0;
    }
    list_camera(&mut all, tracks);
    let is_seen = shots >= LEAST_SHOTS && !is_flat;
    for unknown in &mut all {
        let is_shown = match unknown.id {
            Id::MuS | Id::RadiusRatio => false,
            // discs do not hop, and what trackers do besides is a lead of each shot
            id if (Id::ParallaxX..=Id::ObjectScale).contains(&id) => id == Id::Late && is_seen,
            // few shots do not distinguish it from a deceleration at any speed
            Id::Drag => shots >= LEAST_SHOTS,
            Id::ContactDistance => !is_flat || sum.is_some(),
            Id::Scale => is_seen && discs.radii.is_some(),
            // a delay has no meaning without a unit of time
            Id::ShutterX | Id::ShutterY => is_seen && discs.in_seconds,
            id => is_seen || !(Id::Scale..Id::ParallaxX).contains(&id),
        };
        if !is_shown {
            unknown.mode = Mode::Fixed;
        }
    }
    all
}
