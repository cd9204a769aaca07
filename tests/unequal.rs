//! Balls that are not equal, from the specification of shots to what other programs are given: `synth`, `extract`, `fit`, `design` and
//! `export`.

use caromfit::design::{PlayedKind, design};

use crate::prelude::*;

/// What a kitchen scale tells, kg.
const SCALE: f64 = 0.001;

/// A cue ball of 170 g and an object ball of 160 g, weighed to 1 g.
fn weighed(kind: Kind, seed: u64) -> Spec {
    Spec {
        ball: BallSpec { mass_kg: 0.170, mass_kg_sd: SCALE, ..BallSpec::default() },
        object: Some(StatedObject {
            mass_kg: Some(0.160),
            mass_kg_sd: Some(SCALE),
            ..StatedObject::default()
        }),
        ..spec(kind, &[Played::NaturalRoll], 40, seed)
    }
}

#[test]
fn what_is_simulated_is_found_again() {
    for (kind, seed) in [(Kind::Impacts, 61), (Kind::Tracks, 62)] {
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
    let object = StatedObject { radius_m: Some(0.0280), inertia: Some(0.39), ..StatedObject::default() };
    for (kind, seed) in [(Kind::Impacts, 63), (Kind::Tracks, 64), (Kind::Angles, 65)] {
        let spec =
            Spec { object: Some(object), ..spec(kind, &[Played::NaturalRoll, Played::Stun], 40, seed) };
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

#[test]
fn a_contact_that_gives_way_is_simulated() {
    let usual = spec(Kind::Impacts, &[Played::Stun], 40, 66);
    let truth = Truth { kappa: Some(Model::KAPPA), e_slope: Some(0.01), ..usual.truth };
    let spec = Spec { truth, ..usual };
    let mut dataset = simulate::dataset(&spec).unwrap();
    dataset.settings.compliance = Compliance::Stated;
    dataset.settings.e_falls = true;
    dataset.settings[Parameter::ESlope].fixed = false;
    let fit = auto(&dataset);
    for parameter in [Parameter::Mu, Parameter::E, Parameter::ESlope] {
        let of = spec.truths();
        is_right(&fit, parameter, of.iter().find(|(known, _)| *known == parameter).unwrap().1);
    }
    // a fidelity that is rigid cannot
    let rigid = simulate::generate_with(&spec, &Model::new(Fidelity::Full, Ball::POOL));
    assert!(rigid.unwrap_err().to_string().contains("truth.kappa is 1.257"));
    // nor half a law of friction
    let half = Spec { truth: Truth { mu_b: Some(0.1), ..spec.truth }, ..spec };
    assert!(simulate::generate(&half).unwrap_err().to_string().contains("truth.mu_c is missing"));
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

/// The bound is taken where the fit ended, a standard error from the truth, and the shutter's instants are not spread quite evenly.
const SAME_BOUND: f64 = 0.06;

#[test]
fn designs_expect_the_errors_that_fits_have() {
    let shots =
        Shots { count: 60, speed_m_s: [2.0; 2], cut_deg: [30.0; 2], cue_spin: vec![Played::NaturalRoll] };
    let spec = Spec { shots, ..weighed(Kind::Tracks, 68) };
    let fit = auto(&simulate::dataset(&spec).unwrap());
    let kind = PlayedKind { speed_m_s: [2.0; 2], cut_deg: [30.0; 2], shots: 60, ..PlayedKind::default() };
    let object = spec.object.unwrap().beside(Ball { mass: 0.170, ..Ball::POOL }, [SCALE, 0.0]);
    let of = |object| Expected { object, kinds: vec![kind.clone()], ..Expected::default() };
    let planned = design(&of(Some(object))).unwrap().planned;
    let expected = planned.std_errors.into_iter().chain([planned.ratios[0]]);
    for (parameter, expected) in
        Parameter::COEFFICIENTS.into_iter().chain([Parameter::MassRatio]).zip(expected)
    {
        let (expected, found) = (expected.unwrap(), fit.get(parameter).unwrap().std_error.unwrap());
        assert!((expected / found - 1.0).abs() < SAME_BOUND, "{parameter:?}: {expected}, {found}");
    }
    // what is weighed exactly costs nothing
    let exact = design(&of(Some(ObjectBall::exact(object.ball)))).unwrap().planned;
    assert_eq!(exact.ratios, [None; 2]);
    let [exact, planned] = [exact, planned].map(|all| all.std_errors.map(Option::unwrap));
    assert!(exact[1] < 0.9 * planned[1], "{exact:?} {planned:?}");
}
