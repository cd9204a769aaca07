//! The screen that `caromfit fit` prints: a line per data set with its verdict, those that can be
//! used first; for a single fit also the sources of its errors, and what else to know.

use minijinja::value::Serde;
use minijinja::{Value as Values, context};

use super::plot::ends;
use super::templates::{self, Table};
use super::{chi2_words, sources};
use crate::fit::{Estimate, Fit, Grade, Status, Verdict};
use crate::measurement::number::{plain, with_error, with_interval};
use crate::measurement::parameter::Parameter;
use crate::problem::{self, Id};
use crate::words::symbol;

/// A line of the table and what is said below it.
struct Line {
    grade: Grade,
    cells: Vec<String>,
    below: Option<String>,
}

/// Returns one line per data set, whose labels are folded into it, the best verdict first; below a
/// line the sentence of its verdict if it is not good, or the only one.
pub fn overview(fits: &[Fit]) -> String {
    if fits.is_empty() {
        return String::new();
    }
    let known = parameters(fits);
    let is_same =
        |one: &Fit, next: &Fit| one.group.is_some() && next.group.is_some() && one.dataset == next.dataset;
    let mut lines: Vec<Line> = fits.chunk_by(is_same).map(|fits| line(fits, &known)).collect();
    lines.sort_by_key(|line| line.grade);
    if let ([line], [fit]) = (lines.as_mut_slice(), fits) {
        line.below.get_or_insert(fit.verdict().sentence);
    }
    let (cells, below): (Vec<_>, Vec<_>) = lines.into_iter().map(|line| (line.cells, line.below)).unzip();
    let estimates = table(cells, &known);
    let text = estimates.text("");
    // the head has no sentence
    let lines: Vec<_> = text.lines().zip([None].into_iter().chain(below)).collect();
    let lines_of_table = Serde(lines);
    let details_of_one = if let [fit] = fits { details(fit) } else { Values::UNDEFINED };
    let estimates = Serde(estimates);
    let values = context! { lines_of_table, estimates, rare => rare(&known), ..details_of_one };
    templates::text(include_str!("templates/overview.jinja"), values)
}

/// Returns a table of fits.
pub(super) fn table(rows: Vec<Vec<String>>, known: &[Parameter]) -> Table {
    let symbols = known.iter().map(|parameter| match parameter.unit() {
        "" => parameter.symbol().to_owned(),
        unit => format!("{}, {unit}", parameter.symbol()),
    });
    let head = ["data set", "shots"].map(str::to_owned).into_iter().chain(symbols);
    Table::new(head.chain(["verdict".to_owned()]), rows)
}

/// Returns the meaning of parameters that few fits have.
pub(super) fn rare(known: &[Parameter]) -> Vec<String> {
    let rare = known.iter().filter(|parameter| !Parameter::COEFFICIENTS.contains(parameter));
    rare.map(|parameter| format!("{}: {}", parameter.symbol(), parameter.meaning())).collect()
}

/// Returns the name of a fit, its shots, its estimates, which only a verdict that it can be used
/// lets stand, and that verdict.
pub(super) fn cells(fit: &Fit, known: &[Parameter]) -> Vec<String> {
    let name = fit.label().map_or(fit.dataset.clone(), |label| format!("{} / {label}", fit.dataset));
    let shots = match fit.shots_rejected.len() {
        0 => fit.shots_used().to_string(),
        rejected => format!("{} of {}", fit.shots_used(), fit.shots_used() + rejected),
    };
    let grade = fit.verdict().grade;
    let mut cells = vec![name, shots];
    cells.extend(known.iter().map(|parameter| {
        let shown = fit.get(*parameter).filter(|_| grade != Grade::Unusable);
        shown.map_or("–".to_owned(), |shown| estimate(fit, shown))
    }));
    cells.push(grade.name().to_owned());
    cells
}

/// Returns the line of a data set; of one whose labels are fitted separately with the range of each
/// parameter over those that can be used.
fn line(fits: &[Fit], known: &[Parameter]) -> Line {
    let mut verdicts: Vec<(&Fit, Verdict)> = fits.iter().map(|fit| (fit, fit.verdict())).collect();
    let grade = verdicts.iter().map(|(_, own)| own.grade).min().unwrap_or(Grade::Good);
    let bad = verdicts.iter().find(|(_, own)| own.grade != Grade::Good);
    if let [fit] = fits {
        return Line { grade, cells: cells(fit, known), below: bad.map(|(_, own)| own.sentence.clone()) };
    }
    let below = bad.map(|(fit, own)| format!("{}: {}", fit.label().unwrap_or_default(), own.sentence));
    let count = |grade: Grade| {
        let count = verdicts.iter().filter(|(_, own)| own.grade == grade).count();
        (count > 0).then(|| format!("{count} {}", grade.name()))
    };
    let counts: Vec<String> = Grade::ALL.into_iter().filter_map(count).collect();
    let used: usize = fits.iter().map(|fit| fit.shots_used()).sum();
    let mut cells = vec![format!("{} ({} labels)", fits[0].dataset, fits.len()), used.to_string()];
    verdicts.retain(|(_, own)| own.grade != Grade::Unusable);
    cells.extend(known.iter().map(|parameter| {
        let estimates = verdicts.iter().filter_map(|(fit, _)| fit.get(*parameter));
        let identified = estimates.filter(|own| own.status != Status::NotIdentified);
        let [low, high] = ends(identified.map(|own| own.value));
        let mut texts = [low, high].map(|end| plain(end, 3)).to_vec();
        texts.dedup();
        if low > high { "–".to_owned() } else { texts.join(" to ") }
    }));
    cells.push(counts.join(", "));
    Line { grade, cells, below }
}

/// Returns the sources of the errors of a fit, its χ², and its first warnings; `--all` shows all.
fn details(fit: &Fit) -> Values {
    const MOST_WARNINGS: usize = 3;
    let verdict = fit.verdict();
    let others = fit.warnings().into_iter().filter(|warning| *warning != verdict.sentence);
    // the camera's unknowns, of which there are many, stand in the report
    let unknowns = unknowns(fit, |id| id < Id::Scale);
    let is_shown = verdict.grade != Grade::Unusable && !unknowns.is_empty();
    context! {
        unknowns => is_shown.then(|| Table::new(UNKNOWN_COLUMNS, unknowns).text("")),
        chi2 => chi2_words(fit),
        warnings => Serde(others.take(MOST_WARNINGS).collect::<Vec<_>>()),
    }
}

/// The columns of [`unknowns`].
pub(super) const UNKNOWN_COLUMNS: [&str; 5] =
    ["", "estimate", "error", "prior pull", "largest part of the error"];

/// Returns what all shots share, if the data determine it, with its errors, the pulls of priors in
/// their standard deviations, and the largest parts of the errors.
pub(super) fn unknowns(fit: &Fit, is_shown: impl Fn(Id) -> bool) -> Vec<Vec<String>> {
    let is_determined = |id: Id| {
        let parameters = Parameter::ALL.into_iter().filter(|parameter| Id::from(*parameter) == id);
        parameters.filter_map(|parameter| fit.get(parameter)).all(|estimate| estimate.std_error.is_some())
    };
    let row = |unknown: &problem::Estimate| {
        let error = unknown.std_error.filter(|error| *error > 0.0)?;
        let budget = fit.budget.iter().find(|budget| budget.id == unknown.id);
        let largest = budget.and_then(|budget| sources(budget).into_iter().next());
        let pull = unknown.prior.map(|prior| (unknown.value - prior.mean) / prior.sd);
        Some(vec![
            symbol(unknown.id.name()).to_owned(),
            with_error(unknown.value, error),
            format!("{} %", plain(100.0 * (error / unknown.value).abs(), 2)),
            pull.map_or(String::new(), |pull| format!("{pull:+.1}")),
            largest.map_or(String::new(), |(source, error)| format!("{source}, ± {}", plain(error, 2))),
        ])
    };
    let unknowns = fit.solution.estimates();
    let shown = unknowns.iter().filter(|unknown| is_shown(unknown.id) && is_determined(unknown.id));
    shown.filter_map(row).collect()
}

/// Returns the parameters that have a column: those of some fit, without the ratios of the balls,
/// which few readers look for.
pub(super) fn parameters(fits: &[Fit]) -> Vec<Parameter> {
    let has = |parameter: Parameter| fits.iter().any(|fit| fit.get(parameter).is_some());
    let is_shown = |p: &Parameter| Parameter::COEFFICIENTS.contains(p) || has(*p) && !p.is_of_balls();
    Parameter::ALL.into_iter().filter(is_shown).collect()
}

/// Returns an estimate in one cell.
pub(super) fn estimate(fit: &Fit, estimate: &Estimate) -> String {
    let value = plain(estimate.value, 4);
    if fit.is_refuted() && estimate.status == Status::Free {
        return format!("{value} (refuted)");
    }
    if let Some([edge, bound]) = fit.plateau(estimate.parameter) {
        let sign = if bound >= edge { '≥' } else { '≤' };
        return format!("{sign} {}", plain(edge, 3));
    }
    if let Some(interval) = estimate.lopsided().filter(|_| estimate.status == Status::Free) {
        return with_interval(estimate.value, interval);
    }
    let mark = match (estimate.status, estimate.std_error) {
        (Status::Free, Some(error)) if error.is_finite() => return with_error(estimate.value, error),
        (Status::Free, _) => "no error",
        (Status::Fixed, _) => "fixed",
        (Status::AtLowerBound, _) => "at lower bound",
        (Status::AtUpperBound, _) => "at upper bound",
        (Status::NotIdentified, _) => return "–".to_owned(),
    };
    format!("{value} ({mark})")
}
