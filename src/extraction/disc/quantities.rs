//! What follows from the fitted unknowns, with errors carried over by exact derivatives.

use nalgebra::{Const, SMatrix, SVector};
use num_dual::DualNum;

use super::paths::Centres;
use super::rotation::Turn;
use super::unknowns::{COUNT, DIRECTION, DISTANCE, INPUTS, TIME, velocity};
use super::{Dual, gradient, stick, value};
use crate::measurement::dataset::Measured;
use crate::physics::disc::Discs;
use crate::physics::name::worded;

/// Where a spin stands.
const fn spin(disc: usize, side: usize) -> usize {
    COUNT + 2 * disc + side
}

worded! {
    /// The quantities of a [`super::DiscImpact`], in the order of the columns that report them.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    #[non_exhaustive]
    pub enum Quantity {
        /// The coefficient of restitution e, dimensionless.
        Restitution = "e",
        /// J_t/J_n on the second disc, t 90° counter-clockwise from the line of centres.
        ImpulseRatio = "impulse_ratio",
        /// J_t/J_n from the change of the first disc's spin.
        ImpulseRatioByFirstSpin = "impulse_ratio_by_cue_spin",
        /// J_t/J_n from the change of the second disc's spin.
        ImpulseRatioBySecondSpin = "impulse_ratio_by_obj_spin",
        /// m₂/m₁: stated, or from the balance of momentum along the line of centres.
        MassRatio = "mass_ratio",
        /// Momentum gained along the line of centres, over the normal impulse.
        MomentumAlong = "momentum_along",
        /// Momentum gained across the line of centres, over the normal impulse.
        MomentumAcross = "momentum_across",
        /// Angular momentum gained about the contact point, over the normal impulse times the distance of the centres.
        AngularMomentum = "angular_momentum",
        /// Kinetic energy, of motion and rotation, that was lost, as a fraction of that before the impact.
        EnergyLost = "energy_lost",
        /// How fast the discs approach along the line of centres, m/s.
        ClosingSpeed = "closing_speed",
        /// Slip before the impact over the closing speed.
        SlipRatio = "slip_ratio",
        /// Slip of the second disc's contact point against the first's along t before the impact, m/s.
        SlipBefore = "slip",
        /// Slip of the second disc's contact point against the first's along t after the impact, m/s.
        SlipAfter = "slip_after",
        /// x of the line of centres, a unit vector from the first disc to the second.
        NormalX = "nx",
        /// y of the line of centres, a unit vector from the first disc to the second.
        NormalY = "ny",
        /// Distance of the centres at the impact, m.
        ContactDistance = "contact_distance_mm",
        /// Velocity of the first disc along x before the impact, m/s.
        FirstVxBefore = "cue_vx",
        /// Velocity of the first disc along y before the impact, m/s.
        FirstVyBefore = "cue_vy",
        /// Velocity of the second disc along x before the impact, m/s.
        SecondVxBefore = "obj_vx",
        /// Velocity of the second disc along y before the impact, m/s.
        SecondVyBefore = "obj_vy",
        /// Velocity of the first disc along x after the impact, m/s.
        FirstVxAfter = "cue_vx_after",
        /// Velocity of the first disc along y after the impact, m/s.
        FirstVyAfter = "cue_vy_after",
        /// Velocity of the second disc along x after the impact, m/s.
        SecondVxAfter = "obj_vx_after",
        /// Velocity of the second disc along y after the impact, m/s.
        SecondVyAfter = "obj_vy_after",
        /// Angular velocity of the first disc before the impact, counter-clockwise, rad/s.
        FirstSpinBefore = "cue_wz",
        /// Angular velocity of the first disc after the impact, rad/s.
        FirstSpinAfter = "cue_wz_after",
        /// Angular velocity of the second disc before the impact, rad/s.
        SecondSpinBefore = "obj_wz",
        /// Angular velocity of the second disc after the impact, rad/s.
        SecondSpinAfter = "obj_wz_after",
        /// Instant of the impact, s.
        Time = "impact_time_s",
    }
    /// Its column in discs.csv.
    pub fn column;
}

impl Quantity {
    /// The number of quantities.
    pub const COUNT: usize = Self::ALL.len();
}

/// All that was measured of an impact.
pub(super) struct Known {
    z: SVector<Dual, INPUTS>,
    pub covariance: SMatrix<f64, INPUTS, INPUTS>,
    /// How all this moves in each way in which the camera may be off: spins, which no scale changes, not at all.
    pub by_camera: Vec<SVector<f64, INPUTS>>,
    /// Whether each disc's rotation was seen.
    pub turns: [bool; 2],
    pub radii: [f64; 2],
    masses: Option<[f64; 2]>,
    inertia: f64,
    /// Of discs that stick: e from the growth of their distance.
    stuck: Option<Measured>,
    /// Whether only one coordinate was measured: what is across the line of centres is then unknown.
    is_one_dimensional: bool,
}

impl Known {
    pub(super) fn new(
        centres: &Centres,
        turns: [Option<Turn>; 2],
        discs: &Discs,
        (stuck, is_one_dimensional): (Option<Measured>, bool),
    ) -> Self {
        let mut values = SVector::<f64, INPUTS>::zeros();
        let mut covariance = SMatrix::<f64, INPUTS, INPUTS>::zeros();
        values.fixed_rows_mut::<COUNT>(0).copy_from(&centres.unknowns);
        covariance.fixed_view_mut::<COUNT, COUNT>(0, 0).copy_from(&centres.covariance);
        for (disc, turn) in turns.iter().enumerate() {
            if let Some(turn) = turn {
                for side in 0..2 {
                    values[spin(disc, side)] = turn.values[side];
                    for other in 0..2 {
                        covariance[(spin(disc, side), spin(disc, other))] = turn.covariance[(side, other)];
                    }
                }
            }
        }
        let half = 0.5 * centres.unknowns[DISTANCE];
        Self {
            z: SVector::from_fn(|i, _| Dual::from_re(values[i]).derivative(i)),
            covariance,
            by_camera: centres.by_camera.iter().map(|by| by.resize_generic(Const, Const, 0.0)).collect(),
            turns: turns.map(|turn| turn.is_some()),
            // marks on the edges that touch show no radius, and no slip is known that it would change
            radii: discs.radii.unwrap_or(if is_one_dimensional { [1.0; 2] } else { [half; 2] }),
            masses: discs.masses,
            inertia: discs.inertia,
            stuck,
            is_one_dimensional,
        }
    }

    fn velocity(&self, disc: usize, side: usize) -> [Dual; 2] {
        let first = velocity(disc, side);
        if self.stuck.is_some() && side == 1 {
            return stick::velocity_after(&self.z, disc);
        }
        [self.z[first], self.z[first + 1]]
    }

    /// Components of a vector along n and t.
    fn along(&self, [x, y]: [Dual; 2]) -> [Dual; 2] {
        let (sin, cos) = self.z[DIRECTION].sin_cos();
        [x * cos + y * sin, y * cos - x * sin]
    }

    /// g before (0) and after (1) the impact, along n and t.
    pub(super) fn relative(&self, side: usize) -> [Dual; 2] {
        let ([ux, uy], [vx, vy]) = (self.velocity(0, side), self.velocity(1, side));
        self.along([vx - ux, vy - uy])
    }

    /// Change of a disc's velocity, along n and t.
    fn change(&self, disc: usize) -> [Dual; 2] {
        let ([ax, ay], [bx, by]) = (self.velocity(disc, 0), self.velocity(disc, 1));
        self.along([bx - ax, by - ay])
    }

    /// Whether J_t is known.
    pub(super) fn is_seen_across(&self) -> bool {
        !self.is_one_dimensional
    }

    /// R₁ω₁ + R₂ω₂, the part of the slip that comes of the spins. `None` where one is not known.
    pub(super) fn rim(&self, side: usize) -> Option<Dual> {
        let known = self.turns == [true; 2] && !self.is_one_dimensional;
        known.then(|| self.z[spin(0, side)] * self.radii[0] + self.z[spin(1, side)] * self.radii[1])
    }

    pub(super) fn direction(&self) -> Dual {
        self.z[DIRECTION]
    }

    pub(super) fn values(&self) -> [Option<Measured>; Quantity::COUNT] {
        Quantity::ALL.map(|quantity| {
            if quantity == Quantity::Restitution && self.stuck.is_some() {
                return self.stuck;
            }
            let dual = self.quantity(quantity)?;
            // stated, not measured
            if quantity == Quantity::MassRatio && self.masses.is_some() {
                return Some(Measured { value: value(&dual), sd: None });
            }
            let gradient = gradient(&dual);
            let of_camera = self.by_camera.iter().map(|by| gradient.dot(by).powi(2)).sum::<f64>();
            let variance = gradient.dot(&(self.covariance * gradient)).max(0.0) + of_camera;
            Some(Measured { value: value(&dual), sd: Some(variance.sqrt()) })
        })
    }

    fn quantity(&self, quantity: Quantity) -> Option<Dual> {
        let ([g_n, g_t], [h_n, h_t]) = (self.relative(0), self.relative(1));
        let ([u_n, u_t], [v_n, v_t]) = (self.change(0), self.change(1));
        // m₂/m₁, where it is given
        let given = self.masses.map(|[first, second]| Dual::from_re(second / first));
        let mass_ratio = given.unwrap_or(-u_n / v_n);
        // Δω = −R J_t/(νMR²); J_n/m₁ = −Δu_n, J_n/m₂ = Δv_n
        let by_spin = |disc: usize, normal: Dual| {
            let change = self.z[spin(disc, 1)] - self.z[spin(disc, 0)];
            self.turns[disc].then(|| -change * self.inertia * self.radii[disc] / normal)
        };
        let of_disc = |disc: usize, side: usize| self.turns[disc].then(|| self.z[spin(disc, side)]);
        let component = |disc: usize, side: usize, k: usize| Some(self.velocity(disc, side)[k]);
        match quantity {
            Quantity::Restitution => Some(-h_n / g_n),
            Quantity::ImpulseRatio => (!self.is_one_dimensional).then(|| (h_t - g_t) / (h_n - g_n)),
            Quantity::ImpulseRatioByFirstSpin => by_spin(0, -u_n),
            Quantity::ImpulseRatioBySecondSpin => by_spin(1, v_n),
            Quantity::MassRatio => Some(mass_ratio),
            Quantity::MomentumAlong => given.map(|ratio| (u_n + ratio * v_n) / -u_n),
            Quantity::MomentumAcross => (!self.is_one_dimensional).then(|| (u_t + mass_ratio * v_t) / -u_n),
            Quantity::AngularMomentum => {
                // of either disc about the contact point: R (t × v) and νR²ω, per unit of m₁
                let of = |disc: usize, change: Dual, side: f64| {
                    let spin = self.z[spin(disc, 1)] - self.z[spin(disc, 0)];
                    change * (side * self.radii[disc]) + spin * (self.inertia * self.radii[disc].powi(2))
                };
                let gained = of(0, u_t, -1.0) + mass_ratio * of(1, v_t, 1.0);
                (self.turns == [true; 2]).then(|| gained / (-u_n * (self.radii[0] + self.radii[1])))
            }
            Quantity::EnergyLost => {
                let energy = |side: usize| {
                    let of = |disc: usize| {
                        let ([x, y], rim) =
                            (self.velocity(disc, side), self.z[spin(disc, side)] * self.radii[disc]);
                        x * x + y * y + rim * rim * self.inertia
                    };
                    of(0) + mass_ratio * of(1)
                };
                (self.turns == [true; 2]).then(|| -energy(1) / energy(0) + 1.0)
            }
            Quantity::ClosingSpeed => Some(-g_n),
            Quantity::SlipRatio => self.rim(0).map(|rim| (g_t - rim) / -g_n),
            Quantity::SlipBefore => self.rim(0).map(|rim| g_t - rim),
            Quantity::SlipAfter => self.rim(1).map(|rim| h_t - rim),
            Quantity::NormalX => Some(self.z[DIRECTION].cos()),
            Quantity::NormalY => Some(self.z[DIRECTION].sin()),
            Quantity::ContactDistance => Some(self.z[DISTANCE]),
            Quantity::FirstVxBefore => component(0, 0, 0),
            Quantity::FirstVyBefore => component(0, 0, 1),
            Quantity::SecondVxBefore => component(1, 0, 0),
            Quantity::SecondVyBefore => component(1, 0, 1),
            Quantity::FirstVxAfter => component(0, 1, 0),
            Quantity::FirstVyAfter => component(0, 1, 1),
            Quantity::SecondVxAfter => component(1, 1, 0),
            Quantity::SecondVyAfter => component(1, 1, 1),
            Quantity::FirstSpinBefore => of_disc(0, 0),
            Quantity::FirstSpinAfter => of_disc(0, 1),
            Quantity::SecondSpinBefore => of_disc(1, 0),
            Quantity::SecondSpinAfter => of_disc(1, 1),
            Quantity::Time => Some(self.z[TIME]),
        }
    }
}
