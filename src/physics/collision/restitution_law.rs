//! A coefficient of restitution that falls with the closing speed v, e(v) = e₀ − e₁v: what students plot, and to first order what
//! balls and discs that yield a little do.
//!
//! Each collision has one closing speed, so that it is computed with its own e; the derivatives follow by the chain rule.

use super::{Coefficients, Column, Input, Jacobian, Model};
use crate::physics::ball::BallState;

/// The derivatives of e(v), not below 0.
#[derive(Clone, Copy, Debug)]
pub(super) struct Slopes {
    /// By e₀.
    e: f64,
    /// By v, s/m.
    speed: f64,
    /// By e₁, m/s.
    slope: f64,
}

impl Slopes {
    /// Where e is 0 whatever the speed.
    const NONE: Self = Self { e: 0.0, speed: 0.0, slope: 0.0 };

    /// What the derivatives by e of this collision say of e₀ and of v, in its Jacobian, and of e₁.
    pub fn carry(&self, jacobian: &mut Jacobian) -> Column {
        let by_e = jacobian.column(Input::E as usize).into_owned();
        let mut of_speed = jacobian.column_mut(Input::VelocityX as usize);
        of_speed += by_e * self.speed;
        jacobian.set_column(Input::E as usize, &(by_e * self.e));
        by_e * self.slope
    }
}

impl Model {
    /// This model with an e that is constant, the coefficients with the e of this collision, and how that e follows from e₀, v and e₁.
    pub(super) fn at_closing_speed(
        &self,
        cue: &BallState,
        coefficients: &Coefficients,
    ) -> Option<(Self, Coefficients, Slopes)> {
        let slope = self.e_slope?;
        let speed = cue.velocity.x;
        // e = e₀ − e₁v
        let e = coefficients.e - slope * speed;
        let constant = Self { e_slope: None, ..*self };
        // what is no collision is refused as it stands
        if !(coefficients.e >= 0.0 && speed > 0.0) {
            return Some((constant, *coefficients, Slopes::NONE));
        }
        if e < 0.0 {
            return Some((constant, Coefficients { e: 0.0, ..*coefficients }, Slopes::NONE));
        }
        let slopes = Slopes { e: 1.0, speed: -slope, slope: -speed };
        Some((constant, Coefficients { e, ..*coefficients }, slopes))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::physics::ball::{Ball, Vec3};
    use crate::physics::collision::{Effects, Fidelity};

    /// Central differences with this step err by its square, of numbers of order 1; those of integrated outcomes by their tolerance
    /// over it.
    const STEP: f64 = 1e-4;
    const ERROR: f64 = 1e-5;

    fn shot() -> (BallState, Coefficients) {
        let cue = BallState { velocity: Vec3::new(1.5, 0.8, 0.0), spin: Vec3::new(0.0, 12.0, 5.0) };
        (cue, Coefficients { mu: 0.05, mu_s: 0.25, e: 0.94 })
    }

    fn models() -> Vec<Model> {
        let compliant = Effects { compliance: true, ..Fidelity::Full.effects() };
        let ode = Model::new(Fidelity::Ode, Ball::POOL);
        let full = Model::new(Fidelity::Full, Ball::POOL);
        let all = [
            Model::new(Fidelity::Linear, Ball::POOL),
            full,
            full.with_mass_ratio(1.2),
            ode,
            Model { effects: compliant, kappa: 1.2, ..ode },
            Model::new(Fidelity::Contact, Ball::POOL),
        ];
        all.into_iter().map(|model| Model { e_slope: Some(0.1), ..model }).collect()
    }

    #[test]
    fn a_collision_has_the_e_of_its_closing_speed() {
        let (cue, coefficients) = shot();
        for model in models() {
            let falling = model.collide(&cue, &coefficients).unwrap();
            let constant = Model { e_slope: None, ..model };
            let own = Coefficients { e: 0.94 - 0.1 * 1.5, ..coefficients };
            assert_eq!(falling, constant.collide(&cue, &own).unwrap());
            let not_below_0 = Model { e_slope: Some(1.0), ..model };
            let inelastic = Coefficients { e: 0.0, ..coefficients };
            let [a, b] = [(not_below_0, coefficients), (constant, inelastic)]
                .map(|(model, coefficients)| model.collide(&cue, &coefficients).unwrap());
            assert_eq!(a, b);
        }
    }

    #[test]
    fn derivatives_agree_with_differences_at_every_fidelity() {
        let (cue, coefficients) = shot();
        for model in models() {
            let at = |slope: f64, speed: f64, e: f64| {
                let cue = BallState { velocity: Vec3::new(speed, 0.8, 0.0), ..cue };
                let model = Model { e_slope: Some(slope), ..model };
                model.collide(&cue, &Coefficients { e, ..coefficients }).unwrap().components()
            };
            let (_, jacobian, by_others) = model.collide_with_all(&cue, &coefficients).unwrap();
            let h = STEP;
            let by_slope = (at(0.1 + h, 1.5, 0.94) - at(0.1 - h, 1.5, 0.94)) / (2.0 * h);
            let by_speed = (at(0.1, 1.5 + h, 0.94) - at(0.1, 1.5 - h, 0.94)) / (2.0 * h);
            let by_e = (at(0.1, 1.5, 0.94 + h) - at(0.1, 1.5, 0.94 - h)) / (2.0 * h);
            for (column, expected) in [
                (by_others.unwrap().column(5).into_owned(), by_slope),
                (jacobian.column(Input::VelocityX as usize).into_owned(), by_speed),
                (jacobian.column(Input::E as usize).into_owned(), by_e),
            ] {
                let error = (column - expected).amax() / expected.amax();
                assert!(error < ERROR, "{:?}, κ = {}: {error}", model.fidelity, model.kappa);
            }
        }
    }

    #[test]
    fn what_is_no_collision_is_refused_as_without() {
        let (cue, coefficients) = shot();
        let model = Model { e_slope: Some(0.1), ..Model::new(Fidelity::Full, Ball::POOL) };
        let constant = Model { e_slope: None, ..model };
        let away = BallState { velocity: -cue.velocity, ..cue };
        let too_elastic = Coefficients { e: -0.1, ..coefficients };
        for (cue, coefficients) in [(away, coefficients), (cue, too_elastic)] {
            assert_eq!(model.collide(&cue, &coefficients), constant.collide(&cue, &coefficients));
        }
        let unknown = Model { e_slope: Some(f64::NAN), ..model };
        assert!(unknown.collide(&cue, &coefficients).is_err());
    }
}
