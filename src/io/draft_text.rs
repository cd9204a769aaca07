//! The text of a draft as it grows, and answers to what it leaves blank: the lines that say FILL
//! IN, with what is known put in.

use std::fmt::Display;
use std::path::{Path, PathBuf};

/// A dataset.toml that was drafted.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Draft {
    /// The folder that the draft belongs in: the one that holds all the files.
    pub folder: PathBuf,
    /// The text of the dataset.toml.
    pub text: String,
    /// What was found out about the files, in sentences.
    pub found: Vec<String>,
    /// The keys that have to be filled in, the most important first.
    pub blanks: Vec<&'static str>,
    /// The names of the tracks, in the order of first appearance.
    pub tracks: Vec<String>,
    /// Frames per second that the times in the files follow, where they are in seconds.
    pub follows: Option<f64>,
    /// Whether the files show discs, and not balls.
    pub are_discs: bool,
}

/// Why no dataset.toml can be drafted.
#[derive(Debug, thiserror::Error)]
#[error("{}: {message}", path.display())]
pub struct InitError {
    /// The file or the folder.
    pub path: PathBuf,
    /// What is wrong with it, and what was expected.
    pub message: String,
}

impl InitError {
    pub(super) fn new(path: &Path, message: impl Into<String>) -> Self {
        Self { path: path.to_path_buf(), message: message.into() }
    }

    pub(super) fn unread(path: &Path, error: &std::io::Error) -> Self {
        Self::new(path, format!("cannot be read: {error}"))
    }
}

/// Marks a line that has to be filled in.
const BLANK: &str = "FILL IN";

/// What a draft may leave blank, the most important first, and how its line begins. Only the user
/// knows the first four.
const BLANKS: [(&str, &str); 8] = [
    ("capture_fps", "# capture_fps = …"),
    ("length_unit", "# length_unit = \"…\""),
    ("which ball is which", "# cue = \"…\""),
    ("cue_spin", "# assume = \"…\""),
    ("radius_m", "# radius_m = …"),
    ("mass_kg", "# mass_kg = …"),
    ("cloth", "# cloth = \"…\""),
    ("source", "# source = \"…\""),
];

/// The line below that of the cue ball.
pub(super) const OBJECT: &str = "# object = \"…\"";

impl Draft {
    pub(super) fn line(&mut self, line: impl AsRef<str>) {
        self.text.push_str(line.as_ref());
        self.text.push('\n');
    }

    /// Adds a line with a comment behind it.
    pub(super) fn noted(&mut self, line: impl AsRef<str>, comment: impl Display) {
        self.line(format!("{:<28} # {comment}", line.as_ref()));
    }

    /// Adds a line that has to be filled in, one of [`BLANKS`].
    pub(super) fn blank(&mut self, what: &'static str, why: impl Display) {
        let line = BLANKS.iter().find(|(known, _)| *known == what).map_or("", |(_, line)| line);
        self.blank_line(what, line, why);
    }

    /// Adds any line that has to be filled in.
    pub(super) fn blank_line(&mut self, what: &'static str, line: &str, why: impl Display) {
        self.noted(line, format!("{BLANK}: {why}"));
        self.blanks.push(what);
    }

    /// Adds what was found out, in a sentence.
    pub(super) fn find(&mut self, sentence: impl Into<String>) {
        self.found.push(sentence.into());
    }

    pub(super) fn sort_blanks(&mut self) {
        let rank = |blank: &&str| BLANKS.iter().position(|(known, _)| known == blank);
        self.blanks.sort_by_key(|blank| rank(blank).unwrap_or(BLANKS.len()));
    }

    /// Puts lines of TOML in the place of a blank; returns whether there was such a blank.
    pub fn fill(&mut self, blank: &str, lines: &str) -> bool {
        let known = BLANKS[..4].iter().find(|(known, _)| *known == blank);
        let Some((_, place)) = known.filter(|_| self.blanks.contains(&blank)) else { return false };
        if blank == "which ball is which" {
            // both balls are one answer
            let rest = self.text.lines().filter(|line| !line.starts_with(OBJECT));
            self.text = rest.map(|line| format!("{line}\n")).collect();
        }
        self.replace(place, lines);
        self.blanks.retain(|known| *known != blank);
        true
    }

    /// Names the data set.
    pub fn set_name(&mut self, name: &str) {
        self.replace("name = ", &format!("name = {}", quoted(name)));
    }

    /// States which track is which ball.
    pub fn set_balls(&mut self, cue: &str, object: &str) {
        let [cue, object] = [format!("cue = {}", quoted(cue)), format!("object = {}", quoted(object))];
        if !self.fill("which ball is which", &format!("{cue}\n{object}")) {
            self.replace("cue = ", &cue);
            self.replace("object = ", &object);
        }
    }

    /// States the unit of lengths; in pixels y grows downwards.
    pub fn set_unit(&mut self, unit: &str) {
        let line = format!("length_unit = {}", quoted(unit));
        if !self.fill("length_unit", &line) {
            self.replace("length_unit = ", &line);
        }
        if unit == "px" {
            self.replace("y_axis = ", "y_axis = \"down\"");
        }
    }

    /// States the radius of the balls.
    pub fn set_radius(&mut self, radius_m: f64) {
        for place in ["radius_m = ", "# radius_m = …"] {
            self.replace(place, &format!("radius_m = {radius_m:?}"));
        }
    }

    /// Returns the radius of the balls that it states, as it is written.
    #[must_use]
    pub fn radius(&self) -> Option<&str> {
        let stated = self.text.lines().find_map(|line| line.strip_prefix("radius_m = "));
        stated.and_then(|line| line.split_whitespace().next())
    }

    /// States that the times in the files are those of slow motion, at the rate that they follow.
    pub fn set_playback(&mut self) {
        const PLACE: &str = "# playback_fps = ";
        let stated = self.text.lines().find_map(|line| line.strip_prefix(PLACE)?.split_whitespace().next());
        if let Some(line) = stated.map(|rate| format!("playback_fps = {rate}")) {
            self.replace(PLACE, &line);
        }
    }

    fn replace(&mut self, place: &str, line: &str) {
        let lines = self.text.lines().map(|own| if own.starts_with(place) { line } else { own });
        self.text = lines.map(|line| format!("{line}\n")).collect();
    }
}

/// Returns a text as TOML writes it.
pub(super) fn quoted(text: &str) -> String {
    toml::Value::from(text).to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blanks_are_filled_where_they_are() {
        let text = "radius_m = 0.028575   # a pool ball\n# capture_fps = …     # FILL IN: times follow 30\n\
                    # playback_fps = 30   # take the # away\nlength_unit = \"m\"   # as the file states\ny_axis = \"up\"\n\
                    # cue = \"…\"         # FILL IN: which\n# object = \"…\"      # and which\n";
        let blanks = vec!["capture_fps", "which ball is which"];
        let mut draft = Draft { text: text.to_owned(), blanks, ..Draft::default() };
        assert!(draft.fill("capture_fps", "capture_fps = 240"));
        assert!(
            !draft.fill("cue_spin", "assume = \"stun\"") && !draft.fill("capture_fps", "capture_fps = 1")
        );
        draft.set_balls("w", "y");
        draft.set_radius(0.03075);
        draft.set_playback();
        draft.set_unit("px");
        assert!(draft.blanks.is_empty());
        let expected = "radius_m = 0.03075\ncapture_fps = 240\nplayback_fps = 30\nlength_unit = \"px\"\ny_axis = \"down\"\n\
                        cue = \"w\"\nobject = \"y\"\n";
        assert_eq!(draft.text, expected);
    }
}
