//! What follows from the own and shared unknowns of a shot, with errors carried over by exact
//! derivatives.

use num_dual::DualNum;
use statrs::distribution::{ContinuousCDF, Normal};

use super::motion::{Dual, DualVector, Gradient, Impact, gradient, slip};
use super::stick::Stuck;
use crate::extraction::disc::Quantity;
use crate::measurement::dataset::Measured;
use crate::measurement::number::with_error;
use crate::physics::disc::Discs;

/// What was measured of the impact of a shot, whatever the law of friction. Velocities are in m/s and
/// spins in rad/s in the frame of the table; if the frame rate is not known, per frame.
#[derive(Clone, Debug)]
pub struct DiscImpact {
    /// Name of the shot.
    pub name: String,
    /// Value of each [`Quantity`]; `None` if the tracks do not determine it.
    pub values: [Option<Measured>; Quantity::COUNT],
    /// Standard deviations of a coordinate of the first and of the second disc, m.
    pub position_sd: [f64; 2],
    /// Variance of the frames about the paths over that of their noise before anything was fitted.
    pub misfit: f64,
    /// Number of frames that were used: of the first disc before and after the impact, and of the
    /// second.
    pub frames: [usize; 4],
    /// First and last instant that was used, s.
    pub window: [f64; 2],
    /// Number of frames on either side of the impact in which the discs still touch.
    pub touching: usize,
    /// How the discs stick together after the impact, if they do.
    pub stuck: Option<Stuck>,
}

impl DiscImpact {
    /// Returns the value of a quantity if the tracks determine it.
    #[must_use]
    pub fn get(&self, quantity: Quantity) -> Option<Measured> {
        self.values[quantity as usize]
    }

    /// Returns a sentence if e is not that of an impact, but for this tail probability.
    pub(super) fn find_impossible_restitution(&self, tail: f64) -> Option<String> {
        let Measured { value, sd } = self.get(Quantity::Restitution)?;
        let outside = (value - 1.0).max(-value);
        let is_impossible = Normal::new(0.0, sd?).is_ok_and(|normal| normal.sf(outside) < tail);
        is_impossible.then(|| {
            let e = with_error(value, sd.unwrap_or(0.0));
            format!("its e of {e} is not between 0 and 1, as that of any passive impact is")
        })
    }
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

    /// Returns the value of each quantity with the standard error that `variance` gives a gradient.
    pub fn values(
        &self,
        stuck: Option<&Stuck>,
        variance: impl Fn(&Gradient) -> f64,
    ) -> [Option<Measured>; Quantity::COUNT] {
        Quantity::ALL.map(|quantity| {
            if let (Quantity::Restitution, Some(stuck)) = (quantity, stuck) {
                return Some(stuck.restitution);
            }
            let dual = self.quantity(quantity)?;
            // stated, not measured
            let is_stated = quantity == Quantity::MassRatio && self.discs.masses.is_some();
            let sd = (!is_stated).then(|| variance(&gradient(&dual)).max(0.0).sqrt());
            Some(Measured { value: dual.re, sd })
        })
    }
}
