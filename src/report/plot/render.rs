//! Draws a [`Figure`] as SVG or as PNG.

use std::fmt::Display;
use std::ops::Range;

use plotters::coord::Shift;
use plotters::coord::ranged1d::{DefaultFormatting, KeyPointHint};
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::axis::is_drawable;
use super::text::{LARGE, MEDIUM, SMALL, has_font, shortened, style, width, wrapped};
use super::{ALARM, BAND, Figure, GREY, INK, Mark, Panel, Point, WIDTH, color};
use crate::report::ReportError;

/// Free space at the edges, and height of a line of text, pixels.
const MARGIN: i32 = 22;
const LINE: i32 = 26;

/// Colour of the grid.
const GRID: RGBColor = RGBColor(226, 226, 226);

/// Where a measured point is in a picture: pixels from the left and from the top, and the index of its label.
#[derive(Clone, Copy, Debug, serde::Serialize)]
pub struct Spot(i32, i32, usize);

impl Figure {
    /// Returns the figure as SVG text.
    ///
    /// # Errors
    /// The drawing library gave up.
    pub fn svg(&self) -> Result<String, ReportError> {
        Ok(self.svg_with_spots()?.0)
    }

    /// Returns the figure as SVG text, with the places of the measured points.
    ///
    /// # Errors
    /// The drawing library gave up.
    pub fn svg_with_spots(&self) -> Result<(String, Vec<Spot>), ReportError> {
        let mut text = String::new();
        let size = (WIDTH, self.height());
        let spots = self.draw(&SVGBackend::with_string(&mut text, size).into_drawing_area())?;
        Ok((text, spots))
    }

    /// Returns the figure as PNG bytes.
    ///
    /// # Errors
    /// The drawing library or the encoder gave up.
    pub fn png(&self) -> Result<Vec<u8>, ReportError> {
        let size = (WIDTH, self.height());
        let mut pixels = vec![255; 3 * size.0 as usize * size.1 as usize];
        self.draw(&BitMapBackend::with_buffer(&mut pixels, size).into_drawing_area())?;
        encoded(&pixels, size).map_err(|error| self.failed(error))
    }

    /// Returns the figure in files of this name, as SVG and as PNG.
    ///
    /// # Errors
    /// The drawing library or the encoder gave up.
    pub fn files(&self, name: &str) -> Result<[(String, Vec<u8>); 2], ReportError> {
        Ok([(format!("{name}.svg"), self.svg()?.into_bytes()), (format!("{name}.png"), self.png()?)])
    }

    /// Returns the height of the head and of all rows, pixels.
    fn height(&self) -> u32 {
        self.head().unsigned_abs() + self.rows.iter().map(|row| row.height).sum::<u32>()
    }

    /// Returns the height of title, lines and legend, pixels.
    fn head(&self) -> i32 {
        2 * MARGIN + LINE * (self.head_lines().len() + self.legend().len()) as i32 + 8
    }

    /// Returns the lines below the title, of which long ones take up to three, with their colours.
    fn head_lines(&self) -> Vec<(String, RGBColor)> {
        let room = WIDTH as i32 - 2 * MARGIN;
        let mut lines = Vec::new();
        let warning = self.warning.iter().map(|line| (line, ALARM));
        for (text, color) in self.lines.iter().map(|line| (line, GREY)).chain(warning) {
            let whole = shortened(text, SMALL, room);
            let mut parts = if whole == *text { vec![whole] } else { wrapped(text, SMALL, room) };
            let rest = parts.split_off(parts.len().min(2));
            parts.extend((!rest.is_empty()).then(|| rest.join(" ")));
            lines.extend(parts.iter().map(|part| (shortened(part, SMALL, room), color)));
        }
        lines
    }

    fn failed(&self, reason: impl Display) -> ReportError {
        ReportError::Draw { dataset: self.title.clone(), reason: reason.to_string() }
    }

    /// Returns the rows of the legend: the series with their places from the left.
    fn legend(&self) -> Vec<Vec<(usize, i32)>> {
        let mut rows: Vec<Vec<(usize, i32)>> = Vec::new();
        let mut x = i32::MAX / 2;
        for (series, name) in self.series.iter().enumerate() {
            let entry = 26 + width(name, SMALL);
            if x + entry > WIDTH as i32 - MARGIN {
                rows.push(Vec::new());
                x = MARGIN;
            }
            if let Some(row) = rows.last_mut() {
                row.push((series, x));
            }
            x += entry + 24;
        }
        rows
    }

    fn draw<DB: DrawingBackend>(&self, root: &DrawingArea<DB, Shift>) -> Result<Vec<Spot>, ReportError> {
        if !has_font() {
            return Err(self.failed("its font cannot be read"));
        }
        let mut spots = Vec::new();
        self.try_draw(root, &mut spots).map_err(|error| self.failed(error))?;
        Ok(spots)
    }

    fn try_draw<DB: DrawingBackend>(
        &self,
        root: &DrawingArea<DB, Shift>,
        spots: &mut Vec<Spot>,
    ) -> Result<(), DrawingAreaErrorKind<DB::ErrorType>> {
        root.fill(&WHITE)?;
        let room = WIDTH as i32 - 2 * MARGIN;
        let left = Pos::new(HPos::Left, VPos::Center);
        root.draw_text(
            &shortened(&self.title, LARGE, room),
            &style(LARGE, INK).pos(left),
            (MARGIN, MARGIN + 4),
        )?;
        let mut y = 2 * MARGIN + LINE / 2;
        for (line, color) in self.head_lines() {
            root.draw_text(&line, &style(SMALL, color).pos(left), (MARGIN, y))?;
            y += LINE;
        }
        for row in self.legend() {
            for (series, x) in row {
                marker(root, (x + 7, y), &Point::new([0.0; 2], series))?;
                let name = shortened(&self.series[series], SMALL, room - 30);
                root.draw_text(&name, &style(SMALL, INK).pos(left), (x + 22, y))?;
            }
            y += LINE;
        }
        let mut top = self.head();
        for row in &self.rows {
            for (column, panel) in row.panels.iter().enumerate() {
                let edge = |column: usize| 6 + (WIDTH as i32 - 12) * column as i32 / row.columns as i32;
                let area = root
                    .clone()
                    .shrink((edge(column), top), (edge(column + 1) - edge(column), row.height as i32 - 8));
                panel.draw(&area, spots)?;
            }
            top += row.height as i32;
        }
        root.present()
    }
}

/// A range of an axis with its ticks.
#[derive(Clone)]
struct Ticked {
    range: Range<f64>,
    ticks: Vec<f64>,
}

impl Ranged for Ticked {
    type ValueType = f64;
    type FormatOption = DefaultFormatting;

    /// Returns the pixel of a value; at the edge if it is beyond.
    fn map(&self, value: &f64, (first, last): (i32, i32)) -> i32 {
        let part = (value - self.range.start) / (self.range.end - self.range.start);
        first + (part.clamp(0.0, 1.0) * f64::from(last - first)).round() as i32
    }

    fn key_points<Hint: KeyPointHint>(&self, hint: Hint) -> Vec<f64> {
        if hint.weight().allow_light_points() { Vec::new() } else { self.ticks.clone() }
    }

    fn range(&self) -> Range<f64> {
        self.range.clone()
    }
}

impl Panel {
    /// Returns the points of all marks, which the axes hold: bars with both ends.
    fn extent(&self) -> Vec<[f64; 2]> {
        let of_mark = |mark: &Mark| match mark {
            Mark::Points(points) => {
                let bars = points.iter().filter_map(Point::bar).flatten();
                points.iter().map(|point| point.at).chain(bars).collect()
            }
            Mark::Line { points, .. } => points.clone(),
            Mark::Area { outline, .. } => outline.clone(),
            Mark::Arrow { from, to } => vec![*from, *to],
            Mark::Strip(_) | Mark::Vertical(_) | Mark::Horizontal(_) | Mark::Text { .. } => Vec::new(),
        };
        self.marks.iter().flat_map(of_mark).filter(|place| place.iter().all(|x| is_drawable(*x))).collect()
    }

    fn draw<DB: DrawingBackend>(
        &self,
        area: &DrawingArea<DB, Shift>,
        spots: &mut Vec<Spot>,
    ) -> Result<(), DrawingAreaErrorKind<DB::ErrorType>> {
        let (wide, high) = area.dim_in_pixel();
        let (wide, high) = (wide as i32, high as i32);
        let middle = Pos::new(HPos::Center, VPos::Center);
        let mut top = 16;
        area.draw_text(
            &shortened(&self.title, MEDIUM, wide - 8),
            &style(MEDIUM, INK).pos(middle),
            (wide / 2, top),
        )?;
        for line in wrapped(&self.about, SMALL, wide - 20) {
            top += LINE - 2;
            area.draw_text(&line, &style(SMALL, GREY).pos(middle), (wide / 2, top))?;
        }
        let extent = self.extent();
        let mut x = self.x.range(extent.iter().map(|place| place[0]));
        let mut y = self.y.range(extent.iter().map(|place| place[1]));
        let bottom = 58;
        let y_ticks = self.y.ticks(&y, usize::try_from((high - top - bottom) / 52).unwrap_or(2).clamp(3, 8));
        let words = if self.y.words.is_empty() { MARGIN + 12 } else { 12 };
        let left =
            words + y_ticks.iter().map(|tick| width(&self.y.label(*tick), SMALL)).max().unwrap_or(0) + 12;
        let inner = [wide - left - 18, high - top - bottom - 18];
        if self.is_square {
            make_square([&mut x, &mut y], inner);
        }
        let fits = |ticks: &Vec<f64>| {
            let widest = ticks.iter().map(|tick| width(&self.x.label(*tick), SMALL)).max().unwrap_or(0);
            (widest + 14) * ticks.len() as i32 <= inner[0]
        };
        let x_ticks = (2..=8).rev().map(|most| self.x.ticks(&x, most)).find(fits).unwrap_or_default();
        let y_ticks = if self.is_square { self.y.ticks(&y, y_ticks.len().max(4)) } else { y_ticks };
        let mut chart = ChartBuilder::on(area)
            .margin_top(top + 16)
            .margin_right(18)
            .x_label_area_size(bottom)
            .y_label_area_size(left)
            .build_cartesian_2d(
                Ticked { range: x.clone(), ticks: x_ticks },
                Ticked { range: y.clone(), ticks: y_ticks },
            )?;
        let x_name = shortened(&self.x.name, SMALL, wide - left);
        let y_name = shortened(&self.y.name, SMALL, inner[1] + 60);
        chart
            .configure_mesh()
            .bold_line_style(GRID)
            .light_line_style(TRANSPARENT)
            .axis_style(INK)
            .label_style(style(SMALL, INK))
            .axis_desc_style(style(SMALL, INK))
            .x_label_formatter(&|tick| self.x.label(*tick))
            .y_label_formatter(&|tick| self.y.label(*tick))
            .x_desc(x_name)
            .y_desc(y_name)
            .draw()?;
        let plane = chart.plotting_area();
        for mark in &self.marks {
            draw_mark(mark, plane, area, [&x, &y], spots)?;
        }
        plane.draw(&Rectangle::new([(x.start, y.start), (x.end, y.end)], INK))
    }
}

/// Widens the shorter of two ranges until a unit is as long along either.
fn make_square([x, y]: [&mut Range<f64>; 2], [wide, high]: [i32; 2]) {
    let [wide, high] = [wide, high].map(|pixels| f64::from(pixels.max(1)));
    let unit = ((x.end - x.start) / wide).max((y.end - y.start) / high);
    for (range, pixels) in [(x, wide), (y, high)] {
        let middle = 0.5 * (range.start + range.end);
        *range = middle - 0.5 * unit * pixels..middle + 0.5 * unit * pixels;
    }
}

fn draw_mark<DB: DrawingBackend>(
    mark: &Mark,
    plane: &DrawingArea<DB, Cartesian2d<Ticked, Ticked>>,
    area: &DrawingArea<DB, Shift>,
    [x, y]: [&Range<f64>; 2],
    spots: &mut Vec<Spot>,
) -> Result<(), DrawingAreaErrorKind<DB::ErrorType>> {
    let corner = area.get_base_pixel();
    let pixel = |[x, y]: [f64; 2]| plane.map_coordinate(&(x, y));
    let in_area = |place: [f64; 2]| {
        let (x, y) = pixel(place);
        (x - corner.0, y - corner.1)
    };
    match mark {
        Mark::Points(points) => {
            for point in points.iter().filter(|point| point.at.iter().all(|x| is_drawable(*x))) {
                if let Some([low, high]) = point.bar() {
                    let color = color(point.series).mix(0.8 * point.opacity);
                    plane.draw(&PathElement::new(vec![low.into(), high.into()], color))?;
                }
                marker(area, in_area(point.at), point)?;
                if let Some(label) = point.label {
                    let (x, y) = pixel(point.at);
                    spots.push(Spot(x, y, label));
                }
            }
            Ok(())
        }
        Mark::Line { points, color, width } => {
            let points: Vec<(f64, f64)> = points.iter().map(|point| (*point).into()).collect();
            plane.draw(&PathElement::new(points, color.stroke_width(*width)))
        }
        Mark::Area { outline, color } => {
            let outline: Vec<(f64, f64)> = outline.iter().map(|point| (*point).into()).collect();
            plane.draw(&Polygon::new(outline, color.filled()))
        }
        Mark::Strip([low, high]) => {
            plane.draw(&Rectangle::new([(x.start, *low), (x.end, *high)], BAND.filled()))
        }
        Mark::Arrow { from, to } => arrow(area, [in_area(*from), in_area(*to)]),
        Mark::Vertical(at) => plane.draw(&PathElement::new(vec![(*at, y.start), (*at, y.end)], GREY)),
        Mark::Horizontal(at) => plane.draw(&PathElement::new(vec![(x.start, *at), (x.end, *at)], INK)),
        Mark::Text { at, words } => {
            let style = style(SMALL, GREY).pos(Pos::new(HPos::Center, VPos::Center));
            area.draw_text(words, &style, in_area(*at))
        }
    }
}

/// Draws the marker of a series.
fn marker<DB: DrawingBackend>(
    area: &DrawingArea<DB, Shift>,
    (x, y): (i32, i32),
    point: &Point,
) -> Result<(), DrawingAreaErrorKind<DB::ErrorType>> {
    let style = color(point.series).mix(point.opacity).filled();
    match point.series % 4 {
        0 => area.draw(&Circle::new((x, y), 4, style)),
        1 => area.draw(&Rectangle::new([(x - 4, y - 4), (x + 4, y + 4)], style)),
        2 => area.draw(&Polygon::new(vec![(x - 5, y + 4), (x + 5, y + 4), (x, y - 6)], style)),
        _ => area.draw(&Polygon::new(vec![(x - 6, y), (x, y + 6), (x + 6, y), (x, y - 6)], style)),
    }
}

/// Draws an arrow whose head is visible on a short one, too.
fn arrow<DB: DrawingBackend>(
    area: &DrawingArea<DB, Shift>,
    [from, to]: [(i32, i32); 2],
) -> Result<(), DrawingAreaErrorKind<DB::ErrorType>> {
    let along = [f64::from(to.0 - from.0), f64::from(to.1 - from.1)];
    let length = along[0].hypot(along[1]);
    if length < 1.0 {
        return area.draw(&Circle::new(to, 2, color(1).filled()));
    }
    area.draw(&PathElement::new(vec![from, to], color(1).stroke_width(2)))?;
    let unit = along.map(|x| x / length);
    let head = |back: f64, aside: f64| {
        let x = f64::from(to.0) - back * unit[0] - aside * unit[1];
        let y = f64::from(to.1) - back * unit[1] + aside * unit[0];
        (x.round() as i32, y.round() as i32)
    };
    area.draw(&Polygon::new(vec![head(-2.0, 0.0), head(8.0, 5.0), head(8.0, -5.0)], color(1).filled()))
}

fn encoded(pixels: &[u8], (width, height): (u32, u32)) -> Result<Vec<u8>, png::EncodingError> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, width, height);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_compression(png::Compression::Default);
    // flat colours compress best unfiltered
    encoder.set_filter(png::FilterType::NoFilter);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(pixels)?;
    writer.finish()?;
    Ok(bytes)
}
