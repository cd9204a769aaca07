//! Hard collisions: at every switch of the model and at the ends of every range.

use crate::collisions::{Try, energy};
use crate::plain;
use crate::prelude::*;
use crate::references::Reference;

/// R of the table: products with a power of 2 are exact.
const BALL: Ball = Ball { radius: 1.0 / 32.0, ..Ball::POOL };

/// Some fifty roundings of the larger of |U| and R|ω|.
const ROUNDINGS: f64 = 1e-14;

/// Errors of some steps, each within the tolerance, add up to so many of it.
const STEPS: f64 = 10.0;

/// One shot in some 100 000 takes a step that the estimate of its error thinks far better than it is: the
/// estimate is a difference, and passes through 0. Seen: 58 tolerances.
const LUCKY_STEP: f64 = 100.0;

/// `ode` integrates the equations of `full`.
fn integrated() -> impl Iterator<Item = Model> {
    let tolerances = [1e-8, 1e-10, *TOLERANCES.start()].into_iter();
    tolerances.map(|tolerance| Model { tolerance, ..Model::new(Fidelity::Ode, BALL) })
}

const CLOSED: [Fidelity; 4] = [Fidelity::Elastic, Fidelity::Inelastic, Fidelity::Linear, Fidelity::Full];

/// At speeds whose squares overflow or vanish nothing is computed.
#[test]
fn speeds_out_of_range_are_refused() {
    for speed in [1e-320, 1e-160, 0.9 * SPEEDS.start(), 1.1 * SPEEDS.end(), 1e290] {
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
        ("between topspin and draw", shot(3.5, -15.1, [-2.6e-11, -9.7e-11, -1.7e-3]), usual, 1.0004),
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
            let before = ratio * energy(&BALL, cue);
            let after = ratio * energy(&BALL, &outcome.cue) + energy(&BALL, &outcome.object);
            // to first order friction goes on where the contact would stick
            let is_linear = model.fidelity == Fidelity::Linear;
            assert!(is_linear || after <= before * (1.0 + MADE), "{name}: {before} {after}");
            let parts = outcome.object.velocity.x - outcome.cue.velocity.x;
            let none = coefficients.e == 0.0 && model.fidelity != Fidelity::Elastic;
            assert!(parts > 0.0 || none && parts > -0.05 * cue.velocity.x, "{name}: {parts}");
        }
    }
}

/// y → −y: velocities are vectors, spins axial vectors.
fn mirror(s: &BallState) -> BallState {
    BallState {
        velocity: s.velocity.component_mul(&Vec3::new(1.0, -1.0, 1.0)),
        spin: s.spin.component_mul(&Vec3::new(-1.0, 1.0, -1.0)),
    }
}

/// Asserts that an outcome mirrors, and scales with U by 4 and with R by 8: powers of 2 change no digit, as everything is computed in units of
/// the closing speed, or scales.
fn mirrors_and_scales(name: &str, Try { model, cue, coefficients }: &Try, scales: &[(f64, f64)]) {
    let run = |model: &Model, cue: &BallState| {
        let outcome = model.collide(cue, coefficients).unwrap();
        (outcome.cue, outcome.object, outcome.regime)
    };
    let (cue_after, object_after, regime) = run(model, cue);
    let fidelity = model.fidelity.name();
    let expected = (mirror(&cue_after), mirror(&object_after), regime);
    assert_eq!(run(model, &mirror(cue)), expected, "{name}, {fidelity}");
    for &(by_u, by_r) in scales {
        let scaled = |s: &BallState| BallState { velocity: by_u * s.velocity, spin: by_u / by_r * s.spin };
        let ball = Ball { radius: by_r * model.ball.radius, ..model.ball };
        let expected = (scaled(&cue_after), scaled(&object_after), regime);
        assert_eq!(run(&Model { ball, ..*model }, &scaled(cue)), expected, "{name}, {fidelity}");
    }
}

/// Without weight.
#[test]
fn outcomes_mirror_and_scale_exactly() {
    for case in Reference::hard() {
        // where nothing is subnormal
        let is_usual = case.scale >= 1e-290 && !case.name.contains("1e-300");
        let scales = if is_usual { &[(4.0, 1.0), (1.0, 8.0)][..] } else { &[] };
        for model in CLOSED.map(|fidelity| Model::new(fidelity, BALL)).into_iter().chain(integrated()) {
            let shot = Try { model, cue: case.cue, coefficients: case.coefficients };
            mirrors_and_scales(&case.name, &shot, scales);
        }
    }
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    for fidelity in Fidelity::ALL {
        for i in 0..if fidelity.is_integrated() { 150 } else { 500 } {
            let mut shot = Try::random(&mut rng, fidelity);
            shot.model.effects.gravity = false;
            if fidelity == Fidelity::Ode && i % 3 == 0 {
                shot.model = Model { kappa: Model::KAPPA, ..shot.model }.with_mass_ratio(1.04);
            }
            mirrors_and_scales(&format!("random {i}"), &shot, &[(4.0, 1.0)]);
        }
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
    for tolerance in [1e-3, 1e-10] {
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

/// The largest error of some shots, and the shot.
type Worst = (f64, String);

fn worse(a: Worst, b: Worst) -> Worst {
    if b.0 > a.0 || b.0.is_nan() { b } else { a }
}

/// At length: `CAROMFIT_RANDOM=10000000 cargo test --release -- --nocapture random_shots`.
#[test]
fn random_shots_agree_with_the_plain_solution() {
    const CHUNK: usize = 10_000;
    /// One shot in so many is integrated too.
    const INTEGRATED: usize = 50;
    let shots = count("CAROMFIT_RANDOM", 50_000);
    // error of `full`, that of `ode` in its tolerances, and how many stick and are beyond STEPS tolerances
    let chunk = |seed: usize| {
        let mut rng = ChaCha8Rng::seed_from_u64(seed as u64);
        let (mut worst, mut integrated_worst) = (Worst::default(), Worst::default());
        let (mut stuck, mut beyond) = (0, 0);
        for number in 0..CHUNK {
            let (cue, coefficients) = random(&mut rng);
            let shot = format!("{cue:?} {coefficients:?}");
            let ball = Ball { inertia: rng.random_range(0.35..0.6), ..BALL };
            let plain = plain::collide(&ball, &cue, &coefficients);
            let scale = cue.velocity.norm().max(BALL.radius * cue.spin.norm());
            let off = |model: &Model| {
                let model = Model { ball, ..*model };
                let found =
                    model.collide(&cue, &coefficients).unwrap_or_else(|error| panic!("{error} {shot}"));
                (plain::difference(&found, &plain, BALL.radius), found.regime)
            };
            let (error, regime) = off(&Model::new(Fidelity::Full, BALL));
            worst = worse(worst, (error / scale, shot.clone()));
            stuck += usize::from(regime == Regime::Stick);
            for model in integrated().filter(|_| number % INTEGRATED == 0) {
                let tolerances = off(&model).0 / (model.tolerance * cue.velocity.x + ROUNDINGS * scale);
                beyond += usize::from(!(tolerances < STEPS));
                integrated_worst =
                    worse(integrated_worst, (tolerances, format!("{shot} {}", model.tolerance)));
            }
        }
        (worst, integrated_worst, stuck, beyond)
    };
    let chunks = shots.div_ceil(CHUNK);
    let ((off, worst), (tolerances, integrated), stuck, beyond) =
        (0..chunks).into_par_iter().map(chunk).reduce(
            || (Worst::default(), Worst::default(), 0, 0),
            |a, b| (worse(a.0, b.0), worse(a.1, b.1), a.2 + b.2, a.3 + b.3),
        );
    let count = chunks * CHUNK;
    figure(format!("{count} shots, of which {stuck} stick: off by at most {off:e}: {worst}"));
    figure(format!("integrated: off by at most {tolerances:.1} tolerances: {integrated}"));
    assert!(off < ROUNDINGS, "{off:e}: {worst}");
    assert!(tolerances < LUCKY_STEP, "{tolerances}: {integrated}");
    assert!(beyond <= count / INTEGRATED / 1000, "{beyond} beyond {STEPS} tolerances");
    assert!(stuck > count / 20 && stuck < count / 2, "{stuck} of {count} stick");
}
