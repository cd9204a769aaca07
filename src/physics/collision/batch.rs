//! Many collisions with the same coefficients, as structures of arrays: what all shots share is checked and
//! computed once, and shots of one kind are solved one after the other. Every outcome is that of
//! [`Model::collide`], to the last digit.
//!
//! ```
//! use caromfit::ball::Ball;
//! use caromfit::collision::batch::{Arrays, Cues};
//! use caromfit::collision::{Coefficients, Fidelity, Model};
//!
//! let cues = Cues { velocity: [&[2.0, 1.0], &[0.5, 0.0]], spin: [&[0.0; 2], &[60.0, 0.0], &[0.0; 2]] };
//! let mut arrays = Arrays::new(2);
//! let model = Model::new(Fidelity::Full, Ball::POOL);
//! let coefficients = Coefficients { mu: 0.05, mu_s: 0.3, e: 0.94 };
//! model.collide_batch(&cues, &coefficients, &mut arrays.outcomes())?;
//! assert!(arrays.status.iter().all(Result::is_ok) && arrays.object_velocity[0][1] > 0.9);
//! # Ok::<(), caromfit::collision::batch::Lengths>(())
//! ```

use super::{
    Coefficients, Contact, Fidelity, Jacobian, Model, NotACollision, Outcome, Regime, elastic, inelastic,
    kim, linear,
};
use crate::physics::ball::{BallState, Vec3};

/// Cue balls before the impact, collision frame, m/s and rad/s: one entry per shot in each slice.
#[derive(Clone, Copy, Debug)]
pub struct Cues<'a> {
    /// U_x, U_y.
    pub velocity: [&'a [f64]; 2],
    /// ω_x, ω_y, ω_z.
    pub spin: [&'a [f64]; 3],
}

/// Where outcomes go: one entry per shot in each slice, x, y, z. A shot that is none has its reason in
/// `status` and NaN elsewhere.
#[derive(Debug)]
pub struct Outcomes<'a> {
    pub status: &'a mut [Result<Regime, NotACollision>],
    /// Normal impulse per unit mass q, m/s.
    pub impulse: &'a mut [f64],
    pub cue_velocity: [&'a mut [f64]; 3],
    pub cue_spin: [&'a mut [f64]; 3],
    pub object_velocity: [&'a mut [f64]; 3],
    pub object_spin: [&'a mut [f64]; 3],
}

/// Slices of unlike lengths.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{name} has {found} shots; expected {expected}, as velocity x has")]
pub struct Lengths {
    pub name: &'static str,
    pub found: usize,
    pub expected: usize,
}

/// Arrays of the caller's own for [`Outcomes`].
#[derive(Clone, Debug)]
pub struct Arrays {
    pub status: Vec<Result<Regime, NotACollision>>,
    pub impulse: Vec<f64>,
    pub cue_velocity: [Vec<f64>; 3],
    pub cue_spin: [Vec<f64>; 3],
    pub object_velocity: [Vec<f64>; 3],
    pub object_spin: [Vec<f64>; 3],
}

impl Arrays {
    /// For so many shots.
    #[must_use]
    pub fn new(shots: usize) -> Self {
        let three = || [0; 3].map(|_| vec![f64::NAN; shots]);
        Self {
            status: vec![Ok(Regime::Slide); shots],
            impulse: vec![f64::NAN; shots],
            cue_velocity: three(),
            cue_spin: three(),
            object_velocity: three(),
            object_spin: three(),
        }
    }

    pub fn outcomes(&mut self) -> Outcomes<'_> {
        Outcomes {
            status: &mut self.status,
            impulse: &mut self.impulse,
            cue_velocity: self.cue_velocity.each_mut().map(Vec::as_mut_slice),
            cue_spin: self.cue_spin.each_mut().map(Vec::as_mut_slice),
            object_velocity: self.object_velocity.each_mut().map(Vec::as_mut_slice),
            object_spin: self.object_spin.each_mut().map(Vec::as_mut_slice),
        }
    }
}

/// So many shots are sorted by kind at a time, on the stack.
const BLOCK: usize = 64;

impl Cues<'_> {
    fn get(&self, i: usize) -> BallState {
        let [x, y] = self.velocity.map(|of| of[i]);
        BallState { velocity: Vec3::new(x, y, 0.0), spin: Vec3::from(self.spin.map(|of| of[i])) }
    }

    /// How many, if all slices agree.
    fn count(&self) -> Result<usize, Lengths> {
        let expected = self.velocity[0].len();
        let lengths = [
            ("velocity y", self.velocity[1].len()),
            ("omega_x", self.spin[0].len()),
            ("omega_y", self.spin[1].len()),
            ("omega_z", self.spin[2].len()),
        ];
        same(expected, &lengths)
    }
}

fn same(expected: usize, lengths: &[(&'static str, usize)]) -> Result<usize, Lengths> {
    match lengths.iter().find(|(_, found)| *found != expected) {
        Some(&(name, found)) => Err(Lengths { name, found, expected }),
        None => Ok(expected),
    }
}

impl Outcomes<'_> {
    fn check(&self, expected: usize) -> Result<(), Lengths> {
        same(expected, &[("status", self.status.len()), ("impulse", self.impulse.len())])?;
        for (name, of) in [
            ("cue velocity", &self.cue_velocity),
            ("cue spin", &self.cue_spin),
            ("object velocity", &self.object_velocity),
            ("object spin", &self.object_spin),
        ] {
            same(expected, &[0, 1, 2].map(|axis| (name, of[axis].len())))?;
        }
        Ok(())
    }

    #[inline]
    fn set(&mut self, i: usize, outcome: &Outcome) {
        self.status[i] = Ok(outcome.regime);
        self.impulse[i] = outcome.impulse;
        for axis in 0..3 {
            self.cue_velocity[axis][i] = outcome.cue.velocity[axis];
            self.cue_spin[axis][i] = outcome.cue.spin[axis];
            self.object_velocity[axis][i] = outcome.object.velocity[axis];
            self.object_spin[axis][i] = outcome.object.spin[axis];
        }
    }

    #[cold]
    fn refuse(&mut self, i: usize, why: NotACollision) {
        self.status[i] = Err(why);
        self.impulse[i] = f64::NAN;
        for of in
            [&mut self.cue_velocity, &mut self.cue_spin, &mut self.object_velocity, &mut self.object_spin]
        {
            for slice in of {
                slice[i] = f64::NAN;
            }
        }
    }
}

impl Model {
    /// As [`Model::collide`] for each of the shots. Allocates nothing.
    ///
    /// # Errors
    /// Slices of unlike lengths. What is no collision stands in `outcomes.status`.
    pub fn collide_batch(
        &self,
        cues: &Cues,
        coefficients: &Coefficients,
        outcomes: &mut Outcomes,
    ) -> Result<(), Lengths> {
        let count = cues.count()?;
        outcomes.check(count)?;
        self.each(cues, coefficients, outcomes, count, |i, cue, contact, outcomes| {
            let (impulse, regime) = match self.fidelity {
                Fidelity::Elastic => elastic::impulse(contact),
                Fidelity::Inelastic => inelastic::impulse(contact),
                Fidelity::Linear => linear::impulse(contact),
                Fidelity::Full => kim::impulse(contact),
                Fidelity::Ode | Fidelity::Contact => {
                    match self.collide(cue, coefficients) {
                        Ok(outcome) => outcomes.set(i, &outcome),
                        Err(why) => outcomes.refuse(i, why),
                    }
                    return;
                }
            };
            outcomes.set(i, &self.outcome(cue, contact, &impulse, regime));
        });
        Ok(())
    }

    /// As [`Model::collide_with_jacobian`] for each of the shots. A shot that is none leaves its Jacobian as it
    /// was.
    ///
    /// # Errors
    /// As [`Model::collide_batch`].
    pub fn collide_batch_with_jacobian(
        &self,
        cues: &Cues,
        coefficients: &Coefficients,
        outcomes: &mut Outcomes,
        jacobians: &mut [Jacobian],
    ) -> Result<(), Lengths> {
        let count = cues.count()?;
        outcomes.check(count)?;
        same(count, &[("jacobians", jacobians.len())])?;
        self.each(cues, coefficients, outcomes, count, |i, cue, contact, outcomes| {
            match self.with_jacobian(cue, coefficients, contact) {
                Ok((outcome, jacobian)) => {
                    outcomes.set(i, &outcome);
                    jacobians[i] = jacobian;
                }
                Err(why) => outcomes.refuse(i, why),
            }
        });
        Ok(())
    }

    /// Block by block, first the shots that the cloth takes part in, then those that it does not: each branch
    /// of the solution is then taken many times on end.
    #[inline]
    fn each(
        &self,
        cues: &Cues,
        coefficients: &Coefficients,
        outcomes: &mut Outcomes,
        count: usize,
        mut solve: impl FnMut(usize, &BallState, &Contact, &mut Outcomes),
    ) {
        let shared = match self.checked(coefficients) {
            Ok(shared) => shared,
            Err(why) => {
                (0..count).for_each(|i| outcomes.refuse(i, why));
                return;
            }
        };
        for first in (0..count).step_by(BLOCK) {
            let block = first..count.min(first + BLOCK);
            for topspin in [true, false] {
                for i in block.clone().filter(|i| (cues.spin[1][*i] > 0.0) == topspin) {
                    let cue = cues.get(i);
                    match self.contact_of(&cue, &shared) {
                        Ok(contact) => solve(i, &cue, &contact, outcomes),
                        Err(why) => outcomes.refuse(i, why),
                    }
                }
            }
        }
    }
}
