//! A fit on disk: `<out>/<data set>/` or, where labels are fitted apart, `<out>/<data set>/<label>/`.

use std::collections::HashSet;
use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use super::{ReportError, content, csv, document, fit, label, plot};
use crate::fit::Fit;

/// Returns the folder of all fits of one data set below `out`.
pub(crate) fn fit_folder(fits: &[Fit], out: &Path) -> PathBuf {
    fits.first().map_or_else(|| out.to_path_buf(), |fit| out.join(dataset_folder(&fit.dataset)))
}

/// Writes the fits of one data set below `out`, each label into a folder of its own, after all have been rendered.
pub fn write(fits: &[Fit], out: &Path) -> Result<(), ReportError> {
    let names = group_folders(&fits.iter().map(label).collect::<Vec<_>>());
    let folder = fit_folder(fits, out);
    let mut rendered = Vec::new();
    for (fit, name) in fits.iter().zip(&names) {
        let own = if fit.group.is_some() { folder.join(name) } else { folder.clone() };
        rendered.push((own, of_fit(fit)?));
    }
    if fits.iter().any(|fit| fit.group.is_some()) {
        // what an earlier fit that was not label by label left there is removed
        let page = content::html(&fit::of_labels(fits, &names))?;
        rendered.push((folder, vec![(REPORT.to_owned(), bytes(page))]));
    }
    rendered.iter().try_for_each(|(folder, files)| put(files, folder))
}

/// The files of a fit for people and for programs, and all files that a report may have.
const REPORT: &str = "report.html";
const FIT: &str = "fit.json";
const NAMES: [&str; 9] = [
    REPORT,
    FIT,
    "residuals.csv",
    "shots.csv",
    "frames.csv",
    "residuals.svg",
    "residuals.png",
    "contours.svg",
    "contours.png",
];

/// Names and contents of files.
pub(crate) type Files = Vec<(String, Vec<u8>)>;

/// Returns figures, as SVG and as PNG, and texts as files.
pub(super) fn files<const F: usize, const T: usize>(
    figures: [(&str, plot::Figure); F],
    texts: [(&str, String); T],
) -> Result<Files, ReportError> {
    let mut files = Files::new();
    for (name, figure) in figures {
        files.extend(figure.files(name)?);
    }
    files.extend(texts.map(|(name, text)| (name.to_owned(), text.into_bytes())));
    Ok(files)
}

/// Writes what a file is to hold, which may be more than should be held in memory.
type Content<'a> = Box<dyn Fn(&mut (dyn Write + Send)) -> io::Result<()> + 'a>;

fn bytes<'a>(bytes: impl AsRef<[u8]> + 'a) -> Content<'a> {
    Box::new(move |to| to.write_all(bytes.as_ref()))
}

/// Returns the files of the report of a fit.
fn of_fit(fit: &Fit) -> Result<Vec<(String, Content<'_>)>, ReportError> {
    let mut files: Vec<(String, Content)> = vec![
        ("residuals.csv".to_owned(), Box::new(|to| csv::write_residuals(fit, to))),
        ("shots.csv".to_owned(), bytes(csv::shots(fit))),
    ];
    for (name, figure) in [("residuals", plot::residuals(fit)), ("contours", plot::contours(fit))] {
        if name == "residuals" || !figure.rows.is_empty() {
            files.extend(figure.files(name)?.map(|(name, picture)| (name, bytes(picture))));
        }
    }
    if let Some(film) = &fit.frames {
        files.push(("frames.csv".to_owned(), Box::new(|to| csv::write_frames(film, to))));
    }
    files.push((REPORT.to_owned(), bytes(fit::page(fit)?)));
    // last, so that a program which waits for it finds the others
    files.push((FIT.to_owned(), bytes(document::text(fit)?)));
    Ok(files)
}

/// Writes the files of a report and removes those of an earlier report that this one does not have; other files there stay.
///
/// A fit.json that states the same result stays, with the time and the steps of the run that found it first: what is kept under version
/// control does not change with every run.
fn put(files: &[(String, Content)], folder: &Path) -> Result<(), ReportError> {
    let stays = |(name, content): &&(String, Content)| {
        let (mut text, stored) = (Vec::new(), fs::read_to_string(folder.join(name)));
        name == FIT
            && content(&mut text).is_ok()
            && stored.is_ok_and(|stored| document::is_same_result(&String::from_utf8_lossy(&text), &stored))
    };
    write_contents(files.iter().filter(|file| !stays(file)).collect(), folder)?;
    let is_old = |name: &&str| files.iter().all(|(written, _)| written != name);
    for path in NAMES.into_iter().filter(is_old).map(|name| folder.join(name)).filter(|path| path.exists()) {
        fs::remove_file(&path).map_err(|error| ReportError::of_file(&path, &error))?;
    }
    Ok(())
}

/// Puts files into a folder, which is made where it is missing: all are complete on the disk before
/// the first one replaces what was there.
pub(crate) fn write_files(files: &[(impl AsRef<str>, Vec<u8>)], folder: &Path) -> Result<(), ReportError> {
    let content =
        |(name, content): &(_, Vec<u8>)| (AsRef::<str>::as_ref(name).to_owned(), bytes(content.clone()));
    let contents: Vec<(String, Content)> = files.iter().map(content).collect();
    write_contents(contents.iter().collect(), folder)
}

fn write_contents(files: Vec<&(String, Content)>, folder: &Path) -> Result<(), ReportError> {
    let at = |path: &Path| {
        let path = path.to_owned();
        move |error: io::Error| ReportError::of_file(&path, &error)
    };
    fs::create_dir_all(folder).map_err(at(folder))?;
    // On the same file system as the folder, so that moving is atomic; inside it would be, too, but
    // what a killed run leaves behind would then sit among the results.
    let parent = folder.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let staging = tempfile::Builder::new().prefix(".caromfit-").tempdir_in(parent).map_err(at(parent))?;
    for (name, content) in &files {
        let path = staging.path().join(name);
        let write = |file: File| {
            let mut buffer = BufWriter::new(file);
            content(&mut buffer)?;
            buffer.into_inner().map_err(io::IntoInnerError::into_error)?.sync_all()
        };
        File::create(&path).and_then(write).map_err(at(&path))?;
    }
    files.iter().try_for_each(|(name, _)| {
        let target = folder.join(name);
        fs::rename(staging.path().join(name), &target).map_err(at(&target))
    })
}

/// Returns the folder of a data set: its name, with path separators and control characters replaced.
pub(crate) fn dataset_folder(name: &str) -> String {
    let separator = |c: char| matches!(c, '/' | '\\' | ':') || c.is_control();
    not_special(name.replace(separator, "-").trim().to_owned())
}

/// Returns the folder of a label: letters, digits, `.`, `_` and `-`, anything else replaced by `-`.
pub fn folder_name(label: &str) -> String {
    let allowed = |c: char| c.is_ascii_alphanumeric() || matches!(c, '.' | '_' | '-');
    not_special(label.chars().map(|c| if allowed(c) { c } else { '-' }).collect())
}

/// Returns one folder for each label, all different, also where upper and lower case are the same: labels
/// whose names collide get `-2`, `-3` … in their order.
pub fn group_folders(labels: &[String]) -> Vec<String> {
    // A label that is itself the name of a folder keeps it.
    let own = |label: &&String| folder_name(label) == **label;
    let reserved: HashSet<String> = labels.iter().filter(own).map(|label| label.to_lowercase()).collect();
    let mut used = HashSet::new();
    let folder = |label: &String| {
        let name = folder_name(label);
        let mut free = |candidate: &String| {
            let key = candidate.to_lowercase();
            (!reserved.contains(&key) || candidate == label) && used.insert(key)
        };
        let others = (2..).map(|n| format!("{name}-{n}"));
        std::iter::once(name.clone()).chain(others).find(|candidate| free(candidate)).unwrap_or_default()
    };
    labels.iter().map(folder).collect()
}

/// Returns a name that is not empty, `.` or `..`.
fn not_special(name: String) -> String {
    if name.chars().all(|c| c == '.') { format!("-{name}") } else { name }
}
