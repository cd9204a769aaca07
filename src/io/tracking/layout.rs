//! Which column of a file is what: each format finds it, and one reader reads all of them by it.

use super::boxes::Rest;
use super::heading::Heading;
use super::input::Input;
use super::raw::Clock;
use super::settings::Unit;
use super::units::AngleUnit;

/// What a format says of a file.
#[derive(Clone, Debug)]
pub(super) struct Layout {
    pub heading: Heading,
    pub shot: Option<usize>,
    /// `None`: the rows of a shot are counted.
    pub time: Option<usize>,
    /// The unit of the times, unless these are written h:mm:ss.
    pub clock: Clock,
    /// The unit of lengths, where the file or its format states it.
    pub unit: Option<Unit>,
    /// Whether a row has all cells: else programs and editors may drop empty ones at the end of a line.
    pub has_all_cells: bool,
    /// Whether a row may name no ball: a detection that belongs to no track, and is left out.
    pub may_lack_ball: bool,
    pub blocks: Vec<Block>,
}

/// Why a file that is in a known format has no layout: the reasons are among the problems.
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
    /// The rows are below this line,
    pub above: usize,
    /// and this is the last one.
    pub last: usize,
    pub bodies: Vec<Body>,
}

/// What was followed, and where a row has its position.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Body {
    pub name: Name,
    /// The column that names the point on the ball.
    pub point: Option<usize>,
    pub at: At,
    /// Standard deviations of the position.
    pub sd: Option<[usize; 2]>,
    /// The position of a marker on the ball.
    pub marker: Option<[usize; 2]>,
    /// How far a disc has turned.
    pub angle: Option<(usize, AngleUnit)>,
}

/// Where the name of a body stands.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Name {
    /// Above the rows.
    Fixed(String),
    /// In a column of a table with a row per ball and frame.
    Column(usize),
}

/// The columns of a position.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct At {
    pub x: usize,
    pub y: usize,
    /// Of a box that has a corner in x and y.
    pub rest: Option<Rest>,
    /// How likely the position is one.
    pub likelihood: Option<usize>,
}

impl At {
    /// Returns the columns that the keys of `[tracks.columns]` which begin like this name.
    pub(super) fn of(at: impl Fn(&str) -> Option<usize>, begin: &str) -> Option<Self> {
        let of = |key: &str| at(&format!("{begin}{key}"));
        Some(Self { x: of("x")?, y: of("y")?, rest: Rest::of(&at, begin), likelihood: of("likelihood") })
    }
}

impl Body {
    /// Returns a body with a plain position.
    pub(super) fn new(name: impl Into<String>, x: usize, y: usize) -> Self {
        Self::at(Name::Fixed(name.into()), At { x, y, rest: None, likelihood: None })
    }

    /// Returns a body with nothing but a position.
    pub(super) fn at(name: Name, at: At) -> Self {
        Self { name, point: None, at, sd: None, marker: None, angle: None }
    }

    /// Returns the columns that hold lengths.
    fn lengths(&self) -> impl Iterator<Item = usize> {
        let rest = self.at.rest.map(Rest::columns);
        let pairs = [rest, self.sd, self.marker].into_iter().flatten();
        [self.at.x, self.at.y].into_iter().chain(pairs.flatten())
    }
}

impl Block {
    /// Returns all rows below a heading.
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

    /// Returns the columns of all lengths.
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
