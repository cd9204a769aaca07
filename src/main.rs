//! The command-line program: `caromfit --help`.

fn main() -> std::process::ExitCode {
    caromfit::cli::run()
}
