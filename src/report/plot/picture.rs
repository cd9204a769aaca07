//! A picture in pixels: shapes and texts in the order in which they are drawn, collected once and then drawn as SVG or as PNG.

use std::fmt::Display;
use std::sync::OnceLock;

use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::register_font;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::MARGIN;
use crate::report::ReportError;

/// The font as an SVG names it; the first family is in the program, so that the PNG needs none.
const FONT: &str = "DejaVu Sans, Verdana, Arial, sans-serif";

pub(super) const INK: RGBColor = RGBColor(20, 20, 20);
pub(super) const GREY: RGBColor = RGBColor(85, 85, 85);
pub(super) const GRID: RGBColor = RGBColor(226, 226, 226);
pub(super) const BAND: RGBColor = RGBColor(236, 239, 243);
pub(super) const ALARM: RGBColor = RGBColor(176, 0, 32);

/// Font sizes, pixels from the top of the highest to the bottom of the lowest letter. The letters of
/// the smallest are 15 px in CSS terms.
pub(super) const SMALL: f64 = 19.0;
pub(super) const MEDIUM: f64 = 21.0;
pub(super) const LARGE: f64 = 29.0;

/// A point in pixels, from the left and from the top.
pub(super) type Pixel = (i32, i32);

/// Where points of the data are on a picture: pixels from the left and from the top, and the index of the residual.
pub(crate) type Spots = Vec<(i32, i32, usize)>;

/// Where a text stands about its point.
#[derive(Clone, Copy, Debug)]
pub(super) enum Anchor {
    /// The point is at the left, half height.
    Left,
    Right,
    Centre,
    /// Centred, upwards.
    Upwards,
}

#[derive(Clone, Debug)]
enum Shape {
    /// With its width.
    Line(Vec<Pixel>, RGBAColor, u32),
    /// By two opposite corners.
    Rectangle([Pixel; 2], RGBAColor),
    Polygon(Vec<Pixel>, RGBAColor),
    /// By its centre and radius.
    Circle(Pixel, i32, RGBAColor),
    Text(String, Pixel, Anchor, f64, RGBColor),
}

/// What is drawn, on either backend.
#[derive(Clone, Debug)]
pub struct Picture {
    /// What it is of, as messages name it.
    of: String,
    width: i32,
    height: i32,
    shapes: Vec<Shape>,
    /// Where points of the data were drawn, and which.
    pub(crate) spots: Spots,
}

impl Picture {
    pub(super) fn new(of: &str, width: i32, height: i32) -> Self {
        Self { of: of.to_owned(), width, height, shapes: Vec::new(), spots: Vec::new() }
    }

    pub(super) fn line(&mut self, points: Vec<Pixel>, color: impl Into<RGBAColor>, width: u32) {
        self.shapes.push(Shape::Line(points, color.into(), width));
    }

    pub(super) fn rectangle(&mut self, corners: [Pixel; 2], color: impl Into<RGBAColor>) {
        self.shapes.push(Shape::Rectangle(corners, color.into()));
    }

    pub(super) fn polygon(&mut self, corners: Vec<Pixel>, color: impl Into<RGBAColor>) {
        self.shapes.push(Shape::Polygon(corners, color.into()));
    }

    pub(super) fn circle(&mut self, centre: Pixel, radius: i32, color: impl Into<RGBAColor>) {
        self.shapes.push(Shape::Circle(centre, radius, color.into()));
    }

    pub(super) fn text(&mut self, text: &str, at: Pixel, anchor: Anchor, size: f64, color: RGBColor) {
        self.shapes.push(Shape::Text(text.to_owned(), at, anchor, size, color));
    }

    /// A small text to the right of a point.
    pub(super) fn label(&mut self, text: &str, at: Pixel, color: RGBColor) {
        self.text(text, at, Anchor::Left, SMALL, color);
    }

    /// The title of the whole picture, at this height.
    pub(super) fn title(&mut self, text: &str, y: i32) {
        self.text(text, (MARGIN, y), Anchor::Left, LARGE, INK);
    }

    /// As SVG text.
    ///
    /// # Errors
    /// The drawing library gave up.
    pub fn svg(&self) -> Result<String, ReportError> {
        let mut text = String::new();
        self.draw(&SVGBackend::with_string(&mut text, self.size()).into_drawing_area())?;
        Ok(text)
    }

    /// As PNG bytes.
    ///
    /// # Errors
    /// As [`Self::svg`], and the encoder's.
    pub fn png(&self) -> Result<Vec<u8>, ReportError> {
        let (width, height) = self.size();
        let mut pixels = vec![255; 3 * width as usize * height as usize];
        self.draw(&BitMapBackend::with_buffer(&mut pixels, (width, height)).into_drawing_area())?;
        encoded(&pixels, (width, height)).map_err(|error| self.failed(error))
    }

    fn size(&self) -> (u32, u32) {
        (self.width.unsigned_abs(), self.height.unsigned_abs())
    }

    fn failed(&self, reason: impl Display) -> ReportError {
        ReportError::Draw { dataset: self.of.clone(), reason: reason.to_string() }
    }

    fn draw<DB: DrawingBackend>(&self, area: &DrawingArea<DB, Shift>) -> Result<(), ReportError> {
        if !has_font() {
            return Err(self.failed("its font cannot be read"));
        }
        area.fill(&WHITE).map_err(|error| self.failed(error))?;
        for shape in &self.shapes {
            match shape {
                Shape::Line(points, color, width) => {
                    area.draw(&PathElement::new(points.clone(), color.stroke_width(*width)))
                }
                Shape::Rectangle(corners, color) => area.draw(&Rectangle::new(*corners, color.filled())),
                Shape::Polygon(corners, color) => area.draw(&Polygon::new(corners.clone(), color.filled())),
                Shape::Circle(centre, radius, color) => {
                    area.draw(&Circle::new(*centre, *radius, color.filled()))
                }
                Shape::Text(text, at, anchor, size, color) => {
                    let (style, at) = placed(*at, *anchor, *size, color);
                    area.draw_text(text, &style, at)
                }
            }
            .map_err(|error| self.failed(error))?;
        }
        area.present().map_err(|error| self.failed(error))
    }
}

/// The style of a text, and where it is put.
fn placed((x, y): Pixel, anchor: Anchor, size: f64, color: &RGBColor) -> (TextStyle<'_>, Pixel) {
    // Both backends set capitals and digits off the middle, the bitmap too high by 0.2 of the size,
    // the SVG by 0.08.
    let drop = (0.14 * size).round() as i32;
    let font = font(size);
    let (font, h_pos, at) = match anchor {
        Anchor::Left => (font, HPos::Left, (x, y + drop)),
        Anchor::Right => (font, HPos::Right, (x, y + drop)),
        Anchor::Centre => (font, HPos::Center, (x, y + drop)),
        Anchor::Upwards => (font.transform(FontTransform::Rotate270), HPos::Center, (x + drop, y)),
    };
    (TextStyle::from(font).color(color).pos(Pos::new(h_pos, VPos::Center)), at)
}

fn encoded(pixels: &[u8], (width, height): (u32, u32)) -> Result<Vec<u8>, png::EncodingError> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, width, height);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_compression(png::Compression::Default);
    // Flat colours compress best unfiltered.
    encoder.set_filter(png::FilterType::NoFilter);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(pixels)?;
    writer.finish()?;
    Ok(bytes)
}

fn font(size: f64) -> FontDesc<'static> {
    FontDesc::new(FontFamily::Name(FONT), size, FontStyle::Normal)
}

/// Whether plotters knows the font, without which nothing can be measured or drawn.
fn has_font() -> bool {
    static REGISTERED: OnceLock<bool> = OnceLock::new();
    let font = include_bytes!("../DejaVuSans-subset.ttf");
    *REGISTERED.get_or_init(|| register_font(FONT, FontStyle::Normal, font).is_ok())
}

/// Width of a text in pixels.
pub(super) fn width(text: &str, size: f64) -> i32 {
    let measured = if has_font() { font(size).box_size(text).ok() } else { None };
    measured.map_or(0, |(width, _)| i32::try_from(width).unwrap_or(i32::MAX))
}

/// The text in one line no wider than `limit` pixels, without characters an SVG cannot hold.
pub(super) fn shortened(text: &str, size: f64, limit: i32) -> String {
    // A name of a megabyte is not measured letter by letter.
    let mut short: String = text.chars().take(300).map(|c| if allowed(c) { c } else { ' ' }).collect();
    if short.len() >= text.len() && width(&short, size) <= limit {
        return short;
    }
    while !short.is_empty() && width(&format!("{short}…"), size) > limit {
        short.pop();
    }
    format!("{}…", short.trim_end())
}

/// Lines no wider than `limit` pixels, broken between words.
pub(super) fn wrapped(text: &str, size: f64, limit: i32) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split_whitespace() {
        match lines.last_mut() {
            Some(line) if width(&format!("{line} {word}"), size) <= limit => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(word.to_owned()),
        }
    }
    lines
}

/// Whether XML can hold a character.
fn allowed(c: char) -> bool {
    !c.is_control() && !matches!(c, '\u{fffe}' | '\u{ffff}')
}
