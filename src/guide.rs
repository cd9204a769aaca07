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
    /// What it is about, in a line.
    pub about: &'static str,
    /// The text, in Markdown.
    pub text: &'static str,
}

/// All pages, in the order in which they are best read.
pub const TOPICS: [Topic; 6] = [
    Topic {
        name: "films",
        about: "what to film, how to describe it, the camera, discs",
        text: include_str!("guide/films.md"),
    },
    Topic {
        name: "formats",
        about: "files and dataset.toml, with every key and column",
        text: include_str!("guide/formats.md"),
    },
    Topic {
        name: "results",
        about: "the report, the verdicts, fit.json, the tables, Python",
        text: include_str!("guide/results.md"),
    },
    Topic {
        name: "model",
        about: "the physics, what it leaves out, accuracy against time",
        text: include_str!("guide/model.md"),
    },
    Topic {
        name: "methods",
        about: "how fits, comparisons and designs are made, and how they were tried",
        text: include_str!("guide/methods.md"),
    },
    Topic {
        name: "glossary",
        about: "the words, from cut angle to profile",
        text: include_str!("guide/glossary.md"),
    },
];
