//! From the tracks of a data set to the block of its frames: cleaned, in metres from the middle
//! of the impacts, with first guesses.

use std::sync::Arc;

use rayon::prelude::*;

use super::block::FilmBlock;
use super::camera::Point;
use super::frames::{Frame, ShotFrames, World};
use super::impact::Contact;
use super::own::{self, OWN};
use super::priors::list_unknowns;
use super::spins::{FIRST_SPREADS, SIDE_SPREAD, ShotSpin};
use crate::extraction::{Unusable, from_paths, leave_out_before_cushion, noise_correlation};
use crate::film::{drops, frame_noise, grid};
use crate::measurement::dataset::{Dataset, Tracks};
use crate::measurement::track::{Sample, TrackShot};
use crate::numerics::median;
use crate::physics::collision::Fidelity;
use crate::problem::findings::Finding;
use crate::problem::sums::{Noise, Spread};
use crate::problem::unknowns::{Id, Own, Unknown};
use crate::trajectory::scene::Scene;
use crate::trajectory::unknowns::{Unknowns, unknown};

/// Ratio of the distance of the centres at the impacts to 2R, less 1, beyond which lengths are in
/// another unit than stated.
const OTHER_UNIT: f64 = 0.1;

/// Smallest noise, m: keeps exact synthetic tracks finite.
const LEAST_NOISE: f64 = 1e-7;

/// A film as a block, with its shared unknowns, first guesses, the names of its shots and what was
/// found on the way.
pub(crate) struct Film {
    pub block: FilmBlock,
    pub unknowns: Vec<Unknown>,
    /// First guesses.
    pub own: Vec<Own>,
    /// Names of the shots of the block.
    pub names: Vec<String>,
    pub left_out: Vec<(String, Unusable)>,
    pub findings: Vec<Finding>,
}

/// A shot that can be fitted.
struct Guessed {
    shot: TrackShot,
    guess: Unknowns,
    distance: f64,
}

/// Why a film cannot be fitted.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum FilmError {
    /// The data set has no films of balls.
    #[error("the data set has no films of balls")]
    NoFilm,
    /// No shot shows an impact; with the reason of the first.
    #[error("none of {shots} shots shows an impact; of the first: {first}")]
    NoImpact {
        /// Number of shots.
        shots: usize,
        /// Reason of the first.
        first: String,
    },
    /// No start of the search describes a collision.
    #[error("no values of the unknowns describe a collision that the frames show")]
    NoStart,
    /// The frames leave an unknown undetermined.
    #[error("the frames do not determine the unknowns")]
    Undetermined,
}

impl Film {
    /// Returns the block of a data set's films.
    ///
    /// # Errors
    /// See [`FilmError`].
    pub fn new(dataset: &Dataset) -> Result<Self, FilmError> {
        let tracks = dataset.tracks.as_ref().filter(|tracks| tracks.discs.is_none());
        let tracks = tracks.filter(|tracks| !tracks.shots.is_empty()).ok_or(FilmError::NoFilm)?;
        let scene = Scene::of(&dataset.model(Fidelity::Full));
        let (shots, rho) = cleaned(tracks, &scene);
        let guess = |shot: TrackShot| match from_paths(&shot, &scene, frame_noise::noise(&shot)) {
            Ok((guess, distance)) => Ok(Guessed { shot, guess, distance }),
            Err(why) => Err((shot.name, why)),
        };
        let guesses: Vec<Result<Guessed, (String, Unusable)>> = shots.into_par_iter().map(guess).collect();
        let mut guessed = Vec::with_capacity(guesses.len());
        let mut left_out = Vec::new();
        for guess in guesses {
            match guess {
                Ok(guess) => guessed.push(guess),
                Err(why) => left_out.push(why),
            }
        }
        if guessed.is_empty() {
            let first = left_out.first().map_or_else(String::new, |(_, why)| why.to_string());
            return Err(FilmError::NoImpact { shots: left_out.len(), first });
        }
        let ratio = scene.contact_distance() / median(guessed.iter().map(|g| g.distance).collect());
        let is_other = (ratio - 1.0).abs() > OTHER_UNIT;
        let unit = if tracks.from_balls || is_other { ratio } else { 1.0 };
        let mut findings = Vec::new();
        if is_other && !tracks.from_balls {
            findings.push(Finding::OtherUnit { factor: ratio });
        }
        Ok(Self::of_guesses(dataset, tracks, &scene, guessed, (unit, rho), left_out, findings))
    }

    fn of_guesses(
        dataset: &Dataset,
        tracks: &Tracks,
        scene: &Scene,
        guessed: Vec<Guessed>,
        (unit, rho): (f64, f64),
        left_out: Vec<(String, Unusable)>,
        findings: Vec<Finding>,
    ) -> Self {
        let contact_middle = |g: &Guessed| {
            let (sin, cos) = g.guess[unknown::DIRECTION].sin_cos();
            let object = Point::new(g.guess[unknown::OBJECT], g.guess[unknown::OBJECT + 1]);
            object - Point::new(cos, sin) * (0.5 * g.distance)
        };
        let middle = guessed.iter().map(contact_middle).sum::<Point>() / guessed.len() as f64;
        let frames = guessed.iter().map(|g| frames_of(&g.shot, middle, unit)).collect::<Vec<_>>();
        let own = guessed.iter().map(|g| own_of(&g.guess, middle, unit)).collect();
        let spins: Vec<ShotSpin> = guessed.iter().map(|g| spin_of(g, scene.ball.radius, unit)).collect();
        let sd = unit * median(guessed.iter().map(|g| frame_noise::noise(&g.shot)).collect());
        let noise = Noise { sd: sd.max(LEAST_NOISE), rho };
        let mut unknowns = list_unknowns(dataset, tracks, &spins);
        if unit != 1.0 {
            unknowns[Id::Scale as usize].prior = None;
        }
        let world = World { contact: Contact::new(scene.object, &unknowns), noise: [noise; 2] };
        let mut spreads = FIRST_SPREADS.map(Spread::first);
        if dataset.side_sd > 0.0 {
            spreads[SIDE_SPREAD] = Spread::first(dataset.side_sd);
        }
        let names = guessed.iter().map(|g| g.shot.name.clone()).collect();
        let block = FilmBlock { shots: Arc::new(frames), spins, spreads, world };
        Self { block, unknowns, own, names, left_out, findings }
    }
}

/// Returns the shots with dropped frames made up for and without frames before a cushion, and the
/// correlation of their noise.
fn cleaned(tracks: &Tracks, scene: &Scene) -> (Vec<TrackShot>, f64) {
    let mut shots = tracks.shots.clone();
    shots.par_iter_mut().for_each(|shot| {
        drops::repair(shot);
        leave_out_before_cushion(shot, scene);
    });
    let correlation = noise_correlation(&shots, scene).filter(|found| found.adopted);
    let rho = correlation.map_or(0.0, |found| found.value);
    for shot in &mut shots {
        shot.correlation = rho;
    }
    (shots, rho)
}

/// Returns the frames of a shot in metres from the middle.
fn frames_of(shot: &TrackShot, middle: Point, unit: f64) -> ShotFrames {
    let noise = frame_noise::noise(shot);
    let may_be_held = !shot.states_noise();
    let of = |samples: &[Sample], step: f64| {
        let repeats = grid::repeats(samples, noise.max(grid::rounding(step)), step, may_be_held);
        let frame = |(sample, repeats): (&Sample, [f64; 2])| {
            let seen = (Point::new(sample.x, sample.y) - middle) * unit;
            let weight = |axis: usize| {
                let sd = sample.sd.map_or(1.0, |sd| sd[axis] / noise);
                (repeats[axis].sqrt() * if sd > 0.0 { sd } else { 1.0 }).recip()
            };
            Frame {
                time: sample.t,
                seen,
                weight: Point::new(weight(0), weight(1)),
                used: seen.x.is_finite() && seen.y.is_finite(),
            }
        };
        samples.iter().zip(repeats).map(frame).collect()
    };
    let tracks = [of(&shot.cue, shot.resolution[0]), of(&shot.object, shot.resolution[1])];
    ShotFrames { tracks, fps: shot.fps }
}

/// Returns the own unknowns of a first guess, in metres from the middle.
fn own_of(guess: &Unknowns, middle: Point, unit: f64) -> Own {
    let mut values = Own::zeros(OWN);
    values[own::TIME] = guess[unknown::TIME];
    values[own::X] = (guess[unknown::OBJECT] - middle.x) * unit;
    values[own::Y] = (guess[unknown::OBJECT + 1] - middle.y) * unit;
    values[own::DIRECTION] = guess[unknown::DIRECTION];
    values[own::ALONG] = guess[unknown::BEFORE] * unit;
    values[own::ACROSS] = guess[unknown::BEFORE + 1] * unit;
    values
}

/// Returns what is stated of the spin of a shot.
fn spin_of(guessed: &Guessed, radius: f64, unit: f64) -> ShotSpin {
    let guess = &guessed.guess;
    let (sin, cos) = guess[unknown::DIRECTION].sin_cos();
    let [along, across] = [guess[unknown::BEFORE] * unit, guess[unknown::BEFORE + 1] * unit];
    let velocity = Point::new(along * cos - across * sin, along * sin + across * cos);
    ShotSpin::stated(guessed.shot.spin, velocity, radius)
}
