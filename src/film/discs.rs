//! Films of discs on the table: a shutter that reads the points of a disc one after the other must not bend it, and its centre is that
//! of the corrected points where it is the centre of a circle through them.

use super::camera::Camera;
use crate::film::rigid_body::circle_centres;
use crate::measurement::correction::Correction;
use crate::measurement::track::{Sample, TrackShot, TrackedBall};

/// The discs, in the order of everything that is said of both.
pub(crate) const DISCS: [TrackedBall; 2] = [TrackedBall::Cue, TrackedBall::Object];

/// The velocity of a point is its way from so many frames before to so many after: noise of 0.1 mm at 500 fps is then 0.9 cm/s, which
/// moves a point by a micrometre while a shutter reads a disc.
const REACH: usize = 4;

/// Positions that differ by less are the same, m.
const SAME: f64 = 1e-9;

/// Whether the centre of a disc was computed from the points on it, as films are loaded where three or more points are on a circle
/// about it.
pub(crate) fn is_of_points(film: &TrackShot, disc: TrackedBall) -> bool {
    let centre = centre(film, disc);
    let Ok(circle) = circle_centres(&points(film, disc)) else { return false };
    circle.len() == centre.len()
        && circle.iter().zip(centre).all(|(a, b)| (a.x - b.x).hypot(a.y - b.y) < SAME && a.t == b.t)
}

/// The positions of a disc's centre.
pub(crate) fn centre(film: &TrackShot, disc: TrackedBall) -> &[Sample] {
    match disc {
        TrackedBall::Cue => &film.cue,
        TrackedBall::Object => &film.object,
    }
}

/// The positions of the points on a disc.
pub(crate) fn points(film: &TrackShot, disc: TrackedBall) -> Vec<&[Sample]> {
    let own = film.markers.iter().filter(|marker| marker.ball == disc);
    own.map(|marker| marker.samples.as_slice()).collect()
}

/// A camera as discs calibrate it, and how far it may be off.
#[derive(Clone, Debug, PartialEq)]
pub struct Calibrated {
    pub(crate) camera: Camera,
    /// Independent ways in which it may be off, each by its standard deviation, in the units of the corrections.
    pub(crate) ways: Vec<[f64; Correction::COUNT]>,
}

impl Calibrated {
    /// By how much a point of the table at this place and velocity moves in each of these ways.
    pub(crate) fn moves(&self, place: [f64; 2], velocity: [f64; 2]) -> Vec<[f64; 2]> {
        let by = self.camera.follows(place, velocity);
        let way = |way: &[f64; Correction::COUNT]| {
            [0, 1].map(|k| way.iter().zip(&by).map(|(w, by)| w * by[k]).sum())
        };
        self.ways.iter().map(way).collect()
    }
}

impl Camera {
    /// How a point of the table follows the corrections, at this place and velocity, m by the unit of each.
    pub(crate) fn follows(&self, place: [f64; 2], velocity: [f64; 2]) -> [[f64; 2]; Correction::COUNT] {
        let film = self.film(place);
        let mut by = self.derivatives(film);
        let [by_x, by_y] = self.delays(film, place);
        // what is read later shows where the point was earlier
        by[Correction::ShutterX as usize] = velocity.map(|v| -v * by_x);
        by[Correction::ShutterY as usize] = velocity.map(|v| -v * by_y);
        by
    }

    /// A shot of discs on the table, from its film; `of_points`: of each disc, whether its centre is that of a circle through its points.
    pub(crate) fn discs(&self, film: &TrackShot, of_points: [bool; 2]) -> TrackShot {
        if self.is_neutral() {
            return film.clone();
        }
        let still = self.with(Correction::ShutterX, 0.0).with(Correction::ShutterY, 0.0);
        let mut shot = still.shot(film);
        for (disc, of_points) in DISCS.into_iter().zip(of_points) {
            if self.has_shutter() {
                self.at_one_instant(&mut shot, disc, of_points);
            }
            let circle = circle_centres(&points(&shot, disc)).ok().filter(|_| of_points);
            if let Some(circle) = circle {
                match disc {
                    TrackedBall::Cue => shot.cue = circle,
                    TrackedBall::Object => shot.object = circle,
                }
            }
        }
        shot
    }

    fn has_shutter(&self) -> bool {
        self.get(Correction::ShutterX) != 0.0 || self.get(Correction::ShutterY) != 0.0
    }

    /// By how much later a rolling shutter reads a point of the table, s.
    fn delay(&self, table: [f64; 2]) -> f64 {
        let [by_x, by_y] = self.delays(self.film(table), table);
        self.get(Correction::ShutterX) * by_x + self.get(Correction::ShutterY) * by_y
    }

    /// Moves the points of a disc on to the instant at which its centre was read, or else their mean: what belongs to one frame keeps one
    /// time.
    fn at_one_instant(&self, shot: &mut TrackShot, disc: TrackedBall, of_points: bool) {
        let mut reads: Vec<(f64, f64)> = Vec::new();
        let mut add =
            |samples: &[Sample]| reads.extend(samples.iter().map(|s| (s.t, self.delay([s.x, s.y]))));
        if of_points {
            points(shot, disc).into_iter().for_each(&mut add);
        } else {
            add(centre(shot, disc));
        }
        reads.sort_by(|a, b| a.0.total_cmp(&b.0));
        // of each frame
        let read = |t: f64| {
            let own = reads[reads.partition_point(|read| read.0 < t)..].iter().take_while(|read| read.0 == t);
            let (sum, count) = own.fold((0.0, 0.0), |(sum, count), read| (sum + read.1, count + 1.0));
            (count > 0.0).then(|| sum / count)
        };
        let moved = |samples: &[Sample]| -> Vec<Sample> {
            let on = |(i, s): (usize, &Sample)| {
                let own = self.delay([s.x, s.y]);
                let late = read(s.t).unwrap_or(own);
                let [vx, vy] = velocity(samples, i);
                Sample { t: s.t + late, x: s.x + vx * (late - own), y: s.y + vy * (late - own), sd: s.sd }
            };
            samples.iter().enumerate().map(on).collect()
        };
        let centres = moved(centre(shot, disc));
        for marker in shot.markers.iter_mut().filter(|marker| marker.ball == disc) {
            marker.samples = moved(&marker.samples);
        }
        match disc {
            TrackedBall::Cue => shot.cue = centres,
            TrackedBall::Object => shot.object = centres,
        }
    }
}

/// The velocity of a point from the frames around one of them, m/s.
pub(crate) fn velocity(samples: &[Sample], i: usize) -> [f64; 2] {
    let (Some(a), Some(b)) =
        (samples.get(i.saturating_sub(REACH)), samples.get((i + REACH).min(samples.len().saturating_sub(1))))
    else {
        return [0.0; 2];
    };
    let time = b.t - a.t;
    if time > 0.0 { [(b.x - a.x) / time, (b.y - a.y) / time] } else { [0.0; 2] }
}
