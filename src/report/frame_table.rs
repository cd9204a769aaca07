//! frames.csv of films of balls: one row per ball and frame that was fitted, where the ball was seen and where the fit has it.

use std::io::{self, Write};

use super::csv::{push, push_number, quoted};
use crate::fit::FittedFilm;
use crate::measurement::track::TrackedBall;

/// The columns: lengths in m, as the film shows them at its stated scale; `ball` is cue or object;
/// `…_standardized` is (measured − predicted) / sd.
pub const HEADER: &str =
    "shot,ball,t_s,x_m,y_m,x_predicted_m,y_predicted_m,x_sd_m,y_sd_m,x_standardized,y_standardized";

/// Writes frames.csv shot by shot: there may be more frames than should be held in memory.
///
/// # Errors
/// Those of `to`.
pub fn write(film: &FittedFilm, to: &mut (dyn Write + Send)) -> io::Result<()> {
    writeln!(to, "{HEADER}")?;
    film.write(to, |of_shot, text| {
        let shot = quoted(&of_shot.shot);
        for frame in of_shot.frames.iter().filter(|frame| frame.used) {
            let ball = match frame.ball {
                TrackedBall::Cue => "cue",
                TrackedBall::Object => "object",
            };
            push(text, [&shot, ",", ball]);
            push_number(text, frame.time);
            let cells = [frame.seen, frame.predicted, frame.sd, frame.standardized()];
            cells.into_iter().flatten().for_each(|cell| push_number(text, cell));
            push(text, ["\n"]);
        }
    })
}
