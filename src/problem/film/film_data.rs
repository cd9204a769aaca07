//! From the tracks of a data set to the block of its frames: cleaned, in metres from the middle
//! of the impacts, with first guesses.

use std::sync::Arc;

use rayon::prelude::*;

use super::block::{FilmBlock, MeasuredSpin, ShotFrames, World};
use super::camera::Point;
use super::cleaning::Cleaned;
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
use crate::physics::ball::Ball;
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
pub(crate) struct Modelling {
    /// The collision model.
    pub(crate) model: Model,
    /// Settings of the contact's parameters.
    pub(crate) settings: Settings,
    /// Whether effects beyond the model are adopted if the frames show them.
    pub(crate) is_auto: bool,
    /// How outlying shots count.
    pub(crate) loss: Loss,
}

impl Modelling {
    /// Returns the modelling that a data set states, effects adopted if the frames show them.
    #[must_use]
    pub fn of(dataset: &Dataset) -> Self {
        let settings = dataset.settings_of_balls();
        let model = dataset.model(Fidelity::Full);
        Self { model, settings, is_auto: true, loss: dataset.loss }
    }
}

/// A film of balls or of discs as a block, with its shared unknowns, first guesses, the names of its shots
/// and what was found on the way.
pub(crate) struct Film<B> {
    pub(crate) block: B,
    pub(crate) unknowns: Vec<Unknown>,
    /// First guesses.
    pub(crate) own: Vec<Own>,
    /// Names of the shots of the block.
    pub(crate) names: Vec<String>,
    /// Names and reasons of the others.
    pub(crate) left_out: Vec<(String, String)>,
    pub(crate) findings: Vec<Finding>,
    /// Metres in a unit of length of the film.
    pub(crate) unit: f64,
    /// Middle of the impacts in the film, in its unit.
    pub(crate) middle: Point,
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

impl Film<FilmBlock> {
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
        let shots = guess_all(shots, &ball, tracks.from_balls, &mut left_out);
        if shots.is_empty() {
            return Err(FilmError::NoImpact(left_out));
        }
        let distance = ball.contact_distance(&model.object_ball());
        let ratio = distance / median(shots.iter().map(|shot| shot.guess.distance).collect());
        let is_other = (ratio - 1.0).abs() > OTHER_UNIT;
        let unit = if tracks.from_balls || is_other { ratio } else { 1.0 };
        if unit != 1.0 {
            findings.push(Finding::OtherUnit { factor: unit, stated: !tracks.from_balls });
        }
        let middle = shots.iter().map(Guessed::contact_middle).sum::<Point>() / shots.len() as f64;
        let states_noise = shots.iter().all(|shot| shot.track.states_noise());
        let sd = unit * median(shots.iter().map(|shot| frame_noise::noise(&shot.track)).collect());
        let noise = Noise { sd: if states_noise { 1.0 } else { sd.max(LEAST_NOISE) }, rho };
        let own = shots.iter().map(|shot| shot.own(middle, unit)).collect();
        let names = shots.iter().map(|shot| shot.track.name.clone()).collect();
        let mut frames = Vec::with_capacity(shots.len());
        let mut spins = Vec::with_capacity(shots.len());
        for shot in shots {
            let (of_shot, spin) = shot.read(middle, unit, states_noise, ball.radius);
            frames.push(of_shot);
            spins.push(spin);
        }
        let mut unknowns = list_unknowns(&modelling.settings, tracks, &spins);
        if unit != 1.0 {
            unknowns[Id::Scale as usize].prior = None;
        }
        let contact = Contact::new(&modelling.model, &unknowns);
        let mut spreads = FIRST_SPREADS.map(|first| Spread::first(first, LEAST_SPREAD));
        if dataset.side_sd > 0.0 {
            spreads[SIDE_SPREAD] = Spread::first(dataset.side_sd, LEAST_SPREAD);
        }
        let block = FilmBlock {
            shots: Arc::new(frames),
            corrections: vec![Correction::zeros(); spins.len()],
            spins,
            spreads,
            world: World { contact, noise: [noise; 2] },
            states_noise,
            loss: (modelling.loss != Loss::Squares).then(|| ShotLoss::new(modelling.loss, Id::OFFSETS.len())),
        };
        Ok(Self { block, unknowns, own, names, left_out, findings, unit, middle })
    }
}

/// A shot that can be fitted.
struct Guessed {
    track: TrackShot,
    guess: FirstGuess,
}

/// Returns the shots that show an impact, with first guesses; adds names and reasons of the others to
/// `left_out`.
fn guess_all(
    shots: Vec<TrackShot>,
    ball: &Ball,
    from_balls: bool,
    left_out: &mut Vec<(String, String)>,
) -> Vec<Guessed> {
    let guess = |shot: &TrackShot| from_paths(shot, ball, frame_noise::noise(shot));
    let guesses: Vec<_> = shots.par_iter().map(guess).collect();
    let (mut guessed, mut refused) = (Vec::new(), Vec::new());
    for (track, guess) in shots.into_iter().zip(guesses) {
        match guess {
            Ok(guess) => guessed.push(Guessed { track, guess }),
            Err(why) => refused.push((track.name, why)),
        }
    }
    let is_moving = |why: &Unusable| matches!(why, Unusable::ObjectMoving { .. });
    // metres mean something
    let has_scale = !from_balls || !guessed.is_empty();
    let are_interchanged = guessed.is_empty() && refused.iter().all(|(_, why)| is_moving(why));
    let suffix = match (are_interchanged, refused.len()) {
        (false, _) => "",
        (true, 1) => ": are cue and object interchanged ([tracks] cue, object)?",
        (true, _) => ", as in all shots: are cue and object interchanged ([tracks] cue, object)?",
    };
    left_out.extend(refused.into_iter().map(|(name, why)| {
        let why = if is_moving(&why) && !has_scale {
            "the object ball was moving before the impact".to_owned()
        } else {
            why.to_string()
        };
        (name, why + suffix)
    }));
    guessed
}

impl Guessed {
    /// Returns the middle between the centres of both balls at the impact, in the unit of the film.
    fn contact_middle(&self) -> Point {
        let FirstGuess { object, direction, distance, .. } = self.guess;
        let (sin, cos) = direction.sin_cos();
        Point::from(object) - Point::new(cos, sin) * (0.5 * distance)
    }

    /// Returns the own unknowns of the first guess, in metres from the middle.
    fn own(&self, middle: Point, unit: f64) -> Own {
        let FirstGuess { time, object, direction, before, .. } = self.guess;
        let mut values = Own::zeros(OWN);
        values[own::TIME] = time;
        values[own::X] = (object[0] - middle.x) * unit;
        values[own::Y] = (object[1] - middle.y) * unit;
        values[own::DIRECTION] = direction;
        values[own::ALONG] = before[0] * unit;
        values[own::ACROSS] = before[1] * unit;
        values
    }

    /// Returns the frames in metres from the middle, and what is stated of the spin, or what markers on the
    /// cue ball show of it. The radius is in metres.
    fn read(mut self, middle: Point, unit: f64, states_noise: bool, radius: f64) -> (ShotFrames, ShotSpin) {
        let track = &self.track;
        let reading = Reading { middle, unit, states_noise, may_be_held: !track.states_noise() };
        let [of_cue, of_object] = track.resolution;
        let tracks =
            [reading.frames(track, &track.cue, of_cue), reading.frames(track, &track.object, of_object)];
        let spins = self.read_markers(radius / unit);
        let (sin, cos) = self.guess.direction.sin_cos();
        let [along, across] = self.guess.before.map(|speed| speed * unit);
        let velocity = Point::new(along * cos - across * sin, along * sin + across * cos);
        let spin = ShotSpin::stated(self.track.spin, velocity, radius);
        (ShotFrames { tracks, fps: self.track.fps, spins }, spin)
    }

    /// Takes the spin before the impact from the markers of the cue ball; returns those after it. The
    /// radius is in the unit of the film.
    fn read_markers(&mut self, radius: f64) -> Vec<MeasuredSpin> {
        if self.track.markers.is_empty() {
            return Vec::new();
        }
        let noise = self.track.position_sd.unwrap_or_else(|| frame_noise::noise(&self.track));
        let shown = Rotations::of(&self.track, self.guess.time, radius, noise);
        if let Some(Rotation { spin, covariance, .. }) = shown.cue_before {
            let sd = [0, 1, 2].map(|axis| Some(covariance[(axis, axis)].sqrt()));
            self.track.spin = Spin::Measured { spin, sd };
        }
        let after = |(ball, rotation): (usize, Option<Rotation>)| {
            let Rotation { spin, covariance, .. } = rotation?;
            Some(MeasuredSpin { ball, spin: spin.z, sd: covariance[(2, 2)].sqrt() })
        };
        [shown.cue_after, shown.object_after].into_iter().enumerate().filter_map(after).collect()
    }
}
