//! `caromfit init`: a dataset.toml for CSV files.

use std::io::{IsTerminal, Write};
use std::path::PathBuf;

use crate::io::draft::{self, Draft};
use crate::report::write::Staged;

use super::table_only::{SPINS, Told, UNITS};
use super::{Failure, print, print_lines};

#[derive(clap::Args)]
#[command(after_help = "Example: caromfit init my-shots/*.csv")]
pub(super) struct Args {
    /// The files of one data set, or its folder: exports of Tracker, Kinovea or Qualisys, JSON, or tables
    #[arg(required = true, value_name = "CSV")]
    files: Vec<PathBuf>,
    /// Print it instead of writing it
    #[arg(long)]
    stdout: bool,
}

pub(super) fn run(args: &Args) -> Result<(), Failure> {
    let mut draft = draft::draft(&args.files)?;
    if args.stdout {
        return print(&draft.text());
    }
    let path = draft.folder.join("dataset.toml");
    if path.exists() {
        refuse!(
            "{}: is there already; expected none (remove it, or see what it would be with --stdout)",
            path.display()
        );
    }
    if std::io::stdin().is_terminal() && std::io::stdout().is_terminal() {
        print_lines(&std::mem::take(&mut draft.found))?;
        ask(&mut draft)?;
    }
    let folder = if draft.folder.as_os_str().is_empty() { PathBuf::from(".") } else { draft.folder.clone() };
    Staged::new(&folder)?.add("dataset.toml", draft.text())?.put()?;
    print_lines(&draft.found)?;
    let open = match draft.blanks().as_slice() {
        [] => String::new(),
        blanks => format!(" Fill in: {}.", blanks.join(", ")),
    };
    print(&format!("Wrote {}.{open} Then: caromfit check {}\n", path.display(), folder.display()))
}

/// Asks for what the files do not determine, and puts the answers in.
fn ask(draft: &mut Draft) -> Result<(), Failure> {
    let mut told = Told::default();
    let blanks = draft.blanks();
    let is_blank = |what: &str| blanks.contains(&what);
    if is_blank("capture_fps") {
        let question = "Frames per second that the camera recorded at (phones in slow motion: 120 or 240)";
        told.fps = answer(question, number)?;
    }
    if is_blank("length_unit") {
        let question =
            "Unit of the positions: m, cm, mm, in, ft, or px (pixels: the balls are then the ruler)";
        told.unit = answer(question, |word| one_of(word, &UNITS))?;
    }
    if let ([one, other], true) = (draft.tracks.as_slice(), is_blank("which ball is which")) {
        let question = format!("Which is the cue ball: {one} or {other}");
        told.cue = answer(&question, |word| one_of(word, &[one, other]))?;
        told.object = told.cue.as_ref().map(|cue| if cue == one { other } else { one }.clone());
    }
    if let Some(stated) = draft.value("radius_m").filter(|_| !draft.are_discs) {
        let question = format!(
            "Radius of the balls, m (pool 0.028575, carom 0.03075, snooker 0.02625; Enter: {stated})"
        );
        told.radius = answer(&question, number)?;
    }
    if is_blank("cue_spin") {
        let question =
            "The cue ball before the hit: natural-roll (it rolls), stun (it slides), unknown, measured";
        told.spin = answer(question, |word| one_of(word, &SPINS))?;
    }
    told.fill(draft);
    Ok(())
}

/// Asks until the answer can be read; `None` if the line is empty, or the input ends.
fn answer<T>(question: &str, read: impl Fn(&str) -> Result<T, String>) -> Result<Option<T>, Failure> {
    loop {
        print(&format!("{question}: "))?;
        std::io::stdout().flush()?;
        let mut line = String::new();
        let bytes = std::io::stdin().read_line(&mut line)?;
        let line = line.trim();
        if bytes == 0 || line.is_empty() {
            return Ok(None);
        }
        match read(line) {
            Ok(value) => return Ok(Some(value)),
            Err(error) => print(&format!("  {error}\n"))?,
        }
    }
}

fn number(word: &str) -> Result<f64, String> {
    let value = word.replace(',', ".").parse::<f64>().ok().filter(|value| *value > 0.0 && value.is_finite());
    value.ok_or_else(|| format!("\"{word}\" is no number above 0"))
}

fn one_of(word: &str, words: &[&str]) -> Result<String, String> {
    let known = words.iter().find(|known| known.eq_ignore_ascii_case(word)).map(|known| (*known).to_owned());
    known.ok_or_else(|| format!("\"{word}\": expected one of {}", words.join(", ")))
}
