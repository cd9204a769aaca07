//! The text of a drafted dataset.toml: its keys, and the blanks that only the user can fill in.

use std::path::{Path, PathBuf};

use toml::Value;

/// A dataset.toml that was drafted.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Draft {
    /// The folder that the draft belongs in: the one that holds all the files.
    pub(crate) folder: PathBuf,
    /// Findings about the files, in sentences.
    pub(crate) found: Vec<String>,
    /// The names of the tracks, in the order of first appearance.
    pub(crate) tracks: Vec<String>,
    /// Frames per second that the times in the files follow, if they are in seconds.
    pub(crate) follows: Option<f64>,
    /// Whether the files show discs, and not balls.
    pub(crate) are_discs: bool,
    lines: Vec<Line>,
}

#[derive(Clone, Debug, PartialEq)]
struct Line {
    /// Empty for a comment and for a section's title.
    key: String,
    value: String,
    comment: String,
    state: State,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum State {
    Stated,
    /// Commented out, for the user to state.
    Optional,
    /// To be filled in; with its name in [`Draft::blanks`].
    Blank(&'static str),
}

/// Reason for which no dataset.toml can be drafted.
#[derive(Debug, thiserror::Error)]
#[error("{}: {message}", path.display())]
pub(crate) struct InitError {
    /// The file or the folder.
    pub(crate) path: PathBuf,
    /// The problem, and what was expected.
    pub(crate) message: String,
}

impl InitError {
    pub(super) fn new(path: &Path, message: impl Into<String>) -> Self {
        Self { path: path.to_path_buf(), message: message.into() }
    }

    pub(super) fn unread(path: &Path, error: &std::io::Error) -> Self {
        Self::new(path, format!("cannot be read: {error}"))
    }
}

/// The blanks of a draft that come first, the most important first.
const BLANKS: [&str; 5] = ["capture_fps", "length_unit", "which ball is which", "cue_spin", "radius_m"];

/// Placeholders of a number and of a text to be filled in.
pub(super) const NUMBER: &str = "…";
pub(super) const TEXT: &str = "\"…\"";

impl Draft {
    pub(super) fn line(&mut self, text: impl Into<String>) {
        self.add("", String::new(), text.into(), State::Stated);
    }

    /// Adds a key with its value as TOML writes it, and a comment if it is not empty.
    pub(super) fn state(&mut self, key: &str, value: impl Into<String>, comment: impl Into<String>) {
        self.add(key, value.into(), comment.into(), State::Stated);
    }

    /// Adds a key that the user may state, as a comment.
    pub(super) fn suggest(&mut self, key: &str, value: impl Into<String>, comment: impl Into<String>) {
        self.add(key, value.into(), comment.into(), State::Optional);
    }

    pub(super) fn blank(&mut self, name: &'static str, key: &str, value: &str, why: impl AsRef<str>) {
        self.add(key, value.into(), format!("FILL IN: {}", why.as_ref()), State::Blank(name));
    }

    fn add(&mut self, key: &str, value: String, comment: String, state: State) {
        self.lines.push(Line { key: key.to_owned(), value, comment, state });
    }

    pub(super) fn find(&mut self, sentence: impl Into<String>) {
        self.found.push(sentence.into());
    }

    /// Returns the text of the dataset.toml.
    #[must_use]
    pub fn text(&self) -> String {
        let line = |Line { key, value, comment, state }: &Line| {
            let mark = if *state == State::Stated { "" } else { "# " };
            match (key.is_empty(), comment.is_empty()) {
                (true, _) => format!("{comment}\n"),
                (false, true) => format!("{mark}{key} = {value}\n"),
                (false, false) => format!("{:<28} # {comment}\n", format!("{mark}{key} = {value}")),
            }
        };
        self.lines.iter().map(line).collect()
    }

    /// Returns the names of the keys that have to be filled in, the most important first.
    #[must_use]
    pub fn blanks(&self) -> Vec<&'static str> {
        let blank = |line: &Line| if let State::Blank(name) = line.state { Some(name) } else { None };
        let mut blanks: Vec<&str> = self.lines.iter().filter_map(blank).collect();
        let rank = |blank: &&str| BLANKS.iter().position(|known| known == blank);
        blanks.sort_by_key(|blank| rank(blank).unwrap_or(BLANKS.len()));
        blanks
    }

    /// States a key of the draft, whether stated, suggested or blank.
    pub fn set(&mut self, key: &str, value: impl Into<Value>) {
        if let Some(line) = self.lines.iter_mut().find(|line| line.key == key) {
            let (value, comment) = (value.into().to_string(), String::new());
            *line = Line { key: key.to_owned(), value, comment, state: State::Stated };
        }
    }

    /// Returns the value of a key that is stated, as TOML writes it.
    #[must_use]
    pub fn value(&self, key: &str) -> Option<&str> {
        let line = self.lines.iter().find(|line| line.key == key && line.state == State::Stated);
        line.map(|line| line.value.as_str())
    }

    /// States the camera's frame rate. Returns whether the times in the files are those of slow
    /// motion: of a film recorded more than 5 % faster than they follow.
    pub(crate) fn set_fps(&mut self, fps: f64) -> bool {
        self.set("capture_fps", fps);
        let slow = self.follows.filter(|follows| fps > 1.05 * follows);
        if let Some(follows) = slow {
            self.set("playback_fps", (1e4 * follows).round() / 1e4);
        }
        slow.is_some()
    }

    /// States the unit of lengths; in pixels y grows downwards.
    pub(crate) fn set_unit(&mut self, unit: &str) {
        self.set("length_unit", unit);
        if unit == "px" {
            self.set("y_axis", "down");
        }
    }
}

pub(super) fn quoted(text: &str) -> String {
    Value::from(text).to_string()
}
