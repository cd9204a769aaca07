//! What the accuracy of a fidelity means to whoever fits with it: data without noise are computed with
//! everything that [`Fidelity::Contact`] knows, and fitted with each fidelity. How far the parameters come out
//! from the truth, in their standard errors, is the price of what the fidelity leaves out.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::time::Instant;

use super::accuracy;
use crate::fit;
use crate::fit::{Depth, FitError, Options};
use crate::likelihood::prediction::Plan;
use crate::measurement::dataset::{Before, Dataset, Measured, Measurement, Shot};
use crate::measurement::loss::Loss;
use crate::measurement::observable::{Axis, Observable};
use crate::measurement::parameter::{Compliance, Parameter, Setting, Settings};
use crate::measurement::spin::Spin;
use crate::measurement::values::Values;
use crate::physics::ball::Ball;
use crate::physics::collision::{Coefficients, Effects, Fidelity, Model};

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
pub const MOST_SHOTS: usize = 200;

/// What is fitted.
pub const PARAMETERS: [Parameter; 3] = [Parameter::Mu, Parameter::MuS, Parameter::E];

/// One parameter as a fidelity finds it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Found {
    pub parameter: Parameter,
    pub truth: f64,
    pub estimate: f64,
    /// `None` where the fidelity does not know the parameter, or the data do not.
    pub std_error: Option<f64>,
}

impl Found {
    /// Estimate less truth, where there is an estimate.
    #[must_use]
    pub fn bias(&self) -> Option<f64> {
        self.std_error.map(|_| self.estimate - self.truth)
    }
}

/// What one fidelity finds.
#[derive(Clone, Debug)]
pub struct Row {
    /// `None`: the cheapest for each shot, as `fit --fidelity auto`.
    pub fidelity: Option<Fidelity>,
    /// In the order of [`PARAMETERS`].
    pub found: [Found; 3],
    /// χ² per observation: above 1 the misfit alone would show in data with that noise.
    pub chi2_per_observation: f64,
    /// Of the fit.
    pub seconds: f64,
}

/// The fidelities that have parameters, in the order in which they are fitted.
pub const FITTED: [Option<Fidelity>; 6] = [
    Some(Fidelity::Inelastic),
    Some(Fidelity::Linear),
    Some(Fidelity::Full),
    None,
    Some(Fidelity::Ode),
    Some(Fidelity::Contact),
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
    let shot = |(number, shot): (usize, &accuracy::Shot)| Shot {
        name: (number + 1).to_string(),
        file: PathBuf::new(),
        line: 0,
        labels: BTreeMap::new(),
        before: Before::Impact {
            normal: [exact(1.0), exact(0.0)],
            velocity: [exact(shot.cue.velocity.x), exact(shot.cue.velocity.y)],
        },
        spin: Spin::Measured { spin: shot.cue.spin, sd: [None; 3] },
        after: after.map(|observable| Measurement { observable, measured: exact(0.0) }).to_vec(),
        joint: None,
    };
    Dataset::new("accuracy", ball, shots.iter().enumerate().map(shot).collect())
}

/// The data set's shots with what they would have measured without noise if `contact`, with everything on,
/// were the truth and the initial values of its parameters theirs. Standard deviations stay; those not stated
/// are [`VELOCITY_SD`], [`ANGLE_SD_DEG`]. Priors, relations and labels fitted apart are dropped, since
/// they would pull at the parameters too.
#[must_use]
pub fn noise_free(dataset: &Dataset) -> Dataset {
    let coefficients = initial(dataset);
    let reference = Model { effects: Effects::ALL, tolerance: TOLERANCE, ..dataset.model(Fidelity::Contact) };
    let typical = |observable: Observable| match observable {
        Observable::CueSpin(_) | Observable::ObjectSpin(_) => SPIN_SD,
        Observable::ObjectSpeedRatio => VELOCITY_SD,
        _ if observable.is_angle() => ANGLE_SD_DEG.to_radians(),
        _ => VELOCITY_SD,
    };
    let every = dataset.shots.len().div_ceil(MOST_SHOTS).max(1);
    let mut shots = Vec::new();
    for shot in dataset.shots.iter().step_by(every) {
        let Ok(plan) = Plan::new(shot) else { continue };
        let Ok(prediction) = plan.predict(&reference, &coefficients) else { continue };
        let mut shot = shot.clone();
        for measurement in &mut shot.after {
            let row = plan.rows().iter().position(|row| row.observable == measurement.observable);
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
    let settings = Settings { each, compliance: Compliance::Rigid, ..Settings::default() };
    Dataset { shots, settings, relations: Vec::new(), by: None, loss: Loss::default(), ..dataset.clone() }
}

/// Fits data of [`noise_free`] with one of [`FITTED`].
///
/// # Errors
/// What no fit can do.
pub fn bias(dataset: &Dataset, fidelity: Option<Fidelity>) -> Result<Row, FitError> {
    let begun = Instant::now();
    let options = Options {
        fidelity: fidelity.unwrap_or(Fidelity::Full),
        auto: fidelity.is_none(),
        effects: fidelity.map(Fidelity::effects),
        tolerance: TOLERANCE,
        depth: Depth::Estimates,
        ..Options::default()
    };
    let fitted = fit::fit(dataset, &options)?.remove(0);
    let truth = Values::from(initial(dataset));
    let found = PARAMETERS.map(|parameter| {
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
        fidelity,
        found,
        chi2_per_observation: fitted.chi2 / observations as f64,
        seconds: begun.elapsed().as_secs_f64(),
    })
}

fn initial(dataset: &Dataset) -> Coefficients {
    let [mu, mu_s, e] = PARAMETERS.map(|parameter| dataset.settings[parameter].initial);
    Coefficients { mu, mu_s, e }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn contact_finds_its_own_truth_and_coarser_fidelities_do_not() {
        /// The Jacobian of `contact` is one of differences: the fit ends this part of an error away.
        const DIFFERENCES: f64 = 1e-2;
        let dataset = noise_free(&velocities(&accuracy::shots(24, 3), Ball::POOL));
        let off = |fidelity: Fidelity, parameter: Parameter| {
            let row = bias(&dataset, Some(fidelity)).unwrap();
            let found = row.found.into_iter().find(|found| found.parameter == parameter).unwrap();
            found.bias().map(|bias| bias.abs() / found.std_error.unwrap())
        };
        for parameter in PARAMETERS {
            let contact = off(Fidelity::Contact, parameter).unwrap();
            assert!(contact < DIFFERENCES, "{parameter:?}: {contact}");
        }
        // what knows no stick takes its lesser throw for less friction
        let [linear, full] = [Fidelity::Linear, Fidelity::Full].map(|f| off(f, Parameter::Mu).unwrap());
        assert!(linear > 3.0 && full < linear, "{linear} {full}");
        // and what knows no friction says nothing of it
        assert_eq!(off(Fidelity::Inelastic, Parameter::Mu), None);
    }
}
