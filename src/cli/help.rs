//! Help of the program: `caromfit help`, `caromfit schema` and `caromfit completions`.

use crate::guide::TOPICS;
use crate::report::document::{self, SCHEMAS};
use clap::CommandFactory;
use clap::builder::PossibleValuesParser;
use clap_complete::Shell;

use super::{Cli, Failure, print};

#[derive(clap::Args)]
#[command(after_help = topics())]
pub(super) struct Args {
    /// A command, or a topic of the guide
    #[arg(value_name = "TOPIC", value_parser = PossibleValuesParser::new(names()), hide_possible_values = true)]
    topic: Option<String>,
}

/// Returns the pages of the guide, and the commands, of which `help` prints the help.
fn names() -> impl Iterator<Item = &'static str> {
    let commands =
        "fit compare collide extract accuracy design synth init check export example schema completions help";
    TOPICS.iter().map(|topic| topic.name).chain(commands.split(' '))
}

/// Returns the pages of the guide, a line each.
pub(super) fn topics() -> String {
    let lines = TOPICS.iter().map(|topic| format!("  {:<9} {}\n", topic.name, topic.about));
    format!("Topics of caromfit help TOPIC:\n{}", lines.collect::<String>())
}

pub(super) fn run(args: &Args) -> Result<(), Failure> {
    // built, each command knows that it is caromfit's
    let mut all = Cli::command();
    all.build();
    let Some(name) = &args.topic else { return print(&all.render_long_help().to_string()) };
    if let Some(topic) = TOPICS.iter().find(|topic| topic.name == name) {
        return print(topic.text);
    }
    let command = all.find_subcommand_mut(name);
    print(&command.map_or_else(String::new, |command| command.render_long_help().to_string()))
}

#[derive(clap::Args)]
#[command(after_help = "Example: caromfit schema compare > compare.schema.json")]
pub(super) struct Schema {
    /// Of which command, or dataset
    #[arg(value_parser = PossibleValuesParser::new(SCHEMAS.map(|(command, _)| command)), default_value = "fit")]
    command: String,
}

pub(super) fn schema(args: &Schema) -> Result<(), Failure> {
    // the parser accepts no other name
    let (_, schema) = SCHEMAS.into_iter().find(|(command, _)| *command == args.command).unwrap_or(SCHEMAS[0]);
    print(&document::text(&schema())?)
}

#[derive(clap::Args)]
#[command(
    after_help = "Example: caromfit completions bash > ~/.local/share/bash-completion/completions/caromfit"
)]
pub(super) struct Completions {
    #[arg(value_enum)]
    shell: Shell,
}

pub(super) fn completions(args: &Completions) -> Result<(), Failure> {
    let mut text = Vec::new();
    clap_complete::generate(args.shell, &mut Cli::command(), "caromfit", &mut text);
    print(&String::from_utf8_lossy(&text))
}
