//! frames.csv of a joint fit: one row per ball and frame that was fitted, where the ball was seen and where the fit has it.

use std::io::{self, Write};

use super::csv::{cell, number, quoted};
use super::digits::{self, FEW, MANY};
use crate::fit::FittedFrames;
use crate::likelihood::frames::rows::{Measured, Row};
use crate::measurement::track::TrackedBall;

/// The columns: lengths in m, in the frame of the table, with what was found of the camera corrected; `ball` is cue or object;
/// `…_standardized` is (measured − predicted) / sd.
pub const HEADER: &str =
    "shot,ball,t_s,x_m,y_m,x_predicted_m,y_predicted_m,x_sd_m,y_sd_m,x_standardized,y_standardized";

/// Writes frames.csv shot by shot: there may be more frames than should be held in memory.
///
/// # Errors
/// Those of `to`.
pub fn write(frames: &FittedFrames, to: &mut dyn Write) -> io::Result<()> {
    writeln!(to, "{HEADER}")?;
    frames.write(to, |of_shot| {
        let shot = quoted(&of_shot.shot);
        let coordinates: Vec<&Row> =
            of_shot.rows.iter().filter(|row| row.quantity == Measured::Coordinate).collect();
        let line = |frame: &[&Row]| {
            let ball = match frame[0].ball {
                TrackedBall::Cue => "cue",
                TrackedBall::Object => "object",
            };
            let both = |of: &dyn Fn(&Row) -> String| format!("{},{}", of(frame[0]), of(frame[1]));
            format!(
                "{shot},{ball},{},{},{},{},{}\n",
                number(frame[0].time.unwrap_or(f64::NAN), MANY),
                both(&|row| cell(digits::to_error(row.measured, Some(row.sd)))),
                both(&|row| cell(digits::to_error(row.predicted, Some(row.sd)))),
                both(&|row| number(row.sd, FEW)),
                both(&|row| cell(digits::decimal(row.standardized()))),
            )
        };
        // x and y of a frame follow each other
        coordinates.chunks_exact(2).map(line).collect()
    })
}
