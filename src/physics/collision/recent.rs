//! Integrated collisions with their derivatives, as they were last computed: a fit asks for the same ones several times at every
//! step, for its residuals, its weights and its noise, and each takes as long as a thousand others.

use std::cell::RefCell;

use super::{All, Coefficients, Model, NotACollision};
use crate::physics::ball::BallState;

/// How many are kept, each in a place of its own: as many as a fit has integrated shots, or more.
const KEPT: usize = 128;

struct Computed {
    model: Model,
    cue: BallState,
    coefficients: Coefficients,
    found: Result<All, NotACollision>,
}

thread_local! {
    static RECENT: RefCell<Vec<Option<Box<Computed>>>> = const { RefCell::new(Vec::new()) };
}

/// What `compute` gives for this collision, or gave when it was last asked for.
pub(super) fn remembered(
    model: &Model,
    cue: &BallState,
    coefficients: &Coefficients,
    compute: impl FnOnce() -> Result<All, NotACollision>,
) -> Result<All, NotACollision> {
    let place = place(cue, coefficients);
    let known = RECENT.with_borrow(|recent| {
        let kept = recent.get(place)?.as_ref()?;
        let same = kept.cue == *cue && kept.coefficients == *coefficients && kept.model == *model;
        same.then_some(kept.found)
    });
    if let Some(found) = known {
        return found;
    }
    let found = compute();
    RECENT.with_borrow_mut(|recent| {
        recent.resize_with(KEPT, || None);
        let kept = Computed { model: *model, cue: *cue, coefficients: *coefficients, found };
        recent[place] = Some(Box::new(kept));
    });
    found
}

/// Mixes what differs between the shots of a fit and between its steps.
fn place(cue: &BallState, coefficients: &Coefficients) -> usize {
    const ODD: u64 = 0x9e37_79b9_7f4a_7c15;
    let numbers = [cue.velocity.x, cue.velocity.y, cue.spin.x, cue.spin.y, cue.spin.z, coefficients.mu];
    let mixed = numbers
        .iter()
        .fold(0_u64, |mixed, number| (mixed.rotate_left(25) ^ number.to_bits()).wrapping_mul(ODD));
    (mixed >> 40) as usize % KEPT
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::physics::ball::Ball;
    use crate::physics::collision::{Effects, Fidelity};
    use crate::physics::contact_frame::cue_velocity;

    #[test]
    fn what_differs_in_anything_is_computed_anew() {
        let effects = Effects { compliance: true, ..Fidelity::Full.effects() };
        let model = Model { effects, kappa: 1.2, ..Model::new(Fidelity::Ode, Ball::POOL) };
        let cue = BallState { velocity: cue_velocity(1.0, 0.5), ..BallState::default() };
        let coefficients = Coefficients { mu: 0.05, mu_s: 0.2, e: 0.9 };
        let compute = |model: &Model, e: f64| {
            let coefficients = Coefficients { e, ..coefficients };
            remembered(model, &cue, &coefficients, || model.compute_with_others(&cue, &coefficients)).unwrap()
        };
        let first = compute(&model, 0.9);
        let stiffer = Model { kappa: 1.0, ..model };
        assert_ne!(first.0.impulse, compute(&model, 0.8).0.impulse);
        assert_ne!(first.1, compute(&stiffer, 0.9).1);
        let never = || -> Result<All, NotACollision> { unreachable!("it is known") };
        assert_eq!(remembered(&stiffer, &cue, &coefficients, never).unwrap().1, compute(&stiffer, 0.9).1);
    }
}
