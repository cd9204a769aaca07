//! What `caromfit fit` prints in one screen: one line per data set, those that can be used first, each with its verdict; of a single fit
//! also where its errors come from, and what else to know. With `--all` a line for each fit.

use super::content::Table;
use super::document;
use super::plot::ends;
use super::{label, noise_estimated, reduced_chi2, symbol, title};
use crate::fit::{Estimate, Fit, Grade, Status, Verdict};
use crate::measurement::number::{plain, with_error, with_interval};
use crate::measurement::parameter::Parameter;
use crate::problem::{self, Id};

/// A line of the table and what is said below it.
struct Line {
    grade: Grade,
    cells: Vec<String>,
    verdict: String,
    below: Option<String>,
}

/// Returns one line per data set, whose labels are folded into it, the best verdict first; below a line the sentence of its verdict
/// where it is not good, or where it is the only one.
#[must_use]
pub fn overview(fits: &[Fit]) -> String {
    if fits.is_empty() {
        return String::new();
    }
    let known = parameters(fits);
    let of_dataset =
        |one: &Fit, next: &Fit| one.group.is_some() && next.group.is_some() && one.dataset == next.dataset;
    let mut lines: Vec<Line> = fits.chunk_by(of_dataset).map(|fits| line(fits, &known)).collect();
    lines.sort_by_key(|line| line.grade);
    if let ([line], [fit]) = (lines.as_mut_slice(), fits) {
        line.below.get_or_insert(fit.verdict().sentence);
    }
    let mut text = table(&lines, &known, &[]);
    if let [fit] = fits {
        text += &details(fit);
    }
    text
}

/// Returns one line per fit, with χ²/dof, and the warnings of each.
#[must_use]
pub fn all(fits: &[Fit]) -> String {
    let known = parameters(fits);
    let of_fit = |fit| {
        let mut line = line(std::slice::from_ref(fit), &known);
        line.below = None;
        line.cells.push(match reduced_chi2(fit) {
            Some(chi2) if noise_estimated(fit) => format!("{} *", chi2_text(chi2)),
            Some(chi2) => chi2_text(chi2),
            None => "–".to_owned(),
        });
        line
    };
    let lines: Vec<Line> = fits.iter().map(of_fit).collect();
    let warnings = fits.iter().flat_map(|fit| fit.warnings().into_iter().map(move |one| (title(fit), one)));
    let warnings: String = warnings.map(|(title, warning)| format!("\n{title}: {warning}")).collect();
    let end = if warnings.is_empty() { "" } else { "\n" };
    table(&lines, &known, &["χ²/dof"]) + &warnings + end
}

/// Returns the table, and what its marks and symbols mean.
fn table(lines: &[Line], known: &[Parameter], last: &[&str]) -> String {
    let head = ["data set", "shots"].into_iter().map(str::to_owned);
    let head = head.chain(known.iter().map(|parameter| match parameter.unit() {
        "" => parameter.symbol().to_owned(),
        unit => format!("{}, {unit}", parameter.symbol()),
    }));
    let head = head.chain(last.iter().chain(&["verdict"]).map(|word| (*word).to_owned()));
    let rows = lines.iter().map(|line| line.cells.iter().chain([&line.verdict]).cloned().collect());
    let table = Table::new(head, rows).text("");
    // the head has none
    let below = std::iter::once(&None).chain(lines.iter().map(|line| &line.below));
    let mut text = String::new();
    for (row, below) in table.lines().zip(below) {
        text += &format!("{row}\n");
        text.extend(below.iter().map(|sentence| format!("    {sentence}\n")));
    }
    text + &legend(lines, known)
}

/// Returns what the marks and the symbols of the table mean, as far as it has them.
fn legend(lines: &[Line], known: &[Parameter]) -> String {
    let shows = |line: &Line, mark: &str| line.cells.iter().skip(2).any(|cell| cell.contains(mark));
    let has = |mark: &str| lines.iter().any(|line| shows(line, mark));
    let marks = [
        ("±", "±: one standard error"),
        ("[", "[…]: the 95 % interval, where it is far from ± two standard errors"),
        ("≥", "≥: every larger value fits equally"),
        ("≤", "≤: every smaller value fits equally"),
        ("–", "–: not determined by these shots, or, where the verdict is unusable, no number to use"),
        ("(bound)", "(bound): at the end of the allowed range"),
        ("no error", "no error: nothing to tell it from"),
        (" *", "*: near 1 whatever the model, as noise was estimated from the residuals"),
    ];
    let said: Vec<&str> = marks.iter().filter(|(mark, _)| has(mark)).map(|(_, words)| *words).collect();
    let mut text = if said.is_empty() { String::new() } else { format!("\n{}\n", said.join("; ")) };
    let rare = known.iter().filter(|parameter| !Parameter::COEFFICIENTS.contains(parameter));
    text.extend(rare.map(|parameter| format!("{}: {}\n", parameter.symbol(), parameter.meaning())));
    text
}

/// Returns the line of a data set: of one fit, or of those of all its labels.
fn line(fits: &[Fit], known: &[Parameter]) -> Line {
    let verdicts: Vec<(&Fit, Verdict)> = fits.iter().map(|fit| (fit, fit.verdict())).collect();
    let cells = known.iter().map(|parameter| range(&verdicts, *parameter)).collect::<Vec<_>>();
    let first_bad = verdicts.iter().find(|(_, verdict)| verdict.grade != Grade::Good);
    let (title, used, verdict, below) = if let [fit] = fits {
        let all = fit.shots_used + fit.shots_rejected.len();
        let used = fit.shots_used.to_string();
        let used = if fit.shots_rejected.is_empty() { used } else { format!("{used} of {all}") };
        let title = match &fit.group {
            Some((_, label)) => format!("{} / {label}", fit.dataset),
            None => fit.dataset.clone(),
        };
        let sentence = first_bad.map(|(_, verdict)| verdict.sentence.clone());
        (title, used, verdicts[0].1.grade.name().to_owned(), sentence)
    } else {
        let counts = Grade::ALL.map(|grade| verdicts.iter().filter(|(_, own)| own.grade == grade).count());
        let counted = Grade::ALL.into_iter().zip(counts).filter(|(_, count)| *count > 0);
        let counted: Vec<String> =
            counted.map(|(grade, count)| format!("{count} {}", grade.name())).collect();
        let below = first_bad.map(|(fit, verdict)| format!("{}: {}", label(fit), verdict.sentence));
        let used: usize = fits.iter().map(|fit| fit.shots_used).sum();
        let name = fits.first().map_or("", |fit| fit.dataset.as_str());
        (format!("{name} ({} labels)", fits.len()), used.to_string(), counted.join(", "), below)
    };
    let best = verdicts.iter().map(|(_, verdict)| verdict.grade).min();
    let grade = best.unwrap_or(Grade::Good);
    Line { grade, cells: [title, used].into_iter().chain(cells).collect(), verdict, below }
}

/// Returns from where to where a parameter goes over the labels that can be used; where all say the same, that.
fn range(fits: &[(&Fit, Verdict)], parameter: Parameter) -> String {
    let usable: Vec<&Fit> =
        fits.iter().filter(|(_, own)| own.grade != Grade::Unusable).map(|(fit, _)| *fit).collect();
    let mut cells: Vec<String> = usable.iter().map(|fit| brief(fit, parameter)).collect();
    cells.dedup();
    if let [one] = cells.as_slice() {
        return one.clone();
    }
    let determined = usable.iter().filter_map(|fit| fit.get(parameter));
    let determined = determined.filter(|own| own.status != Status::NotIdentified);
    let [low, high] = ends(determined.map(|own| own.value));
    let [low_text, high_text] = [low, high].map(|end| plain(end, 3));
    match (low > high, low_text == high_text) {
        (true, _) => "–".to_owned(),
        (_, true) => low_text,
        _ => format!("{low_text} to {high_text}"),
    }
}

/// Returns where the errors of a fit come from, its χ², and its first warnings; `--all` shows all.
fn details(fit: &Fit) -> String {
    const MOST_WARNINGS: usize = 3;
    let verdict = fit.verdict();
    let row = |unknown: &problem::Estimate| {
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
    let is_usable = verdict.grade != Grade::Unusable;
    let shown = fit.unknowns.iter().filter(|unknown| is_usable && unknown.id < Id::Scale);
    let rows: Vec<Vec<String>> = shown.filter_map(row).collect();
    let mut text = String::new();
    if !rows.is_empty() {
        let head = ["", "estimate", "error", "prior pull", "largest part of the error"];
        text += &format!("\n{}", Table::new(head, rows).with_numbers(2..4).text(""));
    }
    if let Some(reduced) = reduced_chi2(fit) {
        let estimated = if noise_estimated(fit) { ", the noise estimated from the residuals" } else { "" };
        text += &format!("χ²/dof = {} ({} dof{estimated})\n", chi2_text(reduced), fit.dof);
    }
    let others = fit.warnings().into_iter().filter(|warning| *warning != verdict.sentence);
    text.extend(others.take(MOST_WARNINGS).map(|warning| format!("! {warning}\n")));
    text
}

/// Returns the parameters that have a column: those of some fit, without the ratios of the balls, which few readers look for.
pub(super) fn parameters(fits: &[Fit]) -> Vec<Parameter> {
    let has = |parameter: Parameter| fits.iter().any(|fit| fit.get(parameter).is_some());
    let is_shown = |p: &Parameter| Parameter::COEFFICIENTS.contains(p) || has(*p) && !p.is_of_balls();
    Parameter::ALL.into_iter().filter(is_shown).collect()
}

pub(super) fn with_unit(text: &str, unit: &str) -> String {
    let space = if unit.is_empty() || unit == "°" { "" } else { " " };
    format!("{text}{space}{unit}")
}

/// Returns an estimate in one cell. Of a refuted model: the restitution that was measured without it, where there is one, else the
/// bare estimate.
pub(super) fn estimate(fit: &Fit, estimate: &Estimate) -> String {
    let value = plain(estimate.value, 4);
    if let Some(refuted) = fit.refuted.as_ref().filter(|_| estimate.status == Status::Free) {
        return match refuted.restitution.filter(|_| estimate.parameter == Parameter::E) {
            Some(own) => format!("measured {} (fit refuted)", with_error(own.value, own.std_error)),
            None => format!("{value} (refuted)"),
        };
    }
    if let Some([edge, bound]) = fit.plateau(estimate.parameter) {
        let sign = if bound >= edge { '≥' } else { '≤' };
        return format!("{sign} {}", plain(edge, 3));
    }
    if let Some(interval) = estimate.lopsided().filter(|_| estimate.status == Status::Free) {
        return with_interval(estimate.value, interval);
    }
    match (estimate.status, estimate.std_error) {
        (Status::Free, Some(error)) if error.is_finite() => with_error(estimate.value, error),
        (Status::Free, _) => format!("{value} (no error)"),
        (Status::Fixed, _) => format!("{value} (fixed)"),
        (Status::AtLowerBound, _) => format!("{value} (at lower bound)"),
        (Status::AtUpperBound, _) => format!("{value} (at upper bound)"),
        (Status::NotIdentified, _) => "– (not identified)".to_owned(),
    }
}

/// Returns an estimate in the cell of a table of fits.
pub(super) fn brief(fit: &Fit, parameter: Parameter) -> String {
    let Some(own) = fit.get(parameter) else { return "–".to_owned() };
    match own.status {
        Status::NotIdentified => "–".to_owned(),
        Status::AtLowerBound | Status::AtUpperBound => format!("{} (bound)", plain(own.value, 4)),
        Status::Free | Status::Fixed => estimate(fit, own),
    }
}

/// Returns two decimals, or three digits where those show nothing.
pub(super) fn chi2_text(chi2: f64) -> String {
    if (0.01..100.0).contains(&chi2) { format!("{chi2:.2}") } else { plain(chi2, 3) }
}
