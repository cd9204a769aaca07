//! What a report says, as a value: made once, walked by every renderer ([`super::text`], [`super::html`]), so that they cannot
//! disagree. It holds no markup and no layout.

use serde::Serialize;

use super::plot::Figure;
use crate::fit::Verdict;

/// A report: of a fit, or of a comparison.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// The title.
    pub title: String,
    /// Whether its numbers can be used.
    pub verdict: Verdict,
    /// Sentences that must not be overlooked, the most important first.
    pub warnings: Vec<String>,
    /// What was measured, and how it was fitted: names and texts.
    pub facts: Vec<[String; 2]>,
    /// The sections, in the order in which they are read.
    pub sections: Vec<Section>,
}

/// Facts, without those that have no text.
pub(super) fn facts<const N: usize>(facts: [(&str, String); N]) -> Vec<[String; 2]> {
    let facts = facts.into_iter().filter(|(_, text)| !text.is_empty());
    facts.map(|(name, text)| [name.to_owned(), text]).collect()
}

/// A section: what stands under one heading.
#[derive(Clone, Debug, Serialize)]
pub struct Section {
    /// The heading.
    pub title: String,
    /// What its numbers mean; empty where the heading says it.
    pub about: String,
    /// Its parts.
    pub blocks: Vec<Block>,
    /// Whether it is a detail, which pages show on request only.
    pub folded: bool,
}

impl Section {
    /// Returns a section; `None` if no part holds anything.
    pub(super) fn new(
        title: impl Into<String>,
        about: impl Into<String>,
        blocks: impl IntoIterator<Item = Block>,
    ) -> Option<Self> {
        let holds = |block: &Block| match block {
            Block::Lines(lines) => !lines.is_empty(),
            Block::Table(table) => !table.rows.is_empty(),
            Block::Shots(shots) => !shots.is_empty(),
            Block::Figure(figure) => !figure.drawing.rows.is_empty(),
            Block::Tracks(_) => true,
        };
        let blocks: Vec<Block> = blocks.into_iter().filter(holds).collect();
        let is_empty = blocks.is_empty();
        (!is_empty).then(|| Self { title: title.into(), about: about.into(), blocks, folded: false })
    }

    /// Returns the section of shots that were not used, with the reasons.
    pub(super) fn of_rejected(shots: impl IntoIterator<Item = [String; 2]>) -> Option<Self> {
        let table = Table::new(["shot", "why"], shots.into_iter().map(Vec::from));
        Self::new("Shots that were not used", "", [table.into()])
    }
}

/// A part of a section.
#[derive(Clone, Debug, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Block {
    /// Sentences, each a line.
    Lines(Vec<String>),
    /// A table.
    Table(Table),
    /// A picture, for renderers that can show one.
    Figure(Picture),
    /// The paths of the shots of a film as JSON, for renderers that can draw them instead of the picture before.
    Tracks(String),
    /// Shots one by one, for renderers that can fold them away.
    Shots(Vec<Shot>),
}

impl Block {
    /// Returns a figure that shows what `alt` says.
    pub(super) fn figure(alt: &'static str, drawing: Figure) -> Self {
        Self::Figure(Picture { alt, drawing, svg: String::new(), spots: String::new() })
    }
}

impl From<Table> for Block {
    fn from(table: Table) -> Self {
        Self::Table(table)
    }
}

/// Rows of cells below a head. A row that is shorter than the head ends with a cell that spans the rest.
#[derive(Clone, Debug, Serialize)]
pub struct Table {
    /// The headings of the columns.
    pub head: Vec<String>,
    /// Of each column whether it holds numbers, which are aligned to the right, but for cells that span the rest.
    pub right: Vec<bool>,
    /// The rows.
    pub rows: Vec<Vec<String>>,
    /// The page that the first cell of each row leads to, for renderers that have pages; empty without any.
    pub links: Vec<String>,
}

impl Table {
    /// Returns a table of text, aligned to the left.
    pub(super) fn new<T: Into<String>>(
        head: impl IntoIterator<Item = T>,
        rows: impl IntoIterator<Item = Vec<String>>,
    ) -> Self {
        let head: Vec<String> = head.into_iter().map(Into::into).collect();
        Self { right: vec![false; head.len()], head, rows: rows.into_iter().collect(), links: Vec::new() }
    }

    /// Returns the table with numbers in these columns, if a row reaches them.
    pub(super) fn with_numbers(mut self, columns: std::ops::Range<usize>) -> Self {
        let reached = self.rows.iter().any(|row| row.len() == self.head.len());
        self.right[columns].fill(reached);
        self
    }

    /// Whether a cell of a row spans the rest of the columns.
    pub(super) fn spans(&self, row: &[String], column: usize) -> bool {
        row.len() < self.head.len() && column + 1 == row.len()
    }
}

/// A picture.
#[derive(Clone, Debug, Serialize)]
pub struct Picture {
    /// What it shows, in words.
    pub alt: &'static str,
    /// What is drawn.
    #[serde(skip)]
    pub drawing: Figure,
    /// The picture as SVG text, once it is drawn.
    pub svg: String,
    /// Its measured points and what they stand for, as JSON; empty without any.
    pub spots: String,
}

/// One shot's measured values against the model.
#[derive(Clone, Debug, Serialize)]
pub struct Shot {
    /// A key that is unique in the report, by which pictures refer to it.
    pub id: String,
    /// The name of the shot.
    pub name: String,
    /// Its measured and predicted values.
    pub table: Table,
    /// Its place in the data.
    pub place: usize,
    /// Its largest standardized residual, by absolute value.
    pub largest: f64,
    /// The sum of its squared standardized residuals.
    pub chi2: f64,
}
