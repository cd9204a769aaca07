//! The marker of each observable, and the legend. Colours are Okabe and Ito's, which can be told apart
//! by colour-blind readers; shapes differ, too.

use plotters::prelude::*;

use super::canvas;
use super::canvas::{Anchor, Canvas, INK, Pixel, SMALL};
use super::points::Points;

const COLORS: [RGBColor; 7] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(0, 0, 0),
    RGBColor(86, 180, 233),
    RGBColor(230, 159, 0),
];

#[derive(Clone, Copy)]
enum Shape {
    Circle,
    Square,
    Triangle,
    Diamond,
    TriangleDown,
    Cross,
}

/// Not as many as there are colours, so that their pairs are all different for 42 observables.
const SHAPES: [Shape; 6] =
    [Shape::Circle, Shape::Square, Shape::Triangle, Shape::Diamond, Shape::TriangleDown, Shape::Cross];

pub(super) fn color(series: usize) -> RGBColor {
    COLORS[series % COLORS.len()]
}

/// Draws the marker of the `series`-th observable.
pub(super) fn marker<DB: DrawingBackend>(
    canvas: &Canvas<DB>,
    (x, y): Pixel,
    series: usize,
    opacity: f64,
) -> Result<(), String> {
    let color = color(series).mix(opacity);
    match SHAPES[series % SHAPES.len()] {
        Shape::Circle => canvas.circle((x, y), 5, color),
        Shape::Square => canvas.rectangle([(x - 4, y - 4), (x + 4, y + 4)], color),
        Shape::Triangle => canvas.polygon(vec![(x - 6, y + 4), (x + 6, y + 4), (x, y - 6)], color),
        Shape::TriangleDown => canvas.polygon(vec![(x - 6, y - 4), (x + 6, y - 4), (x, y + 6)], color),
        Shape::Diamond => canvas.polygon(vec![(x - 6, y), (x, y + 6), (x + 6, y), (x, y - 6)], color),
        Shape::Cross => {
            canvas.line(vec![(x - 4, y - 4), (x + 4, y + 4)], color, 2)?;
            canvas.line(vec![(x - 4, y + 4), (x + 4, y - 4)], color, 2)
        }
    }
}

/// Height of a row of the legend, pixels.
const ROW: i32 = 26;

/// The names of the observables beside their markers, in rows.
pub(super) struct Legend {
    /// Text, pixels from the left, row.
    entries: Vec<(String, i32, i32)>,
    rows: i32,
}

impl Legend {
    pub(super) fn new(points: &Points, width: i32) -> Self {
        let (mut entries, mut x, mut row) = (Vec::new(), 0, 0);
        for (observable, count) in points.observables.iter().zip(points.counts()) {
            let text = format!("{} ({count})", observable.label());
            let entry = 22 + canvas::width(&text, SMALL);
            if x > 0 && x + entry > width {
                x = 0;
                row += 1;
            }
            entries.push((text, x, row));
            x += entry + 28;
        }
        let rows = if entries.is_empty() { 0 } else { row + 1 };
        Self { entries, rows }
    }

    /// In pixels.
    pub(super) fn height(&self) -> i32 {
        ROW * self.rows
    }

    pub(super) fn draw<DB: DrawingBackend>(
        &self,
        canvas: &Canvas<DB>,
        (left, top): Pixel,
    ) -> Result<(), String> {
        for (series, (text, x, row)) in self.entries.iter().enumerate() {
            let (x, y) = (left + x, top + ROW * row + ROW / 2);
            marker(canvas, (x + 8, y), series, 0.9)?;
            canvas.text(text, (x + 22, y), Anchor::Left, SMALL, INK)?;
        }
        Ok(())
    }
}
