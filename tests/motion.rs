//! Motion on the cloth, and collisions in the frame of the table.

use caromfit::physics::cloth_motion::{GRAVITY, Path};
use caromfit::physics::contact_frame::CollisionFrame;

use crate::prelude::*;

/// Sums of a few terms.
const ROUNDING: f64 = 1e-13;

/// The path from 0.5 s on of a ball with the velocity (1.5, −0.5, `up`).
fn path_after(slip: [f64; 2], up: f64, cloth: &Cloth) -> Path {
    let ball = Ball::POOL;
    // s = (V_x − RΩ_y, V_y + RΩ_x)
    let spin = Vec3::new(slip[1] + 0.5, 1.5 - slip[0], 0.0) / ball.radius;
    let state = BallState { velocity: Vec3::new(1.5, -0.5, up), spin };
    Path::through([&state; 2], &ball, [1.0, 2.0], 0.5, cloth)
}

#[test]
fn a_sliding_ball_ends_rolling_with_v_minus_two_sevenths_of_its_slip() {
    for up in [0.0, 0.05, 0.3] {
        let cloth = Cloth { rolling: 0.0, ..Cloth::default() };
        let slip = [1.0, 0.4];
        let path = path_after(slip, up, &cloth);
        let velocity = path.velocity(5.0);
        for i in 0..2 {
            let expected = [1.5, -0.5][i] - 2.0 / 7.0 * slip[i];
            assert!((velocity[i] - expected).abs() < ROUNDING, "{velocity:?}");
        }
    }
}

#[test]
fn sliding_lasts_two_sevenths_of_the_slip_over_mu_g() {
    let path = path_after([0.7, 0.0], 0.0, &Cloth { rolling: 0.0, ..Cloth::default() });
    let lasts = 2.0 * 0.7 / (7.0 * 0.2 * GRAVITY);
    let [before, at, after] = [0.9, 1.0, 1.5].map(|part| path.velocity(0.5 + part * lasts)[0]);
    assert!((before - (1.5 - 0.9 * lasts * 0.2 * GRAVITY)).abs() < ROUNDING);
    assert!((at - after).abs() < ROUNDING && (before - at) > 0.09 * lasts * 0.2 * GRAVITY);
}

#[test]
fn a_bounce_that_becomes_a_flight_does_not_move_the_path() {
    /// μ_k(1 + e_t)V_z²/g of the least rebound is 0.12 µm.
    const SAME: f64 = 2e-7;
    for bounces in 0..7 {
        let up = 0.002 / 0.5_f64.powi(bounces);
        let at = |up: f64, time: f64| path_after([1.0, 0.4], up, &Cloth::default()).position(time);
        for time in [0.501, 0.51, 0.53, 0.6, 0.8] {
            let [low, high] = [1.0 - 1e-9, 1.0 + 1e-9].map(|part| at(part * up, time));
            assert!((low[0] - high[0]).hypot(low[1] - high[1]) < SAME, "{up} {time}");
        }
    }
}

fn norm(v: [f64; 2]) -> f64 {
    v[0].hypot(v[1])
}

#[test]
fn a_ball_that_bounces_for_ever_has_a_path_with_an_end() {
    for bounce in [0.0, 0.5, 0.9, 0.99, 1.0] {
        let cloth = Cloth { bounce, ..Cloth::default() };
        for up in [0.0, 0.0021, 0.05, 0.3] {
            let path = path_after([5.0, 0.0], up, &cloth);
            assert!(path.changes().count() <= 64 + 4, "{bounce} {up}: {} stretches", path.changes().count());
            // the cloth pushes with Mg on average, landing by landing: within what one landing takes
            for seconds in [0.15, 0.4] {
                let velocity = path.velocity(0.5 + seconds);
                let expected = 1.5 - 0.2 * (GRAVITY * seconds - up);
                assert!(
                    (velocity[0] - expected).abs() < 0.2 * (1.0 + bounce) * up + ROUNDING,
                    "{bounce} {up}: {velocity:?}"
                );
            }
            assert!(norm(path.velocity(1e4)) < ROUNDING);
        }
    }
}

#[test]
fn the_spin_follows_the_slip_until_the_ball_rolls() {
    let (slip, ball) = ([1.0, 0.4], Ball::POOL);
    for up in [0.0, 0.1] {
        let path = path_after(slip, up, &Cloth::default());
        for time in [0.5, 0.55, 0.6, 0.9, 1.5] {
            let velocity = path.velocity(time);
            let spin = path.spin(time, ball.radius);
            // s = (V_x − RΩ_y, V_y + RΩ_x)
            let left = [velocity[0] - ball.radius * spin[1], velocity[1] + ball.radius * spin[0]];
            assert!((left[0] * slip[1] - left[1] * slip[0]).abs() < ROUNDING, "{left:?}");
            let starts: Vec<f64> = path.changes().collect();
            let rolls = starts[starts.len() - 2] <= time;
            assert_eq!(norm(left) < ROUNDING, rolls, "at {time}: {left:?}");
        }
    }
}

#[test]
fn the_path_is_continuous_and_ends_at_rest() {
    let path = path_after([1.0, 0.4], 0.1, &Cloth::default());
    let just = 1e-9;
    for start in path.changes().skip(1) {
        // the path before, carried on to where the next stretch begins
        let ([x, _], [v, _]) = (path.position(start - just), path.velocity(start - just));
        assert!((x + v * just - path.position(start)[0]).abs() < ROUNDING);
    }
    assert!(norm(path.velocity(1e4)) < ROUNDING);
}

const COEFFICIENTS: Coefficients = Coefficients { mu: 0.05, mu_s: 0.3, e: 0.94 };

#[test]
fn a_table_that_is_turned_turns_what_comes_out() {
    let model = Model::new(Fidelity::Full, Ball::POOL);
    let cue = BallState { velocity: Vec3::new(1.7, 1.0, 0.0), spin: Vec3::new(-20.0, 50.0, 8.0) };
    let straight = model.collide(&cue, &COEFFICIENTS).unwrap();
    for direction in [0.3_f64, 2.0, -1.2] {
        let frame = CollisionFrame::from_direction(direction);
        let cue = BallState { velocity: frame.to_table(cue.velocity), spin: frame.to_table(cue.spin) };
        // of any length
        let line = [3.0 * direction.cos(), 3.0 * direction.sin()];
        let turned = model.collide_on_table(line, &cue, &COEFFICIENTS).unwrap();
        for (on_table, own) in [(turned.cue, straight.cue), (turned.object, straight.object)] {
            assert!((frame.to_collision(on_table.velocity) - own.velocity).amax() < ROUNDING);
            assert!((frame.to_collision(on_table.spin) - own.spin).amax() < 50.0 * ROUNDING);
        }
        assert_eq!(turned.regime, straight.regime);
    }
}

#[test]
fn a_line_without_direction_is_no_collision() {
    let model = Model::new(Fidelity::Full, Ball::POOL);
    let cue = BallState::stun(Vec3::new(1.0, 0.0, 0.0));
    for line in [[0.0, 0.0], [f64::NAN, 1.0], [f64::INFINITY, 0.0]] {
        let error = model.collide_on_table(line, &cue, &COEFFICIENTS).unwrap_err();
        assert!(error.to_string().contains("has no direction"), "{error}");
    }
    let away = model.collide_on_table([-1.0, 0.0], &cue, &COEFFICIENTS);
    assert_eq!(away, Err(NotACollision::NotApproaching(-1.0)));
}
