//! The command-line program: `caromfit --help`.

/// Fits of 20 000 shots take half of the memory that they take with that of the GNU library.
#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

fn main() -> std::process::ExitCode {
    caromfit::cli::run()
}
