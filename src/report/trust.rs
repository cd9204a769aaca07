//! How far a fit can be trusted, in words.

use super::content::{Block, Section, Table};
use super::number::{count_of, interval, plain};
use super::table::{quantity, with_unit};
use crate::fit::{
    Alternative, Bootstrap, Bound, Computed, DOWN_WEIGHTED, Fit, Goodness, Identifiability, Influence,
    NoiseVerdict, Normality, Robust, Trend,
};
use crate::measurement::parameter::Parameter;

/// What else was found of a fit, a section each.
pub(super) fn sections(fit: &Fit) -> Vec<Option<Section>> {
    let found = &fit.diagnostics;
    vec![
        computed(&found.computed),
        found.identifiability.as_ref().and_then(identifiability),
        found.bound.as_ref().and_then(|found| bound(fit, found)),
        found.goodness.as_ref().and_then(|goodness| residuals(fit, goodness)),
        found.goodness.as_ref().and_then(influence),
        found.robust.as_ref().and_then(robust),
        found.bootstrap.as_ref().and_then(bootstrap),
        alternatives(&found.alternatives),
    ]
}

/// What every shot was computed with; `None` where that is the same.
pub(super) fn computed(found: &[Computed]) -> Option<Section> {
    let line = |Computed { fidelity, effects, shots }: &Computed| {
        let on: Vec<_> = effects.list().into_iter().filter_map(|(name, on)| on.then_some(name)).collect();
        format!("{} at {}: {}", count_of(*shots, "shot"), fidelity.name(), on.join(", "))
    };
    let lines = if found.len() > 1 { found.iter().map(line).collect() } else { Vec::new() };
    Section::new("What each shot calls for", "", [Block::Lines(lines)])
}

fn bound(fit: &Fit, found: &Bound) -> Option<Section> {
    let line = |(parameter, least): &(Parameter, f64)| {
        let unit = parameter.unit();
        let own = fit.estimates.iter().find(|e| e.parameter == *parameter).and_then(|e| e.std_error);
        let used = own.map_or(String::new(), |error| {
            let part = 100.0 * (least / error).powi(2);
            format!("; the fit's {} used {part:.0} % of the information", quantity(error, 2, unit))
        });
        format!("{}: standard error {}{used}", parameter.symbol(), quantity(*least, 2, unit))
    };
    let about = "Cramér-Rao bound of the positions, friction of the cloth unknown; beyond 100 %: the fit used more than \
                 positions";
    let lines = found.std_errors.iter().map(line).collect();
    Section::new("What the frames could tell at best", about, [Block::Lines(lines)])
}

fn bootstrap(found: &Bootstrap) -> Option<Section> {
    let head = ["", "standard error", "bias", "95 % interval, percentile", "95 % interval, BCa"];
    let rows = found.estimates.iter().map(|one| {
        let unit = one.parameter.unit();
        vec![
            one.parameter.symbol().to_owned(),
            quantity(one.std_error, 2, unit),
            quantity(one.bias, 2, unit),
            with_unit(&interval(one.percentile, Some(one.std_error)), unit, " "),
            with_unit(&interval(one.bca, Some(one.std_error)), unit, " "),
        ]
    });
    let failed = format!("{} samples could not be fitted and are left out", found.failed);
    let failed = if found.failed > 0 { vec![failed] } else { Vec::new() };
    let table = Table::new(head, rows).with_numbers(1..3);
    let about = format!(
        "{} samples of shots drawn anew, seed {}; bias: their mean less the estimate; BCa: corrected for it",
        found.replicates, found.seed
    );
    Section::new("Bootstrap", about, [table.into(), Block::Lines(failed)])
}

fn alternatives(found: &[Alternative]) -> Option<Section> {
    let row = |model: &Alternative| {
        if let Some(reason) = &model.failed {
            return vec![model.name.to_owned(), format!("not fitted: {reason}")];
        }
        let ratio = model.likelihood_ratio.map_or(String::new(), |ratio| {
            format!("{}, by chance with probability {}", plain(ratio.statistic, 3), plain(ratio.p_value, 2))
        });
        vec![
            model.name.to_owned(),
            model.parameters.to_string(),
            format!("{:+.2}", model.delta_aic),
            format!("{:+.2}", model.delta_bic),
            ratio,
        ]
    };
    let head = ["model", "fitted", "ΔAIC", "ΔBIC", "likelihood ratio"];
    let about = "ΔAIC, ΔBIC: no unit, less than −10 speaks clearly for the model, more than 10 clearly against; fitted: \
                 parameters and noises";
    let table = Table::new(head, found.iter().map(row)).with_numbers(1..4);
    Section::new("Other models on these data", about, [table.into()])
}

fn residuals(fit: &Fit, found: &Goodness) -> Option<Section> {
    let mut lines = Vec::new();
    lines.push(match (found.noise, found.noise_factor) {
        (NoiseVerdict::Explains, Some(factor)) => format!(
            "the stated noise explains the residuals; they are {} times as large as stated (1: just so)",
            plain(factor, 3)
        ),
        (NoiseVerdict::TooSmall | NoiseVerdict::TooLarge, Some(factor)) => format!(
            "the stated noise does not explain the residuals, which are {} times as large",
            plain(factor, 3)
        ),
        _ if found.dof == 0 => "no degree of freedom is left to test the noise with".to_owned(),
        _ if fit.diagnostics.robust.is_some() => {
            "whether the stated noise explains the residuals is not tested: outlying shots count less"
                .to_owned()
        }
        _ => "whether noise explains the residuals cannot be tested: it was estimated from them".to_owned(),
    });
    let significant: Vec<&Trend> = found.trends.iter().filter(|trend| trend.significant).collect();
    if significant.is_empty() {
        lines.push(match found.trends.first() {
            Some(first) => format!(
                "no trend with speed, cut angle or spin; the surest of the {} looked for: {} with {}, by chance with \
                 probability {} (corrected for their number)",
                found.trends.len(),
                first.quantity,
                first.variable.name(),
                plain(first.p_corrected, 2)
            ),
            None => "no trend could be looked for: speed, cut angle and spin do not vary".to_owned(),
        });
    }
    lines.extend(significant.iter().map(|trend| trend.words.clone()));
    lines.push(match found.normality {
        Some(Normality { statistic, p_value }) => format!(
            "normal distribution: Anderson-Darling A² = {} (no unit), by chance as large with probability {}{}",
            plain(statistic, 3),
            plain(p_value, 2),
            if p_value < 0.01 { ": the residuals are not normal" } else { "" }
        ),
        None => "normal distribution: fewer than eight residuals do not tell".to_owned(),
    });
    Section::new("Residuals", format!("of {}", fit.tested().words()), [Block::Lines(lines)])
}

fn influence(found: &Goodness) -> Option<Section> {
    let row = |shot: &Influence| {
        let shifts: Vec<String> = (shot.shifts.iter())
            .map(|(parameter, shift)| format!("{} {shift:+.2} se", parameter.symbol()))
            .collect();
        let without = if shifts.is_empty() { "not determined".to_owned() } else { shifts.join(", ") };
        let cook = if shot.cook.is_finite() { plain(shot.cook, 2) } else { "∞".to_owned() };
        vec![shot.shot.clone(), plain(shot.leverage, 2), cook, without]
    };
    let threshold = match found.influential_from {
        Some(from) => format!(", influential from {}", plain(from, 2)),
        None => String::new(),
    };
    let about = format!(
        "leverage: its share in the fit, of as many as there are parameters; Cook's distance: how far the estimates move \
         without it{threshold}; se: standard errors"
    );
    let head = ["shot", "leverage", "Cook's distance", "without it"];
    let table = Table::new(head, found.influence.iter().map(row)).with_numbers(1..3);
    Section::new("Shots that matter most", about, [table.into()])
}

/// Shots with a small weight, most of them by name: name and weight.
pub(super) fn down_weighted(losses: &str, weights: impl Iterator<Item = (String, f64)>) -> Option<Section> {
    /// Beyond these the rest is counted.
    const LISTED: usize = 20;
    let clear: Vec<(String, f64)> = weights.filter(|(_, weight)| *weight < DOWN_WEIGHTED).collect();
    let line =
        |(shot, weight): &(String, f64)| format!("{shot}: weight {} (1: counts fully)", plain(*weight, 2));
    let mut lines: Vec<String> = clear.iter().take(LISTED).map(line).collect();
    if clear.is_empty() {
        lines.push(format!("no shot has a weight below {DOWN_WEIGHTED} (1: counts fully)"));
    } else if clear.len() > LISTED {
        lines.push(format!("and {} more", clear.len() - LISTED));
    }
    Section::new(format!("Shots that count less, {losses} loss"), "", [Block::Lines(lines)])
}

fn robust(found: &Robust) -> Option<Section> {
    let weights = found.weights.iter().map(|one| (format!("shot {}", one.shot), one.weight));
    down_weighted(found.loss.name(), weights)
}

fn identifiability(found: &Identifiability) -> Option<Section> {
    let values: Vec<String> = found.singular_values.iter().map(|value| plain(*value, 3)).collect();
    let mut lines = vec![format!(
        "singular values {} (no unit; of the Jacobian by parameters, columns scaled to 1), condition number {} (1: \
         the parameters do not interfere; above 30: hardly told apart)",
        values.join(", "),
        plain(found.condition, 3)
    )];
    lines.extend(found.worst.as_ref().map(|worst| worst.words.clone()));
    if !found.silent.is_empty() {
        let names: Vec<_> = found.silent.iter().map(|parameter| parameter.symbol()).collect();
        lines.push(format!("the data are silent on {}", names.join(", ")));
    }
    Section::new("What the data determine", "", [Block::Lines(lines)])
}
