//! The sizes of effects are true: what `auto` leaves out changes an outcome by no more than its tolerance.

use caromfit::physics::collision::effects;

use crate::plain::difference;
use crate::prelude::*;

/// A shot as on a table: 3 cm/s to 10 m/s, any spin up to the natural roll's and side spin.
fn shot(rng: &mut ChaCha8Rng) -> (BallState, Coefficients) {
    let speed = 10_f64.powf(rng.random_range(-1.5..1.0));
    let velocity = cue_velocity(speed, rng.random_range(-75_f64..75.0).to_radians());
    let roll = BallState::natural_roll(velocity, Ball::POOL.radius).spin;
    let share = [1.0, 0.0, rng.random_range(-1.0..1.0)][rng.random_range(0..3)];
    let side = [0.0, rng.random_range(-1.0..1.0)][rng.random_range(0..2)] * roll.norm();
    let cue = BallState { velocity, spin: share * roll + Vec3::z() * side };
    let coefficients = Coefficients {
        mu: rng.random_range(0.02..0.1),
        mu_s: rng.random_range(0.1..0.5),
        e: rng.random_range(0.85..1.0),
    };
    (cue, coefficients)
}

fn off(a: &Outcome, b: &Outcome, radius: f64) -> f64 {
    let (cue, object) = (a.cue.velocity - b.cue.velocity, a.object.velocity - b.object.velocity);
    let spin = (a.cue.spin - b.cue.spin).amax().max((a.object.spin - b.object.spin).amax());
    cue.amax().max(object.amax()).max(radius * spin)
}

#[test]
fn what_is_left_out_stays_within_the_tolerance() {
    /// The part of shots that may be further off.
    const EXCEPTIONS: f64 = 1e-3;
    let shots = count("CAROMFIT_EFFECTS", 3_000);
    let laws = [Law::Constant, Law::Exponential { b: 0.1, c: 1.088 }];
    let mut rng = ChaCha8Rng::seed_from_u64(21);
    // integrated far below every tolerance
    let everything =
        Model { kappa: Model::KAPPA, tolerance: 1e-7, ..Model::new(Fidelity::Contact, Ball::POOL) };
    let cases: Vec<_> = (0..shots)
        .map(|i| {
            let (cue, coefficients) = shot(&mut rng);
            let model = Model { law: laws[usize::from(i % 4 == 0)], ..everything };
            (model, cue, coefficients, model.collide(&cue, &coefficients).unwrap())
        })
        .collect();
    for tolerance in [0.3, 0.1, 0.03, 0.01, 3e-3, 1e-3, 3e-4] {
        let (mut beyond, mut worst) = (0, 0.0_f64);
        for (model, cue, coefficients, all) in &cases {
            let choice = effects::choose(model, cue, coefficients, tolerance).unwrap();
            let outcome = choice.model.collide(cue, coefficients).unwrap();
            assert!(choice.left_out <= tolerance);
            let off = off(&outcome, all, model.ball.radius) / cue.velocity.norm();
            worst = worst.max(off / tolerance);
            beyond += usize::from(off > tolerance);
        }
        let said = format!("{tolerance:e}: {beyond} of {shots} are off, by up to {worst} of it");
        figure(&said);
        assert!(beyond as f64 <= EXCEPTIONS * shots as f64, "{said}");
    }
}

/// An effect that is off is that of a coefficient of 0 (of 1 for e), at every fidelity.
#[test]
fn an_effect_that_is_off_does_nothing() {
    let mut rng = ChaCha8Rng::seed_from_u64(22);
    for fidelity in Fidelity::ALL {
        for _ in 0..20 {
            let (cue, coefficients) = shot(&mut rng);
            let model = Model { tolerance: 1e-8, ..Model::new(fidelity, Ball::POOL) };
            let off = |name: &str| {
                let mut effects = model.effects;
                *effects.switch(name).unwrap() = false;
                let (outcome, jacobian) =
                    Model { effects, ..model }.collide_with_jacobian(&cue, &coefficients).unwrap();
                (outcome.components(), jacobian)
            };
            let with = |coefficients: Coefficients| model.collide(&cue, &coefficients).unwrap().components();
            let (friction, by) = off("friction");
            assert_eq!(friction, with(Coefficients { mu: 0.0, ..coefficients }));
            assert_eq!(by.column(Input::Mu as usize).amax(), 0.0);
            assert_eq!(off("cloth").0, with(Coefficients { mu_s: 0.0, ..coefficients }));
            assert_eq!(off("inelasticity").0, with(Coefficients { e: 1.0, ..coefficients }));
        }
    }
}

/// `full` follows friction that decreases during the impact as its equations are integrated; `linear` takes what it is at the first slip.
#[test]
fn friction_that_falls_with_the_slip_is_followed() {
    /// Of the speed.
    const INTEGRATED: f64 = 1e-10;
    const ROUNDING: f64 = 1e-14;
    let law = Law::Exponential { b: 0.04, c: 1.088 };
    let mut rng = ChaCha8Rng::seed_from_u64(24);
    for _ in 0..200 {
        let (cue, coefficients) = shot(&mut rng);
        let by = |fidelity, law, coefficients: &Coefficients| {
            let model = Model { law, tolerance: *TOLERANCES.start(), ..Model::new(fidelity, Ball::POOL) };
            model.collide(&cue, coefficients).unwrap()
        };
        let [full, ode] = [Fidelity::Full, Fidelity::Ode].map(|fidelity| by(fidelity, law, &coefficients));
        let off = difference(&full, &ode, Ball::POOL.radius);
        assert!(off < INTEGRATED * cue.velocity.norm(), "{off:e}: {cue:?} {coefficients:?}");
        let first = slip(&cue, &BallState::default(), Ball::POOL.radius).yz().norm();
        let constant = Coefficients { mu: law.mu(coefficients.mu, first), ..coefficients };
        let [falls, as_first] = [(law, &coefficients), (Law::Constant, &constant)]
            .map(|(law, coefficients)| by(Fidelity::Linear, law, coefficients));
        let off = difference(&falls, &as_first, Ball::POOL.radius);
        assert!(off < ROUNDING * cue.velocity.norm(), "{off:e}: {cue:?} {coefficients:?}");
    }
}
