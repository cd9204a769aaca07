//! A contact that gives way along the surface, and balls of unequal mass.

use caromfit::physics::collision::MAX_KAPPA;

use super::energy;
use crate::plain::difference;
use crate::prelude::*;

/// What `full` contains, and compliance.
pub fn compliant(fidelity: Fidelity, ball: Ball) -> Model {
    let effects = Effects { compliance: true, ..Fidelity::Full.effects() };
    Model { effects, kappa: Model::KAPPA, ..Model::new(fidelity, ball) }
}

/// A shot of any kind.
fn shot(rng: &mut ChaCha8Rng) -> (BallState, Coefficients) {
    let velocity = cue_velocity(rng.random_range(0.5..5.0), rng.random_range(-60_f64..60.0).to_radians());
    let roll = BallState::natural_roll(velocity, Ball::POOL.radius).spin;
    let share: f64 = rng.random_range(-1.0..1.0);
    let spin = match rng.random_range(0..4) {
        0 => roll,
        1 => Vec3::zeros(),
        2 => share * roll,
        _ => roll + Vec3::z() * (share * roll.norm()),
    };
    let coefficients = Coefficients {
        mu: rng.random_range(0.02..0.3),
        mu_s: rng.random_range(0.0..0.4),
        e: rng.random_range(0.5..1.0),
    };
    (BallState { velocity, spin }, coefficients)
}

/// Between two outcomes, velocities and spins times R.
fn apart(a: &Outcome, b: &Outcome) -> f64 {
    difference(a, b, Ball::POOL.radius)
}

/// Of topspin shots whose contact holds late, as the friction turns round. The spring holds just at its limit as it begins to hold,
/// and in the first shot holds again for less than one step.
#[test]
fn tolerances_agree_where_the_contact_holds_late() {
    /// Between a tolerance and one of 1e-12, parts of the speed; a spring that does not hold when it should errs by 1e-3.
    const APART: f64 = 30.0;
    for row in include_str!("../reference/holds-late.csv").lines().skip(2) {
        let numbers: Vec<f64> = row.split(',').map(|number| number.parse().unwrap()).collect();
        let [speed, cut_deg, x, y, z, mu, mu_s, e, kappa] = numbers[..] else { panic!("{row}") };
        let spin = Vec3::new(x, y, z);
        let cue = BallState { velocity: cue_velocity(speed, cut_deg.to_radians()), spin };
        let coefficients = Coefficients { mu, mu_s, e };
        let at = |tolerance: f64| {
            let model = Model { kappa, tolerance, ..compliant(Fidelity::Ode, Ball::POOL) };
            model.collide(&cue, &coefficients).unwrap()
        };
        let fine = at(1e-12);
        for tolerance in [1e-8, 3e-9, 1e-9, 3e-10, 1e-10, 3e-11, 1e-11] {
            let apart = apart(&at(tolerance), &fine);
            assert!(apart < APART * tolerance * speed, "{speed} m/s, {tolerance:e}: {apart:e}");
        }
    }
}

#[test]
fn towards_no_compliance_it_becomes_the_rigid_contact() {
    /// The difference over √κ and the closing speed, of the hardest of these shots; over κ where it slides throughout.
    const SHAKES: f64 = 0.3;
    const SLIDES: f64 = 0.5;
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let mut slid = 0;
    for _ in 0..100 {
        let (cue, coefficients) = shot(&mut rng);
        let full = Model::new(Fidelity::Full, Ball::POOL).collide(&cue, &coefficients).unwrap();
        for kappa in [1e-1, 1e-2, 1e-3, 1e-4] {
            let model = Model { kappa, tolerance: 1e-7, ..compliant(Fidelity::Ode, Ball::POOL) };
            let outcome = model.collide(&cue, &coefficients).unwrap();
            let apart = apart(&outcome, &full) / cue.velocity.x;
            assert!(apart < SHAKES * kappa.sqrt(), "{kappa}: {apart:e} {cue:?} {coefficients:?}");
            if outcome.regime == full.regime && full.regime == Regime::Slide {
                slid += 1;
                assert!(apart < SLIDES * kappa + 1e-5, "{kappa}: {apart:e} {cue:?} {coefficients:?}");
            }
        }
    }
    assert!(slid > 50, "{slid}");
}

#[test]
fn no_impact_makes_energy_and_stiff_ones_are_computed() {
    let mut rng = ChaCha8Rng::seed_from_u64(8);
    for round in 0..300 {
        let (cue, coefficients) = shot(&mut rng);
        let coefficients = match round % 5 {
            0 => Coefficients { e: 1.0, mu_s: 0.0, ..coefficients },
            1 => Coefficients { e: 0.0, ..coefficients },
            2 => Coefficients { e: 1e-3, ..coefficients },
            3 => Coefficients { mu: 1e-3, ..coefficients },
            _ => Coefficients { mu: 1.0, ..coefficients },
        };
        let kappa = [1e-4, 1e-2, 1.0, 20.0, MAX_KAPPA][rng.random_range(0..5)];
        let ratio = [0.5, 1.0, 2.0][rng.random_range(0..3)];
        for fidelity in [Fidelity::Ode, Fidelity::Contact] {
            let model =
                Model { kappa, tolerance: 1e-6, ..compliant(fidelity, Ball::POOL) }.with_mass_ratio(ratio);
            let outcome = model.collide(&cue, &coefficients).unwrap();
            let before = ratio * energy(&Ball::POOL, &cue);
            let after = ratio * energy(&Ball::POOL, &outcome.cue) + energy(&Ball::POOL, &outcome.object);
            assert!(after <= before * (1.0 + 1e-5), "{kappa} {ratio} {cue:?} {coefficients:?}");
        }
    }
}

#[test]
fn momentum_is_kept_whatever_the_masses() {
    /// Of sums of some roundings, m/s; what is integrated keeps sums of its state.
    const ROUNDING: f64 = 1e-12;
    let mut rng = ChaCha8Rng::seed_from_u64(9);
    for round in 0..50 {
        let (cue, coefficients) = shot(&mut rng);
        let coefficients = Coefficients { mu_s: 0.0, ..coefficients };
        let kappa = if round % 2 == 0 { 0.0 } else { Model::KAPPA };
        let ratio = rng.random_range(0.3..3.0);
        for fidelity in Fidelity::ALL {
            let base = compliant(fidelity, Ball::POOL).with_mass_ratio(ratio);
            let effects = Effects { gravity: false, cloth_on_cue: false, ..base.effects };
            let kappa = if fidelity == Fidelity::Contact { Model::KAPPA } else { kappa };
            let outcome =
                Model { effects, kappa, tolerance: 1e-8, ..base }.collide(&cue, &coefficients).unwrap();
            let change = ratio * (outcome.cue.velocity - cue.velocity) + outcome.object.velocity;
            assert!(change.xy().amax() < ROUNDING, "{fidelity:?} {change}");
            // the relative speed along the line of centres falls to e of what it was, without the cloth
            let e = if fidelity == Fidelity::Elastic { 1.0 } else { coefficients.e };
            let leaves = outcome.object.velocity.x - outcome.cue.velocity.x;
            assert!((leaves - e * cue.velocity.x).abs() < 1e-6, "{fidelity:?} {leaves} {kappa}");
        }
    }
}

/// Balls that differ in everything.
fn unequal(model: Model) -> Model {
    let object = Ball { radius: model.ball.radius, mass: model.ball.mass / 1.2, inertia: 0.43 };
    Model { object: Some(object), ..model }
}

#[test]
fn full_solves_the_equations_of_unequal_balls_as_they_are_integrated() {
    /// Of ode at a tolerance of 1e-10, m/s.
    const INTEGRATED: f64 = 1e-8;
    let mut rng = ChaCha8Rng::seed_from_u64(12);
    for i in 0..200 {
        let (cue, coefficients) = shot(&mut rng);
        let with = |fidelity| {
            let rigid = Model { effects: Fidelity::Full.effects(), ..Model::new(fidelity, Ball::POOL) };
            let model = if i % 2 == 0 { unequal(rigid) } else { rigid.with_mass_ratio(0.7) };
            model.collide(&cue, &coefficients).unwrap()
        };
        let full = with(Fidelity::Full);
        let apart = apart(&with(Fidelity::Ode), &full);
        assert!(apart < INTEGRATED, "{apart:e} {cue:?} {coefficients:?} {:?}", full.regime);
    }
}

#[test]
fn a_ball_that_is_larger_presses_the_other_down_and_a_smaller_one_lifts_it() {
    /// Friction between the balls turns by so little: second order.
    const FRICTION: f64 = 0.02;
    // side spin keeps the friction between the balls along y, whatever the balls then do along z
    let cue = BallState { velocity: Vec3::new(2.0, 0.0, 0.0), spin: Vec3::new(0.0, 0.0, 100.0) };
    let coefficients = Coefficients { mu: 0.05, mu_s: 0.25, e: 0.94 };
    let radius = Ball::POOL.radius;
    for fidelity in [Fidelity::Inelastic, Fidelity::Full, Fidelity::Ode, Fidelity::Contact] {
        let outcome = |object_radius: f64| {
            let object = Ball { radius: object_radius, ..Ball::POOL };
            let effects = Fidelity::Full.effects();
            let model = Model { object: Some(object), effects, ..Model::new(fidelity, Ball::POOL) };
            model.collide(&cue, &coefficients).unwrap()
        };
        // sin δ = 0.005
        let (lifts, presses) = (outcome(radius * 1.005 / 0.995), outcome(radius * 0.995 / 1.005));
        let p = 0.97 * 2.0;
        assert!((lifts.object.velocity.z - 0.005 * p).abs() < FRICTION * 0.005 * p, "{fidelity:?} {lifts:?}");
        assert!(lifts.cue.velocity.z == 0.0 && presses.object.velocity.z == 0.0);
        assert!(
            (presses.cue.velocity.z - 0.005 * p).abs() < FRICTION * 0.005 * p,
            "{fidelity:?} {presses:?}"
        );
        if fidelity != Fidelity::Inelastic {
            // −μ_s P sin δ along x, half of which P makes up for; it turns the ball forwards
            let braked = 0.25 * 0.005 * p;
            assert!(
                (presses.object.velocity.x - (p - 0.5 * braked)).abs() < 2.0 * FRICTION * braked,
                "{fidelity:?} {presses:?}"
            );
            let forward = presses.object.spin.y * 0.4 * radius * 0.995 / 1.005;
            assert!((forward - braked).abs() < 2.0 * FRICTION * braked, "{fidelity:?} {forward} {braked}");
        }
    }
}

/// A contact that slides at first touch by so little, or holds so barely, that what it does next decides: all ways to compute it agree with the
/// finest to the error of the quick one, and each is continuous.
#[test]
fn the_outcome_is_continuous_where_sliding_sets_in() {
    /// The slip differs by dμκ < 1.5d, and the outcome by no more than twice that.
    const SLOPE: f64 = 3.0;
    /// Of an outcome: some dozen steps.
    const STEPS: f64 = 30.0;
    /// Of the quick way, and of `contact` at its tolerance, parts of the speed.
    const QUICK: f64 = 1e-6;
    let ways = [
        (Fidelity::Ode, Model::TOLERANCE_OF_FITS),
        (Fidelity::Ode, 1e-8),
        (Fidelity::Ode, 1e-11),
        (Fidelity::Contact, 1e-10),
    ];
    let mut rng = ChaCha8Rng::seed_from_u64(31);
    for number in 0..300 {
        let mu = rng.random_range(0.02..0.3);
        // above 3.5 a contact that holds at first is the one that lets go at once
        let kappa = rng.random_range(0.3..5.0);
        let (sin, cos) = rng.random_range(0.0..std::f64::consts::TAU).sin_cos();
        let (mu_s, e) = (rng.random_range(0.0..0.4), rng.random_range(0.5..1.0));
        let mass_ratio = rng.random_range(0.8..1.2);
        let coefficients = Coefficients { mu, mu_s, e };
        let sign = if rng.random_bool(0.5) { 1.0 } else { -1.0 };
        let d = sign * 10_f64.powf(rng.random_range(-13.0..-2.0));
        // a closing speed of 1 m/s and a slip of (1 + d)μκ of it
        let at = |d: f64, (fidelity, tolerance): (Fidelity, f64)| {
            let spin = mu * kappa * (1.0 + d) / Ball::POOL.radius;
            // v_y = −Rω_z, v_z = Rω_y
            let spin = Vec3::new(0.0, spin * sin, -spin * cos);
            let cue = BallState { velocity: Vec3::new(1.0, 0.0, 0.0), spin };
            let model = Model { kappa, tolerance, ..compliant(fidelity, Ball::POOL) };
            model.with_mass_ratio(mass_ratio).collide(&cue, &coefficients).unwrap()
        };
        let here = ways.map(|way| at(d, way));
        for (way, outcome) in ways.into_iter().zip(here) {
            let off = apart(&outcome, &here[2]);
            assert!(off < QUICK, "{way:?} {d:e}: {off:e} {kappa}");
            // every third suffices
            if number % 3 == 0 {
                let jump = apart(&outcome, &at(0.0, way));
                assert!(jump < SLOPE * d.abs() + STEPS * way.1, "{way:?} {d:e}: {jump:e}");
            }
        }
    }
}
