//! The text of a drafted dataset.toml: its keys, and the blanks that only the user can fill in.

use std::path::PathBuf;

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

#[derive(Clone, Debug, Default, PartialEq)]
struct Line {
    /// Empty for a comment and for a section's title.
    key: String,
    value: String,
    comment: String,
    /// Whether it is commented out, for the user to state.
    is_open: bool,
    /// The name of what the user has to fill in.
    blank: Option<&'static str>,
}

/// Placeholders of a number and of a text to be filled in.
pub(super) const NUMBER: &str = "…";
pub(super) const TEXT: &str = "\"…\"";

impl Draft {
    pub(super) fn line(&mut self, text: impl Into<String>) {
        self.lines.push(Line { comment: text.into(), ..Line::default() });
    }

    /// Adds a key with its value as TOML writes it, and a comment if it is not empty.
    pub(super) fn state(&mut self, key: &str, value: impl Into<String>, comment: impl Into<String>) {
        let (key, value, comment) = (key.to_owned(), value.into(), comment.into());
        self.lines.push(Line { key, value, comment, ..Line::default() });
    }

    /// Adds a key that the user may state, as a comment.
    pub(super) fn suggest(&mut self, key: &str, value: impl Into<String>, comment: impl Into<String>) {
        let (key, value, comment) = (key.to_owned(), value.into(), comment.into());
        self.lines.push(Line { key, value, comment, is_open: true, blank: None });
    }

    pub(super) fn blank(&mut self, name: &'static str, key: &str, value: &str, why: impl AsRef<str>) {
        let (key, value, comment) = (key.to_owned(), value.to_owned(), format!("FILL IN: {}", why.as_ref()));
        self.lines.push(Line { key, value, comment, is_open: true, blank: Some(name) });
    }

    pub(super) fn find(&mut self, sentence: impl Into<String>) {
        self.found.push(sentence.into());
    }

    /// Returns the text of the dataset.toml.
    pub(crate) fn text(&self) -> String {
        let line = |Line { key, value, comment, is_open, .. }: &Line| {
            let mark = if *is_open { "# " } else { "" };
            match (key.is_empty(), comment.is_empty()) {
                (true, _) => format!("{comment}\n"),
                (false, true) => format!("{mark}{key} = {value}\n"),
                (false, false) => format!("{:<28} # {comment}\n", format!("{mark}{key} = {value}")),
            }
        };
        self.lines.iter().map(line).collect()
    }

    /// Returns the names of what has to be filled in.
    pub(crate) fn blanks(&self) -> Vec<&'static str> {
        self.lines.iter().filter_map(|line| line.blank).collect()
    }

    /// States a key of the draft, whether stated, suggested or blank.
    pub(crate) fn set(&mut self, key: &str, value: impl Into<Value>) {
        if let Some(line) = self.lines.iter_mut().find(|line| line.key == key) {
            *line = Line { key: key.to_owned(), value: value.into().to_string(), ..Line::default() };
        }
    }

    /// Returns the value of a key that is stated, as TOML writes it.
    pub(crate) fn value(&self, key: &str) -> Option<&str> {
        let line = self.lines.iter().find(|line| line.key == key && !line.is_open);
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
