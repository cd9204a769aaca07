//! Tables of any other shape: `[tracks.columns]` says which column is what.

use std::path::Path;

use super::long;
use super::long::{Columns, Gather};
use super::number::shortened;
use super::raw::{FORMAT, Notes, RawShot, Row};
use super::settings::{ColumnNames, TrackSettings};
use super::sheet::{Reader, Sheet};
use super::text::{Separator, lines, trimmed};
use crate::io::error::{Problems, did_you_mean};

pub(super) fn read(
    file: &Path,
    text: &str,
    stem: &str,
    wanted: &ColumnNames,
    settings: &TrackSettings,
    problems: &mut Problems,
    notes: &mut Notes,
) -> Option<Vec<RawShot>> {
    let sheet = header(file, text, wanted, problems)?;
    let position = |name: &Option<String>| {
        let name = name.as_deref()?.trim();
        sheet.names.iter().position(|n| n == name)
    };
    let frame = position(&wanted.frame).filter(|_| settings.capture_fps.is_some() || wanted.t.is_none());
    let time = frame.or(position(&wanted.t))?;
    let shape = if wanted.cue_x.is_some() { "a row per frame" } else { "a row per ball and frame" };
    let message = format!(
        "read by [tracks.columns], {} between cells, names in line {}, {shape}",
        sheet.separator.name(),
        sheet.header
    );
    notes.add(FORMAT, file, None, message);
    let mut gather = Gather::new(file, stem, frame.is_some());
    if wanted.cue_x.is_none() {
        let columns = Columns {
            shot: position(&wanted.shot),
            time,
            frames: frame.is_some(),
            ball: position(&wanted.ball)?,
            point: position(&wanted.point),
            x: position(&wanted.x)?,
            y: position(&wanted.y)?,
            sd: position(&wanted.x_sd).zip(position(&wanted.y_sd)).map(|(x, y)| [x, y]),
            marker: position(&wanted.marker_x).zip(position(&wanted.marker_y)).map(|(x, y)| [x, y]),
        };
        long::read(&sheet, &columns, &mut gather, problems, notes);
        return Some(gather.shots);
    }
    let balls = [
        (settings.cue.0.first()?, position(&wanted.cue_x)?, position(&wanted.cue_y)?),
        (settings.object.0.first()?, position(&wanted.object_x)?, position(&wanted.object_y)?),
    ];
    let shot = position(&wanted.shot);
    let mut reader = Reader::new(file);
    sheet.rows(problems, |line, row, problems| {
        let shot_name = shot.map(|i| row[i].trim());
        if let Some(i) = shot.filter(|_| shot_name == Some("")) {
            problems.add(file, Some(line), Some(&sheet.names[i]), "is empty; expected the name of a shot");
        }
        let Some(time) = reader.time(line, &row[time], &sheet.names[time], problems) else {
            if balls.iter().any(|(_, x, _)| !row[*x].trim().is_empty()) {
                reader.no_time(line, problems);
            }
            return;
        };
        for (ball, x, y) in balls {
            let names = [sheet.names[x].as_str(), sheet.names[y].as_str()];
            let [x, y] = reader.position(line, [&row[x], &row[y]], names, problems, notes);
            gather.push(shot_name, ball, "", Row { time, x, y, line: line as u32 }, None);
        }
    });
    reader.finish(notes);
    Some(gather.shots)
}

/// The first line that has all the names.
fn header<'a>(
    file: &'a Path,
    text: &'a str,
    wanted: &ColumnNames,
    problems: &mut Problems,
) -> Option<Sheet<'a>> {
    let wanted_names = wanted.names();
    let separators: Vec<_> = match wanted.separator.as_deref().and_then(|s| s.chars().next()) {
        Some(separator) => vec![Separator::Char(separator)],
        None => Separator::ALL.to_vec(),
    };
    let mut nearest: Option<(usize, usize, Vec<String>)> = None;
    for (line, content) in lines(text).filter(|(_, content)| !content.trim().is_empty()).take(100) {
        for separator in &separators {
            let bare = content.trim_start().strip_prefix('#').unwrap_or(content);
            let Some(names) = trimmed(bare, *separator) else { continue };
            let here = wanted_names.iter().filter(|name| names.iter().any(|n| n == *name)).count();
            if here == wanted_names.len() {
                let twice = wanted_names.iter().find(|name| names.iter().filter(|n| n == *name).count() > 1);
                if let Some(name) = twice {
                    problems.add(
                        file,
                        Some(line),
                        Some(name),
                        "stands twice in the header; expected it once",
                    );
                    return None;
                }
                return Some(Sheet {
                    file,
                    text,
                    separator: *separator,
                    header: line,
                    above: line,
                    offset: 0,
                    names,
                });
            }
            if nearest.as_ref().is_none_or(|(most, ..)| here > *most) {
                nearest = Some((here, line, names));
            }
        }
    }
    let Some((_, line, names)) = nearest else {
        problems.add(file, None, None, "is empty; expected the columns that [tracks.columns] names");
        return None;
    };
    let missing = wanted_names.iter().find(|name| !names.iter().any(|n| n == *name));
    let missing = missing.copied().unwrap_or_default();
    let near = did_you_mean(missing, names.iter().map(String::as_str));
    let message = format!(
        "no line has all the columns that [tracks.columns] names; \"{missing}\" is missing here{near}: {}",
        shortened(&names.join(" | "))
    );
    problems.add(file, Some(line), None, message);
    None
}

impl ColumnNames {
    /// Whether the columns make a table, long or wide.
    pub(super) fn check(&self) -> Result<(), String> {
        if self.frame.is_none() && self.t.is_none() {
            return Err("[tracks.columns] has neither frame nor t; expected one of them".to_string());
        }
        let wide = [&self.cue_x, &self.cue_y, &self.object_x, &self.object_y];
        let long = [&self.ball, &self.x, &self.y];
        let rest = [&self.point, &self.x_sd, &self.y_sd, &self.marker_x, &self.marker_y];
        let any_wide = wide.iter().any(|name| name.is_some());
        let any_long = long.iter().chain(&rest).any(|name| name.is_some());
        if any_wide && any_long {
            return Err(
                "[tracks.columns] mixes a wide table (cue_x, cue_y, object_x, object_y) with a long \
                        one (ball, x, y); expected one of them"
                    .to_string(),
            );
        }
        let full = |names: &[&Option<String>]| names.iter().all(|name| name.is_some());
        if !full(&wide) && !full(&long) {
            return Err("[tracks.columns] needs ball, x and y (a long table: a row per ball and frame) or \
                        cue_x, cue_y, object_x and object_y (a wide one: a row per frame)"
                .to_string());
        }
        let pairs = [
            (&self.x_sd, &self.y_sd, "x_sd and y_sd"),
            (&self.marker_x, &self.marker_y, "marker_x and marker_y"),
        ];
        for (one, other, names) in pairs {
            if one.is_some() != other.is_some() {
                return Err(format!("[tracks.columns]: {names} go together"));
            }
        }
        if let Some(separator) = &self.separator
            && ![",", ";", "\t", " ", "|"].contains(&separator.as_str())
        {
            return Err(format!(
                "separator is {separator:?}; expected \",\", \";\", \"\\t\", \"|\" or \" \""
            ));
        }
        Ok(())
    }

    /// The file's names of all columns that are asked for.
    fn names(&self) -> Vec<&str> {
        let all = [
            &self.shot,
            &self.frame,
            &self.t,
            &self.ball,
            &self.point,
            &self.x,
            &self.y,
            &self.x_sd,
            &self.y_sd,
            &self.marker_x,
            &self.marker_y,
            &self.cue_x,
            &self.cue_y,
            &self.object_x,
            &self.object_y,
        ];
        all.into_iter().flatten().map(|name| name.trim()).collect()
    }
}
