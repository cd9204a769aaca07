//! What the accuracy of a fidelity means to whoever fits with it: data without noise are computed with
//! everything that [`Fidelity::Contact`] knows, and fitted with each fidelity. How far the parameters come out
//! from the truth, in their standard errors, is the price of what the fidelity leaves out.

use std::time::Instant;

use super::accuracy;
use crate::fit;
use crate::fit::{Depth, FitError, Options};
use crate::measurement::dataset::{Before, Dataset, Measured, Measurement, ObjectBall, Shot};
use crate::measurement::loss::Loss;
use crate::measurement::observable::{Axis, Observable};
use crate::measurement::parameter::{Compliance, Parameter, Setting, Settings};
use crate::measurement::spin::Spin;
use crate::measurement::values::Values;
use crate::physics::ball::Ball;
use crate::physics::collision::{Coefficients, Effects, Fidelity, FidelityChoice, Model};
use crate::problem::predict;

/// Of `contact` and `ode`, far below every error that a fit sees; differences for the Jacobian are then good
/// to 1e-5.
const TOLERANCE: f64 = 1e-8;

/// What good footage gives a velocity, m/s, where a data set states no standard deviations.
pub const VELOCITY_SD: f64 = 0.005;

/// What a protractor or good footage gives an angle, degrees.
pub const ANGLE_SD_DEG: f64 = 0.3;

/// And a spin, rad/s.
const SPIN_SD: f64 = 1.0;

/// More shots than this add time, but no other bias: those taken are spread evenly over the data set.
const MOST_SHOTS: usize = 200;

/// One parameter, as the fit with a fidelity finds it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Found {
    /// The parameter.
    pub parameter: Parameter,
    /// The value that the data were computed with.
    pub truth: f64,
    /// The value that the fit found.
    pub estimate: f64,
    /// Its standard error; `None` where the fidelity does not know the parameter, or the data do not determine it.
    pub std_error: Option<f64>,
}

impl Found {
    /// The estimate less the truth, where there is an estimate.
    #[must_use]
    pub fn bias(&self) -> Option<f64> {
        self.std_error.map(|_| self.estimate - self.truth)
    }
}

/// The model with which shots are fitted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Way {
    /// The fidelity; `None`: that of `fit --fidelity auto`.
    pub fidelity: Option<Fidelity>,
    /// Whether the contact is compliant, as that of the data is.
    pub gives_way: bool,
}

impl Way {
    const fn rigid(fidelity: Option<Fidelity>) -> Self {
        Self { fidelity, gives_way: false }
    }

    /// The name in bias.csv.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self.fidelity {
            Some(Fidelity::Ode) if self.gives_way => "ode compliant",
            Some(fidelity) => fidelity.name(),
            None => "auto",
        }
    }
}

/// The result of the fits with one model.
#[derive(Clone, Debug)]
pub struct Row {
    /// The model with which the shots were fitted.
    pub way: Way,
    /// The tangential compliance κ of the contact that computed the data.
    pub kappa: f64,
    /// The estimates, in the order of [`Parameter::COEFFICIENTS`].
    pub found: [Found; 3],
    /// χ² per observation: above 1 the misfit alone would show in data with that noise.
    pub chi2_per_observation: f64,
    /// How long the fit took, s.
    pub seconds: f64,
}

/// The models that have parameters, in the order in which they are fitted.
pub const FITTED: [Way; 7] = [
    Way::rigid(Some(Fidelity::Inelastic)),
    Way::rigid(Some(Fidelity::Linear)),
    Way::rigid(Some(Fidelity::Full)),
    Way::rigid(Some(Fidelity::Ode)),
    Way { fidelity: Some(Fidelity::Ode), gives_way: true },
    Way { fidelity: Some(Fidelity::Contact), gives_way: true },
    Way::rigid(None),
];

/// A data set of velocities after the impact for these shots, to be filled in.
#[must_use]
pub fn velocities(shots: &[accuracy::Shot], ball: Ball) -> Dataset {
    let exact = |value| Measured { value, sd: None };
    let after = [
        Observable::CueVelocity(Axis::X),
        Observable::CueVelocity(Axis::Y),
        Observable::ObjectVelocity(Axis::X),
        Observable::ObjectVelocity(Axis::Y),
    ];
    let shot = |(number, shot): (usize, &accuracy::Shot)| {
        let before = Before::Impact {
            normal: [exact(1.0), exact(0.0)],
            velocity: [exact(shot.cue.velocity.x), exact(shot.cue.velocity.y)],
        };
        let spin = Spin::Measured { spin: shot.cue.spin, sd: [None; 3] };
        let after = after.map(|observable| Measurement { observable, measured: exact(0.0) });
        Shot::new((number + 1).to_string(), before, spin, after.to_vec())
    };
    Dataset::new("accuracy", ball, shots.iter().enumerate().map(shot).collect())
}

/// The data set's shots with what they would have measured without noise if `contact`, with everything on and with `kappa` giving
/// way, were the truth and the initial values of its parameters theirs. Standard deviations stay; those not stated
/// are [`VELOCITY_SD`], [`ANGLE_SD_DEG`]. Priors and labels fitted apart are dropped, since
/// they would pull at the parameters too.
#[must_use]
pub fn noise_free(dataset: &Dataset, kappa: f64) -> Dataset {
    let coefficients = initial(dataset);
    let reference =
        Model { effects: Effects::ALL, kappa, tolerance: TOLERANCE, ..dataset.model(Fidelity::Contact) };
    let typical = |observable: Observable| match observable {
        Observable::CueSpin(_) | Observable::ObjectSpin(_) => SPIN_SD,
        Observable::ObjectSpeedRatio => VELOCITY_SD,
        _ if observable.is_angle() => ANGLE_SD_DEG.to_radians(),
        _ => VELOCITY_SD,
    };
    let every = dataset.shots.len().div_ceil(MOST_SHOTS).max(1);
    let mut shots = Vec::new();
    for shot in dataset.shots.iter().step_by(every) {
        let Ok(prediction) = predict(shot, &reference, &coefficients) else { continue };
        let mut shot = shot.clone();
        for measurement in &mut shot.after {
            let own = |observable: &Observable| *observable == measurement.observable;
            let row = prediction.observables.iter().position(own);
            // the one that is missing serves to find the speed before
            if let Some(row) = row {
                measurement.measured.value = prediction.values[row];
            }
            if shot.joint.is_none() {
                measurement.measured.sd.get_or_insert(typical(measurement.observable));
            }
        }
        shots.push(shot);
    }
    let each = dataset.settings.each.map(|setting| Setting { prior: None, ..setting });
    let mut settings = Settings { each, ..Settings::default() };
    settings[Parameter::Kappa] = Setting::held(kappa);
    // an error of the masses would hide what a fidelity leaves out
    let object = ObjectBall::exact(dataset.object.map_or(dataset.ball, |object| object.ball));
    Dataset { shots, settings, object: Some(object), by: None, loss: Loss::default(), ..dataset.clone() }
}

/// Fits data of [`noise_free`] with one of [`FITTED`].
///
/// # Errors
/// What no fit can do.
pub fn bias(dataset: &Dataset, way: Way) -> Result<Row, FitError> {
    let begun = Instant::now();
    let Way { fidelity, gives_way } = way;
    let options = Options {
        fidelity: fidelity.map_or(FidelityChoice::Auto, FidelityChoice::Of),
        effects: fidelity.map(Fidelity::effects),
        tolerance: if fidelity == Some(Fidelity::Contact) { TOLERANCE } else { Model::TOLERANCE_OF_FITS },
        depth: Depth::Estimates,
        ..Options::default()
    };
    let mut dataset = dataset.clone();
    if gives_way {
        dataset.settings.compliance = Compliance::Stated;
    } else if fidelity.is_some() {
        dataset.settings.compliance = Compliance::Rigid;
    }
    let dataset = &dataset;
    let fitted = fit::fit(dataset, &options)?.remove(0);
    let truth = Values::initial(&dataset.settings);
    let found = Parameter::COEFFICIENTS.map(|parameter| {
        let truth = truth[parameter];
        let estimate = fitted.estimates.iter().find(|estimate| estimate.parameter == parameter);
        Found {
            parameter,
            truth,
            estimate: estimate.map_or(truth, |estimate| estimate.value),
            // a fidelity that leaves much out is refuted, which is what the bias is to show
            std_error: fitted.std_error_if_model_held(parameter),
        }
    });
    let observations = dataset.shots.iter().map(|shot| shot.after.len()).sum::<usize>();
    Ok(Row {
        way,
        kappa: dataset.settings[Parameter::Kappa].initial,
        found,
        chi2_per_observation: fitted.chi2 / observations as f64,
        seconds: begun.elapsed().as_secs_f64(),
    })
}

fn initial(dataset: &Dataset) -> Coefficients {
    let [mu, mu_s, e] = Parameter::COEFFICIENTS.map(|parameter| dataset.settings[parameter].initial);
    Coefficients { mu, mu_s, e }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::physics::ball::BallState;

    #[test]
    fn contact_finds_its_own_truth_and_coarser_fidelities_do_not() {
        /// The Jacobian of `contact` is one of differences: the fit ends this part of an error away.
        const DIFFERENCES: f64 = 1e-2;
        let dataset = noise_free(&velocities(&accuracy::shots(24, 3), Ball::POOL), Model::KAPPA);
        let off = |fidelity: Fidelity, parameter: Parameter| {
            let way = FITTED.into_iter().rfind(|way| way.fidelity == Some(fidelity)).unwrap();
            let row = bias(&dataset, way).unwrap();
            let found = row.found.into_iter().find(|found| found.parameter == parameter).unwrap();
            found.bias().map(|bias| bias.abs() / found.std_error.unwrap())
        };
        for parameter in Parameter::COEFFICIENTS {
            let contact = off(Fidelity::Contact, parameter).unwrap();
            assert!(contact < DIFFERENCES, "{parameter:?}: {contact}");
        }
        // a rigid contact takes the throw of one that gives way for more friction
        let full = off(Fidelity::Full, Parameter::Mu).unwrap();
        assert!(full > 1.0, "{full}");
        // and what knows no friction says nothing of it
        assert_eq!(off(Fidelity::Inelastic, Parameter::Mu), None);
    }

    /// What it means to leave out that a contact gives way, for stun shots, many of which stick.
    #[test]
    fn a_rigid_contact_does_not_fit_where_it_gave_way() {
        /// Weight and the cloth's friction on the cue ball are still left out, in standard errors.
        const LEFT: f64 = 5.0;
        let stun = |shot: accuracy::Shot| accuracy::Shot { cue: BallState::stun(shot.cue.velocity), ..shot };
        let shots: Vec<_> = accuracy::shots(24, 3).into_iter().map(stun).collect();
        let data = noise_free(&velocities(&shots, Ball::POOL), Model::KAPPA);
        let rows = [FITTED[2], FITTED[6], FITTED[4]].map(|way| bias(&data, way).unwrap());
        let off = |row: &Row| {
            let found = row.found.iter().filter_map(|found| Some(found.bias()?.abs() / found.std_error?));
            found.fold(0.0, f64::max)
        };
        let [rigid, auto, compliant] = rows.each_ref().map(|row| (off(row), row.chi2_per_observation));
        println!("{rigid:?} {auto:?} {compliant:?}");
        assert!(rigid.1 > 2.0 * compliant.1 && auto.0 < LEFT && compliant.0 < LEFT);
        assert!(rows.iter().all(|row| row.kappa == Model::KAPPA));
    }
}
