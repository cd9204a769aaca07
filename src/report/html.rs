//! report.html: one file that a lab attaches to its notebook. It needs no network and no other file; pictures of
//! shots are inside it.

use std::collections::HashMap;

use minijinja::value::Serde;
use minijinja::{AutoEscape, Environment};
use serde::Serialize;

use super::compare::{cell, lines, p_text};
use super::table::estimate;
use super::trust::sections;
use super::{ReportError, noise_estimated, number, reduced_chi2, title};
use crate::compare::Comparison;
use crate::fit::Fit;

const TEMPLATE: &str = include_str!("report.html.jinja");

/// The picture of a shot's track: its name and the SVG.
pub type ShotPicture = (String, String);

/// More pictures than these would make the file too large to open on a phone; those that matter most stay.
pub const MOST_PICTURES: usize = 60;

/// What a point on a picture is.
#[derive(Serialize)]
struct Spot {
    x: i32,
    y: i32,
    /// Of the place in this file that tells more of its shot.
    target: Option<String>,
    text: String,
}

#[derive(Serialize)]
struct Picture {
    title: String,
    svg: String,
    alt: String,
}

#[derive(Serialize)]
struct Shot {
    id: String,
    name: String,
    svg: Option<String>,
    rows: Vec<[String; 5]>,
    largest: f64,
}

#[derive(Serialize)]
struct Section {
    title: String,
    /// What stands in brackets behind the title.
    about: String,
    /// Where all lines are rows of a table, the first its head; else `lines`.
    rows: Vec<Vec<String>>,
    lines: Vec<String>,
}

impl Section {
    /// A block of the text report.
    fn new(title: &str, lines: Vec<String>) -> Self {
        let (title, about) = title.split_once(" (").unwrap_or((title, ""));
        // columns of the text stand at least two spaces apart
        let cells = |line: &String| -> Vec<String> {
            line.split("  ").map(str::trim).filter(|cell| !cell.is_empty()).map(String::from).collect()
        };
        let rows: Vec<Vec<String>> = lines.iter().map(cells).collect();
        let (title, about) = (title.to_owned(), about.trim_end_matches(')').to_owned());
        if rows.len() > 1 && rows.iter().all(|row| row.len() > 1) {
            Self { title, about, rows, lines: Vec::new() }
        } else {
            Self { title, about, rows: Vec::new(), lines }
        }
    }
}

/// The report of a fit. `residuals` and its spots are of the residual plots, `contours` of the regions.
pub fn of_fit(
    fit: &Fit,
    residuals: &str,
    spots: &[(i32, i32, usize)],
    contours: Option<&str>,
    shots: &[ShotPicture],
) -> Result<String, ReportError> {
    let listed = shot_list(fit, shots);
    let target = |name: &str| listed.iter().find(|shot| shot.name == name).map(|shot| shot.id.clone());
    let spots: Vec<Spot> = spots
        .iter()
        .filter_map(|(x, y, index)| {
            let residual = fit.residuals.get(*index)?;
            let text = format!(
                "shot {}: {}, {:+.2} standard deviations",
                residual.shot,
                residual.observable.label(),
                residual.standardized
            );
            Some(Spot { x: *x, y: *y, target: target(&residual.shot), text })
        })
        .collect();
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
        (
            "Balls",
            format!(
                "radius {} mm, mass {} g",
                number::plain(1e3 * fit.ball.radius, 5),
                number::plain(1e3 * fit.ball.mass, 4)
            ),
        ),
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
            vec![e.parameter.symbol().to_owned(), estimate(e), interval, e.parameter.meaning().to_owned()]
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
    render(&Page {
        title: title(fit),
        warnings,
        notes: fit.notes.clone(),
        facts: present(facts),
        head: ["", "estimate ± standard error", "95 % interval", "meaning"].map(str::to_owned).to_vec(),
        parameters,
        pictures,
        rejected,
        sections,
        shots: listed,
        version: env!("CARGO_PKG_VERSION"),
    })
}

/// The report of a comparison.
pub fn of_comparison(
    comparison: &Comparison,
    forest: &str,
    residuals: &str,
    spots: &[(i32, i32, usize)],
) -> Result<String, ReportError> {
    let spots: Vec<Spot> = spots
        .iter()
        .filter_map(|(x, y, index)| {
            let residual = comparison.residuals.get(*index)?;
            let text = format!(
                "{}, shot {}: {}, {:+.2} standard deviations",
                comparison.samples[residual.sample].title,
                residual.shot,
                residual.observable.label(),
                residual.standardized
            );
            Some(Spot { x: *x, y: *y, target: None, text })
        })
        .collect();
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
    let sections: Vec<Section> = comparison
        .quantities
        .iter()
        .map(|q| Section {
            title: format!("{}, {}", q.quantity.symbol(), q.quantity.meaning()),
            about: String::new(),
            rows: Vec::new(),
            lines: lines(comparison, q),
        })
        .collect();
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
        ("Shots", comparison.samples.iter().map(|s| s.shots_used).sum::<usize>().to_string()),
        ("χ²/dof", format!("{} ({} dof{noise})", number::plain(reduced, 3), comparison.dof)),
    ];
    render(&Page {
        title: format!("Comparison by {}", comparison.told_by),
        warnings: comparison.warnings.clone(),
        notes: Vec::new(),
        facts: present(facts),
        head,
        parameters,
        pictures,
        rejected,
        sections,
        shots: Vec::new(),
        version: env!("CARGO_PKG_VERSION"),
    })
}

/// What the template shows.
#[derive(Serialize)]
struct Page {
    title: String,
    warnings: Vec<String>,
    notes: Vec<String>,
    facts: Vec<(&'static str, String)>,
    head: Vec<String>,
    parameters: Vec<Vec<String>>,
    pictures: Vec<Picture>,
    rejected: Vec<[String; 2]>,
    sections: Vec<Section>,
    shots: Vec<Shot>,
    version: &'static str,
}

fn render(page: &Page) -> Result<String, ReportError> {
    let failed = |error: minijinja::Error| ReportError::Draw {
        dataset: page.title.clone(),
        reason: format!("report.html: {error}"),
    };
    let mut environment = Environment::new();
    environment.set_auto_escape_callback(|_| AutoEscape::Html);
    environment.add_template("report.html", TEMPLATE).map_err(failed)?;
    let template = environment.get_template("report.html").map_err(failed)?;
    template.render(Serde(page)).map_err(failed)
}

/// The shots whose pictures go into the report: those with the largest residuals.
#[must_use]
pub fn worth_drawing(fits: &[Fit]) -> Vec<String> {
    let of = |fit: &Fit| {
        let shots = shot_list(fit, &[]);
        shots.into_iter().take(MOST_PICTURES).map(|shot| shot.name).collect::<Vec<_>>()
    };
    fits.iter().flat_map(of).collect()
}

/// Facts that there are.
fn present<const N: usize>(facts: [(&'static str, String); N]) -> Vec<(&'static str, String)> {
    facts.into_iter().filter(|(_, text)| !text.is_empty()).collect()
}

fn model(fit: &Fit) -> String {
    let effects: Vec<String> = fit
        .effects
        .iter()
        .map(|(effect, used)| if *used { (*effect).to_owned() } else { format!("not {effect}") })
        .collect();
    format!("{} ({})", fit.fidelity, effects.join(", "))
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

/// The shots that are listed in the report, those with the largest residuals first.
fn shot_list(fit: &Fit, pictures: &[ShotPicture]) -> Vec<Shot> {
    let mut shots: Vec<Shot> = Vec::new();
    let mut known: HashMap<&str, usize> = HashMap::new();
    for residual in &fit.residuals {
        let unit_si = residual.observable.unit_si();
        let row = [
            format!("{} {}", residual.observable.label(), residual.observable.unit()),
            number::plain(residual.measured / unit_si, 5),
            number::plain(residual.predicted / unit_si, 5),
            number::plain(residual.sd / unit_si, 2),
            format!("{:+.2}", residual.standardized),
        ];
        let size = if residual.standardized.is_finite() { residual.standardized.abs() } else { 0.0 };
        if let Some(shot) = known.get(residual.shot.as_str()).and_then(|index| shots.get_mut(*index)) {
            shot.rows.push(row);
            shot.largest = shot.largest.max(size);
        } else {
            let id = format!("shot-{}", shots.len() + 1);
            known.insert(&residual.shot, shots.len());
            shots.push(Shot { id, name: residual.shot.clone(), svg: None, rows: vec![row], largest: size });
        }
    }
    shots.sort_by(|a, b| b.largest.total_cmp(&a.largest));
    shots.truncate(10 * MOST_PICTURES);
    for shot in shots.iter_mut().take(MOST_PICTURES) {
        shot.svg = pictures.iter().find(|(name, _)| *name == shot.name).map(|(_, svg)| svg.clone());
    }
    shots
}

/// A picture with a place over each point that names its shot when the pointer is there.
fn with_spots(svg: &str, spots: &[Spot]) -> String {
    let Some((picture, _)) = svg.rsplit_once("</svg>") else { return svg.to_owned() };
    let mut text = picture.to_owned();
    for Spot { x, y, target, text: words } in spots {
        let place = format!(
            "<circle class=\"spot\" cx=\"{x}\" cy=\"{y}\" r=\"8\"><title>{}</title></circle>",
            escaped(words)
        );
        match target {
            Some(id) => text.push_str(&format!("<a href=\"#{id}\">{place}</a>\n")),
            None => text.push_str(&format!("{place}\n")),
        }
    }
    text + "</svg>"
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
