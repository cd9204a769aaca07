//! Fits of frames: the shots with their films, what a joint fit finds besides the parameters, and what frames could tell at
//! best.

use nalgebra::{DMatrix, DVector};

use super::search::Search;
use super::uncertainty::{self, Minimum};
use super::{Bound, Films, JointFit};
use crate::dataset::Dataset;
use crate::impact::film;
use crate::parameters::Parameter;
use crate::residuals::{Fitted, Problem};
use crate::whitening::Whitening;

/// The shots with their frames; `None` if one has none.
pub(super) fn filmed(fitted: &[Fitted], films: &Films) -> Option<Vec<Fitted>> {
    let with = |shot: &Fitted| {
        let film = films.get(shot.index).cloned().flatten()?;
        Some(Fitted { film: Some(film), ..shot.clone() })
    };
    fitted.iter().map(with).collect()
}

/// What a joint fit found besides the parameters.
pub(super) fn joint_fit(fitted: &[Fitted], minimum: &Minimum) -> JointFit {
    let columns: Vec<usize> = (0..minimum.x.len()).collect();
    let covariance = uncertainty::covariance(&minimum.jacobian, &columns, &minimum.ties(false));
    let of = |column: usize| {
        let error = covariance.as_ref().map_or(f64::NAN, |c| c[(column, column)].sqrt());
        (minimum.x[column], error)
    };
    let films = || fitted.iter().filter_map(|shot| shot.film.as_ref());
    JointFit {
        sliding: of(minimum.x.len() - 2),
        rolling: of(minimum.x.len() - 1),
        observations: films().map(|film| film.observations()).sum(),
        unknowns: films().map(|film| film.unknowns()).sum(),
    }
}

/// What the frames could tell at best (Cramér–Rao): the standard errors of a joint fit of some of the shots,
/// for all of them. `None` without frames, and where b or c of a falling friction is free.
pub(super) fn bound(
    search: &Search,
    free: &[Parameter],
    minimum: &Minimum,
    films: &Films,
    cloth: [f64; 2],
) -> Option<Bound> {
    if free.iter().any(|p| !Parameter::COEFFICIENTS.contains(p)) {
        return None;
    }
    let have = |shot: &&Fitted| films.get(shot.index).is_some_and(Option::is_some);
    let some: Vec<Fitted> = search.fitted.iter().filter(have).cloned().collect();
    let shots = filmed(&some, films).filter(|shots| !shots.is_empty() && !free.is_empty())?;
    let whitening = Whitening::none();
    let held = minimum.values;
    let problem = Problem::new(&shots, search.model, search.settings, free, held, &whitening);
    let own = minimum.x.rows(0, free.len());
    let x = DVector::from_iterator(free.len() + cloth.len(), own.iter().copied().chain(cloth));
    let (residuals, jacobian) = problem.evaluate_at(&x);
    let columns: Vec<usize> = (0..x.len()).collect();
    let covariance = uncertainty::covariance(&jacobian, &columns, &DMatrix::zeros(0, x.len()))?;
    if !residuals.iter().all(|r| r.is_finite()) {
        return None;
    }
    let part = shots.len() as f64 / search.fitted.len() as f64;
    let errors = (0..free.len()).map(|i| (free[i], (covariance[(i, i)] * part).sqrt()));
    Some(Bound { std_errors: errors.collect(), shots: shots.len() })
}

/// μ_k and μ_r, as they were fitted or are assumed.
pub(super) fn cloth_of(minimum: &Minimum, dataset: &Dataset) -> [f64; 2] {
    let assumed = dataset.rolling.map_or(film::CLOTH[1].0, |rolling| rolling.value);
    [minimum.sliding(dataset.sliding), minimum.rolling().unwrap_or(assumed)]
}
