//! One panel: title, remarks, axes, and where a point of the data is on the picture.

use plotters::prelude::*;

use super::WIDTH;
use super::axis::Axis;
use super::picture::{
    Anchor, BAND, GREY, GRID, INK, MEDIUM, Picture, Pixel, SMALL, shortened, width, wrapped,
};
use super::series;

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

impl Rect {
    /// One of `columns` panels side by side, of this height with what separates it from the next row.
    pub(super) fn of_row(top: i32, height: i32, column: usize, columns: usize) -> Self {
        let left = |column: usize| 6 + (WIDTH as i32 - 12) * column as i32 / columns as i32;
        Self { left: left(column), top, right: left(column + 1), bottom: top + height - 8 }
    }
}

/// A panel whose axes stand.
pub(super) struct Frame<'a> {
    pub(super) picture: &'a mut Picture,
    pub(super) x: Axis,
    pub(super) y: Axis,
    area: Rect,
    plot: Rect,
    x_ticks: Vec<(f64, String)>,
    y_ticks: Vec<(f64, String)>,
}

impl<'a> Frame<'a> {
    /// Writes title and remarks, and makes room for the axes; what lies behind the data is drawn
    /// before [`Frame::axes`].
    pub(super) fn new(
        picture: &'a mut Picture,
        area: Rect,
        title: &str,
        remarks: &[String],
        (x, y): (Axis, Axis),
    ) -> Self {
        let top = head(picture, area, title, remarks);
        let bottom = area.bottom - 62;
        let y_ticks = y.ticks(usize::try_from((bottom - top) / 50).unwrap_or(2).clamp(3, 8));
        let widest =
            |ticks: &[(f64, String)]| ticks.iter().map(|(_, label)| width(label, SMALL)).max().unwrap_or(0);
        let plot = Rect { left: area.left + 30 + widest(&y_ticks) + 12, top, right: area.right - 26, bottom };
        let length = plot.right - plot.left;
        let fits = |ticks: &Vec<(f64, String)>| (widest(ticks) + 16) * ticks.len() as i32 <= length;
        let x_ticks = (3..=9).rev().map(|count| x.ticks(count)).find(fits).unwrap_or_else(|| x.ticks(2));
        Self { picture, x, y, area, plot, x_ticks, y_ticks }.with_grid()
    }

    /// Without numbers on the axis upwards: the caller writes there.
    pub(super) fn unlabelled(
        picture: &'a mut Picture,
        area: Rect,
        title: &str,
        remarks: &[String],
        (x, y): (Axis, Axis),
    ) -> Self {
        let top = head(picture, area, title, remarks);
        let plot = Rect { left: area.left + 30, top, right: area.right - 26, bottom: area.bottom - 62 };
        let x_ticks = x.ticks(7);
        Self { picture, x, y, area, plot, x_ticks, y_ticks: Vec::new() }.with_grid()
    }

    fn with_grid(mut self) -> Self {
        for (x, _) in self.x_ticks.clone() {
            self.vertical(x, GRID);
        }
        for (y, _) in self.y_ticks.clone() {
            self.horizontal(y, GRID);
        }
        self
    }

    /// Where a point of the data is; at the edge, if it is beyond.
    pub(super) fn at(&self, x: f64, y: f64) -> Pixel {
        let Rect { left, top, right, bottom } = self.plot;
        let along = |from: i32, to: i32, part: f64| from + whole(part * f64::from(to - from));
        (along(left, right, self.x.position(x)), along(bottom, top, self.y.position(y)))
    }

    /// A straight line through data points, clipped to the panel by the caller.
    pub(super) fn line(&mut self, points: &[(f64, f64)], color: impl Into<RGBAColor>, width: u32) {
        let pixels = points.iter().map(|(x, y)| self.at(*x, *y)).collect();
        self.picture.line(pixels, color, width);
    }

    /// A thin line from the bottom to the top.
    pub(super) fn vertical(&mut self, x: f64, color: RGBColor) {
        self.line(&[(x, self.y.low), (x, self.y.high)], color, 1);
    }

    /// A thin line from the left to the right.
    pub(super) fn horizontal(&mut self, y: f64, color: RGBColor) {
        self.line(&[(self.x.low, y), (self.x.high, y)], color, 1);
    }

    /// An area by its outline.
    pub(super) fn polygon(
        &mut self,
        outline: impl IntoIterator<Item = (f64, f64)>,
        color: impl Into<RGBAColor>,
    ) {
        let pixels = outline.into_iter().map(|(x, y)| self.at(x, y)).collect();
        self.picture.polygon(pixels, color);
    }

    /// Where standardized residuals should be, two standard deviations to either side.
    pub(super) fn two_sd(&mut self) {
        let corners = [self.at(self.x.low, -2.0), self.at(self.x.high, 2.0)];
        self.picture.rectangle(corners, BAND.mix(0.8));
    }

    /// A dot of this radius.
    pub(super) fn dot(&mut self, x: f64, y: f64, radius: i32, color: RGBColor) {
        self.picture.circle(self.at(x, y), radius, color);
    }

    /// The marker of a series.
    pub(super) fn marker(&mut self, (x, y): (f64, f64), series: usize, opacity: f64) {
        series::marker(self.picture, self.at(x, y), series, opacity);
    }

    /// The same of a residual, which the picture remembers.
    pub(super) fn spot(&mut self, place: (f64, f64), index: usize, series: usize, opacity: f64) {
        self.marker(place, series, opacity);
        let (x, y) = self.at(place.0, place.1);
        self.picture.spots.push((x, y, index));
    }

    /// Draws border, ticks, their labels and the axes' names.
    pub(super) fn axes(self) {
        let Rect { left, top, right, bottom } = self.plot;
        border(self.picture, self.plot);
        for (x, label) in &self.x_ticks {
            let (x, _) = self.at(*x, self.y.low);
            self.picture.line(vec![(x, bottom), (x, bottom + 5)], INK, 1);
            self.picture.text(label, (x, bottom + 17), Anchor::Centre, SMALL, INK);
        }
        for (y, label) in &self.y_ticks {
            let (_, y) = self.at(self.x.low, *y);
            self.picture.line(vec![(left - 5, y), (left, y)], INK, 1);
            self.picture.text(label, (left - 9, y), Anchor::Right, SMALL, INK);
        }
        // Names longer than their axis may use the whole panel.
        let area = self.area;
        let name = shortened(&self.x.name, SMALL, area.right - area.left - 8);
        let middle = centred((left + right) / 2, width(&name, SMALL), (area.left, area.right));
        self.picture.text(&name, (middle, bottom + 43), Anchor::Centre, SMALL, INK);
        let name = shortened(&self.y.name, SMALL, area.bottom - area.top - 30);
        let middle = centred((top + bottom) / 2, width(&name, SMALL), (area.top, area.bottom));
        self.picture.text(&name, (area.left + 13, middle), Anchor::Upwards, SMALL, INK);
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
pub(super) fn message(picture: &mut Picture, area: Rect, title: &str, text: &str) {
    let top = head(picture, area, title, &[]);
    let plot = Rect { left: area.left + 40, top, right: area.right - 26, bottom: area.bottom - 62 };
    border(picture, plot);
    let lines = wrapped(text, SMALL, plot.right - plot.left - 40);
    let first = (plot.top + plot.bottom - LINE * (lines.len() as i32 - 1)) / 2;
    for (line, y) in lines.iter().zip((first..).step_by(LINE as usize)) {
        picture.text(line, ((plot.left + plot.right) / 2, y), Anchor::Centre, SMALL, GREY);
    }
}

/// Title and remarks; returns where they end.
fn head(picture: &mut Picture, area: Rect, title: &str, remarks: &[String]) -> i32 {
    let middle = (area.left + area.right) / 2;
    let mut y = area.top + 14;
    picture.text(title, (middle, y), Anchor::Centre, MEDIUM, INK);
    y += LINE + 1;
    for line in wrapped(&remarks.join("; "), SMALL, area.right - area.left - 20) {
        picture.text(&line, (middle, y), Anchor::Centre, SMALL, GREY);
        y += LINE;
    }
    y - LINE / 2 + 4
}

fn border(picture: &mut Picture, plot: Rect) {
    let Rect { left, top, right, bottom } = plot;
    picture.line(vec![(left, top), (right, top), (right, bottom), (left, bottom), (left, top)], INK, 1);
}
