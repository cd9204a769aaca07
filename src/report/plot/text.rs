//! The font of figures, and how wide texts are.

use std::sync::OnceLock;

use plotters::prelude::*;
use plotters::style::register_font;

/// The font as an SVG names it; the first family is in the program, so that the PNG needs none.
const FONT: &str = "DejaVu Sans, Verdana, Arial, sans-serif";

/// Sizes of texts, pixels.
pub(super) const SMALL: f64 = 18.0;
pub(super) const MEDIUM: f64 = 20.0;
pub(super) const LARGE: f64 = 28.0;

/// Returns the style of a text of a size and colour.
pub(super) fn style(size: f64, color: RGBColor) -> TextStyle<'static> {
    TextStyle { color: color.to_backend_color(), ..TextStyle::from(font(size)) }
}

fn font(size: f64) -> FontDesc<'static> {
    FontDesc::new(FontFamily::Name(FONT), size, FontStyle::Normal)
}

/// Returns whether plotters knows the font, without which nothing can be measured or drawn.
pub(super) fn has_font() -> bool {
    static REGISTERED: OnceLock<bool> = OnceLock::new();
    let font = include_bytes!("../DejaVuSans-subset.ttf");
    *REGISTERED.get_or_init(|| register_font(FONT, FontStyle::Normal, font).is_ok())
}

/// Returns the width of a text, pixels.
pub(super) fn width(text: &str, size: f64) -> i32 {
    let measured = if has_font() { font(size).box_size(text).ok() } else { None };
    measured.map_or(0, |(width, _)| i32::try_from(width).unwrap_or(i32::MAX / 4))
}

/// Returns the text in one line no wider than `limit` pixels, without characters that an SVG cannot hold.
pub(super) fn shortened(text: &str, size: f64, limit: i32) -> String {
    let is_allowed = |c: char| !c.is_control() && !matches!(c, '\u{fffe}' | '\u{ffff}');
    // a name of a megabyte is not measured letter by letter
    let mut short: String = text.chars().take(300).map(|c| if is_allowed(c) { c } else { ' ' }).collect();
    if short.len() >= text.len() && width(&short, size) <= limit {
        return short;
    }
    while !short.is_empty() && width(&format!("{short}…"), size) > limit {
        short.pop();
    }
    format!("{}…", short.trim_end())
}

/// Returns lines no wider than `limit` pixels, broken between words.
pub(super) fn wrapped(text: &str, size: f64, limit: i32) -> Vec<String> {
    /// A text of a megabyte is not measured word by word.
    const MOST: usize = 200;
    let mut lines: Vec<String> = Vec::new();
    for word in text.split_whitespace().take(MOST) {
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
