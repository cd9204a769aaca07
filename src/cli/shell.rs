//! Completions for shells, and the manual.

use std::path::PathBuf;

use caromfit::report::write;
use clap::{Command, CommandFactory};
use clap_complete::Shell;

use super::{Cli, Failure, print};

/// Prints what makes a shell complete the words of caromfit.
#[derive(clap::Args)]
#[command(
    after_help = "Example: caromfit completions bash > ~/.local/share/bash-completion/completions/caromfit"
)]
pub struct Completions {
    #[arg(value_enum)]
    shell: Shell,
}

/// Prints the manual page, or writes one for each command.
#[derive(clap::Args)]
#[command(after_help = "Example: caromfit man --out ~/.local/share/man/man1")]
pub struct Man {
    /// Write caromfit.1, caromfit-fit.1, … there
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

pub fn completions(args: &Completions) -> Result<(), Failure> {
    let mut text = Vec::new();
    clap_complete::generate(args.shell, &mut Cli::command(), "caromfit", &mut text);
    print(&String::from_utf8_lossy(&text))
}

pub fn man(args: &Man) -> Result<(), Failure> {
    let page = |command: Command| {
        let mut text = Vec::new();
        clap_mangen::Man::new(command).render(&mut text)?;
        Ok::<_, Failure>(keep_lines(&String::from_utf8_lossy(&text)).into_bytes())
    };
    // built, each command knows that it is caromfit's
    let mut all = Cli::command();
    all.build();
    let Some(out) = &args.out else { return print(&String::from_utf8_lossy(&page(all)?)) };
    let mut pages = vec![("caromfit.1".to_string(), page(all.clone())?)];
    for command in all.get_subcommands() {
        pages.push((format!("caromfit-{}.1", command.get_name()), page(command.clone())?));
    }
    Ok(write::write_files(&pages, out)?)
}

/// What follows the options of a command, where examples keep their lines: man would fill and break them like prose.
fn keep_lines(page: &str) -> String {
    const EXTRA: &str = ".SH EXTRA";
    let mut text = String::with_capacity(page.len());
    let (mut extra, mut kept) = (false, false);
    for line in page.lines() {
        if line.starts_with(".SH") {
            extra = line == EXTRA;
        }
        let keeps = extra && (line.starts_with(' ') || line.starts_with("Example") || line.is_empty());
        let keeps = keeps && line != EXTRA;
        if keeps != kept {
            text.push_str(if keeps { ".nf\n" } else { ".fi\n" });
            kept = keeps;
        }
        text.push_str(if line == EXTRA { ".SH EXAMPLES" } else { line });
        text.push('\n');
    }
    if kept {
        text.push_str(".fi\n");
    }
    text
}
