//! Draws a [`Figure`] as SVG or as PNG. Texts are measured and drawn with a font that is in the
//! program.

use std::ops::Range;
use std::sync::OnceLock;

use plotters::coord::Shift;
use plotters::coord::ranged1d::{DefaultFormatting, KeyPointHint};
use plotters::prelude::*;
use plotters::style::register_font;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::axis::is_drawable;
use super::{Axis, Figure, GREY, INK, Mark, Panel, Point, WIDTH, color};
use crate::report::ReportError;

/// Free space at the edges, height of a line of text, sizes of texts, pixels.
const MARGIN: i32 = 22;
const LINE: i32 = 26;
const SMALL_TEXT: f64 = 18.0;
const MEDIUM: f64 = 20.0;
const LARGE: f64 = 28.0;

/// Width of a line of text below the title, pixels.
const ROOM: i32 = WIDTH as i32 - 2 * MARGIN;

/// Colour of the grid.
const GRID: RGBColor = RGBColor(226, 226, 226);

const LEFT: Pos = Pos { h_pos: HPos::Left, v_pos: VPos::Center };
const MIDDLE: Pos = Pos { h_pos: HPos::Center, v_pos: VPos::Center };

/// The font as an SVG names it; the first family is in the program.
const FONT: &str = "DejaVu Sans, Verdana, Arial, sans-serif";

/// Place of a measured point in a picture: pixels from the left and from the top, and the index of
/// its label.
#[derive(Clone, Copy, Debug, serde::Serialize)]
pub(in crate::report) struct Spot(i32, i32, usize);

type Area<'a, DB> = DrawingArea<DB, Shift>;
type Drawn<DB> = Result<(), DrawingAreaErrorKind<<DB as DrawingBackend>::ErrorType>>;

impl Figure {
    /// Returns the figure as SVG text, with the places of the measured points.
    pub(in crate::report) fn svg(&self) -> Result<(String, Vec<Spot>), ReportError> {
        let mut text = String::new();
        let spots = self.drawn_on(SVGBackend::with_string(&mut text, self.size()))?;
        Ok((text, spots))
    }

    pub(in crate::report) fn png(&self) -> Result<Vec<u8>, ReportError> {
        let size = self.size();
        let mut pixels = vec![255; 3 * size.0 as usize * size.1 as usize];
        self.drawn_on(BitMapBackend::with_buffer(&mut pixels, size))?;
        encoded(&pixels, size).map_err(|error| self.failed(error))
    }

    fn drawn_on<DB: DrawingBackend>(&self, backend: DB) -> Result<Vec<Spot>, ReportError> {
        let mut spots = Vec::new();
        self.draw(&backend.into_drawing_area(), &mut spots).map_err(|error| self.failed(error))?;
        Ok(spots)
    }

    fn failed(&self, error: impl std::fmt::Display) -> ReportError {
        ReportError(format!("the figure of {} cannot be drawn: {error}", self.title))
    }

    /// Returns width and height, pixels.
    fn size(&self) -> (u32, u32) {
        (WIDTH, self.head().unsigned_abs() + self.rows.iter().map(|(height, _)| height).sum::<u32>())
    }

    /// Returns the height of title, lines and legend, pixels.
    fn head(&self) -> i32 {
        let legend = self.series.len().div_ceil(self.legend_columns());
        2 * MARGIN + LINE * (self.head_lines().len() + legend) as i32 + 8
    }

    /// Returns the lines below the title, of which long ones take up to three, with their colours.
    fn head_lines(&self) -> Vec<(String, RGBColor)> {
        let wrap = |(line, color): &(String, RGBColor)| {
            let color = *color;
            wrapped(line, ROOM, 3).into_iter().map(move |part| (part, color))
        };
        self.lines.iter().flat_map(wrap).collect()
    }

    /// Returns how many names of series stand side by side.
    fn legend_columns(&self) -> usize {
        let widest = self.series.iter().map(|name| width(name, SMALL_TEXT)).max().unwrap_or(0);
        usize::try_from(ROOM / (widest + 50)).unwrap_or(0).clamp(1, self.series.len().max(1))
    }

    fn draw<DB: DrawingBackend>(&self, root: &Area<DB>, spots: &mut Vec<Spot>) -> Drawn<DB> {
        root.fill(&WHITE)?;
        let title = shortened(&self.title, LARGE, ROOM);
        root.draw_text(&title, &style(LARGE, INK).pos(LEFT), (MARGIN, MARGIN + 4))?;
        let mut y = 2 * MARGIN + LINE / 2;
        for (line, color) in self.head_lines() {
            root.draw_text(&line, &style(SMALL_TEXT, color).pos(LEFT), (MARGIN, y))?;
            y += LINE;
        }
        let columns = self.legend_columns();
        for (series, name) in self.series.iter().enumerate() {
            let x = MARGIN + ROOM / columns as i32 * (series % columns) as i32;
            let y = y + LINE * (series / columns) as i32;
            marker(root, (x + 7, y), &Point::new([0.0; 2], series))?;
            let name = shortened(name, SMALL_TEXT, ROOM - 30);
            root.draw_text(&name, &style(SMALL_TEXT, INK).pos(LEFT), (x + 22, y))?;
        }
        let mut top = self.head();
        for (height, panels) in &self.rows {
            let edge = |column: usize| 6 + (WIDTH as i32 - 12) * column as i32 / panels.len() as i32;
            for (column, panel) in panels.iter().enumerate() {
                let size = (edge(column + 1) - edge(column), *height as i32 - 8);
                panel.draw(&root.clone().shrink((edge(column), top), size), spots)?;
            }
            top += *height as i32;
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
        let points = |mark: &Mark| match mark {
            Mark::Points(points) => points.iter().flat_map(Point::bar).collect(),
            Mark::Path(points, _) => points.clone(),
        };
        self.marks.iter().flat_map(points).filter(|place| place.iter().all(|x| is_drawable(*x))).collect()
    }

    fn draw<DB: DrawingBackend>(&self, area: &Area<DB>, spots: &mut Vec<Spot>) -> Drawn<DB> {
        let (wide, high) = area.dim_in_pixel();
        let (wide, high) = (wide as i32, high as i32);
        let mut top = 16;
        let title = shortened(&self.title, MEDIUM, wide - 8);
        area.draw_text(&title, &style(MEDIUM, INK).pos(MIDDLE), (wide / 2, top))?;
        for line in wrapped(&self.about, wide - 20, usize::MAX) {
            top += LINE - 2;
            area.draw_text(&line, &style(SMALL_TEXT, GREY).pos(MIDDLE), (wide / 2, top))?;
        }
        let extent = self.extent();
        let [mut x, mut y] =
            [(&self.x, 0), (&self.y, 1)].map(|(axis, i)| axis.range(extent.iter().map(|place| place[i])));
        let bottom = 58;
        let rows = usize::try_from((high - top - bottom) / 52).unwrap_or(2).clamp(3, 8);
        let widest = |axis: &Axis, ticks: &[f64]| {
            ticks.iter().map(|tick| width(&axis.label(*tick), SMALL_TEXT)).max().unwrap_or(0)
        };
        let name = if self.y.name.is_empty() { 0 } else { MARGIN };
        let left = 24 + name + widest(&self.y, &self.y.ticks(&y, rows));
        let inner = [wide - left - 18, high - top - bottom - 18];
        if self.is_square {
            make_square([&mut x, &mut y], inner);
        }
        let fits = |ticks: &Vec<f64>| (widest(&self.x, ticks) + 14) * ticks.len() as i32 <= inner[0];
        let x_ticks = (2..=8).rev().map(|most| self.x.ticks(&x, most)).find(fits).unwrap_or_default();
        let y_ticks = self.y.ticks(&y, rows);
        let mut chart = ChartBuilder::on(area)
            .margin_top(top + 16)
            .margin_right(18)
            .x_label_area_size(bottom)
            .y_label_area_size(left)
            .build_cartesian_2d(
                Ticked { range: x.clone(), ticks: x_ticks },
                Ticked { range: y.clone(), ticks: y_ticks },
            )?;
        chart
            .configure_mesh()
            .bold_line_style(GRID)
            .light_line_style(TRANSPARENT)
            .axis_style(INK)
            .label_style(style(SMALL_TEXT, INK))
            .axis_desc_style(style(SMALL_TEXT, INK))
            .x_label_formatter(&|tick| self.x.label(*tick))
            .y_label_formatter(&|tick| self.y.label(*tick))
            .x_desc(shortened(&self.x.name, SMALL_TEXT, wide - left))
            .y_desc(shortened(&self.y.name, SMALL_TEXT, inner[1] + 60))
            .draw()?;
        let plane = chart.plotting_area();
        for mark in &self.marks {
            draw_mark(mark, plane, area, spots)?;
        }
        plane.draw(&Rectangle::new([(x.start, y.start), (x.end, y.end)], INK))
    }
}

/// Widens the shorter of two ranges until a unit is as long along either.
fn make_square([x, y]: [&mut Range<f64>; 2], pixels: [i32; 2]) {
    let [wide, high] = pixels.map(|pixels| f64::from(pixels.max(1)));
    let unit = ((x.end - x.start) / wide).max((y.end - y.start) / high);
    for (range, pixels) in [(x, wide), (y, high)] {
        let middle = 0.5 * (range.start + range.end);
        *range = middle - 0.5 * unit * pixels..middle + 0.5 * unit * pixels;
    }
}

fn draw_mark<DB: DrawingBackend>(
    mark: &Mark,
    plane: &DrawingArea<DB, Cartesian2d<Ticked, Ticked>>,
    area: &Area<DB>,
    spots: &mut Vec<Spot>,
) -> Drawn<DB> {
    let corner = area.get_base_pixel();
    let pairs = |points: &[[f64; 2]]| points.iter().map(|point| (*point).into()).collect::<Vec<_>>();
    let points = match mark {
        Mark::Points(points) => points,
        Mark::Path(points, style) if style.filled => return plane.draw(&Polygon::new(pairs(points), *style)),
        Mark::Path(points, style) => return plane.draw(&PathElement::new(pairs(points), *style)),
    };
    for point in points.iter().filter(|point| point.at.iter().all(|x| is_drawable(*x))) {
        if point.sd.is_some() {
            let color = color(point.series).mix(0.8 * point.opacity);
            plane.draw(&PathElement::new(pairs(&point.bar()), color))?;
        }
        let (x, y) = plane.map_coordinate(&point.at.into());
        marker(area, (x - corner.0, y - corner.1), point)?;
        spots.extend(point.label.map(|label| Spot(x, y, label)));
    }
    Ok(())
}

fn marker<DB: DrawingBackend>(area: &Area<DB>, (x, y): (i32, i32), point: &Point) -> Drawn<DB> {
    let corners: &[(i32, i32)] = match point.series % 4 {
        0 => &[],
        1 => &[(-4, -4), (4, -4), (4, 4), (-4, 4)],
        2 => &[(-5, 4), (5, 4), (0, -6)],
        _ => &[(-6, 0), (0, 6), (6, 0), (0, -6)],
    };
    let style = color(point.series).mix(point.opacity).filled();
    if corners.is_empty() {
        return area.draw(&Circle::new((x, y), 4, style));
    }
    let corners: Vec<(i32, i32)> = corners.iter().map(|corner| (x + corner.0, y + corner.1)).collect();
    area.draw(&Polygon::new(corners, style))
}

fn font(size: f64) -> FontDesc<'static> {
    static REGISTERED: OnceLock<bool> = OnceLock::new();
    let bytes = include_bytes!("../DejaVuSans-subset.ttf");
    REGISTERED.get_or_init(|| register_font(FONT, FontStyle::Normal, bytes).is_ok());
    FontDesc::new(FontFamily::Name(FONT), size, FontStyle::Normal)
}

fn style(size: f64, color: RGBColor) -> TextStyle<'static> {
    TextStyle { color: color.to_backend_color(), ..TextStyle::from(font(size)) }
}

/// Returns the width of a text, pixels; 0 if the font cannot be read.
fn width(text: &str, size: f64) -> i32 {
    font(size).box_size(text).map_or(0, |(width, _)| i32::try_from(width).unwrap_or(i32::MAX / 4))
}

/// Returns the text in one line no wider than `limit` pixels, without characters that an SVG cannot
/// hold.
fn shortened(text: &str, size: f64, limit: i32) -> String {
    let is_refused = |c: char| c.is_control() || matches!(c, '\u{fffe}' | '\u{ffff}');
    // a name of a megabyte is not measured letter by letter
    let mut short = text.chars().take(300).collect::<String>().replace(is_refused, " ");
    if short.len() >= text.len() && width(&short, size) <= limit {
        return short;
    }
    while !short.is_empty() && width(&format!("{short}…"), size) > limit {
        short.pop();
    }
    format!("{}…", short.trim_end())
}

/// Returns up to `most` lines of small text no wider than `limit` pixels, broken between words.
fn wrapped(text: &str, limit: i32, most: usize) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split_inclusive(' ').take(300) {
        let is_last = lines.len() == most;
        match lines.last_mut() {
            Some(line) if is_last || width(&format!("{line}{word}"), SMALL_TEXT) <= limit => {
                line.push_str(word);
            }
            _ => lines.push(word.to_owned()),
        }
    }
    lines.iter().map(|line| shortened(line.trim_end(), SMALL_TEXT, limit)).collect()
}

fn encoded(pixels: &[u8], (width, height): (u32, u32)) -> Result<Vec<u8>, png::EncodingError> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, width, height);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_compression(png::Compression::Fast);
    // flat colours become zeros
    encoder.set_filter(png::FilterType::Up);
    encoder.write_header()?.write_image_data(pixels)?;
    Ok(bytes)
}
