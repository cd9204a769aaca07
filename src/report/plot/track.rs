//! A picture of one shot: both tracks from above with the fitted paths, and what the fit leaves.

use super::axis::Axis;
use super::frame::{Frame, Rect};
use super::picture::{GREY, INK, LARGE, Picture, shortened};
use super::series::{color, two_balls};
use crate::fit::FittedFilm;
use crate::problem::Impact;
use crate::report::ReportError;

const WIDTH: i32 = 1200;
const HEIGHT: i32 = 660;

/// Width of the plan, pixels: so that what is within its axes is square.
const PLAN: i32 = 538;

/// What a picture shows, whatever was fitted.
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

/// The picture of a shot as SVG: plan in centimetres, residuals in millimetres against time.
pub fn svg(film: &FittedFilm, impact: &Impact) -> Result<String, ReportError> {
    let place = |ball: usize, t: f64| impact.paths.place(ball, t);
    let radius = film.radius();
    let tracks = Tracks {
        name: &impact.shot.name,
        summary: summary(impact),
        names: ["cue ball", "object ball"],
        window: window(&impact.seen),
        seen: impact.seen.clone(),
        time: impact.time,
        clock: ("time from the impact (ms)", 1e-3),
        position_sd: impact.position_sd,
        radii: [radius; 2],
        place: &place,
    };
    tracks.svg()
}

/// The first and the last instant of what was seen.
pub(super) fn window(seen: &[Vec<(f64, [f64; 2])>; 2]) -> [f64; 2] {
    let times = || seen.iter().flatten().map(|(t, _)| *t);
    [times().fold(f64::INFINITY, f64::min), times().fold(f64::NEG_INFINITY, f64::max)]
}

/// Instants from end to end of a window.
pub(super) fn instants([from, to]: [f64; 2], steps: u32) -> impl Iterator<Item = f64> {
    (0..=steps).map(move |step| from + (to - from) * f64::from(step) / f64::from(steps))
}

/// In centimetres.
pub(super) fn cm([x, y]: [f64; 2]) -> (f64, f64) {
    (100.0 * x, 100.0 * y)
}

impl Tracks<'_> {
    pub(crate) fn svg(&self) -> Result<String, ReportError> {
        let name = format!("shot {}", self.name);
        let mut picture = Picture::new(&name, WIDTH, HEIGHT);
        picture.title(&shortened(&name, LARGE, WIDTH - 44), 32);
        picture.label(&self.summary, (22, 66), GREY);
        self.plan(&mut picture);
        self.residuals(&mut picture);
        two_balls(&mut picture, self.names, [WIDTH - 360, WIDTH - 190]);
        picture.svg()
    }

    /// Tracks, fitted paths, and both balls as they touch, with the line of centres.
    fn plan(&self, picture: &mut Picture) {
        const STEPS: u32 = 200;
        let contact = [0, 1].map(|ball| (self.place)(ball, self.time));
        let outline = |ball: usize| {
            (0..=60).map(move |step| {
                let (sin, cos) = (std::f64::consts::TAU * f64::from(step) / 60.0).sin_cos();
                let ([x, y], radius) = (contact[ball], self.radii[ball]);
                cm([x + radius * cos, y + radius * sin])
            })
        };
        let path = |ball: usize| instants(self.window, STEPS).map(move |t| cm((self.place)(ball, t)));
        // wrong frames far away would shrink the rest: the fitted paths decide
        let all = || [0, 1].into_iter().flat_map(|ball| path(ball).chain(outline(ball)));
        let (mut x, mut y) =
            (Axis::around("x (cm)", all().map(|p| p.0)), Axis::around("y (cm)", all().map(|p| p.1)));
        // equal scales: the longer side decides
        let longer = (x.high - x.low).max(y.high - y.low);
        x.widen(longer);
        y.widen(longer);
        let area = Rect { left: 10, top: 84, right: 10 + PLAN, bottom: HEIGHT - 10 };
        let remarks = ["points: tracked; lines: fitted; circles: at the impact".to_string()];
        let mut frame = Frame::new(picture, area, "Seen from above", &remarks, (x, y));
        for (ball, seen) in self.seen.iter().enumerate() {
            for (_, place) in seen {
                frame.marker(cm(*place), ball, 0.45);
            }
            frame.line(&path(ball).collect::<Vec<_>>(), color(ball), 2);
            frame.line(&outline(ball).collect::<Vec<_>>(), color(ball), 1);
        }
        frame.line(&contact.map(cm), INK, 2);
        frame.axes();
    }

    fn residuals(&self, picture: &mut Picture) {
        let mut points = Vec::new();
        for (ball, seen) in self.seen.iter().enumerate() {
            for (t, [seen_x, seen_y]) in seen {
                let [x, y] = (self.place)(ball, *t);
                let time = (t - self.time) / self.clock.1;
                points.push((ball, time, [1e3 * (seen_x - x), 1e3 * (seen_y - y)]));
            }
        }
        // wrong frames would squeeze the others: they stand at the edge
        let most = 6e3 * self.position_sd;
        for (row, name) in ["x residual (mm)", "y residual (mm)"].into_iter().enumerate() {
            let top = 84 + row as i32 * 285;
            let rect = Rect { left: PLAN + 30, top, right: WIDTH - 6, bottom: top + 285 };
            let values = points.iter().map(|(_, _, residual)| residual[row].clamp(-most, most));
            let axes =
                (Axis::around(self.clock.0, points.iter().map(|p| p.1)), Axis::symmetric(name, values, 1e-6));
            let title = if row == 0 { "Tracked less fitted" } else { "" };
            let mut frame = Frame::new(picture, rect, title, &[], axes);
            frame.horizontal(0.0, INK);
            frame.vertical(0.0, GREY);
            for (ball, time, residual) in &points {
                frame.marker((*time, residual[row]), *ball, 0.6);
            }
            frame.axes();
        }
    }
}

fn summary(impact: &Impact) -> String {
    let [before, cue, object] = impact.speeds();
    format!(
        "cue ball {before:.3} → {cue:.3} m/s, object ball {object:.3} m/s, noise {:.3} mm, χ²/dof {:.2}, {} frames left out",
        1e3 * impact.position_sd,
        impact.reduced_chi2,
        impact.outliers,
    )
}
