//! frames.csv of a joint fit: one row per ball and frame that was fitted, where the ball was seen and where the fit has it.

use std::io::{self, Write};

use super::csv::{push, push_number, quoted};
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
pub fn write(frames: &FittedFrames, to: &mut (dyn Write + Send)) -> io::Result<()> {
    writeln!(to, "{HEADER}")?;
    frames.write(to, |of_shot, text| {
        let shot = quoted(&of_shot.shot);
        let coordinates: Vec<&Row> =
            of_shot.rows.iter().filter(|row| row.quantity == Measured::Coordinate).collect();
        let mut line = |frame: &[&Row]| {
            let ball = match frame[0].ball {
                TrackedBall::Cue => "cue",
                TrackedBall::Object => "object",
            };
            push(text, [&shot, ",", ball]);
            push_number(text, digits::significant(frame[0].time.unwrap_or(f64::NAN), MANY));
            let of: [fn(&Row) -> f64; 4] = [
                |row| digits::to_error(row.measured, Some(row.sd)),
                |row| digits::to_error(row.predicted, Some(row.sd)),
                |row| digits::significant(row.sd, FEW),
                |row| digits::decimal(row.standardized()),
            ];
            for of in of {
                for row in frame {
                    push_number(text, of(row));
                }
            }
            push(text, ["\n"]);
        };
        // x and y of a frame follow each other
        coordinates.chunks_exact(2).for_each(&mut line);
    })
}
