//! Is the difference real? Estimates, pairs, and "same" against "different".

use statrs::distribution::{ChiSquared, ContinuousCDF};

use super::fidelity_choice;
use super::fidelity_choice::Question;
use super::global::solve_all;
use super::joint::{Solved, Weights, solve};
use super::layout::Layout;
use super::uninformed::{AllSay, Held, Says, Settled, check_room, column_of, layout, settle};
use super::verdict::{Tests, wald};
use super::{
    CompareError, Compared, Comparison, Difference, LabelResidual, LikelihoodRatio, Quantity, Robust, Sample,
    TestKind, Value,
};
use crate::fit::search::Effort;
use crate::fit::{Computed, Residual, computed};
use crate::likelihood::prediction::difference;
use crate::likelihood::whitening::covariance;
use crate::measurement::loss::Loss;
use crate::measurement::parameter::{Compliance, Parameter};

/// What shots are computed with, the joint fit, and a test of each parameter.
pub(super) const STAGES: usize = 2 + Parameter::COEFFICIENTS.len();

/// A standard error of less than this part of the value is rounding.
const PRESCRIBED: f64 = 1e-12;

/// Fits what is to be shared shared, the rest apart, and tests every parameter.
pub(super) fn run(
    labels: &[String],
    mut samples: Vec<Sample>,
    apart: [bool; 3],
    auto: bool,
    stage: &dyn Fn(&str),
) -> Result<Comparison, CompareError> {
    check_noise(&samples)?;
    stage("what each shot calls for");
    let question = Question { labels: labels.len(), apart };
    let integrated = samples.first().is_some_and(|sample| sample.model.closed().is_some());
    let fidelity = samples.first().map_or("", |sample| sample.model.fidelity.name());
    let refused = match (auto, integrated) {
        (true, _) => fidelity_choice::choose(&mut samples, question)?,
        (false, true) => fidelity_choice::integrate(&mut samples, question).map(|()| None)?,
        (false, false) => None,
    };
    let computed = count(&samples);
    stage("fitting all together");
    let settled = settle(&samples, labels.len(), apart, Weights::Unbiased)?;
    check_room(&settled, apart)?;
    let Settled { samples, says: all_say, held, layout, solved, .. } = &settled;
    let noise_estimated = solved.sds.iter().any(|sds| !sds.is_empty());
    let dof = (solved.observations + layout.priors()).saturating_sub(layout.room());
    let shots: usize = samples.iter().map(|sample| sample.fitted.len()).sum();
    let tests = match solved.shot_weights {
        // honest errors come of the scatter of the shots
        Some(_) => Tests { dof: shots.saturating_sub(layout.room()), estimated: true },
        None => Tests { dof, estimated: noise_estimated },
    };
    let mut quantities = Vec::new();
    for parameter in Parameter::COEFFICIENTS {
        stage(&format!("one {} or several", parameter.symbol()));
        let says = &all_say[parameter as usize];
        let telling: Vec<usize> = (0..labels.len()).filter(|l| says[*l] == Says::Something).collect();
        let left_out = says.iter().enumerate().filter_map(|(label, says)| match says {
            Says::Nothing(why) => Some((label, why.clone())),
            Says::Something | Says::Held => None,
        });
        let shared = !apart[parameter as usize];
        let own = (!shared).then_some(labels.len());
        let mut compared = Compared {
            quantity: Quantity::Parameter(parameter),
            shared,
            estimates: estimates(samples, layout, solved, &tests, parameter, own),
            differences: Vec::new(),
            same_or_different: None,
            left_out: left_out.collect(),
        };
        if telling.len() > 1 {
            if !shared {
                compared.differences = differences(samples, layout, solved, &tests, parameter, &telling);
            }
            let ways = Ways { samples, says: all_say, held, apart, parameter };
            compared.same_or_different = ways.same_or_different(layout, solved, &tests, &telling)?;
        }
        quantities.push(compared);
    }
    let relations = relations(&settled);
    let warnings = warnings(labels, &settled, &quantities, &relations, dof, noise_estimated);
    Ok(Comparison {
        labels: Vec::new(),
        told_by: String::new(),
        fidelity: if auto { "auto" } else { fidelity },
        computed,
        samples: Vec::new(),
        quantities,
        chi2: solved.chi2,
        dof,
        noise_estimated,
        converged: solved.converged,
        termination: solved.termination.clone(),
        residuals: residuals(samples, layout, solved),
        robust: robust(samples, solved),
        refuted: None,
        relations,
        warnings,
        notes: refused.into_iter().collect(),
    })
}

fn warnings(
    labels: &[String],
    Settled { solved, samples, .. }: &Settled,
    quantities: &[Compared],
    relations: &[(String, bool)],
    dof: usize,
    noise_estimated: bool,
) -> Vec<String> {
    let mut warnings = Vec::new();
    if !solved.converged {
        warnings.push(format!("The joint fit did not converge: {}.", solved.termination));
    }
    let gives_way = |sample: &&Sample| {
        let kappa = sample.settings[Parameter::Kappa].initial;
        sample.settings.compliance == Compliance::Stated && kappa > 0.0
    };
    if let Some(sample) = samples.iter().find(gives_way) {
        warnings.push(format!(
            "A comparison takes the contact between the balls as rigid along its surface: kappa under [fit] of {} is \
             ignored here. caromfit fit takes it.",
            sample.title
        ));
    }
    if solved.covariance.is_none() {
        warnings.push(
            "The data do not determine all of this together: there are no errors. Share more parameters, or fix some under [fit]."
                .to_string(),
        );
    }
    let reduced = solved.chi2 / dof.max(1) as f64;
    if !noise_estimated && solved.shot_weights.is_none() && dof > 0 {
        let p = ChiSquared::new(dof as f64).map_or(f64::NAN, |d| d.sf(solved.chi2));
        if p < 1e-3 {
            warnings.push(format!(
                "The residuals are larger than the stated standard deviations explain (χ²/dof = {reduced:.2}, \
                 probability {p:.1e}): what looks like a difference may be noise that is larger than stated."
            ));
        }
    }
    for compared in quantities {
        for value in compared.estimates.iter().filter(|value| value.at_bound) {
            let of = value.label.map_or(String::new(), |label| format!(" of {}", labels[label]));
            warnings.push(format!(
                "{}{of} ends on a bound, {}: its differences are those of the curvature there, which is cautious.",
                compared.quantity.symbol(),
                value.value
            ));
        }
    }
    for (text, active) in relations {
        if *active && text.contains(['<', '>', '≤', '≥']) {
            warnings.push(format!(
                "The constraint {text} holds with equality: the data pull beyond it. Errors are those \
                 without it, which is cautious."
            ));
        }
    }
    warnings
}

/// The constraints, and whether they hold with equality.
fn relations(Settled { layout, solved, .. }: &Settled) -> Vec<(String, bool)> {
    let name = |tie: &super::layout::Tie| format!("\"{}\" ({})", tie.text, tie.title);
    let equalities = layout.equalities.iter().map(|tie| (name(tie), true));
    let inequalities = layout.inequalities.iter().enumerate();
    equalities.chain(inequalities.map(|(i, tie)| (name(tie), solved.active.contains(&i)))).collect()
}

/// How many shots are computed how.
fn count(samples: &[Sample]) -> Vec<Computed> {
    let mut all: Vec<Computed> = Vec::new();
    let own = |sample: &Sample| computed(&sample.fitted, &sample.model);
    for one in samples.iter().flat_map(own) {
        match all.iter_mut().find(|c| (c.fidelity, c.effects) == (one.fidelity, one.effects)) {
            Some(known) => known.shots += one.shots,
            None => all.push(one),
        }
    }
    all
}

fn robust(samples: &[Sample], solved: &Solved) -> Option<Robust> {
    let weights = solved.shot_weights.as_ref()?;
    let mut losses: Vec<&'static str> = Vec::new();
    let mut low: Vec<(usize, String, f64)> = Vec::new();
    for (sample, weights) in samples.iter().zip(weights) {
        if sample.loss != Loss::Squares && !losses.contains(&sample.loss.name()) {
            losses.push(sample.loss.name());
        }
        let named = sample.fitted.iter().zip(weights).filter(|(_, weight)| **weight < 1.0);
        low.extend(named.map(|(shot, weight)| (sample.number, sample.names[shot.index].clone(), *weight)));
    }
    low.sort_by(|a, b| a.2.total_cmp(&b.2));
    Some(Robust { losses, weights: low })
}

fn check_noise(samples: &[Sample]) -> Result<(), CompareError> {
    let mut seen = Vec::new();
    for sample in samples {
        for row in sample.fitted.iter().flat_map(|shot| shot.plan.rows()) {
            let (key, has) = ((sample.dataset, row.observable), row.measured.sd.is_some());
            match seen.iter().find(|(known, _)| *known == key) {
                Some((_, other)) if *other != has => {
                    return Err(CompareError::MixedNoise {
                        label: sample.title.clone(),
                        column: row.observable.column(),
                    });
                }
                Some(_) => {}
                None => seen.push((key, has)),
            }
        }
    }
    Ok(())
}

/// `labels`: how many, where each has a value of its own.
fn estimates(
    samples: &[Sample],
    layout: &Layout,
    solved: &Solved,
    tests: &Tests,
    parameter: Parameter,
    labels: Option<usize>,
) -> Vec<Value> {
    let value = |column: Option<usize>, label: Option<usize>, held: f64| {
        let Some(column) = column else {
            return Value {
                label,
                value: held,
                std_error: None,
                interval_95: None,
                fitted: false,
                at_bound: false,
            };
        };
        let std_error = solved.covariance.as_ref().map(|c| c[(column, column)].sqrt());
        let value = solved.x[column];
        // an equality leaves it no room
        if std_error.is_some_and(|error| error <= PRESCRIBED * value.abs()) {
            let at_bound = false;
            return Value { label, value, std_error: None, interval_95: None, fitted: false, at_bound };
        }
        let t = tests.quantile();
        let interval_95 = std_error.map(|error| {
            let clamp = |end: f64| end.clamp(layout.lower[column], layout.upper[column]);
            [clamp(value - t * error), clamp(value + t * error)]
        });
        Value { label, value, std_error, interval_95, fitted: true, at_bound: solved.at_bound[column] }
    };
    let held = |label: usize| {
        let own = samples.iter().position(|sample| sample.label == label);
        own.map_or(f64::NAN, |i| layout.settings[i][parameter].initial)
    };
    let Some(labels) = labels else {
        let column = layout.columns.iter().find_map(|columns| columns[parameter as usize]);
        return vec![value(column, None, layout.settings[0][parameter].initial)];
    };
    (0..labels)
        .filter(|label| samples.iter().any(|sample| sample.label == *label))
        .map(|label| value(column_of(samples, layout, label, parameter), Some(label), held(label)))
        .collect()
}

fn differences(
    samples: &[Sample],
    layout: &Layout,
    solved: &Solved,
    tests: &Tests,
    parameter: Parameter,
    telling: &[usize],
) -> Vec<Difference> {
    let Some(covariance) = &solved.covariance else { return Vec::new() };
    let mut all = Vec::new();
    for (i, first) in telling.iter().enumerate() {
        for second in &telling[i + 1..] {
            let column = |label| column_of(samples, layout, label, parameter);
            let (Some(a), Some(b)) = (column(*first), column(*second)) else { continue };
            let variance = covariance[(a, a)] + covariance[(b, b)] - 2.0 * covariance[(a, b)];
            let (value, error) = (solved.x[b] - solved.x[a], variance.sqrt());
            all.push(tests.pair(*first, *second, value, error));
        }
    }
    all
}

/// One parameter, once shared and once apart.
struct Ways<'a> {
    samples: &'a [Sample],
    says: &'a AllSay,
    held: &'a Held,
    apart: [bool; 3],
    parameter: Parameter,
}

impl Ways<'_> {
    fn layout(&self, different: bool) -> Result<Layout, CompareError> {
        let mut apart = self.apart;
        apart[self.parameter as usize] = different;
        layout(self.samples, self.says, self.held, apart)
    }

    /// `None` where the constraints leave nothing to be tested.
    fn same_or_different(
        &self,
        of_fit: &Layout,
        fitted: &Solved,
        tests: &Tests,
        telling: &[usize],
    ) -> Result<Option<LikelihoodRatio>, CompareError> {
        let apart = self.apart[self.parameter as usize];
        let (own_layout, own);
        let (larger, different) = if apart {
            (of_fit, fitted)
        } else {
            own_layout = self.layout(true)?;
            own = solve_all(self.samples, &own_layout, Weights::Unbiased)?;
            (&own_layout, &own)
        };
        // two labels that must be the same contradict nothing; two that must differ leave no "same"
        let Ok(smaller) = self.layout(false) else { return Ok(None) };
        let extra = larger.room().saturating_sub(smaller.room());
        if extra == 0 {
            return Ok(None);
        }
        let dof = if apart { tests.dof } else { tests.dof.saturating_sub(extra) };
        let tests = Tests { dof, ..*tests };
        let judged = |statistic: f64, rise: f64, by: TestKind| LikelihoodRatio {
            statistic,
            by,
            extra_parameters: extra,
            p_value: tests.of_rise(rise, extra),
            delta_aic: 2.0 * extra as f64 - statistic,
        };
        if different.shot_weights.is_some() {
            let column = |label: &usize| column_of(self.samples, larger, *label, self.parameter);
            let columns: Vec<usize> = telling.iter().filter_map(column).collect();
            let covariance = different.covariance.as_ref();
            let statistic = covariance.and_then(|c| wald(&different.x, c, &columns, extra));
            return Ok(statistic.map(|statistic| judged(statistic, statistic, TestKind::Wald)));
        }
        // with the weights of the larger model, in which that of the smaller one is contained
        let same = solve_all(self.samples, &smaller, Weights::Of(different))?;
        let larger = Layout { start: different.x.clone(), ..larger.clone() };
        let of_larger = solve(self.samples, &larger, Weights::Of(different), Effort::FULL)?;
        let rise = (same.chi2 - of_larger.chi2).max(0.0);
        let n = fitted.observations as f64;
        // Gaussian noise of unknown size: n ln of the ratio of the sums of squares
        let gain = if tests.estimated { n * (1.0 + rise / of_larger.chi2).ln() } else { rise };
        Ok(Some(judged(gain, rise, TestKind::LikelihoodRatio)))
    }
}

fn residuals(samples: &[Sample], layout: &Layout, solved: &Solved) -> Vec<LabelResidual> {
    let mut all = Vec::new();
    for (number, sample) in samples.iter().enumerate() {
        let at = layout.coefficients(number, &solved.x);
        for (i, shot) in sample.fitted.iter().enumerate() {
            let predicted = solved.whitening[number].predict(i, &shot.plan, &sample.model, &at);
            let Ok(prediction) = predicted else { continue };
            let covariance = covariance(&shot.plan, &prediction, &solved.sds[number]);
            for (row, measurement) in shot.plan.rows().iter().enumerate() {
                let (observable, measured) = (measurement.observable, measurement.measured.value);
                let d = difference(observable, prediction.values[row], measured);
                let sd = covariance[(row, row)].sqrt();
                let of_shot = Residual {
                    shot: sample.names[shot.index].clone(),
                    observable,
                    measured,
                    predicted: measured + d,
                    sd,
                    standardized: -d / sd,
                    cut: shot.plan.cut(),
                    speed: shot.plan.knows_speed().then_some(prediction.speed),
                };
                all.push(LabelResidual { label: sample.label, sample: sample.number, of_shot });
            }
        }
    }
    all
}
