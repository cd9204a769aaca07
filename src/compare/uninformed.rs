//! What each label says about each parameter, and the joint fit of what is told.

use super::global::solve_all;
use super::joint::{Solved, Weights};
use super::layout::Layout;
use super::{CompareError, Quantity, Sample};
use crate::measurement::parameter::Parameter;
use crate::measurement::relation::Sense;
use crate::measurement::values::Values;
use crate::physics::collision::Coefficients;

/// What a label says about a parameter.
#[derive(Clone, PartialEq)]
pub(super) enum Says {
    Something,
    Held,
    Nothing(String),
}

/// Of each parameter, what each label says.
pub(super) type AllSay = [Vec<Says>; Parameter::COEFFICIENTS.len()];

/// What parameters that are not fitted are held at, for each sample.
pub(super) type Held = Vec<[f64; Parameter::COEFFICIENTS.len()]>;

/// A joint fit in which everything that is free is told.
pub(super) struct Settled {
    /// Those that tell something.
    pub samples: Vec<Sample>,
    pub says: AllSay,
    pub held: Held,
    pub layout: Layout,
    pub solved: Solved,
    /// Where each of the samples ended, those included that tell nothing in the end.
    pub coefficients: Vec<Coefficients>,
}

/// Fits all that the samples tell: parameters that are `apart` have a value for each label. What ends on a plateau tells
/// only that it is beyond its edge: it is left out, and the rest fitted again.
pub(super) fn settle(
    all: &[Sample],
    labels: usize,
    apart: [bool; 3],
    weights: Weights,
) -> Result<Settled, CompareError> {
    // the search starts from usual values; what is not told stays at its initial value
    let start = |sample: &Sample| {
        let usual = Values::usual(&sample.settings);
        Parameter::COEFFICIENTS
            .map(|p| if is_informed(sample, p) { usual[p] } else { sample.settings[p].initial })
    };
    let mut ends: Held = all.iter().map(start).collect();
    let mut held = ends.clone();
    let mut says =
        Parameter::COEFFICIENTS.map(|p| (0..labels).map(|label| says_of(all, label, p)).collect::<Vec<_>>());
    // places among all
    let mut places: Vec<usize> = (0..all.len()).collect();
    let mut samples = all.to_vec();
    loop {
        let layout = layout(&samples, &says, &held, apart)?;
        let solved = solve_all(&samples, &layout, weights)?;
        for (i, place) in places.iter().enumerate() {
            let Coefficients { mu, mu_s, e } = layout.coefficients(i, &solved.x);
            ends[*place] = [mu, mu_s, e];
        }
        let mut lost = false;
        for parameter in Parameter::COEFFICIENTS {
            for (label, says) in says[parameter as usize].iter_mut().enumerate() {
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
            // tests of one value for all start from here
            for ((held, place), columns) in held.iter_mut().zip(&places).zip(&layout.columns) {
                for parameter in
                    Parameter::COEFFICIENTS.into_iter().filter(|p| columns[*p as usize].is_some())
                {
                    held[parameter as usize] = ends[*place][parameter as usize];
                }
            }
            let coefficients = ends.into_iter().map(|[mu, mu_s, e]| Coefficients { mu, mu_s, e }).collect();
            return Ok(Settled { samples, says, held, layout, solved, coefficients });
        }
        // what is fitted to nothing of a sample any more would only pass for noise
        let tells = |sample: &Sample| {
            let of = |p: Parameter| says[p as usize][sample.label] == Says::Something;
            Parameter::COEFFICIENTS.into_iter().any(|p| of(p) && !sample.settings[p].fixed)
        };
        let stays: Vec<bool> = samples.iter().map(tells).collect();
        keep(&mut samples, &stays);
        keep(&mut held, &stays);
        keep(&mut places, &stays);
        if samples.is_empty() {
            return Err(CompareError::TooFew(0));
        }
    }
}

fn keep<T>(all: &mut Vec<T>, stays: &[bool]) {
    let mut each = stays.iter();
    all.retain(|_| each.next().copied().unwrap_or(true));
}

/// Whether a sample's observations depend on a parameter, whatever the friction, or an equality ties it.
fn is_informed(sample: &Sample, parameter: Parameter) -> bool {
    let ties = |r: &crate::measurement::relation::Relation| {
        r.sense == Sense::Equal && r.coefficients[parameter as usize] != 0.0
    };
    if sample.relations.iter().any(ties) {
        return true;
    }
    Values::usual(&sample.settings).across_friction(&sample.settings).iter().any(|at| {
        sample.fitted.iter().any(|shot| {
            let prediction = shot.plan.predict(&sample.model, &at.coefficients);
            prediction.is_ok_and(|prediction| shot.plan.depends(&prediction)[parameter as usize])
        })
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
///
/// # Errors
/// Constraints that contradict each other, or leave a parameter that is to be compared no room to differ.
pub(super) fn layout(
    samples: &[Sample],
    says: &AllSay,
    held: &Held,
    apart: [bool; 3],
) -> Result<Layout, CompareError> {
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
    layout.relate(samples)?;
    Ok(layout)
}

/// Nothing could be found out about a difference that the constraints prescribe.
pub(super) fn check_room(settled: &Settled, apart: [bool; 3]) -> Result<(), CompareError> {
    let Settled { samples, says, layout, .. } = settled;
    for parameter in Parameter::COEFFICIENTS.into_iter().filter(|p| apart[*p as usize]) {
        let columns: Vec<usize> = (0..says[parameter as usize].len())
            .filter_map(|label| column_of(samples, layout, label, parameter))
            .collect();
        let pinned = |(i, first): (usize, &usize)| columns[i + 1..].iter().any(|c| layout.pins(*first, *c));
        if !columns.iter().enumerate().any(pinned) {
            continue;
        }
        let involved = |r: &&crate::measurement::relation::Relation| {
            r.sense == Sense::Equal && r.coefficients[parameter as usize] != 0.0
        };
        let relation = samples.iter().flat_map(|sample| &sample.relations).find(involved);
        let shared = relation.into_iter().flat_map(|relation| {
            let others = Parameter::COEFFICIENTS.into_iter();
            others.filter(|p| *p != parameter && relation.coefficients[*p as usize] != 0.0)
        });
        return Err(CompareError::Pinned {
            text: relation.map_or(String::new(), |relation| relation.text.clone()),
            parameter: Quantity::Parameter(parameter).name(),
            others: shared
                .map(|p| format!(", or give {0} a value for each with --per-dataset {0}", p.name()))
                .collect(),
        });
    }
    Ok(())
}

/// The unknown that is a label's value of a parameter.
pub(super) fn column_of(
    samples: &[Sample],
    layout: &Layout,
    label: usize,
    parameter: Parameter,
) -> Option<usize> {
    let mut own = samples.iter().zip(&layout.columns).filter(|(sample, _)| sample.label == label);
    own.find_map(|(_, columns)| columns[parameter as usize])
}
