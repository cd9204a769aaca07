//! A contact that gives way and slides at first touch by so little, or holds so barely, that what it does next decides: the outcome is
//! continuous there, and all ways to compute it agree.

use super::compliant::{apart, compliant};

use crate::prelude::*;

/// A shot at a closing speed of 1 m/s whose slip is (1 + d)μκ of it, in some direction.
struct Marginal {
    mu: f64,
    kappa: f64,
    angle: f64,
    mu_s: f64,
    e: f64,
    mass_ratio: f64,
}

impl Marginal {
    fn random(rng: &mut ChaCha8Rng) -> Self {
        Self {
            mu: rng.random_range(0.02..0.3),
            // above 3.5 a contact that holds at first is the one that lets go at once
            kappa: rng.random_range(0.3..5.0),
            angle: rng.random_range(0.0..std::f64::consts::TAU),
            mu_s: rng.random_range(0.0..0.4),
            e: rng.random_range(0.5..1.0),
            mass_ratio: rng.random_range(0.8..1.2),
        }
    }

    fn model(&self, fidelity: Fidelity, tolerance: f64) -> Model {
        let model = Model { kappa: self.kappa, tolerance, ..compliant(fidelity, Ball::POOL) };
        model.with_mass_ratio(self.mass_ratio)
    }

    fn shot(&self, d: f64) -> (BallState, Coefficients) {
        let (slip, radius) = (self.mu * self.kappa * (1.0 + d), Ball::POOL.radius);
        let (sin, cos) = self.angle.sin_cos();
        // v_y = −Rω_z, v_z = Rω_y
        let spin = Vec3::new(0.0, slip * sin / radius, -slip * cos / radius);
        let coefficients = Coefficients { mu: self.mu, mu_s: self.mu_s, e: self.e };
        (BallState { velocity: Vec3::new(1.0, 0.0, 0.0), spin }, coefficients)
    }
}

/// From 1e-13 to 1e-2, of both signs.
fn small(rng: &mut ChaCha8Rng) -> f64 {
    let size = 10_f64.powf(rng.random_range(-13.0..-2.0));
    if rng.random_bool(0.5) { size } else { -size }
}

const WAYS: [(Fidelity, f64); 4] = [
    (Fidelity::Ode, Model::TOLERANCE_OF_FITS),
    (Fidelity::Ode, 1e-8),
    (Fidelity::Ode, 1e-11),
    (Fidelity::Contact, 1e-10),
];

/// All ways agree with the finest to the error of the quick one, and each is continuous.
#[test]
fn the_outcome_is_continuous_where_sliding_sets_in() {
    /// The slip differs by dμκ < 1.5d, and the outcome by no more than twice that.
    const SLOPE: f64 = 3.0;
    /// Of an outcome: some dozen steps.
    const STEPS: f64 = 30.0;
    /// Of the quick way, and of `contact` at its tolerance, parts of the speed.
    const QUICK: f64 = 1e-6;
    let mut rng = ChaCha8Rng::seed_from_u64(31);
    for number in 0..300 {
        let marginal = Marginal::random(&mut rng);
        let d = small(&mut rng);
        let at = |d: f64, (fidelity, tolerance): (Fidelity, f64)| {
            let (cue, coefficients) = marginal.shot(d);
            marginal.model(fidelity, tolerance).collide(&cue, &coefficients).unwrap()
        };
        let here = WAYS.map(|way| at(d, way));
        for (way, outcome) in WAYS.into_iter().zip(here) {
            let off = apart(&outcome, &here[2]);
            assert!(off < QUICK, "{way:?} {d:e}: {off:e} {}", marginal.kappa);
            // every third suffices
            if number % 3 == 0 {
                let jump = apart(&outcome, &at(0.0, way));
                assert!(jump < SLOPE * d.abs() + STEPS * way.1, "{way:?} {d:e}: {jump:e}");
            }
        }
    }
}

#[test]
fn stiff_contacts_come_to_an_end_at_every_tolerance() {
    /// The shaking changes the outcome by so much, over √κ and the speed.
    const SHAKES: f64 = 0.3;
    let velocity = cue_velocity(2.0, 3_f64.to_radians());
    let cue = BallState { velocity, spin: Vec3::zeros() };
    let coefficients = Coefficients { mu: 0.3, mu_s: 0.3, e: 0.94 };
    let rigid = Model::new(Fidelity::Full, Ball::POOL).collide(&cue, &coefficients).unwrap();
    for fidelity in [Fidelity::Ode, Fidelity::Contact] {
        for (kappa, tolerance) in [(1e-5, 1e-12), (1e-6, 1e-6), (1e-6, 1e-4)] {
            let model = Model { kappa, tolerance, ..compliant(fidelity, Ball::POOL) };
            let apart = apart(&model.collide(&cue, &coefficients).unwrap(), &rigid);
            assert!(apart < 2.0 * SHAKES * kappa.sqrt() + 30.0 * tolerance, "{kappa:e} {apart:e}");
        }
    }
}
