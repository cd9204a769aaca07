//! A [`Fit`] → [`Report`].

use super::content::{Block, Report, Section, Table, facts};
use super::number::{interval, plain, with_error};
use super::shots::{shot_list, tracks};
use super::table::{self, INTERVAL, chi2_text, estimate, with_unit};
use super::{bodies, label, model, noise_estimated, p_text, plot, reduced_chi2, text, trust};
use crate::fit::{Counted, DOWN_WEIGHTED, Estimate, Fit, Grade, Noise, Status, Verdict};

/// Returns the report of a fit as text, which says what each number means.
#[must_use]
pub fn as_text(fit: &Fit) -> String {
    text::walk(&content(fit))
}

/// Returns the report of a fit.
#[must_use]
pub fn content(fit: &Fit) -> Report {
    let stopped = (!fit.converged).then(|| format!("Not converged: {}", fit.termination));
    let tested = match fit.frames {
        Some(_) => "of the velocities after each impact, against the estimates of the fit",
        None => "",
    };
    let shots = shot_list(fit.residuals.iter().map(|residual| (residual.shot.clone(), residual)));
    let paths = fit.frames.iter().flat_map(|film| {
        let alt = "The paths of both balls in all shots, seen from above";
        let figure = Block::figure(alt, plot::track::of_all(&fit.dataset, film));
        [figure].into_iter().chain(tracks(film, &shots).map(Block::Tracks))
    });
    let figure = |title: &str, about: &str, alt: &'static str, figure: plot::Figure| {
        Section::new(title, about, [Block::figure(alt, figure)])
    };
    let alt = "e against the closing speed, and the friction against the slip";
    let open = [
        parameters(fit),
        Section::new("All shots", "", paths),
        figure("All impacts", "", alt, plot::discs::figure(fit)),
        figure(
            "Residual plots",
            tested,
            "Measured against predicted values, and residuals",
            plot::residuals(fit),
        ),
    ];
    let (title, alt) = ("Regions of pairs of parameters", "68 % and 95 % regions of pairs of parameters");
    let rejected = fit.shots_rejected.iter().map(|one| [one.shot.clone(), one.reason.clone()]);
    let computation = [format!("model {}", model(fit)), format!("the search stopped: {}", fit.termination)];
    let noise = Table::new(
        ["", "values", "sd of one value", "rms of the residuals"],
        fit.noise.iter().map(|one| noise(fit, one)),
    );
    let folded = [
        Section::new("How it was computed", "", [Block::Lines(computation.to_vec())]),
        super::disc_section::section(fit),
        Section::new("χ²", "", [Block::Lines(chi2(fit))]),
        Section::new("Noise", "rms: root mean square", [noise.with_numbers(1..2).into()]),
        figure(title, "", alt, plot::contours::figure(fit)),
    ];
    let folded = folded.into_iter().chain(trust::sections(fit)).chain([
        camera(fit),
        Section::of_rejected(rejected),
        Section::new("Notes", "", [Block::Lines(fit.notes().into_iter().map(str::to_owned).collect())]),
        Section::new("Shots, the largest residuals first", tested, [Block::Shots(shots)]),
    ]);
    let folded = folded.flatten().map(|section| Section { folded: true, ..section });
    Report {
        title: super::title(fit),
        verdict: fit.verdict(),
        warnings: stopped.into_iter().chain(fit.warnings().into_iter().map(str::to_owned)).collect(),
        facts: facts([
            ("source", fit.source.clone().unwrap_or_default()),
            ("cloth", fit.cloth.clone().unwrap_or_default()),
            bodies(fit),
            ("method", fit.method_name().to_owned()),
            ("shots", format!("{} used, {} not used", fit.shots_used, fit.shots_rejected.len())),
        ]),
        sections: open.into_iter().flatten().chain(folded).collect(),
    }
}

/// Returns the page that leads to the reports of the labels of a data set, each in a folder of its own.
pub(super) fn of_labels(fits: &[Fit], folders: &[String]) -> Report {
    let parameters = table::parameters(fits);
    let verdicts: Vec<Verdict> = fits.iter().map(Fit::verdict).collect();
    let row = |(fit, verdict): (&Fit, &Verdict)| {
        let cells = parameters.iter().map(|parameter| table::brief(fit, *parameter));
        let verdict = format!("{}. {}", verdict.grade.name(), verdict.sentence);
        [label(fit), fit.shots_used.to_string()].into_iter().chain(cells).chain([verdict]).collect()
    };
    let symbols = parameters.iter().map(|parameter| parameter.symbol());
    let head = ["label", "shots"].into_iter().chain(symbols).chain(["verdict"]);
    let mut estimates = Table::new(head, fits.iter().zip(&verdicts).map(row));
    estimates.links = folders.iter().map(|folder| format!("{folder}/report.html")).collect();
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
        sections: Section::new("Estimates", "± one standard error", [estimates.into()]).into_iter().collect(),
    }
}

/// Returns the camera of footage as it was fitted.
fn camera(fit: &Fit) -> Option<Section> {
    let found = fit.camera.as_ref()?;
    let rows = found.corrections.iter().map(|correction| {
        let value = with_error(correction.value, correction.std_error);
        vec![correction.which.words().to_owned(), value]
    });
    let table = Table::new(["", "found"], rows);
    let figure = Block::figure("How far positions were moved", plot::camera::figure(found));
    let about = format!("from the frames of {} shots; ± one standard error", found.shots);
    Section::new("Camera", about, [table.into(), figure])
}

/// Of intervals.
const PROFILE: &str =
    "profile: both ends from how χ² rises as the parameter moves, which need not be symmetric";

fn parameters(fit: &Fit) -> Option<Section> {
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
    let lines = fit.estimates.iter().filter_map(at_bound).chain(correlations(fit)).collect();
    let errors = if fit.refuted.is_some() { "" } else { "± one standard error" };
    Section::new("Parameters", format!("{errors}{how}"), [Table::new(head, rows).into(), Block::Lines(lines)])
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
