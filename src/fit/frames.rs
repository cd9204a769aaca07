//! Fits of frames: the shots with their films, what a joint fit finds besides the parameters, and what frames could tell at
//! best.

use std::io;

use nalgebra::{DMatrix, DVector, SMatrix};
use rayon::prelude::*;
use statrs::distribution::{ChiSquared, ContinuousCDF};

use super::diagnostics::goodness::IMPROBABLE;
use super::minimum::Minimum;
use super::robust::Sandwich;
use super::samples::Search;
use super::{Bound, Films, JointFit, SharedEstimate};
use crate::likelihood::fitted::Fitted;
use crate::likelihood::frames;
use crate::likelihood::frames::own_estimates::{OwnEstimate, SharedCovariance};
use crate::likelihood::frames::rows::Row;
use crate::likelihood::frames::shared_unknowns::{self, SharedUnknown};
use crate::likelihood::frames::{ALL_SHARED, Own};
use crate::likelihood::sample::{Sample, Unknown};
use crate::likelihood::whitening::Whitening;
use crate::measurement::dataset::{Dataset, Shot};
use crate::measurement::parameter::Parameter;
use crate::physics::collision::Model;

/// The shots with their frames; `None` if one has none.
pub(crate) fn filmed(fitted: &[Fitted], films: &Films) -> Option<Vec<Fitted>> {
    let with = |shot: &Fitted| {
        let film = films.get(shot.index).cloned().flatten()?;
        Some(Fitted { film: Some(film), ..shot.clone() })
    };
    fitted.iter().map(with).collect()
}

/// The frames of a joint fit with what it takes to compare them with the model, shot by shot: all at once they would take
/// ten times the memory.
#[derive(Clone, Debug)]
pub struct FittedFrames {
    shots: Vec<(String, Fitted, Own)>,
    model: Model,
    shared: frames::Shared,
    shared_covariance: Box<SharedCovariance>,
}

/// The topspin of a cue ball before the impact, as the frames show it.
pub(super) struct ShownSpin {
    pub shot: String,
    /// Over the natural roll's.
    topspin: f64,
    /// By how much χ² rises without spin; infinite where the spin is known.
    explained: f64,
}

impl ShownSpin {
    /// Whether the frames show a spin: at four standard errors, which in a film of 40 stun shots chance does in one of 400.
    pub fn is_surely_some(&self) -> bool {
        const RISE: f64 = 16.0;
        self.explained > RISE
    }

    pub fn is_topspin(&self) -> bool {
        self.topspin > 0.0 && self.is_surely_some()
    }
}

/// The frames of one shot against the model.
#[derive(Clone, Debug)]
pub struct OfShot {
    /// The name of the shot.
    pub shot: String,
    /// Cut angle, radians.
    pub cut: f64,
    /// Cue ball's speed before the impact, m/s.
    pub speed: f64,
    /// When the balls touch, s.
    pub instant: f64,
    /// The coordinates, and components of spins, that were fitted.
    pub rows: Vec<Row>,
}

impl FittedFrames {
    /// At a minimum, with the own unknowns of each shot.
    pub(super) fn new(
        shots: &[&Shot],
        fitted: &[Fitted],
        model: &Model,
        minimum: &Minimum,
        (free, unknowns): (&[Parameter], &[SharedUnknown]),
    ) -> Self {
        let shared_covariance = Box::new(shared_covariance(minimum, free, unknowns));
        let model = minimum.first().model(model);
        let values = &minimum.x.as_slice()[minimum.x.len() - unknowns.len()..];
        let shared = shared_unknowns::shared(minimum.first(), unknowns, values);
        let with_own = |shot: &Fitted| {
            let film = shot.film.as_ref()?;
            let reduced = film.reduced(&shot.plan.collision(&model), &shared, &film.start)?;
            Some((shots[shot.index].name.clone(), shot.clone(), reduced.own))
        };
        Self { shots: fitted.par_iter().filter_map(with_own).collect(), model, shared, shared_covariance }
    }

    /// Shot by shot, in the order of those that were used.
    pub fn shots(&self) -> impl Iterator<Item = OfShot> {
        self.shots.iter().filter_map(|shot| self.of_shot(shot))
    }

    fn of_shot(&self, (name, shot, own): &(String, Fitted, Own)) -> Option<OfShot> {
        let film = shot.film.as_ref()?;
        let rows = film.rows(&shot.plan.collision(&self.model), &self.shared, own)?;
        let cut = shot.plan.cut();
        Some(OfShot { shot: name.clone(), cut, speed: own[4].hypot(own[5]), instant: own[0], rows })
    }

    /// Writes a text of each shot, which `text` appends, in the same order. Texts are made side by side, some at a time, while those
    /// before them are written: there may be more frames than should be held in memory.
    pub(crate) fn write(
        &self,
        to: &mut (dyn io::Write + Send),
        text: impl Fn(&OfShot, &mut String) + Sync,
    ) -> io::Result<()> {
        const AT_A_TIME: usize = 512;
        const TOGETHER: usize = 16;
        let mut ready: Vec<String> = Vec::new();
        for some in self.shots.chunks(AT_A_TIME).chain([&[][..]]) {
            let of_some = |some: &[_]| {
                let mut texts = String::new();
                some.iter()
                    .filter_map(|shot| self.of_shot(shot))
                    .for_each(|of_shot| text(&of_shot, &mut texts));
                texts
            };
            let mut write = || ready.iter().try_for_each(|text| to.write_all(text.as_bytes()));
            let (written, next) =
                rayon::join(&mut write, || some.par_chunks(TOGETHER).map(of_some).collect());
            written?;
            ready = next;
        }
        Ok(())
    }

    /// What was estimated of each shot besides the parameters, in the same order, with the shot's name.
    pub(crate) fn estimates(&self) -> impl Iterator<Item = (&str, Vec<OwnEstimate>)> {
        self.shots.iter().filter_map(|(name, shot, own)| {
            let film = shot.film.as_ref()?;
            let collision = shot.plan.collision(&self.model);
            Some((name.as_str(), film.own_estimates(&collision, &self.shared, own, &self.shared_covariance)))
        })
    }

    /// The spins of the cue balls, and how surely the frames show that they have any.
    pub(super) fn spins(&self) -> impl Iterator<Item = ShownSpin> {
        self.shots.iter().filter_map(|(name, shot, own)| {
            let film = shot.film.as_ref()?;
            let (topspin, explained) =
                film.shown_topspin(&shot.plan.collision(&self.model), &self.shared, own)?;
            Some(ShownSpin { shot: name.clone(), topspin, explained })
        })
    }

    /// What is expected of unknown spins beforehand, as part of χ².
    pub(super) fn prior_chi2(&self) -> f64 {
        self.shots.iter().filter_map(|(_, shot, own)| Some(shot.film.as_ref()?.prior_chi2(own))).sum()
    }
}

/// Covariance of what all shots share; 0 where the fit holds it, NaN where it cannot tell its error.
fn shared_covariance(minimum: &Minimum, free: &[Parameter], unknowns: &[SharedUnknown]) -> SharedCovariance {
    let found = minimum.covariance();
    let of_unknowns = unknowns.iter().map(|unknown| unknown.kind.place());
    let places: Vec<usize> = free.iter().map(|p| frames::place_of(*p)).chain(of_unknowns).collect();
    let mut covariance = SMatrix::<f64, ALL_SHARED, ALL_SHARED>::zeros();
    for (i, a) in places.iter().enumerate() {
        for (j, b) in places.iter().enumerate() {
            covariance[(*a, *b)] = found.as_ref().map_or(f64::NAN, |found| found[(i, j)]);
        }
    }
    covariance
}

/// What a joint fit found besides the parameters; `chi2` and `dof` are those of the frames.
pub(super) fn joint_fit(
    search: &Search,
    minimum: &Minimum,
    ((chi2, dof), intervals): ((f64, usize), &[Option<[f64; 2]>]),
) -> JointFit {
    let Sample { fitted, unknowns, .. } = search.first();
    let first = minimum.x.len() - unknowns.len();
    let covariance = match Sandwich::new(search, minimum, first) {
        Some(sandwich) => sandwich.covariance_of_all(),
        None => minimum.covariance(),
    };
    let of = |i: usize, j: usize| covariance.as_ref().map_or(f64::NAN, |c| c[(first + i, first + j)]);
    let shared = unknowns.iter().enumerate().map(|(i, unknown)| SharedEstimate {
        kind: unknown.kind,
        value: minimum.x[first + i],
        std_error: of(i, i).sqrt(),
        interval_95: intervals.get(i).copied().flatten(),
    });
    let films = || fitted.iter().filter_map(|shot| shot.film.as_ref());
    let is_tested = !search.is_robust() && films().all(|film| film.states_noise);
    JointFit {
        p_value: ChiSquared::new(dof as f64).ok().filter(|_| is_tested).map(|d| d.sf(chi2)),
        shared: shared.collect(),
        covariance: DMatrix::from_fn(unknowns.len(), unknowns.len(), of),
        observations: films().map(|film| film.observations()).sum(),
        unknowns: films().map(|film| film.unknowns()).sum(),
    }
}

/// Whether the noise explains what the collisions, and what is known of all that the shots share, add to the χ² of the motions in the
/// films.
pub(super) fn are_explained(search: &Search, minimum: &Minimum) -> bool {
    let shots = || search.shots();
    if search.is_robust() || !shots().all(|shot| shot.film.is_some()) {
        return false;
    }
    let kinks = minimum.whitening.iter().map(Whitening::kink_rows).sum::<usize>();
    let rows = minimum.residuals.len() - kinks;
    let chi2 = minimum.residuals.rows(0, rows).norm_squared();
    let of_motions: f64 = shots().map(Fitted::least_chi2).sum();
    // of a shot as many numbers as are extracted from it, and each that is known
    let tied: usize = shots().map(|shot| shot.plan.rows().len()).sum();
    let known = rows - shots().map(Fitted::rows).sum::<usize>();
    let dof = (tied + known).saturating_sub(minimum.parameters() + minimum.shared);
    ChiSquared::new(dof as f64).is_ok_and(|d| d.sf((chi2 - of_motions).max(0.0)) >= IMPROBABLE)
}

/// What the frames could tell at best (Cramér–Rao): the standard errors of a joint fit of some of the shots,
/// for all of them. `None` without frames, and where b or c of a falling friction is free.
pub(super) fn bound(
    search: &Search,
    free: &[Unknown],
    minimum: &Minimum,
    films: &Films,
    cloth: [f64; 2],
) -> Option<Bound> {
    let is_followed = |p: Parameter| Parameter::COEFFICIENTS.contains(&p) || p.is_of_balls();
    if !free.iter().all(|unknown| is_followed(unknown.parameter)) {
        return None;
    }
    let have = |shot: &&Fitted| films.get(shot.index).is_some_and(Option::is_some);
    let some: Vec<Fitted> = search.shots().filter(have).cloned().collect();
    let shots = filmed(&some, films).filter(|shots| !shots.is_empty() && !free.is_empty())?;
    let whitening = [Whitening::default()];
    let filmed = search.from(&minimum.values).with(|_, sample| {
        sample.fitted = &shots;
        sample.unknowns = shared_unknowns::of_fit(std::iter::empty());
    });
    let problem = filmed.problem(free, &whitening);
    let own = minimum.x.rows(0, free.len());
    let x = DVector::from_iterator(free.len() + cloth.len(), own.iter().copied().chain(cloth));
    let (residuals, jacobian) = problem.evaluate_at(&x);
    let covariance = super::minimum::covariance(&jacobian)?;
    if !residuals.iter().all(|r| r.is_finite()) {
        return None;
    }
    let part = shots.len() as f64 / search.count() as f64;
    let errors = (0..free.len()).map(|i| (free[i].parameter, (covariance[(i, i)] * part).sqrt()));
    Some(Bound { std_errors: errors.collect(), shots: shots.len() })
}

/// μ_k and μ_r, as they were fitted or are assumed.
pub(super) fn cloth_of(minimum: &Minimum, dataset: &Dataset) -> [f64; 2] {
    let assumed = dataset.rolling.map_or(frames::CLOTH[1].0, |rolling| rolling.value);
    [minimum.sliding(dataset.sliding), minimum.rolling().unwrap_or(assumed)]
}
