//! The collision solver: reference values, energy, limits, derivatives, symmetries.

pub mod compliant;

use nalgebra::SVector;

use crate::prelude::*;

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

/// Kinetic energy per unit mass.
pub fn energy(ball: &Ball, state: &BallState) -> f64 {
    0.5 * (state.velocity.norm_squared() + ball.inertia * ball.radius.powi(2) * state.spin.norm_squared())
}

/// Whether the input is a spin, in rad/s.
fn is_spin(input: Input) -> bool {
    matches!(input, Input::SpinX | Input::SpinY | Input::SpinZ)
}

/// The derivatives of an outcome by an input over its unit: central differences, extrapolated twice. `None` where one lies on the other side of a
/// kink.
fn differences(shot: &Try, input: Input, unit: f64) -> Option<SVector<f64, 12>> {
    let side = |shot: &Try, outcome: &Outcome| {
        let v = slip(&shot.cue, &BallState::default(), shot.model.ball.radius);
        (outcome.regime, v.z.total_cmp(&0.0), v.y.total_cmp(&0.0))
    };
    let here = side(shot, &shot.outcome());
    let at = |by: f64| {
        let moved = shot.moved(input, by * unit);
        let outcome = moved.model.collide(&moved.cue, &moved.coefficients).ok()?;
        (side(&moved, &outcome) == here).then(|| outcome.components())
    };
    let central = |h: f64| Some((at(h)? - at(-h)?) / (2.0 * h));
    let [coarse, middle, fine] = [central(2e-3)?, central(1e-3)?, central(5e-4)?];
    let [once, again] = [(4.0 * middle - coarse) / 3.0, (4.0 * fine - middle) / 3.0];
    Some((16.0 * again - once) / 15.0)
}

/// Steps of 2e-3 to 5e-4, extrapolated twice, leave the sixth power of the step over the distance from a kink, and roundings over it.
#[test]
fn jacobian_of_random_shots_agrees_with_differences() {
    const DIFFERENCES: f64 = 1e-6;
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    for fidelity in CLOSED {
        let (mut compared, mut stuck) = (0, 0);
        for _ in 0..1_000 {
            let shot = Try::random(&mut rng, fidelity);
            let (speed, radius) = (shot.cue.velocity.norm(), shot.model.ball.radius);
            let (outcome, jacobian) =
                shot.model.collide_with_jacobian(&shot.cue, &shot.coefficients).unwrap();
            assert_eq!(outcome, shot.outcome());
            assert!(jacobian.iter().all(|x| x.is_finite()), "{shot:?}");
            // just before it sticks, the slip falls as a fractional power, and turns fast where it is small: no place for differences
            let left = slip(&outcome.cue, &outcome.object, radius).yz().norm();
            let first = slip(&shot.cue, &BallState::default(), radius).yz().norm();
            let is_near = outcome.regime == Regime::Slide && left < 0.1 * speed || first < 0.2 * speed;
            if is_near || shot.coefficients.mu < 0.01 || shot.coefficients.e < 0.05 {
                continue;
            }
            for input in Input::ALL.into_iter().take(8) {
                let unit = match input {
                    Input::Mu | Input::MuS | Input::E => 1.0,
                    Input::VelocityX | Input::VelocityY => speed,
                    _ => speed / radius,
                };
                let Some(expected) = differences(&shot, input, unit) else { continue };
                let off =
                    (jacobian.column(input as usize) * unit - expected).component_mul(&in_speeds(radius));
                let most = DIFFERENCES * speed;
                assert!(off.amax() < most, "{fidelity:?} {}: {:e} {shot:?}", input.name(), off.amax());
                compared += 1;
                stuck += usize::from(outcome.regime == Regime::Stick);
            }
        }
        assert!(compared > 3_000, "{fidelity:?}: only {compared} away from kinks");
        assert!(fidelity != Fidelity::Full || stuck > 300, "only {stuck} of shots that stick");
    }
}

/// Factors that make speeds of the surface of spins.
fn in_speeds(radius: f64) -> SVector<f64, 12> {
    SVector::from_fn(|row, _| if (row / 3) % 2 == 0 { 1.0 } else { radius })
}

/// Derivatives by all inputs, for balls that differ in everything: the larger one presses the smaller one into the cloth.
#[test]
fn derivatives_by_everything_agree_with_differences() {
    /// Extrapolated twice…
    const EXACT: f64 = 1e-10;
    /// …of a compliant contact, followed with steps of 1e-7, their size times the second derivative; and with those of fits.
    const FOLLOWED: f64 = 1e-4;
    const QUICK: f64 = 2e-3;
    let smaller = Ball { radius: 0.0281, mass: 0.161, inertia: 0.39 };
    let larger = Ball { radius: 0.0287, mass: 0.16, inertia: 0.4 };
    let of = |fidelity| Model {
        law: Law::Exponential { b: 0.08, c: 1.1 },
        e_slope: Some(0.01),
        tolerance: 1e-11,
        ..Model::new(fidelity, Ball::POOL)
    };
    let compliant = Model { kappa: 1.2, ..of(Fidelity::Ode) };
    let quick = Model { tolerance: Model::TOLERANCE_OF_FITS, ..compliant };
    let coefficients = Coefficients { mu: 0.03, mu_s: 0.25, e: 0.9 };
    let cues = [[1.7, 0.9, 12.0, 40.0, 9.0], [1.7, 1.2, -9.0, -50.0, 4.0], [2.0, 0.1, 0.0, 3.0, 1.0]]
        .map(|[x, y, a, b, c]| BallState { velocity: Vec3::new(x, y, 0.0), spin: Vec3::new(a, b, c) });
    for model in Fidelity::ALL.map(of).into_iter().chain([compliant, quick]) {
        for (object, cue) in [smaller, larger].into_iter().flat_map(|object| cues.map(|cue| (object, cue))) {
            let shot = Try { model: Model { object: Some(object), ..model }, cue, coefficients };
            let (_, by) = shot.model.collide_with_jacobian(&cue, &coefficients).unwrap();
            // `ode` has the derivatives of `full`; those of a quick contact are looked at beside a fine one
            let is_rigid = model.fidelity == Fidelity::Ode && model.kappa == 0.0;
            let fine = if is_rigid { shot.model.closed().unwrap() } else { shot.model };
            let fine = if model.tolerance > 1e-11 { Model { tolerance: 1e-11, ..fine } } else { fine };
            let most = match model {
                Model { kappa: 0.0, .. } => EXACT,
                Model { tolerance, .. } if tolerance > 1e-11 => QUICK,
                _ => FOLLOWED,
            };
            for input in Input::ALL {
                let unit = if is_spin(input) { 30.0 } else { 1.0 };
                let Some(expected) = differences(&Try { model: fine, ..shot }, input, unit) else { continue };
                let found = by.column(input as usize) * unit;
                // spins are in rad/s, some hundred
                let off = (found - expected).amax() / (100.0 + expected.amax());
                let name = model.fidelity.name();
                assert!(off < most, "{name}, kappa {}, {}: {off:e}, {cue:?}", model.kappa, input.name());
            }
        }
    }
}
