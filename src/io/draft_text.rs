//! The text of a drafted dataset.toml: parts of a template, and the blanks that only the user can
//! fill in.

use std::path::PathBuf;

use toml::Value;

/// Parts of a dataset.toml, each below a line with @ and its name.
const TEMPLATE: &str = include_str!("draft.toml");

/// Beginning of the comment of a key that the user has to state.
const FILL_IN: &str = "FILL IN: ";

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
pub(super) struct Line {
    /// Empty for a comment and for a section's title.
    pub(super) key: String,
    /// The value as TOML writes it.
    pub(super) value: String,
    pub(super) comment: String,
    /// Whether it is commented out, for the user to state.
    pub(super) is_open: bool,
}

impl Line {
    /// Returns a line of the template.
    fn of(text: &str) -> Self {
        let bare = text.strip_prefix("# ").unwrap_or(text);
        match bare.split_once(" = ") {
            Some((key, rest)) if !key.contains(' ') => {
                let (value, comment) = rest.split_once(" # ").unwrap_or((rest, ""));
                let (key, value, comment) = (key.to_owned(), value.trim().to_owned(), comment.to_owned());
                Self { key, value, comment, is_open: bare != text }
            }
            _ => Self { comment: text.to_owned(), ..Self::default() },
        }
    }

    fn text(&self) -> String {
        let Self { key, value, comment, is_open } = self;
        let mark = if *is_open { "# " } else { "" };
        match (key.is_empty(), comment.is_empty()) {
            (true, _) => format!("{comment}\n"),
            (false, true) => format!("{mark}{key} = {value}\n"),
            (false, false) => format!("{:<28} # {comment}\n", format!("{mark}{key} = {value}")),
        }
    }
}

impl Draft {
    /// Adds a part of the template, in which `words` stand for names in braces.
    pub(super) fn add(&mut self, part: &str, words: &[(&str, &str)]) {
        let parts = TEMPLATE.split('@').filter_map(|text| text.split_once('\n'));
        let lines = parts.filter(|(name, _)| *name == part).flat_map(|(_, text)| text.lines());
        self.lines.extend(lines.map(|line| {
            let fill = |line: String, (name, word): &(&str, &str)| line.replace(&format!("{{{name}}}"), word);
            Line::of(&words.iter().fold(line.to_owned(), fill))
        }));
    }

    pub(super) fn push(&mut self, line: Line) {
        self.lines.push(line);
    }

    pub(super) fn find(&mut self, sentence: impl Into<String>) {
        self.found.push(sentence.into());
    }

    /// Returns the text of the dataset.toml.
    pub(crate) fn text(&self) -> String {
        self.lines.iter().map(Line::text).collect()
    }

    /// Returns the names of what has to be filled in.
    pub(crate) fn blanks(&self) -> Vec<&str> {
        let blanks = self.lines.iter().filter(|line| line.is_open && line.comment.starts_with(FILL_IN));
        let keys = blanks.map(|line| line.key.as_str());
        let named = keys.map(|key| match key {
            "assume" => "cue_spin",
            "cue" => "which ball is which",
            "t" => "which column is what",
            key => key,
        });
        named.collect()
    }

    /// States a key of the draft, whether stated, suggested or blank.
    pub(crate) fn set(&mut self, key: &str, value: impl Into<Value>) {
        self.state(key, value, "");
    }

    /// States a key of the draft, with a comment if it is not empty.
    pub(super) fn state(&mut self, key: &str, value: impl Into<Value>, comment: &str) {
        if let Some(line) = self.lines.iter_mut().find(|line| line.key == key) {
            let (key, value, comment) = (key.to_owned(), value.into().to_string(), comment.to_owned());
            *line = Line { key, value, comment, is_open: false };
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
