//! A [`Fit`], or several, as text and as pages.

use minijinja::value::Serde;
use minijinja::{Value as Values, context};

use super::document::FitDocument;
use super::plot::{self, Figure};
use super::shots::{shot_list, tracks};
use super::templates;
use super::terminal::{UNKNOWN_COLUMNS, cells, estimate, parameters, rare, table, unknowns};
use super::{ReportError, chi2_words, sources, title};
use crate::fit::{Estimate, Fit, Grade, Status, Verdict};
use crate::measurement::number::{interval, plain, with_unit};
use crate::problem::Budget;
use crate::words::symbol;

/// The templates of one fit and of several.
const FIT: &str = include_str!("templates/fit.jinja");
const FITS: &str = include_str!("templates/fits.jinja");

/// Returns all that there is to say of fits as text: of one its report, of several a line each, all
/// warnings, and their error budgets.
pub fn as_text(fits: &[Fit]) -> String {
    match fits {
        [fit] => templates::text(FIT, of_fit(fit)),
        several => templates::text(FITS, of_several(several)).trim_start().to_owned(),
    }
}

/// Returns report.html of a fit.
pub fn page(fit: &Fit) -> Result<String, ReportError> {
    page_with(fit, &plot::residuals(fit), &plot::contours(fit))
}

/// Returns report.html of a fit with its figures of residuals and contours.
pub(super) fn page_with(fit: &Fit, residuals: &Figure, contours: &Figure) -> Result<String, ReportError> {
    let shots = shot_list(fit.residuals.iter().map(|residual| (residual.shot.clone(), residual)));
    let film = fit.frames.as_ref();
    let figures = context! {
        paths => film.map(|film| Values::from(Serde(plot::all_shots(&fit.dataset, film)))),
        tracks => film.and_then(|film| tracks(film, &shots)),
        discs => Serde(plot::discs(fit)),
        residuals => Serde(residuals),
        contours => Serde(contours),
    };
    templates::page(FIT, context! { figures, shots_of_page => Serde(shots), ..of_fit(fit) })
}

/// Returns the page that leads to the reports of the labels of a data set, each in a folder of its
/// own.
pub(super) fn page_of_labels(fits: &[Fit], folders: &[String]) -> Result<String, ReportError> {
    let grades = || fits.iter().map(|fit| fit.verdict().grade);
    let grade = grades().max().unwrap_or(Grade::Good);
    let count = grades().filter(|own| *own == grade).count();
    let sentence = format!("{count} of {} labels are {}.", fits.len(), grade.name());
    let links: Vec<String> = folders.iter().map(|folder| format!("{folder}/report.html")).collect();
    let title = fits.first().map_or_else(String::new, |fit| fit.dataset.clone());
    let verdict = Serde(Verdict { grade, sentence });
    templates::page(FITS, context! { title, verdict, links, ..of_several(fits) })
}

fn of_several(fits: &[Fit]) -> Values {
    let known = parameters(fits);
    let estimates = table(fits.iter().map(|fit| cells(fit, &known)).collect(), &known);
    let describe = |fit: &Fit| {
        fit.warnings().into_iter().map(|warning| format!("{}: {warning}", title(fit))).collect::<Vec<_>>()
    };
    let warnings: Vec<String> = fits.iter().flat_map(describe).collect();
    let budget: Vec<_> = fits.iter().flat_map(budget).collect();
    context! { warnings, rare => rare(&known), estimates => Serde(estimates), budget => Serde(budget) }
}

fn of_fit(fit: &Fit) -> Values {
    let is_usable = fit.verdict().grade != Grade::Unusable;
    context! {
        title => title(fit),
        is_size_stated => fit.discs.map(|discs| discs.radii.is_some()),
        warnings => Serde(fit.warnings()),
        notes => Serde(fit.notes()),
        is_filmed => fit.frames.is_some(),
        chi2 => chi2_words(fit),
        parameters => fit.estimates.iter().map(|own| parameter(fit, own)).collect::<Vec<_>>(),
        budget => budget(fit).iter().map(|row| row[1..].to_vec()).collect::<Vec<_>>(),
        unknowns => if is_usable { unknowns(fit, |_| true) } else { Vec::new() },
        unknown_columns => UNKNOWN_COLUMNS.to_vec(),
        fit => Serde(FitDocument::new(fit)),
    }
}

/// Returns a parameter with its estimate, its interval and its meaning.
fn parameter(fit: &Fit, own: &Estimate) -> Vec<String> {
    let (symbol, unit) = (own.parameter.symbol().to_owned(), own.parameter.unit());
    let ends = own.interval_95.filter(|ends| ends.iter().all(|end| end.is_finite()));
    let how = if own.is_profiled { " profile" } else { "" };
    let ends = ends.map(|ends| with_unit(&interval(ends, own.std_error), unit) + how);
    let mut value = estimate(fit, own);
    if own.status == Status::NotIdentified {
        value += &format!(", left at {}", plain(own.value, 4));
    }
    vec![symbol, with_unit(&value, unit), ends.unwrap_or_default(), own.parameter.meaning().to_owned()]
}

/// Returns the name of a fit, a parameter, its error and the parts of that, the largest first, for
/// each of μ, μ_s and e.
fn budget(fit: &Fit) -> Vec<[String; 4]> {
    let row = |budget: &Budget| {
        let parts = sources(budget).into_iter();
        let parts = parts.map(|(source, error)| format!("{source} {}", plain(error, 2)));
        let error = format!("± {}", plain(budget.std_error(), 2));
        [title(fit), symbol(budget.id.name()).to_owned(), error, parts.collect::<Vec<_>>().join(", ")]
    };
    let usable = Some(fit).filter(|fit| fit.verdict().grade != Grade::Unusable);
    usable.into_iter().flat_map(|fit| &fit.budget).map(row).collect()
}
