//! `caromfit completions`: completions for shells.

use clap::CommandFactory;
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

pub fn completions(args: &Completions) -> Result<(), Failure> {
    let mut text = Vec::new();
    clap_complete::generate(args.shell, &mut Cli::command(), "caromfit", &mut text);
    print(&String::from_utf8_lossy(&text))
}
