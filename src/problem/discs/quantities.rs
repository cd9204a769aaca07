//! Quantities of a shot that follow from its own and shared unknowns, with errors by exact derivatives.

use num_dual::DualNum;

use super::motion::{Dual, DualVector, Impact, InputCovariance, slip};
use super::stick::Stuck;
use crate::measurement::dataset::Measured;
use crate::physics::disc::Discs;
use crate::physics::name::worded;
use crate::problem::film::dual::gradient;

worded! {
    /// The quantities of a [`super::impact::DiscImpact`], in the order of the columns that report them.
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
        /// Angular momentum gained about the contact point, over the normal impulse times the distance of the
        /// centres.
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

/// An impact of which something follows.
pub(super) struct Known<'a> {
    pub impact: &'a Impact,
    pub discs: &'a Discs,
    /// Whether the rotation of each disc was seen.
    pub turns: [bool; 2],
    /// Whether both coordinates were measured.
    pub is_seen_across: bool,
    /// Whether both spins before the impact are known.
    pub knows_slip: bool,
}

impl Known<'_> {
    /// Returns the components of a vector along n and t.
    fn along(&self, vector: &DualVector) -> [Dual; 2] {
        let (sin, cos) = self.impact.direction.sin_cos();
        [vector.x * cos + vector.y * sin, vector.y * cos - vector.x * sin]
    }

    /// Returns g before (0) and after (1) the impact, along n and t.
    fn relative(&self, side: usize) -> [Dual; 2] {
        let [first, second] = self.impact.velocities;
        self.along(&(second[side] - first[side]))
    }

    /// Returns e and J_t/J_n of the paths.
    pub fn outcome(&self) -> [Dual; 2] {
        let ([g_n, g_t], [h_n, h_t]) = (self.relative(0), self.relative(1));
        [-h_n / g_n, (h_t - g_t) / (h_n - g_n)]
    }

    fn quantity(&self, quantity: Quantity) -> Option<Dual> {
        let ([g_n, g_t], [_, h_t]) = (self.relative(0), self.relative(1));
        let Impact { velocities, spins, radii, .. } = self.impact;
        let change = |disc: usize| self.along(&(velocities[disc][1] - velocities[disc][0]));
        let ([u_n, u_t], [v_n, v_t]) = (change(0), change(1));
        // m₂/m₁, if it is stated
        let stated = self.discs.masses.map(|[first, second]| Dual::from_re(second / first));
        let mass_ratio = stated.unwrap_or(-u_n / v_n);
        let inertia = self.discs.inertia;
        let turned = |disc: usize| spins[disc][1] - spins[disc][0];
        // Δω = −R J_t/(νMR²); J_n/m₁ = −Δu_n, J_n/m₂ = Δv_n
        let by_spin = |disc: usize, normal: Dual| {
            self.turns[disc].then(|| -turned(disc) * radii[disc] * inertia / normal)
        };
        let spin = |disc: usize, side: usize| self.turns[disc].then(|| spins[disc][side]);
        let both_turn = self.turns == [true; 2];
        let slip_on = |side: usize| slip(&[g_t, h_t][side], radii, &[spins[0][side], spins[1][side]]);
        match quantity {
            Quantity::Restitution => Some(self.outcome()[0]),
            Quantity::ImpulseRatio => self.is_seen_across.then(|| self.outcome()[1]),
            Quantity::ImpulseRatioByFirstSpin => by_spin(0, -u_n),
            Quantity::ImpulseRatioBySecondSpin => by_spin(1, v_n),
            Quantity::MassRatio => Some(mass_ratio),
            Quantity::MomentumAlong => stated.map(|ratio| (u_n + ratio * v_n) / -u_n),
            Quantity::MomentumAcross => self.is_seen_across.then(|| (u_t + mass_ratio * v_t) / -u_n),
            Quantity::AngularMomentum => {
                // of either disc about the contact point: R (t × v) and νR²ω, per unit of m₁
                let of = |disc: usize, change: Dual, side: f64| {
                    change * radii[disc] * side + turned(disc) * radii[disc] * radii[disc] * inertia
                };
                let gained = of(0, u_t, -1.0) + mass_ratio * of(1, v_t, 1.0);
                both_turn.then(|| gained / (-u_n * (radii[0] + radii[1])))
            }
            Quantity::EnergyLost => {
                let energy = |side: usize| {
                    let of = |disc: usize| {
                        let rim = spins[disc][side] * radii[disc];
                        velocities[disc][side].dot(&velocities[disc][side]) + rim * rim * inertia
                    };
                    of(0) + mass_ratio * of(1)
                };
                both_turn.then(|| -energy(1) / energy(0) + 1.0)
            }
            Quantity::ClosingSpeed => Some(-g_n),
            Quantity::SlipRatio => self.knows_slip.then(|| slip_on(0) / -g_n),
            Quantity::SlipBefore => self.knows_slip.then(|| slip_on(0)),
            Quantity::SlipAfter => both_turn.then(|| slip_on(1)),
            Quantity::NormalX => Some(self.impact.direction.cos()),
            Quantity::NormalY => Some(self.impact.direction.sin()),
            Quantity::ContactDistance => Some(self.impact.distance),
            Quantity::FirstVxBefore => Some(velocities[0][0].x),
            Quantity::FirstVyBefore => Some(velocities[0][0].y),
            Quantity::SecondVxBefore => Some(velocities[1][0].x),
            Quantity::SecondVyBefore => Some(velocities[1][0].y),
            Quantity::FirstVxAfter => Some(velocities[0][1].x),
            Quantity::FirstVyAfter => Some(velocities[0][1].y),
            Quantity::SecondVxAfter => Some(velocities[1][1].x),
            Quantity::SecondVyAfter => Some(velocities[1][1].y),
            Quantity::FirstSpinBefore => spin(0, 0),
            Quantity::FirstSpinAfter => spin(0, 1),
            Quantity::SecondSpinBefore => spin(1, 0),
            Quantity::SecondSpinAfter => spin(1, 1),
            Quantity::Time => Some(self.impact.time),
        }
    }

    /// Returns the value of each quantity with its standard error.
    pub fn values(
        &self,
        stuck: Option<&Stuck>,
        inputs: &InputCovariance,
    ) -> [Option<Measured>; Quantity::COUNT] {
        Quantity::ALL.map(|quantity| {
            if let (Quantity::Restitution, Some(stuck)) = (quantity, stuck) {
                return Some(stuck.restitution);
            }
            let dual = self.quantity(quantity)?;
            // stated, not measured
            let is_stated = quantity == Quantity::MassRatio && self.discs.masses.is_some();
            let sd = (!is_stated).then(|| gradient(&dual).dot(&(inputs * gradient(&dual))).max(0.0).sqrt());
            Some(Measured { value: dual.re, sd })
        })
    }
}
