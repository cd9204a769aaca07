//! One panel: title, remarks, axes, and where a point of the data is on the picture.

use plotters::prelude::*;

use super::axis::Axis;
use super::canvas::{Anchor, Canvas, GREY, GRID, INK, MEDIUM, Pixel, SMALL, shortened, width, wrapped};

/// Height of a line of small text, pixels.
const LINE: i32 = 24;

/// Part of the picture, in pixels.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rect {
    pub(super) left: i32,
    pub(super) top: i32,
    pub(super) right: i32,
    pub(super) bottom: i32,
}

/// A panel whose axes stand.
pub(super) struct Frame<'c, 'a, DB: DrawingBackend> {
    pub(super) canvas: &'c Canvas<'a, DB>,
    pub(super) x: Axis,
    pub(super) y: Axis,
    area: Rect,
    plot: Rect,
    x_ticks: Vec<(f64, String)>,
    y_ticks: Vec<(f64, String)>,
}

impl<'c, 'a, DB: DrawingBackend> Frame<'c, 'a, DB> {
    /// Writes title and remarks, and makes room for the axes; what lies behind the data is drawn
    /// before [`Frame::axes`].
    pub(super) fn new(
        canvas: &'c Canvas<'a, DB>,
        area: Rect,
        title: &str,
        remarks: &[String],
        (x, y): (Axis, Axis),
    ) -> Result<Self, String> {
        let top = head(canvas, area, title, remarks)?;
        let bottom = area.bottom - 62;
        let y_ticks = y.ticks(usize::try_from((bottom - top) / 50).unwrap_or(2).clamp(3, 8));
        let widest =
            |ticks: &[(f64, String)]| ticks.iter().map(|(_, label)| width(label, SMALL)).max().unwrap_or(0);
        let plot = Rect { left: area.left + 30 + widest(&y_ticks) + 12, top, right: area.right - 26, bottom };
        let length = plot.right - plot.left;
        let fits = |ticks: &Vec<(f64, String)>| (widest(ticks) + 16) * ticks.len() as i32 <= length;
        let x_ticks = (3..=9).rev().map(|count| x.ticks(count)).find(fits).unwrap_or_else(|| x.ticks(2));
        let frame = Self { canvas, x, y, area, plot, x_ticks, y_ticks };
        frame.grid()?;
        Ok(frame)
    }

    /// Without numbers on the axis upwards: the caller writes there.
    pub(super) fn unlabelled(
        canvas: &'c Canvas<'a, DB>,
        area: Rect,
        title: &str,
        remarks: &[String],
        axes: (Axis, Axis),
    ) -> Result<Self, String> {
        let top = head(canvas, area, title, remarks)?;
        let (x, y) = axes;
        let plot = Rect { left: area.left + 30, top, right: area.right - 26, bottom: area.bottom - 62 };
        let x_ticks = x.ticks(7);
        let frame = Self { canvas, x, y, area, plot, x_ticks, y_ticks: Vec::new() };
        frame.grid()?;
        Ok(frame)
    }

    /// Where a point of the data is; at the edge, if it is beyond.
    pub(super) fn at(&self, x: f64, y: f64) -> Pixel {
        let Rect { left, top, right, bottom } = self.plot;
        let along = |from: i32, to: i32, part: f64| from + whole(part * f64::from(to - from));
        (along(left, right, self.x.position(x)), along(bottom, top, self.y.position(y)))
    }

    /// A straight line through data points, clipped to the panel by the caller.
    pub(super) fn line(&self, points: &[(f64, f64)], color: RGBColor, width: u32) -> Result<(), String> {
        let pixels = points.iter().map(|(x, y)| self.at(*x, *y)).collect();
        self.canvas.line(pixels, color.to_rgba(), width)
    }

    fn grid(&self) -> Result<(), String> {
        for (x, _) in &self.x_ticks {
            self.line(&[(*x, self.y.low), (*x, self.y.high)], GRID, 1)?;
        }
        for (y, _) in &self.y_ticks {
            self.line(&[(self.x.low, *y), (self.x.high, *y)], GRID, 1)?;
        }
        Ok(())
    }

    /// Draws border, ticks, their labels and the axes' names.
    pub(super) fn axes(&self) -> Result<(), String> {
        let Rect { left, top, right, bottom } = self.plot;
        border(self.canvas, self.plot)?;
        for (x, label) in &self.x_ticks {
            let (x, _) = self.at(*x, self.y.low);
            self.canvas.line(vec![(x, bottom), (x, bottom + 5)], INK.to_rgba(), 1)?;
            self.canvas.text(label, (x, bottom + 17), Anchor::Centre, SMALL, INK)?;
        }
        for (y, label) in &self.y_ticks {
            let (_, y) = self.at(self.x.low, *y);
            self.canvas.line(vec![(left - 5, y), (left, y)], INK.to_rgba(), 1)?;
            self.canvas.text(label, (left - 9, y), Anchor::Right, SMALL, INK)?;
        }
        // Names longer than their axis may use the whole panel.
        let area = self.area;
        let name = shortened(&self.x.name, SMALL, area.right - area.left - 8);
        let middle = centred((left + right) / 2, width(&name, SMALL), (area.left, area.right));
        self.canvas.text(&name, (middle, bottom + 43), Anchor::Centre, SMALL, INK)?;
        let name = shortened(&self.y.name, SMALL, area.bottom - area.top - 30);
        let middle = centred((top + bottom) / 2, width(&name, SMALL), (area.top, area.bottom));
        self.canvas.text(&name, (area.left + 13, middle), Anchor::Upwards, SMALL, INK)
    }
}

/// The nearest pixel. What is half-way but for a rounding goes up, on every machine.
fn whole(pixels: f64) -> i32 {
    const ROUNDING: f64 = 1e-6;
    (pixels + ROUNDING).round() as i32
}

/// The place nearest to `wish` where something `length` long does not stick out.
fn centred(wish: i32, length: i32, (low, high): (i32, i32)) -> i32 {
    let half = length / 2 + 4;
    wish.min(high - half).max(low + half)
}

/// A panel that says in words why there is nothing in it.
pub(super) fn message<DB: DrawingBackend>(
    canvas: &Canvas<DB>,
    area: Rect,
    title: &str,
    text: &str,
) -> Result<(), String> {
    let top = head(canvas, area, title, &[])?;
    let plot = Rect { left: area.left + 40, top, right: area.right - 26, bottom: area.bottom - 62 };
    border(canvas, plot)?;
    let lines = wrapped(text, SMALL, plot.right - plot.left - 40);
    let first = (plot.top + plot.bottom - LINE * (lines.len() as i32 - 1)) / 2;
    for (line, y) in lines.iter().zip((first..).step_by(LINE as usize)) {
        canvas.text(line, ((plot.left + plot.right) / 2, y), Anchor::Centre, SMALL, GREY)?;
    }
    Ok(())
}

/// Title and remarks; returns where they end.
fn head<DB: DrawingBackend>(
    canvas: &Canvas<DB>,
    area: Rect,
    title: &str,
    remarks: &[String],
) -> Result<i32, String> {
    let middle = (area.left + area.right) / 2;
    let mut y = area.top + 14;
    canvas.text(title, (middle, y), Anchor::Centre, MEDIUM, INK)?;
    y += LINE + 1;
    for line in wrapped(&remarks.join("; "), SMALL, area.right - area.left - 20) {
        canvas.text(&line, (middle, y), Anchor::Centre, SMALL, GREY)?;
        y += LINE;
    }
    Ok(y - LINE / 2 + 4)
}

fn border<DB: DrawingBackend>(canvas: &Canvas<DB>, plot: Rect) -> Result<(), String> {
    let Rect { left, top, right, bottom } = plot;
    let corners = vec![(left, top), (right, top), (right, bottom), (left, bottom), (left, top)];
    canvas.line(corners, INK.to_rgba(), 1)
}
