//! The frames of the balls of some shots as a block.

use std::sync::Arc;

use rayon::prelude::*;

use super::camera::Point;
use super::frames::{ShotFrames, World};
use super::impact::{Contact, Correction};
use super::motion::{cue_before, own_inputs};
use super::own::OWN;
use super::spins::ShotSpin;
use crate::problem::loss::ShotLoss;
use crate::problem::sums::{Contribution, Spread, settle};
use crate::problem::unknowns::{Id, Own, Shared};

/// Noise of the first descents, m: lines through the frames next to an impact miss the balls by as
/// much.
const COARSE_SD: f64 = 1e-3;

/// Rounds in which a distance is found from the weighted one.
const DISTANCE_STEPS: usize = 60;

/// Returns how far outcome offsets are from 0 in their standard deviations; `None` if the frames do
/// not tell them.
fn distance(sums: &Contribution) -> Option<f64> {
    let (information, gradient) = sums.reduced(&Id::OFFSETS)?;
    let square = gradient.dot(&information.cholesky()?.solve(&gradient));
    square.is_finite().then(|| square.max(0.0).sqrt())
}

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
    /// How outlying shots count; `None`: by least squares.
    pub loss: Option<ShotLoss>,
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
        if let Some((loss, distance)) = self.loss.zip(distance(&sums)) {
            sums.products *= loss.weight(distance);
            sums.cost += loss.cost(distance) - distance * distance;
        }
        sums
    }

    /// Returns where χ² of shot `i` is least over its own unknowns, if its spin is `spin`, and over some
    /// shared ones, which it sets, and the sums there.
    pub fn settle(
        &self,
        i: usize,
        spin: &ShotSpin,
        own: Own,
        (shared, ids): (&mut Shared, &[Id]),
        stop: (usize, f64),
    ) -> (Own, Contribution) {
        let with = |x: &Own| {
            let mut all = shared.clone();
            for (id, value) in ids.iter().zip(x.iter().skip(OWN)) {
                all[*id] = *value;
            }
            all
        };
        let start = own.into_iter().copied().chain(ids.iter().map(|id| shared[*id]));
        let start = Own::from_iterator(OWN + ids.len(), start);
        let bounded = |x: Own| Some(spin.bounded(x, shared));
        let contribute = |x: &Own| self.contribute_as(i, spin, x, &with(x));
        let (x, sums) = settle(spin.bounded(start, shared), ids, stop, contribute, bounded);
        *shared = with(&x);
        (x.rows(0, OWN).into_owned(), sums)
    }

    /// Returns the distance of each shot from the law of the impact in standard deviations of its
    /// outcome, at sums by a robust loss.
    pub fn distances(&self, shots: &[Contribution]) -> Vec<f64> {
        let Some(loss) = self.loss else { return Vec::new() };
        // the weighted sums have the weighted distance, which grows with the distance
        let of_shot = |sums: &Contribution| {
            let weighted = distance(sums).unwrap_or(f64::INFINITY);
            let mut found = weighted;
            for _ in 0..DISTANCE_STEPS {
                found = weighted / loss.weight(found).sqrt();
            }
            found
        };
        shots.iter().map(of_shot).collect()
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

    /// Takes shots by their indices, each as often as it stands there.
    pub fn take(&mut self, indices: &[usize]) {
        self.shots = Arc::new(indices.iter().map(|i| self.shots[*i].clone()).collect());
        self.spins = indices.iter().map(|i| self.spins[*i]).collect();
        self.corrections = indices.iter().map(|i| self.corrections[*i].clone()).collect();
    }

    /// Counts the picture in another unit and from another middle: a place becomes `factor`·place + `by`.
    pub fn move_picture(&mut self, factor: f64, by: Point) {
        for shot in Arc::make_mut(&mut self.shots) {
            for frame in shot.tracks.iter_mut().flatten() {
                frame.seen = frame.seen * factor + by;
            }
        }
        for noise in &mut self.world.noise {
            noise.sd *= factor;
        }
    }
}
