//! A data set and its shots, as loaded and checked.

use std::collections::BTreeMap;
use std::path::PathBuf;

use nalgebra::{DMatrix, DVector};

use super::loss::Loss;
use super::observable::{Axis, Observable};
use super::parameter::{Compliance, Parameter, Prior, Settings};
use super::relation::Relation;
use super::spin::Spin;
use super::track::TrackShot;
use crate::physics::ball::{Ball, Vec3};
use crate::physics::collision::{Effects, Fidelity, Model};
use crate::physics::disc::Discs;

/// A data set. One that was read from files is checked; of one that a program made a fit refuses what
/// [`Dataset::faults`] finds.
#[derive(Clone, Debug)]
pub struct Dataset {
    /// Also the name of its folder below `fits/`.
    pub name: String,
    /// The file it was read from.
    pub path: PathBuf,
    pub cloth: Option<String>,
    pub source: Option<String>,
    /// The cue ball, and what is not like it of the object ball.
    pub ball: Ball,
    pub object: Option<ObjectBall>,
    pub settings: Settings,
    /// Constraints between parameters (`[fit] constraints`).
    pub relations: Vec<Relation>,
    /// How outlying shots count (`[fit] loss`).
    pub loss: Loss,
    /// The label column whose values are fitted apart (`[fit] by`).
    pub by: Option<String>,
    pub shots: Vec<Shot>,
    /// Shots that are left out from the start, with the reason.
    pub left_out: Vec<(String, String)>,
    /// The cloth's sliding friction μ_k, where the shots were extracted from tracks with it.
    pub sliding: Option<Measured>,
    /// Its rolling resistance μ_r likewise.
    pub rolling: Option<Measured>,
    /// Relative standard error that all shots share of how high friction lifts a ball, where they were extracted with it.
    pub lift_sd: Option<f64>,
    /// Standard deviation of side spin that nobody saw, as Rω_z/U: of shots that are stated as stun or natural roll (`[cue_spin]
    /// side_sd`). 0: there is none.
    pub side_sd: f64,
    /// Kind `tracks`: what was filmed, from which shots are yet to be extracted.
    pub tracks: Option<Tracks>,
}

impl Dataset {
    /// Shots that a program measured, with the usual settings of the fit; [`Dataset::faults`] names what is wrong with them.
    #[must_use]
    pub fn new(name: impl Into<String>, ball: Ball, shots: Vec<Shot>) -> Self {
        Self {
            name: name.into(),
            path: PathBuf::new(),
            cloth: None,
            source: None,
            ball,
            object: None,
            settings: Settings::default(),
            relations: Vec::new(),
            loss: Loss::default(),
            by: None,
            shots,
            left_out: Vec::new(),
            sliding: None,
            rolling: None,
            lift_sd: None,
            side_sd: 0.0,
            tracks: None,
        }
    }

    /// The model of its balls.
    #[must_use]
    pub fn model(&self, fidelity: Fidelity) -> Model {
        let e_slope = self.settings.e_falls.then(|| self.settings[Parameter::ESlope].initial);
        Model { object: self.object.map(|object| object.ball), e_slope, ..Model::new(fidelity, self.ball) }
    }

    /// The model by which films are corrected and impacts extracted: `full`, or `ode` where it is stated that the contact gives way.
    #[must_use]
    pub(crate) fn model_of_contact(&self) -> Model {
        let kappa = self.settings[Parameter::Kappa].initial;
        if self.settings.compliance != Compliance::Stated || kappa <= 0.0 {
            return self.model(Fidelity::Full);
        }
        let effects = Effects { compliance: true, falling_friction: true, ..Fidelity::Full.effects() };
        Model { effects, kappa, tolerance: Model::TOLERANCE_OF_FITS, ..self.model(Fidelity::Ode) }
    }

    /// The settings of its fit, with what is known of balls that are not equal.
    #[must_use]
    pub fn settings_of_balls(&self) -> Settings {
        self.object.map_or(self.settings, |object| object.settings(self.ball, self.settings))
    }

    /// Whether it is of tracks from which no impacts have been extracted yet.
    #[must_use]
    pub fn awaits_extraction(&self) -> bool {
        self.shots.is_empty() && self.tracks.as_ref().is_some_and(|tracks| !tracks.shots.is_empty())
    }

    /// The names of its shots, of footage as filmed, in their order.
    #[must_use]
    pub fn names(&self) -> Vec<&str> {
        let filmed = self.tracks.iter().flat_map(|tracks| &tracks.shots).map(|shot| shot.name.as_str());
        filmed.chain(self.shots.iter().map(|shot| shot.name.as_str())).collect()
    }

    /// Leaves out the shots that are not wanted, as [`ON_REQUEST`] states.
    pub fn keep(&mut self, wanted: impl Fn(&str) -> bool) {
        let unwanted: Vec<String> =
            self.names().into_iter().filter(|name| !wanted(name)).map(str::to_owned).collect();
        self.shots.retain(|shot| wanted(&shot.name));
        if let Some(tracks) = &mut self.tracks {
            tracks.shots.retain(|shot| wanted(&shot.name));
        }
        self.left_out.extend(unwanted.into_iter().map(|name| (name, ON_REQUEST.to_owned())));
    }

    /// The standard errors that all shots share.
    #[must_use]
    pub fn shared_errors(&self) -> Vec<(Shared, f64)> {
        let sd = |shared| match shared {
            Shared::Sliding => self.sliding.and_then(|sliding| sliding.sd),
            Shared::Lift => self.lift_sd,
            Shared::Rolling => self.rolling.and_then(|rolling| rolling.sd),
        };
        Shared::ALL.into_iter().filter_map(|shared| Some((shared, sd(shared)?))).collect()
    }
}

/// An object ball that is not like the cue ball.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ObjectBall {
    pub ball: Ball,
    /// Standard deviations of m_cue/m_object and of R_cue/R_object, where they are known.
    pub mass_ratio_sd: Option<f64>,
    pub radius_ratio_sd: Option<f64>,
}

impl ObjectBall {
    /// Settings with the ratios of masses and radii as they are known.
    #[must_use]
    pub fn settings(&self, cue: Ball, mut settings: Settings) -> Settings {
        let model = Model { object: Some(self.ball), ..Model::new(Fidelity::Full, cue) };
        for (parameter, mean, sd) in [
            (Parameter::MassRatio, model.mass_ratio(), self.mass_ratio_sd),
            (Parameter::RadiusRatio, model.radius_ratio(), self.radius_ratio_sd),
        ] {
            let setting = &mut settings[parameter];
            (setting.initial, setting.fixed) = (mean, sd.is_none());
            setting.prior = sd.map(|sd| Prior { mean, sd });
        }
        settings
    }
}

/// Why shots are left out that a user did not want.
pub const ON_REQUEST: &str = "left out on request";

/// One shot, or the mean of several.
#[derive(Clone, Debug)]
pub struct Shot {
    /// The `shot` column, or where there is none the number, from 1, among all the data set's shots.
    pub name: String,
    pub file: PathBuf,
    /// Line of the file, from 1, comments and header counted.
    pub line: usize,
    /// Columns that are neither input nor observable, kept as text.
    pub labels: BTreeMap<String, String>,
    pub before: Before,
    pub spin: Spin,
    /// At least one.
    pub after: Vec<Measurement>,
    /// Where state before and observations were extracted together, their joint errors.
    pub joint: Option<Box<Joint>>,
}

impl Shot {
    /// A measured impact in the table's frame: the line of centres from the cue ball to the object ball, of any length but 0, the
    /// cue ball's velocity before, and its own and the object ball's after, in m/s, each component with its standard deviation where
    /// one is known. The direction of the line of centres errs by `normal_sd` radians, where that is known.
    #[must_use]
    pub fn impact(
        name: impl Into<String>,
        (normal, normal_sd): ([f64; 2], Option<f64>),
        spin: Spin,
        before: [Measured; 2],
        [cue_after, object_after]: [[Measured; 2]; 2],
    ) -> Self {
        const LEAST: f64 = 1e-12;
        let length = normal[0].hypot(normal[1]);
        let [nx, ny] = normal.map(|component| component / length);
        // a unit vector that turns by σ moves by σ across itself; standard deviations are positive
        let component = |value: f64, across: f64| Measured {
            value,
            sd: normal_sd.map(|sd| sd * across.abs().max(LEAST)),
        };
        let of = |observable: fn(Axis) -> Observable, velocity: [Measured; 2]| {
            [Axis::X, Axis::Y]
                .into_iter()
                .zip(velocity)
                .map(move |(axis, measured)| Measurement { observable: observable(axis), measured })
        };
        Self {
            name: name.into(),
            file: PathBuf::new(),
            line: 0,
            labels: BTreeMap::new(),
            before: Before::Impact { normal: [component(nx, ny), component(ny, nx)], velocity: before },
            spin,
            after: of(Observable::CueVelocity, cue_after)
                .chain(of(Observable::ObjectVelocity, object_after))
                .collect(),
            joint: None,
        }
    }

    /// Makes the side spin of a shot that is stated as stun or natural roll uncertain: `sd` is its standard deviation, of Rω_z/U.
    /// Whether the speed is known that this takes.
    pub fn add_side_spin(&mut self, sd: f64, radius: f64) -> bool {
        let rolls = match self.spin {
            Spin::Stun => 0.0,
            Spin::NaturalRoll => 1.0,
            Spin::Measured { .. } | Spin::Unknown => return true,
        };
        let velocity = match self.before {
            Before::Impact { velocity, .. } => velocity.map(|v| v.value),
            Before::Angle { cut, speed: Some(speed) } => {
                [speed.value * cut.value.cos(), speed.value * cut.value.sin()]
            }
            Before::Angle { speed: None, .. } => return false,
        };
        // ω = (−U_y, U_x, 0)/R where it rolls
        let spin = Vec3::new(-velocity[1], velocity[0], 0.0) * (rolls / radius);
        let side = sd * velocity[0].hypot(velocity[1]) / radius;
        self.spin = Spin::Measured { spin, sd: [None, None, Some(side)] };
        if let Some(joint) = &mut self.joint {
            // the spin that rolls goes with the velocity, and its error with that of the velocity
            let mut with = DMatrix::identity(joint.covariance.nrows(), joint.covariance.ncols());
            with[(3, 2)] = -rolls / radius;
            with[(4, 1)] = rolls / radius;
            joint.covariance = &with * &joint.covariance * with.transpose();
            joint.covariance[(5, 5)] += side * side;
            joint.by_shared = joint.by_shared.clone().map(|by| &with * by);
        }
        true
    }
}

/// Errors of what was extracted from one track, table frame: direction of the line of centres (rad), the
/// cue ball's v_x, v_y (m/s), ω_x, ω_y, ω_z (rad/s) before the impact, then the shot's observations in
/// their order.
#[derive(Clone, Debug, PartialEq)]
pub struct Joint {
    /// Without the errors that all shots share.
    pub covariance: DMatrix<f64>,
    /// How they move with each of these, in the order of [`Shared::ALL`].
    pub by_shared: [DVector<f64>; 3],
}

/// What all shots of footage were extracted with, so that they share its error.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shared {
    /// The cloth's sliding friction μ_k.
    Sliding,
    /// How high friction lifts a ball, as a factor.
    Lift,
    /// The cloth's rolling resistance μ_r.
    Rolling,
}

impl Shared {
    pub const ALL: [Self; 3] = [Self::Sliding, Self::Lift, Self::Rolling];
}

impl Joint {
    /// How many quantities before the impact stand in front of the observations.
    pub const BEFORE: usize = 6;
}

/// A value with its standard deviation, where the data give one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measured {
    pub value: f64,
    pub sd: Option<f64>,
}

impl Measured {
    /// With its standard deviation.
    #[must_use]
    pub fn new(value: f64, sd: f64) -> Self {
        Self { value, sd: Some(sd) }
    }
}

/// An observable's measured value, in SI units and radians.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measurement {
    pub observable: Observable,
    pub measured: Measured,
}

/// The cue ball's motion before the impact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Before {
    /// Kind `impacts`: line of centres (unit vector, cue to object) and velocity, table frame.
    Impact { normal: [Measured; 2], velocity: [Measured; 2] },
    /// Kind `angles`: cut angle in radians, and the speed (m/s) where it is known.
    Angle { cut: Measured, speed: Option<Measured> },
}

/// The filmed shots of a data set.
#[derive(Clone, Debug)]
pub struct Tracks {
    pub shots: Vec<TrackShot>,
    /// Shots that the shots table says to skip: name and reason.
    pub skipped: Vec<(String, String)>,
    /// Shots that were damaged between the camera and the file and cannot be mended: name and reason, with file and line.
    pub damaged: Vec<(String, String)>,
    /// What was detected and repaired, with file and line.
    pub notes: Vec<String>,
    /// Shots whose impact was found, though something about them is wrong: name and what it is.
    pub doubtful: Vec<(String, String)>,
    /// Of discs: what was measured of each shot, those that are not fitted among them.
    pub disc_shots: Vec<DiscShot>,
    /// `None`: balls.
    pub discs: Option<Discs>,
    /// Corrections for the camera that are stated, in the order of [`Correction::ALL`](crate::film::camera::Correction::ALL); `None`:
    /// to be found from the balls.
    pub camera: [Option<f64>; 7],
    /// Lengths are in an unknown unit: the size of the balls tells it.
    pub from_balls: bool,
}

/// What was measured of one shot of discs; `None` where its tracks do not tell.
#[derive(Clone, Debug, PartialEq)]
pub struct DiscShot {
    pub name: String,
    /// e.
    pub restitution: Option<Measured>,
    /// J_t/J_n on the second disc.
    pub impulse_ratio: Option<Measured>,
    /// Momentum gained along and across the line of centres, over the normal impulse.
    pub momentum: [Option<Measured>; 2],
    /// Angular momentum gained about the contact point, over the normal impulse times the distance of the centres.
    pub angular_momentum: Option<Measured>,
    /// Part of the energy that was lost.
    pub energy_lost: Option<Measured>,
    /// m/s, or m per frame where the frame rate is not known.
    pub closing_speed: Option<Measured>,
    /// Slip before the impact over the closing speed.
    pub slip_ratio: Option<Measured>,
    /// Whether the discs move on as one.
    pub sticks: bool,
    /// What speaks against these numbers; empty for a good shot.
    pub doubts: String,
}

impl Tracks {
    /// Shots that were left out on loading: name and reason.
    pub(crate) fn left_out(&self) -> impl Iterator<Item = (String, String)> {
        let skipped = self.skipped.iter().map(|(shot, reason)| (shot.clone(), format!("skipped: {reason}")));
        skipped.chain(self.damaged.iter().cloned())
    }
}
