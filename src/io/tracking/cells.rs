//! Cells as numbers: times and positions, with a check of their decimal marks.

use super::boxes::Rest;
use super::input::{Input, Row};
use super::layout::At;
use super::raw::{CLOCK, Clock, FORMAT, GAPS, RawTrack};
use super::settings::TimeUnit;
use super::timecode::{Style, count_frames, is_clock, seconds};
use crate::io::number::{Mark, Place, shortened};

/// Least likelihood of a position, unless stated: the default of `DeepLabCut`.
pub(super) const LIKELY: f64 = 0.6;

/// Reader of cells with the properties that all share.
pub(super) struct CellReader<'a> {
    input: &'a Input<'a>,
    times: Mark,
    positions: Mark,
    /// If times are those of a clock, how they are written, with the line of the first.
    clock: Option<(Style, usize)>,
    /// Whether a time was a plain number.
    is_plain: bool,
}

impl<'a> CellReader<'a> {
    pub(super) fn new(input: &'a Input<'a>) -> Self {
        let [times, positions] = [(); 2].map(|()| Mark::default());
        Self { input, times, positions, clock: None, is_plain: false }
    }

    /// Reads a time; `None` if the cell is empty or wrong.
    pub(super) fn time(&mut self, cell: Place) -> Option<f64> {
        match self.clock_time(cell) {
            Ok(Some(time)) => Some(time),
            Ok(None) => self.times.number(cell),
            Err(wrong) => {
                cell.wrong(format!("\"{}\" {wrong}", shortened(cell.text.trim())));
                None
            }
        }
    }

    /// Returns the seconds of a cell that is a time of a clock; `None` if the cell is to be a
    /// number.
    fn clock_time(&mut self, cell: Place) -> Result<Option<f64>, String> {
        if !is_clock(cell.text) {
            self.is_plain = true;
            return match self.clock {
                Some((_, at)) if !cell.text.trim().is_empty() => {
                    Err(format!("is a plain number, but line {at} h:mm:ss"))
                }
                _ => Ok(None),
            };
        }
        let Some((time, style)) = seconds(cell.text) else {
            return Err("is not a time; expected h:mm:ss.fff, h:mm:ss:cs or a number".to_string());
        };
        if self.is_plain {
            return Err("is h:mm:ss, but times above are plain numbers".to_string());
        }
        match (self.clock.get_or_insert((style, cell.line)), style) {
            // as many digits as any has
            ((Style::Fraction(most), _), Style::Fraction(digits)) => *most = digits.max(*most),
            ((other, at), _) if *other != style => {
                return Err(format!("is not written like the time in line {at}"));
            }
            _ => {}
        }
        Ok(Some(time))
    }

    /// Reads x and y, not numbers in a gap.
    pub(super) fn position(&mut self, row: &Row, columns: [usize; 2]) -> [f64; 2] {
        let found = self.input.problems.len();
        let cells = columns.map(|column| row.at(column));
        match cells.map(|cell| self.positions.number(cell)) {
            [Some(x), Some(y)] => return [x, y],
            [None, None] => {}
            _ if self.input.problems.len() == found => {
                let [x, y] = cells.map(|cell| shortened(cell.text.trim()));
                let [x_name, y_name] = cells.map(|cell| cell.column);
                let message =
                    format!("{x_name} \"{x}\" and {y_name} \"{y}\": half a position; taken as a gap");
                self.input.log.add(GAPS, row.line, message);
            }
            _ => {}
        }
        [f64::NAN; 2]
    }

    /// Reads the position of a ball: the middle of a box, and a gap if it is too unlikely.
    pub(super) fn place(&mut self, row: &Row, at: At) -> [f64; 2] {
        let corner = self.position(row, [at.x, at.y]);
        let middle = |rest: Rest| rest.middle(corner, self.position(row, rest.columns()));
        let place = at.rest.map_or(corner, middle);
        let likelihood = at.likelihood.and_then(|column| self.beside(row.at(column)));
        if place[0].is_nan() || likelihood.is_none_or(|likelihood| likelihood >= LIKELY) {
            return place;
        }
        let message = format!("a position of a likelihood below {LIKELY}: taken as a gap");
        self.input.log.add(GAPS, row.line, message);
        [f64::NAN; 2]
    }

    /// Reads the standard deviations of a position; NaN if they are missing.
    pub(super) fn deviations(&mut self, row: &Row, columns: [usize; 2]) -> [f64; 2] {
        columns.map(|column| {
            let cell = row.at(column);
            let sd = self.beside(cell);
            if let Some(sd) = sd.filter(|sd| *sd <= 0.0) {
                cell.wrong(format!("{sd} is not a standard deviation; expected more than 0"));
            }
            sd.unwrap_or(f64::NAN)
        })
    }

    /// Reads a number that goes with positions, such as an angle.
    pub(super) fn beside(&mut self, cell: Place) -> Option<f64> {
        self.positions.beside(cell)
    }

    /// Reports problems of all cells. Returns the clock if the times are of a clock; time codes
    /// become numbers of frames in the tracks.
    pub(super) fn finish<'t>(self, tracks: impl Iterator<Item = &'t mut RawTrack>) -> Option<Clock> {
        let Input { file, problems, log, .. } = *self.input;
        self.times.finish(file, problems);
        self.positions.finish(file, problems);
        match (self.positions.is_comma(), self.times.is_comma()) {
            (true, true) => log.add(FORMAT, None, "decimal comma"),
            (true, false) => log.add(FORMAT, None, "decimal comma in the coordinates, not in the times"),
            (false, true) => log.add(FORMAT, None, "decimal comma in the times, not in the coordinates"),
            (false, false) => {}
        }
        let (style, line) = self.clock?;
        if style == Style::Colon(2)
            && let Some(rate) = count_frames(&mut tracks.collect::<Vec<_>>())
        {
            let message = format!(
                "times are time codes, h:mm:ss:ff with {rate} frames to a second: read as numbers of frames"
            );
            log.add(CLOCK, line, message);
            return Some(Clock::In(TimeUnit::Frames));
        }
        Some(Clock::Rounded(style.resolution()))
    }
}
