//! `caromfit fit`: the main job.

use std::path::PathBuf;

use crate::fit::{self, Falling, Fit, Options};
use crate::measurement::dataset::Dataset;
use crate::measurement::loss::Loss;
use crate::report;
use crate::report::stored::{self, Stored};
use crate::report::terminal;

use super::progress::{self, Progress};
use super::table_only::{Told, is_table};
use super::{Failure, answer, unless_none};

#[derive(clap::Args)]
#[command(after_help = "Example: caromfit fit data/*/")]
pub(super) struct Args {
    /// Folders that hold a dataset.toml, or such files; or a table, with what a dataset.toml would
    /// say as options
    #[arg(required = true, value_name = "DATASET")]
    datasets: Vec<PathBuf>,
    /// Leave these shots out
    #[arg(long, value_name = "SHOT", value_delimiter = ',')]
    skip: Vec<String>,
    /// Where the results go, one folder per data set
    #[arg(long, default_value = "fits", value_name = "DIR")]
    out: PathBuf,
    /// Collision model; auto is full, with a compliant contact and the balls' weight if the data
    /// show them
    #[arg(long, value_parser = super::fidelity(), default_value = "auto")]
    fidelity: super::Chosen,
    /// Friction between the balls that decreases with their slip v, m/s, as μ + B·exp(−C·v), with
    /// this B and C or with both as [fit] mu_b and mu_c of the data set state (fit); linear takes
    /// it at the first slip
    #[arg(long, value_name = "B,C|fit", value_parser = falling, allow_hyphen_values = true)]
    falling: Option<Falling>,
    /// How outlying shots count, instead of what the data set states
    #[arg(long, value_parser = super::named(Loss::ALL, Loss::name))]
    loss: Option<Loss>,
    /// Number of samples of shots drawn with repetition and fitted, for intervals that do not rest
    /// on model or noise
    #[arg(long, default_value_t = 0, value_name = "N")]
    bootstrap: usize,
    /// Seed of all random numbers
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Compare with stored fits (a fit.json, or a folder of them): status 1 and a table of what
    /// moved
    #[arg(long, value_name = "FIT.json")]
    baseline: Option<PathBuf>,
    /// Print everything: of one fit its report, of several a line for each label, all warnings and
    /// error budgets
    #[arg(long)]
    all: bool,
    /// Print only the fits as a JSON array, on standard output
    #[arg(long)]
    json: bool,
    // its heading holds for all options behind it
    #[command(flatten)]
    told: Told,
}

/// `fit`, or B,C.
fn falling(text: &str) -> Result<Falling, String> {
    if text.trim() == "fit" {
        return Ok(Falling::Fitted);
    }
    let numbers = super::numbers(text, "two, b,c with c in s/m");
    numbers.map(|[b, c]| Falling::Held { b, c }).map_err(|error| format!("{error}, or fit"))
}

/// Returns the data sets, and what was assumed of tables without a dataset.toml.
fn load(args: &Args) -> Result<(Vec<Dataset>, Vec<String>), Failure> {
    let (tables, folders): (Vec<PathBuf>, Vec<PathBuf>) =
        args.datasets.iter().cloned().partition(|path| is_table(path));
    let are_there = folders.iter().all(|folder| folder.exists());
    if tables.is_empty() && are_there && args.told != Told::default() {
        refuse!(
            "--fps, --radius, --spin, --cue, --object and --unit are for a table without a dataset.toml; of a data set, its \
             dataset.toml states them"
        );
    }
    let (mut datasets, wrong) = progress::load(&folders);
    unless_none(&wrong, 2)?;
    let mut assumed = Vec::new();
    for table in &tables {
        let (dataset, said) = args.told.load(table)?;
        assumed.extend(said.into_iter().map(|line| format!("{}: {line}", dataset.name)));
        datasets.push(dataset);
    }
    progress::named_apart(&datasets)?;
    leave_out(&args.skip, &mut datasets)?;
    Ok((datasets, assumed))
}

/// Leaves out shots, each of which some data set must have.
fn leave_out(unwanted: &[String], datasets: &mut [Dataset]) -> Result<(), Failure> {
    let known: Vec<&str> = datasets.iter().flat_map(|dataset| dataset.names()).collect();
    if let Some(absent) = unwanted.iter().find(|name| !known.contains(&name.as_str())) {
        let known = known.iter().take(8).copied().collect::<Vec<_>>().join(", ");
        refuse!("\"{absent}\" names no shot; expected one of {known}, …");
    }
    for dataset in datasets {
        let had_shots = !dataset.names().is_empty();
        dataset.keep(|name| unwanted.iter().all(|unwanted| unwanted != name));
        if had_shots && dataset.names().is_empty() {
            refuse!("{}: --skip leaves out all of its shots", dataset.name);
        }
    }
    Ok(())
}

pub(super) fn run(args: &Args) -> Result<(), Failure> {
    // all input is checked before anything is written
    let (datasets, assumed) = load(args)?;
    let baseline = args.baseline.as_deref().map(Stored::read).transpose()?;
    let progress = Progress::new(datasets.len() * (1 + args.bootstrap));
    let options = Options {
        fidelity: args.fidelity.0,
        falling: args.falling.unwrap_or_default(),
        loss: args.loss,
        bootstrap: args.bootstrap,
        seed: args.seed,
        ..Options::default()
    };
    let (mut fits, mut failed, mut status) = (Vec::new(), Vec::new(), 1);
    for dataset in datasets {
        progress.step(&dataset.name);
        match fit::fit_watched(&dataset, &options, &|| progress.done()) {
            Ok(found) => fits.push(found),
            Err(error) => {
                status = if error.is_bad_input() { 2 } else { status };
                failed.push(error.to_string());
            }
        }
        progress.done();
    }
    if status == 2 {
        return unless_none(&failed, status);
    }
    let mut moved = Vec::new();
    for (baseline, fit) in baseline.iter().flat_map(|own| fits.iter().flatten().map(move |fit| (own, fit))) {
        moved.extend(baseline.moved(fit)?);
    }
    // what moved is not written over what it moved from
    let written = if moved.is_empty() { &fits[..] } else { &[] };
    written.iter().try_for_each(|found| report::write(found, &args.out))?;
    let page = |folder: PathBuf| folder.join("report.html").display().to_string();
    let report = match written {
        [] => String::new(),
        [one] => format!("\nReport: {}\n", page(report::fit_folder(one, &args.out))),
        all => format!("\nReports: {} ({} data sets)\n", page(args.out.join("*")), all.len()),
    };
    drop(progress);
    let fits: Vec<Fit> = fits.into_iter().flatten().collect();
    answer(args.json, &fits, || {
        let assumed = if assumed.is_empty() { String::new() } else { assumed.join("\n") + "\n\n" };
        assumed + &if args.all { report::fit::as_text(&fits) } else { terminal::overview(&fits) } + &report
    })?;
    if !moved.is_empty() {
        let table = stored::table(&moved);
        failed.push(format!("the fit is no longer that of the baseline:\n{}", table.trim_end()));
    }
    unless_none(&failed, 1)
}
