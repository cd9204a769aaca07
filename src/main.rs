//! The command-line program: `caromfit --help`.

mod cli;

fn main() -> std::process::ExitCode {
    cli::run()
}
