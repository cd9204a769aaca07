//! A [`Fit`] → [`Report`].

use super::content::{Block, Link, Report, Section, Shot, Table, facts};
use super::number::{count_of, interval, plain, with_error};
use super::shots::{shot_list, tracks};
use super::table::{self, INTERVAL, chi2_text, estimate, with_unit};
use super::trust::sections;
use super::{bodies, label, model, noise_estimated, p_text, plot, reduced_chi2};
use crate::fit::{Counted, DOWN_WEIGHTED, Estimate, Fit, FittedFilm, Grade, Noise, Status, Verdict};

/// Returns the report of a fit.
#[must_use]
pub fn content(fit: &Fit) -> Report {
    let mut warnings = fit.warnings.clone();
    if !fit.converged {
        warnings.insert(0, format!("Not converged: {}", fit.termination));
    }
    let tested = match fit.frames {
        Some(_) => "of the velocities after each impact, against the estimates of the fit",
        None => "",
    };
    let shots = shot_list(named(fit));
    let mut open = vec![parameters(fit)];
    open.extend(fit.frames.as_ref().and_then(|film| paths(fit, film, &shots)));
    let alt = "e against the closing speed, and the friction against the slip";
    open.extend(plot::discs::figure(fit).map(|figure| Section::of_figure("All impacts", "", alt, figure)));
    let residuals = Some(plot::residuals(fit)).filter(|figure| !figure.rows.is_empty());
    let alt = "Measured against predicted values, and residuals";
    open.extend(residuals.map(|figure| Section::of_figure("Residual plots", tested, alt, figure)));
    let mut folded = vec![computation(fit)];
    folded.extend(super::disc_section::section(fit));
    folded.push(Section::lines("χ²", chi2(fit)));
    if !fit.noise.is_empty() {
        let rows = fit.noise.iter().map(|one| noise(fit, one));
        let table =
            Table::new(["", "values", "sd of one value", "rms of the residuals"], rows).with_numbers(1..2);
        folded.push(Section::table("Noise", "rms: root mean square", table));
    }
    let (title, alt) = ("Regions of pairs of parameters", "68 % and 95 % regions of pairs of parameters");
    folded.extend(plot::contours::figure(fit).map(|figure| Section::of_figure(title, "", alt, figure)));
    folded.extend(sections(fit));
    folded.extend(camera(fit));
    let rejected =
        fit.shots_rejected.iter().map(|rejected| [&rejected.shot, &rejected.reason].map(String::clone));
    folded.extend(Section::of_rejected(rejected));
    folded.extend(Section::of_notes(fit.notes.clone()));
    folded.extend(Section::of_shots(shots, tested));
    open.extend(folded.into_iter().map(Section::folded));
    let (title, verdict) = (super::title(fit), fit.verdict());
    Report { title, verdict, warnings, facts: about(fit), sections: open }
}

/// The paths of all shots of a film.
fn paths(fit: &Fit, film: &FittedFilm, shots: &[Shot]) -> Option<Section> {
    let alt = "The paths of both balls in all shots, seen from above";
    let figure = Block::figure(alt, plot::paths::figure(&fit.dataset, film)?);
    let blocks = [figure].into_iter().chain(tracks(film, shots).map(Block::Tracks));
    Some(Section::new("All shots", "", blocks.collect()))
}

/// Returns each residual with the name of its shot.
fn named(fit: &Fit) -> impl Iterator<Item = (String, &crate::fit::Residual)> {
    fit.residuals.iter().map(|residual| (residual.shot.clone(), residual))
}

/// Returns the page that leads to the reports of the labels of a data set, each in a folder of its own.
pub(super) fn of_labels(fits: &[Fit], folders: &[String]) -> Report {
    let parameters = table::parameters(fits);
    let row = |fit: &Fit| {
        let cells = parameters.iter().map(|parameter| table::brief(fit, *parameter));
        [label(fit), fit.shots_used.to_string()].into_iter().chain(cells).collect()
    };
    let symbols = parameters.iter().map(|parameter| parameter.symbol());
    let head = ["label", "shots"].into_iter().chain(symbols);
    let link = |(fit, folder): (&Fit, &String)| {
        let verdict = fit.verdict();
        let text = format!("{}. {}", verdict.grade.name(), verdict.sentence);
        Link { name: label(fit), place: format!("{folder}/report.html"), text }
    };
    let links = fits.iter().zip(folders).map(link).collect();
    let verdicts: Vec<_> = fits.iter().map(Fit::verdict).collect();
    let worst = verdicts.iter().map(|verdict| verdict.grade).max().unwrap_or(Grade::Good);
    let alike = verdicts.iter().filter(|verdict| verdict.grade == worst).count();
    Report {
        title: fits.first().map_or_else(String::new, |fit| fit.dataset.clone()),
        verdict: Verdict {
            grade: worst,
            sentence: format!("{alike} of {} labels are {}.", fits.len(), worst.name()),
        },
        warnings: Vec::new(),
        facts: Vec::new(),
        sections: vec![
            Section::table("Estimates", "± one standard error", Table::new(head, fits.iter().map(row))),
            Section::new("Reports", "", vec![Block::Links(links)]),
        ],
    }
}

/// The camera of footage as it was fitted.
fn camera(fit: &Fit) -> Option<Section> {
    let found = fit.camera.as_ref().filter(|found| !found.corrections.is_empty())?;
    let rows = found.corrections.iter().map(|correction| {
        let value = with_error(correction.value, correction.std_error);
        vec![correction.which.words().to_owned(), value]
    });
    let mut blocks = vec![Block::Table(Table::new(["", "found"], rows))];
    let alt = "How far positions were moved";
    blocks.extend(plot::camera::figure(found).map(|figure| Block::figure(alt, figure)));
    Some(Section::new(
        "Camera",
        format!("from the frames of {} shots; ± one standard error", found.shots),
        blocks,
    ))
}

/// What was measured, and how it was fitted.
fn about(fit: &Fit) -> Vec<super::content::Fact> {
    facts([
        ("source", fit.source.clone().unwrap_or_default()),
        ("cloth", fit.cloth.clone().unwrap_or_default()),
        bodies(fit),
        ("method", fit.method_name().to_owned()),
        ("shots", format!("{} used, {} not used", fit.shots_used, fit.shots_rejected.len())),
    ])
}

/// What only those want to know who look into the computation.
fn computation(fit: &Fit) -> Section {
    let search = format!(
        "the search stopped after {}, {} s: {}",
        count_of(fit.iterations, "step"),
        plain(fit.seconds, 2),
        fit.termination
    );
    Section::lines("How it was computed", vec![format!("model {}", model(fit)), search])
}

/// Of intervals.
const PROFILE: &str =
    "profile: both ends from how χ² rises as the parameter moves, which need not be symmetric";

fn parameters(fit: &Fit) -> Section {
    let profiled = fit.estimates.iter().any(Estimate::is_profiled);
    let lopsided = fit.refuted.is_none() && fit.estimates.iter().any(|own| own.lopsided().is_some());
    let how = match (profiled, lopsided) {
        (false, _) => String::new(),
        (true, false) => format!("; {PROFILE}"),
        (true, true) => format!("; {INTERVAL}; {PROFILE}"),
    };
    let head = match fit.refuted {
        Some(_) => ["", "estimate", "", "meaning"],
        None => ["", "estimate", "95 % interval", "meaning"],
    };
    let rows = fit.estimates.iter().map(|estimate| parameter(fit, estimate));
    let mut blocks = vec![Block::Table(Table::new(head, rows))];
    let mut lines: Vec<String> = fit.estimates.iter().filter_map(at_bound).collect();
    lines.extend(correlations(fit));
    if !lines.is_empty() {
        blocks.push(Block::Lines(lines));
    }
    let errors = if fit.refuted.is_some() { "" } else { "± one standard error" };
    Section::new("Parameters", format!("{errors}{how}"), blocks)
}

fn parameter(fit: &Fit, parameter: &Estimate) -> Vec<String> {
    let unit = parameter.parameter.unit();
    let interval = match parameter.interval_95 {
        Some(ends) if ends.iter().all(|end| end.is_finite()) => {
            let how = if parameter.is_profiled() { " profile" } else { "" };
            with_unit(&interval(ends, parameter.std_error), unit, " ") + how
        }
        _ => String::new(),
    };
    let value = match parameter.status {
        Status::NotIdentified => {
            format!("{}, left at {}", estimate(fit, parameter), plain(parameter.value, 4))
        }
        _ => estimate(fit, parameter),
    };
    let value = with_unit(&value, unit, " ");
    [parameter.parameter.symbol(), &value, &interval, parameter.parameter.meaning()]
        .map(str::to_owned)
        .to_vec()
}

fn at_bound(estimate: &Estimate) -> Option<String> {
    let error = estimate.std_error_at_bound.filter(|error| error.is_finite())?;
    let value = with_unit(&with_error(estimate.value, error), estimate.parameter.unit(), " ");
    Some(format!(
        "{}: {value} if the parameters at their bounds are truly there",
        estimate.parameter.symbol()
    ))
}

/// One line, of the pairs that have a correlation.
fn correlations(fit: &Fit) -> Option<String> {
    let mut pairs = Vec::new();
    for (row, first) in fit.estimates.iter().enumerate() {
        for (column, second) in fit.estimates.iter().enumerate().skip(row + 1) {
            if let Some(value) = fit.correlation.get((row, column)).filter(|value| value.is_finite()) {
                let [first, second] = [first, second].map(|estimate| estimate.parameter.symbol());
                pairs.push(format!("{first} and {second} {value:+.3}"));
            }
        }
    }
    (!pairs.is_empty()).then(|| format!("correlation of the errors, −1 to 1: {}", pairs.join(", ")))
}

/// χ², what it counts, and what it says about model and noise; of a film of balls first of the frames, then of the velocities.
fn chi2(fit: &Fit) -> Vec<String> {
    let Some(reduced) = reduced_chi2(fit) else {
        return vec![
            "no degrees of freedom: the fit passes through the data and cannot be tested".to_owned(),
        ];
    };
    let goodness = fit.diagnostics.goodness.as_ref();
    let mut lines = vec![of(fit.counted(), fit.chi2, fit.dof, reduced)];
    match &fit.diagnostics.joint {
        Some(joint) => {
            lines[0] += &joint.p_value.map_or(
                ": not tested, as the noise of the positions was estimated from the same frames".to_owned(),
                by_chance,
            );
            if let Some(found) = goodness.filter(|found| found.dof > 0) {
                let line = of(fit.tested(), found.chi2, found.dof, found.chi2 / found.dof as f64);
                lines.push(line + &found.p_value.map_or(": not tested".to_owned(), by_chance));
            }
        }
        None => lines[0] += &tested(fit),
    }
    if fit.prior_chi2 >= LEAST_SHOWN * fit.chi2 {
        lines.push(format!(
            "{} of this χ² is what priors and errors that all shots share add",
            plain(fit.prior_chi2, 2)
        ));
    }
    lines
}

/// A smaller part of χ² is not worth a line.
const LEAST_SHOWN: f64 = 0.005;

fn of(counted: Counted, chi2: f64, dof: usize, reduced: f64) -> String {
    format!(
        "χ² of {} = {} for {dof} degrees of freedom, χ²/dof = {}",
        counted.words(),
        plain(chi2, 4),
        chi2_text(reduced)
    )
}

/// Whether χ² tells model from noise, and what it says.
fn tested(fit: &Fit) -> String {
    let p = fit.diagnostics.goodness.as_ref().and_then(|goodness| goodness.p_value);
    if noise_estimated(fit) {
        ": near 1 whatever the model, as noise was estimated from these residuals".to_owned()
    } else if fit.diagnostics.robust.is_some() {
        format!(": not tested, as outlying shots count less (weights below {DOWN_WEIGHTED} are listed)")
    } else {
        p.map_or(String::new(), by_chance)
    }
}

fn by_chance(p: f64) -> String {
    format!("; were model and noise right, chance would give a larger χ² with probability {}", p_text(p))
}

fn noise(fit: &Fit, noise: &Noise) -> Vec<String> {
    let observable = noise.observable;
    let unit = observable.unit();
    let quantity = |si: f64| {
        let space = if unit == "°" { "" } else { " " };
        with_unit(&plain(si / observable.unit_si(), 3), unit, space)
    };
    let sd = match noise.estimated_sd {
        Some(sd) => format!("{}, estimated from the residuals", quantity(sd)),
        None if fit.footage => "as the frames of each shot tell".to_owned(),
        None => "given with the data".to_owned(),
    };
    vec![observable.label().to_owned(), noise.count.to_string(), sd, quantity(noise.rms)]
}
