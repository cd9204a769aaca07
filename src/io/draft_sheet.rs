//! The text of a draft as it grows.

use std::fmt::Display;

/// Marks a line that has to be filled in.
pub const BLANK: &str = "FILL IN";

/// What a draft may leave blank, the most important first, and how its line begins. The first four nobody but the user knows.
pub(super) const BLANKS: [(&str, &str); 8] = [
    ("capture_fps", "# capture_fps = …"),
    ("length_unit", "# length_unit = \"…\""),
    ("which ball is which", "# cue = \"…\""),
    ("cue_spin", "# assume = \"…\""),
    ("radius_m", "# radius_m = …"),
    ("mass_kg", "# mass_kg = …"),
    ("cloth", "# cloth = \"…\""),
    ("source", "# source = \"…\""),
];

/// The line below that of the balls.
pub(super) const OBJECT: &str = "# object = \"…\"";

/// The text as it grows.
#[derive(Default)]
pub(super) struct Sheet {
    pub text: String,
    pub found: Vec<String>,
    pub blanks: Vec<&'static str>,
}

impl Sheet {
    pub fn line(&mut self, line: impl AsRef<str>) {
        self.text.push_str(line.as_ref());
        self.text.push('\n');
    }

    /// A line with a comment behind it.
    pub fn noted(&mut self, line: impl AsRef<str>, comment: impl Display) {
        self.line(format!("{:<28} # {comment}", line.as_ref()));
    }

    /// A line that has to be filled in, of [`BLANKS`].
    pub fn blank(&mut self, what: &'static str, why: impl Display) {
        let line = BLANKS.iter().find(|(known, _)| *known == what).map_or("", |(_, line)| line);
        self.blank_line(what, line, why);
    }

    /// The same, of another line.
    pub fn blank_line(&mut self, what: &'static str, line: &str, why: impl Display) {
        self.noted(line, format!("{BLANK}: {why}"));
        self.blanks.push(what);
    }

    /// What was found out, in a sentence.
    pub fn find(&mut self, sentence: impl Into<String>) {
        self.found.push(sentence.into());
    }
}

/// As TOML writes it.
pub(super) fn quoted(text: &str) -> String {
    toml::Value::from(text).to_string()
}
