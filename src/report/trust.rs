//! How far a fit can be trusted, in words.

use super::number::{interval, plain};
use super::table::aligned;
use crate::fit::{
    Alternative, Bootstrap, Bound, Computed, DOWN_WEIGHTED, Fit, Goodness, Identifiability, NoiseVerdict,
    Normality, Robust, Starts, Trend,
};
use crate::parameters::Parameter;

/// Sections of the text report, each a title and its lines.
pub(super) fn sections(fit: &Fit) -> Vec<(String, Vec<String>)> {
    let found = &fit.diagnostics;
    let mut sections = Vec::new();
    if !fit.shots_doubtful.is_empty() {
        let lines = fit.shots_doubtful.iter().map(|shot| format!("shot {}: {}", shot.shot, shot.reason));
        sections.push((
            "Doubtful shots (they were used, but something about them is wrong)".to_owned(),
            lines.collect(),
        ));
    }
    if found.computed.len() > 1 {
        sections.push(computed(&found.computed));
    }
    sections.extend(found.identifiability.as_ref().map(identifiability));
    sections.extend(found.bound.as_ref().map(|found| bound(fit, found)));
    sections.extend(found.goodness.as_ref().map(|goodness| residuals(fit, goodness)));
    sections.extend(found.goodness.as_ref().filter(|g| !g.influence.is_empty()).map(influence));
    sections.extend(found.robust.as_ref().map(robust));
    if !found.relations.is_empty() {
        let state = |active: bool| if active { "holds with equality" } else { "holds, with room" };
        let lines = found.relations.iter().map(|(text, active)| format!("{text}: {}", state(*active)));
        sections.push(("Constraints between parameters".to_owned(), lines.collect()));
    }
    sections.extend(found.starts.as_ref().map(starts));
    sections.extend(found.bootstrap.as_ref().map(bootstrap));
    if !found.alternatives.is_empty() {
        sections.push(alternatives(&found.alternatives));
    }
    sections
}

pub(super) fn computed(found: &[Computed]) -> (String, Vec<String>) {
    let line = |Computed { fidelity, effects, shots }: &Computed| {
        let on: Vec<_> = effects.list().into_iter().filter_map(|(name, on)| on.then_some(name)).collect();
        format!("{shots} shot(s) at {}: {}", fidelity.name(), on.join(", "))
    };
    ("What each shot calls for".to_owned(), found.iter().map(line).collect())
}

fn bound(fit: &Fit, found: &Bound) -> (String, Vec<String>) {
    let line = |(parameter, least): &(Parameter, f64)| {
        let used = fit.estimates[*parameter as usize].std_error.map_or(String::new(), |error| {
            format!(
                "; the fit's {} used {:.0} % of the information",
                plain(error, 2),
                100.0 * (least / error).powi(2)
            )
        });
        format!("{}: standard error {} (no unit){used}", parameter.symbol(), plain(*least, 2))
    };
    let title = "What the frames could tell at best (Cramér-Rao bound of the positions, friction of the cloth unknown; \
                 beyond 100 %: the fit used more than positions)";
    (title.to_owned(), found.std_errors.iter().map(line).collect())
}

fn bootstrap(found: &Bootstrap) -> (String, Vec<String>) {
    let mut rows = vec![
        ["", "standard error", "bias", "95 % interval (percentile)", "95 % interval (BCa)"]
            .map(str::to_owned)
            .to_vec(),
    ];
    for one in &found.estimates {
        rows.push(vec![
            one.parameter.symbol().to_owned(),
            plain(one.std_error, 2),
            plain(one.bias, 2),
            interval(one.percentile, Some(one.std_error)),
            interval(one.bca, Some(one.std_error)),
        ]);
    }
    let mut lines: Vec<String> = aligned(&rows, "").lines().map(str::to_owned).collect();
    if found.failed > 0 {
        lines.push(format!("{} samples could not be fitted and are left out", found.failed));
    }
    let title = format!(
        "Bootstrap: {} samples of shots drawn anew, seed {} (no unit; bias: their mean less the estimate; BCa: \
         corrected for it)",
        found.replicates, found.seed
    );
    (title, lines)
}

fn alternatives(found: &[Alternative]) -> (String, Vec<String>) {
    let mut rows = vec![["model", "fitted", "ΔAIC", "ΔBIC", "likelihood ratio"].map(str::to_owned).to_vec()];
    for model in found {
        if let Some(reason) = &model.failed {
            rows.push(vec![model.name.to_owned(), format!("not fitted: {reason}")]);
            continue;
        }
        let ratio = model.likelihood_ratio.map_or(String::new(), |ratio| {
            format!("{}, by chance with probability {}", plain(ratio.statistic, 3), plain(ratio.p_value, 2))
        });
        let difference = |value: f64| format!("{value:+.2}");
        let (aic, bic) = (difference(model.delta_aic), difference(model.delta_bic));
        rows.push(vec![model.name.to_owned(), model.parameters.to_string(), aic, bic, ratio]);
    }
    let title = "Other models on these data (ΔAIC, ΔBIC: no unit, less than −10 speaks clearly for the model, more \
                 than 10 clearly against; fitted: parameters and noises)";
    (title.to_owned(), aligned(&rows, "").lines().map(str::to_owned).collect())
}

fn residuals(fit: &Fit, found: &Goodness) -> (String, Vec<String>) {
    let mut lines = Vec::new();
    lines.push(match (found.noise, found.noise_factor) {
        (NoiseVerdict::Explains, Some(factor)) => format!(
            "the stated noise explains the residuals; they are {} times as large as stated (1: just so)",
            plain(factor, 3)
        ),
        (NoiseVerdict::TooSmall | NoiseVerdict::TooLarge, Some(factor)) => {
            format!(
                "the stated noise does not explain the residuals, which are {} times as large",
                plain(factor, 3)
            )
        }
        _ if fit.dof == 0 => "no degree of freedom is left to test the noise with".to_owned(),
        _ => "whether noise explains the residuals cannot be tested: it was told from them".to_owned(),
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
    ("Residuals".to_owned(), lines)
}

fn influence(found: &Goodness) -> (String, Vec<String>) {
    let mut rows = vec![["shot", "leverage", "Cook's distance", "without it"].map(str::to_owned).to_vec()];
    for shot in &found.influence {
        let shifts: Vec<String> = (shot.shifts.iter())
            .map(|(parameter, shift)| format!("{} {shift:+.2} se", parameter.symbol()))
            .collect();
        let without = if shifts.is_empty() { "not determined".to_owned() } else { shifts.join(", ") };
        let cook = if shot.cook.is_finite() { plain(shot.cook, 2) } else { "∞".to_owned() };
        rows.push(vec![shot.shot.clone(), plain(shot.leverage, 2), cook, without]);
    }
    let threshold = match found.influential_from {
        Some(from) => format!(", influential from {}", plain(from, 2)),
        None => String::new(),
    };
    let title = format!(
        "Shots that matter most (leverage: its share in the fit, of as many as there are parameters; Cook's \
         distance: how far the estimates move without it{threshold}; se: standard errors)"
    );
    (title, aligned(&rows, "").lines().map(str::to_owned).collect())
}

fn robust(found: &Robust) -> (String, Vec<String>) {
    /// Beyond these the rest is counted.
    const LISTED: usize = 20;
    let clear: Vec<_> = found.weights.iter().filter(|(_, weight)| *weight < DOWN_WEIGHTED).collect();
    let mut lines: Vec<String> = clear
        .iter()
        .take(LISTED)
        .map(|(shot, weight)| format!("shot {shot}: weight {} (1: counts fully)", plain(*weight, 2)))
        .collect();
    if clear.is_empty() {
        lines.push(format!("no shot has a weight below {DOWN_WEIGHTED} (1: counts fully)"));
    } else if clear.len() > LISTED {
        lines.push(format!("and {} more", clear.len() - LISTED));
    }
    (format!("Shots that count less, {} loss", found.loss.name()), lines)
}

fn starts(found: &Starts) -> (String, Vec<String>) {
    let mut lines: Vec<String> = (found.minima.iter())
        .map(|minimum| {
            let values: Vec<String> = (minimum.values.iter())
                .map(|(parameter, value)| format!("{} = {}", parameter.symbol(), plain(*value, 5)))
                .collect();
            format!(
                "{} starts: {}; −2 log likelihood {} above the best",
                minimum.starts,
                values.join(", "),
                plain(minimum.above_best, 3)
            )
        })
        .collect();
    if found.failed > 0 {
        lines.push(format!("{} starts ended in no minimum", found.failed));
    }
    let agree = if found.agree() { "all agree" } else { "they do not agree" };
    (format!("{} starts, seed {}: {agree}", found.count, found.seed), lines)
}

fn identifiability(found: &Identifiability) -> (String, Vec<String>) {
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
    ("What the data determine".to_owned(), lines)
}
