//! The fit of a film as a [`Fit`].

use nalgebra::Vector4;
use statrs::distribution::{ChiSquared, ContinuousCDF};

use super::camera::FoundCamera;
use super::common::Common;
use super::diagnostics::goodness::{IMPROBABLE, normality_of};
use super::diagnostics::trends::ranked;
use super::film::{FittedFilm, stated_scale_sd};
use super::intervals::regions::contours;
use super::{
    Bound, Computed, Counted, Depth, Diagnostics, Estimate, Fit, Goodness, Intervals, JointFit, Noise,
    NoiseVerdict, Options, Residual, Status, Variable, check, film_words, warnings,
};
use crate::measurement::dataset::{Dataset, Measured, Shot};
use crate::measurement::observable::{Axis, Observable};
use crate::measurement::parameter::{Parameter, Settings};
use crate::measurement::spin::Spin;
use crate::measurement::track::TrackShot;
use crate::problem::{Id, Impact, Motion, Offsets, Solution};

/// Normal quantile of 95 % intervals.
const WIDE: f64 = 1.96;

/// What was fitted.
pub(crate) struct Fitted<'a> {
    pub dataset: &'a Dataset,
    pub group: Option<(String, String)>,
    pub options: &'a Options,
    pub settings: Settings,
    pub film: FittedFilm,
    pub done: &'a (dyn Fn() + Sync),
    pub impacts: &'a [Impact],
}

impl Fitted<'_> {
    fn solution(&self) -> &Solution {
        &self.film.solution
    }

    fn common(&self) -> Common<'_> {
        let Self { dataset, options, settings, group, done, .. } = self;
        Common { dataset, group: group.as_ref(), options, settings, solution: self.solution(), done: *done }
    }

    /// Returns the fit with everything that is said of it.
    pub fn fit(self, seconds: f64) -> Fit {
        let solution = self.solution();
        let parameters = self.common().parameters();
        let estimates: Vec<Estimate> = parameters.iter().map(|p| self.estimate(*p)).collect();
        let residuals = Self::residuals(solution);
        let (chi2_of_data, observations) = solution.chi2_of_data();
        let unknowns = solution.own_count();
        let dof = (observations - unknowns as f64 - solution.data_count()).max(0.0);
        let measured = |id: Id| self.film.shared(id).map(|(value, sd)| Measured::new(value, sd));
        let computed = Computed::of(solution, self.options.fidelity);
        let mut fit = Fit {
            sliding: measured(Id::MuK),
            rolling: measured(Id::MuR),
            footage: true,
            effects: Computed::effects(&computed),
            chi2: chi2_of_data + solution.prior_chi2(),
            dof: solution.dof(),
            noise: noise_of(&residuals),
            camera: Some(FoundCamera::of_film(solution)),
            diagnostics: self.diagnostics(&estimates, (observations, unknowns), dof),
            residuals,
            frames: Some(self.film.clone()),
            seconds,
            stated_scale_sd: stated_scale_sd(self.dataset),
            explanations: film_words::explanations(solution, Some(&self.film), stated_scale_sd(self.dataset)),
            ..self.common().bare(estimates, self.film.solution.clone())
        };
        self.comment(&mut fit);
        fit
    }

    fn estimate(&self, parameter: Parameter) -> Estimate {
        let (solution, id) = (self.solution(), Id::from(parameter));
        let value = solution.value(id);
        let setting = self.settings[parameter];
        let Some(found) = solution.get(id) else {
            let is_held = setting.fixed || !self.settings.has(parameter);
            let status = if is_held { Status::Fixed } else { Status::NotIdentified };
            return Estimate::bare(parameter, value, status);
        };
        let [low, high] = solution.bounds(id);
        let Some(error) = found.std_error else {
            let Some(limit) = solution.limit_at_bound(id) else {
                return Estimate::bare(parameter, setting.initial, Status::NotIdentified);
            };
            let (status, ends) = if value == low {
                (Status::AtLowerBound, [low, limit])
            } else {
                (Status::AtUpperBound, [limit, high])
            };
            let mut bare = Estimate::bare(parameter, value, status);
            bare.interval_95 = Some(ends);
            bare.intervals.hessian = Some(ends);
            return bare.unless_uninformed(&setting);
        };
        if parameter == Parameter::MuS && solution.is_undetermined(id) {
            return Estimate::bare(parameter, value, Status::NotIdentified);
        }
        let interval = Some([(value - WIDE * error).max(low), (value + WIDE * error).min(high)]);
        let looks = self.options.depth >= Depth::Intervals && !parameter.is_of_balls();
        let is_robust = !solution.weights().is_empty();
        let profile = (looks && !is_robust).then(|| solution.lopsided_interval(id, WIDE)).flatten();
        Estimate {
            std_error: Some(error),
            interval_95: profile.or(interval),
            intervals: Intervals { hessian: interval, profile },
            ..Estimate::bare(parameter, value, Status::Free)
        }
    }

    /// Returns the velocities after the impact of each shot of a film against its fit, in the frame of the
    /// table.
    pub(crate) fn residuals(solution: &Solution) -> Vec<Residual> {
        let of_shot = |(i, name): (usize, &String)| {
            let (Some(motion), Some(Offsets { values, covariance })) =
                (solution.motion(i), solution.offsets(0, i))
            else {
                return Vec::new();
            };
            let (sin, cos) = motion.direction.sin_cos();
            let of = |observable: Observable, first: usize, by: [f64; 2]| {
                let mut direction = Vector4::zeros();
                (direction[first], direction[first + 1]) = (by[0], by[1]);
                let predicted = direction.dot(&Vector4::from(motion.after));
                let off = direction.dot(&values);
                let sd = direction.dot(&(covariance * direction)).sqrt();
                Residual {
                    shot: name.clone(),
                    observable,
                    measured: predicted + off,
                    predicted,
                    sd,
                    standardized: off / sd,
                    cut: motion.cut,
                    speed: Some(motion.speed),
                }
            };
            let axes = [(Axis::X, [cos, -sin]), (Axis::Y, [sin, cos])];
            let balls = [Observable::CueVelocity as fn(Axis) -> Observable, Observable::ObjectVelocity];
            let both = balls.into_iter().enumerate();
            both.flat_map(|(ball, observable)| axes.map(|(axis, by)| of(observable(axis), 2 * ball, by)))
                .collect()
        };
        solution.names[0].iter().enumerate().flat_map(of_shot).collect()
    }

    fn diagnostics(
        &self,
        estimates: &[Estimate],
        (observations, unknowns): (f64, usize),
        dof: f64,
    ) -> Diagnostics {
        let solution = self.solution();
        let is_stated = solution.states_noise();
        let chi2 = solution.chi2_of_data().0;
        let p_value = ChiSquared::new(dof).ok().filter(|_| is_stated).map(|d| d.sf(chi2));
        let shared: Vec<_> = solution.estimates().into_iter().filter(|e| !is_of_contact(e.id)).collect();
        let ids: Vec<Id> = shared.iter().map(|estimate| estimate.id).collect();
        let common = self.common();
        let contact = common.contact();
        let parameters: Vec<Parameter> = contact.iter().map(|(p, _)| *p).collect();
        let is_silent = |e: &&Estimate| {
            e.status == Status::NotIdentified && solution.get(Id::from(e.parameter)).is_none()
        };
        let silent = estimates.iter().filter(is_silent).map(|e| e.parameter).collect();
        let drawn: Vec<&Estimate> = estimates.iter().filter(|e| parameters.contains(&e.parameter)).collect();
        let regions = self.options.depth >= Depth::Everything;
        Diagnostics {
            computed: Computed::of(solution, self.options.fidelity),
            identifiability: common.identifiability(&parameters, silent),
            goodness: Some(self.goodness((chi2, dof as usize, p_value), is_stated)),
            robust: common.robust(),
            bootstrap: common.bootstrap(&contact),
            contours: if regions {
                contours(solution, &solution.covariance, &drawn, None)
            } else {
                Vec::new()
            },
            bound: Some(Bound { std_errors: contact, shots: solution.names[0].len() }),
            joint: Some(JointFit {
                covariance: solution.covariance(&ids),
                shared,
                p_value,
                observations: observations.round() as usize,
                unknowns,
            }),
            ..Diagnostics::default()
        }
    }

    fn goodness(&self, (chi2, dof, p_value): (f64, usize, Option<f64>), is_stated: bool) -> Goodness {
        let solution = self.solution();
        let reduced = chi2 / dof.max(1) as f64;
        let noise = match p_value {
            None => NoiseVerdict::NotTested,
            Some(p) if p < IMPROBABLE => NoiseVerdict::TooSmall,
            Some(p) if p > 1.0 - IMPROBABLE && reduced < 0.9 => NoiseVerdict::TooLarge,
            Some(_) => NoiseVerdict::Explains,
        };
        let standardized: Vec<f64> = self.whitened_offsets();
        let influential_from = self.common().influential_from((4 * solution.names[0].len()) as f64);
        Goodness {
            counted: Counted::Velocities,
            chi2,
            dof,
            noise_is_stated: is_stated,
            p_value,
            noise,
            noise_factor: p_value.map(|_| reduced.sqrt()),
            trends: self.trends(),
            normality: normality_of(&standardized),
            influence: self.common().influence(influential_from),
            influential_from,
        }
    }

    /// Returns the outcome offsets of all shots, whitened.
    fn whitened_offsets(&self) -> Vec<f64> {
        let of_shot = |i: usize| {
            let Offsets { values, covariance } = self.solution().offsets(0, i)?;
            covariance.cholesky()?.l().solve_lower_triangular(&values)
        };
        let shots = 0..self.solution().names[0].len();
        shots.filter_map(of_shot).flat_map(|white| white.iter().copied().collect::<Vec<_>>()).collect()
    }

    fn trends(&self) -> Vec<super::Trend> {
        let solution = self.solution();
        let motions: Vec<_> = (0..solution.names[0].len()).map(|i| solution.motion(i)).collect();
        let variables = [
            (Variable::Speed, motions.iter().map(|m| m.map_or(f64::NAN, |m| m.speed)).collect::<Vec<_>>()),
            (Variable::Cut, motions.iter().map(|m| m.map_or(f64::NAN, |m| m.cut.abs())).collect()),
            // of spins that the frames told, topspin is no variable of its own
            (Variable::Roll, self.film.tracks().iter().zip(&motions).map(stated_roll).collect()),
        ];
        // friction has the sign of the cut angle
        let side = |cut: f64| if cut < 0.0 { -1.0 } else { 1.0 };
        let quantities = [
            ("throw", 3, true),
            ("object-ball velocity along the line of centres", 2, false),
            ("cue-ball velocity along the line of centres", 0, false),
            ("cue-ball velocity across the line of centres", 1, true),
        ];
        let mut found = Vec::new();
        for (quantity, component, is_across) in quantities {
            let direction = |cut: f64| {
                let mut direction = Vector4::zeros();
                direction[component] = if is_across { side(cut) } else { 1.0 };
                direction
            };
            let directions: Vec<Vector4<f64>> =
                motions.iter().map(|m| direction(m.map_or(0.0, |m| m.cut))).collect();
            for (variable, values) in &variables {
                if let Some(slope) = solution.slope(values, &directions) {
                    found.push((quantity, *variable, slope.value, slope.p_value));
                }
            }
        }
        ranked(found)
    }

    /// Adds what is to be said of the fit.
    fn comment(&self, fit: &mut Fit) {
        let shots: Vec<&Shot> = self.impacts.iter().map(|impact| &impact.shot).collect();
        let (warnings, notes) = film_words::sentences(fit, &self.film);
        fit.warnings = warnings;
        fit.notes = notes;
        let topspin = self.film.solution.topspins().iter().any(|(_, topspin)| *topspin > 0.1);
        warnings::add(fit, topspin, true);
        let cloth = [fit.sliding, fit.rolling].map(|measured| measured.filter(|_| fit.refuted.is_none()));
        let suspicious = check::suspicious(self.dataset, &shots, cloth);
        fit.warnings.splice(0..0, check::warnings(&suspicious, shots.len()));
        fit.diagnostics.suspicious = suspicious;
        fit.notes.extend(self.dataset.notes().cloned());
    }
}

/// Returns the topspin of a shot over natural roll if it is known beforehand, NaN if not.
fn stated_roll((track, motion): (&TrackShot, &Option<Motion>)) -> f64 {
    match track.spin {
        Spin::Stun => 0.0,
        Spin::NaturalRoll => 1.0,
        Spin::Measured { .. } => motion.map_or(f64::NAN, |motion| motion.topspin),
        Spin::Unknown => f64::NAN,
    }
}

/// Returns whether an unknown is a parameter of the contact.
fn is_of_contact(id: Id) -> bool {
    id <= Id::RadiusRatio
}

/// Returns the noise of each observable, whose size each shot's frames tell.
fn noise_of(residuals: &[Residual]) -> Vec<Noise> {
    let mut all: Vec<(Observable, Vec<f64>)> = Vec::new();
    for residual in residuals {
        let off = residual.measured - residual.predicted;
        match all.iter_mut().find(|(observable, _)| *observable == residual.observable) {
            Some((_, own)) => own.push(off),
            None => all.push((residual.observable, vec![off])),
        }
    }
    let noise = |(observable, own): (Observable, Vec<f64>)| Noise {
        observable,
        count: own.len(),
        rms: (own.iter().map(|off| off * off).sum::<f64>() / own.len() as f64).sqrt(),
        estimated_sd: None,
        rounding: None,
    };
    all.into_iter().map(noise).collect()
}
