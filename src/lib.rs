#![doc = include_str!("guide/library.md")]
#![cfg_attr(feature = "report", doc = include_str!("guide/library-fits.md"))]
//!
//! The [`guide`] has the pages of `caromfit help`.
//!
//! A Cargo feature that a program does not need can be left out: `cli`, the program itself, builds
//! on `report`, that on `io`, that on `fit`, and all are there by default. Without any, [`physics`]
//! is left.

// the library answers with values, never with a panic or a line on the terminal
#![cfg_attr(
    not(test),
    warn(
        clippy::unwrap_used,
        clippy::expect_used,
        clippy::panic,
        clippy::print_stdout,
        clippy::print_stderr
    )
)]
// the program uses all of the library
#![cfg_attr(not(feature = "cli"), allow(dead_code))]
// the front page names all modules, also those that were left out
#![cfg_attr(not(feature = "report"), allow(rustdoc::broken_intra_doc_links))]

#[cfg(feature = "cli")]
#[doc(hidden)]
pub mod cli;
#[cfg(feature = "fit")]
pub mod compare;
#[cfg(feature = "io")]
pub mod design;
#[cfg(feature = "fit")]
mod film;
#[cfg(feature = "fit")]
pub mod fit;
#[cfg(feature = "report")]
pub mod guide;
#[cfg(feature = "io")]
pub mod io;
#[cfg(feature = "fit")]
pub mod measurement;
pub mod name;
pub mod numerics;
pub mod physics;
#[cfg(feature = "fit")]
mod problem;
#[cfg(feature = "report")]
pub mod report;
#[cfg(feature = "io")]
pub mod simulate;
#[cfg(feature = "io")]
mod studies;
#[cfg(feature = "fit")]
mod words;
