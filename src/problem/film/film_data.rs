//! From the tracks of a data set to the block of its frames: cleaned, in metres from the middle
//! of the impacts, with first guesses.

use std::sync::Arc;

use rayon::prelude::*;

use super::block::FilmBlock;
use super::camera::Point;
use super::cleaning::Cleaned;
use super::frames::{MeasuredSpin, ShotFrames, World};
use super::impact::{Contact, Correction};
use super::own::{self, OWN};
use super::priors::list_unknowns;
use super::reading::Reading;
use super::spins::{FIRST_SPREADS, LEAST_SPREAD, SIDE_SPREAD, ShotSpin};
use crate::extraction::{FirstGuess, Rotation, Rotations, Unusable, from_paths};
use crate::film::frame_noise;
use crate::measurement::dataset::Dataset;
use crate::measurement::loss::Loss;
use crate::measurement::parameter::Settings;
use crate::measurement::spin::Spin;
use crate::measurement::track::TrackShot;
use crate::numerics::median;
use crate::physics::collision::{Fidelity, Model};
use crate::problem::findings::Finding;
use crate::problem::loss::ShotLoss;
use crate::problem::sums::{Noise, Spread};
use crate::problem::unknowns::{Id, Own, Unknown};

/// Ratio of the distance of the centres at the impacts to 2R, less 1, beyond which lengths are in
/// another unit than stated.
const OTHER_UNIT: f64 = 0.1;

/// Smallest noise, m: keeps exact synthetic tracks finite.
const LEAST_NOISE: f64 = 1e-7;

/// How a film is modelled and fitted.
#[derive(Clone, Copy, Debug)]
pub struct Modelling {
    /// The collision model.
    pub model: Model,
    /// Settings of the contact's parameters.
    pub settings: Settings,
    /// Whether effects beyond the model are adopted where the frames call for them.
    pub is_auto: bool,
    /// How outlying shots count.
    pub loss: Loss,
}

impl Modelling {
    /// Returns what a data set asks for, with effects adopted as they are called for.
    #[must_use]
    pub fn of(dataset: &Dataset) -> Self {
        let settings = dataset.settings_of_balls();
        let model = dataset.model(Fidelity::Full);
        Self { model, settings, is_auto: true, loss: dataset.loss }
    }
}

/// A film as a block, with its shared unknowns, first guesses, the names of its shots and what was
/// found on the way.
pub(crate) struct Film {
    pub block: FilmBlock,
    pub unknowns: Vec<Unknown>,
    /// First guesses.
    pub own: Vec<Own>,
    /// Names of the shots of the block.
    pub names: Vec<String>,
    /// Names and reasons of the others.
    pub left_out: Vec<(String, String)>,
    pub findings: Vec<Finding>,
    /// Metres in a unit of length of the film.
    pub unit: f64,
    /// Middle of the impacts in the film, in its unit.
    pub middle: Point,
}

/// A shot that can be fitted.
struct Guessed {
    shot: TrackShot,
    guess: FirstGuess,
}

impl Guessed {
    /// Takes the spin before the impact from the markers of the cue ball; returns those after it. The
    /// radius is in the unit of the film.
    fn read_markers(&mut self, radius: f64) -> Vec<MeasuredSpin> {
        if self.shot.markers.is_empty() {
            return Vec::new();
        }
        let noise = self.shot.position_sd.unwrap_or_else(|| frame_noise::noise(&self.shot));
        let found = Rotations::of(&self.shot, self.guess.time, radius, noise);
        if let Some(before) = found.cue_before {
            let sd = [0, 1, 2].map(|axis| Some(before.covariance[(axis, axis)].sqrt()));
            self.shot.spin = Spin::Measured { spin: before.spin, sd };
        }
        let after = |(ball, rotation): (usize, Option<Rotation>)| {
            let Rotation { spin, covariance, .. } = rotation?;
            Some(MeasuredSpin { ball, spin: spin.z, sd: covariance[(2, 2)].sqrt() })
        };
        [found.cue_after, found.object_after].into_iter().enumerate().filter_map(after).collect()
    }
}

/// Why a film cannot be fitted.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum FilmError {
    /// The data set has no films of these bodies.
    #[error("the data set has no such films")]
    NoFilm,
    /// No shot shows an impact; with the name and the reason of each.
    #[error("none of {} shots shows an impact; of the first: {}", .0.len(), .0.first().map_or("", |(_, why)| why))]
    NoImpact(Vec<(String, String)>),
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
    pub fn new(dataset: &Dataset, modelling: &Modelling) -> Result<Self, FilmError> {
        let tracks = dataset.tracks.as_ref().filter(|tracks| tracks.discs.is_none());
        let tracks = tracks.filter(|tracks| !tracks.shots.is_empty()).ok_or(FilmError::NoFilm)?;
        let model = dataset.model(Fidelity::Full);
        let ball = model.ball;
        let Cleaned { shots, rho, mut findings, mut left_out } = Cleaned::new(tracks, &ball);
        let guess = |shot: TrackShot| match from_paths(&shot, &ball, frame_noise::noise(&shot)) {
            Ok(guess) => Ok(Guessed { shot, guess }),
            Err(why) => Err((shot.name, why)),
        };
        let guesses: Vec<Result<Guessed, (String, Unusable)>> = shots.into_par_iter().map(guess).collect();
        let moves = |guess: &Result<_, (String, _)>| matches!(guess, Err((_, Unusable::ObjectMoving { .. })));
        let reasons = Reasons {
            has_scale: !tracks.from_balls || guesses.iter().any(Result::is_ok),
            interchanged: if guesses.iter().all(moves) { guesses.len() } else { 0 },
        };
        let mut guessed = Vec::with_capacity(guesses.len());
        for guess in guesses {
            match guess {
                Ok(guess) => guessed.push(guess),
                Err((name, why)) => left_out.push((name, reasons.in_words(&why))),
            }
        }
        if guessed.is_empty() {
            return Err(FilmError::NoImpact(left_out));
        }
        let distance = ball.contact_distance(&model.object_ball());
        let ratio = distance / median(guessed.iter().map(|g| g.guess.distance).collect());
        let is_other = (ratio - 1.0).abs() > OTHER_UNIT;
        let unit = if tracks.from_balls || is_other { ratio } else { 1.0 };
        if unit != 1.0 {
            findings.push(Finding::OtherUnit { factor: unit, stated: !tracks.from_balls });
        }
        let middle = guessed.iter().map(contact_middle).sum::<Point>() / guessed.len() as f64;
        let states_noise = guessed.iter().all(|g| g.shot.states_noise());
        let frames_of = |Guessed { shot, .. }: &Guessed| {
            let reading = Reading { middle, unit, states_noise, may_be_held: !shot.states_noise() };
            let [of_cue, of_object] = shot.resolution;
            let tracks =
                [reading.frames(shot, &shot.cue, of_cue), reading.frames(shot, &shot.object, of_object)];
            ShotFrames { tracks, fps: shot.fps, spins: Vec::new() }
        };
        let mut frames: Vec<ShotFrames> = guessed.iter().map(frames_of).collect();
        for (frames, guessed) in frames.iter_mut().zip(&mut guessed) {
            frames.spins = guessed.read_markers(ball.radius / unit);
        }
        let own = guessed.iter().map(|g| own_of(&g.guess, middle, unit)).collect();
        let spins: Vec<ShotSpin> = guessed.iter().map(|g| spin_of(g, ball.radius, unit)).collect();
        let sd = unit * median(guessed.iter().map(|g| frame_noise::noise(&g.shot)).collect());
        let noise = Noise { sd: if states_noise { 1.0 } else { sd.max(LEAST_NOISE) }, rho };
        let mut unknowns = list_unknowns(dataset, &modelling.settings, tracks, &spins);
        if unit != 1.0 {
            unknowns[Id::Scale as usize].prior = None;
        }
        let contact = Contact::new(&modelling.model, &unknowns);
        let world = World { contact, noise: [noise; 2] };
        let mut spreads = FIRST_SPREADS.map(|first| Spread::first(first, LEAST_SPREAD));
        if dataset.side_sd > 0.0 {
            spreads[SIDE_SPREAD] = Spread::first(dataset.side_sd, LEAST_SPREAD);
        }
        let names = guessed.iter().map(|g| g.shot.name.clone()).collect();
        let block = FilmBlock {
            shots: Arc::new(frames),
            corrections: vec![Correction::zeros(); spins.len()],
            spins,
            spreads,
            world,
            states_noise,
            loss: (modelling.loss != Loss::Squares).then(|| ShotLoss::new(modelling.loss, Id::OFFSETS.len())),
        };
        Ok(Self { block, unknowns, own, names, left_out, findings, unit, middle })
    }
}

/// Returns the middle between the centres of both balls at the impact, in the unit of the film.
fn contact_middle(guessed: &Guessed) -> Point {
    let FirstGuess { object, direction, distance, .. } = guessed.guess;
    let (sin, cos) = direction.sin_cos();
    Point::from(object) - Point::new(cos, sin) * (0.5 * distance)
}

/// How to say why shots cannot be used.
struct Reasons {
    /// Metres mean something.
    has_scale: bool,
    /// In so many shots, all that there are, the object ball moves first; else 0.
    interchanged: usize,
}

impl Reasons {
    fn in_words(&self, why: &Unusable) -> String {
        let mut words = match why {
            Unusable::ObjectMoving { .. } if !self.has_scale => {
                "the object ball was moving before the impact".to_owned()
            }
            why => why.to_string(),
        };
        if self.interchanged > 0 {
            words.push_str(if self.interchanged > 1 { ", as in all shots" } else { "" });
            words.push_str(": are cue and object interchanged ([tracks] cue, object)?");
        }
        words
    }
}

/// Returns the own unknowns of a first guess, in metres from the middle.
fn own_of(guess: &FirstGuess, middle: Point, unit: f64) -> Own {
    let mut values = Own::zeros(OWN);
    values[own::TIME] = guess.time;
    values[own::X] = (guess.object[0] - middle.x) * unit;
    values[own::Y] = (guess.object[1] - middle.y) * unit;
    values[own::DIRECTION] = guess.direction;
    values[own::ALONG] = guess.before[0] * unit;
    values[own::ACROSS] = guess.before[1] * unit;
    values
}

/// Returns what is stated of the spin of a shot.
fn spin_of(guessed: &Guessed, radius: f64, unit: f64) -> ShotSpin {
    let (sin, cos) = guessed.guess.direction.sin_cos();
    let [along, across] = guessed.guess.before.map(|speed| speed * unit);
    let velocity = Point::new(along * cos - across * sin, along * sin + across * cos);
    ShotSpin::stated(guessed.shot.spin, velocity, radius)
}
