//! What mass ratios of different balls limit.

use nalgebra::DVector;

use super::joint_fit::FitOfAll;
use crate::measurement::number::plain;
use crate::measurement::parameter::Parameter;

/// Says that most of the error of a difference is due to ratios of the masses that the data sets do not share: with d how the
/// difference covaries with the ratios, whose covariance is C, that part of its variance is dᵀC⁻¹d.
pub(super) fn sentence(fit: &FitOfAll) -> Option<String> {
    /// Of a variance.
    const MOST: f64 = 0.5;
    let (free, covariance) = (&fit.informed.settled.free, fit.covariance.as_ref()?);
    let of = |wanted: Parameter| (0..free.len()).filter(move |i| free[*i].parameter == wanted);
    let ratios: Vec<usize> = of(Parameter::MassRatio).collect();
    if ratios.len() < 2 {
        return None;
    }
    let inverse = covariance.select_rows(&ratios).select_columns(&ratios).try_inverse()?;
    let limited = |parameter: Parameter| {
        let mut own = of(parameter);
        let (first, second) = (own.next()?, own.next()?);
        let column = covariance.column(second) - covariance.column(first);
        let variance = column[second] - column[first];
        let by_ratios = DVector::from_iterator(ratios.len(), ratios.iter().map(|ratio| column[*ratio]));
        let part = by_ratios.dot(&(&inverse * &by_ratios));
        (part > MOST * variance).then_some((parameter, variance.sqrt(), part.sqrt()))
    };
    let (parameter, error, part) = super::COMPARED.into_iter().find_map(limited)?;
    Some(format!(
        "Of the error of a difference in {}, ± {}, {} is the mass ratio of the balls, one for each data set. If the same balls were played, \
         balls = \"LABEL\" in each dataset.toml says so; if not, weigh them to 0.1 g.",
        parameter.symbol(),
        plain(error, 2),
        plain(part, 2)
    ))
}
