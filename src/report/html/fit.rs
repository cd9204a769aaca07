//! The report of a fit.

use super::{MOST_PICTURES, Page, Picture, Section, ShotPicture, present, render, shot_list, with_spots};
use crate::fit::{Fit, Residual};
use crate::report::compare::p_text;
use crate::report::table::estimate;
use crate::report::trust::sections;
use crate::report::{ReportError, bodies, model, noise_estimated, number, reduced_chi2, title};

/// The report of a fit. `residuals` and its spots are of the residual plots, `contours` of the regions.
pub fn of_fit(
    fit: &Fit,
    residuals: &str,
    spots: &[(i32, i32, usize)],
    contours: Option<&str>,
    shots: &[ShotPicture],
) -> Result<String, ReportError> {
    let listed = shot_list(named(fit), shots);
    let spots = super::spots(spots, &listed, |index| {
        fit.residuals.get(index).map(|residual| (residual.shot.clone(), residual))
    });
    let mut pictures = vec![Picture {
        title: "Residuals".to_owned(),
        svg: with_spots(residuals, &spots),
        alt: "Measured against predicted values, and residuals".to_owned(),
    }];
    if let Some(contours) = contours {
        pictures.push(Picture {
            title: "Regions of pairs of parameters".to_owned(),
            svg: contours.to_owned(),
            alt: "68 % and 95 % regions".to_owned(),
        });
    }
    let facts = [
        ("Data", fit.source.clone().unwrap_or_default()),
        ("Cloth", fit.cloth.clone().unwrap_or_default()),
        bodies(fit),
        ("Model", model(fit)),
        ("Method", fit.method.name().to_owned()),
        ("Shots", format!("{} used, {} not used", fit.shots_used, fit.shots_rejected.len())),
        ("χ²", chi2(fit)),
        ("Optimiser", fit.termination.clone()),
    ];
    let parameters: Vec<Vec<String>> = fit
        .estimates
        .iter()
        .map(|e| {
            let interval = e.interval_95.map_or(String::new(), |ends| number::interval(ends, e.std_error));
            vec![
                e.parameter.symbol().to_owned(),
                estimate(fit, e),
                interval,
                e.parameter.meaning().to_owned(),
            ]
        })
        .collect();
    let rejected: Vec<[String; 2]> =
        fit.shots_rejected.iter().map(|r| [r.shot.clone(), r.reason.clone()]).collect();
    let sections: Vec<Section> =
        sections(fit).into_iter().map(|(title, lines)| Section::new(&title, lines)).collect();
    let mut warnings = fit.warnings.clone();
    if !fit.converged {
        warnings.insert(0, format!("Not converged: {}", fit.termination));
    }
    let head = match fit.refuted {
        Some(_) => ["", "estimate", "", "meaning"],
        None => ["", "estimate ± standard error", "95 % interval", "meaning"],
    };
    render(&Page {
        title: title(fit),
        warnings,
        notes: fit.notes.clone(),
        facts: present(facts),
        head: head.map(str::to_owned).to_vec(),
        parameters,
        pictures,
        rejected,
        sections,
        shots: listed,
        version: env!("CARGO_PKG_VERSION"),
    })
}

/// The shots whose pictures go into the report: those with the largest residuals.
#[must_use]
pub fn worth_drawing(fits: &[Fit]) -> Vec<String> {
    let of = |fit: &Fit| {
        let shots = shot_list(named(fit), &[]);
        shots.into_iter().take(MOST_PICTURES).map(|shot| shot.name).collect::<Vec<_>>()
    };
    fits.iter().flat_map(of).collect()
}

fn named(fit: &Fit) -> impl Iterator<Item = (String, &Residual)> {
    fit.residuals.iter().map(|residual| (residual.shot.clone(), residual))
}

fn chi2(fit: &Fit) -> String {
    let Some(reduced) = reduced_chi2(fit) else { return "no degrees of freedom".to_owned() };
    let how = if noise_estimated(fit) { "; noise estimated from these residuals" } else { "" };
    let p = fit.diagnostics.goodness.as_ref().and_then(|goodness| goodness.p_value);
    let p = p.map_or(String::new(), |p| format!(", probability {}", p_text(p)));
    format!(
        "{} for {} degrees of freedom (χ²/dof = {}{how}){p}",
        number::plain(fit.chi2, 4),
        fit.dof,
        number::plain(reduced, 3)
    )
}
