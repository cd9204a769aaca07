//! The marker of each observable, and legends. Colours are Okabe and Ito's, which can be told apart
//! by colour-blind readers; shapes differ, too.

use plotters::prelude::*;

use super::picture::{INK, Picture, Pixel, SMALL, width};

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
pub(super) fn marker(picture: &mut Picture, (x, y): Pixel, series: usize, opacity: f64) {
    let color = color(series).mix(opacity);
    match SHAPES[series % SHAPES.len()] {
        Shape::Circle => picture.circle((x, y), 5, color),
        Shape::Square => picture.rectangle([(x - 4, y - 4), (x + 4, y + 4)], color),
        Shape::Triangle => picture.polygon(vec![(x - 6, y + 4), (x + 6, y + 4), (x, y - 6)], color),
        Shape::TriangleDown => picture.polygon(vec![(x - 6, y - 4), (x + 6, y - 4), (x, y + 6)], color),
        Shape::Diamond => picture.polygon(vec![(x - 6, y), (x, y + 6), (x + 6, y), (x, y - 6)], color),
        Shape::Cross => {
            picture.line(vec![(x - 4, y - 4), (x + 4, y + 4)], color, 2);
            picture.line(vec![(x - 4, y + 4), (x + 4, y - 4)], color, 2);
        }
    }
}

/// Height of a row of a legend, pixels.
pub(super) const ROW: i32 = 26;

/// Names with room for a marker before each, in rows.
pub(super) struct Legend {
    /// Text, pixels from the left, row.
    entries: Vec<(String, i32, i32)>,
}

impl Legend {
    /// Rows no wider than `limit` pixels.
    pub(super) fn new(texts: impl IntoIterator<Item = String>, limit: i32) -> Self {
        let (mut entries, mut x, mut row) = (Vec::new(), 0, 0);
        for text in texts {
            let entry = 22 + width(&text, SMALL);
            if x > 0 && x + entry > limit {
                (x, row) = (0, row + 1);
            }
            entries.push((text, x, row));
            x += entry + 28;
        }
        Self { entries }
    }

    /// In pixels.
    pub(super) fn height(&self) -> i32 {
        self.entries.last().map_or(0, |(.., row)| ROW * (row + 1))
    }

    pub(super) fn draw(&self, picture: &mut Picture, (left, top): Pixel, opacity: f64) {
        for (series, (text, x, row)) in self.entries.iter().enumerate() {
            let (x, y) = (left + x, top + ROW * row + ROW / 2);
            marker(picture, (x + 8, y), series, opacity);
            picture.label(text, (x + 22, y), INK);
        }
    }
}

/// The names of both balls beside their markers, at these places from the left.
pub(super) fn two_balls(picture: &mut Picture, names: [&str; 2], left: [i32; 2]) {
    for (ball, (name, x)) in names.into_iter().zip(left).enumerate() {
        marker(picture, (x, 32), ball, 1.0);
        picture.label(name, (x + 14, 32), INK);
    }
}
