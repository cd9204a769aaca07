//! Numbers as people read them, in sentences and tables.

/// Beyond these decimals a column of a table gets too wide; only noise-free data come here.
const MOST_DECIMALS: usize = 9;

/// Returns the number to at most some significant digits, without trailing zeros: `0.3`, `0.0514`,
/// `12.3`, `1.2e-9`.
pub(crate) fn plain(value: f64, digits: usize) -> String {
    // never −0
    let value = value + 0.0;
    let text = format!("{value:.*e}", digits - 1);
    let Some((mantissa, _)) = text.split_once('e') else { return "–".to_owned() };
    match exponent(value, digits) {
        exponent @ -5..=6 => {
            let decimals = usize::try_from(digits as i32 - 1 - exponent).unwrap_or(0);
            trimmed(&format!("{value:.decimals$}")).to_owned()
        }
        exponent => format!("{}e{exponent}", trimmed(mantissa)),
    }
}

/// `0.1014 ± 0.0027`: the error to two significant digits, the value to the same decimals; the
/// value alone without an error.
pub(crate) fn with_error(value: f64, error: f64) -> String {
    if !(error > 0.0 && error.is_finite()) {
        return plain(value, 4);
    }
    let decimals = decimals_of(error);
    if 1 - exponent(error, 2) > MOST_DECIMALS as i32 {
        return format!("{value:.decimals$} ± {error:.1e}");
    }
    format!("{value:.decimals$} ± {error:.decimals$}")
}

/// `0.942 [0.867, 0.975]`: a value with the interval that it lies in.
#[cfg(feature = "report")]
pub(crate) fn with_interval(value: f64, [low, high]: [f64; 2]) -> String {
    // some four standard errors
    let error = 0.25 * (high - low);
    format!("{value:.*} {}", decimals_of(error), interval([low, high], Some(error)))
}

/// `0.3 m/s`, `2°`.
pub(crate) fn with_unit(text: &str, unit: &str) -> String {
    let space = if unit.is_empty() || unit == "°" { "" } else { " " };
    format!("{text}{space}{unit}")
}

/// `1 shot`, `2 shots`.
pub(crate) fn count_of(count: usize, noun: &str) -> String {
    let plural = if count == 1 { "" } else { "s" };
    format!("{count} {noun}{plural}")
}

/// `[0.0489, 0.0517]`, to the decimals of the standard error if there is one.
#[cfg(feature = "report")]
pub(crate) fn interval([low, high]: [f64; 2], error: Option<f64>) -> String {
    match error.map(decimals_of) {
        Some(decimals) => format!("[{low:.decimals$}, {high:.decimals$}]"),
        None => format!("[{}, {}]", plain(low, 3), plain(high, 3)),
    }
}

/// Decimals that show two significant digits of an error, as far as a table has room.
fn decimals_of(error: f64) -> usize {
    if error == 0.0 || !error.is_finite() {
        return 4;
    }
    usize::try_from(1 - exponent(error, 2)).unwrap_or(0).min(MOST_DECIMALS)
}

/// The decimal exponent of a number once it is rounded to some significant digits: 0.0996 has −2,
/// but −1 to two digits.
fn exponent(value: f64, digits: usize) -> i32 {
    let text = format!("{value:.*e}", digits - 1);
    text.split_once('e').and_then(|(_, exponent)| exponent.parse().ok()).unwrap_or(0)
}

fn trimmed(number: &str) -> &str {
    if number.contains('.') { number.trim_end_matches('0').trim_end_matches('.') } else { number }
}
