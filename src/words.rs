//! Text from templates: the syntax and the filters that sentences, reports and pages have in
//! common.

use minijinja::syntax::SyntaxConfig;
use minijinja::{Environment, Error, UndefinedBehavior, Value};

use crate::measurement::parameter::Parameter;
use crate::numerics::number::{count_of, plain, with_error};

/// Returns an environment that renders templates.
pub(crate) fn environment(undefined: UndefinedBehavior) -> Result<Environment<'static>, Error> {
    let mut environment = Environment::new();
    environment.set_undefined_behavior(undefined);
    let mut syntax = SyntaxConfig::builder();
    environment.set_syntax(syntax.trim_blocks(true).lstrip_blocks(true).build()?);
    environment.add_filter("symbol", |name: &str| symbol(name).to_owned());
    environment.add_filter("plain", plain);
    environment.add_filter("exact", |value: f64| value.to_string());
    environment.add_filter("with_error", with_error);
    environment.add_filter("p", p_text);
    environment.add_filter("count_of", |count: usize, what: &str| count_of(count, what));
    environment.add_filter("capital", |words: &str| capital(words));
    // a number that rounds to 0 has no sign
    environment.add_filter("fixed", |value: f64, digits: i32| {
        let unit = 10_f64.powi(digits);
        format!("{:.*}", digits as usize, (value * unit).round() / unit + 0.0)
    });
    environment.add_filter("scientific", |value: f64, digits: usize| format!("{value:.digits$e}"));
    Ok(environment)
}

/// A template that has a sentence for some values.
pub(crate) struct Sentences(Result<Environment<'static>, Error>);

impl Sentences {
    pub(crate) fn of(template: &'static str) -> Self {
        Self(environment(UndefinedBehavior::SemiStrict).and_then(|mut environment| {
            environment.add_template("", template)?;
            Ok(environment)
        }))
    }

    /// Returns the sentence for some values; empty if the template has none.
    pub(crate) fn sentence(&self, values: Value) -> String {
        // the templates are those of the program, which its tests render
        let environment = match &self.0 {
            Ok(environment) => environment,
            Err(error) => return error.to_string(),
        };
        let text = environment.get_template("").and_then(|template| template.render(values));
        text.map_or_else(|error| error.to_string(), |text| text.trim().to_owned())
    }
}

/// Returns `p = 0.013`; small probabilities are not distinguished.
fn p_text(p: f64) -> String {
    const LEAST_P: f64 = 1e-4;
    if p < LEAST_P { format!("p < {LEAST_P}") } else { format!("p = {}", plain(p, 2)) }
}

/// Returns the symbol of an unknown, by its name; without one the name.
pub(crate) fn symbol(name: &str) -> &str {
    match (name, Parameter::ALL.into_iter().find(|parameter| parameter.name() == name)) {
        ("mu_k", _) => "μ_k",
        ("mu_r", _) => "μ_r",
        (_, Some(parameter)) => parameter.symbol(),
        (_, None) => name,
    }
}

/// Returns words with a capital letter. A symbol (e, μ, μ_s) stays as it is: of words, only `a` has
/// one letter.
pub(crate) fn capital(words: &str) -> String {
    let first = words.split([' ', '_']).next().unwrap_or_default();
    if first != "a" && first.chars().count() == 1 {
        return words.to_string();
    }
    let mut letters = words.chars();
    letters.next().map_or(String::new(), |first| first.to_uppercase().chain(letters).collect())
}
