//! A fit on disk: `<out>/<data set>/` or, if labels are fitted separately,
//! `<out>/<data set>/<label>/`.

use std::collections::HashSet;
use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use tempfile::TempDir;

use super::{ReportError, csv, document, fit, plot};
use crate::fit::Fit;
use crate::studies::accuracy::Row;

/// Returns the folder of all fits of one data set below `out`.
pub(crate) fn fit_folder(fits: &[Fit], out: &Path) -> PathBuf {
    fits.first().map_or_else(|| out.to_path_buf(), |fit| out.join(dataset_folder(&fit.dataset)))
}

/// Writes the fits of one data set below `out`, each label into a folder of its own, after all have
/// been rendered.
pub fn write(fits: &[Fit], out: &Path) -> Result<(), ReportError> {
    let labels: Vec<String> = fits.iter().map(|fit| fit.label().unwrap_or_default().to_owned()).collect();
    let names = group_folders(&labels);
    let folder = fit_folder(fits, out);
    let mut staged = Vec::new();
    for (fit, name) in fits.iter().zip(&names) {
        staged.push(of_fit(fit, if fit.group.is_some() { folder.join(name) } else { folder.clone() })?);
    }
    if fits.iter().any(|fit| fit.group.is_some()) {
        staged.push(Staged::new(&folder)?.add(REPORT, fit::page_of_labels(fits, &names)?)?);
    }
    staged.into_iter().try_for_each(Staged::put_report)
}

/// Writes the figure of a study of accuracy.
pub(crate) fn write_accuracy(rows: &[Row], out: &Path) -> Result<(), ReportError> {
    Staged::new(out)?.figure("accuracy", &plot::accuracy(rows))?.put()
}

/// The files of a fit for people and for programs.
const REPORT: &str = "report.html";
const FIT: &str = "fit.json";

/// All files that a report may have.
const NAMES: [&str; 8] = [
    REPORT,
    FIT,
    "residuals.csv",
    "shots.csv",
    "residuals.svg",
    "residuals.png",
    "contours.svg",
    "contours.png",
];

/// Stages the files of the report of a fit. fit.json is the last, so that a program which waits for
/// it finds the others.
fn of_fit(fit: &Fit, folder: PathBuf) -> Result<Staged, ReportError> {
    let tables = || {
        let staged = Staged::new(&folder)?.stream("residuals.csv", |to| csv::write_residuals(fit, to))?;
        staged.add("shots.csv", csv::shots(fit))
    };
    let (staged, pictures) = rayon::join(tables, || pictures(fit));
    staged?.add_all(pictures?)?.add(FIT, document::text(fit)?)
}

/// Returns the figures of a fit and its page, by the names of their files.
fn pictures(fit: &Fit) -> Result<Vec<(String, Vec<u8>)>, ReportError> {
    let (residuals, contours) = (plot::residuals(fit), plot::contours(fit));
    let mut files = drawn("residuals", &residuals)?;
    if !contours.rows.is_empty() {
        files.extend(drawn("contours", &contours)?);
    }
    files.push((REPORT.to_owned(), fit::page_with(fit, &residuals, &contours)?.into_bytes()));
    Ok(files)
}

/// Returns a figure as SVG and as PNG, by the names of their files.
fn drawn(name: &str, figure: &plot::Figure) -> Result<Vec<(String, Vec<u8>)>, ReportError> {
    Ok(vec![(format!("{name}.svg"), figure.svg()?.0.into_bytes()), (format!("{name}.png"), figure.png()?)])
}

/// Files for a folder, all of which are complete on the disk before the first one replaces what was
/// there.
pub(crate) struct Staged {
    folder: PathBuf,
    staging: TempDir,
    names: Vec<String>,
}

impl Staged {
    pub(crate) fn new(folder: &Path) -> Result<Self, ReportError> {
        // beside the folder, so that moving is atomic and a killed run leaves nothing among results
        let parent = folder.parent().filter(|parent| !parent.as_os_str().is_empty());
        let parent = parent.unwrap_or(Path::new("."));
        fs::create_dir_all(parent).map_err(failed(parent))?;
        let staging = tempfile::Builder::new().prefix(".caromfit-").tempdir_in(parent);
        let staging = staging.map_err(failed(parent))?;
        Ok(Self { folder: folder.to_path_buf(), staging, names: Vec::new() })
    }

    pub(crate) fn add(self, name: &str, content: impl AsRef<[u8]>) -> Result<Self, ReportError> {
        self.stream(name, |to| to.write_all(content.as_ref()))
    }

    /// Adds a figure as SVG and as PNG.
    pub(super) fn figure(self, name: &str, figure: &plot::Figure) -> Result<Self, ReportError> {
        self.add_all(drawn(name, figure)?)
    }

    fn add_all(self, files: Vec<(String, Vec<u8>)>) -> Result<Self, ReportError> {
        files.into_iter().try_fold(self, |staged, (name, content)| staged.add(&name, content))
    }

    /// Adds a file that may be more than should be held in memory.
    fn stream(
        mut self,
        name: &str,
        write: impl FnOnce(&mut (dyn Write + Send)) -> io::Result<()>,
    ) -> Result<Self, ReportError> {
        let path = self.staging.path().join(name);
        let written = File::create(&path).and_then(|file| {
            let mut buffer = BufWriter::new(file);
            write(&mut buffer)?;
            buffer.into_inner()?.sync_all()
        });
        written.map_err(failed(&path))?;
        self.names.push(name.to_owned());
        Ok(self)
    }

    /// Moves the files into the folder, which is made if it is missing; other files there stay.
    pub(crate) fn put(&self) -> Result<(), ReportError> {
        fs::create_dir_all(&self.folder).map_err(failed(&self.folder))?;
        self.names.iter().try_for_each(|name| {
            let target = self.folder.join(name);
            fs::rename(self.staging.path().join(name), &target).map_err(failed(&target))
        })
    }

    /// Moves the files of a report into the folder, and removes those of an earlier one that this
    /// one does not have.
    ///
    /// A fit.json that states the same result stays, with the time and the steps of the run that
    /// found it first: what is kept under version control does not change with every run.
    fn put_report(mut self) -> Result<(), ReportError> {
        let is_old = |name: &&str| self.names.iter().all(|written| written != name);
        let old = NAMES.into_iter().filter(is_old).map(|name| self.folder.join(name));
        let old: Vec<PathBuf> = old.filter(|path| path.exists()).collect();
        let [now, stored] = [self.staging.path(), &self.folder].map(|at| fs::read_to_string(at.join(FIT)));
        if now.is_ok_and(|now| stored.is_ok_and(|stored| document::is_same_result(&now, &stored))) {
            self.names.retain(|name| name != FIT);
        }
        self.put()?;
        old.iter().try_for_each(|path| fs::remove_file(path).map_err(failed(path)))
    }
}

fn failed(path: &Path) -> impl FnOnce(io::Error) -> ReportError {
    move |error| ReportError(format!("{}: cannot be written: {error}", path.display()))
}

/// Returns the folder of a data set: its name, with path separators and control characters
/// replaced.
pub(crate) fn dataset_folder(name: &str) -> String {
    let separator = |c: char| matches!(c, '/' | '\\' | ':') || c.is_control();
    not_special(name.replace(separator, "-").trim().to_owned())
}

/// Returns the folder of a label: letters, digits, `.`, `_` and `-`, anything else replaced by `-`.
pub fn folder_name(label: &str) -> String {
    let allowed = |c: char| c.is_ascii_alphanumeric() || matches!(c, '.' | '_' | '-');
    not_special(label.chars().map(|c| if allowed(c) { c } else { '-' }).collect())
}

/// Returns one folder for each label, all different even if upper and lower case are the same: the
/// labels whose names collide get `-2`, `-3` … in their order.
pub fn group_folders(labels: &[String]) -> Vec<String> {
    let mut used = HashSet::new();
    let folder = |label: &String| {
        let name = folder_name(label);
        let mut candidates = std::iter::once(name.clone()).chain((2..).map(|n| format!("{name}-{n}")));
        candidates.find(|candidate| used.insert(candidate.to_lowercase())).unwrap_or_default()
    };
    labels.iter().map(folder).collect()
}

/// Returns a name that is not empty, `.` or `..`.
fn not_special(name: String) -> String {
    if name.chars().all(|c| c == '.') { format!("-{name}") } else { name }
}
