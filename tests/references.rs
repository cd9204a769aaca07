//! Collisions that were calculated independently: those of tests/reference/{collisions, hard_cases}.json to 25 digits, and those of compliant.json
//! each with its error.

use crate::collisions::compliant::compliant;
use crate::prelude::*;

/// A collision with its outcome, rounded to doubles.
pub struct Reference {
    pub name: String,
    /// The model of `full`, or of a compliant contact.
    pub model: Model,
    pub cue: BallState,
    pub coefficients: Coefficients,
    /// The outcome, velocities and spins of both balls.
    case: Value,
    /// Errors of what is calculated are of this speed, m/s.
    pub scale: f64,
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| value.as_str().unwrap().parse().unwrap())
}

fn vector(value: &Value) -> Vec3 {
    Vec3::from([0, 1, 2].map(|i| number(&value[i])))
}

fn read(file: &str) -> Vec<Value> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/reference").join(file);
    serde_json::from_str(&fs::read_to_string(path).unwrap()).unwrap()
}

impl Reference {
    fn new(name: String, model: Model, cue: BallState, case: Value) -> Self {
        let [mu, mu_s, e] = ["mu", "mu_s", "e"].map(|key| number(&case[key]));
        let scale = cue.velocity.norm();
        Self { name, model, cue, coefficients: Coefficients { mu, mu_s, e }, case, scale }
    }

    /// Collisions of a table by speed and cut angle.
    fn table(file: &str, model: fn(&Value, Ball) -> Model) -> impl Iterator<Item = Self> {
        read(file).into_iter().enumerate().map(move |(i, case)| {
            let ball = Ball { radius: number(&case["radius"]), ..Ball::POOL };
            let velocity = cue_velocity(number(&case["speed"]), number(&case["cut_deg"]).to_radians());
            let cue = BallState { velocity, spin: vector(&case["omega"]) };
            Self::new(format!("{} {i}", case["name"]), model(&case, ball), cue, case)
        })
    }

    /// Ordinary collisions.
    fn ordinary() -> impl Iterator<Item = Self> {
        Self::table("collisions.json", |case, ball| {
            let as_printed = case["as_printed"].as_bool().unwrap();
            Model { as_printed, ..Model::new(Fidelity::Full, ball) }
        })
    }

    /// Collisions at every switch of the model and at the ends of every range, in R = 1/32 m.
    pub fn hard() -> impl Iterator<Item = Self> {
        let model = Model::new(Fidelity::Full, Ball { radius: 1.0 / 32.0, ..Ball::POOL });
        let all = read("hard_cases.json").into_iter().map(move |case| {
            let [x, y] = [0, 1].map(|i| number(&case["velocity"][i]));
            let cue = BallState { velocity: Vec3::new(x, y, 0.0), spin: vector(&case["spin"]) };
            let scale = cue.velocity.amax().max(model.ball.radius * cue.spin.amax());
            Self { scale, ..Self::new(case["name"].as_str().unwrap().to_owned(), model, cue, case) }
        });
        all.filter(|case| SPEEDS.contains(&case.cue.velocity.x.max(case.cue.velocity.y.abs())))
    }

    /// Contacts that are compliant along the surface, also of balls of unequal mass.
    fn compliant() -> impl Iterator<Item = Self> {
        Self::table("compliant.json", |case, ball| {
            let kappa = number(&case["kappa"]);
            let model = Model { kappa, tolerance: 1e-11, ..compliant(Fidelity::Ode, ball) };
            let ratio = number(&case["mass_ratio"]);
            if ratio == 1.0 { model } else { model.with_mass_ratio(ratio) }
        })
    }

    /// Velocities and spins of both balls after the impact, by a fidelity.
    fn outcome(&self, fidelity: Fidelity) -> [f64; 12] {
        std::array::from_fn(|row| match self.case.get("outcome") {
            Some(outcome) => number(&outcome[fidelity.name()][row]),
            None => {
                let ball = &self.case[["cue", "object"][row / 6]];
                number(&ball[["velocity", "spin"][row / 3 % 2]][row % 3])
            }
        })
    }

    /// The largest difference from the outcome by a fidelity, m/s, spins times R.
    fn off(&self, outcome: &Outcome, fidelity: Fidelity) -> f64 {
        let expected = self.outcome(fidelity);
        let unit = |row: usize| if (row / 3).is_multiple_of(2) { 1.0 } else { self.model.ball.radius };
        let off = |row: usize| unit(row) * (outcome.components()[row] - expected[row]).abs();
        (0..12).map(off).fold(0.0, |most, off| if off.is_nan() { off } else { most.max(off) })
    }
}

/// Some fifty roundings of the larger of |U| and R|ω|.
const ROUNDINGS: f64 = 1e-14;

/// Steps of the subnormal numbers that a few operations lose.
const SUBNORMAL: f64 = 64.0 * 5e-324;

/// In closed form to rounding, with finite derivatives.
#[test]
fn closed_forms_agree_with_25_digits() {
    let all: Vec<Reference> = Reference::ordinary().chain(Reference::hard()).collect();
    assert!(all.len() > 170, "{}", all.len());
    for case in &all {
        let is_hard = case.case.get("outcome").is_some();
        let fidelities = [Fidelity::Full, Fidelity::Elastic, Fidelity::Inelastic, Fidelity::Linear];
        for fidelity in fidelities.into_iter().take(if is_hard { 4 } else { 1 }) {
            let as_printed = case.model.as_printed;
            let model = Model { as_printed, ..Model::new(fidelity, case.model.ball) };
            let (outcome, jacobian) = model.collide_with_jacobian(&case.cue, &case.coefficients).unwrap();
            assert_eq!(outcome, model.collide(&case.cue, &case.coefficients).unwrap(), "{}", case.name);
            assert!(jacobian.iter().all(|x| x.is_finite()), "{}, {}: {jacobian}", case.name, fidelity.name());
            let off = case.off(&outcome, fidelity);
            let name = format!("{}, {}", case.name, fidelity.name());
            assert!(off <= ROUNDINGS * case.scale + SUBNORMAL, "{name}: {off:e}");
            if !is_hard {
                assert_eq!(case.case["regime"], outcome.regime.name(), "{name}");
                let off = (outcome.impulse - number(&case.case["impulse"])).abs();
                assert!(off < ROUNDINGS * case.scale, "{name}: {off:e}");
            }
        }
    }
}

/// What integrates the same equations as `full` is off by a few of its tolerances, which are of the closing speed.
#[test]
fn integration_agrees_with_25_digits() {
    const STEPS: f64 = 10.0;
    for case in Reference::ordinary().chain(Reference::hard()) {
        for tolerance in [1e-6, 1e-8, 1e-10, *TOLERANCES.start()] {
            let ode = Model::new(Fidelity::Ode, case.model.ball);
            let model = Model { as_printed: case.model.as_printed, tolerance, ..ode };
            let outcome = model.collide(&case.cue, &case.coefficients).unwrap();
            let off = case.off(&outcome, Fidelity::Full);
            let most = STEPS * tolerance * case.cue.velocity.x + ROUNDINGS * case.scale + SUBNORMAL;
            assert!(off <= most, "{}, {tolerance:e}: {off:e}, at most {most:e}", case.name);
            assert!(case.case.get("regime").is_none_or(|regime| *regime == outcome.regime.name()));
        }
    }
}

#[test]
fn compliant_contacts_agree_with_independent_integration() {
    /// Steps of 1e-11 of the closing speed, up to 5 m/s, some ten of which add up.
    const INTEGRATION: f64 = 1e-10;
    /// Steps of those of a fit, and friction that is taken to follow its slip closely.
    const QUICK: f64 = 1e-5;
    let cases: Vec<Reference> = Reference::compliant().collect();
    assert_eq!(cases.len(), 60);
    for case in &cases {
        let fine = case.model;
        let quick = Model { tolerance: Model::TOLERANCE_OF_FITS, ..fine };
        let contact = Model { fidelity: Fidelity::Contact, ..fine };
        let exact = number(&case.case["error"]) + INTEGRATION;
        for (model, most) in [(fine, exact), (contact, exact), (quick, QUICK)] {
            let outcome = model.collide(&case.cue, &case.coefficients).unwrap();
            let off = case.off(&outcome, Fidelity::Ode);
            assert!(off < most, "{:?} {}: {off:e}", model.fidelity, case.name);
        }
    }
}
