//! The layout of a file: each format determines it, and one reader reads all files by it.

use super::heading::Heading;
use super::input::Input;
use super::raw::Clock;
use super::units::{AngleUnit, TimeUnit, Unit};
use super::words::Rest;

#[derive(Clone, Debug)]
pub(super) struct Layout {
    pub heading: Heading,
    pub shot: Option<usize>,
    /// The column of times; `None`: the rows of a shot are counted.
    pub time: Option<usize>,
    /// The unit of the times, unless these are written h:mm:ss.
    pub clock: Clock,
    /// The unit of lengths, if the file or its format states it.
    pub unit: Option<Unit>,
    /// Whether every row has all cells; otherwise empty ones at its end may be missing.
    pub has_all_cells: bool,
    /// Whether rows may lack a ball: detections that belong to no track are left out.
    pub may_lack_ball: bool,
    pub blocks: Vec<Block>,
}

/// Returns the layout of a file; `None` if it is in another format or, with a problem, faulty.
pub(super) type Detect = fn(&Input) -> Option<Layout>;

/// Rows that are read by the same columns.
#[derive(Clone, Debug)]
pub(super) struct Block {
    /// The line of the names of columns.
    pub header: usize,
    /// The line above the rows.
    pub above: usize,
    /// The line of the last row.
    pub last: usize,
    pub bodies: Vec<Body>,
}

/// A tracked body, and the columns of its position.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Body {
    pub name: Name,
    /// The column that names the point on the ball.
    pub point: Option<usize>,
    pub xy: [usize; 2],
    /// The size or other corner of a box with a corner at x and y.
    pub rest: Option<Rest>,
    /// The column of the position's likelihood.
    pub likelihood: Option<usize>,
    /// The columns of the position's standard deviations.
    pub sd: Option<[usize; 2]>,
    /// The columns of a marker on the ball.
    pub marker: Option<[usize; 2]>,
    /// The column of a disc's angle, and its unit.
    pub angle: Option<(usize, AngleUnit)>,
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
}

impl Layout {
    /// Returns the layout of rows below a header, with a column of times or, if the flag is set, of
    /// numbers of frames. Complains if the header contradicts itself or dataset.toml about units.
    pub(super) fn below(
        heading: Heading,
        bodies: Vec<Body>,
        time: Option<(usize, bool)>,
        input: &Input,
    ) -> Self {
        let Heading { line: header, above, .. } = heading;
        Self::of_blocks(heading, vec![Block { header, above, last: usize::MAX, bodies }], time, input)
    }

    /// Returns the layout of several blocks of rows, as [`Layout::below`] does.
    pub(super) fn of_blocks(
        heading: Heading,
        blocks: Vec<Block>,
        time: Option<(usize, bool)>,
        input: &Input,
    ) -> Self {
        let lengths = blocks.iter().flat_map(|block| &block.bodies).flat_map(|body| {
            let pairs = [Some(body.xy), body.rest.map(|rest| rest.columns), body.sd, body.marker];
            pairs.into_iter().flatten().flatten()
        });
        let unit = heading.length(&lengths.collect::<Vec<_>>(), input);
        let unit_of_times = match time {
            Some((time, false)) => heading.time(time, input),
            _ => TimeUnit::Frames,
        };
        Self {
            heading,
            shot: None,
            time: time.map(|(column, _)| column),
            clock: Clock::In(unit_of_times),
            unit,
            has_all_cells: false,
            may_lack_ball: false,
            blocks,
        }
    }

    pub(super) fn bodies(&self) -> impl Iterator<Item = &Body> {
        self.blocks.iter().flat_map(|block| &block.bodies)
    }

    /// Returns the names that stand above the rows.
    pub(super) fn names(&self) -> impl Iterator<Item = &str> {
        self.bodies().filter_map(|body| match &body.name {
            Name::Fixed(name) => Some(name.as_str()),
            Name::Column(_) => None,
        })
    }
}
