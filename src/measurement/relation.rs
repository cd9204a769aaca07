//! Linear relations between the parameters of a fit, as dataset.toml writes them: `mu_s <= 3*mu`,
//! `e = 0.94`, `2*mu + mu_s/3 >= 0.2`.
//!
//! A relation is two sums and `<=`, `>=` or `=` between them; a term of a sum is a number, a parameter,
//! or a parameter times or over a number.

use super::parameter::Parameter;
use crate::physics::name::UnknownName;

/// Σ coefficient·parameter ≤ limit, or = limit.
#[derive(Clone, Debug, PartialEq)]
pub struct Relation {
    /// The relation as it was written.
    pub text: String,
    /// The coefficient of each parameter, in the order of [`Parameter::ALL`].
    pub coefficients: [f64; Parameter::ALL.len()],
    /// Whether the sum is bounded by the limit or equal to it.
    pub sense: Sense,
    /// The limit, a number without unit.
    pub limit: f64,
}

/// How the sum of a [`Relation`] is compared with its limit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sense {
    /// The sum is at most the limit.
    AtMost,
    /// The sum equals the limit.
    Equal,
}

impl Relation {
    /// Reads a relation such as `mu_s <= 3*mu`.
    ///
    /// # Errors
    /// What is wrong with the text, with what was expected.
    pub fn parse(text: &str) -> Result<Self, String> {
        let tokens = tokens(text)?;
        let comparisons: Vec<usize> =
            (0..tokens.len()).filter(|i| matches!(tokens[*i], Token::Comparison(..))).collect();
        let [at] = comparisons[..] else {
            return Err(format!(
                "{} comparison signs; expected one of <=, >= and =, as in mu_s <= 3*mu",
                comparisons.len()
            ));
        };
        let Token::Comparison(sign, sense) = tokens[at] else { return Err(String::new()) };
        let (left, right) = (sum(&tokens[..at], "left")?, sum(&tokens[at + 1..], "right")?);
        let coefficients = std::array::from_fn(|j| sign * (left.0[j] - right.0[j]));
        let limit = sign * (right.1 - left.1);
        if coefficients.iter().all(|c| *c == 0.0) {
            return Err("no parameter is left in it; expected at least one of ".to_owned() + &known());
        }
        if coefficients.iter().chain([&limit]).any(|c| !c.is_finite()) {
            return Err("a number is too large".to_owned());
        }
        Ok(Self { text: text.trim().to_owned(), coefficients, sense, limit })
    }
}

fn known() -> String {
    Parameter::ALL.map(Parameter::name).join(", ")
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Token {
    Number(f64),
    Parameter(Parameter),
    Plus,
    Minus,
    Times,
    Over,
    /// 1 for ≤ and =, −1 for ≥.
    Comparison(f64, Sense),
}

fn tokens(text: &str) -> Result<Vec<Token>, String> {
    let mut tokens = Vec::new();
    let mut rest = text.trim_start();
    while let Some(first) = rest.chars().next() {
        let signs = [
            ("<=", Token::Comparison(1.0, Sense::AtMost)),
            (">=", Token::Comparison(-1.0, Sense::AtMost)),
            ("==", Token::Comparison(1.0, Sense::Equal)),
            ("≤", Token::Comparison(1.0, Sense::AtMost)),
            ("≥", Token::Comparison(-1.0, Sense::AtMost)),
            ("<", Token::Comparison(1.0, Sense::AtMost)),
            (">", Token::Comparison(-1.0, Sense::AtMost)),
            ("=", Token::Comparison(1.0, Sense::Equal)),
            ("+", Token::Plus),
            ("-", Token::Minus),
            ("−", Token::Minus),
            ("*", Token::Times),
            ("·", Token::Times),
            ("/", Token::Over),
        ];
        let length = if let Some((sign, token)) = signs.iter().find(|(sign, _)| rest.starts_with(sign)) {
            tokens.push(*token);
            sign.len()
        } else if first.is_ascii_digit() || first == '.' {
            let length = number_length(rest);
            let number =
                rest[..length].parse().map_err(|_| format!("\"{}\" is no number", &rest[..length]))?;
            tokens.push(Token::Number(number));
            length
        } else if first.is_alphabetic() {
            let length = rest.find(|c: char| !(c.is_alphanumeric() || c == '_')).unwrap_or(rest.len());
            let word = &rest[..length];
            let parameter: Parameter = word.parse().map_err(|error: UnknownName| error.to_string())?;
            tokens.push(Token::Parameter(parameter));
            length
        } else {
            return Err(format!(
                "\"{first}\" has no meaning here; expected numbers, parameters ({}), + - * / and one of <= >= =",
                known()
            ));
        };
        rest = rest[length..].trim_start();
    }
    Ok(tokens)
}

/// Length of the number that a text begins with: digits, a point, an exponent.
fn number_length(text: &str) -> usize {
    let bytes = text.as_bytes();
    let mut length = 0;
    while let Some(byte) = bytes.get(length) {
        let sign = matches!(byte, b'+' | b'-') && length > 0 && matches!(bytes[length - 1], b'e' | b'E');
        let exponent = matches!(byte, b'e' | b'E')
            && bytes.get(length + 1).is_some_and(|b| b.is_ascii_digit() || matches!(b, b'+' | b'-'));
        if !(byte.is_ascii_digit() || *byte == b'.' || sign || exponent) {
            break;
        }
        length += 1;
    }
    length
}

/// Coefficients and constant of one side.
fn sum(tokens: &[Token], side: &str) -> Result<([f64; Parameter::ALL.len()], f64), String> {
    let (mut coefficients, mut constant) = ([0.0; Parameter::ALL.len()], 0.0);
    let mut rest = tokens;
    if rest.is_empty() {
        return Err(format!(
            "nothing stands on the {side} of the comparison; expected a parameter or a number"
        ));
    }
    let mut first = true;
    while !rest.is_empty() {
        let mut sign = 1.0;
        match rest[0] {
            Token::Plus => rest = &rest[1..],
            Token::Minus => {
                sign = -1.0;
                rest = &rest[1..];
            }
            _ if first => {}
            _ => return Err("two terms without a sign between them; expected +, -, * or /".to_owned()),
        }
        first = false;
        let (mut factor, mut parameter) = (sign, None);
        let mut divide = false;
        loop {
            match rest.first() {
                Some(Token::Number(number)) if divide && *number == 0.0 => {
                    return Err("a division by 0".to_owned());
                }
                Some(Token::Number(number)) => factor *= if divide { number.recip() } else { *number },
                Some(Token::Parameter(_)) if divide => {
                    return Err(
                        "a division by a parameter; expected a relation linear in the parameters".to_owned()
                    );
                }
                Some(Token::Parameter(_)) if parameter.is_some() => {
                    return Err(
                        "a product of parameters; expected a relation linear in the parameters".to_owned()
                    );
                }
                Some(Token::Parameter(own)) => parameter = Some(*own),
                _ => {
                    return Err(format!(
                        "a term of the {side} side ends early; expected a parameter or a number"
                    ));
                }
            }
            rest = &rest[1..];
            match rest.first() {
                Some(Token::Times) => divide = false,
                Some(Token::Over) => divide = true,
                _ => break,
            }
            rest = &rest[1..];
        }
        match parameter {
            Some(parameter) => coefficients[parameter as usize] += factor,
            None => constant += factor,
        }
    }
    Ok((coefficients, constant))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parsed(text: &str) -> (f64, f64, f64, Sense, f64) {
        let Relation { coefficients, sense, limit, .. } = Relation::parse(text).unwrap();
        let of = |parameter: Parameter| coefficients[parameter as usize];
        (of(Parameter::Mu), of(Parameter::MuS), of(Parameter::E), sense, limit)
    }

    #[test]
    fn relations_are_read() {
        assert_eq!(parsed("mu_s <= 3*mu"), (-3.0, 1.0, 0.0, Sense::AtMost, 0.0));
        assert_eq!(parsed("mu_s = 0.3"), (0.0, 1.0, 0.0, Sense::Equal, 0.3));
        assert_eq!(parsed(" 0.2 ≤ 2·mu + mu_s/4 "), (-2.0, -0.25, 0.0, Sense::AtMost, -0.2));
        assert_eq!(parsed("e >= mu + 5e-1"), (1.0, 0.0, -1.0, Sense::AtMost, -0.5));
        assert_eq!(parsed("-mu*2 + 1 == 1 - e"), (-2.0, 0.0, 1.0, Sense::Equal, 0.0));
    }

    #[test]
    fn what_is_wrong_is_said() {
        for (text, expected) in [
            ("mu_s", "0 comparison signs"),
            ("0 <= mu <= 1", "2 comparison signs"),
            ("mu_k <= 3", "\"mu_k\" is no parameter; expected one of mu, mu_s, e"),
            ("mu*mu_s <= 3", "a product of parameters"),
            ("1/mu <= 3", "a division by a parameter"),
            ("mu/0 <= 3", "a division by 0"),
            ("mu <= ", "nothing stands on the right"),
            ("mu <= 3 *", "ends early"),
            ("mu 3 <= 1", "two terms without a sign"),
            ("mu <= mu", "no parameter is left"),
            ("mu <= 0,3", "\",\" has no meaning"),
            ("mu <= 1.2.3", "\"1.2.3\" is no number"),
        ] {
            let error = Relation::parse(text).unwrap_err();
            assert!(error.contains(expected), "{text}: {error}");
        }
    }
}
