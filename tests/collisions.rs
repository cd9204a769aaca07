//! The collision solver: reference values, energy, limits, derivatives, symmetries.

mod caught;
mod compliant;

use std::fs;

use caromfit::physics::ball::{Ball, BallState, Vec3};
use caromfit::physics::collision::{Coefficients, Fidelity, Input, Jacobian, Model, Outcome, Regime};
use caromfit::physics::contact_frame::{cue_velocity, slip};
use caromfit::physics::friction_law::Law;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::plain;

/// The bar that the full solution is held to, of the cue ball's speed (spins: over R): some fifty roundings.
const REFERENCE: f64 = 1e-14;

fn reference() -> serde_json::Value {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/reference/collisions.json");
    serde_json::from_str(&fs::read_to_string(path).unwrap()).unwrap()
}

fn vector(value: &serde_json::Value) -> Vec3 {
    let number = |v: &serde_json::Value| v.as_f64().unwrap_or_else(|| v.as_str().unwrap().parse().unwrap());
    Vec3::new(number(&value[0]), number(&value[1]), number(&value[2]))
}

/// A collision with its 25-digit outcome, rounded to doubles.
pub struct Case {
    pub name: String,
    pub model: Model,
    pub cue: BallState,
    pub coefficients: Coefficients,
    pub outcome: Outcome,
}

/// The cases of tests/reference/collisions.json, with `full` for a model.
pub fn reference_cases() -> Vec<Case> {
    let read = |case: &serde_json::Value| {
        let number = |key: &str| case[key].as_f64().unwrap();
        let ball = Ball { radius: number("radius"), ..Ball::POOL };
        let as_printed = case["as_printed"].as_bool().unwrap();
        let state = |key: &str| BallState {
            velocity: vector(&case[key]["velocity"]),
            spin: vector(&case[key]["spin"]),
        };
        Case {
            name: case["name"].as_str().unwrap().to_string(),
            model: Model { as_printed, ..Model::new(Fidelity::Full, ball) },
            cue: BallState {
                velocity: cue_velocity(number("speed"), number("cut_deg").to_radians()),
                spin: vector(&case["omega"]),
            },
            coefficients: Coefficients { mu: number("mu"), mu_s: number("mu_s"), e: number("e") },
            outcome: Outcome {
                regime: if case["regime"] == "stick" { Regime::Stick } else { Regime::Slide },
                impulse: case["impulse"].as_str().unwrap().parse().unwrap(),
                cue: state("cue"),
                object: state("object"),
            },
        }
    };
    let cases: Vec<Case> = reference().as_array().unwrap().iter().map(read).collect();
    assert_eq!(cases.len(), 23);
    cases
}

#[test]
fn full_agrees_with_the_25_digit_reference() {
    for Case { name, model, cue, coefficients, outcome: expected } in reference_cases() {
        let (speed, radius) = (cue.velocity.norm(), model.ball.radius);
        let outcome = model.collide(&cue, &coefficients).unwrap();
        assert_eq!(outcome.regime, expected.regime, "{name}");
        assert!(
            (outcome.impulse - expected.impulse).abs() < REFERENCE * speed,
            "{name}: {}",
            outcome.impulse
        );
        for (ball, expected) in [(&outcome.cue, &expected.cue), (&outcome.object, &expected.object)] {
            let off = (ball.velocity - expected.velocity).amax() / speed;
            let off_spin = (ball.spin - expected.spin).amax() * radius / speed;
            assert!(off < REFERENCE && off_spin < REFERENCE, "{name}: {off:e} {off_spin:e}");
        }
    }
}

/// The fidelities with a closed form.
const CLOSED: [Fidelity; 4] = [Fidelity::Elastic, Fidelity::Inelastic, Fidelity::Linear, Fidelity::Full];

/// A shot to try: cue ball and coefficients.
#[derive(Clone, Copy, Debug)]
pub struct Try {
    pub model: Model,
    pub cue: BallState,
    pub coefficients: Coefficients,
}

impl Try {
    /// Natural roll, stun, draw, side spin, any mixture; thick to thin; also slippery and grippy.
    pub fn random(rng: &mut ChaCha8Rng, fidelity: Fidelity) -> Self {
        let radius = rng.random_range(0.02..0.04);
        let speed: f64 = rng.random_range(0.1..10.0);
        let cut: f64 = rng.random_range(-80.0_f64..80.0).to_radians();
        let velocity = cue_velocity(speed, cut);
        let side = Vec3::z() * (rng.random_range(-1.5..1.5) * speed / radius);
        let roll = BallState::natural_roll(velocity, radius).spin;
        let spin = match rng.random_range(0..6) {
            0 => Vec3::zeros(),
            1 => roll,
            2 => side,
            3 => roll * rng.random_range(-1.5..0.0),
            4 => roll * rng.random_range(0.0..1.5) + side,
            _ => roll * rng.random_range(-1.0..1.0) + side,
        };
        let grip = if rng.random_bool(0.2) { 5.0 } else { 1.0 };
        let coefficients = Coefficients {
            mu: grip * rng.random_range(0.01..0.1),
            mu_s: rng.random_range(0.0..0.6),
            e: rng.random_range(0.0..1.0),
        };
        let ball = Ball { radius, inertia: rng.random_range(0.35..0.6), ..Ball::POOL };
        Self { model: Model::new(fidelity, ball), cue: BallState { velocity, spin }, coefficients }
    }

    pub fn outcome(&self) -> Outcome {
        self.model.collide(&self.cue, &self.coefficients).unwrap()
    }

    /// The shot with one input changed; of a mass or a radius, that of the object ball.
    pub fn moved(&self, input: Input, by: f64) -> Self {
        let Self { mut model, mut cue, coefficients: mut c } = *self;
        let [b, fall] = model.law.numbers();
        match input {
            Input::Mu => c.mu += by,
            Input::MuS => c.mu_s += by,
            Input::E => c.e += by,
            Input::VelocityX => cue.velocity.x += by,
            Input::VelocityY => cue.velocity.y += by,
            Input::SpinX => cue.spin.x += by,
            Input::SpinY => cue.spin.y += by,
            Input::SpinZ => cue.spin.z += by,
            Input::B => model.law = Law::Exponential { b: b + by, c: fall },
            Input::C => model.law = Law::Exponential { b, c: fall + by },
            Input::Kappa => model.kappa += by,
            Input::MassRatio => model = model.with_mass_ratio(model.mass_ratio() + by),
            Input::RadiusRatio => {
                let radius = model.ball.radius / (model.radius_ratio() + by);
                model.object = Some(Ball { radius, ..model.object_ball() });
            }
            Input::ESlope => model.e_slope = model.e_slope.map(|slope| slope + by),
        }
        Self { model, cue, coefficients: c }
    }
}

#[test]
fn full_agrees_with_the_plain_solution() {
    let mut rng = ChaCha8Rng::seed_from_u64(4);
    for _ in 0..20_000 {
        let Try { model, cue, coefficients } = Try::random(&mut rng, Fidelity::Full);
        let fast = model.collide(&cue, &coefficients).unwrap();
        let plain = plain::collide(&model.ball, &cue, &coefficients);
        let scale = cue.velocity.norm().max(cue.spin.norm() * model.ball.radius);
        let off = plain::difference(&fast, &plain, model.ball.radius) / scale;
        assert!(off < REFERENCE, "{off:e}: {cue:?} {coefficients:?} {fast:?} {plain:?}");
    }
}

/// Kinetic energy per unit mass.
pub fn energy(ball: &Ball, state: &BallState) -> f64 {
    0.5 * (state.velocity.norm_squared() + ball.inertia * ball.radius.powi(2) * state.spin.norm_squared())
}

/// (∫ S ds, ∫ s S ds, ∫ s S² ds) from u to 1, S = √(z² + y² s^2γ): plainly, by the 5-point Gauss rule in
/// 100 panels of x = s^(1/12), in which S is smooth at 0.
fn slip_integrals(y: f64, z: f64, gamma: f64, u: f64) -> [f64; 3] {
    const RULE: [(f64, f64); 3] = [
        (0.0, 0.568_888_888_888_888_9),
        (0.538_469_310_105_683, 0.478_628_670_499_366_5),
        (0.906_179_845_938_664, 0.236_926_885_056_189_1),
    ];
    let (from, panels) = (u.powf(1.0 / 12.0), 100);
    let half = (1.0 - from) / f64::from(2 * panels);
    let mut sums = [0.0; 3];
    for panel in 0..panels {
        let middle = from + half * f64::from(2 * panel + 1);
        for (t, w) in RULE {
            for x in if t == 0.0 { vec![middle] } else { vec![middle - half * t, middle + half * t] } {
                let s = x.powi(12);
                let slip = z.hypot(y * s.powf(gamma));
                let ds = w * half * 12.0 * x.powi(11);
                sums[0] += ds * slip;
                sums[1] += ds * s * slip;
                sums[2] += ds * s * slip * slip;
            }
        }
    }
    sums
}

/// The audit closes to this part of the energy before the impact.
const ENERGY: f64 = 1e-12;

#[test]
fn energy_audit_closes() {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let mut stuck = 0;
    for _ in 0..5_000 {
        let Try { model, cue, coefficients } = Try::random(&mut rng, Fidelity::Full);
        let Coefficients { mu, mu_s, .. } = coefficients;
        let (nu, radius) = (model.ball.inertia, model.ball.radius);
        let outcome = model.collide(&cue, &coefficients).unwrap();
        let v0 = slip(&cue, &BallState::default(), radius);
        let m_s = if v0.z > 0.0 { mu_s } else { 0.0 };
        let beta_z = (2.0 + nu - m_s) / (2.0 * nu);
        let gamma = (nu + m_s) / (2.0 + nu - m_s);
        // what is left of the slip at the end
        let after = slip(&outcome.cue, &outcome.object, radius) + Vec3::z() * 0.0;
        let u = if outcome.regime == Regime::Stick {
            stuck += 1;
            0.0
        } else if v0.z == 0.0 {
            (after.y / v0.y).powf(1.0 / (1.0 + gamma))
        } else {
            1.0 + nu * radius * (outcome.cue.spin.y - cue.spin.y) * 2.0 * beta_z / v0.z
        };
        let [s, u_s, u_s2] = slip_integrals(v0.y, v0.z, gamma, u.max(0.0));
        let c = 1.0 / (2.0 * mu * beta_z);
        let q_slid = c * s;
        let q = outcome.impulse;
        // W = v_x0 q + q² + ∫ m_s μ∫ sin θ dq' dq, where the inner integral is v_z0(u − 1)/2β_z
        let a = m_s * v0.z / (2.0 * beta_z);
        let work = v0.x * q + q * q - a * (c * (s - u_s) + (q - q_slid).max(0.0) * f64::from(u <= 0.0));
        // μ∫ v_∥ dq = ∫ u S² du / 2β_z
        let friction = u_s2 / (2.0 * beta_z);
        // m_s μ∫ sin θ (V_x − RΩ_y) dq = −A ∫ (q + [m_s − (1 − m_s)/ν] v_z0 (s − 1)/2β_z) ds
        let lever = (m_s - (1.0 - m_s) / nu) * v0.z / (2.0 * beta_z);
        let cloth = -a * (c * (u_s - u * s) - lever * 0.5 * (1.0 - u).powi(2));
        let before = energy(&model.ball, &cue);
        let change = energy(&model.ball, &outcome.cue) + energy(&model.ball, &outcome.object) - before;
        let gap = change - (work - friction + cloth);
        assert!(
            gap.abs() < ENERGY * before,
            "{gap:e} of {before}: {cue:?} {coefficients:?} {:?}",
            outcome.regime
        );
    }
    assert!(stuck > 300, "only {stuck} shots stuck: the test must see them too");
}

/// Central differences with steps of 1e-4 of the scale, extrapolated once, leave about 1e-9.
const DIFFERENCES: f64 = 1e-6;

#[test]
fn jacobian_agrees_with_central_differences() {
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    for fidelity in CLOSED {
        let (mut compared, mut stuck) = (0, 0);
        for _ in 0..2_000 {
            let shot = Try::random(&mut rng, fidelity);
            let (outcome, jacobian) =
                shot.model.collide_with_jacobian(&shot.cue, &shot.coefficients).unwrap();
            assert_eq!(outcome, shot.model.collide(&shot.cue, &shot.coefficients).unwrap());
            assert!(jacobian.iter().all(|x| x.is_finite()), "{:?} {:?}", shot.cue, shot.coefficients);
            let Ok(numeric) = differences(&shot) else { continue };
            compared += 1;
            stuck += usize::from(outcome.regime == Regime::Stick);
            let (radius, speed) = (shot.model.ball.radius, shot.cue.velocity.norm());
            for row in 0..12 {
                let row_scale = if (row / 3) % 2 == 0 { speed } else { speed / radius };
                for column in 0..8 {
                    let scale = row_scale / column_scale(&shot, column);
                    let off = (jacobian[(row, column)] - numeric[(row, column)]).abs() / scale;
                    assert!(
                        off < DIFFERENCES,
                        "{fidelity:?} ({row}, {column}): {} against {}: {:?} {:?} {:?}",
                        jacobian[(row, column)],
                        numeric[(row, column)],
                        shot.cue,
                        shot.coefficients,
                        outcome.regime
                    );
                }
            }
        }
        assert!(compared > 1_200, "{fidelity:?}: only {compared} shots away from kinks");
        assert!(fidelity != Fidelity::Full || stuck > 100, "only {stuck} stuck shots");
    }
}

fn column_scale(shot: &Try, column: usize) -> f64 {
    let speed = shot.cue.velocity.norm();
    match column {
        0..3 => 1.0,
        3 | 4 => speed,
        _ => speed / shot.model.ball.radius,
    }
}

/// `Err` where a kink lies within the steps.
fn differences(shot: &Try) -> Result<Jacobian, ()> {
    let start = shot.model.collide(&shot.cue, &shot.coefficients).unwrap();
    let regime = start.regime;
    // just before it sticks, the slip falls as a fractional power: no place for differences
    let slip_left = slip(&start.cue, &start.object, shot.model.ball.radius).yz().norm();
    if regime == Regime::Slide && slip_left < 0.05 * shot.cue.velocity.norm() {
        return Err(());
    }
    let slip_side = |cue: &BallState| {
        let v = slip(cue, &BallState::default(), shot.model.ball.radius);
        (v.z > 0.0, v.z < 0.0, v.y.hypot(v.z) > 0.02 * cue.velocity.norm())
    };
    let at = |column: usize, step: f64| {
        let Try { model, cue, coefficients } =
            shot.moved(Input::ALL[column], step * column_scale(shot, column));
        let outcome = model.collide(&cue, &coefficients).map_err(drop)?;
        let side = slip_side(&cue);
        let same = outcome.regime == regime && side == slip_side(&shot.cue) && side.2;
        if same { Ok(outcome.components()) } else { Err(()) }
    };
    let mut jacobian = Jacobian::zeros();
    for column in 0..8 {
        let central =
            |h: f64| Ok((at(column, h)? - at(column, -h)?) / (2.0 * h * column_scale(shot, column)));
        let (coarse, fine) = (central(2e-4)?, central(1e-4)?);
        jacobian.set_column(column, &((4.0 * fine - coarse) / 3.0));
    }
    Ok(jacobian)
}

/// Derivatives by all inputs, for balls that differ in everything: the larger one presses the smaller one into the cloth.
#[test]
fn derivatives_by_everything_agree_with_differences() {
    /// Central differences with steps of 1e-3 and 5e-4, extrapolated twice, leave the sixth power of the step and roundings over it…
    const EXACT: f64 = 1e-10;
    /// …and of a compliant contact, followed with steps of 1e-7, their size times the second derivative.
    const FOLLOWED: f64 = 1e-4;
    let smaller = Ball { radius: 0.0281, mass: 0.161, inertia: 0.39 };
    let larger = Ball { radius: 0.0287, mass: 0.16, inertia: 0.4 };
    let of = |fidelity| Model {
        law: Law::Exponential { b: 0.08, c: 1.1 },
        e_slope: Some(0.01),
        tolerance: 1e-11,
        ..Model::new(fidelity, Ball::POOL)
    };
    let compliant = Model { kappa: 1.2, ..of(Fidelity::Ode) };
    let models = Fidelity::ALL.map(of).into_iter().chain([compliant]);
    let coefficients = Coefficients { mu: 0.03, mu_s: 0.25, e: 0.9 };
    let shots = [[1.7, 0.9, 12.0, 40.0, 9.0], [1.7, 1.2, -9.0, -50.0, 4.0], [2.0, 0.1, 0.0, 3.0, 1.0]]
        .map(|[x, y, a, b, c]| BallState { velocity: Vec3::new(x, y, 0.0), spin: Vec3::new(a, b, c) });
    for (model, (object, cue)) in models.flat_map(|model| {
        [smaller, larger]
            .into_iter()
            .flat_map(|object| shots.map(|cue| (object, cue)))
            .map(move |case| (model, case))
    }) {
        let shot = Try { model: Model { object: Some(object), ..model }, cue, coefficients };
        let (_, by) = shot.model.collide_with_jacobian(&cue, &coefficients).unwrap();
        // `ode` has the derivatives of `full`
        let is_rigid = model.fidelity == Fidelity::Ode && model.kappa == 0.0;
        let model = if is_rigid { shot.model.closed().unwrap() } else { shot.model };
        let most = if model.kappa > 0.0 { FOLLOWED } else { EXACT };
        for input in Input::ALL {
            let unit = if is_spin(input) { 30.0 } else { 1.0 };
            let at = |by: f64| Try { model, ..shot }.moved(input, by * unit).outcome().components();
            let central = |h: f64| (at(h) - at(-h)) / (2.0 * h);
            let [coarse, middle, fine] = [2e-3, 1e-3, 5e-4].map(central);
            let [once, again] = [(4.0 * middle - coarse) / 3.0, (4.0 * fine - middle) / 3.0];
            let expected = (16.0 * again - once) / 15.0;
            let found = by.column(input as usize) * unit;
            // spins are in rad/s, some hundred
            let off = (found - expected).amax() / (100.0 + expected.amax());
            let name = model.fidelity.name();
            assert!(off < most, "{name}, kappa {}, {}: {off:e}, {cue:?}", model.kappa, input.name());
        }
    }
}

/// Whether the input is a spin, in rad/s.
pub fn is_spin(input: Input) -> bool {
    matches!(input, Input::SpinX | Input::SpinY | Input::SpinZ)
}

#[test]
fn the_linear_error_falls_as_mu_squared() {
    // physics: U = 2 m/s, φ = 30°, ω = (0, U/R, 0), e = 0.94, μ_s = 0.3
    let ball = Ball::POOL;
    let cue = BallState {
        velocity: cue_velocity(2.0, 30_f64.to_radians()),
        spin: Vec3::new(0.0, 2.0 / ball.radius, 0.0),
    };
    let error = |mu: f64| {
        let coefficients = Coefficients { mu, mu_s: 0.3, e: 0.94 };
        let [linear, full] = [Fidelity::Linear, Fidelity::Full]
            .map(|fidelity| Model::new(fidelity, ball).collide(&cue, &coefficients).unwrap());
        // the largest component
        (linear.cue.velocity - full.cue.velocity)
            .amax()
            .max((linear.object.velocity - full.object.velocity).amax())
    };
    let errors = [0.05, 0.005, 0.0005].map(error);
    // Independently: 1.0e-3, 1.0e-5, 1.0e-7 m/s, to the two digits given.
    for (error, expected) in errors.iter().zip([1.0e-3, 1.0e-5, 1.0e-7]) {
        assert!((error / expected - 1.0).abs() < 0.05, "{error:e} {expected:e}");
    }
    for pair in errors.windows(2) {
        let order = (pair[0] / pair[1]).log10();
        assert!((order - 2.0).abs() < 0.02, "order {order}");
    }
}

/// Without weight. A power of 2 changes no digit, as everything is computed in units of the closing speed or scales.
#[test]
fn outcomes_mirror_and_scale() {
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    for fidelity in Fidelity::ALL {
        for i in 0..if fidelity.is_integrated() { 150 } else { 500 } {
            let mut shot = Try::random(&mut rng, fidelity);
            shot.model.effects.gravity = false;
            if fidelity == Fidelity::Ode && i % 3 == 0 {
                shot.model = Model { kappa: Model::KAPPA, ..shot.model }.with_mass_ratio(1.04);
            }
            let outcome = shot.outcome();
            // y → −y: velocities are vectors, spins axial vectors
            let mirror = |s: &BallState| BallState {
                velocity: s.velocity.component_mul(&Vec3::new(1.0, -1.0, 1.0)),
                spin: s.spin.component_mul(&Vec3::new(-1.0, 1.0, -1.0)),
            };
            let mirrored = Try { cue: mirror(&shot.cue), ..shot }.outcome();
            assert_eq!((mirrored.cue, mirrored.object), (mirror(&outcome.cue), mirror(&outcome.object)));
            let cue = BallState { velocity: 4.0 * shot.cue.velocity, spin: 4.0 * shot.cue.spin };
            assert_eq!(Try { cue, ..shot }.outcome().components(), 4.0 * outcome.components());
        }
    }
}
