//! A [`Fit`], or several, → `Report`.

use super::content::{self, Block, Report, Section, Table};
use super::plot;
use super::shots::{shot_list, tracks};
use super::terminal::{cells, chi2_text, estimate, parameters, table, with_unit};
use super::{ReportError, bodies, budgets, model, p_text, reduced_chi2, symbol, title};
use crate::fit::{Counted, Estimate, Fit, Grade, Noise, Status, Verdict};
use crate::measurement::number::{interval, plain, with_error};

/// Shots of a weight below this are listed in the report.
const DOWN_WEIGHTED: f64 = 0.5;

/// Returns all that there is to say of fits as text: of one its report, of several a line each, all warnings, and their error budgets.
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
        Section::of_figure("All impacts", "", plot::discs(fit)),
        Section::of_figure("Residual plots", tested, plot::residuals(fit)),
        budget(std::slice::from_ref(fit)),
    ];
    let rejected = fit.shots_rejected.iter().map(|one| [one.shot.clone(), one.reason.clone()]);
    let computation = [format!("model {}", model(fit)), format!("the search stopped: {}", fit.termination)];
    let folded = [
        Section::of_lines("How it was computed", "", computation.to_vec()),
        residual_tests(fit),
        Section::of_figure("Regions of pairs of parameters", "", plot::contours(fit)),
        identifiability(fit),
        influence(fit),
        weights(fit),
        bootstrap(fit),
        camera(fit),
        Section::of_rejected(rejected),
        Section::of_lines("Notes", "", fit.notes().into_iter().map(str::to_owned).collect()),
        Section::new("Shots, the largest residuals first", tested, [Block::Shots(shots)]),
    ];
    sections.extend(folded.map(Section::folded));
    let (kind, sizes) = bodies(fit);
    let facts = [
        ("source", fit.source.clone().unwrap_or_default()),
        ("cloth", fit.cloth.clone().unwrap_or_default()),
        (kind, sizes),
        ("method", fit.method_name().to_owned()),
        ("shots", format!("{} used, {} not used", fit.shots_used, fit.shots_rejected.len())),
    ];
    Report {
        title: title(fit),
        verdict: fit.verdict(),
        warnings: fit.warnings().into_iter().map(str::to_owned).collect(),
        facts: facts.to_vec(),
        sections,
    }
}

/// Returns the page that leads to the reports of the labels of a data set, each in a folder of its own.
pub(super) fn of_labels(fits: &[Fit], folders: &[String]) -> Report {
    let grades = || fits.iter().map(|fit| fit.verdict().grade);
    let grade = grades().max().unwrap_or(Grade::Good);
    let count = grades().filter(|own| *own == grade).count();
    Report {
        title: fits.first().map_or_else(String::new, |fit| fit.dataset.clone()),
        verdict: Verdict {
            grade,
            sentence: format!("{count} of {} labels are {}.", fits.len(), grade.name()),
        },
        warnings: Vec::new(),
        facts: Vec::new(),
        sections: of_several(fits, folders).to_vec(),
    }
}

/// Returns a line for each fit, which leads to the report in its folder if there are some; what could be wrong, and the error budgets.
fn of_several(fits: &[Fit], folders: &[String]) -> [Section; 3] {
    let known = parameters(fits);
    let (mut estimates, legend) = table(fits.iter().map(|fit| cells(fit, &known)).collect(), &known);
    estimates.links = folders.iter().map(|folder| format!("{folder}/report.html")).collect();
    let warnings = fits
        .iter()
        .flat_map(|fit| fit.warnings().into_iter().map(move |warning| format!("{}: {warning}", title(fit))));
    [
        Section::new("Estimates", "", [estimates.into(), Block::Lines(legend)]),
        Section::of_lines("What could be wrong", "", warnings.collect()),
        budget(fits),
    ]
}

/// Returns what makes up the errors of μ, μ_s and e of each fit, the largest part first.
fn budget(fits: &[Fit]) -> Section {
    // a single fit is not named
    let unnamed = usize::from(fits.len() == 1);
    let usable = fits.iter().filter(|fit| fit.verdict().grade != Grade::Unusable);
    let rows = usable.flat_map(|fit| {
        budgets(fit).into_iter().map(move |budget| {
            let parts = budget.parts.iter().map(|(source, error)| format!("{source} {}", plain(*error, 2)));
            let parts = parts.collect::<Vec<_>>().join(", ");
            let row =
                [title(fit), symbol(budget.of.name()), format!("± {}", plain(budget.std_error, 2)), parts];
            row.into_iter().skip(unnamed).collect()
        })
    });
    let about = "squares add up; parts below a tenth of the error are left out";
    let head = ["data set", "", "error", "of which"].into_iter().skip(unnamed);
    Section::new("Error budget", about, [Table::new(head, rows).into()])
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
    Section::new("Parameters", about, [table.into(), Block::Lines(correlations)])
}

/// Returns χ², what it counts, and its probability; of a film of balls first of the frames, then of the velocities.
fn chi2(fit: &Fit) -> Vec<String> {
    let Some(reduced) = reduced_chi2(fit) else {
        let why = "no degrees of freedom: the fit passes through the data and cannot be tested";
        return vec![why.to_owned()];
    };
    let line = |counted: Counted, chi2: f64, dof: usize, p: Option<f64>| {
        let test = match p {
            Some(p) => format!("{} of a larger one if model and noise are right", p_text(p)),
            None if fit.diagnostics.robust.is_some() => {
                format!("not tested, as outlying shots count less (weights below {DOWN_WEIGHTED} are listed)")
            }
            None => "not tested, as the noise was estimated from the same data".to_owned(),
        };
        let (counted, chi2, reduced) = (counted.words(), plain(chi2, 4), chi2_text(chi2 / dof as f64));
        format!("χ² of {counted} = {chi2} for {dof} degrees of freedom, χ²/dof = {reduced}: {test}")
    };
    let goodness = fit.diagnostics.goodness.as_ref();
    let tested = goodness.and_then(|found| found.p_value);
    let first = line(fit.counted(), reduced * fit.dof as f64, fit.dof, tested);
    let velocities = goodness.filter(|found| fit.frames.is_some() && found.dof > 0);
    let velocities = velocities.map(|found| line(fit.tested(), found.chi2, found.dof, tested));
    [first].into_iter().chain(velocities).collect()
}

fn noise(fit: &Fit, noise: &Noise) -> Vec<String> {
    let observable = noise.observable;
    let quantity = |si: f64| with_unit(&plain(si / observable.unit_si(), 3), observable.unit());
    let sd = match noise.estimated_sd {
        Some(sd) => format!("{}, estimated from the residuals", quantity(sd)),
        None if fit.footage => "as the frames of each shot tell".to_owned(),
        None => "given with the data".to_owned(),
    };
    vec![observable.label().to_owned(), noise.count.to_string(), sd, quantity(noise.rms)]
}

fn identifiability(fit: &Fit) -> Section {
    let lines = fit.diagnostics.identifiability.iter().flat_map(|found| {
        let values: Vec<String> = found.singular_values.iter().map(|value| plain(*value, 3)).collect();
        let first = format!(
            "singular values {} (no unit; of the Jacobian by parameters, columns scaled to 1), condition number {} (1: the \
             parameters do not interfere; above 30: hardly told apart)",
            values.join(", "),
            plain(found.condition, 3)
        );
        let names: Vec<_> = found.silent.iter().map(|parameter| parameter.symbol()).collect();
        let silent = (!names.is_empty()).then(|| format!("nothing depends on {}", names.join(", ")));
        [first].into_iter().chain(found.worst.as_ref().map(|worst| worst.words.clone())).chain(silent)
    });
    Section::of_lines("What the data determine", "", lines.collect())
}

/// Returns what tests say of the residuals: their size, trends, and their distribution.
fn residual_tests(fit: &Fit) -> Section {
    let mut lines = chi2(fit);
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
    let head = ["", "values", "sd of one value", "rms (root mean square)"];
    let noise = Table::new(head, fit.noise.iter().map(|one| noise(fit, one))).with_numbers(1..2);
    Section::new("Residuals", "", [Block::Lines(lines), noise.into()])
}

fn influence(fit: &Fit) -> Section {
    let goodness = fit.diagnostics.goodness.as_ref();
    let rows = goodness.iter().flat_map(|found| &found.influence).map(|shot| {
        let shifts = shot.shifts.iter();
        let shifts: Vec<String> = shifts.map(|(p, shift)| format!("{} {shift:+.2} se", p.symbol())).collect();
        let without = if shifts.is_empty() { "not determined".to_owned() } else { shifts.join(", ") };
        let cook = if shot.cook.is_finite() { plain(shot.cook, 2) } else { "∞".to_owned() };
        vec![shot.shot.clone(), plain(shot.leverage, 2), cook, without]
    });
    let threshold = goodness.and_then(|found| found.influential_from);
    let threshold = threshold.map_or(String::new(), |from| format!(", influential from {}", plain(from, 2)));
    let about = format!(
        "leverage: its share in the fit, of as many as there are parameters; Cook's distance: how far the estimates move without \
         it{threshold}; se: standard errors"
    );
    let table = Table::new(["shot", "leverage", "Cook's distance", "without it"], rows).with_numbers(1..3);
    Section::new("Shots that matter most", about, [table.into()])
}

fn weights(fit: &Fit) -> Section {
    let Some(robust) = &fit.diagnostics.robust else { return Section::default() };
    let weights = robust.weights.iter().map(|one| (format!("shot {}", one.shot), one.weight));
    down_weighted(robust.loss.name(), weights)
}

/// Returns shots with a small weight, by name and weight.
pub(super) fn down_weighted(losses: &str, weights: impl Iterator<Item = (String, f64)>) -> Section {
    let clear = weights.filter(|(_, weight)| *weight < DOWN_WEIGHTED);
    let mut lines: Vec<String> = clear
        .map(|(shot, weight)| format!("{shot}: weight {} (1: counts fully)", plain(weight, 2)))
        .collect();
    if lines.is_empty() {
        lines.push(format!("no shot has a weight below {DOWN_WEIGHTED} (1: counts fully)"));
    }
    Section::of_lines(format!("Shots that count less, {losses} loss"), "", lines)
}

fn bootstrap(fit: &Fit) -> Section {
    let Some(found) = &fit.diagnostics.bootstrap else { return Section::default() };
    let rows = found.estimates.iter().map(|one| {
        let unit = one.parameter.unit();
        let number = |value: f64| with_unit(&plain(value, 2), unit);
        let ends = |ends| with_unit(&interval(ends, Some(one.std_error)), unit);
        let symbol = one.parameter.symbol().to_owned();
        vec![symbol, number(one.std_error), number(one.bias), ends(one.percentile), ends(one.bca)]
    });
    let head = ["", "standard error", "bias", "95 % interval, percentile", "95 % interval, BCa"];
    let table = Table::new(head, rows).with_numbers(1..3);
    let failed = (found.failed > 0).then(|| format!("{} samples could not be fitted", found.failed));
    let about = format!(
        "{} samples of shots drawn anew, seed {}; bias: their mean less the estimate; BCa: corrected for it",
        found.replicates, found.seed
    );
    Section::new("Bootstrap", about, [table.into(), Block::Lines(failed.into_iter().collect())])
}

fn camera(fit: &Fit) -> Section {
    let Some(found) = &fit.camera else { return Section::default() };
    let rows = found.corrections.iter().map(|correction| {
        let value = with_error(correction.value, correction.std_error);
        vec![correction.which.words().to_owned(), value]
    });
    let table = Table::new(["", "found"], rows);
    let about = format!("from the frames of {} shots; ± one standard error", found.shots);
    Section::new("Camera", about, [table.into()])
}
