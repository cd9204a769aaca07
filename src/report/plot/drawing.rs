//! One drawing as SVG text or PNG bytes.

use plotters::coord::Shift;
use plotters::prelude::*;

/// What is drawn on.
pub(super) type Area<DB> = DrawingArea<DB, Shift>;

/// SVG text, and what the drawing says besides.
pub(super) fn svg<T>(
    size: (u32, u32),
    draw: impl for<'a> FnOnce(&Area<SVGBackend<'a>>) -> Result<T, String>,
) -> Result<(String, T), String> {
    let mut text = String::new();
    let area = SVGBackend::with_string(&mut text, size).into_drawing_area();
    let said = draw(&area)?;
    area.present().map_err(|error| error.to_string())?;
    drop(area);
    Ok((text, said))
}

/// PNG bytes.
pub(super) fn png<T>(
    (width, height): (u32, u32),
    draw: impl for<'a> FnOnce(&Area<BitMapBackend<'a>>) -> Result<T, String>,
) -> Result<Vec<u8>, String> {
    let mut pixels = vec![255; 3 * width as usize * height as usize];
    let area = BitMapBackend::with_buffer(&mut pixels, (width, height)).into_drawing_area();
    draw(&area)?;
    area.present().map_err(|error| error.to_string())?;
    drop(area);
    encoded(&pixels, (width, height)).map_err(|error| error.to_string())
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
