//! What a report says, as a value: made once, walked by every renderer ([`super::text`], [`super::html`]), so that they cannot
//! disagree. It holds no markup and no layout.

use serde::Serialize;

use super::plot;
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
    /// What was measured, and how it was fitted.
    pub facts: Vec<Fact>,
    /// The sections, in the order in which they are read.
    pub sections: Vec<Section>,
}

/// A short text with its name.
#[derive(Clone, Debug, Serialize)]
pub struct Fact {
    /// The name.
    pub name: &'static str,
    /// The text.
    pub text: String,
}

/// Facts, without those that have no text.
pub(super) fn facts<const N: usize>(facts: [(&'static str, String); N]) -> Vec<Fact> {
    let facts = facts.into_iter().map(|(name, text)| Fact { name, text });
    facts.filter(|fact| !fact.text.is_empty()).collect()
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
    pub(super) fn new(title: impl Into<String>, about: impl Into<String>, blocks: Vec<Block>) -> Self {
        Self { title: title.into(), about: about.into(), blocks, folded: false }
    }

    /// Of sentences alone.
    pub(super) fn lines(title: impl Into<String>, lines: Vec<String>) -> Self {
        Self::new(title, "", vec![Block::Lines(lines)])
    }

    /// Of a table alone.
    pub(super) fn table(title: impl Into<String>, about: impl Into<String>, table: Table) -> Self {
        Self::new(title, about, vec![Block::Table(table)])
    }

    /// Shots that were not used, with the reasons; `None` where there are none.
    pub(super) fn of_rejected(shots: impl IntoIterator<Item = [String; 2]>) -> Option<Self> {
        let table = Table::new(["shot", "why"], shots.into_iter().map(Vec::from));
        (!table.rows.is_empty()).then(|| Self::table("Shots that were not used", "", table))
    }

    /// Sentences that a reader may want to know; `None` where there are none.
    pub(super) fn of_notes(notes: Vec<String>) -> Option<Self> {
        (!notes.is_empty()).then(|| Self::lines("Notes", notes))
    }

    /// Shots one by one; `None` where there are none.
    pub(super) fn of_shots(shots: Vec<Shot>, about: &str) -> Option<Self> {
        let title = "Shots, the largest residuals first";
        (!shots.is_empty()).then(|| Self::new(title, about, vec![Block::Shots(shots)]))
    }

    /// Of a figure alone, which shows what `alt` says.
    pub(super) fn of_figure(title: &str, about: &str, alt: &'static str, drawing: plot::Figure) -> Self {
        Self::new(title, about, vec![Block::figure(alt, drawing)])
    }

    /// The same section, as a detail.
    pub(super) fn folded(self) -> Self {
        Self { folded: true, ..self }
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
    Figure(Figure),
    /// Other pages, for renderers that have them.
    Links(Vec<Link>),
    /// The paths of the shots of a film as JSON, for renderers that can draw them instead of the picture before.
    Tracks(String),
    /// Shots one by one, for renderers that can fold them away.
    Shots(Vec<Shot>),
}

impl Block {
    /// A figure that shows what `alt` says.
    pub(super) fn figure(alt: &'static str, drawing: plot::Figure) -> Self {
        Self::Figure(Figure { alt, drawing, svg: String::new(), spots: String::new() })
    }
}

/// A page that another one leads to.
#[derive(Clone, Debug, Serialize)]
pub struct Link {
    /// Its name.
    pub name: String,
    /// Its place, from the page that leads to it.
    pub place: String,
    /// What it says, in a sentence.
    pub text: String,
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
}

impl Table {
    /// Of text, aligned to the left.
    pub(super) fn new<T: Into<String>>(
        head: impl IntoIterator<Item = T>,
        rows: impl IntoIterator<Item = Vec<String>>,
    ) -> Self {
        let head: Vec<String> = head.into_iter().map(Into::into).collect();
        Self { right: vec![false; head.len()], head, rows: rows.into_iter().collect() }
    }

    /// The same with numbers in these columns, if a row reaches them.
    pub(super) fn with_numbers(mut self, columns: std::ops::Range<usize>) -> Self {
        let reached = self.rows.iter().any(|row| row.len() == self.head.len());
        self.right.iter_mut().take(columns.end).skip(columns.start).for_each(|right| *right = reached);
        self
    }

    /// Whether a cell of a row spans the rest of the columns.
    pub(super) fn spans(&self, row: &[String], column: usize) -> bool {
        row.len() < self.head.len() && column + 1 == row.len()
    }
}

/// A picture.
#[derive(Clone, Debug, Serialize)]
pub struct Figure {
    /// What it shows, in words.
    pub alt: &'static str,
    /// What is drawn.
    #[serde(skip)]
    pub drawing: plot::Figure,
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
