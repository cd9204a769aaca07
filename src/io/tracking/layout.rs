//! The layout of a file: each format determines it, and one reader reads all files by it.

use super::heading::Heading;
use super::input::{Input, Subject, quoted};
use super::raw::Clock;
use super::settings::Format;
use super::units::{AngleUnit, TimeUnit, Unit};
use super::words::Rest;

#[derive(Clone, Debug)]
pub(super) struct Layout {
    pub(crate) format: Format,
    pub(crate) heading: Heading,
    pub(crate) shot: Option<usize>,
    /// The column of times; `None`: the rows of a shot are counted.
    pub(crate) time: Option<usize>,
    /// The unit of the times, unless these are written h:mm:ss.
    pub(crate) clock: Clock,
    /// The unit of lengths, if the file or its format states it.
    pub(crate) unit: Option<Unit>,
    /// Whether every row has all cells; otherwise empty ones at its end may be missing.
    pub(crate) has_all_cells: bool,
    /// The number of rows that the file states.
    pub(crate) rows: Option<f64>,
    pub(crate) blocks: Vec<Block>,
}

/// Rows that are read by the same columns.
#[derive(Clone, Debug)]
pub(super) struct Block {
    /// The line of the names of columns.
    pub(crate) header: usize,
    /// The line above the rows.
    pub(crate) above: usize,
    /// The line of the last row.
    pub(crate) last: usize,
    pub(crate) bodies: Vec<Body>,
}

/// A tracked body, and the columns of its position.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Body {
    pub(crate) name: Name,
    /// The column that names the point on the ball.
    pub(crate) point: Option<usize>,
    pub(crate) xy: [usize; 2],
    /// The size or other corner of a box with a corner at x and y.
    pub(crate) rest: Option<Rest>,
    /// The column of the position's likelihood.
    pub(crate) likelihood: Option<usize>,
    /// The columns of the position's standard deviations.
    pub(crate) sd: Option<[usize; 2]>,
    /// The columns of a marker on the ball.
    pub(crate) marker: Option<[usize; 2]>,
    /// The column of a disc's angle, and its unit.
    pub(crate) angle: Option<(usize, AngleUnit)>,
}

/// Source of the name of a body.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Name {
    /// The name stands above the rows.
    Fixed(String),
    /// The name stands in a column, in a table with a row per ball and frame.
    Column(usize),
}

impl Body {
    /// Returns a body with a fixed name and a position only.
    pub(super) fn new(name: impl Into<String>, xy: [usize; 2]) -> Self {
        let name = Name::Fixed(name.into());
        Self { name, point: None, xy, rest: None, likelihood: None, sd: None, marker: None, angle: None }
    }

    /// Returns the body with the columns of the keys of `[tracks.columns]` that begin like this.
    pub(super) fn of_keys(name: Name, begin: &str, at: impl Fn(&str) -> Option<usize>) -> Option<Self> {
        let of = |key: &str| at(&format!("{begin}{key}"));
        let pair = |one: &str, other: &str| Some([of(one)?, of(other)?]);
        let rest = |one: &str, other: &str, is_size| Some(Rest { columns: pair(one, other)?, is_size });
        Some(Self {
            name,
            point: of("point"),
            xy: pair("x", "y")?,
            rest: rest("x2", "y2", false).or_else(|| rest("width", "height", true)),
            likelihood: of("likelihood"),
            sd: pair("x_sd", "y_sd"),
            marker: pair("marker_x", "marker_y"),
            angle: None,
        })
    }

    fn lengths(&self) -> impl Iterator<Item = usize> {
        let pairs = [Some(self.xy), self.rest.map(|rest| rest.columns), self.sd, self.marker];
        pairs.into_iter().flatten().flatten()
    }
}

impl Block {
    pub(super) fn below(heading: &Heading, bodies: Vec<Body>) -> Self {
        Self { header: heading.line, above: heading.above, last: usize::MAX, bodies }
    }
}

impl Layout {
    /// Returns the layout of blocks of rows with a column of times or, if the flag is set, of numbers
    /// of frames. Complains if the header contradicts itself or dataset.toml about units.
    pub(super) fn new(
        format: Format,
        heading: Heading,
        blocks: Vec<Block>,
        time: Option<(usize, bool)>,
        input: &Input,
    ) -> Self {
        let lengths = blocks.iter().flat_map(|block| &block.bodies).flat_map(Body::lengths);
        let unit = heading.length(&lengths.collect::<Vec<_>>(), input);
        let unit_of_times = match time {
            Some((time, false)) => heading.time(time, input),
            _ => TimeUnit::Frames,
        };
        Self {
            format,
            heading,
            shot: None,
            time: time.map(|(column, _)| column),
            clock: Clock::In(unit_of_times),
            unit,
            has_all_cells: false,
            rows: None,
            blocks,
        }
    }

    pub(super) fn bodies(&self) -> impl Iterator<Item = &Body> {
        self.blocks.iter().flat_map(|block| &block.bodies)
    }

    pub(super) fn ball(&self) -> Option<usize> {
        self.bodies().find_map(|body| if let Name::Column(column) = body.name { Some(column) } else { None })
    }

    pub(super) fn names(&self) -> impl Iterator<Item = &str> {
        self.bodies().filter_map(|body| match &body.name {
            Name::Fixed(name) if !name.is_empty() => Some(name.as_str()),
            _ => None,
        })
    }

    fn is_read(&self, column: usize) -> bool {
        let is_of = |body: &Body| {
            let angle = body.angle.map(|(column, _)| column);
            body.lengths().chain(body.point).chain(body.likelihood).chain(angle).any(|own| own == column)
        };
        [self.shot, self.time, self.ball()].contains(&Some(column)) || self.bodies().any(is_of)
    }

    /// Notes how a file is read, and which of its columns are not.
    pub(super) fn note(&self, input: &Input) {
        /// Maximum number of columns listed.
        const MAX_NAMED: usize = 12;
        let Heading { names, separator, above, .. } = &self.heading;
        let mut passed: Vec<&String> =
            (0..names.len()).filter(|i| !self.is_read(*i)).map(|i| &names[i]).collect();
        passed.retain(|name| !name.is_empty() && !name.starts_with("column "));
        let mut message = format!(
            "read as {}, {} between cells, rows from line {} on",
            self.format.shown(),
            separator.name(),
            above + 1
        );
        let tracks = quoted(self.names());
        if !tracks.is_empty() {
            message += &format!(", tracks {tracks}");
        }
        if !passed.is_empty() {
            let more = passed.len().saturating_sub(MAX_NAMED);
            let more = if more > 0 { format!(" and {more} more") } else { String::new() };
            message +=
                &format!("; columns passed over: {}{more}", quoted(passed.into_iter().take(MAX_NAMED)));
        }
        if self.format == Format::Kinovea {
            message += "; coordinates of its kinematics window are filtered, which smears an impact: export the trajectories";
        }
        input.log.add(Subject::Format, None, message);
    }
}
