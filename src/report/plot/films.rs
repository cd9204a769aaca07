//! Figures of films: paths of one shot with what the fit leaves, those of all shots seen from above, and the camera.

use std::f64::consts::TAU;

use super::axis::ends;
use super::{Axis, Figure, INK, Panel, Point, Scale, color};
use crate::fit::FittedFilm;
use crate::measurement::number::count_of;
use crate::problem::Impact;

/// Names of the balls.
const BALLS: [&str; 2] = ["cue ball", "object ball"];

/// The content of the figure of a shot, of balls or discs.
pub(in crate::report) struct Tracks<'a> {
    pub(in crate::report) name: &'a str,
    /// Where either was seen, and when (s).
    pub(in crate::report) seen: [Vec<(f64, [f64; 2])>; 2],
    /// Below the title.
    pub(in crate::report) summary: String,
    pub(in crate::report) names: [&'static str; 2],
    /// Instant of impact.
    pub(in crate::report) time: f64,
    /// The axis of times and what one unit of it is in those of the track.
    pub(in crate::report) clock: (&'static str, f64),
    /// Standard deviation of a coordinate, m.
    pub(in crate::report) position_sd: f64,
    /// Radii of both, m.
    pub(in crate::report) radii: [f64; 2],
    /// The fitted place of either at a time.
    pub(in crate::report) place: &'a dyn Fn(usize, f64) -> [f64; 2],
}

fn cm(place: [f64; 2]) -> [f64; 2] {
    place.map(|metres| 100.0 * metres)
}

/// Returns a place from the origin of the film instead of its middle.
fn in_film(film: &FittedFilm, place: [f64; 2]) -> [f64; 2] {
    [0, 1].map(|axis| place[axis] + film.solution.middle[axis] * film.solution.unit)
}

/// Returns a fitted path from one instant to another.
fn path(steps: u32, [from, to]: [f64; 2], place: impl Fn(f64) -> [f64; 2]) -> Vec<[f64; 2]> {
    (0..=steps).map(|step| place(from + (to - from) * f64::from(step) / f64::from(steps))).collect()
}

/// Returns the figure of a shot of balls.
pub(in crate::report) fn of_shot(film: &FittedFilm, impact: &Impact) -> Figure {
    let [before, cue, object] = impact.speeds();
    let summary = format!(
        "cue ball {before:.3} → {cue:.3} m/s, object ball {object:.3} m/s, noise {:.3} mm, χ²/dof {:.2}, {} left out",
        1e3 * impact.position_sd,
        impact.reduced_chi2,
        count_of(impact.outliers, "frame"),
    );
    let in_film = |place| in_film(film, place);
    let tracks = Tracks {
        name: &impact.shot.name,
        seen: impact.seen.each_ref().map(|seen| seen.iter().map(|(t, at)| (*t, in_film(*at))).collect()),
        summary,
        names: BALLS,
        time: impact.time,
        clock: ("time from the impact (ms)", 1e-3),
        position_sd: impact.position_sd,
        radii: [film.radius(); 2],
        place: &|ball, time| in_film(impact.paths.place(ball, time)),
    };
    tracks.figure()
}

/// Returns the paths of both balls in all shots, in a figure that is empty if no shot shows an impact.
pub(in crate::report) fn all_shots(name: &str, film: &FittedFilm) -> Figure {
    /// Largest numbers of shots, spread over all, and of frames of a ball of each: more would only cover each other.
    const MOST_SHOTS: usize = 60;
    const MOST_FRAMES: usize = 20;
    let names = film.names();
    let each = names.len().div_ceil(MOST_SHOTS).max(1);
    let shots: Vec<Impact> = names.iter().step_by(each).filter_map(|name| film.impact(name)).collect();
    let mut panel = Panel::of_places("", "");
    for impact in &shots {
        let place = |ball: usize, time: f64| cm(in_film(film, impact.paths.place(ball, time)));
        for (ball, seen) in impact.seen.iter().enumerate() {
            let window = ends(seen.iter().map(|(time, _)| *time));
            panel.line(path(60, window, |time| place(ball, time)), color(ball), 1);
            let frames = seen.iter().step_by(seen.len().div_ceil(MOST_FRAMES).max(1));
            let point = |at| Point { opacity: 0.5, ..Point::new(cm(in_film(film, at)), ball) };
            panel.points(frames.map(|(_, at)| point(*at)));
        }
        panel.line([0, 1].map(|ball| place(ball, impact.time)), INK, 2);
    }
    let mut figure = Figure::new(name);
    let counted = if shots.len() == names.len() { String::new() } else { format!("{} of ", shots.len()) };
    let words = "seen from above; points: tracked; lines: fitted; bars: line of centres at the impact";
    figure.lines = vec![format!("{counted}{}, {words}", count_of(names.len(), "shot"))];
    figure.series = BALLS.map(str::to_owned).to_vec();
    if !shots.is_empty() {
        figure.add_rows(760, 1, vec![panel]);
    }
    figure
}

impl Tracks<'_> {
    pub(in crate::report) fn figure(&self) -> Figure {
        let mut figure = Figure::new(format!("shot {}", self.name));
        figure.lines = vec![self.summary.clone()];
        figure.series = self.names.map(str::to_owned).to_vec();
        figure.add_rows(600, 1, vec![self.plan()]);
        figure.add_rows(300, 2, vec![self.residuals(0), self.residuals(1)]);
        figure
    }

    /// Returns tracks, fitted paths, and both balls as they touch, with the line of centres.
    fn plan(&self) -> Panel {
        let about = "points: tracked; lines: fitted; circles: at the impact";
        let mut panel = Panel::of_places("Seen from above", about);
        let contact = [0, 1].map(|ball| (self.place)(ball, self.time));
        let window = ends(self.seen.iter().flatten().map(|(time, _)| *time));
        let paths = [0, 1].map(|ball| path(200, window, |time| cm((self.place)(ball, time))));
        for ball in [0, 1] {
            let [x, y] = contact[ball];
            let outline = path(36, [0.0, TAU], |angle| {
                cm([x + self.radii[ball] * angle.cos(), y + self.radii[ball] * angle.sin()])
            });
            panel.line(paths[ball].iter().copied(), color(ball), 2);
            panel.line(outline, color(ball), 1);
        }
        // wrong frames far away would shrink the rest: they stand at the edge
        let reach = [0, 1].map(|axis| ends(paths.iter().flatten().map(|place| place[axis])));
        let room = 0.1 * reach.iter().map(|[low, high]| high - low).fold(0.0, f64::max);
        for (ball, seen) in self.seen.iter().enumerate() {
            panel.points(seen.iter().map(|(_, at)| {
                let at = cm(*at);
                let at = [0, 1].map(|axis| at[axis].clamp(reach[axis][0] - room, reach[axis][1] + room));
                Point { opacity: 0.45, ..Point::new(at, ball) }
            }));
        }
        panel.line(contact.map(cm), INK, 2);
        panel
    }

    /// Returns tracked less fitted places along x or y against time, in millimetres.
    fn residuals(&self, axis: usize) -> Panel {
        // wrong frames would squeeze the others: they stand at the edge
        let most = 6e3 * self.position_sd;
        let y = Axis::with(["x residual (mm)", "y residual (mm)"][axis], Scale::Symmetric(1e-6));
        let mut panel = Panel::new("Tracked less fitted", "", Axis::new(self.clock.0), y);
        panel.horizontal(0.0);
        panel.line([[0.0, f64::NEG_INFINITY], [0.0, f64::INFINITY]], INK, 1);
        for (ball, seen) in self.seen.iter().enumerate() {
            panel.points(seen.iter().map(|(time, place)| {
                let off = 1e3 * (place[axis] - (self.place)(ball, *time)[axis]);
                let at = [(time - self.time) / self.clock.1, off.clamp(-most, most)];
                Point { opacity: 0.6, ..Point::new(at, ball) }
            }));
        }
        panel
    }
}
