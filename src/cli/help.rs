//! `caromfit help`: commands, and the pages of the guide.

use caromfit::guide::TOPICS;
use clap::CommandFactory;

use super::{Cli, Failure, print};

/// Prints the help of a command, or a page of the guide.
#[derive(clap::Args)]
#[command(after_help = topics())]
pub struct Args {
    /// A command, or a topic of the guide
    #[arg(value_name = "TOPIC")]
    topic: Option<String>,
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
    if let Some(command) = all.find_subcommand_mut(name) {
        return print(&command.render_long_help().to_string());
    }
    let commands: Vec<String> = all.get_subcommands().map(|command| command.get_name().to_owned()).collect();
    let topics = TOPICS.map(|topic| topic.name);
    Err(Failure::input(format!(
        "\"{name}\" is no command and no topic; expected a topic, of {}, or a command, of {}",
        topics.join(", "),
        commands.join(", ")
    )))
}
