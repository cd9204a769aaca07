//! A [`Fit`], or several, → `Report`.

use super::content::{self, Block, Report, Section, Table};
use super::document::FitDocument;
use super::plot;
use super::shots::{shot_list, tracks};
use super::terminal::{cells, estimate, parameters, table, unknowns, with_unit};
use super::{ReportError, bodies, budgets, chi2_words, model, p_text, symbol, title};
use crate::fit::{Estimate, Fit, Grade, Rejected, Status, Verdict};
use crate::measurement::number::{interval, plain};

/// Returns all that there is to say of fits as text: of one its report, of several a line each, all
/// warnings, and their error budgets.
pub fn as_text(fits: &[Fit]) -> String {
    match fits {
        [fit] => content::text(&content(fit)),
        several => content::sections(&of_several(several, &[])).trim_start().to_owned(),
    }
}

/// Returns report.html of a fit.
pub fn page(fit: &Fit) -> Result<String, ReportError> {
    content::html(&content(fit))
}

fn content(fit: &Fit) -> Report {
    let document = FitDocument::new(fit);
    let tested = match fit.frames {
        Some(_) => "of the velocities after each impact, against the estimates of the fit",
        None => "",
    };
    let shots = shot_list(fit.residuals.iter().map(|residual| (residual.shot.clone(), residual)));
    let paths = fit.frames.iter().flat_map(|film| {
        let alt = "The paths of both balls in all shots, seen from above";
        let figure = Block::figure(alt, plot::all_shots(&fit.dataset, film));
        [figure].into_iter().chain(tracks(film, &shots).map(Block::Tracks))
    });
    let mut sections = vec![
        parameter_section(fit),
        Section::new("All shots", "", paths),
        Section::new("All impacts", "", [Block::figure("e and friction of all impacts", plot::discs(fit))]),
        Section::new("Residual plots", tested, [Block::figure("Residual plots", plot::residuals(fit))]),
        budget(std::slice::from_ref(fit)),
    ];
    let notes = fit.notes().into_iter().map(str::to_owned).collect();
    let pairs = Block::figure("Regions of pairs of parameters", plot::contours(fit));
    let mut folded =
        vec![residual_tests(fit, &document), Section::new("Regions of pairs of parameters", "", [pairs])];
    folded.extend(diagnostics(fit));
    folded.extend([
        rejected(fit.shots_rejected.iter().map(|one| (String::new(), one))),
        Section::new("Notes", "", [Block::Lines(notes)]),
        Section::new("Shots, the largest residuals first", tested, [Block::Shots(shots)]),
    ]);
    sections.extend(folded.into_iter().map(Section::folded));
    let (kind, sizes) = bodies(fit);
    let facts = vec![
        ("source", fit.source.clone().unwrap_or_default()),
        ("cloth", fit.cloth.clone().unwrap_or_default()),
        (kind, sizes),
        ("method", fit.method_name().to_owned()),
        ("model", model(fit)),
        ("search", fit.termination.clone()),
        ("shots", format!("{} used, {} not used", fit.shots_used, fit.shots_rejected.len())),
    ];
    let verdict = fit.verdict();
    let others = fit.warnings().into_iter().filter(|warning| *warning != verdict.sentence);
    Report { title: title(fit), warnings: others.map(str::to_owned).collect(), verdict, facts, sections }
}

/// Returns the page that leads to the reports of the labels of a data set, each in a folder of its
/// own.
pub(super) fn of_labels(fits: &[Fit], folders: &[String]) -> Report {
    let grades = || fits.iter().map(|fit| fit.verdict().grade);
    let grade = grades().max().unwrap_or(Grade::Good);
    let count = grades().filter(|own| *own == grade).count();
    let sentence = format!("{count} of {} labels are {}.", fits.len(), grade.name());
    Report {
        title: fits.first().map_or_else(String::new, |fit| fit.dataset.clone()),
        verdict: Verdict { grade, sentence },
        warnings: Vec::new(),
        facts: Vec::new(),
        sections: of_several(fits, folders).to_vec(),
    }
}

/// Returns a line for each fit, which leads to the report in its folder if there are some; what
/// could be wrong, and the error budgets.
fn of_several(fits: &[Fit], folders: &[String]) -> [Section; 3] {
    let known = parameters(fits);
    let (mut estimates, legend) = table(fits.iter().map(|fit| cells(fit, &known)).collect(), &known);
    estimates.links = folders.iter().map(|folder| format!("{folder}/report.html")).collect();
    let warnings = fits
        .iter()
        .flat_map(|fit| fit.warnings().into_iter().map(move |warning| format!("{}: {warning}", title(fit))));
    [
        Section::new("Estimates", "", [Block::Table(estimates), Block::Lines(legend)]),
        Section::new("What could be wrong", "", [Block::Lines(warnings.collect())]),
        budget(fits),
    ]
}

/// Returns what makes up the errors of μ, μ_s and e of each fit, the largest part first.
fn budget(fits: &[Fit]) -> Section {
    // a single fit is not named
    let unnamed = usize::from(fits.len() == 1);
    let mut rows = Vec::new();
    for fit in fits.iter().filter(|fit| fit.verdict().grade != Grade::Unusable) {
        for budget in budgets(fit) {
            let parts = budget.parts.iter().map(|(source, error)| format!("{source} {}", plain(*error, 2)));
            let error = format!("± {}", plain(budget.std_error, 2));
            let row = [
                title(fit),
                symbol(budget.of.name()).to_owned(),
                error,
                parts.collect::<Vec<_>>().join(", "),
            ];
            rows.push(row.into_iter().skip(unnamed).collect());
        }
    }
    let about = "squares add up; parts below a tenth of the error are left out";
    let head = ["data set", "", "error", "of which"].into_iter().skip(unnamed);
    Section::new("Error budget", about, [Block::Table(Table::new(head, rows))])
}

/// Returns the section of shots that were not used, with the names of their samples and the
/// reasons.
pub(super) fn rejected<'a>(shots: impl Iterator<Item = (String, &'a Rejected)>) -> Section {
    let row = |(sample, one): (String, &Rejected)| vec![sample + &one.shot, one.reason.clone()];
    let table = Table::new(["shot", "why"], shots.map(row));
    Section::new("Shots that were not used", "", [Block::Table(table)])
}

fn parameter_section(fit: &Fit) -> Section {
    let about = "±: one standard error; profile: both ends from how χ² rises as the parameter moves";
    let row = |own: &Estimate| {
        let (symbol, unit) = (own.parameter.symbol().to_owned(), own.parameter.unit());
        let ends = own.interval_95.filter(|ends| ends.iter().all(|end| end.is_finite()));
        let how = if own.is_profiled() { " profile" } else { "" };
        let ends = ends.map(|ends| with_unit(&interval(ends, own.std_error), unit) + how);
        let mut value = estimate(fit, own);
        if own.status == Status::NotIdentified {
            value += &format!(", left at {}", plain(own.value, 4));
        }
        let meaning = own.parameter.meaning().to_owned();
        vec![symbol, with_unit(&value, unit), ends.unwrap_or_default(), meaning]
    };
    let table = Table::new(["", "estimate", "95 % interval", "meaning"], fit.estimates.iter().map(row));
    let mut pairs = Vec::new();
    for (row, first) in fit.estimates.iter().enumerate() {
        for (column, second) in fit.estimates.iter().enumerate().skip(row + 1) {
            if let Some(value) = fit.correlation.get((row, column)).filter(|value| value.is_finite()) {
                let [first, second] = [first, second].map(|estimate| estimate.parameter.symbol());
                pairs.push(format!("{first} and {second} {value:+.3}"));
            }
        }
    }
    let correlations = format!("correlation of the errors, −1 to 1: {}", pairs.join(", "));
    let correlations = if pairs.is_empty() { Vec::new() } else { vec![correlations] };
    Section::new("Parameters", about, [Block::Table(table), Block::Lines(correlations)])
}

/// Returns χ² and its probability.
fn chi2(fit: &Fit) -> String {
    let goodness = fit.diagnostics.goodness.as_ref();
    let test = match goodness.and_then(|found| found.p_value) {
        Some(p) => format!(": {} of a larger one if model and noise are right", p_text(p)),
        None if fit.diagnostics.robust.is_some() => ": not tested, as outlying shots count less".to_owned(),
        None => ": not tested".to_owned(),
    };
    chi2_words(fit) + if fit.dof > 0 { &test } else { "" }
}

/// Returns what tests say of the residuals: their size, trends, and their distribution.
fn residual_tests(fit: &Fit, document: &FitDocument) -> Section {
    let mut lines = vec![chi2(fit)];
    if let Some(found) = &fit.diagnostics.goodness {
        let significant = found.trends.iter().filter(|trend| trend.significant);
        let significant: Vec<String> = significant.map(|trend| trend.words.clone()).collect();
        let most = found.trends.first().filter(|_| significant.is_empty());
        lines.extend(significant);
        lines.extend(most.map(|first| {
            format!(
                "no trend with speed, cut angle or spin; the most significant: {} with {}, {}, corrected for {} tests",
                first.quantity,
                first.variable.name(),
                p_text(first.p_corrected),
                found.trends.len()
            )
        }));
        lines.extend(found.normality.map(|tested| {
            let (statistic, p) = (plain(tested.statistic, 3), p_text(tested.p_value));
            format!("normal distribution: Anderson-Darling A² = {statistic}, {p}")
        }));
    }
    let noise = Table::of(
        &document.noise,
        &[
            ("column", "/observable"),
            ("unit", "/unit"),
            ("values", "/count"),
            ("sd, if estimated from the residuals", "/estimated_sd"),
            ("rms (root mean square)", "/rms"),
        ],
    );
    Section::new("Residuals", "", [Block::Lines(lines), noise])
}

/// Returns what the data determine, the shots that matter most or count less, resampled estimates,
/// and all unknowns.
fn diagnostics(fit: &Fit) -> Vec<Section> {
    let found = &fit.diagnostics;
    let mut sections = Vec::new();
    if let Some(identified) = &found.identifiability {
        let values: Vec<String> = identified.singular_values.iter().map(|value| plain(*value, 3)).collect();
        let mut lines = vec![format!(
            "singular values {} (no unit; of the Jacobian by parameters, columns scaled to 1), condition number {} (1: the \
             parameters do not interfere; above 30: poorly distinguished)",
            values.join(", "),
            plain(identified.condition, 3)
        )];
        lines.extend(identified.worst.iter().map(|worst| worst.words.clone()));
        let silent = identified.silent.iter();
        lines.extend(silent.map(|parameter| format!("no observation depends on {}", parameter.symbol())));
        sections.push(Section::new("What the data determine", "", [Block::Lines(lines)]));
    }
    if let Some(goodness) = &found.goodness {
        let from = goodness.influential_from;
        let threshold = from.map_or(String::new(), |from| format!(", influential from {}", plain(from, 2)));
        let about = format!(
            "leverage: its share in the fit, of as many as there are parameters; Cook's distance: how far the estimates move without \
             it{threshold}"
        );
        let columns = [
            ("shot", "/shot"),
            ("leverage", "/leverage"),
            ("Cook's distance", "/cook_distance"),
            ("shifts without it, in standard errors", "/shift_without_it_in_std_errors"),
        ];
        let table = Table::of(&goodness.influence, &columns);
        sections.push(Section::new("Shots that matter most", about, [table]));
    }
    if let Some(robust) = &found.robust {
        let table = Table::of(&robust.weights, &[("shot", "/shot"), ("weight (1: counts fully)", "/weight")]);
        sections.push(Section::new(count_less(robust.loss.name()), "", [table]));
    }
    if let Some(bootstrap) = &found.bootstrap {
        let failed =
            (bootstrap.failed > 0).then(|| format!("{} samples could not be fitted", bootstrap.failed));
        let about = format!(
            "{} samples of shots drawn again, seed {}; bias: their mean less the estimate; BCa: corrected for it",
            bootstrap.replicates, bootstrap.seed
        );
        let columns = [
            ("", "/0"),
            ("standard error", "/1/std_error"),
            ("bias", "/1/bias"),
            ("95 % interval, percentile", "/1/interval_95_percentile"),
            ("95 % interval, BCa", "/1/interval_95_bca"),
        ];
        let table = Table::of(bootstrap.estimates.iter().map(|one| (one.parameter, one)), &columns);
        sections.push(Section::new("Bootstrap", about, [table, Block::Lines(failed.into_iter().collect())]));
    }
    if fit.verdict().grade != Grade::Unusable {
        let about = "all that the shots share: contact, balls, cloth, time and camera; units as in fit.json";
        let table = Block::Table(unknowns(fit, |_| true));
        sections.push(Section::new("Unknowns", about, [table]));
    }
    sections
}

/// Returns the title of the section of shots with weights below 1.
pub(super) fn count_less(losses: &str) -> String {
    format!("Shots that count less, {losses} loss")
}
