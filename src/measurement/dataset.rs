//! A data set and its shots, as loaded and checked.

use std::collections::BTreeMap;
use std::path::PathBuf;

use super::loss::Loss;
use super::observable::{Axis, Observable};
pub use super::observable::{Measured, Measurement};
use super::parameter::{Parameter, Prior, Setting, Settings};
use super::spin::Spin;
use super::track::TrackShot;
pub use super::track::Tracks;
use crate::physics::ball::{Ball, BallState, Vec3};
use crate::physics::collision::{Fidelity, Model};
use crate::physics::contact_frame::cue_velocity;

/// A data set: measured shots, and how they are to be fitted. A fit refuses what
/// [`Dataset::faults`] finds; a data set that was read from files has no faults.
#[derive(Clone, Debug, Default)]
pub struct Dataset {
    /// The name of the data set, also of its folder below `fits/`.
    pub name: String,
    /// The file that the data set was read from; empty for one that a program made.
    pub path: PathBuf,
    /// The cloth it was measured on; comparisons distinguish data sets by it.
    pub cloth: Option<String>,
    /// Which balls were played; in a comparison the same label has the same ratios of the balls.
    pub balls: Option<String>,
    /// Which camera filmed it; in a comparison the same label is a camera that was not moved.
    pub camera: Option<String>,
    /// Who measured it, how and when.
    pub source: Option<String>,
    /// The cue ball.
    pub ball: Ball,
    /// The object ball; `None` stands for [`ObjectBall::unweighed`], of discs for equal ones.
    pub object: Option<ObjectBall>,
    /// Starting values, bounds and priors of the parameters (`[fit]`).
    pub settings: Settings,
    /// How outlying shots count (`[fit] loss`).
    pub loss: Loss,
    /// The label column whose values are fitted separately (`[fit] by`).
    pub by: Option<String>,
    /// The measured shots; empty for footage whose impacts have not been extracted yet.
    pub shots: Vec<Shot>,
    /// Name and reason of each shot that was left out from the start.
    pub left_out: Vec<(String, String)>,
    /// μ_k of the cloth with which shots were extracted from tracks.
    pub sliding: Option<Measured>,
    /// μ_r of the cloth likewise.
    pub rolling: Option<Measured>,
    /// Standard deviation of the side spin Rω_z/U of stun and natural roll (`[cue_spin] side_sd`).
    pub side_sd: f64,
    /// Assumptions that its dataset.toml does not state, in sentences.
    pub taken: Vec<String>,
    /// The filmed shots of a data set of kind `tracks`.
    pub tracks: Option<Tracks>,
}

impl Dataset {
    /// Returns a data set of shots that a program measured, with the default settings of the fit.
    pub fn new(name: impl Into<String>, ball: Ball, shots: Vec<Shot>) -> Self {
        Self { name: name.into(), ball, shots, ..Self::default() }
    }

    /// Returns a data set of shots that a program filmed and tracked, with the default settings.
    pub fn filmed(name: impl Into<String>, ball: Ball, shots: Vec<TrackShot>) -> Self {
        Self { tracks: Some(Tracks::new(shots)), ..Self::new(name, ball, Vec::new()) }
    }

    /// Returns what was taken for granted, and what was repaired in the files of tracks.
    pub fn notes(&self) -> impl Iterator<Item = &String> {
        self.taken.iter().chain(self.tracks.iter().flat_map(|tracks| &tracks.notes))
    }

    /// Returns the collision model of its balls at a fidelity, with constant friction.
    pub fn model(&self, fidelity: Fidelity) -> Model {
        let e_slope = self.settings.e_falls.then(|| self.settings[Parameter::ESlope].initial);
        let object = self.object_ball().map(|object| object.ball);
        Model { object, e_slope, ..Model::new(fidelity, self.ball) }
    }

    /// Returns the object ball, with what is known of its mass and radius; `None` for discs.
    fn object_ball(&self) -> Option<ObjectBall> {
        (!self.is_of_discs()).then(|| self.object.unwrap_or(ObjectBall::unweighed(self.ball)))
    }

    /// Returns whether discs were filmed, and not balls.
    pub(crate) fn is_of_discs(&self) -> bool {
        self.tracks.as_ref().is_some_and(|tracks| tracks.discs.is_some())
    }

    /// Returns the number of shots that a fit can use, once the impacts of films were found.
    pub fn count_usable(&self) -> usize {
        let discs = self.tracks.as_ref().filter(|tracks| tracks.discs.is_some());
        discs.map_or(self.shots.len(), |tracks| tracks.shots.len())
    }

    /// Returns the settings of its fit, with the ratios of the masses and radii of both balls:
    /// fixed if they are exact, else with a prior.
    pub(crate) fn settings_of_balls(&self) -> Settings {
        let mut settings = self.settings;
        let Some(object) = self.object_ball() else { return settings };
        let Ball { mass, radius, .. } = object.ball;
        let [mass_sd, radius_sd] = object.ratio_sds(self.ball);
        let masses = (Parameter::MassRatio, self.ball.mass / mass, mass_sd);
        for (parameter, mean, sd) in [masses, (Parameter::RadiusRatio, self.ball.radius / radius, radius_sd)]
        {
            let prior = sd.map(|sd| Prior { mean, sd });
            settings[parameter] =
                Setting { initial: mean, fixed: sd.is_none(), prior, ..settings[parameter] };
        }
        settings
    }

    /// Returns the names of the filmed shots, if any, then of the measured shots, in their order.
    pub fn names(&self) -> Vec<&str> {
        let filmed = self.tracks.iter().flat_map(|tracks| &tracks.shots).map(|shot| shot.name.as_str());
        filmed.chain(self.shots.iter().map(|shot| shot.name.as_str())).collect()
    }

    /// Leaves out the shots whose names `wanted` refuses, and states them as left out on request.
    pub fn keep(&mut self, wanted: impl Fn(&str) -> bool) {
        let unwanted: Vec<String> =
            self.names().into_iter().filter(|name| !wanted(name)).map(str::to_owned).collect();
        self.shots.retain(|shot| wanted(&shot.name));
        if let Some(tracks) = &mut self.tracks {
            tracks.shots.retain(|shot| wanted(&shot.name));
        }
        self.left_out.extend(unwanted.into_iter().map(|name| (name, ON_REQUEST.to_owned())));
    }
}

/// The standard deviation of m_cue/m_object of balls that were not weighed, as a fraction: balls of
/// one set differ by 0.5 to 3 %. (Films of 15 natural-roll shots determine the ratio to 0.3 %.)
pub const UNWEIGHED: f64 = 0.02;

/// The standard deviation of a mass that is stated without one, kg: that of a kitchen scale.
pub const WEIGHED_KG: f64 = 5e-4;

/// The object ball.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ObjectBall {
    /// Its radius, mass and moment of inertia.
    pub ball: Ball,
    /// The standard deviations of the cue ball's and of its own mass, kg; 0 if exact, or if both
    /// balls share the error. `None`: the ratio of the masses has the standard deviation
    /// [`UNWEIGHED`].
    pub mass_sd: Option<[f64; 2]>,
    /// The standard deviations of both radii, m, likewise.
    pub radius_sd: [f64; 2],
}

impl ObjectBall {
    /// Returns an object ball whose properties are exact.
    pub fn exact(ball: Ball) -> Self {
        Self { ball, mass_sd: Some([0.0; 2]), radius_sd: [0.0; 2] }
    }

    /// Returns an object ball like a cue ball, of balls that were not weighed.
    pub fn unweighed(cue: Ball) -> Self {
        Self { mass_sd: None, ..Self::exact(cue) }
    }

    /// Returns the standard deviations of m_cue/m_object and of R_cue/R_object; `None` of a ratio
    /// that counts as exact.
    pub fn ratio_sds(&self, cue: Ball) -> [Option<f64>; 2] {
        let mass_sd = self.mass_sd.unwrap_or([UNWEIGHED * cue.mass, 0.0]);
        let pairs = [([cue.mass, self.ball.mass], mass_sd), ([cue.radius, self.ball.radius], self.radius_sd)];
        pairs.map(|([first, second], sd)| {
            let sd = first / second * (sd[0] / first).hypot(sd[1] / second);
            (sd != 0.0).then_some(sd)
        })
    }
}

/// The reason why shots are left out that a user did not want.
pub(crate) const ON_REQUEST: &str = "left out on request";

/// One shot, or the mean of several.
#[derive(Clone, Debug)]
pub struct Shot {
    /// The `shot` column, or without one the number, from 1, among all shots of the data set.
    pub name: String,
    /// The file that it was read from; empty for a shot that a program made.
    pub file: PathBuf,
    /// Line of the file, from 1, comments and header counted.
    pub line: usize,
    /// Columns other than inputs and observables, kept as text.
    pub labels: BTreeMap<String, String>,
    /// The cue ball's motion before the impact.
    pub before: Before,
    /// The cue ball's spin before the impact.
    pub spin: Spin,
    /// The observables measured after the impact, at least one.
    pub after: Vec<Measurement>,
}

impl Shot {
    /// Returns a shot of no file, without labels.
    pub fn new(name: impl Into<String>, before: Before, spin: Spin, after: Vec<Measurement>) -> Self {
        let (file, labels) = (PathBuf::new(), BTreeMap::new());
        Self { name: name.into(), file, line: 0, labels, before, spin, after }
    }

    /// Returns a measured impact, table frame: the line of centres from the cue ball to the object
    /// ball, of any length but 0, which errs by `normal_sd` radians, the cue ball's velocity
    /// before, and its own and the object ball's after, in m/s.
    pub fn impact(
        name: impl Into<String>,
        (normal, normal_sd): ([f64; 2], Option<f64>),
        spin: Spin,
        before: [Measured; 2],
        [cue_after, object_after]: [[Measured; 2]; 2],
    ) -> Self {
        let length = normal[0].hypot(normal[1]);
        let [nx, ny] = normal.map(|component| component / length);
        // a unit vector that turns by σ moves by σ across itself; standard deviations are positive
        let sd = |across: f64| normal_sd.map(|sd| sd * across.abs().max(1e-12));
        let normal = [Measured { value: nx, sd: sd(ny) }, Measured { value: ny, sd: sd(nx) }];
        let plane = [Axis::X, Axis::Y];
        let cue_velocity = plane.map(Observable::CueVelocity).into_iter().zip(cue_after);
        let rows = cue_velocity.chain(plane.map(Observable::ObjectVelocity).into_iter().zip(object_after));
        let after = rows.map(|(observable, measured)| Measurement { observable, measured }).collect();
        Self::new(name, Before::Impact { normal, velocity: before }, spin, after)
    }

    /// Makes the side spin of a shot that is stated as stun or natural roll uncertain: `sd` is that
    /// of Rω_z/U, `radius` the ball's, m. Returns whether the shot's speed, which this takes, is
    /// known.
    pub fn add_side_spin(&mut self, sd: f64, radius: f64) -> bool {
        if !matches!(self.spin, Spin::Stun | Spin::NaturalRoll) {
            return true;
        }
        let velocity = match self.before {
            Before::Impact { velocity: [x, y], .. } => Vec3::new(x.value, y.value, 0.0),
            Before::Angle { cut, speed: Some(speed) } => cue_velocity(speed.value, cut.value),
            Before::Angle { speed: None, .. } => return false,
        };
        let roll = BallState::natural_roll(velocity, radius).spin;
        let spin = if self.spin == Spin::NaturalRoll { roll } else { Vec3::zeros() };
        self.spin = Spin::Measured { spin, sd: [None, None, Some(sd * roll.norm())] };
        true
    }
}

/// The cue ball's motion before the impact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Before {
    /// The motion of kind `impacts`, in the table frame.
    Impact {
        /// The line of centres from the cue ball to the object ball, x and y.
        normal: [Measured; 2],
        /// The cue ball's velocity, x and y in m/s.
        velocity: [Measured; 2],
    },
    /// The motion of kind `angles`.
    Angle {
        /// The cut angle, rad: positive if the cue ball moves towards +y of the collision frame.
        cut: Measured,
        /// The speed in m/s, if it is known.
        speed: Option<Measured>,
    },
}
