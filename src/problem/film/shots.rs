//! What a fit of a film says of each shot: its impact, its frames, its paths through the picture.

use nalgebra::{DMatrix, DVector};

use super::block::FilmBlock;
use super::camera::Camera;
use super::dual::{Dual, gradient};
use super::frames::locate;
use super::motion::{Approach, Piece, Stretch, Struck, follow_balls};
use super::own::{self, OWN};
use crate::measurement::dataset::{Before, Joint, Measured, Measurement, Shared as SharedError, Shot};
use crate::measurement::observable::{Axis, Observable};
use crate::measurement::spin::Spin;
use crate::measurement::track::{TrackShot, TrackedBall};
use crate::physics::ball::Vec3;
use crate::problem::solution::Solution;
use crate::problem::sums::Contribution;
use crate::problem::unknowns::{Id, Own, Shared};

/// Observables of an impact.
const OBSERVED: [Observable; 4] = [
    Observable::CueVelocity(Axis::X),
    Observable::CueVelocity(Axis::Y),
    Observable::ObjectVelocity(Axis::X),
    Observable::ObjectVelocity(Axis::Y),
];

/// Steps until the outcome of a shot is found.
const STEPS: usize = 30;

/// Fall of χ² below which a step ends the search.
const STALL: f64 = 1e-6;

/// The impact of a shot with a free outcome, and how well its frames show it.
#[derive(Clone, Debug)]
pub struct Impact {
    /// The shot as measured, in the table frame.
    pub shot: Shot,
    /// Instant of the impact, s.
    pub time: f64,
    /// Standard deviation of a coordinate of the object ball, m.
    pub position_sd: f64,
    /// χ² of its frames per degree of freedom.
    pub reduced_chi2: f64,
    /// Number of frames that were used, of the cue ball before and after the impact, and of the object
    /// ball after it.
    pub frames: [usize; 3],
    /// Number of frames that were left out.
    pub outliers: usize,
    /// Paths of the balls through the picture.
    pub paths: PicturePaths,
}

/// One ball in one frame against the fit.
#[derive(Clone, Copy, Debug)]
pub struct FittedFrame {
    /// The ball.
    pub ball: TrackedBall,
    /// s
    pub time: f64,
    /// Place in the picture, m from the middle of the film.
    pub seen: [f64; 2],
    /// Where the fit has it.
    pub predicted: [f64; 2],
    /// Standard deviations of both coordinates, m.
    pub sd: [f64; 2],
    /// Whether the frame is used.
    pub used: bool,
}

/// Paths of the balls of a shot through the picture.
#[derive(Clone, Debug)]
pub struct PicturePaths {
    stretches: [Vec<Stretch>; 2],
    instant: f64,
    camera: Camera,
}

impl PicturePaths {
    fn new(film: &FilmBlock, i: usize, own: &Own, shared: &Shared) -> Option<Self> {
        let paths = follow_balls(own, shared, &film.spins[i].stated, film.contact(i)).ok()?;
        let stretches = paths.pieces.map(|pieces| pieces.iter().map(Piece::stretch).collect());
        Some(Self { stretches, instant: own[own::TIME], camera: Camera::new(shared) })
    }

    /// Returns the place of the cue ball (0) or the object ball (1) in the picture at a time, m from
    /// the middle of the film.
    #[must_use]
    pub fn place(&self, ball: usize, time: f64) -> [f64; 2] {
        let at = |late: f64| {
            let (table, height) = locate(&self.stretches[ball.min(1)], time - self.instant + late);
            self.camera.look(table, height).place
        };
        // where it is seen says when the shutter reads it
        at(self.camera.delay(at(0.0))).into()
    }
}

impl Solution {
    /// Returns the frames of shot `i` of a film against the fit.
    #[must_use]
    pub fn fitted_frames(&self, i: usize) -> Vec<FittedFrame> {
        let Some((film, own, shared)) = self.film_shot(i) else { return Vec::new() };
        let Some(paths) = PicturePaths::new(film, i, own, &shared) else { return Vec::new() };
        let of_ball = |(which, ball): (usize, TrackedBall)| {
            let noise = film.world.noise[which];
            let paths = &paths;
            film.shots[i].tracks[which].iter().map(move |frame| FittedFrame {
                ball,
                time: frame.time,
                seen: frame.seen.into(),
                predicted: paths.place(which, frame.time),
                sd: frame.weight.map(|weight| noise.sd / weight).into(),
                used: frame.used,
            })
        };
        [TrackedBall::Cue, TrackedBall::Object].into_iter().enumerate().flat_map(of_ball).collect()
    }

    fn film_shot(&self, i: usize) -> Option<(&FilmBlock, &Own, Shared)> {
        let shared = self.problem.samples.first()?.gather(&self.state().shared);
        Some((self.problem.film()?, self.state().own.first()?.get(i)?, shared))
    }

    /// Returns the impact of shot `i` of a film as its frames show it whatever the law of the impact,
    /// the camera and the cloth as the fit has them; `track` is what it was read from. `None` if its
    /// frames do not show it.
    #[must_use]
    pub fn impact(&self, i: usize, track: &TrackShot) -> Option<Impact> {
        let (film, own, mut shared) = self.film_shot(i)?;
        let (own, sums) = settle(film, i, own.clone(), &mut shared);
        let (matrix, _) = sums.system(&Id::OFFSETS, 0.0);
        let held = |place: usize| sums.held.get(place).copied().unwrap_or(false);
        let mut covariance = matrix.cholesky()?.inverse();
        for place in (0..OWN).filter(|place| held(*place)) {
            covariance[(place, place)] = 0.0;
        }
        let spin = film.spins[i];
        let struck = Struck::new(&own, &shared, &spin.stated, film.contact(i)).ok()?;
        let quantities = table_quantities(&struck, &own, film.world.contact.object().radius);
        let offsets = Id::OFFSETS.map(|id| OWN + id as usize);
        let by_own = DMatrix::from_fn(quantities.len(), OWN + 4, |row, column| {
            let by = gradient(&quantities[row]);
            by[if column < OWN { column } else { offsets[column - OWN] }]
        });
        let shot_covariance = &by_own * &covariance * by_own.transpose();
        // own unknowns and outcome follow what all shots share
        let by_shared = |id: Id| {
            let place = |i: usize| if i < OWN { i } else { offsets[i - OWN] };
            let column = OWN + id as usize;
            let beside = DVector::from_fn(OWN + 4, |i, _| {
                let (a, b) = (place(i).min(column), place(i).max(column));
                if held(i) { 0.0 } else { sums.products[(a, b)] }
            });
            -(&by_own * (&covariance * beside))
        };
        let by_shared = SharedError::ALL.map(|error| match error {
            SharedError::Sliding => by_shared(Id::MuK),
            SharedError::Rolling => by_shared(Id::MuR),
            SharedError::Lift | SharedError::Camera(_) => DVector::zeros(quantities.len()),
        });
        let value = |row: usize| quantities[row].re;
        let sd = |row: usize| shot_covariance[(row, row)].max(0.0).sqrt();
        let measured = |row: usize| Measured::new(value(row), sd(row));
        let (sin, cos) = value(0).sin_cos();
        let normal = [Measured::new(cos, sd(0) * sin.abs()), Measured::new(sin, sd(0) * cos.abs())];
        let stated = match (spin.stated.approach, track.spin) {
            (_, Spin::Stun) => Spin::Stun,
            (_, Spin::NaturalRoll) | (Approach::Rolls, Spin::Unknown) => Spin::NaturalRoll,
            _ => Spin::Measured {
                spin: Vec3::new(value(3), value(4), value(5)),
                sd: [3, 4, 5].map(|row| Some(sd(row))),
            },
        };
        let after = OBSERVED.iter().enumerate();
        let after = after.map(|(k, observable)| Measurement {
            observable: *observable,
            measured: measured(Joint::BEFORE + k),
        });
        let frames = &film.shots[i].tracks;
        let time = own[own::TIME];
        let count = |ball: usize, is_after: bool| {
            frames[ball].iter().filter(|frame| frame.used && (frame.time > time) == is_after).count()
        };
        let all: f64 = sums.noises.iter().map(|noise| noise.count).sum();
        let weighted: f64 = sums.noises.iter().map(|noise| noise.weighted).sum();
        Some(Impact {
            shot: Shot {
                name: track.name.clone(),
                file: track.file.clone(),
                line: track.line,
                labels: track.labels.clone(),
                before: Before::Impact { normal, velocity: [measured(1), measured(2)] },
                spin: stated,
                after: after.collect(),
                joint: Some(Box::new(Joint { covariance: shot_covariance, by_shared: by_shared.to_vec() })),
                side_sd: 0.0,
            },
            time,
            position_sd: film.world.noise[1].sd,
            reduced_chi2: weighted / (all - (OWN + 4) as f64).max(1.0),
            frames: [count(0, false), count(0, true), count(1, true)],
            outliers: frames.iter().flatten().filter(|frame| frame.is_left_out()).count(),
            paths: PicturePaths::new(film, i, &own, &shared)?,
        })
    }
}

/// Returns direction of the line of centres, velocity and spin of the cue ball before the impact, and
/// the velocities of both balls after it, in the table frame.
fn table_quantities(struck: &Struck, own: &Own, radius: f64) -> Vec<Dual> {
    let velocity = struck.turn(&struck.before.velocity);
    let [x, y, z] = struck.before.spin.map(|spin| spin / radius);
    let turning = struck.turn(&nalgebra::Vector2::new(x, y));
    let [cue, object] = [0, 1].map(|ball| struck.turn(&struck.after[ball].velocity));
    let direction = struck.inputs[own::DIRECTION];
    debug_assert!((direction.re - own[own::DIRECTION]).abs() < 1e-12);
    vec![direction, velocity.x, velocity.y, turning.x, turning.y, z, cue.x, cue.y, object.x, object.y]
}

/// Returns the own unknowns of a shot where χ² is least over them and the outcome offsets, which it
/// sets in `shared`, and the sums there.
fn settle(film: &FilmBlock, i: usize, mut own: Own, shared: &mut Shared) -> (Own, Contribution) {
    let mut at = film.contribute(i, &own, shared);
    let mut damping = 1e-6;
    for _ in 0..STEPS {
        let Some(step) = at.own_step(&Id::OFFSETS, damping) else { break };
        let mut moved = shared.clone();
        for (k, id) in Id::OFFSETS.into_iter().enumerate() {
            moved[id] -= step[OWN + k];
        }
        let trial = film.spins[i].bounded(&own - step.rows(0, OWN), &moved);
        let there = film.contribute(i, &trial, &moved);
        if there.cost < at.cost {
            let gain = at.cost - there.cost;
            (own, *shared, at) = (trial, moved, there);
            damping *= 0.01;
            if gain < STALL {
                break;
            }
        } else {
            damping = (damping * 100.0).max(1e-6);
            if damping > 1e6 {
                break;
            }
        }
    }
    (own, at)
}
