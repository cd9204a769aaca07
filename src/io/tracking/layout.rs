//! The layout of a file: each format determines it, and one reader reads all files by it.

use super::boxes::Rest;
use super::heading::Heading;
use super::input::Input;
use super::raw::Clock;
use super::settings::Unit;
use super::units::AngleUnit;

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

/// Marker of a file in a known format without a layout; the reasons are among the problems.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Refused;

/// The layout of a file; `None` if the file is not in the format.
pub(super) type Detected = Option<Result<Layout, Refused>>;

/// Finds the layout of a file, if it is in a format.
pub(super) type Detect = fn(&Input) -> Detected;

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
    pub at: At,
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

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct At {
    pub x: usize,
    pub y: usize,
    /// The size or other corner of a box with a corner at x and y.
    pub rest: Option<Rest>,
    /// The column of the position's likelihood.
    pub likelihood: Option<usize>,
}

impl At {
    /// Returns the columns of the keys of `[tracks.columns]` that begin like this.
    pub(super) fn of(at: impl Fn(&str) -> Option<usize>, begin: &str) -> Option<Self> {
        let of = |key: &str| at(&format!("{begin}{key}"));
        Some(Self { x: of("x")?, y: of("y")?, rest: Rest::of(&at, begin), likelihood: of("likelihood") })
    }
}

impl Body {
    /// Returns a body with a fixed name and a position only.
    pub(super) fn new(name: impl Into<String>, x: usize, y: usize) -> Self {
        Self::at(Name::Fixed(name.into()), At { x, y, rest: None, likelihood: None })
    }

    /// Returns a body with a position only.
    pub(super) fn at(name: Name, at: At) -> Self {
        Self { name, point: None, at, sd: None, marker: None, angle: None }
    }

    fn lengths(&self) -> impl Iterator<Item = usize> {
        let rest = self.at.rest.map(Rest::columns);
        let pairs = [rest, self.sd, self.marker].into_iter().flatten();
        [self.at.x, self.at.y].into_iter().chain(pairs.flatten())
    }
}

impl Block {
    pub(super) fn below(heading: &Heading, bodies: Vec<Body>) -> Self {
        Self { header: heading.line, above: heading.above, last: usize::MAX, bodies }
    }
}

impl Layout {
    /// Returns the layout of a table that is one shot, with times in a column if there is one.
    pub(super) fn new(heading: Heading, blocks: Vec<Block>, time: Option<usize>, clock: Clock) -> Self {
        let [has_all_cells, may_lack_ball] = [false; 2];
        Self { heading, shot: None, time, clock, unit: None, has_all_cells, may_lack_ball, blocks }
    }

    pub(super) fn lengths(blocks: &[Block]) -> Vec<usize> {
        blocks.iter().flat_map(|block| &block.bodies).flat_map(Body::lengths).collect()
    }

    /// Returns the names that stand above the rows.
    pub(super) fn names(&self) -> impl Iterator<Item = &str> {
        self.blocks.iter().flat_map(|block| &block.bodies).filter_map(|body| match &body.name {
            Name::Fixed(name) => Some(name.as_str()),
            Name::Column(_) => None,
        })
    }
}
