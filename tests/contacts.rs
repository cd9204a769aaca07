//! Contacts and balls as they are: κ of a contact that gives way, and balls of unequal mass, in fits.

use crate::prelude::*;

/// Stun shots whose contact gives way by so much.
fn giving(kappa: f64, seed: u64) -> Dataset {
    let effects = Effects { compliance: true, ..Fidelity::Full.effects() };
    let model = Model { effects, kappa, tolerance: 1e-9, ..Model::new(Fidelity::Ode, Ball::POOL) };
    made_with(&spec(Kind::Impacts, &[Played::Stun], 40, seed), &model)
}

#[test]
fn a_contact_that_gives_way_is_adopted_where_the_data_call_for_it() {
    let fit = auto(&giving(Model::KAPPA, 31));
    is_right(&fit, Parameter::Mu, TRUTH[0]);
    is_right(&fit, Parameter::E, TRUTH[2]);
    let kappa = fit.get(Parameter::Kappa).unwrap();
    assert_eq!((kappa.value, kappa.status), (Model::KAPPA, Status::Fixed));
    assert!(fit.explanations.iter().any(|known| known.adopted && known.delta_2logl < -6.0));
    assert!(fit.effects.iter().any(|(name, on)| *name == "compliance" && *on));
}

#[test]
fn it_is_not_where_they_do_not() {
    let dataset =
        made_with(&spec(Kind::Impacts, &[Played::Stun], 40, 32), &Model::new(Fidelity::Full, Ball::POOL));
    let fit = auto(&dataset);
    assert!(fit.get(Parameter::Kappa).is_none() && fit.explanations.is_empty());
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
