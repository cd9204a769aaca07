//! A shot of a table: its measured numbers and their errors.

use std::sync::Arc;

use nalgebra::{DMatrix, DVector};

use crate::measurement::dataset::{Before, Dataset, Measured, Measurement, Shot};
use crate::measurement::number::count_of;
use crate::measurement::observable::{Axis, Observable};
use crate::measurement::spin::Spin;
use crate::physics::collision::NotACollision;
use crate::problem::film::impact::Correction;
use crate::problem::film::own::MOVING;
use crate::problem::sums::OwnPrior;
use crate::problem::unknowns::Id;

/// Number of inputs of a shot, whose errors are its first own unknowns; the others are held. Of a
/// measured impact they are the direction of the line of centres (rad), v_x, v_y, ω_x, ω_y and ω_z
/// in the table frame; of angles cut angle and speed, one that is not used, and ω_x, ω_y and ω_z in
/// the collision frame.
pub(super) const INPUTS: usize = 6;

/// Place of the speed of a shot of angles, or of a speed afterwards from which it follows.
pub(super) const SPEED: usize = 1;

/// Speeds afterwards that determine an unknown speed before, the best first.
const SPEEDS: [Observable; 4] = [
    Observable::ObjectSpeed,
    Observable::ObjectSpeedRolling,
    Observable::CueSpeed,
    Observable::CueSpeedRolling,
];

/// A number before or after the impact.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Row {
    /// The number, with the error 0 if it is exact. Before the impact only the unit of its observable
    /// counts.
    pub(crate) number: Measurement,
    /// Index of its noise among those of the block; `None` if its error is stated, or no number after
    /// the impact has the unit of one before it.
    pub(crate) noise: Option<usize>,
}

/// A shot of a table. Its own unknowns are the errors of its inputs, SI and radians.
#[derive(Clone, Debug)]
pub(crate) struct RowShot {
    /// Whether it is of angles, in the collision frame.
    pub(super) is_cut: bool,
    /// Numbers before the impact, in the order of the own unknowns.
    pub(super) inputs: [Row; INPUTS],
    /// Whether the speed before the impact is measured or follows from a speed afterwards.
    pub(crate) knows_speed: bool,
    /// The speed afterwards from which an unknown one before follows.
    pub(super) speed_after: Option<Observable>,
    /// Radius of the cue ball, m.
    pub(super) radius: f64,
    /// Moment of inertia of the balls over MR².
    pub(super) inertia: f64,
    /// Spin that follows from the velocity, as a part of the spin of natural roll.
    pub(super) roll: f64,
    /// Sign of the measured cut angle, from which angles are counted.
    pub(super) side: f64,
    pub(crate) rows: Vec<Row>,
    /// The correction of the outcome by a finer model of the impact; `None`: there is none.
    pub(crate) offset: Option<Arc<Correction>>,
}

impl RowShot {
    /// Returns a shot whose unstated errors all have the noise of index 0. `needs_speed`:
    /// friction or restitution depends on the speed.
    pub fn new(shot: &Shot, dataset: &Dataset, needs_speed: bool) -> Result<Self, Unpredictable> {
        let mut rows = shot.after.clone();
        let is_cut = matches!(shot.before, Before::Angle { .. });
        let is_measured = !matches!(shot.before, Before::Angle { speed: None, .. });
        let speed = if is_measured { None } else { take_speed(shot, &mut rows, needs_speed)? };
        let inputs = read_inputs(shot, speed.map(|speed| speed.measured))?;
        let row = |number: Measurement| Row { number, noise: number.measured.sd.is_none().then_some(0) };
        let [first, x, y, ..] = inputs.map(|input| input.number.measured.value);
        let cut = if is_cut { first } else { y.atan2(x) - first };
        Ok(Self {
            is_cut,
            inputs,
            knows_speed: is_measured || speed.is_some(),
            speed_after: speed.map(|speed| speed.observable),
            radius: dataset.ball.radius,
            inertia: dataset.ball.inertia,
            roll: if shot.spin == Spin::NaturalRoll { 1.0 } else { 0.0 },
            side: if cut.sin() < 0.0 { -1.0 } else { 1.0 },
            rows: rows.into_iter().map(row).collect(),
            offset: None,
        })
    }

    /// Returns what is known of each own unknown, with its place; those that count as numbers with
    /// a noise are not among them.
    pub(crate) fn priors(&self) -> impl Iterator<Item = (usize, OwnPrior)> {
        let prior = |place: usize| {
            let sd = self.inputs.get(place).and_then(|input| input.number.measured.sd);
            (place, sd.filter(|sd| *sd > 0.0).map_or(OwnPrior::Held, OwnPrior::Stated))
        };
        let is_number = |place: &usize| self.inputs.get(*place).is_some_and(|input| input.noise.is_some());
        (0..MOVING).filter(move |place| !is_number(place)).map(prior)
    }

    /// Returns the index of the noise of each number, then of each input that counts as a number.
    pub(super) fn noises(&self) -> impl Iterator<Item = Option<usize>> {
        let inputs = self.inputs.iter().filter(|input| input.noise.is_some());
        self.rows.iter().chain(inputs).map(|row| row.noise)
    }
}

/// Takes the best speed afterwards, which determines an unknown speed before the impact, from the
/// numbers of a shot; `None` if no number depends on the speed.
fn take_speed(
    shot: &Shot,
    rows: &mut Vec<Measurement>,
    needs_speed: bool,
) -> Result<Option<Measurement>, Unpredictable> {
    let place = SPEEDS.iter().find_map(|speed| rows.iter().position(|row| row.observable == *speed));
    let spins = matches!(shot.spin, Spin::Measured { spin, .. } if spin.norm() > 0.0);
    match (place, spins, needs_speed) {
        (Some(place), ..) if rows.len() == 1 => {
            Err(Unpredictable::NothingLeft(rows[place].observable.column()))
        }
        (Some(place), ..) => Ok(Some(rows.remove(place))),
        (None, true, _) => Err(Unpredictable::SpinWithoutSpeed),
        (None, _, true) => Err(Unpredictable::FallsWithoutSpeed),
        _ => Ok(None),
    }
}

/// Returns the inputs of a shot.
fn read_inputs(shot: &Shot, speed_after: Option<Measured>) -> Result<[Row; INPUTS], Unpredictable> {
    let input = |observable, measured| Row { number: Measurement { observable, measured }, noise: None };
    let angle = |measured| input(Observable::Throw, measured);
    let speed = |measured| input(Observable::CueSpeed, measured);
    let turning = |measured| input(Observable::CueSpin(Axis::X), measured);
    let exact = |value| speed(Measured::new(value, 0.0));
    let [first, second, third] = match shot.before {
        Before::Impact { normal: [x, y], velocity } => {
            // a unit vector errs across itself: dα² = dn_x² + dn_y²
            let sd = x.sd.or(y.sd).map(|_| x.sd.unwrap_or(0.0).hypot(y.sd.unwrap_or(0.0)));
            let [v_x, v_y] = velocity.map(speed);
            [angle(Measured { value: y.value.atan2(x.value), sd }), v_x, v_y]
        }
        Before::Angle { cut, speed: before } => {
            let before = before.or(speed_after).map_or(exact(1.0), speed);
            [angle(cut), before, exact(0.0)]
        }
    };
    let [w_x, w_y, w_z] = match shot.spin {
        Spin::Unknown => return Err(Unpredictable::UnknownSpin),
        Spin::Measured { spin, sd } => {
            [0, 1, 2].map(|axis| turning(Measured { value: spin[axis], sd: sd[axis] }))
        }
        Spin::Stun | Spin::NaturalRoll => [exact(0.0); 3],
    };
    Ok([first, second, third, w_x, w_y, w_z])
}

/// Numbers of one shot less their prediction from its measured inputs.
pub(crate) struct Deviations {
    pub(crate) observables: Vec<Observable>,
    /// Measured numbers, SI and radians.
    pub(crate) measured: Vec<f64>,
    /// Measured less predicted.
    pub(crate) values: DVector<f64>,
    /// Covariance of `values`, errors of the inputs included.
    pub(crate) covariance: DMatrix<f64>,
    /// Derivatives of the prediction by the unknowns, of a table those that move the balls, in the
    /// order of [`Id`].
    pub(crate) by: DMatrix<f64>,
    /// Direction of the line of centres: cosine and sine.
    pub(crate) normal: [f64; 2],
    /// Cut angle, rad.
    pub(crate) cut: f64,
    /// Speed of the cue ball before the impact, m/s; `None` if it is not known.
    pub(crate) speed: Option<f64>,
    /// Topspin and side spin of the cue ball before the impact over those of natural roll; NaN if
    /// not known.
    pub(crate) spins: [f64; 2],
}

/// Why a table cannot be fitted.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum RowsError {
    /// No shot can be fitted.
    #[error("no shot can be used{}", .left_out.first().map_or(String::new(), |(shot, why)| format!(": shot {shot}: {why}")))]
    NoShot {
        /// Names of the shots, and reasons.
        left_out: Vec<(String, String)>,
    },
    /// There are fewer numbers than free unknowns.
    #[error(
        "{} for the free parameters {}; expected at least as many observations as parameters: add shots, or fix parameters under [fit]",
        count_of(*.numbers, "observation"),
        .unknowns.iter().map(|id| id.name()).collect::<Vec<_>>().join(", ")
    )]
    TooFewNumbers {
        /// Number of observations and priors.
        numbers: usize,
        /// The free unknowns.
        unknowns: Vec<Id>,
    },
    /// Some numbers of a column have a standard deviation and others do not.
    #[error("{column} has a standard deviation in {with}, but none in {without}; give all or none")]
    MixedNoise {
        /// The column.
        column: &'static str,
        /// Place and name of the first shot with one.
        with: String,
        /// Place and name of the first shot without.
        without: String,
    },
    /// κ is stated, and the fidelity is of a rigid contact.
    #[error(
        "kappa stands in [fit], but with the fidelity {0} a contact is rigid along its surface; expected the fidelity auto, ode or \
         contact with it"
    )]
    Rigid(&'static str),
    /// No start of the search describes a collision.
    #[error(
        "no collision is like these shots, so that no search can begin: check the radius, the units and which ball is which"
    )]
    NoStart,
}

/// Reason why a shot cannot be fitted.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Unpredictable {
    /// The state before the impact is not a collision.
    #[error(transparent)]
    NotACollision(#[from] NotACollision),
    /// The spin is unknown.
    #[error("its spin is unknown; give spin columns, or cue_spin stun or natural-roll")]
    UnknownSpin,
    /// The spin is stated in rad/s and no speed is.
    #[error("its spin is given in rad/s but no speed is: give speed_m_s or a speed after the impact")]
    SpinWithoutSpeed,
    /// Friction or restitution depends on the speed, which is not known.
    #[error(
        "the friction or e depends on the speed, but the shot has none: give speed_m_s or a speed after the \
         impact"
    )]
    FallsWithoutSpeed,
    /// The only observable determines the speed before the impact.
    #[error("its only observable, {0}, serves to find the incoming speed: no number is left to fit")]
    NothingLeft(&'static str),
}
