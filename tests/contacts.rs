//! Contacts and balls as they are, in fits: balls that are not equal, and contacts that give way along their surface.

use crate::prelude::*;

/// What a kitchen scale tells, kg.
const SCALE: f64 = 0.001;

/// A cue ball of 170 g and an object ball of 160 g, weighed to 1 g.
fn weighed(kind: &str, seed: u64) -> Spec {
    let balls = format!(
        "ball = {{ mass_kg = 0.170, mass_kg_sd = {SCALE} }}\nobject = {{ mass_kg = 0.160, mass_kg_sd = {SCALE} }}"
    );
    with(&spec(kind, &["natural-roll"], 40, seed), &balls)
}

#[test]
fn what_is_simulated_is_found_again() {
    for (kind, seed) in [("impacts", 61), ("tracks", 62)] {
        let dataset = simulate::dataset(&weighed(kind, seed)).unwrap();
        let object = dataset.object.unwrap();
        assert_eq!(object.mass_sd, Some([SCALE; 2]));
        // as the scale shows it, which is not the truth
        let off = object.ball.mass - 0.160;
        assert!(off != 0.0 && off.abs() < ERRORS * SCALE, "{off}");
        let fit = auto(&dataset);
        for (parameter, truth) in weighed(kind, seed).truths() {
            is_right(&fit, parameter, truth);
        }
        assert!(fit.get(Parameter::MassRatio).unwrap().status == Status::Free, "{kind:?}");
    }
}

#[test]
fn radii_and_inertias_that_differ_are_simulated_in_every_kind() {
    for (kind, seed) in [("impacts", 63), ("tracks", 64), ("angles", 65)] {
        let usual = spec(kind, &["natural-roll", "stun"], 40, seed);
        let spec = with(&usual, "object = { radius_m = 0.0280, inertia = 0.39 }");
        let dataset = simulate::dataset(&spec).unwrap();
        let ball = Ball { radius: 0.0280, inertia: 0.39, ..Ball::POOL };
        // no mass of it is stated
        let stated = ObjectBall { mass_sd: None, ..ObjectBall::exact(ball) };
        assert_eq!(dataset.object, Some(stated), "{kind:?}");
        let fit = auto(&dataset);
        for parameter in Parameter::COEFFICIENTS {
            let truth = spec.truths()[parameter as usize].1;
            is_right(&fit, parameter, truth);
        }
    }
}

/// dv_x/dq = 1 + m_object/m_cue + μ_s μ sin θ must stay positive, sin θ from −1 with topspin.
#[test]
fn balls_jam_by_their_masses() {
    let velocity = Vec3::new(1.0, 0.2, 0.0);
    let roll = BallState::natural_roll(velocity, Ball::POOL.radius);
    let stun = BallState { velocity, spin: Vec3::zeros() };
    // just inside and just outside of 1 + 1/r; μ_s below 1 + (1 + ν)/r
    for (ratio, mu_s) in [(5.0, 1.2), (1.0, 2.0), (0.2, 3.0)] {
        let model = Model::new(Fidelity::Full, Ball::POOL).with_mass_ratio(ratio);
        let most = 1.0 + 1.0 / ratio;
        let of = |part: f64| Coefficients { mu: part * most / mu_s, mu_s, e: 0.9 };
        let inside = model.collide(&roll, &of(0.99)).unwrap();
        assert!(inside.impulse.is_finite() && inside.object.velocity.x > 0.0, "{ratio}: {inside:?}");
        let NotACollision::Jams(product, bound) = model.collide(&roll, &of(1.01)).unwrap_err() else {
            panic!("{ratio}")
        };
        assert!((product - 1.01 * most).abs() < 1e-12 && (bound - most).abs() < 1e-12);
        assert!(model.collide(&stun, &of(1.01)).is_ok(), "the cloth takes no part without topspin");
    }
    let heavy = Model::new(Fidelity::Full, Ball::POOL).with_mass_ratio(5.0);
    let over = heavy.collide(&roll, &Coefficients { mu: 0.1, mu_s: 1.3, e: 0.9 }).unwrap_err();
    assert!(matches!(over, NotACollision::MuSOutOfRange(_, most) if (most - 1.28).abs() < 1e-12), "{over}");
}

/// Stun shots whose contact gives way by so much.
fn giving(kappa: f64, seed: u64) -> Dataset {
    let effects = Effects { compliance: true, ..Fidelity::Full.effects() };
    let model = Model { effects, kappa, tolerance: 1e-9, ..Model::new(Fidelity::Ode, Ball::POOL) };
    made_with(&spec("impacts", &["stun"], 40, seed), &model)
}

#[test]
fn a_contact_that_gives_way_is_adopted_where_the_data_call_for_it() {
    let fit = auto(&giving(Model::KAPPA, 31));
    is_right(&fit, Parameter::Mu, TRUTH[0]);
    is_right(&fit, Parameter::E, TRUTH[2]);
    let kappa = fit.get(Parameter::Kappa).unwrap();
    assert_eq!((kappa.value, kappa.status), (Model::KAPPA, Status::Fixed));
    let is_large = |known: &Value| known["adopted"] == true && number(known, "/delta_2logl") < -6.0;
    assert!(part(&fit, "/explanations").as_array().unwrap().iter().any(is_large));
    assert_eq!(part(&fit, "/effects/compliance"), true);
}

#[test]
fn it_is_not_where_they_do_not() {
    let dataset = made_with(&spec("impacts", &["stun"], 40, 32), &Model::new(Fidelity::Full, Ball::POOL));
    let fit = auto(&dataset);
    assert!(fit.get(Parameter::Kappa).is_none() && part(&fit, "/explanations") == json!([]));
    is_right(&fit, Parameter::Mu, TRUTH[0]);
    // nor where it is stated to be rigid
    let mut rigid = giving(Model::KAPPA, 31);
    rigid.settings.compliance = Compliance::Rigid;
    assert!(auto(&rigid).get(Parameter::Kappa).is_none());
}

#[test]
fn kappa_is_fitted_within_bounds() {
    let mut dataset = giving(2.5, 33);
    dataset.settings.compliance = Compliance::Stated;
    dataset.settings[Parameter::Kappa] = Setting { fixed: false, ..Parameter::Kappa.default_setting() };
    let fit = auto(&dataset);
    // χ² hardly rises from 2.5 to 5: the interval tells, and the curvature at the minimum does not
    let kappa = fit.get(Parameter::Kappa).unwrap();
    let [low, high] = kappa.interval_95.unwrap();
    assert!(low < 2.5 && 2.5 < high && low > 1.0, "{kappa:?}");
    is_right(&fit, Parameter::Mu, TRUTH[0]);
}
