//! The guide: what a user of the program reads, as `caromfit help TOPIC` prints it.
//!
//! | topic | about |
//! | --- | --- |
//! | [`films`] | footage: what to film, dataset.toml, the camera, discs |
//! | [`formats`] | files and dataset.toml, with every key and column |
//! | [`results`] | the report, the verdicts, fit.json, the tables, Python |
//! | [`model`] | the physics, what it leaves out, accuracy against time |
//! | [`methods`] | how fits and comparisons are made, and how they were tried |
//! | [`glossary`] | the words, from cut angle to profile |

#[doc = include_str!("guide/films.md")]
pub mod films {}
#[doc = include_str!("guide/formats.md")]
pub mod formats {}
#[doc = include_str!("guide/results.md")]
pub mod results {}
#[doc = include_str!("guide/model.md")]
pub mod model {}
#[doc = include_str!("guide/methods.md")]
pub mod methods {}
#[doc = include_str!("guide/glossary.md")]
pub mod glossary {}

/// A page of the guide.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Topic {
    /// The name by which `caromfit help` finds it.
    pub name: &'static str,
    /// Its subject, in a line.
    pub about: &'static str,
    /// The text, in Markdown.
    pub text: &'static str,
}

const fn topic(name: &'static str, about: &'static str, text: &'static str) -> Topic {
    Topic { name, about, text }
}

/// All pages, in the order in which they are best read.
pub const TOPICS: [Topic; 6] = [
    topic("films", "what to film, how to describe it, the camera, discs", include_str!("guide/films.md")),
    topic("formats", "files and dataset.toml, with every key and column", include_str!("guide/formats.md")),
    topic(
        "results",
        "the report, the verdicts, fit.json, the tables, Python",
        include_str!("guide/results.md"),
    ),
    topic("model", "the physics, what it leaves out, accuracy against time", include_str!("guide/model.md")),
    topic(
        "methods",
        "how fits, comparisons and designs are made, and how they were tried",
        include_str!("guide/methods.md"),
    ),
    topic("glossary", "the words, from cut angle to profile", include_str!("guide/glossary.md")),
];
