//! accuracy.svg and accuracy.png: error against time, both on logarithmic scales.

use plotters::prelude::RGBColor;

use super::axis::Axis;
use super::frame::{Frame, Rect};
use super::picture::{GREY, INK, Picture, SMALL, width};
use super::{MARGIN, WIDTH};
use crate::report::accuracy::{self, Pick};
use crate::studies::accuracy::Row;

const HEIGHT: i32 = 640;
const HEAD: i32 = 112;

/// Errors below are roundings.
const LEAST: f64 = 1e-16;

/// One for each way, in the order of first appearance.
const COLORS: [RGBColor; 9] = [
    RGBColor(120, 120, 120),
    RGBColor(60, 60, 60),
    RGBColor(230, 159, 0),
    RGBColor(213, 94, 0),
    RGBColor(0, 114, 178),
    RGBColor(86, 180, 233),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(140, 86, 75),
];

/// A way's name, its colour, and its rows.
type Series<'a> = (String, RGBColor, Vec<&'a Row>);

fn series(rows: &[Row]) -> Vec<Series<'_>> {
    let mut all: Vec<Series> = Vec::new();
    for row in rows {
        let name = accuracy::name(row);
        match all.iter_mut().find(|(known, ..)| *known == name) {
            Some((.., own)) => own.push(row),
            None => all.push((name, COLORS[all.len() % COLORS.len()], vec![row])),
        }
    }
    all
}

/// Error against time, of every way.
#[must_use]
pub fn picture(rows: &[Row]) -> Picture {
    let mut picture = Picture::new("the accuracy", WIDTH as i32, HEIGHT);
    picture.title("Accuracy against time (ode and contact: at tolerances from 10⁻² down)", 34);
    let series = series(rows);
    let (mut x, mut y) = (MARGIN, 72);
    for (name, color, _) in &series {
        let wide = 20 + width(name, SMALL) + 28;
        if x + wide > WIDTH as i32 - MARGIN {
            (x, y) = (MARGIN, y + 26);
        }
        picture.circle((x + 6, y), 6, *color);
        picture.label(name, (x + 20, y), INK);
        x += wide;
    }
    let panels: [(&str, Pick); 2] = [
        ("Numerical error: against the same equations, solved closely", |row| row.numerical),
        ("Model error: against contact, integrated closely", |row| Some(row.model)),
    ];
    for (column, (title, pick)) in panels.into_iter().enumerate() {
        panel(&mut picture, Rect::of_row(HEAD, HEIGHT - HEAD, column, 2), title, &series, pick);
    }
    picture
}

fn panel(picture: &mut Picture, rect: Rect, title: &str, series: &[Series], pick: Pick) {
    /// Horizontal speeds.
    const SPEED: usize = 1;
    let point = |row: &Row| {
        let error = pick(row)?[SPEED].p95;
        error.is_finite().then(|| (row.seconds.log10(), error.max(LEAST).log10()))
    };
    let points = |own: &[&Row]| own.iter().filter_map(|row| point(row)).collect::<Vec<_>>();
    let all: Vec<_> = series.iter().flat_map(|(.., own)| points(own)).collect();
    let axes = (
        Axis::around("time of a collision", all.iter().map(|p| p.0)).in_words(time),
        Axis::around("error of a velocity over U (95 % of the shots)", all.iter().map(|p| p.1))
            .in_words(power_of_ten),
    );
    let mut frame = Frame::new(picture, rect, title, &[], axes);
    for (_, color, own) in series {
        let points = points(own);
        if points.len() > 1 {
            frame.line(&points, *color, 2);
        } else if let [(_, y)] = points[..] {
            // how far its accuracy reaches
            frame.horizontal(y, GREY);
        }
        for (x, y) in points {
            frame.dot(x, y, 6, *color);
        }
    }
    frame.axes();
}

/// 10^n seconds in ns, µs, ms; nothing in between.
fn time(log10: f64) -> String {
    let Some(n) = whole(log10) else { return String::new() };
    let (unit, power) = match n {
        ..-6 => ("ns", -9),
        -6..-3 => ("µs", -6),
        -3..0 => ("ms", -3),
        _ => ("s", 0),
    };
    format!("{} {unit}", 10_f64.powi(n - power))
}

fn power_of_ten(log10: f64) -> String {
    let Some(n) = whole(log10) else { return String::new() };
    let raised = |c: char| match c {
        '-' => '⁻',
        digit => ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'][digit as usize - '0' as usize],
    };
    format!("10{}", n.to_string().chars().map(raised).collect::<String>())
}

fn whole(x: f64) -> Option<i32> {
    ((x - x.round()).abs() < 1e-6).then_some(x.round() as i32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_name_their_decade() {
        assert_eq!(
            [-8.0, -7.0, -6.0, -4.0, -3.0, 0.0].map(time),
            ["10 ns", "100 ns", "1 µs", "100 µs", "1 ms", "1 s"]
        );
        assert_eq!([0.0, -1.0, -12.0, -6.5].map(power_of_ten), ["10⁰", "10⁻¹", "10⁻¹²", ""]);
    }
}
