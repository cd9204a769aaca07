//! The conclusions of a design in sentences.

use super::information::{played, std_errors};
use super::{Cell, Design, Expected, PlayedKind};
use crate::measurement::parameter::Parameter;
use crate::physics::collision::Regime;

/// Cut angles are as good as the best that take at most this many times the shots.
const AS_GOOD: f64 = 2.0;

/// Number of shots of each kind that are compared.
const COMPARED: f64 = 40.0;

pub(super) fn of(design: &Design) -> Vec<String> {
    let mut lines = Vec::new();
    for parameter in Parameter::COEFFICIENTS {
        let told: Vec<Told> = design.cells.iter().filter_map(|cell| Told::of(cell, parameter)).collect();
        match best_of(&told) {
            Some(best) => {
                lines.push(best_shots(design, parameter, best, &told));
                lines.extend(other_kinds(design, parameter, best, &told));
            }
            None => lines.push(format!(
                "{} ({}) is told by none of these shots at one cut angle and speed.",
                parameter.symbol(),
                parameter.meaning()
            )),
        }
        lines.extend(silence(design, parameter, &told));
    }
    lines.extend(all_wanted(design));
    lines.extend(ratios(design));
    lines
}

/// Returns what the shots determine of the balls, beside what is stated of them.
fn ratios(design: &Design) -> Option<String> {
    let percent = |error: f64| number(100.0 * error, 2);
    let mut parts = Vec::new();
    let both = design.expected.ratio_sds().into_iter().zip(design.planned.ratios);
    for (ratio, (stated, found)) in [Parameter::MassRatio, Parameter::RadiusRatio].iter().zip(both) {
        parts.extend(found.map(|found| {
            let (symbol, stated, found) = (ratio.symbol(), percent(stated), percent(found));
            format!("{symbol}, known to ± {stated} % beforehand, comes out to ± {found} %")
        }));
    }
    let list = parts.join(", ");
    let text =
        format!("The balls are fitted, too: from all planned shots {list}; the errors above include theirs.");
    (!parts.is_empty()).then_some(text)
}

/// A cell that determines a parameter, with the standard error that [`COMPARED`] shots give.
#[derive(Clone, Copy)]
struct Told<'a> {
    cell: &'a Cell,
    error: f64,
}

impl<'a> Told<'a> {
    fn of(cell: &'a Cell, parameter: Parameter) -> Option<Self> {
        let error = std_errors(&(cell.information * COMPARED))[parameter as usize]?;
        Some(Self { cell, error })
    }

    /// Returns how many times the shots of another it takes.
    fn times(&self, other: &Told) -> f64 {
        (self.error / other.error).powi(2)
    }
}

/// Returns the cell with the smallest error.
fn best_of<'a>(told: &[Told<'a>]) -> Option<Told<'a>> {
    told.iter().copied().min_by(|a, b| a.error.total_cmp(&b.error))
}

/// Returns `30° and 4 m/s`.
fn place(cell: &Cell) -> String {
    format!("{}° and {} m/s", number(cell.cut_deg, 1), number(cell.speed_m_s, 2))
}

/// Returns `3`, `1.4`, `120`.
fn times(ratio: f64) -> String {
    match ratio {
        ..9.5 => number(ratio, 1),
        ..1e4 => format!("{ratio:.0}"),
        _ => "more than 10 000".to_owned(),
    }
}

/// Returns a number with so many decimals, more if it is small, without trailing zeros.
fn number(value: f64, decimals: usize) -> String {
    let needed = if value == 0.0 { 0.0 } else { (-value.abs().log10()).ceil().clamp(0.0, 12.0) };
    let text = format!("{value:.*}", decimals.max(needed as usize));
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

fn best_shots(design: &Design, parameter: Parameter, best: Told, told: &[Told]) -> String {
    let Cell { kind, speed_m_s, cut_deg, .. } = *best.cell;
    // two digits
    let decimals = (1.0 - best.error.log10().floor()).clamp(0.0, 12.0) as usize;
    let mut line = format!(
        "{} ({}) is told best by \"{}\" at a cut of {}: {COMPARED} such shots give ± {:.decimals$}.",
        parameter.symbol(),
        parameter.meaning(),
        design.expected.kinds[kind].name,
        place(best.cell),
        best.error
    );
    let own = || told.iter().filter(|t| t.cell.kind == kind);
    let row: Vec<&Told> = own().filter(|t| t.cell.speed_m_s == speed_m_s).collect();
    if let Some(at) = row.iter().position(|t| t.cell.cut_deg == cut_deg) {
        let is_good = |t: &&&Told| t.times(&best) <= AS_GOOD;
        let above = row[at..].iter().take_while(is_good).last().map_or(cut_deg, |t| t.cell.cut_deg);
        let below = row[..=at].iter().rev().take_while(is_good).last().map_or(cut_deg, |t| t.cell.cut_deg);
        if below < above {
            line += &format!(
                " From {}° to {}° it takes at most {} times as many.",
                number(below, 1),
                number(above, 1),
                times(AS_GOOD)
            );
        }
    }
    let at_cut = own().filter(|t| t.cell.cut_deg == cut_deg);
    let worst = at_cut.max_by(|a, b| a.error.total_cmp(&b.error));
    if let Some(worst) = worst.filter(|worst| worst.times(&best) > AS_GOOD) {
        let (speed, times) = (number(worst.cell.speed_m_s, 2), times(worst.times(&best)));
        line += &format!(" At {speed} m/s it takes {times} times as many.");
    }
    line
}

/// Returns the other kinds at their best, with how many times the shots they take.
fn other_kinds(design: &Design, parameter: Parameter, best: Told, told: &[Told]) -> Option<String> {
    let of_kind = |kind: usize| {
        let own: Vec<Told> = told.iter().copied().filter(|t| t.cell.kind == kind).collect();
        best_of(&own).filter(|_| kind != best.cell.kind)
    };
    let mut others: Vec<Told> = (0..design.expected.kinds.len()).filter_map(of_kind).collect();
    others.sort_by(|a, b| a.error.total_cmp(&b.error));
    let one = |t: &Told| {
        let name = &design.expected.kinds[t.cell.kind].name;
        format!("\"{name}\" {} (at {})", times(t.times(&best)), place(t.cell))
    };
    let each = others.iter().map(one).collect::<Vec<_>>().join(", ");
    let symbol = parameter.symbol();
    (!each.is_empty()).then(|| format!("  For the same {symbol}, times as many shots at their best: {each}."))
}

/// Returns which shots by themselves do not determine a parameter, and why if that is known.
fn silence(design: &Design, parameter: Parameter, told: &[Told]) -> Option<String> {
    let expected = &design.expected;
    let mut parts: Vec<String> = Vec::new();
    for (index, kind) in expected.kinds.iter().enumerate() {
        let is_told = |cell: &Cell| told.iter().any(|t| std::ptr::eq(t.cell, cell));
        let own = || design.cells.iter().filter(|cell| cell.kind == index);
        let silent: Vec<&Cell> = own().filter(|cell| !is_told(cell)).collect();
        if silent.is_empty() {
            continue;
        }
        let mut cuts: Vec<f64> = silent.iter().map(|cell| cell.cut_deg).collect();
        cuts.sort_by(f64::total_cmp);
        cuts.dedup();
        let all = silent.len() == own().count();
        let which = match cuts[..] {
            _ if all => String::new(),
            [one] => format!(" at {}°", number(one, 1)),
            [first, .., last] => format!(" at {}° to {}°", number(first, 1), number(last, 1)),
            [] => continue,
        };
        let why = if parameter == Parameter::MuS && kind.topspin[1] <= 0.0 {
            " (without topspin nothing presses the object ball into the cloth)"
        } else if parameter == Parameter::Mu && silent.iter().all(|cell| sticks(expected, kind, cell)) {
            " (the balls stick together before they part)"
        } else {
            ""
        };
        let name = format!("\"{}\"{which}", kind.name);
        // a reason that several share is given once, behind the last
        match parts.last_mut().filter(|last| !why.is_empty() && last.ends_with(why)) {
            Some(last) => {
                last.truncate(last.len() - why.len());
                *last += &format!(", {name}{why}");
            }
            None => parts.push(format!("{name}{why}")),
        }
    }
    (!parts.is_empty())
        .then(|| format!("  By themselves say nothing of {}: {}.", parameter.symbol(), parts.join(", ")))
}

/// Returns whether the slip between the balls ends before they part.
fn sticks(expected: &Expected, kind: &PlayedKind, cell: &Cell) -> bool {
    let topspin = 0.5 * (kind.topspin[0] + kind.topspin[1]);
    let (cue, model) = played(expected, kind, [cell.speed_m_s, cell.cut_deg, topspin]);
    let outcome = model.collide(&cue, &expected.coefficients);
    outcome.is_ok_and(|outcome| outcome.regime == Regime::Stick)
}

/// Returns the best mixture, and the best single kind beside it.
fn all_wanted(design: &Design) -> Option<String> {
    let mixture = design.mixtures.iter().find(|m| m.parameter.is_none() && !m.of_cells)?;
    let name = |kind: usize| design.expected.kinds[kind].name.as_str();
    let of: Vec<String> =
        mixture.shots.iter().map(|(kind, shots)| format!("{shots} of \"{}\"", name(*kind))).collect();
    let untold = design.expected.wanted.iter().zip(&design.planned.std_errors);
    let untold = untold.filter(|(wanted, error)| wanted.is_some() && error.is_none()).count();
    let what = if untold == 0 { "All that is wanted" } else { "What they tell of what is wanted" };
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
