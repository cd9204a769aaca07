//! The layout of a file, which column is what: each format determines it, and one reader reads all
//! files by it.

use super::heading::Heading;
use super::input::{Input, Subject, listed, quoted};
use super::raw::Stated;
use super::settings::Format;
use super::units::Unit;
use crate::io::text::name_of;

#[derive(Clone, Debug)]
pub(super) struct Layout {
    pub(crate) heading: Heading,
    pub(crate) shot: Option<usize>,
    /// The column of times; `None`: the rows of a shot are counted.
    pub(crate) time: Option<usize>,
    pub(crate) stated: Stated,
    pub(crate) blocks: Vec<Block>,
}

/// Rows that are read by the same columns.
#[derive(Clone, Debug)]
pub(super) struct Block {
    /// The first line of its title and names, which ends the block above.
    pub(crate) begin: usize,
    /// The line above the rows.
    pub(crate) above: usize,
    pub(crate) bodies: Vec<Body>,
}

/// A tracked body, or a point on it, and the columns of its position.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Body {
    /// Its number among all bodies of the layout.
    pub(crate) index: usize,
    /// The name that stands above the rows; otherwise it is in the column `ball`.
    pub(crate) name: String,
    /// The columns that name the ball, and the point on it, in a table with a row per ball and
    /// frame.
    pub(crate) ball: Option<usize>,
    pub(crate) point: Option<usize>,
    pub(crate) part: Part,
    pub(crate) xy: [usize; 2],
    /// The columns of the other corner of a box with a corner at x and y, or of its size.
    pub(crate) corner: Option<[usize; 2]>,
    pub(crate) size: Option<[usize; 2]>,
    /// The columns of the position's likelihood, and of its standard deviations.
    pub(crate) likelihood: Option<usize>,
    pub(crate) sd: Option<[usize; 2]>,
}

/// The part of a body that the columns are of.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) enum Part {
    /// The centre, or a point that a column names.
    #[default]
    Centre,
    Marker,
    /// The angle of a disc, in the column x.
    Angle(Unit),
}

impl Body {
    /// Returns a body with a fixed name and a position only.
    pub(super) fn new(name: impl Into<String>, xy: [usize; 2]) -> Self {
        Self { name: name.into(), xy, ..Self::default() }
    }

    /// Returns the body with the columns of the keys that begin with `begin`, and its parts;
    /// `None` without x and y.
    pub(super) fn of_keys(
        name: &str,
        begin: &str,
        at: impl Fn(&str) -> Option<usize>,
        angle: Option<(usize, Unit)>,
    ) -> Option<Vec<Self>> {
        let of = |key: &str| at(&format!("{begin}{key}"));
        let pair = |one: &str, other: &str| Some([of(one)?, of(other)?]);
        let part = |part, xy| Self { ball: of("ball"), part, ..Self::new(name, xy) };
        let centre = Self {
            point: of("point"),
            corner: pair("x2", "y2"),
            size: pair("width", "height"),
            likelihood: of("likelihood"),
            sd: pair("x_sd", "y_sd"),
            ..part(Part::Centre, pair("x", "y")?)
        };
        let marker = pair("marker_x", "marker_y").map(|xy| part(Part::Marker, xy));
        let angle = angle.map(|(column, unit)| part(Part::Angle(unit), [column; 2]));
        Some([Some(centre), marker, angle].into_iter().flatten().collect())
    }

    fn lengths(&self) -> impl Iterator<Item = usize> {
        let is_length = !matches!(self.part, Part::Angle(_));
        let pairs = [Some(self.xy), self.corner, self.size, self.sd];
        pairs.into_iter().filter(move |_| is_length).flatten().flatten()
    }
}

impl Block {
    pub(super) fn below(heading: &Heading, bodies: Vec<Body>) -> Self {
        Self { begin: heading.line, above: heading.above, bodies }
    }
}

impl Layout {
    /// Returns the layout of blocks of rows with a column of times or, if the flag is set, of
    /// numbers of frames. Complains if the header contradicts itself or dataset.toml about units.
    pub(super) fn new(
        format: Format,
        heading: Heading,
        mut blocks: Vec<Block>,
        time: Option<(usize, bool)>,
        input: &Input,
    ) -> Self {
        let bodies = blocks.iter_mut().flat_map(|block| &mut block.bodies);
        bodies.enumerate().for_each(|(index, body)| body.index = index);
        let lengths = blocks.iter().flat_map(|block| &block.bodies).flat_map(Body::lengths);
        let unit = heading.unit(lengths, Unit::M, None, input);
        let unit_of_time = match time {
            Some((time, false)) => heading.time(time, input),
            _ => Unit::Frames,
        };
        let stated = Stated { format, unit, time: Some(unit_of_time), ..Stated::default() };
        Self { heading, shot: None, time: time.map(|(column, _)| column), stated, blocks }
    }

    /// Returns the block of the row in a line.
    pub(super) fn block(&self, line: usize) -> Option<&Block> {
        let begun = self.blocks.partition_point(|block| block.begin <= line);
        self.blocks[..begun].last().filter(|block| block.above < line)
    }

    pub(super) fn bodies(&self) -> impl Iterator<Item = &Body> {
        self.blocks.iter().flat_map(|block| &block.bodies)
    }

    pub(super) fn ball(&self) -> Option<usize> {
        self.bodies().find_map(|body| body.ball)
    }

    /// Returns whether no column and no names of columns separate the balls.
    pub(super) fn is_of_paths(&self) -> bool {
        self.stated.format == Format::Columns
            && self.bodies().all(|body| body.ball.is_none() && body.name.is_empty())
    }

    /// Notes how a file is read, and which of its columns are not.
    pub(super) fn note(&self, input: &Input) {
        let Heading { names, separator, above, .. } = &self.heading;
        let (format, separator, first) = (self.stated.format.shown(), name_of(*separator), above + 1);
        let mut message = format!("read as {format}, {separator} between cells, rows from line {first} on");
        let named = self.bodies().filter(|body| body.part == Part::Centre && !body.name.is_empty());
        let tracks = quoted(named.map(|body| &body.name));
        if !tracks.is_empty() {
            message += &format!(", tracks {tracks}");
        }
        let others = |body: &Body| [body.ball, body.point, body.likelihood, Some(body.xy[0])];
        let mut read: Vec<usize> = self.bodies().flat_map(Body::lengths).collect();
        read.extend(self.bodies().flat_map(others).chain([self.shot, self.time]).flatten());
        let is_passed = |(i, name): &(usize, &String)| {
            !read.contains(i) && !name.is_empty() && !name.starts_with("column ")
        };
        let passed: Vec<&String> = names.iter().enumerate().filter(is_passed).map(|(_, name)| name).collect();
        if !passed.is_empty() {
            message += &format!("; columns passed over: {}", listed(&passed));
        }
        if self.stated.format == Format::Kinovea {
            message += "; coordinates of its kinematics window are filtered, which smears an impact: export the trajectories";
        }
        input.job.note(Subject::Format, None, message);
    }
}
