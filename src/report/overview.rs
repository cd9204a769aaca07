//! What `caromfit fit` prints in one screen: one line per data set, those that can be used first, each with its verdict; of a single fit
//! also where its errors come from, and what else to know.

use super::aligned;
use super::content::Table;
use super::document;
use super::number::{plain, with_error};
use super::plot::ends;
use super::table::{INTERVAL, brief, chi2_text, columns, head, name, parameters, shots, shows};
use super::{label, noise_estimated, reduced_chi2, symbol};
use crate::fit::{Fit, Grade, Status};
use crate::measurement::parameter::Parameter;
use crate::problem::{Estimate, Id};

/// Whether the words of verdicts have colours, as terminals show them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Colour {
    /// With colours.
    On,
    /// Without colours.
    Off,
}

impl Colour {
    /// A word in the colour of a grade (ECMA-48, SGR).
    fn paint(self, text: &str, grade: Grade) -> String {
        let code = match grade {
            Grade::Good => 32,
            Grade::Doubtful => 33,
            Grade::Unusable => 31,
        };
        match self {
            Self::On => format!("\u{1b}[{code}m{text}\u{1b}[0m"),
            Self::Off => text.to_owned(),
        }
    }
}

/// A line of the table and what is said below it.
struct Line {
    grade: Grade,
    cells: Vec<String>,
    verdict: String,
    below: Vec<String>,
}

/// One line per data set, whose labels are folded into it, the best verdict first; below a line the sentence of its verdict
/// where it is not good, or where it is the only one.
#[must_use]
pub fn render(fits: &[Fit], colour: Colour) -> String {
    if fits.is_empty() {
        return String::new();
    }
    let known = parameters(fits);
    let mut lines: Vec<Line> = of_datasets(fits).into_iter().map(|fits| line(fits, &known)).collect();
    lines.sort_by_key(|line| line.grade);
    if let ([line], [fit]) = (lines.as_mut_slice(), fits)
        && line.grade == Grade::Good
    {
        line.below.insert(0, fit.verdict().sentence);
    }
    let rows = lines.iter().map(|line| line.cells.iter().chain([&line.verdict]).cloned().collect());
    let table = aligned::table(&Table::new(head(&known, &["verdict"]), rows), "");
    let mut rows = table.lines();
    let mut text = format!("{}\n", rows.next().unwrap_or_default());
    for (row, line) in rows.zip(&lines) {
        let numbers = row.strip_suffix(line.verdict.as_str()).unwrap_or(row);
        text.push_str(&format!("{numbers}{}\n", colour.paint(&line.verdict, line.grade)));
        line.below.iter().for_each(|sentence| text.push_str(&format!("    {sentence}\n")));
    }
    text += &legend(&lines, &known);
    if let [fit] = fits {
        text += &details(fit);
    }
    text
}

/// Largest number of warnings that are shown of a single fit; `--all` shows all.
const MOST_WARNINGS: usize = 3;

/// Returns where the errors of a fit come from, its χ², and its first warnings.
fn details(fit: &Fit) -> String {
    let row = |unknown: &Estimate| {
        let error = unknown.std_error.filter(|error| *error > 0.0)?;
        let budget = fit.budget.iter().find(|budget| budget.id == unknown.id);
        let largest = budget.and_then(|budget| document::budget(budget).into_iter().next());
        let pull = unknown.prior.map(|prior| (unknown.value - prior.mean) / prior.sd);
        Some(vec![
            symbol(unknown.id.name()),
            with_error(unknown.value, error),
            format!("{} %", plain(100.0 * (error / unknown.value).abs(), 2)),
            pull.map_or(String::new(), |pull| format!("{pull:+.1}")),
            largest.map_or(String::new(), |part| {
                format!("{}, ± {}", symbol(&part.source), plain(part.std_error.unwrap_or(f64::NAN), 2))
            }),
        ])
    };
    // the camera's, of which there are many, stand in the report
    let is_usable = fit.verdict().grade != Grade::Unusable;
    let shown = fit.unknowns.iter().filter(|unknown| is_usable && unknown.id < Id::Scale);
    let rows: Vec<Vec<String>> = shown.filter_map(row).collect();
    let mut text = String::new();
    if !rows.is_empty() {
        let head = ["", "estimate", "error", "prior pull", "largest part of the error"];
        text += &format!("\n{}", aligned::table(&Table::new(head, rows).with_numbers(2..4), ""));
    }
    if let Some(reduced) = reduced_chi2(fit) {
        let estimated = if noise_estimated(fit) { ", the noise estimated from the residuals" } else { "" };
        text += &format!("χ²/dof = {} ({} dof{estimated})\n", chi2_text(reduced), fit.dof);
    }
    let verdict = fit.verdict().sentence;
    let others = fit.warnings().into_iter().filter(|warning| *warning != verdict);
    text + &others.take(MOST_WARNINGS).map(|warning| format!("! {warning}\n")).collect::<String>()
}

/// The fits of each data set, in their order.
fn of_datasets(fits: &[Fit]) -> Vec<&[Fit]> {
    fits.chunk_by(|one, next| one.group.is_some() && next.group.is_some() && one.dataset == next.dataset)
        .collect()
}

fn line(fits: &[Fit], known: &[Parameter]) -> Line {
    let verdicts: Vec<_> = fits.iter().map(|fit| (fit, fit.verdict())).collect();
    let count = |grade: Grade| verdicts.iter().filter(|(_, verdict)| verdict.grade == grade).count();
    let first_bad = verdicts.iter().find(|(_, verdict)| verdict.grade != Grade::Good);
    let (title, used, verdict, below) = if let [fit] = fits {
        let sentences = first_bad.map(|(_, verdict)| verdict.sentence.clone());
        let grade = fit.verdict().grade.name().to_owned();
        (name(fit), shots(fit), grade, sentences.into_iter().collect())
    } else {
        let title =
            fits.first().map_or(String::new(), |fit| format!("{} ({} labels)", fit.dataset, fits.len()));
        let used: usize = fits.iter().map(|fit| fit.shots_used).sum();
        let counted = Grade::ALL.into_iter().filter(|grade| count(*grade) > 0);
        let counted: Vec<String> =
            counted.map(|grade| format!("{} {}", count(grade), grade.name())).collect();
        let below = first_bad.map(|(fit, verdict)| {
            let label = label(fit);
            match fits.len() - count(Grade::Good) {
                1 => format!("{label}: {}", verdict.sentence),
                others => format!("{label}, the first of {others}: {}", verdict.sentence),
            }
        });
        (title, used.to_string(), counted.join(", "), below.into_iter().collect())
    };
    // as good as the better half of its labels
    let mut grades: Vec<Grade> = verdicts.iter().map(|(_, verdict)| verdict.grade).collect();
    grades.sort_unstable();
    let grade = grades.get(fits.len() / 2).copied().unwrap_or(Grade::Good);
    let cells = known.iter().map(|parameter| range(fits, *parameter));
    Line { grade, cells: [title, used].into_iter().chain(cells).collect(), verdict, below }
}

/// From where to where a parameter goes over the labels that can be used; where all say the same, that.
fn range(fits: &[Fit], parameter: Parameter) -> String {
    let usable = || fits.iter().filter(|fit| fit.verdict().grade != Grade::Unusable);
    let mut cells: Vec<String> = usable().map(|fit| brief(fit, parameter)).collect();
    cells.dedup();
    if let [one] = cells.as_slice() {
        return one.clone();
    }
    let own = |fit: &Fit| fit.estimates.iter().find(|e| e.parameter == parameter).copied();
    let values =
        usable().filter_map(own).filter(|e| !matches!(e.status, Status::NotIdentified)).map(|e| e.value);
    let [low, high] = ends(values);
    let [low_text, high_text] = [low, high].map(|end| plain(end, 3));
    match (low > high, low_text == high_text) {
        (true, _) => "–".to_owned(),
        (_, true) => low_text,
        _ => format!("{low_text} to {high_text}"),
    }
}

/// What the marks and the symbols of the table mean, as far as it has them.
fn legend(lines: &[Line], known: &[Parameter]) -> String {
    let has = |mark: &str| lines.iter().any(|line| shows(&line.cells, mark));
    let has_dash = |is_meant: fn(Grade) -> bool| {
        lines.iter().any(|line| is_meant(line.grade) && shows(&line.cells, "–"))
    };
    let dash = match (has_dash(|grade| grade < Grade::Unusable), has_dash(|grade| grade == Grade::Unusable)) {
        (true, true) => "–: not determined by these shots; where the verdict is unusable: no number to use",
        (false, true) => "–: no number to use",
        _ => "–: not determined by these shots",
    };
    let marks = [
        ("±", "±: one standard error"),
        ("[", INTERVAL),
        ("≥", "≥: every larger value fits equally"),
        ("≤", "≤: every smaller value fits equally"),
        ("–", dash),
        ("(bound)", "(bound): at the end of the allowed range"),
        ("no error", "no error: nothing to tell it from"),
    ];
    let said: Vec<&str> = marks.iter().filter(|(mark, _)| has(mark)).map(|(_, words)| *words).collect();
    let mut text = if said.is_empty() { String::new() } else { format!("\n{}\n", said.join("; ")) };
    for line in columns(known) {
        text.push_str(&format!("{line}\n"));
    }
    text
}
