//! What a report says, as a value: made once, walked by every renderer ([`super::text`], [`super::html`]), so that they cannot
//! disagree. It holds no markup and no layout.

use serde::Serialize;

/// A report: of a fit, or of a comparison.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Report {
    pub title: String,
    /// Whether its numbers can be used: a word, and the one sentence to read.
    pub verdict: Verdict,
    /// Sentences that must not be overlooked, the most important first.
    pub warnings: Vec<String>,
    /// What was measured, and how it was fitted.
    pub facts: Vec<Fact>,
    pub sections: Vec<Section>,
}

/// What stands first.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Verdict {
    pub grade: &'static str,
    pub sentence: String,
}

impl From<crate::fit::Verdict> for Verdict {
    fn from(found: crate::fit::Verdict) -> Self {
        Self { grade: found.grade.name(), sentence: found.sentence }
    }
}

/// Something in a word or two, and its name.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Fact {
    pub name: &'static str,
    pub text: String,
}

/// Facts, without those that have no text.
pub(super) fn facts<const N: usize>(facts: [(&'static str, String); N]) -> Vec<Fact> {
    let facts = facts.into_iter().map(|(name, text)| Fact { name, text });
    facts.filter(|fact| !fact.text.is_empty()).collect()
}

/// What stands under one heading.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Section {
    pub title: String,
    /// What its numbers mean; empty where the title says it.
    pub about: String,
    pub blocks: Vec<Block>,
    /// Whether it is a detail, which pages show on request only.
    pub folded: bool,
}

impl Section {
    pub fn new(title: impl Into<String>, about: impl Into<String>, blocks: Vec<Block>) -> Self {
        Self { title: title.into(), about: about.into(), blocks, folded: false }
    }

    /// The same as a detail.
    #[must_use]
    pub fn folded(self) -> Self {
        Self { folded: true, ..self }
    }
}

/// A part of a section.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Block {
    /// Sentences, each a line.
    Lines(Vec<String>),
    Table(Table),
    /// Only where pictures can be shown.
    Figure(Figure),
    /// Shots one by one, only where they can be folded.
    Shots(Vec<Shot>),
}

/// Rows of cells below a head. A row that is shorter than the head ends with a cell that spans the rest.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Table {
    pub head: Vec<Cell>,
    pub rows: Vec<Vec<Cell>>,
}

impl Table {
    pub fn new<const N: usize>(head: [&str; N], rows: impl IntoIterator<Item = Vec<Cell>>) -> Self {
        let rows: Vec<Vec<Cell>> = rows.into_iter().collect();
        // a head stands above its column as the first row does
        let align = |column: usize| {
            let cell = rows.iter().filter(|row| row.len() == N).find_map(|row| row.get(column));
            cell.map_or(Align::Left, |cell| cell.align)
        };
        let head = head.iter().enumerate().map(|(i, text)| Cell { text: (*text).into(), align: align(i) });
        Self { head: head.collect(), rows }
    }
}

/// A cell of a table.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Cell {
    pub text: String,
    pub align: Align,
}

impl Cell {
    pub fn text(text: impl Into<String>) -> Self {
        Self { text: text.into(), align: Align::Left }
    }

    /// A number among others above and below it.
    pub fn number(text: impl Into<String>) -> Self {
        Self { text: text.into(), align: Align::Right }
    }
}

/// To which side of its column a cell leans.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Align {
    Left,
    Right,
}

/// A picture.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Figure {
    /// For who cannot see it.
    pub alt: String,
    /// SVG text.
    pub svg: String,
}

/// One shot's measured values against the model.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Shot {
    /// Of its place in the report.
    pub id: String,
    pub name: String,
    pub table: Table,
    /// Its track.
    pub figure: Option<Figure>,
    /// Of its standardized residuals, by absolute value.
    #[serde(skip)]
    pub largest: f64,
}
