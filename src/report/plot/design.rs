//! design.svg and design.png: standard errors against the cut angle, one row of panels for each parameter, one
//! column for each speed.

use plotters::prelude::*;

use super::axis::Axis;
use super::canvas::{Anchor, Canvas, GREY, INK, LARGE, SMALL, width};
use super::drawing::Area;
use super::frame::{Frame, Rect, message};
use super::series::{color, marker};
use super::{MARGIN, WIDTH, drawing};
use crate::design::{Cell, Design};
use crate::measurement::parameter::Parameter;
use crate::report::ReportError;
use crate::report::number::plain;

/// Height of a row of panels and of a line of the legend, pixels.
const PANEL: i32 = 380;
const LINE: i32 = 26;
const HEAD: i32 = 88;

/// Standard errors this many times the least of a parameter tell nothing worth drawing.
const WORST: f64 = 1e3;

/// Kinds of shots stand beside each other by this part of the axis.
const ASIDE: f64 = 0.025;

/// At most so many speeds are drawn.
const COLUMNS: usize = 3;

/// design.svg as text.
///
/// # Errors
/// The drawing library gave up.
pub fn svg(design: &Design) -> Result<String, ReportError> {
    let layout = Layout::of(design).map_err(failed)?;
    drawing::svg(layout.size(), |area| layout.draw(area)).map(|(text, ())| text).map_err(failed)
}

/// design.png as bytes.
///
/// # Errors
/// As [`svg`].
pub fn png(design: &Design) -> Result<Vec<u8>, ReportError> {
    let layout = Layout::of(design).map_err(failed)?;
    drawing::png(layout.size(), |area| layout.draw(area)).map_err(failed)
}

fn failed(reason: String) -> ReportError {
    ReportError::Draw { dataset: "the design".to_owned(), reason }
}

struct Layout<'a> {
    design: &'a Design,
    /// Speeds of the columns, and of each kind the speed that stands in each.
    columns: usize,
    speeds: Vec<Vec<f64>>,
    /// Parameters that some cell tells.
    rows: Vec<Parameter>,
    /// Name, pixels from the left, line of each kind in the legend.
    legend: Vec<(String, i32, i32)>,
}

impl<'a> Layout<'a> {
    fn of(design: &'a Design) -> Result<Self, String> {
        super::canvas::register()?;
        let speeds: Vec<Vec<f64>> = (0..design.expected.kinds.len())
            .map(|kind| {
                let own = design.cells.iter().filter(|cell| cell.kind == kind);
                let mut speeds: Vec<f64> = own.map(|cell| cell.speed_m_s).collect();
                speeds.dedup();
                speeds
            })
            .collect();
        let told = |p: &Parameter| design.cells.iter().any(|cell| cell.std_errors[*p as usize].is_some());
        let (mut legend, mut x, mut line) = (Vec::new(), 0, 0);
        for kind in &design.expected.kinds {
            let text = format!("{} ({} shots)", kind.name, kind.shots);
            let text = super::canvas::shortened(&text, SMALL, WIDTH as i32 / 2);
            let wide = 22 + width(&text, SMALL) + 28;
            if x > 0 && x + wide > WIDTH as i32 - 2 * MARGIN {
                (x, line) = (0, line + 1);
            }
            legend.push((text, x, line));
            x += wide;
        }
        Ok(Self {
            design,
            columns: speeds.iter().map(Vec::len).max().unwrap_or(1).clamp(1, COLUMNS),
            speeds,
            rows: Parameter::COEFFICIENTS.into_iter().filter(told).collect(),
            legend,
        })
    }

    fn head(&self) -> i32 {
        HEAD + LINE * (self.legend.last().map_or(0, |(.., line)| line + 1)) + 6
    }

    fn size(&self) -> (u32, u32) {
        let height = self.head() + PANEL * self.rows.len().max(1) as i32;
        (WIDTH, u32::try_from(height).unwrap_or(WIDTH))
    }

    fn draw<DB: DrawingBackend>(&self, area: &Area<DB>) -> Result<(), String> {
        let canvas = Canvas::new(area)?;
        let title = "Standard errors that shots of one cut angle and speed give";
        canvas.text(title, (MARGIN, 34), Anchor::Left, LARGE, INK)?;
        let remark = "Without a point: such shots by themselves do not tell it. Kinds stand a little side by side, so that equal errors are seen.";
        canvas.text(remark, (MARGIN, 66), Anchor::Left, SMALL, GREY)?;
        for (kind, (text, x, line)) in self.legend.iter().enumerate() {
            let (x, y) = (MARGIN + x, HEAD + 8 + LINE * line);
            marker(&canvas, (x + 8, y), kind, 1.0)?;
            canvas.text(text, (x + 22, y), Anchor::Left, SMALL, INK)?;
        }
        let left = |column: usize| 6 + (WIDTH as i32 - 12) * column as i32 / self.columns as i32;
        for (row, parameter) in self.rows.iter().enumerate() {
            let top = self.head() + PANEL * row as i32;
            for column in 0..self.columns {
                let rect = Rect { left: left(column), top, right: left(column + 1), bottom: top + PANEL - 8 };
                self.panel(&canvas, rect, *parameter, column)?;
            }
        }
        if self.rows.is_empty() {
            let rect =
                Rect { left: 6, top: self.head(), right: WIDTH as i32 - 6, bottom: self.head() + PANEL - 8 };
            message(
                &canvas,
                rect,
                "Nothing to draw",
                "No shot at a single cut angle and speed tells a parameter by itself.",
            )?;
        }
        Ok(())
    }

    /// Standard errors of a parameter that are worth drawing.
    fn told(&self, parameter: Parameter) -> impl Fn(&Cell) -> Option<f64> {
        let all = || self.design.cells.iter().filter_map(|cell| cell.std_errors[parameter as usize]);
        let most = WORST * all().fold(f64::INFINITY, f64::min);
        move |cell: &Cell| cell.std_errors[parameter as usize].filter(|error| *error > 0.0 && *error <= most)
    }

    fn panel<DB: DrawingBackend>(
        &self,
        canvas: &Canvas<DB>,
        rect: Rect,
        parameter: Parameter,
        column: usize,
    ) -> Result<(), String> {
        let cells = &self.design.cells;
        let told = self.told(parameter);
        let speed = |kind: usize| self.speeds[kind].get(column).copied();
        let mut names: Vec<f64> = (0..self.speeds.len()).filter_map(speed).collect();
        names.sort_by(f64::total_cmp);
        names.dedup();
        let title = match names[..] {
            [] => String::new(),
            [one] => format!("{}, {} m/s", parameter.symbol(), plain(one, 3)),
            [least, .., most] => {
                format!("{}, {} to {} m/s", parameter.symbol(), plain(least, 3), plain(most, 3))
            }
        };
        let x = Axis::around("cut angle φ (°)", cells.iter().map(|cell| cell.cut_deg));
        let errors = cells.iter().filter_map(&told);
        let y = Axis::logarithmic(format!("standard error of {}", parameter.symbol()), errors);
        let frame = Frame::new(canvas, rect, &title, &[], (x, y))?;
        // equal errors of several kinds would hide each other: they stand side by side
        let kinds = self.speeds.len();
        let aside =
            |kind: usize| (kind as f64 - 0.5 * (kinds as f64 - 1.0)) * ASIDE * (frame.x.high - frame.x.low);
        for kind in 0..kinds {
            let own = |cell: &&Cell| cell.kind == kind && Some(cell.speed_m_s) == speed(kind);
            let points: Vec<Option<(f64, f64)>> = cells
                .iter()
                .filter(own)
                .map(|cell| told(cell).map(|error| (cell.cut_deg + aside(kind), error.log10())))
                .collect();
            // a gap where it is not told
            for pair in points.windows(2) {
                if let [Some(a), Some(b)] = pair {
                    frame.line(&[*a, *b], color(kind), 2)?;
                }
            }
            for (x, y) in points.into_iter().flatten() {
                marker(canvas, frame.at(x, y), kind, 1.0)?;
            }
        }
        frame.axes()
    }
}
