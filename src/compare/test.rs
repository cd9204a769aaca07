//! Is the difference real? Estimates, pairs, and "same" against "different".

use statrs::distribution::{ChiSquared, ContinuousCDF, FisherSnedecor, Normal, StudentsT};

use super::joint::{Layout, Solved, coefficients, solve};
use super::{
    CompareError, Compared, Comparison, Difference, LabelResidual, LikelihoodRatio, Quantity, Sample, Value,
};
use crate::collision::Coefficients;
use crate::dataset::{Dataset, Measured};
use crate::parameters::Parameter;
use crate::predict::difference;
use crate::whitening::covariance;

/// What a label says about a parameter.
#[derive(Clone, PartialEq)]
enum Says {
    Something,
    Held,
    Nothing(String),
}

/// Fits what is to be shared shared, the rest apart, and tests every parameter.
pub(super) fn run(
    labels: &[String],
    samples: &[Sample],
    differs: &dyn Fn(Quantity) -> bool,
) -> Result<Comparison, CompareError> {
    check_noise(samples)?;
    let mut all_say = Parameter::COEFFICIENTS
        .map(|p| (0..labels.len()).map(|label| says_of(samples, label, p)).collect::<Vec<_>>());
    let mut held: Held =
        samples.iter().map(|s| Parameter::COEFFICIENTS.map(|p| s.settings[p].initial)).collect();
    let apart = Parameter::COEFFICIENTS.map(|p| differs(Quantity::Parameter(p)));
    let mut samples = samples.to_vec();
    // what ends on a plateau tells only that it is beyond its edge: it is left out, and the rest fitted again
    let (layout, solved) = loop {
        let layout = layout(&samples, &all_say, &held, apart);
        let solved = solve(&samples, &layout, None)?;
        let mut lost = false;
        for parameter in Parameter::COEFFICIENTS {
            for (label, says) in all_say[parameter as usize].iter_mut().enumerate() {
                let column = column_of(&samples, &layout, label, parameter);
                let Some(column) = column.filter(|c| solved.silent[*c] && *says == Says::Something) else {
                    continue;
                };
                let why = match parameter {
                    Parameter::Mu => {
                        "its contacts stick at the best fit: the data tell only that it is large"
                    }
                    _ => "nothing depends on it at the best fit",
                };
                *says = Says::Nothing(why.to_string());
                lost = true;
                for (i, _) in samples.iter().enumerate().filter(|(_, sample)| sample.label == label) {
                    held[i][parameter as usize] = solved.x[column];
                }
            }
        }
        if !lost {
            break (layout, solved);
        }
        // what is fitted to nothing of a sample any more would only pass for noise
        let tells = |sample: &Sample| {
            let of = |p: Parameter| all_say[p as usize][sample.label] == Says::Something;
            Parameter::COEFFICIENTS.into_iter().any(|p| of(p) && !sample.settings[p].fixed)
        };
        let stays: Vec<bool> = samples.iter().map(tells).collect();
        let mut each = stays.iter();
        samples.retain(|_| each.next().copied().unwrap_or(true));
        let mut each = stays.iter();
        held.retain(|_| each.next().copied().unwrap_or(true));
        if samples.is_empty() {
            return Err(CompareError::TooFew(0));
        }
    };
    let samples = samples.as_slice();
    let noise_estimated = solved.sds.iter().any(|sds| !sds.is_empty());
    let dof = (solved.observations + priors(&layout)).saturating_sub(layout.start.len());
    let tests = Tests { dof, estimated: noise_estimated };
    let mut quantities = Vec::new();
    for parameter in Parameter::COEFFICIENTS {
        let says = &all_say[parameter as usize];
        let telling: Vec<usize> = (0..labels.len()).filter(|l| says[*l] == Says::Something).collect();
        let left_out = says.iter().enumerate().filter_map(|(label, says)| match says {
            Says::Nothing(why) => Some((label, why.clone())),
            Says::Something | Says::Held => None,
        });
        let shared = !apart[parameter as usize];
        let mut compared = Compared {
            quantity: Quantity::Parameter(parameter),
            shared,
            estimates: estimates(
                samples,
                &layout,
                &solved,
                &tests,
                parameter,
                (!shared).then_some(labels.len()),
            ),
            differences: Vec::new(),
            same_or_different: None,
            left_out: left_out.collect(),
        };
        if telling.len() > 1 {
            if !shared {
                compared.differences = differences(samples, &layout, &solved, &tests, parameter, &telling);
            }
            let ways = Ways { samples, says: &all_say, held: &held, apart, parameter };
            compared.same_or_different = Some(ways.same_or_different(&solved, &tests, telling.len())?);
        }
        quantities.push(compared);
    }
    let mut warnings = Vec::new();
    if !solved.converged {
        warnings.push(format!("The joint fit did not converge: {}.", solved.termination));
    }
    if solved.covariance.is_none() {
        warnings.push(
            "The data do not determine all of this together: there are no errors. Share more parameters, or fix some under [fit]."
                .to_string(),
        );
    }
    let reduced = solved.chi2 / dof.max(1) as f64;
    if !noise_estimated && dof > 0 {
        let p = ChiSquared::new(dof as f64).map_or(f64::NAN, |d| d.sf(solved.chi2));
        if p < 1e-3 {
            warnings.push(format!(
                "The residuals are larger than the stated standard deviations explain (χ²/dof = {reduced:.2}, \
                 probability {p:.1e}): what looks like a difference may be noise that is larger than stated."
            ));
        }
    }
    for compared in &quantities {
        for value in compared.estimates.iter().filter(|value| value.at_bound) {
            let of = value.label.map_or(String::new(), |label| format!(" of {}", labels[label]));
            warnings.push(format!(
                "{}{of} ends on a bound, {}: its differences are those of the curvature there, which is cautious.",
                compared.quantity.symbol(),
                value.value
            ));
        }
    }
    Ok(Comparison {
        labels: Vec::new(),
        told_by: String::new(),
        fidelity: samples.first().map_or("", |sample| sample.model.fidelity.name()),
        samples: Vec::new(),
        quantities,
        chi2: solved.chi2,
        dof,
        noise_estimated,
        converged: solved.converged,
        termination: solved.termination.clone(),
        residuals: residuals(samples, &layout, &solved),
        warnings,
    })
}

/// What parameters that are not fitted are held at, for each sample.
type Held = Vec<[f64; Parameter::COEFFICIENTS.len()]>;

/// How sums of squares are judged.
struct Tests {
    dof: usize,
    /// The noise was estimated from the residuals.
    estimated: bool,
}

impl Tests {
    /// 97.5 % quantile.
    fn quantile(&self) -> f64 {
        match StudentsT::new(0.0, 1.0, self.dof.max(1) as f64) {
            Ok(t) if self.estimated => t.inverse_cdf(0.975),
            _ => Normal::standard().inverse_cdf(0.975),
        }
    }

    /// Two-sided probability of a difference of so many standard errors.
    fn p_value(&self, errors: f64) -> f64 {
        match StudentsT::new(0.0, 1.0, self.dof.max(1) as f64) {
            Ok(t) if self.estimated => 2.0 * t.sf(errors.abs()),
            _ => 2.0 * Normal::standard().sf(errors.abs()),
        }
    }

    /// Probability of a larger rise of χ² by `extra` parameters.
    fn of_rise(&self, rise: f64, extra: usize) -> f64 {
        let extra = extra as f64;
        if self.estimated {
            FisherSnedecor::new(extra, self.dof.max(1) as f64).map_or(f64::NAN, |f| f.sf(rise / extra))
        } else {
            ChiSquared::new(extra).map_or(f64::NAN, |d| d.sf(rise))
        }
    }
}

/// Whether a sample's observations depend on a parameter at its initial value.
fn is_informed(sample: &Sample, parameter: Parameter) -> bool {
    let [mu, mu_s, e] = Parameter::COEFFICIENTS.map(|p| sample.settings[p].initial);
    let at = Coefficients { mu, mu_s, e };
    sample.fitted.iter().any(|shot| {
        let by = shot.plan.predict(&sample.model, &at).map(|p| p.by_parameters);
        by.is_ok_and(|by| (0..shot.plan.rows().len()).any(|row| by[(row, parameter as usize)] != 0.0))
    })
}

fn says_of(samples: &[Sample], label: usize, parameter: Parameter) -> Says {
    let own: Vec<&Sample> = samples.iter().filter(|sample| sample.label == label).collect();
    if own.is_empty() {
        return Says::Nothing("it has no shot that can be used".to_string());
    }
    if own.iter().all(|sample| sample.settings[parameter].fixed) {
        return Says::Held;
    }
    if own.iter().any(|sample| !sample.settings[parameter].fixed && is_informed(sample, parameter)) {
        return Says::Something;
    }
    let why = match parameter {
        Parameter::Mu => "none of its observations depends on the friction between the balls",
        Parameter::MuS => "none of its shots has topspin, so the cloth never carries the object ball",
        _ => "none of its observations depends on the restitution",
    };
    Says::Nothing(why.to_string())
}

/// One unknown for all, or one for each label that tells it.
fn layout(samples: &[Sample], says: &[Vec<Says>; 3], held: &Held, apart: [bool; 3]) -> Layout {
    let mut layout = Layout::new(samples);
    for parameter in Parameter::COEFFICIENTS {
        for (settings, held) in layout.settings.iter_mut().zip(held) {
            settings[parameter].initial = held[parameter as usize];
        }
        let tells = |i: &usize| {
            says[parameter as usize][samples[*i].label] == Says::Something
                && !samples[*i].settings[parameter].fixed
                && is_informed(&samples[*i], parameter)
        };
        let telling: Vec<usize> = (0..samples.len()).filter(tells).collect();
        if apart[parameter as usize] {
            for label in 0..says[parameter as usize].len() {
                let own: Vec<usize> =
                    telling.iter().copied().filter(|i| samples[*i].label == label).collect();
                layout.add(parameter, &own);
            }
        } else {
            layout.add(parameter, &telling);
        }
    }
    layout
}

fn column_of(samples: &[Sample], layout: &Layout, label: usize, parameter: Parameter) -> Option<usize> {
    let mut own = samples.iter().zip(&layout.columns).filter(|(sample, _)| sample.label == label);
    own.find_map(|(_, columns)| columns[parameter as usize])
}

fn priors(layout: &Layout) -> usize {
    let of = |(settings, columns): (&crate::parameters::Settings, &super::joint::Columns)| {
        let counts = |p: &Parameter| columns[*p as usize].is_some() && settings[*p].prior.is_some();
        Parameter::COEFFICIENTS.iter().filter(|p| counts(p)).count()
    };
    layout.settings.iter().zip(&layout.columns).map(of).sum()
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
            all.push(pair(*first, *second, value, error, tests));
        }
    }
    all
}

fn pair(first: usize, second: usize, value: f64, std_error: f64, tests: &Tests) -> Difference {
    let t = tests.quantile();
    let p_value = tests.p_value(value / std_error);
    let interval_95 = [value - t * std_error, value + t * std_error];
    Difference { first, second, value, std_error, interval_95, p_value, p_holm: p_value, words: None }
}

/// One parameter, once shared and once apart.
struct Ways<'a> {
    samples: &'a [Sample],
    says: &'a [Vec<Says>; 3],
    held: &'a Held,
    apart: [bool; 3],
    parameter: Parameter,
}

impl Ways<'_> {
    fn layout(&self, different: bool) -> Layout {
        let mut apart = self.apart;
        apart[self.parameter as usize] = different;
        layout(self.samples, self.says, self.held, apart)
    }

    fn same_or_different(
        &self,
        fitted: &Solved,
        tests: &Tests,
        telling: usize,
    ) -> Result<LikelihoodRatio, CompareError> {
        let own;
        let different = if self.apart[self.parameter as usize] {
            fitted
        } else {
            own = solve(self.samples, &self.layout(true), None)?;
            &own
        };
        // with the weights of the larger model, in which that of the smaller one is contained
        let weights = (different.whitening.as_slice(), different.sds.as_slice());
        let same = solve(self.samples, &self.layout(false), Some(weights))?;
        let larger = solve(self.samples, &self.layout(true), Some(weights))?;
        let extra = telling - 1;
        let rise = (same.chi2 - larger.chi2).max(0.0);
        let dof =
            if self.apart[self.parameter as usize] { tests.dof } else { tests.dof.saturating_sub(extra) };
        let tests = Tests { dof, estimated: tests.estimated };
        let n = fitted.observations as f64;
        // Gaussian noise of unknown size: n ln of the ratio of the sums of squares
        let gain = if tests.estimated { n * (1.0 + rise / larger.chi2).ln() } else { rise };
        Ok(LikelihoodRatio {
            statistic: gain,
            extra_parameters: extra,
            p_value: tests.of_rise(rise, extra),
            delta_aic: 2.0 * extra as f64 - gain,
        })
    }
}

fn residuals(samples: &[Sample], layout: &Layout, solved: &Solved) -> Vec<LabelResidual> {
    let mut all = Vec::new();
    for (number, sample) in samples.iter().enumerate() {
        let at = coefficients(&layout.settings[number], &layout.columns[number], &solved.x);
        for (i, (shot, name)) in sample.fitted.iter().zip(&sample.names).enumerate() {
            let predicted = solved.whitening[number].predict(i, &shot.plan, &sample.model, &at);
            let Ok(prediction) = predicted else { continue };
            let covariance = covariance(&shot.plan, &prediction, &solved.sds[number]);
            for (row, measurement) in shot.plan.rows().iter().enumerate() {
                let observable = measurement.observable;
                let d = difference(observable, prediction.values[row], measurement.measured.value);
                all.push(LabelResidual {
                    label: sample.label,
                    sample: sample.number,
                    shot: name.clone(),
                    observable,
                    cut: shot.plan.cut(),
                    speed: shot.plan.knows_speed().then_some(prediction.speed),
                    standardized: -d / covariance[(row, row)].sqrt(),
                });
            }
        }
    }
    all
}

/// μ_k is found shot by shot, when the impacts are: values of data sets of one label are averaged by their
/// errors, and differences are of independent numbers.
pub(super) fn sliding(
    datasets: &[Dataset],
    labels: &[String],
    label_of: &[Option<usize>],
    apart: bool,
    comparison: &mut Comparison,
) {
    let mean = |known: Vec<Measured>| {
        let weight = |m: &Measured| m.sd.map_or(0.0, |sd| sd.powi(-2));
        let total: f64 = known.iter().map(weight).sum();
        let value = known.iter().map(|m| m.value * weight(m)).sum::<f64>() / total;
        (total > 0.0).then(|| (value, total.powf(-0.5)))
    };
    let of = |label: Option<usize>| {
        let own = datasets.iter().zip(label_of).filter(|(_, own)| label.is_none() || **own == label);
        mean(own.filter_map(|(dataset, _)| dataset.sliding).collect())
    };
    let tests = Tests { dof: 0, estimated: false };
    let t = tests.quantile();
    let value = |label, (value, error): (f64, f64)| Value {
        label,
        value,
        std_error: Some(error),
        interval_95: Some([value - t * error, value + t * error]),
        fitted: true,
        at_bound: false,
    };
    let each: Vec<Option<(f64, f64)>> = (0..labels.len()).map(|label| of(Some(label))).collect();
    if each.iter().all(Option::is_none) {
        return;
    }
    let telling: Vec<(usize, f64, f64)> =
        each.iter().enumerate().filter_map(|(label, of)| of.map(|(value, sd)| (label, value, sd))).collect();
    let mut differences = Vec::new();
    for (i, a) in telling.iter().enumerate() {
        for b in &telling[i + 1..] {
            differences.push(pair(a.0, b.0, b.1 - a.1, a.2.hypot(b.2), &tests));
        }
    }
    let same_or_different = (telling.len() > 1).then(|| {
        let (mean, _) = of(None).unwrap_or((f64::NAN, f64::NAN));
        let statistic = telling.iter().map(|(_, value, sd)| ((value - mean) / sd).powi(2)).sum();
        let extra = telling.len() - 1;
        LikelihoodRatio {
            statistic,
            extra_parameters: extra,
            p_value: tests.of_rise(statistic, extra),
            delta_aic: 2.0 * extra as f64 - statistic,
        }
    });
    let left_out = each.iter().enumerate().filter(|(_, of)| of.is_none());
    let left_out = left_out.map(|(label, _)| {
        (label, "it has no paths after the impacts that tell it: only footage does".to_string())
    });
    comparison.quantities.push(Compared {
        quantity: Quantity::Sliding,
        shared: !apart,
        estimates: if apart {
            telling.iter().map(|(label, v, sd)| value(Some(*label), (*v, *sd))).collect()
        } else {
            of(None).map(|mean| value(None, mean)).into_iter().collect()
        },
        differences: if apart { differences } else { Vec::new() },
        same_or_different,
        left_out: left_out.collect(),
    });
}

/// Holm's step-down correction over all pairs of all quantities.
pub(super) fn holm(quantities: &mut [Compared]) {
    let mut all: Vec<&mut Difference> = quantities.iter_mut().flat_map(|q| &mut q.differences).collect();
    all.sort_by(|a, b| a.p_value.total_cmp(&b.p_value));
    let count = all.len();
    let mut last = 0.0_f64;
    for (i, difference) in all.into_iter().enumerate() {
        last = last.max((difference.p_value * (count - i) as f64).min(1.0));
        difference.p_holm = last;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Four tests: 0.01·4, 0.02·3, then 0.03·2 is no less than 0.06, 0.5.
    #[test]
    fn holm_steps_down() {
        let difference =
            |p| Difference { p_value: p, ..pair(0, 1, 1.0, 1.0, &Tests { dof: 0, estimated: false }) };
        let quantity = |differences| Compared {
            quantity: Quantity::Sliding,
            shared: false,
            estimates: Vec::new(),
            differences,
            same_or_different: None,
            left_out: Vec::new(),
        };
        let mut both = [
            quantity(vec![difference(0.02), difference(0.5)]),
            quantity(vec![difference(0.01), difference(0.03)]),
        ];
        holm(&mut both);
        let p: Vec<f64> = both.iter().flat_map(|q| &q.differences).map(|d| d.p_holm).collect();
        for (p, expected) in p.iter().zip([0.06, 0.5, 0.04, 0.06]) {
            assert!((p - expected).abs() < 1e-15, "{p}");
        }
    }
}
