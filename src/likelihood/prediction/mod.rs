//! Shot + coefficients → what the model says each observable should be, with derivatives with
//! respect to the coefficients and to the measured state before the impact.

mod choice;
mod error;
mod seen;
mod start;

use nalgebra::{DMatrix, DVector, SMatrix, SVector};

pub use error::Unpredictable;
use seen::View;
pub use seen::{difference, wrap};
use start::{Start, State};

use super::joint_errors::Together;
use crate::likelihood::corrected::Correction;
use crate::likelihood::small_products::add_product;
use crate::measurement::dataset::{Before, Joint, Measurement, Shared, Shot};
use crate::measurement::observable::Observable;
use crate::measurement::parameter::Parameter;
use crate::measurement::spin::Spin;
use crate::physics::ball::BallState;
use crate::physics::collision::{Coefficients, Effects, Fidelity, Model, Regime};
use crate::physics::friction_law::Law;

/// No kind of data set has more observables per shot.
pub(crate) const MAX_OBSERVABLES: usize = Observable::IMPACTS.len();

/// Inputs of a shot. Kind `impacts`: direction of the line of centres (rad), v_x, v_y, ω_x, ω_y,
/// ω_z in the table frame. Kind `angles`: cut angle, speed (or the speed afterwards that it is
/// solved from), nothing, ω_x, ω_y, ω_z in the collision frame.
pub(crate) const INPUTS: usize = Joint::BEFORE;

/// Predicted observables of one shot, SI and radians, in the order of [`Plan::rows`].
#[derive(Clone, Debug)]
pub struct Prediction {
    /// The predicted values; those beyond the shot's observations are 0.
    pub values: SVector<f64, MAX_OBSERVABLES>,
    /// Their derivatives by the parameters in the order of [`Parameter::ALL`]; 0 for parameters that have no part in
    /// the model.
    pub by_parameters: SMatrix<f64, MAX_OBSERVABLES, { Parameter::ALL.len() }>,
    /// Their derivatives by the shot's inputs: for kind `impacts` the direction of the line of centres (rad), v_x,
    /// v_y, ω_x, ω_y and ω_z in the table frame; for kind `angles` the cut angle, the speed, nothing, and ω_x, ω_y,
    /// ω_z in the collision frame.
    pub by_inputs: SMatrix<f64, MAX_OBSERVABLES, INPUTS>,
    /// Speed of the cue ball before the impact, m/s, measured or solved for.
    pub speed: f64,
    /// How the balls touch.
    pub(crate) contact: Contact,
}

/// How the balls touch: what decides on which side of its kinks a prediction is.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Contact {
    /// Whether the cue ball presses the object ball into the cloth, and whether the contact sticks.
    pub side: [bool; 2],
    /// The slip at first contact over the closing speed: its vertical component v_z0/k, and ln(|v_∥0|/k); and how
    /// they follow from the inputs.
    pub vertical: f64,
    pub log_slip: f64,
    pub vertical_by_inputs: SVector<f64, INPUTS>,
    pub log_slip_by_inputs: SVector<f64, INPUTS>,
}

/// A shot prepared for prediction: its measured state before the impact, the inputs, and its observations.
#[derive(Clone, Debug)]
pub struct Plan {
    state: State,
    rows: Vec<Measurement>,
    joint: Option<Box<Joint>>,
    together: Option<Box<Together>>,
    variance_in: SVector<f64, INPUTS>,
    side_sd: f64,
    /// In the place of the fidelity and the effects of the model.
    choice: Option<(Fidelity, Effects)>,
    /// What an integrated fidelity that was chosen adds to `full`…
    correction: Option<Box<Correction>>,
    /// …or that it is integrated each time.
    is_direct: bool,
}

/// The speeds afterwards that the speed before can be solved from, best first.
const SOLVABLE: [Observable; 4] = [
    Observable::ObjectSpeed,
    Observable::ObjectSpeedRolling,
    Observable::CueSpeed,
    Observable::CueSpeedRolling,
];

/// Takes the best speed to solve from out of the observations.
fn take_solvable(rows: &mut Vec<Measurement>) -> Option<Measurement> {
    let index = SOLVABLE.iter().find_map(|o| rows.iter().position(|row| row.observable == *o))?;
    Some(rows.remove(index))
}

fn cut(before: &Before) -> f64 {
    match before {
        Before::Angle { cut, .. } => cut.value,
        Before::Impact { normal, velocity } => {
            let [nx, ny] = normal.map(|m| m.value);
            let [vx, vy] = velocity.map(|m| m.value);
            (nx * vy - ny * vx).atan2(nx * vx + ny * vy)
        }
    }
}

impl Plan {
    /// Prepares a shot.
    ///
    /// # Errors
    /// A shot with unknown spin, or whose speed is needed and neither given nor to be solved for.
    pub fn new(shot: &Shot) -> Result<Self, Unpredictable> {
        let mut rows = shot.after.clone();
        let mut variance_in = SVector::zeros();
        let variance = |sd: Option<f64>| sd.map_or(0.0, |sd| sd * sd);
        let mut solved_from = None;
        match shot.before {
            Before::Impact { normal, velocity } => {
                // a unit vector errs across itself: dn = (−n_y, n_x) dα, so dα² = dn_x² + dn_y²
                variance_in[0] = variance(normal[0].sd) + variance(normal[1].sd);
                variance_in[1] = variance(velocity[0].sd);
                variance_in[2] = variance(velocity[1].sd);
            }
            Before::Angle { cut, speed } => {
                variance_in[0] = variance(cut.sd);
                if let Some(speed) = speed {
                    variance_in[1] = variance(speed.sd);
                } else if let Some(row) = take_solvable(&mut rows) {
                    variance_in[1] = variance(row.measured.sd);
                    if rows.is_empty() {
                        return Err(Unpredictable::NothingLeft { column: row.observable.column() });
                    }
                    solved_from = Some(row);
                } else if matches!(shot.spin, Spin::Measured { spin, .. } if spin.norm() > 0.0) {
                    return Err(Unpredictable::SpinWithoutSpeed);
                }
            }
        }
        match shot.spin {
            Spin::Unknown => return Err(Unpredictable::UnknownSpin),
            Spin::Measured { sd, .. } => {
                for (axis, sd) in sd.into_iter().enumerate() {
                    variance_in[3 + axis] = variance(sd);
                }
            }
            Spin::Stun | Spin::NaturalRoll => {}
        }
        let Shot { mut before, spin, .. } = *shot;
        if let Before::Impact { normal: [x, y], .. } = &mut before {
            let length = x.value.hypot(y.value);
            (x.value, y.value) = (x.value / length, y.value / length);
        }
        let side = if cut(&before) < 0.0 { -1.0 } else { 1.0 };
        Ok(Self {
            state: State { before, spin, solved_from, side, topspin: 0.0 },
            rows,
            joint: shot.joint.clone(),
            together: shot.joint.as_deref().and_then(Together::new).map(Box::new),
            variance_in,
            side_sd: shot.side_sd,
            choice: None,
            correction: None,
            is_direct: false,
        })
    }

    /// The cue ball just before the impact, in the collision frame.
    ///
    /// # Errors
    /// As [`Plan::predict`].
    pub fn cue(&self, model: &Model, coefficients: &Coefficients) -> Result<BallState, Unpredictable> {
        let speed = self.predict(model, coefficients)?.speed;
        Ok(Start::new(&self.state, speed, model.ball.radius).cue)
    }

    /// Which parameters, in the order of [`Parameter::ALL`], its observations depend on where this is predicted of it.
    pub(crate) fn depends(&self, prediction: &Prediction) -> [bool; Parameter::ALL.len()] {
        let by = prediction.by_parameters.rows(0, self.rows.len());
        std::array::from_fn(|parameter| by.column(parameter).iter().any(|d| *d != 0.0))
    }

    /// Whether its contact slides to the end or sticks, in closed form.
    pub(crate) fn regime(&self, model: &Model, coefficients: &Coefficients) -> Result<Regime, Unpredictable> {
        let cue = self.cue(model, coefficients)?;
        Ok(self.collision(model).model.collide(&cue, coefficients)?.regime)
    }

    /// The observations that are compared with the prediction.
    #[must_use]
    pub fn rows(&self) -> &[Measurement] {
        &self.rows
    }

    /// The same shot with an exact state before the impact, and with this covariance of what is observed after it, whose differences from
    /// what is predicted move so with each way in which the camera may be off.
    pub(crate) fn with_covariance(&self, covariance: &DMatrix<f64>, by_camera: &[DVector<f64>]) -> Self {
        let count = self.rows.len();
        let places = Joint::BEFORE + count;
        let mut joint = Joint {
            covariance: DMatrix::zeros(places, places),
            by_shared: vec![DVector::zeros(places); Shared::ALL.len()],
        };
        joint.covariance.view_mut((Joint::BEFORE, Joint::BEFORE), (count, count)).copy_from(covariance);
        for by in by_camera {
            // predicted less measured
            let mut of_all = DVector::zeros(places);
            of_all.rows_mut(Joint::BEFORE, count).copy_from(&-by);
            joint.by_shared.push(of_all);
        }
        let together = Together::new(&joint).map(Box::new);
        let mut with =
            Self { joint: Some(Box::new(joint)), together, variance_in: SVector::zeros(), ..self.clone() };
        for (i, row) in with.rows.iter_mut().enumerate() {
            row.measured.sd = Some(covariance[(i, i)].sqrt());
        }
        with
    }

    /// Whether it is one of discs.
    pub(crate) fn is_of_discs(&self) -> bool {
        self.rows.iter().any(|row| row.observable == Observable::Restitution)
    }

    /// The joint errors of inputs and observations, where they were extracted together.
    pub(crate) fn joint(&self) -> Option<&Joint> {
        self.joint.as_deref()
    }

    /// The same, taken apart.
    pub(crate) fn together(&self) -> Option<&Together> {
        self.together.as_deref()
    }

    /// Whether any input has an error that can be told from those of the observations.
    pub(crate) fn has_uncertain_inputs(&self) -> bool {
        self.joint.is_none() == self.together.is_none() && self.variance_in.amax() > 0.0
    }

    /// The variances of the inputs in the order of the columns of [`Prediction::by_inputs`]; an input without a stated error counts as exact.
    #[must_use]
    pub fn variance_in(&self) -> &SVector<f64, INPUTS> {
        &self.variance_in
    }

    /// The standard deviation of side spin that nobody saw, rad/s; 0 where none is reckoned with.
    pub(crate) fn side_sd(&self) -> f64 {
        self.side_sd
    }

    /// Whether the incoming speed is known, measured or solved for.
    pub(crate) fn knows_speed(&self) -> bool {
        !matches!(self.state.before, Before::Angle { speed: None, .. }) || self.state.solved_from.is_some()
    }

    /// Whether the cue ball has topspin about the line of centres, so that it presses the object
    /// ball into the cloth.
    pub(crate) fn has_topspin(&self) -> bool {
        let start = Start::new(&self.state, 1.0, 1.0);
        start.cue.spin.y > 0.0
    }

    /// Whether the cue ball's spin is stated, as stun or natural roll.
    pub(crate) fn states_spin(&self) -> bool {
        matches!(self.state.spin, Spin::Stun | Spin::NaturalRoll)
    }

    /// The same shot with this much more topspin than is stated, over the natural roll's; one whose spin is measured or unknown
    /// stays as it is.
    pub(crate) fn with_topspin(mut self, topspin: f64) -> Self {
        self.state.topspin = topspin;
        self
    }

    /// Cut angle, radians.
    pub(crate) fn cut(&self) -> f64 {
        cut(&self.state.before)
    }

    /// What the model predicts from the state before the impact as it was measured.
    ///
    /// # Errors
    /// What is no collision, and a speed that cannot be solved for.
    pub fn predict(&self, model: &Model, coefficients: &Coefficients) -> Result<Prediction, Unpredictable> {
        self.predict_from(&self.state, model, coefficients)
    }

    /// With the inputs moved by so much from what was measured.
    pub(crate) fn predict_moved(
        &self,
        by: &SVector<f64, INPUTS>,
        model: &Model,
        coefficients: &Coefficients,
    ) -> Result<Prediction, Unpredictable> {
        self.predict_from(&self.state.moved(by), model, coefficients)
    }

    fn predict_from(
        &self,
        state: &State,
        model: &Model,
        coefficients: &Coefficients,
    ) -> Result<Prediction, Unpredictable> {
        match (state.before, state.solved_from) {
            (Before::Angle { speed: None, .. }, Some(known)) => {
                self.predict_solved(state, model, coefficients, known)
            }
            (Before::Angle { speed: None, .. }, None)
                if model.law != Law::Constant || model.e_slope.is_some() =>
            {
                Err(Unpredictable::FallsWithoutSpeed)
            }
            (Before::Angle { speed: None, .. }, None) => {
                // the outcome is proportional to the speed and only angles and ratios are asked for
                self.predict_at(state, model, coefficients, 1.0, None)
            }
            (Before::Angle { speed: Some(speed), .. }, _) => {
                self.predict_at(state, model, coefficients, speed.value, None)
            }
            (Before::Impact { velocity, .. }, _) => {
                let speed = velocity[0].value.hypot(velocity[1].value);
                self.predict_at(state, model, coefficients, speed, None)
            }
        }
    }

    /// Solves f(U) = `known` for the incoming speed U, then takes `known` as the input in its place:
    /// dU = (d known − f_θ dθ)/f_U.
    fn predict_solved(
        &self,
        state: &State,
        model: &Model,
        coefficients: &Coefficients,
        known: Measurement,
    ) -> Result<Prediction, Unpredictable> {
        /// Without spin in rad/s the second step only removes roundings.
        const MAX_STEPS: usize = 50;
        const CONVERGED: f64 = 1e-13;
        let target = known.measured.value;
        let failed = Unpredictable::NoSpeed { column: known.observable.column(), value: target };
        let mut speed = target;
        for _ in 0..MAX_STEPS {
            let p = self.predict_at(state, model, coefficients, speed, Some(known.observable))?;
            let row = self.rows.len();
            let (value, slope) = (p.values[row], p.by_inputs[(row, 1)]);
            let step = (target - value) / slope;
            if !step.is_finite() {
                return Err(failed);
            }
            if step.abs() > CONVERGED * speed {
                speed = (speed + step).max(0.1 * speed);
                continue;
            }
            let mut p = p;
            let by_speed = p.by_inputs.column(1) / slope;
            let (row_p, row_i) = (p.by_parameters.row(row).into_owned(), p.by_inputs.row(row).into_owned());
            p.by_parameters -= by_speed * row_p;
            p.by_inputs -= by_speed * row_i;
            p.by_inputs.set_column(1, &by_speed);
            return Ok(p);
        }
        Err(failed)
    }

    /// At a given speed; `extra` is one more observable behind the rows.
    fn predict_at(
        &self,
        state: &State,
        model: &Model,
        coefficients: &Coefficients,
        speed: f64,
        extra: Option<Observable>,
    ) -> Result<Prediction, Unpredictable> {
        let collision = self.collision(model);
        let model = &collision.model;
        let start = Start::new(state, speed, model.ball.radius);
        let (outcome, jacobian, by_others) = collision.collide_with_all(&start.cue, coefficients)?;
        let mut by_inputs = SMatrix::zeros();
        add_product(&mut by_inputs, 1.0, &jacobian.fixed_columns::<5>(3).into_owned(), &start.by_inputs);
        // where the contact gives way the outcome has no kink where sticking sets in
        let regime = if model.is_compliant() { Regime::Slide } else { outcome.regime };
        let mut prediction = Prediction {
            values: SVector::zeros(),
            by_parameters: SMatrix::zeros(),
            by_inputs: SMatrix::zeros(),
            speed,
            contact: start.contact(model.ball.radius, regime),
        };
        let asked = self.rows.iter().map(|row| row.observable).chain(extra);
        for (row, observable) in asked.enumerate() {
            let view = View { outcome: &outcome, start: &start, model };
            let seen = view.observe(observable);
            prediction.values[row] = seen.value;
            prediction.by_inputs.set_row(row, &seen.by_input.transpose());
            for (k, by_outcome) in seen.by_outcome.iter().enumerate().filter(|(_, by)| **by != 0.0) {
                for column in 0..Parameter::COEFFICIENTS.len() {
                    prediction.by_parameters[(row, column)] += by_outcome * jacobian[(k, column)];
                }
                if let Some(by_others) = &by_others {
                    for (other, by) in by_others.row(k).iter().enumerate() {
                        let column = Parameter::COEFFICIENTS.len() + other;
                        prediction.by_parameters[(row, column)] += by_outcome * by;
                    }
                }
                for column in 0..INPUTS {
                    prediction.by_inputs[(row, column)] += by_outcome * by_inputs[(k, column)];
                }
            }
        }
        Ok(prediction)
    }
}

impl Plan {
    /// The cue ball's spin before the impact at a speed (m/s): forward spin over that of natural roll,
    /// and Rω_z/U.
    pub(crate) fn spin_ratios(&self, speed: f64, radius: f64) -> [f64; 2] {
        let BallState { velocity, spin } = Start::new(&self.state, speed, radius).cue;
        let forward = spin.y * velocity.x - spin.x * velocity.y;
        [radius * forward / velocity.norm_squared(), radius * spin.z / velocity.norm()]
    }
}
