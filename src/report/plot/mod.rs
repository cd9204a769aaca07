//! Figures: what each shows is data ([`Figure`], [`Panel`], [`Mark`]), which one renderer draws as
//! SVG and as PNG with a font of its own.

mod axis;
mod films;
mod others;
mod render;
mod residuals;

use plotters::prelude::*;
use serde::{Serialize, Serializer};
use serde_json::json;

use super::templates::for_script;
pub(super) use axis::ends;
use axis::{Axis, Scale};
pub(super) use films::{Tracks, all_shots, of_balls};
pub(super) use others::{accuracy, contours, design, discs, forest};
pub(super) use residuals::{of_comparison, residuals};

/// Width of a figure, pixels.
const WIDTH: u32 = 1200;

/// Name of an axis that several figures have.
const CUT_AXIS: &str = "cut angle φ (°)";

/// Colours of axes and texts, of what is less important, of areas behind the data, and of warnings.
const INK: RGBColor = RGBColor(20, 20, 20);
const GREY: RGBColor = RGBColor(85, 85, 85);
const BAND: RGBColor = RGBColor(228, 233, 240);
const ALARM: RGBColor = RGBColor(176, 0, 32);

/// Colours of series, which colour-blind readers can distinguish (Okabe and Ito 2008).
const COLORS: [RGBColor; 7] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(0, 0, 0),
    RGBColor(86, 180, 233),
    RGBColor(230, 159, 0),
];

fn color(series: usize) -> RGBColor {
    COLORS[series % COLORS.len()]
}

/// A figure: rows of panels below a title, with their heights in pixels.
#[derive(Default)]
pub(super) struct Figure {
    title: String,
    /// Lines below the title, with their colours.
    lines: Vec<(String, RGBColor)>,
    /// The name of each series.
    series: Vec<String>,
    /// The meaning of the points.
    labels: Vec<Label>,
    pub(super) rows: Vec<(u32, Vec<Panel>)>,
}

impl Figure {
    fn new(title: impl Into<String>) -> Self {
        Self { title: title.into(), ..Self::default() }
    }

    /// Adds a line below the title.
    fn say(&mut self, line: impl Into<String>) {
        self.lines.push((line.into(), GREY));
    }

    /// Adds panels in evenly filled rows of limited length.
    fn add_rows(&mut self, height: u32, most: usize, panels: Vec<Panel>) {
        let rows = panels.len().div_ceil(most).max(1);
        let each = panels.len().div_ceil(rows).max(1);
        self.rows.extend(panels.chunks(each).map(|row| (height, row.to_vec())));
    }
}

/// As SVG, with its measured points as JSON; as null without panels.
impl Serialize for Figure {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        if self.rows.is_empty() {
            return serializer.serialize_none();
        }
        let (svg, spots) = self.svg().map_err(serde::ser::Error::custom)?;
        let spots =
            (!spots.is_empty()).then(|| for_script(&json!({ "spots": spots, "labels": self.labels })));
        json!({ "svg": svg, "spots": spots }).serialize(serializer)
    }
}

/// The meaning of a measured point: its shot, and the quantity with its residual.
#[derive(Clone, Serialize)]
struct Label {
    shot: String,
    words: String,
}

/// A panel: marks in one coordinate system, the first behind all others. The axes reach beyond all
/// that are finite; infinite ones end at the frame.
#[derive(Clone)]
pub(super) struct Panel {
    title: String,
    /// The meaning of its marks, below the title.
    about: String,
    x: Axis,
    y: Axis,
    /// Whether a unit is as long along either axis.
    is_square: bool,
    marks: Vec<Mark>,
}

impl Panel {
    fn new(title: impl Into<String>, about: impl Into<String>, x: Axis, y: Axis) -> Self {
        Self { title: title.into(), about: about.into(), x, y, is_square: false, marks: Vec::new() }
    }

    fn line(&mut self, points: impl IntoIterator<Item = [f64; 2]>, color: RGBColor, width: u32) {
        self.marks.push(Mark::Path(points.into_iter().collect(), color.stroke_width(width)));
    }

    /// Adds a thin line across the panel at a value of y.
    fn horizontal(&mut self, y: f64) {
        self.line([[f64::NEG_INFINITY, y], [f64::INFINITY, y]], INK, 1);
    }

    fn points(&mut self, points: impl IntoIterator<Item = Point>) {
        self.marks.push(Mark::Points(points.into_iter().collect()));
    }

    /// Adds points of a series with lines between.
    fn curve(&mut self, places: &[[f64; 2]], series: usize) {
        self.line(places.iter().copied(), color(series), 2);
        self.points(places.iter().map(|at| Point::new(*at, series)));
    }

    fn area(&mut self, outline: impl IntoIterator<Item = [f64; 2]>, color: RGBColor) {
        self.marks.push(Mark::Path(outline.into_iter().collect(), color.filled()));
    }

    /// Adds an area between two values of x and two of y.
    fn rectangle(&mut self, [left, right]: [f64; 2], [low, high]: [f64; 2], color: RGBColor) {
        self.area([[left, low], [right, low], [right, high], [left, high]], color);
    }
}

/// A mark in a panel, in the units of its axes.
#[derive(Clone)]
enum Mark {
    Points(Vec<Point>),
    /// A line, or the outline of a filled area.
    Path(Vec<[f64; 2]>, ShapeStyle),
}

/// A measured point.
#[derive(Clone, Copy)]
struct Point {
    at: [f64; 2],
    /// Its standard deviation along y, drawn as a bar.
    sd: Option<f64>,
    /// Its series, which gives colour and shape.
    series: usize,
    /// 0 to 1.
    opacity: f64,
    /// The index of its label in the figure.
    label: Option<usize>,
}

impl Point {
    fn new(at: [f64; 2], series: usize) -> Self {
        Self { at, sd: None, series, opacity: 1.0, label: None }
    }

    /// Returns the ends of its bar; its own place without one.
    fn bar(&self) -> [[f64; 2]; 2] {
        let sd = self.sd.filter(|sd| axis::is_drawable(*sd)).unwrap_or(0.0);
        [-sd, sd].map(|end| [self.at[0], self.at[1] + end])
    }
}
