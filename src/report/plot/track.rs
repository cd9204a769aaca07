//! A picture of one shot: both tracks from above with the fitted paths, and what the fit leaves.

use plotters::prelude::*;

use super::axis::Axis;
use super::canvas::{Anchor, Canvas, GREY, INK, LARGE, SMALL, shortened};
use super::drawing;
use super::drawing::Area;
use super::frame::{Frame, Rect};
use super::series::{color, marker};
use crate::extraction::{Impact, Quantity};
use crate::measurement::track::{Sample, TrackShot};
use crate::report::ReportError;
use crate::trajectory::scene::Scene;

const WIDTH: i32 = 1200;
const HEIGHT: i32 = 660;

/// Width of the plan, pixels: so that what is within its axes is square.
const PLAN: i32 = 538;

/// What a picture shows, whatever was fitted.
pub(crate) struct Picture<'a> {
    pub shot: &'a TrackShot,
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
pub fn svg(shot: &TrackShot, impact: &Impact, scene: &Scene) -> Result<String, ReportError> {
    let motion = impact.motion(scene);
    let place = |ball: usize, t: f64| if ball == 0 { motion.cue(t) } else { motion.object(t) };
    let picture = Picture {
        shot,
        summary: summary(impact),
        names: ["cue ball", "object ball"],
        window: impact.window,
        time: impact.values[Quantity::Time as usize],
        clock: ("time from the impact (ms)", 1e-3),
        position_sd: impact.position_sd,
        radii: [scene.ball.radius, scene.object.radius],
        place: &place,
    };
    picture.svg()
}

impl Picture<'_> {
    pub(crate) fn svg(&self) -> Result<String, ReportError> {
        let failed = |reason| ReportError::Draw { dataset: format!("shot {}", self.shot.name), reason };
        let size = (WIDTH as u32, HEIGHT as u32);
        drawing::svg(size, |area| self.draw(area)).map(|(text, ())| text).map_err(failed)
    }

    fn draw<DB: DrawingBackend>(&self, area: &Area<DB>) -> Result<(), String> {
        let canvas = Canvas::new(area)?;
        let title = shortened(&format!("shot {}", self.shot.name), LARGE, WIDTH - 44);
        canvas.text(&title, (22, 32), Anchor::Left, LARGE, INK)?;
        canvas.text(&self.summary, (22, 66), Anchor::Left, SMALL, GREY)?;
        self.plan(&canvas)?;
        self.residuals(&canvas)?;
        for (ball, name) in self.names.into_iter().enumerate() {
            let x = WIDTH - 360 + 170 * ball as i32;
            marker(&canvas, (x, 32), ball, 1.0)?;
            canvas.text(name, (x + 14, 32), Anchor::Left, SMALL, INK)?;
        }
        Ok(())
    }

    /// The samples that the fit used or left out as wrong, by ball.
    fn used(&self) -> [Vec<&Sample>; 2] {
        let [from, to] = self.window;
        [&self.shot.cue, &self.shot.object]
            .map(|samples| samples.iter().filter(|sample| (from..=to).contains(&sample.t)).collect())
    }

    /// Tracks, fitted paths, and both balls as they touch, with the line of centres.
    fn plan<DB: DrawingBackend>(&self, canvas: &Canvas<DB>) -> Result<(), String> {
        const STEPS: u32 = 200;
        let cm = |metres: f64| 100.0 * metres;
        let contact = [0, 1].map(|ball| (self.place)(ball, self.time));
        let outline = |ball: usize| {
            (0..=60).map(move |step| {
                let (sin, cos) = (std::f64::consts::TAU * f64::from(step) / 60.0).sin_cos();
                let ([x, y], radius) = (contact[ball], self.radii[ball]);
                (cm(x + radius * cos), cm(y + radius * sin))
            })
        };
        let path = |ball: usize| {
            let [from, to] = self.window;
            (0..=STEPS).map(move |step| {
                let [x, y] = (self.place)(ball, from + (to - from) * f64::from(step) / f64::from(STEPS));
                (cm(x), cm(y))
            })
        };
        // wrong frames far away would shrink the rest: the fitted paths decide
        let all = || [0, 1].into_iter().flat_map(|ball| path(ball).chain(outline(ball)));
        let (mut x, mut y) =
            (Axis::around("x (cm)", all().map(|p| p.0)), Axis::around("y (cm)", all().map(|p| p.1)));
        // equal scales: the longer side decides
        let half = 0.5 * (x.high - x.low).max(y.high - y.low);
        for axis in [&mut x, &mut y] {
            let middle = 0.5 * (axis.low + axis.high);
            (axis.low, axis.high) = (middle - half, middle + half);
        }
        let area = Rect { left: 10, top: 84, right: 10 + PLAN, bottom: HEIGHT - 10 };
        let remarks = ["points: tracked; lines: fitted; circles: at the impact".to_string()];
        let frame = Frame::new(canvas, area, "Seen from above", &remarks, (x, y))?;
        for (ball, samples) in self.used().iter().enumerate() {
            for sample in samples {
                marker(canvas, frame.at(cm(sample.x), cm(sample.y)), ball, 0.45)?;
            }
            frame.line(&path(ball).collect::<Vec<_>>(), color(ball), 2)?;
            frame.line(&outline(ball).collect::<Vec<_>>(), color(ball), 1)?;
        }
        frame.line(&contact.map(|[x, y]| (cm(x), cm(y))), INK, 2)?;
        frame.axes()
    }

    fn residuals<DB: DrawingBackend>(&self, canvas: &Canvas<DB>) -> Result<(), String> {
        let mut points = Vec::new();
        for (ball, samples) in self.used().iter().enumerate() {
            for sample in samples {
                let [x, y] = (self.place)(ball, sample.t);
                let time = (sample.t - self.time) / self.clock.1;
                points.push((ball, time, [1e3 * (sample.x - x), 1e3 * (sample.y - y)]));
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
            let frame = Frame::new(canvas, rect, title, &[], axes)?;
            let (low, high) = (frame.x.low, frame.x.high);
            frame.line(&[(low, 0.0), (high, 0.0)], INK, 1)?;
            frame.line(&[(0.0, frame.y.low), (0.0, frame.y.high)], GREY, 1)?;
            for (ball, time, residual) in &points {
                marker(canvas, frame.at(*time, residual[row]), *ball, 0.6)?;
            }
            frame.axes()?;
        }
        Ok(())
    }
}

fn summary(impact: &Impact) -> String {
    let v = |x: Quantity, y: Quantity| impact.values[x as usize].hypot(impact.values[y as usize]);
    format!(
        "cue ball {:.3} → {:.3} m/s, object ball {:.3} m/s, noise {:.3} mm, χ²/dof {:.2}, {} frames left out",
        v(Quantity::CueVxBefore, Quantity::CueVyBefore),
        v(Quantity::CueVxAfter, Quantity::CueVyAfter),
        v(Quantity::ObjVxAfter, Quantity::ObjVyAfter),
        1e3 * impact.position_sd,
        impact.reduced_chi2,
        impact.outliers,
    )
}
