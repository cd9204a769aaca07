//! Answers to what a draft leaves blank: the lines that say FILL IN, with what is known put in.

use super::draft::Draft;
use super::draft_sheet::{BLANK, BLANKS, OBJECT, quoted};

impl Draft {
    /// Puts lines of TOML in the place of a blank; whether there was such a blank.
    pub fn fill(&mut self, blank: &str, lines: &str) -> bool {
        let known = BLANKS[..4].iter().find(|(known, _)| *known == blank);
        let Some((_, place)) = known.filter(|_| self.blanks.contains(&blank)) else { return false };
        // both balls are one answer
        let follows = |line: &&str| blank == "which ball is which" && line.starts_with(OBJECT);
        let is_place = |line: &str| line.starts_with(place) && line.contains(BLANK);
        let rest = self.text.lines().filter(|line| !follows(line));
        let filled = rest.map(|line| if is_place(line) { lines } else { line });
        self.text = filled.collect::<Vec<_>>().join("\n") + "\n";
        self.blanks.retain(|known| *known != blank);
        true
    }

    /// Names the data set.
    pub fn set_name(&mut self, name: &str) {
        self.replace("name = ", &format!("name = {}", quoted(name)));
    }

    /// States which track is which ball.
    pub fn set_balls(&mut self, cue: &str, object: &str) {
        let lines = format!("cue = {}\nobject = {}", quoted(cue), quoted(object));
        if !self.fill("which ball is which", &lines) {
            self.replace("cue = ", &format!("cue = {}", quoted(cue)));
            self.replace("object = ", &format!("object = {}", quoted(object)));
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
        self.replace("radius_m = ", &format!("radius_m = {radius_m:?}"));
        self.replace("# radius_m = …", &format!("radius_m = {radius_m:?}"));
    }

    /// The radius of the balls that it states, as it is written; `None` where there is none.
    #[must_use]
    pub fn radius(&self) -> Option<&str> {
        let stated = self.text.lines().find_map(|line| line.strip_prefix("radius_m = "));
        stated.and_then(|line| line.split_whitespace().next())
    }

    /// The times in the files are those of slow motion, as the rate that they follow says.
    pub fn set_playback(&mut self) {
        const PLACE: &str = "# playback_fps = ";
        let stated = self.text.lines().find(|line| line.starts_with(PLACE));
        let line = stated.and_then(|line| line.trim_start_matches("# ").split('#').next()).map(str::to_owned);
        if let Some(line) = line {
            self.replace(PLACE, line.trim_end());
        }
    }

    fn replace(&mut self, place: &str, line: &str) {
        let lines = self.text.lines().map(|own| if own.starts_with(place) { line } else { own });
        self.text = lines.collect::<Vec<_>>().join("\n") + "\n";
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blanks_are_filled_where_they_are() {
        let text = "\
[ball]
radius_m = 0.028575   # a pool ball
[video]
# capture_fps = …     # FILL IN: times follow 30
# playback_fps = 30   # take the # away
[scale]
length_unit = \"m\"   # as the file states
y_axis = \"up\"
[tracks]
# cue = \"…\"         # FILL IN: which
# object = \"…\"      # and which
";
        let blanks = vec!["capture_fps", "which ball is which"];
        let mut draft = Draft {
            folder: std::path::PathBuf::new(),
            text: text.to_owned(),
            found: Vec::new(),
            blanks,
            tracks: Vec::new(),
            follows: Some(30.0),
            are_discs: false,
        };
        assert!(draft.fill("capture_fps", "capture_fps = 240"));
        assert!(draft.fill("which ball is which", "cue = \"w\"\nobject = \"y\""));
        assert!(
            !draft.fill("cue_spin", "assume = \"stun\"") && !draft.fill("capture_fps", "capture_fps = 1")
        );
        draft.set_radius(0.03075);
        draft.set_playback();
        draft.set_unit("px");
        assert!(draft.blanks.is_empty());
        let expected = "\
[ball]
radius_m = 0.03075
[video]
capture_fps = 240
playback_fps = 30
[scale]
length_unit = \"px\"
y_axis = \"down\"
[tracks]
cue = \"w\"
object = \"y\"
";
        assert_eq!(draft.text, expected);
    }
}
