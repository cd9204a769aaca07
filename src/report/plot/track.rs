//! A figure of one shot: both tracks from above with the fitted paths, and what the fit leaves.

use super::axis::ends;
use super::{Axis, Figure, INK, Mark, Panel, Point, cm, color};
use crate::fit::FittedFilm;
use crate::problem::Impact;

/// Height of the panels, pixels.
const ROW: u32 = 600;

/// Instants of a fitted path, and corners of the outline of a ball.
const STEPS: u32 = 200;
const CORNERS: u32 = 60;

/// What a figure shows, whatever was fitted.
pub(crate) struct Tracks<'a> {
    pub name: &'a str,
    /// Where either was seen, and when (s).
    pub seen: [Vec<(f64, [f64; 2])>; 2],
    /// Below the title.
    pub summary: String,
    pub names: [&'static str; 2],
    /// First and last instant used.
    pub window: [f64; 2],
    /// Instant of impact.
    pub time: f64,
    /// The axis of times and what one unit of it is in those of the track.
    pub clock: (&'static str, f64),
    /// Standard deviation of a coordinate, m.
    pub position_sd: f64,
    /// Radii of both, m.
    pub radii: [f64; 2],
    /// The fitted place of either at a time.
    pub place: &'a dyn Fn(usize, f64) -> [f64; 2],
}

/// Returns the figure of a shot of balls.
pub fn of_balls(film: &FittedFilm, impact: &Impact) -> Figure {
    let [before, cue, object] = impact.speeds();
    let tracks = Tracks {
        name: &impact.shot.name,
        summary: format!(
            "cue ball {before:.3} → {cue:.3} m/s, object ball {object:.3} m/s, noise {:.3} mm, χ²/dof {:.2}, {} frames left out",
            1e3 * impact.position_sd,
            impact.reduced_chi2,
            impact.outliers,
        ),
        names: ["cue ball", "object ball"],
        window: ends(impact.seen.iter().flatten().map(|(t, _)| *t)),
        seen: impact.seen.clone(),
        time: impact.time,
        clock: ("time from the impact (ms)", 1e-3),
        position_sd: impact.position_sd,
        radii: [film.radius(); 2],
        place: &|ball, time| impact.paths.place(ball, time),
    };
    tracks.figure()
}

impl Tracks<'_> {
    pub(crate) fn figure(&self) -> Figure {
        let mut figure = Figure::new(format!("shot {}", self.name));
        figure.lines = vec![self.summary.clone()];
        figure.series = self.names.map(str::to_owned).to_vec();
        let [along_x, along_y] = [0, 1].map(|axis| self.residuals(axis));
        figure.add_rows(ROW, 1, vec![self.plan()]);
        figure.add_rows(ROW / 2, 2, vec![along_x, along_y]);
        figure
    }

    /// Returns tracks, fitted paths, and both balls as they touch, with the line of centres, in centimetres.
    fn plan(&self) -> Panel {
        let about = "points: tracked; lines: fitted; circles: at the impact";
        let mut panel = Panel::of_places("Seen from above", about);
        let contact = [0, 1].map(|ball| (self.place)(ball, self.time));
        let [from, to] = self.window;
        let mut paths = Vec::new();
        for ball in [0, 1] {
            let times = (0..=STEPS).map(|step| from + (to - from) * f64::from(step) / f64::from(STEPS));
            let path: Vec<[f64; 2]> = times.map(|time| cm((self.place)(ball, time))).collect();
            let outline = (0..=CORNERS).map(|corner| {
                let (sin, cos) = (std::f64::consts::TAU * f64::from(corner) / f64::from(CORNERS)).sin_cos();
                cm([contact[ball][0] + self.radii[ball] * cos, contact[ball][1] + self.radii[ball] * sin])
            });
            paths.extend(path.iter().copied());
            panel.line(path, color(ball), 2);
            panel.line(outline, color(ball), 1);
        }
        // wrong frames far away would shrink the rest: they stand at the edge
        let reach = [0, 1].map(|axis| ends(paths.iter().map(|place| place[axis])));
        let room = 0.1 * (reach[0][1] - reach[0][0]).max(reach[1][1] - reach[1][0]);
        for (ball, seen) in self.seen.iter().enumerate() {
            let place = |place: [f64; 2]| {
                let place = cm(place);
                [0, 1].map(|axis| place[axis].clamp(reach[axis][0] - room, reach[axis][1] + room))
            };
            let points = seen.iter().map(|(_, at)| Point { opacity: 0.45, ..Point::new(place(*at), ball) });
            panel.points(points);
        }
        panel.line(contact.map(cm), INK, 2);
        panel
    }

    /// Returns tracked less fitted places along x or y against time, in millimetres.
    fn residuals(&self, axis: usize) -> Panel {
        // wrong frames would squeeze the others: they stand at the edge
        let most = 6e3 * self.position_sd;
        let name = ["x residual (mm)", "y residual (mm)"][axis];
        let mut panel =
            Panel::new("Tracked less fitted", "", Axis::new(self.clock.0), Axis::symmetric(name, 1e-6));
        panel.marks.extend([Mark::Horizontal(0.0), Mark::Vertical(0.0)]);
        for (ball, seen) in self.seen.iter().enumerate() {
            let points = seen.iter().map(|(time, place)| {
                let off = 1e3 * (place[axis] - (self.place)(ball, *time)[axis]);
                let at = [(time - self.time) / self.clock.1, off.clamp(-most, most)];
                Point { opacity: 0.6, ..Point::new(at, ball) }
            });
            panel.points(points);
        }
        panel
    }
}
