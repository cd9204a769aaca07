//! Figures of films: paths of one shot with what the fit leaves, and those of all shots seen from
//! above.

use std::f64::consts::TAU;

use super::axis::ends;
use super::{Axis, Figure, INK, Panel, Point, Scale, color};
use crate::fit::FittedFilm;
use crate::measurement::number::count_of;
use crate::problem::{Impact, ShownPaths};

/// Both tracks of a shot of balls or discs with what was fitted.
pub(in crate::report) struct Tracks<'a> {
    pub(in crate::report) name: &'a str,
    /// Time (s) and place of each sighting.
    pub(in crate::report) seen: [Vec<(f64, [f64; 2])>; 2],
    /// Below the title.
    pub(in crate::report) summary: String,
    pub(in crate::report) names: [&'static str; 2],
    /// Instant of impact.
    pub(in crate::report) time: f64,
    /// Title of the axis of times, and its unit in the unit of the track's times.
    pub(in crate::report) clock: (&'static str, f64),
    /// Standard deviation of a coordinate, m.
    pub(in crate::report) position_sd: f64,
    /// Radii of both, m.
    pub(in crate::report) radii: [f64; 2],
    /// The fitted place of either at a time.
    pub(in crate::report) place: Box<dyn Fn(usize, f64) -> [f64; 2] + 'a>,
}

/// Returns the tracks of a shot of balls, at places from the origin of the film instead of its
/// middle; `None` if its frames do not show an impact.
pub(in crate::report) fn of_balls<'a>(film: &FittedFilm, impact: &'a Impact) -> Option<Tracks<'a>> {
    let ShownPaths { seen, paths } = film.solution.shown_paths(impact)?;
    let [before, cue, object] = impact.speeds();
    let (noise, chi2) = (1e3 * impact.position_sd, impact.reduced_chi2);
    let left_out = count_of(impact.outliers, "frame");
    let [x, y] = film.solution.origin();
    let in_film = move |place: [f64; 2]| [place[0] + x, place[1] + y];
    Some(Tracks {
        name: &impact.shot.name,
        seen: seen.map(|seen| seen.into_iter().map(|(t, at)| (t, in_film(at))).collect()),
        summary: format!(
            "cue ball {before:.3} → {cue:.3} m/s, object ball {object:.3} m/s, noise {noise:.3} mm, χ²/dof {chi2:.2}, \
             {left_out} left out"
        ),
        names: ["cue ball", "object ball"],
        time: impact.time,
        clock: ("time from the impact (ms)", 1e-3),
        position_sd: impact.position_sd,
        radii: [film.solution.radius(); 2],
        place: Box::new(move |ball, time| in_film(paths.place(ball, time))),
    })
}

/// Returns the paths of both balls in all shots, in a figure that is empty if no shot shows an
/// impact.
pub(in crate::report) fn all_shots(name: &str, film: &FittedFilm) -> Figure {
    /// Largest numbers of shots, spread over all, and of frames of a ball of each: more would only
    /// cover each other.
    const MOST_SHOTS: usize = 60;
    const MOST_FRAMES: usize = 20;
    let names = film.solution.names();
    let each = names.len().div_ceil(MOST_SHOTS).max(1);
    let shots: Vec<&Impact> = names.iter().step_by(each).filter_map(|name| film.impact(name)).collect();
    let mut panel = seen_from_above("", "");
    let mut figure = Figure::new(name);
    for tracks in shots.iter().filter_map(|impact| of_balls(film, impact)) {
        tracks.draw(&mut panel, 1, MOST_FRAMES);
        figure.series = tracks.names.map(str::to_owned).to_vec();
    }
    let counted = if shots.len() == names.len() { String::new() } else { format!("{} of ", shots.len()) };
    let words = "seen from above; points: tracked; lines: fitted; bars: line of centres at the impact";
    figure.say(format!("{counted}{}, {words}", count_of(names.len(), "shot")));
    if !shots.is_empty() {
        figure.add_rows(760, 1, vec![panel]);
    }
    figure
}

/// Returns a panel of places.
fn seen_from_above(title: &str, about: &str) -> Panel {
    Panel { is_square: true, ..Panel::new(title, about, Axis::new("x (cm)"), Axis::new("y (cm)")) }
}

/// Returns a path between two values of its parameter, in centimetres.
fn path([from, to]: [f64; 2], place: impl Fn(f64) -> [f64; 2]) -> Vec<[f64; 2]> {
    const STEPS: u32 = 100;
    (0..=STEPS).map(|step| cm(place(from + (to - from) * f64::from(step) / f64::from(STEPS)))).collect()
}

fn cm(place: [f64; 2]) -> [f64; 2] {
    place.map(|metres| 100.0 * metres)
}

impl Tracks<'_> {
    /// Returns the figure of a shot.
    pub(in crate::report) fn figure(&self) -> Figure {
        let about = "points: tracked; lines: fitted; circles: at the impact";
        let mut plan = seen_from_above("Seen from above", about);
        for (ball, radius) in self.radii.into_iter().enumerate() {
            let [x, y] = (self.place)(ball, self.time);
            let outline = path([0.0, TAU], |angle| [x + radius * angle.cos(), y + radius * angle.sin()]);
            plan.line(outline, color(ball), 1);
        }
        self.draw(&mut plan, 2, usize::MAX);
        let mut figure = Figure::new(format!("shot {}", self.name));
        figure.say(&self.summary);
        figure.series = self.names.map(str::to_owned).to_vec();
        figure.rows = vec![(600, vec![plan]), (300, vec![self.residuals(0), self.residuals(1)])];
        figure
    }

    /// Adds fitted paths, tracked places and the line of centres at the impact.
    fn draw(&self, panel: &mut Panel, width: u32, most_frames: usize) {
        let window = ends(self.seen.iter().flatten().map(|(time, _)| *time));
        let paths = [0, 1].map(|ball| path(window, |time| (self.place)(ball, time)));
        // wrong frames far away would shrink the rest: they stand at the edge
        let reach = [0, 1].map(|axis| ends(paths.iter().flatten().map(|place| place[axis])));
        let room = 0.1 * reach.iter().map(|[low, high]| high - low).fold(0.0, f64::max);
        for (ball, (path, seen)) in paths.into_iter().zip(&self.seen).enumerate() {
            panel.line(path, color(ball), width);
            let frames = seen.iter().step_by(seen.len().div_ceil(most_frames).max(1));
            panel.points(frames.map(|(_, at)| {
                let at = cm(*at);
                let at = [0, 1].map(|axis| at[axis].clamp(reach[axis][0] - room, reach[axis][1] + room));
                Point { opacity: 0.5, ..Point::new(at, ball) }
            }));
        }
        panel.line([0, 1].map(|ball| cm((self.place)(ball, self.time))), INK, 2);
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
