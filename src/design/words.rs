//! The conclusions of a design in sentences.

use super::information::{cue_before, std_errors};
use super::{Cell, Design};
use crate::measurement::number::plain;
use crate::measurement::parameter::Parameter;
use crate::physics::collision::Regime;

/// Cut angles are as good as the best that take at most this many times the shots.
const AS_GOOD: f64 = 2.0;

/// Number of shots of each kind that are compared.
const COMPARED: f64 = 40.0;

pub(super) fn of(design: &Design) -> Vec<String> {
    let mut lines = Vec::new();
    for parameter in Parameter::COEFFICIENTS {
        lines.extend(best_shots(design, parameter));
        lines.extend(silent_shots(design, parameter));
    }
    lines.extend(all_wanted(design));
    lines.extend(ratios(design));
    lines
}

/// Returns the variance of a parameter that [`COMPARED`] shots of a cell give, if they determine
/// it.
fn variance(cell: &Cell, parameter: Parameter) -> Option<f64> {
    std_errors(&(cell.information * COMPARED))[parameter as usize].map(|error| error * error)
}

/// Returns the best cell for a parameter, how far its cut angle may be off, and the other kinds at
/// their best.
fn best_shots(design: &Design, parameter: Parameter) -> Vec<String> {
    let (symbol, meaning) = (parameter.symbol(), parameter.meaning());
    let with_variance = |cell| variance(cell, parameter).map(|variance| (cell, variance));
    let mut cells: Vec<(&Cell, f64)> = design.cells.iter().filter_map(with_variance).collect();
    cells.sort_by(|a, b| a.1.total_cmp(&b.1));
    let Some(&(best, least)) = cells.first() else {
        return vec![format!(
            "{symbol} ({meaning}) is told by none of these shots at one cut angle and speed."
        )];
    };
    let name = |kind: usize| &design.expected.kinds[kind].name;
    let place = |cell: &Cell| format!("{}° and {} m/s", plain(cell.cut_deg, 3), plain(cell.speed_m_s, 3));
    let mut line = format!(
        "{symbol} ({meaning}) is told best by \"{}\" at a cut of {}: {COMPARED} such shots give ± {}.",
        name(best.kind),
        place(best),
        plain(least.sqrt(), 2)
    );
    // the cuts around the best that are as good
    let row = || design.cells.iter().filter(|c| c.kind == best.kind && c.speed_m_s == best.speed_m_s);
    let is_poor = |c: &&Cell| variance(c, parameter).is_none_or(|variance| variance > AS_GOOD * least);
    let poor: Vec<f64> = row().filter(is_poor).map(|cell| cell.cut_deg).collect();
    let is_near = |cut: f64| {
        let [low, high] = [cut.min(best.cut_deg), cut.max(best.cut_deg)];
        !poor.iter().any(|poor| (low..=high).contains(poor))
    };
    let near: Vec<f64> = row().map(|cell| cell.cut_deg).filter(|cut| is_near(*cut)).collect();
    if let [from, .., to] = near[..] {
        let (from, to) = (plain(from, 3), plain(to, 3));
        line += &format!(" From {from}° to {to}° it takes at most {AS_GOOD} times as many.");
    }
    let mut kinds = vec![best.kind];
    let mut others = Vec::new();
    for (cell, variance) in cells {
        if !kinds.contains(&cell.kind) {
            kinds.push(cell.kind);
            others.push(format!(
                "\"{}\" {} (at {})",
                name(cell.kind),
                plain(variance / least, 2),
                place(cell)
            ));
        }
    }
    let others = others.join(", ");
    let of_others = format!("  For the same {symbol}, times as many shots at their best: {others}.");
    [line].into_iter().chain((!others.is_empty()).then_some(of_others)).collect()
}

/// Returns which shots by themselves do not determine a parameter, and why if that is known.
fn silent_shots(design: &Design, parameter: Parameter) -> Option<String> {
    let expected = &design.expected;
    // a reason that several kinds share is given once, behind the last
    let mut parts: Vec<(String, &str)> = Vec::new();
    for (index, kind) in expected.kinds.iter().enumerate() {
        let own: Vec<&Cell> = design.cells.iter().filter(|cell| cell.kind == index).collect();
        let is_silent = |cell: &&Cell| variance(cell, parameter).is_none();
        let silent: Vec<&Cell> = own.iter().copied().filter(is_silent).collect();
        let cuts = || silent.iter().map(|cell| cell.cut_deg);
        let (least, most) = (cuts().fold(90.0, f64::min), cuts().fold(-90.0, f64::max));
        let at = match (own.len() - silent.len(), least == most) {
            (0, _) => String::new(),
            (_, true) => format!(" at {}°", plain(least, 3)),
            (_, false) => format!(" at {}° to {}°", plain(least, 3), plain(most, 3)),
        };
        let sticks = |cell: &&Cell| {
            let topspin = 0.5 * (kind.topspin[0] + kind.topspin[1]);
            let cue = cue_before(expected, kind, [cell.speed_m_s, cell.cut_deg, topspin]);
            let outcome = expected.model().collide(&cue, &expected.coefficients);
            outcome.is_ok_and(|outcome| outcome.regime == Regime::Stick)
        };
        let why = match parameter {
            Parameter::MuS if kind.topspin[1] <= 0.0 => {
                " (without topspin nothing presses the object ball into the cloth)"
            }
            Parameter::Mu if silent.iter().all(sticks) => " (the balls stick together before they part)",
            _ => "",
        };
        let name = format!("\"{}\"{at}", kind.name);
        match parts.last_mut() {
            _ if silent.is_empty() => {}
            Some((names, last)) if *last == why => *names += &format!(", {name}"),
            _ => parts.push((name, why)),
        }
    }
    let symbol = parameter.symbol();
    let list = parts.into_iter().map(|(names, why)| names + why).collect::<Vec<_>>().join(", ");
    (!list.is_empty()).then(|| format!("  By themselves say nothing of {symbol}: {list}."))
}

/// Returns the best mixture, and the best single kind beside it.
fn all_wanted(design: &Design) -> Option<String> {
    let mixture = design.mixtures.iter().find(|m| m.parameter.is_none())?;
    let name = |kind: usize| design.expected.kinds[kind].name.as_str();
    let of: Vec<String> =
        mixture.shots.iter().map(|(kind, shots)| format!("{shots} of \"{}\"", name(*kind))).collect();
    let mut wanted = design.expected.wanted.iter().zip(&design.planned.std_errors);
    let is_untold = wanted.any(|(wanted, error)| wanted.is_some() && error.is_none());
    let what = if is_untold { "What they tell of what is wanted" } else { "All that is wanted" };
    let mut line = format!("{what} takes {} shots at the least: {}.", mixture.total(), of.join(", "));
    let single = design.kinds.iter().enumerate().filter_map(|(i, kind)| Some((kind.needed_all?, i)));
    match single.min() {
        Some((shots, kind)) if shots > mixture.total() => {
            line += &format!(" With one kind alone: {shots} of \"{}\".", name(kind));
        }
        None => line += " No kind alone tells all of it.",
        Some(_) => {}
    }
    Some(line)
}

/// Returns what the shots determine of the balls, beside what is stated of them.
fn ratios(design: &Design) -> Option<String> {
    let ratios = [Parameter::MassRatio, Parameter::RadiusRatio].into_iter();
    let errors = design.expected.ratio_sds().into_iter().zip(design.planned.ratios);
    let in_words = |(ratio, (stated, found)): (Parameter, (f64, Option<f64>))| {
        let [stated, found] = [stated, found?].map(|error| plain(100.0 * error, 2));
        Some(format!("{}, known to ± {stated} % beforehand, comes out to ± {found} %", ratio.symbol()))
    };
    let parts: Vec<String> = ratios.zip(errors).filter_map(in_words).collect();
    let list = parts.join(", ");
    let text =
        format!("The balls are fitted, too: from all planned shots {list}; the errors above include theirs.");
    (!parts.is_empty()).then_some(text)
}
