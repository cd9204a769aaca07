//! Time per collision of every fidelity, with and without Jacobian, over 10 000 mixed shots.
//!
//!     cargo bench
//!
//! Shots of 0.5–5 m/s, |φ| < 70°, roll, stun, draw, side spin, μ 0.02–0.1, μ_s 0.2–0.4,
//! e 0.9–0.98. Only ratios of one run mean anything on another machine.

use caromfit::physics::ball::{Ball, BallState, Vec3};
use caromfit::physics::collision::{Coefficients, Effects, Fidelity, Model};
use caromfit::physics::contact_frame::cue_velocity;
use divan::{Bencher, black_box, counter::ItemsCount};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

fn main() {
    divan::main();
}

const SHOTS: usize = 10_000;

/// What is integrated takes long: so many of the shots do.
const INTEGRATED: usize = 100;

/// At most, for each line.
const SECONDS: f64 = 2.0;

fn shots() -> Vec<(BallState, Coefficients)> {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let radius = Ball::POOL.radius;
    let mut shot = || {
        let speed = rng.random_range(0.5..5.0);
        let velocity = cue_velocity(speed, rng.random_range(-70.0_f64..70.0).to_radians());
        let roll = BallState::natural_roll(velocity, radius).spin;
        let side = Vec3::z() * (rng.random_range(-1.0..1.0) * speed / radius);
        let spin = match rng.random_range(0..4) {
            0 => roll,
            1 => Vec3::zeros(),
            2 => -roll,
            _ => roll + side,
        };
        let coefficients = Coefficients {
            mu: rng.random_range(0.02..0.1),
            mu_s: rng.random_range(0.2..0.4),
            e: rng.random_range(0.9..0.98),
        };
        (BallState { velocity, spin }, coefficients)
    };
    (0..SHOTS).map(|_| shot()).collect()
}

/// Time is per pass over the shots, throughput counts collisions.
fn timed(bencher: Bencher, model: &Model, derivatives: bool) {
    let mut shots = shots();
    if model.fidelity.is_integrated() {
        shots.truncate(INTEGRATED);
    }
    bencher.counter(ItemsCount::new(shots.len())).bench_local(|| {
        for (cue, coefficients) in &shots {
            if derivatives {
                let _ = black_box(model.collide_with_jacobian(black_box(cue), coefficients));
            } else {
                let _ = black_box(model.collide(black_box(cue), coefficients));
            }
        }
    });
}

#[divan::bench(args = Fidelity::ALL.map(Fidelity::name), max_time = SECONDS)]
fn single(bencher: Bencher, fidelity: &str) {
    timed(bencher, &Model::new(fidelity.parse().unwrap(), Ball::POOL), false);
}

#[divan::bench(args = Fidelity::ALL.map(Fidelity::name), max_time = SECONDS)]
fn single_with_jacobian(bencher: Bencher, fidelity: &str) {
    timed(bencher, &Model::new(fidelity.parse().unwrap(), Ball::POOL), true);
}

/// A contact that gives way along its surface, as a fit computes it; and what it takes with all derivatives.
#[divan::bench(args = [false, true], max_time = SECONDS)]
fn compliant(bencher: Bencher, derivatives: bool) {
    let effects = Effects { compliance: true, ..Fidelity::Full.effects() };
    let tolerance = Model::TOLERANCE_OF_FITS;
    let ode = Model::new(Fidelity::Ode, Ball::POOL);
    timed(bencher, &Model { effects, kappa: Model::KAPPA, tolerance, ..ode }, derivatives);
}
