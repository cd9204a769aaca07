//! Lines, shapes and text in pixels, on either backend.

use std::cell::RefCell;
use std::sync::OnceLock;

use plotters::prelude::*;
use plotters::style::register_font;
use plotters::style::text_anchor::{HPos, Pos, VPos};

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

pub(super) struct Canvas<'a, DB: DrawingBackend> {
    area: &'a DrawingArea<DB, plotters::coord::Shift>,
    /// Where points of the data were drawn, and which.
    spots: RefCell<Vec<(i32, i32, usize)>>,
}

/// Where a text stands about its point.
#[derive(Clone, Copy)]
pub(super) enum Anchor {
    /// The point is at the left, half height.
    Left,
    Right,
    Centre,
    /// Centred, upwards.
    Upwards,
}

impl<'a, DB: DrawingBackend> Canvas<'a, DB> {
    pub(super) fn new(area: &'a DrawingArea<DB, plotters::coord::Shift>) -> Result<Self, String> {
        register()?;
        area.fill(&WHITE).map_err(|error| error.to_string())?;
        Ok(Self { area, spots: RefCell::default() })
    }

    /// Remembers where a point of the data was drawn.
    pub(super) fn spot(&self, (x, y): Pixel, index: usize) {
        self.spots.borrow_mut().push((x, y, index));
    }

    pub(super) fn spots(&self) -> Vec<(i32, i32, usize)> {
        self.spots.take()
    }

    pub(super) fn line(&self, points: Vec<Pixel>, color: RGBAColor, width: u32) -> Result<(), String> {
        let path = PathElement::new(points, color.stroke_width(width));
        self.area.draw(&path).map_err(|error| error.to_string())
    }

    pub(super) fn rectangle(&self, corners: [Pixel; 2], color: RGBAColor) -> Result<(), String> {
        self.area.draw(&Rectangle::new(corners, color.filled())).map_err(|error| error.to_string())
    }

    pub(super) fn polygon(&self, corners: Vec<Pixel>, color: RGBAColor) -> Result<(), String> {
        self.area.draw(&Polygon::new(corners, color.filled())).map_err(|error| error.to_string())
    }

    pub(super) fn circle(&self, centre: Pixel, radius: i32, color: RGBAColor) -> Result<(), String> {
        self.area.draw(&Circle::new(centre, radius, color.filled())).map_err(|error| error.to_string())
    }

    pub(super) fn text(
        &self,
        text: &str,
        (x, y): Pixel,
        anchor: Anchor,
        size: f64,
        color: RGBColor,
    ) -> Result<(), String> {
        let h_pos = match anchor {
            Anchor::Left => HPos::Left,
            Anchor::Right => HPos::Right,
            Anchor::Centre | Anchor::Upwards => HPos::Center,
        };
        let mut font = FontDesc::new(FontFamily::Name(FONT), size, FontStyle::Normal);
        if matches!(anchor, Anchor::Upwards) {
            font = font.transform(FontTransform::Rotate270);
        }
        let style = TextStyle::from(font).color(&color).pos(Pos::new(h_pos, VPos::Center));
        // Both backends set capitals and digits off the middle, the bitmap too high by 0.2 of the size,
        // the SVG by 0.08.
        let drop = (0.14 * size).round() as i32;
        let at = if matches!(anchor, Anchor::Upwards) { (x + drop, y) } else { (x, y + drop) };
        self.area.draw_text(text, &style, at).map_err(|error| error.to_string())
    }
}

/// Makes the font known to plotters: before anything is measured or drawn.
pub(super) fn register() -> Result<(), String> {
    static REGISTERED: OnceLock<bool> = OnceLock::new();
    let font = include_bytes!("../DejaVuSans-subset.ttf");
    let registered = *REGISTERED.get_or_init(|| register_font(FONT, FontStyle::Normal, font).is_ok());
    if registered { Ok(()) } else { Err("its font cannot be read".to_owned()) }
}

/// Width of a text in pixels.
pub(super) fn width(text: &str, size: f64) -> i32 {
    let font = FontDesc::new(FontFamily::Name(FONT), size, FontStyle::Normal);
    font.box_size(text).map_or(0, |(width, _)| i32::try_from(width).unwrap_or(i32::MAX))
}

/// The text in one line no wider than `limit` pixels, without characters an SVG cannot hold.
pub(super) fn shortened(text: &str, size: f64, limit: i32) -> String {
    // A name of a megabyte is not measured letter by letter.
    let short: String = text.chars().take(300).map(|c| if allowed(c) { c } else { ' ' }).collect();
    if short.len() >= text.len() && width(&short, size) <= limit {
        return short;
    }
    let mut short = short;
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
