//! The integrated fidelities `ode` and `contact` against the reference values, `full`, and what physics asks of them.

use super::collisions;
use super::plain::difference;

use crate::prelude::*;

/// The tolerance is for each step, and relative to the closing speed: an outcome sums up some dozen steps.
const STEPS: f64 = 20.0;

/// The largest difference of velocities, and spins times R, relative to the closing speed.
fn off(a: &Outcome, b: &Outcome, radius: f64, k: f64) -> f64 {
    difference(a, b, radius) / k
}

/// Kinetic energy of both balls per unit mass.
fn energy(ball: &Ball, outcome: &Outcome) -> f64 {
    collisions::energy(ball, &outcome.cue) + collisions::energy(ball, &outcome.object)
}

/// `contact` without weight, with more or less of the cloth's friction.
fn weightless(effects: Effects) -> Model {
    Model { effects: Effects { gravity: false, ..effects }, ..Model::new(Fidelity::Contact, Ball::POOL) }
}

#[test]
fn friction_of_the_cloth_takes_energy() {
    let ball = Ball::POOL;
    let velocity = cue_velocity(2.0, 30_f64.to_radians());
    let coefficients = Coefficients { mu: 0.06, mu_s: 0.3, e: 0.94 };
    let draw = BallState { velocity, spin: -BallState::natural_roll(velocity, ball.radius).spin };
    let with = weightless(Effects::ALL);
    let without = weightless(Effects { cloth_on_cue: false, ..Effects::ALL });
    let [without, with] = [without, with].map(|model| model.collide(&draw, &coefficients).unwrap());
    // the cue ball is pressed down and slides: the cloth takes μ_k J_z off both balls together, along its
    // slip, which turns a little during the impact
    let momentum = |o: &Outcome| o.cue.velocity + o.object.velocity;
    let lost = (momentum(&without) - momentum(&with))
        / (Model::new(Fidelity::Contact, ball).mu_k * with.object.velocity.z);
    let slip = |state: &BallState| cloth_slip(state, ball.radius).xy().normalize();
    let (first, last) = (slip(&draw), slip(&with.cue));
    assert!(last.x < lost.x && lost.x < first.x, "{lost} {first} {last}");
    assert!(first.y < lost.y && lost.y < last.y, "{lost} {first} {last}");
    assert!(energy(&ball, &with) < energy(&ball, &without));
}

#[test]
fn the_true_slip_direction_turns_the_cloths_friction() {
    // inside english on a rolling ball: the object ball is thrown sideways while pressed into the cloth
    let ball = Ball::POOL;
    let velocity = cue_velocity(2.0, 30_f64.to_radians());
    let mut cue = BallState::natural_roll(velocity, ball.radius);
    cue.spin.z = 60.0;
    let coefficients = Coefficients { mu: 0.06, mu_s: 0.3, e: 0.94 };
    let straight = weightless(Effects { cloth_turning: false, ..Effects::ALL });
    let turning = weightless(Effects::ALL);
    let [straight, turning] = [straight, turning].map(|model| model.collide(&cue, &coefficients).unwrap());
    // the cloth now also holds back the throw, by less than μμ_s of the impulse
    let (a, b) = (straight.object.velocity, turning.object.velocity);
    assert!(a.y * b.y > 0.0 && b.y.abs() < a.y.abs(), "{a} {b}");
    assert!((a - b).norm() < 0.06 * 0.3 * straight.impulse * a.y.abs(), "{a} {b}");
    // and gives the object ball a little of the roll about x
    assert!(straight.object.spin.x == 0.0 && turning.object.spin.x != 0.0);
}

#[test]
fn gravity_matters_as_its_impulse_does() {
    let ball = Ball::POOL;
    let coefficients = Coefficients { mu: 0.06, mu_s: 0.3, e: 0.94 };
    for speed in [0.05, 0.2, 1.0, 5.0] {
        let velocity = cue_velocity(speed, 30_f64.to_radians());
        // a sliding ball without spin loses μ_k g Δt on the cloth
        let cue = BallState::stun(velocity);
        let with = Model::new(Fidelity::Contact, ball);
        let without = Model { effects: Effects { gravity: false, ..Effects::ALL }, ..with };
        let [with, without] = [with, without].map(|model| model.collide(&cue, &coefficients).unwrap());
        let duration = Model::CONTACT_TIME * velocity.x.powf(-0.2) * 0.5 * (1.0 + coefficients.e);
        let lost = (with.cue.velocity - without.cue.velocity).norm();
        let weight = 0.2 * 9.81 * duration;
        assert!(lost > 0.3 * weight && lost < 1.2 * weight, "{speed}: {lost:e} {weight:e}");
    }
}

/// A slow rolling ball is not lifted at all where μF stays below its weight.
#[test]
fn a_ball_lifts_off_only_where_friction_beats_its_weight() {
    let ball = Ball::POOL;
    let coefficients = Coefficients { mu: 0.05, mu_s: 0.3, e: 0.94 };
    let up = |speed: f64| {
        let cue = BallState::natural_roll(cue_velocity(speed, 0.0), ball.radius);
        let outcome = Model::new(Fidelity::Contact, ball).collide(&cue, &coefficients).unwrap();
        outcome.cue.velocity.z / (coefficients.mu * outcome.impulse)
    };
    // F reaches 1.4 k/Δt·…: at 2 cm/s μF is 6 m/s², at 10 cm/s twice g for part of the contact
    assert_eq!(up(0.02), 0.0);
    let slow = up(0.15);
    assert!(slow > 0.0 && slow < 0.8, "{slow}");
    assert!((up(5.0) - 1.0).abs() < 0.02);
}

/// Every ordinary shot is integrated with all effects. (Stun shots hop: the balls' grip presses one of them onto the
/// cloth and lifts the other, by turns.)
#[test]
fn ordinary_shots_are_integrated() {
    /// Of U. Mostly the tolerance; some hundred of them where hops die away, of which the last ones are cut off.
    /// What the weight does is of 3e-4.
    const HOPS: f64 = 1e-5;
    const TOLERANCES: f64 = 50.0;
    let coefficients = Coefficients { mu: 0.05, mu_s: 0.3, e: 0.94 };
    let at = |tolerance: f64| Model { tolerance, ..Model::new(Fidelity::Contact, Ball::POOL) };
    let finest = at(1e-12);
    let mut errors = Vec::new();
    for i in 0..150 {
        let velocity = cue_velocity(0.3 + 0.02 * f64::from(i), (0.5 * f64::from(i)).to_radians());
        let roll = BallState::natural_roll(velocity, Ball::POOL.radius);
        let draw = BallState { velocity, spin: -roll.spin };
        for cue in [roll, draw, BallState::stun(velocity)] {
            let exact = finest.collide(&cue, &coefficients).unwrap();
            for tolerance in [1e-6, 1e-8, 1e-10] {
                let found = at(tolerance).collide(&cue, &coefficients).unwrap();
                for (found, exact) in [(&found.cue, &exact.cue), (&found.object, &exact.object)] {
                    let error = (found.velocity - exact.velocity).norm() / velocity.norm();
                    assert!(error < HOPS.max(TOLERANCES * tolerance), "{error:e} at {tolerance:e}: {cue:?}");
                    errors.push(error / tolerance);
                }
            }
        }
    }
    errors.sort_by(f64::total_cmp);
    assert!(errors[errors.len() * 9 / 10] < TOLERANCES, "{}", errors[errors.len() * 9 / 10]);
}

/// Shots whose three contacts stick and slide by turns: rough balls and cloths, slow and fast, without slip between the balls
/// at first, or with a cue ball that skids sideways on the cloth. Slip that sets in is followed to the tolerance, and so
/// are the many small hops of slow balls.
#[test]
fn contacts_that_stick_and_slip_by_turns_are_integrated() {
    /// Of U, at the default tolerance against one of 1e-12: up to a thousand steps instead of some dozen.
    const MOST: f64 = 1e-8;
    const USUALLY: f64 = 1e-9;
    let ball = Ball::POOL;
    let at = |tolerance: f64| Model { tolerance, ..Model::new(Fidelity::Contact, ball) };
    let mut errors = Vec::new();
    for speed in [1e-3, 2e-3, 0.02, 0.3, 5.0] {
        for cut in [-60_f64, -30.0, -5.0, 0.0, 15.0, 45.0] {
            let (sin, cos) = cut.to_radians().sin_cos();
            let spin = speed / ball.radius;
            // a skid sideways; no slip between the balls: of a sliding ball, one that turns sideways, one that rolls
            let spins = [
                Vec3::new(-1.9117 * spin, 0.0, 0.0),
                Vec3::new(0.0, 0.0, -spin * sin),
                Vec3::new(-spin * sin, 0.0, -spin * sin),
                Vec3::new(-spin * sin, spin * cos, -spin * sin),
            ];
            for (mu, mu_s) in [(0.05, 0.3), (0.3, 1.0), (0.5, 0.3), (1.0, 0.0), (1.0, 0.6), (1.0, 1.0)] {
                for spin in spins {
                    let cue = BallState { velocity: cue_velocity(speed, cut.to_radians()), spin };
                    let coefficients = Coefficients { mu, mu_s, e: 0.94 };
                    let [found, exact] = [Model::TOLERANCE, 1e-12].map(|tolerance| {
                        at(tolerance).collide(&cue, &coefficients).unwrap_or_else(|error| {
                            panic!("{error} at {tolerance:e}: {cue:?} {coefficients:?}")
                        })
                    });
                    let error = off(&found, &exact, ball.radius, speed);
                    assert!(error < MOST, "{error:e}: {cue:?} {coefficients:?}");
                    assert!(energy(&ball, &found) <= collisions::energy(&ball, &cue));
                    errors.push(error);
                    // a rigid contact without weight
                    let [full, ode] = [Fidelity::Full, Fidelity::Ode]
                        .map(|fidelity| Model::new(fidelity, ball).collide(&cue, &coefficients).unwrap());
                    let error = off(&full, &ode, ball.radius, speed);
                    assert!(error < STEPS * Model::TOLERANCE, "{error:e}: {cue:?} {coefficients:?}");
                }
            }
        }
    }
    errors.sort_by(f64::total_cmp);
    assert!(errors[errors.len() * 95 / 100] < USUALLY, "{:e}", errors[errors.len() * 95 / 100]);
}
