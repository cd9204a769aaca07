//! Numbers in stored results, to the digits that mean something. The last digits of a fit come from roundings, which
//! differ between processors (a cosine with or without fused multiply-add, say) and say nothing of the data; results that
//! are kept under version control would change with them.

use serde_json::Value;

/// Digits of a standard error, of noise and of other numbers that are themselves known to a few per cent.
pub(super) const FEW: usize = 4;

/// Digits of numbers that others are computed from.
pub(super) const MANY: usize = 8;

/// Digits of a value whose error is smaller still, as that of a fit without noise.
const MOST: usize = 12;

/// Digits of what describes a shot: its cut angle, its speed.
pub(super) const SHOT: usize = 5;

/// Digits of a standard error to which the value beside it is given: a ten-thousandth of the error.
const OF_ERROR: usize = 5;

/// The same of an end of an interval, which is found to a thousandth of the error.
const OF_END: usize = 4;

/// The same of the edge of a region, a hundredth of the error, which is more than a picture shows.
const OF_EDGE: usize = 3;

/// Decimals of what is by its nature of the order of 1: correlations, differences of −2 log L, standardized residuals, shifts in
/// standard errors.
const DECIMALS: i32 = 4;

/// Larger numbers have no decimals that a double could hold beside so many digits.
const LARGE: f64 = 1e11;

/// Smaller numbers, in SI units, are zero and rounding.
const ROUNDING: f64 = 1e-12;

/// Half-way but for this part of a number is half-way: printed measurements often are, once digits are left off.
const HALF_WAY: f64 = 1e-14;

/// Powers of ten up to this one are exact.
const EXACT: i32 = 22;

/// To a decimal place, 10^`place`; what is half-way goes away from 0.
fn at_place(value: f64, place: i32) -> f64 {
    let scale = 10_f64.powi(place.abs());
    let whole = |number: f64| (number * (1.0 + HALF_WAY)).round();
    let rounded = if place < 0 { whole(value * scale) / scale } else { whole(value / scale) * scale };
    // never −0
    rounded + 0.0
}

/// The decimal exponent of a number that is not 0.
fn exponent(value: f64) -> i32 {
    value.abs().log10().floor() as i32
}

/// To so many significant digits, however small the number.
pub(super) fn relative(value: f64, digits: usize) -> f64 {
    if value == 0.0 || !value.is_finite() {
        return value;
    }
    let place = exponent(value) - (digits as i32 - 1);
    if place.abs() <= EXACT {
        return at_place(value, place);
    }
    // the largest numbers may round to infinity
    let rounded = format!("{value:.*e}", digits - 1).parse().ok().filter(|rounded: &f64| rounded.is_finite());
    rounded.unwrap_or(value)
}

/// To so many significant digits; 0 where the number is no more than a rounding of 0.
pub(super) fn significant(value: f64, digits: usize) -> f64 {
    if value.abs() < ROUNDING { 0.0 } else { relative(value, digits) }
}

/// To four decimals.
pub(super) fn decimal(value: f64) -> f64 {
    if value.abs() < LARGE { at_place(value, -DECIMALS) } else { value }
}

/// To a ten-thousandth of its standard error, but no more than twelve digits; to eight without an error.
pub(super) fn to_error(value: f64, error: Option<f64>) -> f64 {
    to_digits_of_error(value, error, OF_ERROR)
}

/// To a thousandth of its standard error, likewise.
pub(super) fn end(value: f64, error: Option<f64>) -> f64 {
    to_digits_of_error(value, error, OF_END)
}

/// To a hundredth of its standard error, likewise.
pub(super) fn edge(value: f64, error: Option<f64>) -> f64 {
    to_digits_of_error(value, error, OF_EDGE)
}

fn to_digits_of_error(value: f64, error: Option<f64>, digits: usize) -> f64 {
    let Some(error) = error.filter(|error| error.is_finite() && *error > 0.0) else {
        return significant(value, MANY);
    };
    if value.abs() < ROUNDING || !value.is_finite() {
        return significant(value, MANY);
    }
    let place = exponent(error) - (digits as i32 - 1);
    if exponent(value) - place >= MOST as i32 || place.abs() > EXACT {
        return significant(value, MOST);
    }
    at_place(value, place)
}

/// A probability: small ones matter, too.
pub(super) fn probability(p: f64) -> f64 {
    relative(p, FEW)
}

/// All numbers of a document that are not whole, to eight digits.
pub(super) fn of_document(value: &mut Value) {
    match value {
        Value::Array(items) => items.iter_mut().for_each(of_document),
        Value::Object(entries) => entries.values_mut().for_each(of_document),
        Value::Number(number) if number.is_f64() => {
            *value = number.as_f64().map_or(Value::Null, |number| significant(number, MANY).into());
        }
        _ => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn digits_follow_the_error() {
        assert_eq!(to_error(0.059_830_911_131_6, Some(0.000_303_746)), 0.059_830_91);
        assert_eq!(to_error(-13.554_584_604, Some(1.2)), -13.5546);
        assert_eq!(to_error(0.059_830_911_131_6, None), 0.059_830_911);
        assert_eq!(to_error(0.05, Some(1.23e-13)), 0.05);
        assert_eq!(to_error(5.098_555, Some(0.694_7)), 5.098_56);
        assert_eq!(to_error(5.098_554_999_999_999, Some(0.694_7)), 5.098_56);
        assert_eq!(to_error(1.59e-15, Some(f64::NAN)), 0.0);
        assert_eq!(to_error(123_456.0, Some(3.0e5)), 123_460.0);
        assert!(to_error(f64::NAN, Some(1.0)).is_nan());
    }

    #[test]
    fn roundings_of_zero_are_zero() {
        assert_eq!(significant(1.07e-30, FEW), 0.0);
        assert_eq!(decimal(-8.5e-10).to_bits(), 0.0_f64.to_bits());
        assert_eq!(decimal(1.999_999_999_15), 2.0);
        assert_eq!(probability(3.186_144_245_9e-31), 3.186e-31);
        assert_eq!(relative(f64::MAX, FEW), f64::MAX);
        assert_eq!(relative(9.999_999_999_99e-4, FEW), 1e-3);
        assert_eq!(significant(30.000_000_000_000_04, MANY), 30.0);
    }
}
