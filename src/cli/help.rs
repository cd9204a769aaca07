//! `caromfit help`: commands, and the pages of the guide.

use caromfit::guide::TOPICS;
use clap::CommandFactory;
use clap::builder::PossibleValuesParser;

use super::{Cli, Failure, print};

/// Prints the help of a command, or a page of the guide.
#[derive(clap::Args)]
#[command(after_help = topics())]
pub struct Args {
    /// A command, or a topic of the guide
    #[arg(value_name = "TOPIC", value_parser = PossibleValuesParser::new(names()), hide_possible_values = true)]
    topic: Option<String>,
}

/// The commands, of which `help` prints the help.
const COMMANDS: [&str; 14] = [
    "fit",
    "compare",
    "collide",
    "extract",
    "accuracy",
    "design",
    "synth",
    "init",
    "check",
    "export",
    "example",
    "schema",
    "completions",
    "help",
];

fn names() -> Vec<&'static str> {
    TOPICS.iter().map(|topic| topic.name).chain(COMMANDS).collect()
}

/// The pages of the guide, a line each.
pub fn topics() -> String {
    let lines = TOPICS.iter().map(|topic| format!("  {:<9} {}\n", topic.name, topic.about));
    format!("Topics of caromfit help TOPIC:\n{}", lines.collect::<String>())
}

pub fn run(args: &Args) -> Result<(), Failure> {
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
