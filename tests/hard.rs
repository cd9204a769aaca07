//! Hard collisions: at every switch of the model and at the ends of every range.

use std::fs;

use caromfit::physics::ball::{Ball, BallState, Vec3};
use caromfit::physics::collision::{
    Coefficients, Fidelity, MAX_SPEED, MIN_SPEED, MIN_TOLERANCE, Model, NotACollision, Outcome, Regime,
};
use caromfit::physics::contact_frame::{cue_velocity, slip};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use crate::plain;

/// R of the table: products with a power of 2 are exact.
const BALL: Ball = Ball { radius: 1.0 / 32.0, ..Ball::POOL };

/// Some fifty roundings of the larger of |U| and R|ω|.
const ROUNDINGS: f64 = 1e-14;

/// Steps of the subnormal numbers that a few operations lose.
const SUBNORMAL: f64 = 64.0 * 5e-324;

/// Errors of some steps, each within the tolerance, add up to so many of it.
const STEPS: f64 = 10.0;

/// One shot in some 100 000 takes a step that the estimate of its error thinks far better than it is: the
/// estimate is a difference, and passes through 0. Seen: 58 tolerances.
const LUCKY_STEP: f64 = 100.0;

/// `ode` integrates the equations of `full`.
fn integrated() -> impl Iterator<Item = Model> {
    let tolerances = [1e-8, 1e-10, MIN_TOLERANCE].into_iter();
    tolerances.map(|tolerance| Model { tolerance, ..Model::new(Fidelity::Ode, BALL) })
}

struct Case {
    name: String,
    cue: BallState,
    coefficients: Coefficients,
    outcome: serde_json::Value,
}

impl Case {
    fn scale(&self) -> f64 {
        self.cue.velocity.amax().max(BALL.radius * self.cue.spin.amax())
    }
}

fn cases() -> Vec<Case> {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/reference/hard_cases.json");
    let all: Vec<serde_json::Value> = serde_json::from_str(&fs::read_to_string(path).unwrap()).unwrap();
    let ordinary = |case: &serde_json::Value| {
        let speed = case["velocity"][0].as_f64().unwrap().max(case["velocity"][1].as_f64().unwrap().abs());
        (MIN_SPEED..MAX_SPEED).contains(&speed)
    };
    let cases = all.into_iter().filter(ordinary).map(|mut case| {
        let number = |value: &serde_json::Value| value.as_f64().unwrap();
        let [x, y] = [0, 1].map(|i| number(&case["velocity"][i]));
        let spin = [0, 1, 2].map(|i| number(&case["spin"][i]));
        let [mu, mu_s, e] = ["mu", "mu_s", "e"].map(|key| number(&case[key]));
        Case {
            name: case["name"].as_str().unwrap().to_owned(),
            cue: BallState { velocity: Vec3::new(x, y, 0.0), spin: Vec3::from(spin) },
            coefficients: Coefficients { mu, mu_s, e },
            outcome: case["outcome"].take(),
        }
    });
    cases.collect()
}

/// Spins count as speeds of the surface.
fn as_speed(row: usize) -> f64 {
    if (row / 3).is_multiple_of(2) { 1.0 } else { BALL.radius }
}

const CLOSED: [Fidelity; 4] = [Fidelity::Elastic, Fidelity::Inelastic, Fidelity::Linear, Fidelity::Full];

/// In closed form to rounding, with finite derivatives; what integrates the same equations as `full` is off by a few of its
/// tolerances, which are of the closing speed.
#[test]
fn hard_cases_agree_with_25_digits() {
    let cases = cases();
    assert!(cases.len() > 150, "{}", cases.len());
    let mut wrong = Vec::new();
    for case in &cases {
        let mut check = |model: &Model, expected: Fidelity, allowed: f64| {
            let outcome = model.collide(&case.cue, &case.coefficients).unwrap();
            for (row, found) in outcome.components().iter().enumerate() {
                let expected = case.outcome[expected.name()][row].as_str().unwrap();
                let off = as_speed(row) * (found - expected.parse::<f64>().unwrap()).abs();
                if !(off <= allowed + ROUNDINGS * case.scale() + SUBNORMAL) {
                    wrong.push(format!("{}, {} row {row}: {off:e}", case.name, model.fidelity.name()));
                }
            }
            outcome
        };
        for fidelity in CLOSED {
            let model = Model::new(fidelity, BALL);
            let outcome = check(&model, fidelity, 0.0);
            let (same, jacobian) = model.collide_with_jacobian(&case.cue, &case.coefficients).unwrap();
            assert_eq!(outcome, same, "{}", case.name);
            assert!(jacobian.iter().all(|x| x.is_finite()), "{}, {}: {jacobian}", case.name, fidelity.name());
        }
        for model in integrated() {
            check(&model, Fidelity::Full, STEPS * model.tolerance * case.cue.velocity.x);
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// At speeds whose squares overflow or vanish nothing is computed.
#[test]
fn speeds_out_of_range_are_refused() {
    for speed in [1e-320, 1e-160, 0.9 * MIN_SPEED, 1.1 * MAX_SPEED, 1e290] {
        let cue = BallState::stun(cue_velocity(speed, 0.1));
        for fidelity in Fidelity::ALL {
            let model = Model::new(fidelity, BALL);
            let error = model.collide(&cue, &Coefficients { mu: 0.05, mu_s: 0.3, e: 0.9 }).unwrap_err();
            assert!(error.to_string().starts_with("speed_m_s is "), "{speed:e}: {error}");
        }
    }
    let spinning = BallState { spin: Vec3::new(0.0, 1e12, 0.0), ..BallState::stun(cue_velocity(1.0, 0.1)) };
    let error =
        Model::new(Fidelity::Full, BALL).collide(&spinning, &Coefficients { mu: 0.05, mu_s: 0.3, e: 0.9 });
    assert!(error.unwrap_err().to_string().starts_with("speed_m_s is 31250000000"));
}

/// What is hard for every fidelity: each shot comes out with finite derivatives, no energy is made, and the balls part.
#[test]
fn every_fidelity_computes_what_is_hard() {
    /// Of the energy before: the tolerance of what is integrated.
    const MADE: f64 = 1e-6;
    let shot = |speed: f64, cut_deg: f64, spin: [f64; 3]| BallState {
        velocity: cue_velocity(speed, cut_deg.to_radians()),
        // of the surface, over the speed
        spin: Vec3::from(spin) * (speed / BALL.radius),
    };
    let roll = |speed: f64, cut_deg: f64| {
        BallState::natural_roll(cue_velocity(speed, cut_deg.to_radians()), BALL.radius)
    };
    let usual = Coefficients { mu: 0.05, mu_s: 0.3, e: 0.94 };
    let gearing = -30_f64.to_radians().sin();
    let cases = [
        ("grazing", roll(2.0, 89.0), usual, 1.0),
        ("stick at the end of compression", shot(2.0, 10.28, [0.0; 3]), usual, 1.0),
        ("no friction", roll(2.0, 30.0), Coefficients { mu: 0.0, ..usual }, 1.0),
        ("no restitution", roll(2.0, 30.0), Coefficients { e: 0.0, ..usual }, 1.0),
        ("elastic", roll(2.0, 30.0), Coefficients { e: 1.0, ..usual }, 1.0),
        ("head-on roll", roll(2.0, 0.0), usual, 1.0),
        ("head-on stun", shot(2.0, 0.0, [0.0; 3]), usual, 1.0),
        ("pure side spin", shot(2.0, 0.0, [0.0, 0.0, 1.0]), usual, 1.0),
        ("gearing", shot(2.0, 30.0, [0.0, 0.0, gearing]), usual, 1.0),
        ("tiny speed", roll(1e-3, 30.0), usual, 1.0),
        ("large speed", roll(1e3, 30.0), usual, 1.0),
        ("much friction", roll(2.0, 30.0), Coefficients { mu: 1.0, ..usual }, 1.0),
        ("light cue ball", roll(2.0, 30.0), usual, 0.01),
        ("heavy cue ball", roll(2.0, 30.0), usual, 100.0),
    ];
    let of = |fidelity| Model::new(fidelity, BALL);
    let compliant = |kappa: f64| Model { kappa, tolerance: 1e-8, ..of(Fidelity::Ode) };
    let models = Fidelity::ALL.map(of).into_iter().chain([1e-3, Model::KAPPA, 20.0].map(compliant));
    for model in models {
        for (name, cue, coefficients, ratio) in &cases {
            let model = if *ratio == 1.0 { model } else { model.with_mass_ratio(*ratio) };
            let name = format!("{name}, {}, kappa {}", model.fidelity.name(), model.kappa);
            let found = model
                .collide_with_jacobian(cue, coefficients)
                .unwrap_or_else(|error| panic!("{name}: {error}"));
            let (outcome, by) = found;
            assert_eq!(outcome, model.collide(cue, coefficients).unwrap(), "{name}");
            assert!(by.iter().all(|x| x.is_finite()), "{name}");
            let energy = |ball: &BallState| {
                ball.velocity.norm_squared() + BALL.inertia * (BALL.radius * ball.spin).norm_squared()
            };
            let before = ratio * energy(cue);
            let after = ratio * energy(&outcome.cue) + energy(&outcome.object);
            // to first order friction goes on where the contact would stick
            let is_linear = model.fidelity == Fidelity::Linear;
            assert!(is_linear || after <= before * (1.0 + MADE), "{name}: {before} {after}");
            let parts = outcome.object.velocity.x - outcome.cue.velocity.x;
            let none = coefficients.e == 0.0 && model.fidelity != Fidelity::Elastic;
            assert!(parts > 0.0 || none && parts > -0.05 * cue.velocity.x, "{name}: {parts}");
        }
    }
}

#[test]
fn hard_cases_mirror_and_scale_exactly() {
    let mirror = |s: &BallState| BallState {
        velocity: s.velocity.component_mul(&Vec3::new(1.0, -1.0, 1.0)),
        spin: s.spin.component_mul(&Vec3::new(-1.0, 1.0, -1.0)),
    };
    for case in cases() {
        for model in CLOSED.map(|fidelity| Model::new(fidelity, BALL)).into_iter().chain(integrated()) {
            let outcome = model.collide(&case.cue, &case.coefficients).unwrap();
            let run = |model: &Model, cue: &BallState| {
                let outcome = model.collide(cue, &case.coefficients).unwrap();
                (outcome.cue, outcome.object, outcome.regime)
            };
            // y → −y: velocities are vectors, spins axial vectors
            let expected = (mirror(&outcome.cue), mirror(&outcome.object), outcome.regime);
            assert_eq!(run(&model, &mirror(&case.cue)), expected, "{}", case.name);
            // U by 4, then R by 8, where nothing is subnormal
            if case.scale() < 1e-290 || case.name.contains("1e-300") {
                continue;
            }
            let scaled = |by_u: f64, by_r: f64| {
                move |s: &BallState| BallState { velocity: by_u * s.velocity, spin: by_u / by_r * s.spin }
            };
            for (by_u, by_r) in [(4.0, 1.0), (1.0, 8.0)] {
                let scaled = scaled(by_u, by_r);
                let ball = Ball { radius: by_r * BALL.radius, ..BALL };
                let expected = (scaled(&outcome.cue), scaled(&outcome.object), outcome.regime);
                assert_eq!(
                    run(&Model { ball, ..model }, &scaled(&case.cue)),
                    expected,
                    "{}, {}",
                    case.name,
                    model.fidelity.name()
                );
            }
        }
    }
}

fn full(cue: &BallState, mu: f64, mu_s: f64, e: f64) -> Outcome {
    Model::new(Fidelity::Full, BALL).collide(cue, &Coefficients { mu, mu_s, e }).unwrap()
}

fn gap(a: &Outcome, b: &Outcome) -> f64 {
    let difference = a.components() - b.components();
    (0..12).map(|row| as_speed(row) * difference[row].abs()).fold(0.0, f64::max)
}

#[test]
fn outcomes_are_continuous_across_every_switch() {
    /// So far on either side of the switch,
    const ASIDE: f64 = 1e-10;
    /// times the slope of the outcome there, at most: the slip turns within v_∥0, here 0.1 m/s or more, and
    /// ends as a power of what is left.
    const SLOPE: f64 = 100.0;
    let cue = |x, y, spin_y, spin_z| BallState {
        velocity: Vec3::new(x, y, 0.0),
        spin: Vec3::new(0.0, spin_y, spin_z),
    };
    // draw, stun, topspin: the cloth sets in
    for y in [0.4, -0.4, 0.1] {
        let [draw, stun, top] = [-ASIDE, 0.0, ASIDE].map(|s| full(&cue(1.0, y, s, 0.0), 0.06, 0.4, 0.94));
        assert!(gap(&draw, &stun).max(gap(&stun, &top)) < SLOPE * ASIDE, "cloth at {y}");
    }
    // θ through ±π/2 and, with the slip along y, through 0
    for spin in [10.0, -10.0] {
        let [a, b, c] = [-ASIDE, 0.0, ASIDE].map(|y| full(&cue(1.0, y, spin, 0.0), 0.06, 0.3, 0.94));
        assert!(gap(&a, &b).max(gap(&b, &c)) < SLOPE * ASIDE, "θ at {spin}");
    }
    // no slip at first contact
    for (y, z) in [(ASIDE, 0.0), (0.0, ASIDE), (ASIDE, -ASIDE)] {
        let [none, some] =
            [0.0, 1.0].map(|s| full(&cue(1.0, 0.5 + s * y, 32.0 * s * z, -16.0), 0.06, 0.3, 0.94));
        assert!(gap(&none, &some) < SLOPE * ASIDE, "gearing");
        assert_eq!((none.regime, some.regime), (Regime::Stick, Regime::Stick));
    }
    // μ, μ_s and e from 0
    for spin in [30.0, -30.0, 3.0] {
        let at = |mu, mu_s, e| full(&cue(1.0, 0.2, spin, 1.0), mu, mu_s, e);
        let from = at(0.06, 0.3, 0.94);
        assert!(from.regime == Regime::Slide || spin == 3.0);
        for (zero, some) in [
            (at(0.0, 0.3, 0.94), at(ASIDE, 0.3, 0.94)),
            (at(0.06, 0.0, 0.94), at(0.06, ASIDE, 0.94)),
            (at(0.06, 0.3, 0.0), at(0.06, 0.3, ASIDE)),
            (at(0.06, 0.3, 1.0), at(0.06, 0.3, 1.0 - ASIDE)),
        ] {
            assert!(gap(&zero, &some) < SLOPE * ASIDE, "coefficients at {spin}");
        }
    }
    // stick: at the very start, in compression, in restitution, at the end, with k through each of them
    for (y, spin) in [(0.1, 3.0), (0.1, -3.0), (0.1, 0.0), (0.0, 3.0)] {
        let at = |x: f64| full(&cue(x, y, spin, 0.0), 0.06, 0.3, 0.94);
        let (mut slides, mut sticks) = (1e-3, 100.0);
        assert_eq!((at(slides).regime, at(sticks).regime), (Regime::Slide, Regime::Stick));
        while sticks - slides > ASIDE {
            let middle = 0.5 * (slides + sticks);
            if at(middle).regime == Regime::Slide { slides = middle } else { sticks = middle }
        }
        assert!(gap(&at(slides), &at(sticks)) < SLOPE * ASIDE, "stick at {y}, {spin}");
        // from the end of restitution to the end of compression and beyond
        for step in 0..20_000 {
            let x = sticks * (1.0 + f64::from(step) * 1e-4);
            let off = gap(&at(x), &at(x * (1.0 + 1e-9)));
            assert!(off < SLOPE * 1e-9 * x, "sticking at {x}: {off:e}");
        }
    }
}

/// Kim 2024, Eqs. 24–30, sign of the cloth's torque corrected: q from what is left of the slip,
/// 2μβ_y q = v̄ [F(x_y0) − F(x_y)], F(x) = x ₂F₁(−½, a_y; 1 + a_y; −x^(1/a_y)), x_y = |v_y|/v̄,
/// v̄ = |v_z0| |v_z0/v_y0|^(2a_z).
fn impulse_of_the_paper(before: Vec3, after: Vec3, mu: f64, m_s: f64) -> f64 {
    let nu = BALL.inertia;
    let (a_y, a_z) = (-(1.0 + nu) / (nu + m_s), (2.0 + nu - m_s) / (2.0 * (nu + m_s)));
    let v_bar = before.z.abs() * (before.z / before.y).abs().powf(2.0 * a_z);
    let f = |v: Vec3| {
        let x = v.y.abs() / v_bar;
        // x^(1/a_y) = tan²θ, here below 1/4: the series Σ (−½)_n/n! a/(a + n) (−tan²θ)^n
        let tan2 = x.powf(1.0 / a_y);
        let (mut binomial, mut sum) = (1.0, 0.0);
        for n in 0..40 {
            let n = f64::from(n);
            sum += binomial * a_y / (a_y + n);
            binomial *= (0.5 - n) / (n + 1.0) * tan2;
        }
        x * sum
    };
    v_bar * (f(before) - f(after)) * nu / (2.0 * mu * (1.0 + nu))
}

#[test]
fn the_form_of_the_paper_fails_where_ours_does_not() {
    /// 40 terms in tan²θ < 1/4 leave less than rounding, which powers of the slip amplify.
    const AWAY_FROM_POLES: f64 = 1e-11;
    let (mu, e) = (0.0625, 0.94);
    let shot = |y: f64, z: f64, mu_s: f64| {
        let cue = BallState { velocity: Vec3::new(1.0, y, 0.0), spin: Vec3::new(0.0, 32.0 * z, 0.0) };
        let outcome = full(&cue, mu, mu_s, e);
        let before = slip(&cue, &BallState::default(), BALL.radius);
        let after = slip(&outcome.cue, &outcome.object, BALL.radius);
        (outcome.impulse, impulse_of_the_paper(before, after, mu, if z > 0.0 { mu_s } else { 0.0 }))
    };
    // where it works, both are the same solution
    for mu_s in [0.1, 0.2, 0.25, 0.35, 0.45] {
        let (ours, paper) = shot(2.0, 0.8, mu_s);
        assert!((ours - paper).abs() < AWAY_FROM_POLES, "{mu_s}: {ours} {paper}");
    }
    // a_y = −2 at μ_s = 0.3: the closer, the worse. At μ_s = 1/15, a_y = −3
    for (pole, steps) in [(0.3, [1e-6, 1e-9, 1e-12]), (1.0 / 15.0, [1e-6, 1e-9, 1e-12])] {
        let (at_pole, of_paper) = shot(2.0, 0.8, pole);
        assert!(
            !((of_paper - at_pole).abs() < 1e-4),
            "the pole at {pole} does no harm: {of_paper} {at_pole}"
        );
        let errors = steps.map(|step| {
            let (ours, paper) = shot(2.0, 0.8, pole + step);
            // ours passes the pole without notice
            assert!((ours - at_pole).abs() < step, "{ours} {at_pole}");
            (ours - paper).abs()
        });
        assert!(errors[2] > 1e3 * errors[0] && errors[2] > 1e-8, "{errors:?}");
    }
    // v̄ = 0 (no topspin, no draw) and v̄ = ∞ (a straight shot)
    for (y, z) in [(2.0, 0.0), (0.0, 0.8)] {
        let (ours, paper) = shot(y, z, 0.25);
        assert!(ours.is_finite() && !paper.is_finite(), "{ours} {paper}");
    }
}

/// A shot from the whole of the ranges, with what is hard about it more often than not.
fn random(rng: &mut ChaCha8Rng) -> (BallState, Coefficients) {
    let log = |rng: &mut ChaCha8Rng, from: f64, to: f64| rng.random_range(from.ln()..to.ln()).exp();
    let speed = log(rng, 1e-4, 50.0);
    let side = if rng.random_bool(0.5) { 1.0 } else { -1.0 };
    let cut_deg = match rng.random_range(0..4) {
        0 => 90.0 - log(rng, 1e-5, 90.0),
        1 => log(rng, 1e-9, 90.0),
        _ => rng.random_range(0.0..89.0),
    };
    let velocity = cue_velocity(speed, side * cut_deg.to_radians());
    let radius = BALL.radius;
    let roll = BallState::natural_roll(velocity, radius).spin;
    // the side spin that takes the slip away
    let gear = -velocity.y / radius;
    let any = rng.random_range(-1.5..1.5) * speed / radius;
    let spin = match rng.random_range(0..8) {
        0 => Vec3::zeros(),
        1 => roll,
        2 => -roll,
        3 => Vec3::new(0.0, 0.0, any),
        4 => roll * rng.random_range(-1.5..1.5) + Vec3::z() * any,
        5 => roll * (side * log(rng, 1e-12, 1.0)) + Vec3::z() * any,
        6 => Vec3::new(0.0, rng.random_range(-1000.0..1000.0), rng.random_range(-1000.0..1000.0)),
        _ => Vec3::new(0.0, side * log(rng, 1e-9, 1e3), gear * (1.0 + log(rng, 1e-16, 1.0))),
    };
    let mu = if rng.random_bool(0.3) { log(rng, 1e-12, 1.0) } else { rng.random_range(0.01..0.2) };
    let mu_s = match rng.random_range(0..4) {
        0 => rng.random_range(0.0..1.0),
        1 => log(rng, 1e-12, 1.0),
        _ => rng.random_range(0.2..0.4),
    };
    let e = match rng.random_range(0..4) {
        0 => log(rng, 1e-9, 1.0),
        1 => rng.random_range(0.0..1.0),
        _ => rng.random_range(0.9..1.0),
    };
    (BallState { velocity, spin }, Coefficients { mu, mu_s, e })
}

/// With gravity and all friction of the cloth a shot comes out finite. Refused are a few that close in at less than a millimetre per
/// second: the cloth, on which a ball spins, then pushes the balls against each other for as long as it spins.
#[test]
fn with_everything_on_shots_end_or_say_why_not() {
    const SHOTS: usize = 1_000;
    const MOST_REFUSED: usize = SHOTS / 100;
    const PUSHED: f64 = 1e-3;
    for tolerance in [1e-3, 1e-6, 1e-10] {
        let model = Model { tolerance, ..Model::new(Fidelity::Contact, BALL) };
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let mut refused = 0;
        for _ in 0..SHOTS {
            let (cue, coefficients) = random(&mut rng);
            match model.collide(&cue, &coefficients) {
                Ok(outcome) => assert!(outcome.components().iter().all(|x| x.is_finite())),
                Err(error) => {
                    assert!(matches!(error, NotACollision::NotIntegrated { .. }), "{error}");
                    assert!(cue.velocity.x < PUSHED, "{cue:?} {coefficients:?}");
                    refused += 1;
                }
            }
        }
        println!("{tolerance:e}: {refused} of {SHOTS} refused");
        assert!(refused <= MOST_REFUSED, "{refused} refused at {tolerance:e}");
    }
    // e = 0 ends with compression. Near it restitution would last for days: the cue ball, rolling, pushes the
    // object ball along until the cloth parts them
    let roll = BallState::natural_roll(cue_velocity(2.0, 0.5), BALL.radius);
    let model = Model { tolerance: 1e-6, ..Model::new(Fidelity::Contact, BALL) };
    let at = |e: f64| model.collide(&roll, &Coefficients { mu: 0.05, mu_s: 0.3, e }).unwrap();
    let [none, little] = [at(0.0), at(1e-9)];
    assert!((none.object.velocity.x - none.cue.velocity.x).abs() < 1e-3 * roll.velocity.x);
    assert!(little.object.velocity.x > little.cue.velocity.x && little.impulse > none.impulse);
}

/// At length: `CAROMFIT_RANDOM=10000000 cargo test --release -- --nocapture random_shots`.
#[test]
fn random_shots_agree_with_the_plain_solution() {
    const CHUNK: usize = 10_000;
    /// One shot in so many is integrated too.
    const INTEGRATED: usize = 50;
    let shots: usize = std::env::var("CAROMFIT_RANDOM").map_or(50_000, |n| n.parse().unwrap());
    let chunk = |seed: usize| {
        let mut rng = ChaCha8Rng::seed_from_u64(seed as u64);
        let mut worst = (0.0, String::new());
        let mut worst_integrated = (0.0, String::new());
        let (mut stuck, mut beyond) = (0, 0);
        for number in 0..CHUNK {
            let (cue, coefficients) = random(&mut rng);
            let fast = Model::new(Fidelity::Full, BALL).collide(&cue, &coefficients).unwrap();
            let plain = plain::collide(&BALL, &cue, &coefficients);
            let scale = cue.velocity.norm().max(BALL.radius * cue.spin.norm());
            let off = plain::difference(&fast, &plain, BALL.radius) / scale;
            stuck += usize::from(fast.regime == Regime::Stick);
            let [u, w] = [cue.velocity, cue.spin].map(|v| [v.x, v.y, v.z]);
            let shot = || format!("{u:?} {w:?} {coefficients:?}");
            if off > worst.0 || off.is_nan() {
                worst = (off, format!("{}, {} and {}", shot(), fast.impulse, plain.impulse));
            }
            if number % INTEGRATED == 0 {
                for model in integrated() {
                    let slow = model
                        .collide(&cue, &coefficients)
                        .unwrap_or_else(|e| panic!("{e} {} {}", shot(), model.tolerance));
                    let allowed = model.tolerance * cue.velocity.x + ROUNDINGS * scale;
                    let off = plain::difference(&slow, &plain, BALL.radius) / allowed;
                    beyond += usize::from(!(off < STEPS));
                    if off > worst_integrated.0 || off.is_nan() {
                        worst_integrated = (off, format!("{}, {model:?}", shot()));
                    }
                }
            }
        }
        (worst, worst_integrated, stuck, beyond)
    };
    let all: Vec<_> = (0..shots.div_ceil(CHUNK)).into_par_iter().map(chunk).collect();
    let stuck: usize = all.iter().map(|(_, _, stuck, _)| stuck).sum();
    let beyond: usize = all.iter().map(|(.., beyond)| beyond).sum();
    let count = all.len() * CHUNK;
    let largest =
        |errors: Vec<&(f64, String)>| errors.into_iter().max_by(|a, b| a.0.total_cmp(&b.0)).unwrap().clone();
    let (off, worst) = largest(all.iter().map(|(worst, ..)| worst).collect());
    let (tolerances, integrated) = largest(all.iter().map(|(_, worst, ..)| worst).collect());
    println!(
        "{count} shots, of which {stuck} stick: off by at most {off:e} of the larger of U and Rω: {worst}"
    );
    println!(
        "integrated, {} of them: off by at most {tolerances:.1} tolerances: {integrated}",
        count / INTEGRATED
    );
    assert!(off < ROUNDINGS, "{off:e}: {worst}");
    assert!(tolerances < LUCKY_STEP, "{tolerances}: {integrated}");
    assert!(beyond <= count / INTEGRATED / 1000, "{beyond} beyond {STEPS} tolerances");
    assert!(stuck > count / 20 && stuck < count / 2, "{stuck} of {count} stick");
}
