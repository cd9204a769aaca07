//! report.html: one file that a lab attaches to its notebook. It needs no network and no other file; pictures of
//! shots are inside it.

use minijinja::value::Serde;
use minijinja::{AutoEscape, Environment, context};

use super::ReportError;
use super::content::Report;

const TEMPLATE: &str = include_str!("report.html.jinja");
const SCRIPT: &str = include_str!("report.js");

/// The whole report.
///
/// # Errors
/// The template engine gave up.
pub fn render(report: &Report) -> Result<String, ReportError> {
    let failed = |error: minijinja::Error| ReportError::Draw {
        dataset: report.title.clone(),
        reason: format!("report.html: {error}"),
    };
    let mut environment = Environment::new();
    environment.set_auto_escape_callback(|_| AutoEscape::Html);
    environment.add_template("report.html", TEMPLATE).map_err(failed)?;
    let template = environment.get_template("report.html").map_err(failed)?;
    let version = env!("CARGO_PKG_VERSION");
    template.render(context! { report => Serde(report), version, script => SCRIPT }).map_err(failed)
}
