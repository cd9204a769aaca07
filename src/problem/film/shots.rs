//! The shots of a fitted film: their impacts, their frames, their paths through the picture.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::block::Settled;
use super::camera::{Camera, Point};
use super::dual::{Dual, DualVector, gradient};
use super::filmed::ShotAt;
use super::motion::{Struck, locate};
use super::own::{self, OWN, input_of};
use crate::measurement::dataset::{Before, Measured, Measurement, Shot};
use crate::measurement::observable::{Axis, Observable};
use crate::measurement::spin::Spin;
use crate::measurement::track::{TrackShot, TrackedBall};
use crate::numerics::median;
use crate::physics::ball::Vec3;
use crate::problem::evaluation::Reduced;
use crate::problem::frames::{Frame, PicturePaths};
use crate::problem::solution::Solution;
use crate::problem::sums::{Contribution, NoiseSums};
use crate::problem::unknowns::{Id, Own, Shared};

/// Velocities of the cue ball and of the object ball after an impact.
pub(in crate::problem) const VELOCITIES: [Observable; 4] = [
    Observable::CueVelocity(Axis::X),
    Observable::CueVelocity(Axis::Y),
    Observable::ObjectVelocity(Axis::X),
    Observable::ObjectVelocity(Axis::Y),
];

/// Number of quantities of an impact before its observables: direction, velocity, spin.
const BEFORE: usize = 6;

/// Unknowns of the cloth, with whose errors all shots are extracted.
const CLOTH: [Id; 2] = [Id::MuK, Id::MuR];

/// Steps of a descent in the own unknowns of a shot, and decrease of χ² after which it ends: 1e-3
/// standard deviations.
const SHOT_STOP: (usize, f64) = (30, 1e-6);

/// The impact of a shot with a free outcome, and how well its frames show it.
#[derive(Clone, Debug)]
pub(crate) struct Impact {
    /// Its number among the shots of the fit.
    pub(crate) index: usize,
    /// The shot as measured, in the table frame, with the errors that are its own.
    pub(crate) shot: Shot,
    /// Variance that its numbers have of what all shots share, friction and rolling resistance of
    /// the cloth, over their own: the mean of direction and velocities.
    pub(crate) shared_part: f64,
    /// Instant of the impact, s.
    pub(crate) time: f64,
    /// Standard deviation of a coordinate of the object ball, m.
    pub(crate) position_sd: f64,
    /// χ² of its frames per degree of freedom.
    pub(crate) reduced_chi2: f64,
    /// Number of frames that were left out.
    pub(crate) outliers: usize,
    /// Its own unknowns without a law of the impact.
    own: Own,
    /// The [`Id::OFFSETS`] of its outcome.
    offsets: [f64; Id::OFFSETS.len()],
}

/// The frames of a shot that were used, with the paths that they show.
pub(crate) struct ShownPaths {
    /// Instant (s) and place of each ball, m from the middle of the film.
    pub(crate) seen: [Vec<(f64, [f64; 2])>; 2],
    /// Paths of the balls through the picture.
    pub(crate) paths: PicturePaths,
}

impl Impact {
    /// Returns the speeds of the cue ball before and after the impact, and of the object ball after
    /// it, m/s.
    pub fn speeds(&self) -> [f64; 3] {
        let Before::Impact { velocity: [x, y], .. } = self.shot.before else { return [f64::NAN; 3] };
        let after: Vec<f64> = self.shot.after.iter().map(|after| after.measured.value).collect();
        [x.value.hypot(y.value), after[0].hypot(after[1]), after[2].hypot(after[3])]
    }
}

/// One ball in one frame against the fit.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FittedFrame {
    pub(crate) ball: TrackedBall,
    /// s
    pub(crate) time: f64,
    /// Place in the picture, m from the middle of the film.
    pub(crate) seen: [f64; 2],
    /// Place by the fit, m from the middle of the film.
    pub(crate) predicted: [f64; 2],
    /// Standard deviations of both coordinates, m.
    pub(crate) sd: [f64; 2],
    pub(crate) used: bool,
}

impl FittedFrame {
    /// Returns measured less predicted, in standard deviations.
    pub fn standardized(&self) -> [f64; 2] {
        [0, 1].map(|axis| (self.seen[axis] - self.predicted[axis]) / self.sd[axis])
    }
}

impl ShotAt<'_> {
    /// Returns the paths of the balls through the picture; `None` if they do not collide.
    pub(super) fn paths(&self) -> Option<PicturePaths> {
        let [cue, object] = &self.struck().ok()?.paths(self);
        let camera = Camera::new(self.shared);
        Some(PicturePaths::new([cue, object], locate, self.own[own::TIME], camera, self.shot.fps))
    }

    /// Returns the frames of the shot against its paths.
    pub(super) fn fitted_frames(&self) -> Vec<FittedFrame> {
        let Some(paths) = &self.paths() else { return Vec::new() };
        let balls = [TrackedBall::Cue, TrackedBall::Object].into_iter().enumerate();
        let frames_of_ball = |(which, ball): (usize, TrackedBall)| {
            let noise = self.film.variation.noises[which].sd;
            self.shot.tracks[which].iter().map(move |frame| FittedFrame {
                ball,
                time: frame.time,
                seen: frame.seen.into(),
                predicted: (Point::from(paths.place(which, frame.time))
                    + frame.apart * self.shared[Id::Push])
                    .into(),
                sd: frame.weight.map(|weight| noise / weight).into(),
                used: frame.used,
            })
        };
        balls.flat_map(frames_of_ball).collect()
    }
}

/// How a cue ball meets an object ball.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Motion {
    /// Cut angle, rad: positive if the cue ball moves towards +y of the collision frame.
    pub(crate) cut: f64,
    /// Speed of the cue ball before the impact, m/s.
    pub(crate) speed: f64,
    /// Direction of the line of centres, rad.
    pub(crate) direction: f64,
    /// Velocities of both balls after the impact in the collision frame, along and across, m/s.
    pub(crate) after: [f64; 4],
    /// Topspin over natural roll.
    pub(crate) topspin: f64,
}

/// An estimate that a shot has of its own, under its column in tables, in the unit of its name;
/// velocities m/s.
type OwnEstimate = (&'static str, Measured);

impl Solution {
    /// Returns the shared unknowns of the first sample.
    fn first_shared(&self) -> Shared {
        self.problem.samples[0].gather(&self.state().shared)
    }

    fn film_shot<'a>(&'a self, i: usize, shared: &'a Shared) -> Option<ShotAt<'a>> {
        let film = self.problem.film()?;
        Some(ShotAt { film, shot: film.shots.get(i)?, own: self.state().own[0].get(i)?, shared })
    }

    /// Returns the frames of shot `i` of a film against the fit, m in the film at its stated scale.
    pub(crate) fn fitted_frames(&self, i: usize) -> Vec<FittedFrame> {
        let shared = self.first_shared();
        let mut frames = self.film_shot(i, &shared).map_or_else(Vec::new, |at| at.fitted_frames());
        let [x, y] = self.origin();
        for place in frames.iter_mut().flat_map(|frame| [&mut frame.seen, &mut frame.predicted]) {
            *place = [place[0] + x, place[1] + y];
        }
        frames
    }

    /// Returns the radius of the object ball of a film, m.
    pub fn radius(&self) -> f64 {
        self.problem.film().map_or(f64::NAN, |film| film.contact.object().radius)
    }

    /// Returns how shot `i` of a film goes by the fit.
    pub fn motion(&self, i: usize) -> Option<Motion> {
        let shared = self.first_shared();
        let at = self.film_shot(i, &shared)?;
        let [cue, object] = at.struck().ok()?.after.map(|ball| ball.velocity.map(|v| v.re));
        let ShotAt { shot, own, .. } = at;
        let [along, across] = [own[own::ALONG], own[own::ACROSS]];
        Some(Motion {
            cut: across.atan2(along),
            speed: along.hypot(across),
            direction: own[own::DIRECTION],
            after: [cue.x, cue.y, object.x, object.y],
            topspin: shot.spin.topspin_of(own),
        })
    }

    /// Returns the own unknowns of each shot of a film in the frame of the table, with its name;
    /// their errors include those of what all shots share.
    pub(crate) fn own_estimates<'a>(&'a self) -> Vec<(&'a str, Vec<OwnEstimate>)> {
        let reduced = self.at.reduced();
        let estimate = |(i, name): (usize, &'a String)| {
            let estimates = reduced.and_then(|reduced| self.own_estimates_of(i, reduced));
            (name.as_str(), estimates.unwrap_or_default())
        };
        self.names().par_iter().enumerate().map(estimate).collect()
    }

    fn own_estimates_of(&self, i: usize, reduced: &Reduced) -> Option<Vec<OwnEstimate>> {
        let (shared, [x, y]) = (self.first_shared(), self.origin());
        let at = self.film_shot(i, &shared)?;
        let (struck, ShotAt { shot, own, .. }) = (at.struck().ok()?, at);
        let inputs = &struck.inputs;
        let velocity = struck.turn(&struck.before.velocity);
        let mut all = vec![
            // time counts from the estimate
            ("impact_t_s", inputs[own::TIME] + own[own::TIME]),
            ("object_x_m", inputs[own::X] + x),
            ("object_y_m", inputs[own::Y] + y),
            ("normal_deg", inputs[own::DIRECTION] * 1_f64.to_degrees()),
            ("cue_vx", velocity.x),
            ("cue_vy", velocity.y),
        ];
        if !shot.spin.rolls {
            all.push(("cue_topspin_of_roll", inputs[own::TOPSPIN]));
        }
        all.push(("cue_side_spin_of_speed", inputs[own::SIDE]));
        let estimate = |(column, value): (&'static str, Dual)| {
            let by = gradient(&value);
            let by = DVector::from_fn(OWN, |place, _| by[input_of(place)]);
            let sd = self.covariance.variance(reduced, (0, i), &by).sqrt();
            (column, Measured::new(value.re, sd))
        };
        Some(all.into_iter().map(estimate).collect())
    }

    /// Returns the impact of shot `i` of a film as its frames show it without a law of the impact,
    /// the camera and the cloth as the fit has them; `track` is what it was read from. `None` if
    /// its frames do not show it.
    pub fn impact(&self, i: usize, track: &TrackShot) -> Option<Impact> {
        let shared = self.first_shared();
        let at = self.film_shot(i, &shared)?;
        let Settled { own, shared, sums } = at.settle(&Id::OFFSETS, SHOT_STOP);
        let at = ShotAt { own: &own, shared: &shared, ..at };
        let (struck, ShotAt { film, shot, .. }) = (at.struck().ok()?, at);
        let quantities = table_quantities(&struck, self.radius());
        let [of_shot, of_cloth] = self.variances(&quantities, &sums)?;
        // the spin may follow from the velocity, without an error of its own
        let parts = [0, 1, 2, 6, 7, 8, 9].map(|row: usize| of_cloth[row] / of_shot[row]);
        let parts: Vec<f64> = parts.into_iter().filter(|part| part.is_finite()).collect();
        let value = |row: usize| quantities[row].re;
        let sd = |row: usize| of_shot[row].max(0.0).sqrt();
        let measured = |row: usize| Measured::new(value(row), sd(row));
        let (sin, cos) = value(0).sin_cos();
        let normal = [Measured::new(cos, sd(0) * sin.abs()), Measured::new(sin, sd(0) * cos.abs())];
        // what is stated may be refuted
        let is_open = shot.spin.is_unknown();
        let stated = match track.spin {
            spin @ (Spin::Stun | Spin::NaturalRoll) if !is_open => spin,
            _ if is_open && shot.spin.rolls => Spin::NaturalRoll,
            _ => Spin::Measured {
                spin: Vec3::new(value(3), value(4), value(5)),
                sd: [3, 4, 5].map(|row| Some(sd(row)).filter(|sd| *sd > 0.0)),
            },
        };
        let after = (BEFORE..).zip(VELOCITIES);
        let after = after.map(|(row, observable)| Measurement { observable, measured: measured(row) });
        let impact = Shot {
            file: track.file.clone(),
            line: track.line,
            labels: track.labels.clone(),
            ..Shot::new(
                track.name.clone(),
                Before::Impact { normal, velocity: [measured(1), measured(2)] },
                stated,
                after.collect(),
            )
        };
        // of a coordinate, in units of the film's noise
        let used = shot.tracks[1].iter().filter(|frame| frame.used);
        let sds: Vec<f64> = used.flat_map(|frame| [frame.weight.x.recip(), frame.weight.y.recip()]).collect();
        let typical_sd = if sds.is_empty() { 1.0 } else { median(sds) };
        let time = own[own::TIME];
        let add_up = |of: fn(&NoiseSums) -> f64| sums.sums.noises.iter().map(of).sum::<f64>();
        let dof = add_up(|noise| noise.count) - (sums.sums.count_free() + Id::OFFSETS.len()) as f64;
        let is_left_out = |frame: &&Frame| !frame.used && frame.seen.iter().all(|x| x.is_finite());
        Some(Impact {
            index: i,
            shot: impact,
            shared_part: parts.iter().sum::<f64>() / parts.len() as f64,
            time,
            position_sd: film.variation.noises[1].sd * typical_sd,
            reduced_chi2: add_up(|noise| noise.weighted) / dof.max(1.0),
            outliers: shot.tracks.iter().flatten().filter(is_left_out).count(),
            own: own.clone(),
            offsets: Id::OFFSETS.map(|id| shared[id]),
        })
    }

    /// Returns the frames of a shot of a film with its paths without a law of the impact. They are
    /// not kept with its impact, since those of many shots do not fit in memory.
    pub fn shown_paths(&self, impact: &Impact) -> Option<ShownPaths> {
        let mut shared = self.first_shared();
        for (id, offset) in Id::OFFSETS.into_iter().zip(impact.offsets) {
            shared[id] = offset;
        }
        let at = ShotAt { own: &impact.own, ..self.film_shot(impact.index, &shared)? };
        let used = |frames: &Vec<Frame>| {
            let used = frames.iter().filter(|frame| frame.used);
            used.map(|frame| (frame.time, frame.seen.into())).collect()
        };
        Some(ShownPaths { seen: [0, 1].map(|ball| used(&at.shot.tracks[ball])), paths: at.paths()? })
    }

    /// Returns the variances of quantities of a shot with a free outcome: those that its frames
    /// leave, and those of the cloth, which own unknowns and outcome follow.
    fn variances(&self, quantities: &[Dual], sums: &Contribution) -> Option<[DVector<f64>; 2]> {
        let (matrix, _) = sums.system(&[&Id::OFFSETS[..], &CLOTH].concat());
        let free = OWN + Id::OFFSETS.len();
        let mut covariance = matrix.view((0, 0), (free, free)).into_owned().cholesky()?.inverse();
        for place in (0..OWN).filter(|place| sums.sums.held[*place]) {
            covariance[(place, place)] = 0.0;
        }
        let by_own = DMatrix::from_fn(quantities.len(), free, |row, column| {
            let offset = column.checked_sub(OWN).map(|i| OWN + Id::OFFSETS[i] as usize);
            gradient(&quantities[row])[input_of(offset.unwrap_or(column))]
        });
        let shot_variances = (&by_own * &covariance * by_own.transpose()).diagonal();
        let by_cloth = &by_own * covariance * matrix.view((0, free), (free, CLOTH.len()));
        let cloth_covariance = self.covariance.between(&CLOTH).map(|c| if c.is_nan() { 0.0 } else { c });
        Some([shot_variances, (&by_cloth * cloth_covariance * by_cloth.transpose()).diagonal()])
    }
}

/// Returns direction of the line of centres, velocity and spin of the cue ball before the impact,
/// and the velocities of both balls after it, in the table frame.
fn table_quantities(struck: &Struck, radius: f64) -> Vec<Dual> {
    let velocity = struck.turn(&struck.before.velocity);
    let [x, y, z] = struck.before.spin.map(|spin| spin / radius);
    let turning = struck.turn(&DualVector::new(x, y));
    let [cue, object] = [0, 1].map(|ball| struck.turn(&struck.after[ball].velocity));
    let direction = struck.inputs[own::DIRECTION];
    vec![direction, velocity.x, velocity.y, turning.x, turning.y, z, cue.x, cue.y, object.x, object.y]
}
