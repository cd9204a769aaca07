//! Time per collision of every fidelity, with and without Jacobian, over 10 000 mixed shots.
//!
//!     cargo bench
//!
//! Shots of 0.5–5 m/s, |φ| < 70°, roll, stun, draw, side spin, μ 0.02–0.1, μ_s 0.2–0.4,
//! e 0.9–0.98. Only ratios of one run mean anything on another machine.

use caromfit::physics::ball::{Ball, BallState, Vec3};
use caromfit::physics::collision::batch::{Arrays, Cues};
use caromfit::physics::collision::{Coefficients, Fidelity, Jacobian, Model};
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

/// In batches.
const CLOSED: [&str; 4] = ["elastic", "inelastic", "linear", "full"];
const COEFFICIENTS: Coefficients = Coefficients { mu: 0.06, mu_s: 0.3, e: 0.94 };

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
#[divan::bench(args = Fidelity::ALL.map(Fidelity::name), max_time = SECONDS)]
fn single(bencher: Bencher, fidelity: &str) {
    let (model, shots) = setting(fidelity);
    bencher.counter(ItemsCount::new(shots.len())).bench_local(|| {
        for (cue, coefficients) in &shots {
            let _ = black_box(model.collide(black_box(cue), coefficients));
        }
    });
}

#[divan::bench(args = Fidelity::ALL.map(Fidelity::name), max_time = SECONDS)]
fn single_with_jacobian(bencher: Bencher, fidelity: &str) {
    let (model, shots) = setting(fidelity);
    bencher.counter(ItemsCount::new(shots.len())).bench_local(|| {
        for (cue, coefficients) in &shots {
            let _ = black_box(model.collide_with_jacobian(black_box(cue), coefficients));
        }
    });
}

/// The same shots, as structures of arrays; with coefficients in common.
#[divan::bench(args = CLOSED, max_time = SECONDS)]
fn batch(bencher: Bencher, fidelity: &str) {
    let (model, shots) = setting(fidelity);
    let columns = columns(&shots);
    let mut arrays = Arrays::new(shots.len());
    bencher.counter(ItemsCount::new(shots.len())).bench_local(|| {
        let cues = cues(black_box(&columns));
        let _ = black_box(model.collide_batch(&cues, &COEFFICIENTS, &mut arrays.outcomes()));
    });
}

#[divan::bench(args = CLOSED, max_time = SECONDS)]
fn batch_with_jacobian(bencher: Bencher, fidelity: &str) {
    let (model, shots) = setting(fidelity);
    let columns = columns(&shots);
    let mut arrays = Arrays::new(shots.len());
    let mut jacobians = vec![Jacobian::zeros(); shots.len()];
    bencher.counter(ItemsCount::new(shots.len())).bench_local(|| {
        let (cues, outcomes) = (cues(black_box(&columns)), &mut arrays.outcomes());
        let _ = black_box(model.collide_batch_with_jacobian(&cues, &COEFFICIENTS, outcomes, &mut jacobians));
    });
}

/// For a fair comparison with `batch`: one at a time, with these coefficients.
#[divan::bench(args = CLOSED, max_time = SECONDS)]
fn single_in_common(bencher: Bencher, fidelity: &str) {
    let (model, shots) = setting(fidelity);
    bencher.counter(ItemsCount::new(shots.len())).bench_local(|| {
        for (cue, _) in &shots {
            let _ = black_box(model.collide(black_box(cue), &COEFFICIENTS));
        }
    });
}

fn columns(shots: &[(BallState, Coefficients)]) -> [Vec<f64>; 5] {
    let column = |of: fn(&BallState) -> f64| shots.iter().map(|(cue, _)| of(cue)).collect();
    [
        column(|cue| cue.velocity.x),
        column(|cue| cue.velocity.y),
        column(|cue| cue.spin.x),
        column(|cue| cue.spin.y),
        column(|cue| cue.spin.z),
    ]
}

fn cues(columns: &[Vec<f64>; 5]) -> Cues<'_> {
    let [x, y, spins @ ..] = columns.each_ref().map(Vec::as_slice);
    Cues { velocity: [x, y], spin: spins }
}

fn setting(fidelity: &str) -> (Model, Vec<(BallState, Coefficients)>) {
    let fidelity = Fidelity::ALL.into_iter().find(|f| f.name() == fidelity).expect("a name of a fidelity");
    let mut shots = shots();
    if matches!(fidelity, Fidelity::Ode | Fidelity::Contact) {
        shots.truncate(INTEGRATED);
    }
    (Model::new(fidelity, Ball::POOL), shots)
}
