//! The guide: what a user of the program reads, as `caromfit help TOPIC` prints it.

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

macro_rules! topics {
    ($($name:ident: $about:literal,)+) => {
        $(
            #[doc = include_str!(concat!("guide/", stringify!($name), ".md"))]
            pub mod $name {}
        )+

        /// All pages, in the order in which they are best read.
        pub const TOPICS: [Topic; [$(stringify!($name)),+].len()] = [$(Topic {
            name: stringify!($name),
            about: $about,
            text: include_str!(concat!("guide/", stringify!($name), ".md")),
        }),+];
    };
}

topics! {
    films: "what to film, how to describe it, the camera, discs",
    formats: "files and dataset.toml, with every key and column",
    results: "the report, the verdicts, fit.json, the tables, Python",
    model: "the physics, what it leaves out, accuracy against time",
    methods: "how fits, comparisons and designs are made, and how they were tried",
    glossary: "the words, from cut angle to profile",
}
