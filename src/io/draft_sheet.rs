//! The text of a draft as it grows.

/// Marks a line that has to be filled in.
pub const BLANK: &str = "FILL IN";

/// The text as it grows.
pub(super) struct Sheet {
    pub text: String,
    pub found: Vec<String>,
    pub blanks: Vec<&'static str>,
}

impl Sheet {
    pub fn line(&mut self, line: &str) {
        self.text.push_str(line);
        self.text.push('\n');
    }

    pub fn blank(&mut self, what: &'static str, line: &str, why: &str) {
        self.line(&format!("{line:<28} # {BLANK}: {why}"));
        self.blanks.push(what);
    }
}

/// As TOML writes it.
pub(super) fn quoted(text: &str) -> String {
    toml::Value::from(text).to_string()
}
