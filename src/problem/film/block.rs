//! The frames of the balls of some shots as a block.

use std::sync::Arc;

use rayon::prelude::*;

use super::frames::{ShotFrames, World};
use super::impact::{Contact, Correction};
use super::motion::{cue_before, own_inputs};
use super::spins::ShotSpin;
use crate::problem::sums::{Contribution, Spread};
use crate::problem::unknowns::{Own, Shared};

/// Noise of the first descents, m: lines through the frames next to an impact miss the balls by as
/// much.
const COARSE_SD: f64 = 1e-3;

/// Frames of balls.
#[derive(Clone)]
pub(crate) struct FilmBlock {
    pub shots: Arc<Vec<ShotFrames>>,
    /// The spin of each shot.
    pub spins: Vec<ShotSpin>,
    /// Of topspin and side spin from shot to shot.
    pub spreads: [Spread; 2],
    pub world: World,
    /// Whether the noise of every frame is stated.
    pub states_noise: bool,
    /// What a finer model of the impact adds to the outcome of each shot.
    pub corrections: Vec<Correction>,
}

impl FilmBlock {
    /// Returns the sums of shot `i`, with what is known of its spin.
    pub fn contribute(&self, i: usize, own: &Own, shared: &Shared) -> Contribution {
        self.contribute_as(i, &self.spins[i], own, shared)
    }

    /// Returns the sums of shot `i` if its spin is `spin`.
    pub fn contribute_as(&self, i: usize, spin: &ShotSpin, own: &Own, shared: &Shared) -> Contribution {
        let mut sums = self.shots[i].contribute(own, shared, &spin.stated, self.world(i));
        spin.constrain(own, shared, &self.spreads, &mut sums);
        sums
    }

    /// Raises the noise to what lines through the frames next to an impact miss the balls by.
    pub fn coarsen(&mut self) {
        for noise in &mut self.world.noise {
            noise.sd = noise.sd.max(COARSE_SD);
        }
    }

    /// Returns the film with all balls of unknown spin sliding, if there are any.
    pub fn all_sliding(&self) -> Option<Self> {
        let mut sliding = self.clone();
        let mut count = 0;
        for spin in sliding.spins.iter_mut().filter(|spin| spin.is_unknown()) {
            *spin = ShotSpin::unknown_sliding();
            count += 1;
        }
        (count > 0).then_some(sliding)
    }

    /// Returns the collision model, and what a finer one adds to the outcome of shot `i`.
    pub fn contact(&self, i: usize) -> (&Contact, &Correction) {
        (&self.world.contact, &self.corrections[i])
    }

    /// Returns what the shots have in common, and what a finer model adds to the outcome of shot `i`.
    pub fn world(&self, i: usize) -> (&World, &Correction) {
        (&self.world, &self.corrections[i])
    }

    /// Computes what the finer model of the impact adds to the outcome of each shot; nothing where it
    /// describes no collision.
    pub fn correct(&mut self, own: &[Own], shared: &Shared) {
        let contact = self.world.contact;
        let of_shot = |(own, spin): (&Own, &ShotSpin)| {
            let cue = cue_before(&spin.stated, shared, &own_inputs(own), &contact.object());
            contact.correct(&cue, shared).unwrap_or_else(|_| Correction::zeros())
        };
        self.corrections = own.par_iter().zip(&self.spins).map(of_shot).collect();
    }

    /// Keeps the shots for which `keep` is true.
    pub fn retain(&mut self, keep: &[bool]) {
        let mut of_shots = keep.iter();
        let mut of_spins = keep.iter();
        let mut of_corrections = keep.iter();
        Arc::make_mut(&mut self.shots).retain(|_| of_shots.next().copied().unwrap_or(true));
        self.spins.retain(|_| of_spins.next().copied().unwrap_or(true));
        self.corrections.retain(|_| of_corrections.next().copied().unwrap_or(true));
    }
}
