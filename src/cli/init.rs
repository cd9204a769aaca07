//! `caromfit init`: a dataset.toml for CSV files.

use std::io::{IsTerminal, Write};
use std::path::PathBuf;

use clap::{Args as _, FromArgMatches};

use crate::io::draft::{self, Draft};
use crate::report::write::Staged;

use super::table_only::Told;
use super::{Failure, print};

#[derive(clap::Args)]
#[command(after_help = "Example: caromfit init my-shots/*.csv")]
pub(super) struct Args {
    /// The files of one data set, or its folder: exports of Tracker, Kinovea or Qualisys, JSON, or
    /// tables
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
        print(&lines(&std::mem::take(&mut draft.found)))?;
        ask(&mut draft)?;
    }
    let folder = if draft.folder.as_os_str().is_empty() { PathBuf::from(".") } else { draft.folder.clone() };
    Staged::new(&folder)?.add("dataset.toml", draft.text())?.put()?;
    print(&lines(&draft.found))?;
    let open = match draft.blanks().as_slice() {
        [] => String::new(),
        blanks => format!(" Fill in: {}.", blanks.join(", ")),
    };
    let mut folder = folder.display().to_string();
    if folder.contains(char::is_whitespace) {
        folder = format!("\"{folder}\"");
    }
    print(&format!("Wrote {}.{open} Then: caromfit check {folder}\n", path.display()))
}

fn lines(found: &[String]) -> String {
    found.iter().map(|line| format!("{line}\n")).collect()
}

/// What files may not determine, the option that would state it, and a question.
const QUESTIONS: [(&str, &str, &str); 5] = [
    (
        "capture_fps",
        "fps",
        "Frames per second that the camera recorded at (phones in slow motion: 120 or 240)",
    ),
    (
        "length_unit",
        "unit",
        "Unit of the positions: m, cm, mm, in, ft, or px (pixels: the balls are then the ruler)",
    ),
    ("which ball is which", "cue", "Which is the cue ball"),
    (
        "radius_m",
        "radius",
        "Radius of the balls, m (pool 0.028575, carom 0.03075, snooker 0.02625; Enter: as in the files, or pool)",
    ),
    (
        "cue_spin",
        "spin",
        "The cue ball before the hit: natural-roll (it rolls), stun (it slides), unknown, measured",
    ),
];

/// Asks for what the files do not determine, and puts the answers in, which are those of options.
fn ask(draft: &mut Draft) -> Result<(), Failure> {
    let mut options = vec!["init".to_owned()];
    for (blank, option, question) in QUESTIONS {
        let has_radius = blank == "radius_m" && draft.value(blank).is_some() && !draft.are_discs;
        if !has_radius && !draft.blanks().contains(&blank) {
            continue;
        }
        let balls = draft.tracks.join(" or ");
        print(&if option == "cue" { format!("{question}, {balls}: ") } else { format!("{question}: ") })?;
        std::io::stdout().flush()?;
        let mut line = String::new();
        std::io::stdin().read_line(&mut line)?;
        let answer = line.trim();
        options.extend((!answer.is_empty()).then(|| format!("--{option}={answer}")));
        if let (Some(other), "cue", false) =
            (draft.tracks.iter().find(|ball| *ball != answer), option, answer.is_empty())
        {
            options.push(format!("--object={other}"));
        }
    }
    let arguments = Told::augment_args(clap::Command::new("init")).try_get_matches_from(options)?;
    Told::from_arg_matches(&arguments)?.fill(draft);
    Ok(())
}
