//! The report of a comparison.

use super::{Page, Picture, Section, ShotPicture, present, render, shot_list, with_spots};
use crate::compare::Comparison;
use crate::fit::Residual;
use crate::report::compare::{METHOD, about, cell, lines, notes, shot_name};
use crate::report::{ReportError, number};

/// The report of a comparison.
pub fn of_comparison(
    comparison: &Comparison,
    forest: &str,
    residuals: &str,
    spots: &[(i32, i32, usize)],
    shots: &[ShotPicture],
) -> Result<String, ReportError> {
    let listed = shot_list(named(comparison), shots);
    let spots = super::spots(spots, &listed, |index| {
        let residual = comparison.residuals.get(index)?;
        Some((shot_name(comparison, residual), &residual.of_shot))
    });
    let pictures = vec![
        Picture {
            title: "Estimates".to_owned(),
            svg: forest.to_owned(),
            alt: "Estimates with their intervals".to_owned(),
        },
        Picture {
            title: "Residuals".to_owned(),
            svg: with_spots(residuals, &spots),
            alt: "Residuals of all, by colour".to_owned(),
        },
    ];
    let mut head = vec![comparison.told_by.clone()];
    head.extend(comparison.quantities.iter().map(|q| q.quantity.symbol().to_owned()));
    let parameters: Vec<Vec<String>> = comparison
        .labels
        .iter()
        .enumerate()
        .map(|(label, name)| {
            let cells = comparison.quantities.iter().map(|q| cell(q, label));
            std::iter::once(name.clone()).chain(cells).collect()
        })
        .collect();
    let mut sections: Vec<Section> = comparison
        .quantities
        .iter()
        .map(|q| Section {
            title: format!("{}, {}", q.quantity.symbol(), q.quantity.meaning()),
            about: String::new(),
            rows: Vec::new(),
            lines: lines(comparison, q),
        })
        .collect();
    let about = about(comparison).into_iter();
    sections.extend(about.map(|(title, lines)| Section::new(&title, lines)));
    let rejected: Vec<[String; 2]> = comparison
        .samples
        .iter()
        .flat_map(|sample| {
            sample.shots_rejected.iter().map(|r| [format!("{}, {}", sample.title, r.shot), r.reason.clone()])
        })
        .collect();
    let reduced = comparison.chi2 / comparison.dof.max(1) as f64;
    let noise = if comparison.noise_estimated { "; noise estimated from the residuals" } else { "" };
    let facts = [
        ("Model", comparison.fidelity.to_owned()),
        ("Method", METHOD.to_owned()),
        ("Shots", comparison.samples.iter().map(|s| s.shots_used).sum::<usize>().to_string()),
        ("χ²/dof", format!("{} ({} dof{noise})", number::plain(reduced, 3), comparison.dof)),
    ];
    render(&Page {
        title: format!("Comparison by {}", comparison.told_by),
        warnings: comparison.warnings.clone(),
        notes: notes(comparison),
        facts: present(facts),
        head,
        parameters,
        pictures,
        rejected,
        sections,
        shots: listed,
        version: env!("CARGO_PKG_VERSION"),
    })
}

fn named(comparison: &Comparison) -> impl Iterator<Item = (String, &Residual)> {
    comparison.residuals.iter().map(|residual| (shot_name(comparison, residual), &residual.of_shot))
}
