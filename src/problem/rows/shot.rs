//! A shot of a table: its measured numbers, their errors, and the prediction.

use nalgebra::{DMatrix, DVector};
use num_dual::DualNum;

use super::view::View;
use crate::measurement::dataset::{Before, Dataset, Joint, Measured, Measurement, Shared as Common, Shot};
use crate::measurement::observable::Observable;
use crate::measurement::spin::Spin;
use crate::numerics::wrap;
use crate::physics::collision::NotACollision;
use crate::problem::film::dual::{Dual, DualVector, Gradient, constant, gradient, norm};
use crate::problem::film::impact::{Contact, Correction, Side};
use crate::problem::sums::OwnPrior;
use crate::problem::unknowns::{Id, Normal, Own, Shared};

/// Number of own unknowns: of a measured impact the errors of the direction of the line of centres
/// (rad), v_x, v_y, ω_x, ω_y and ω_z in the table frame; of angles those of cut angle and speed, one
/// that is not used, and those of ω_x, ω_y and ω_z in the collision frame.
pub(crate) const OWN: usize = Joint::BEFORE;

/// Place of the speed of a shot of angles.
const SPEED: usize = 1;

/// Variance that is left of a number given the numbers before it, as a part of its variance, below
/// which it follows from them.
const DEPENDENT: f64 = 1e-12;

/// Relative error of a speed afterwards that is stated without one and from which the speed before
/// follows: far below what any instrument reads.
const EXACT: f64 = 1e-5;

/// Speeds afterwards that determine an unknown speed before, the best first.
pub(super) const SPEEDS: [Observable; 4] = [
    Observable::ObjectSpeed,
    Observable::ObjectSpeedRolling,
    Observable::CueSpeed,
    Observable::CueSpeedRolling,
];

/// Reason why a shot cannot be fitted.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Unpredictable {
    /// The state before the impact is no collision.
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
    #[error("its only observable, {0}, serves to find the incoming speed: nothing is left to fit")]
    NothingLeft(&'static str),
    /// A covariance is not positive definite.
    #[error("its covariance is not positive definite")]
    NoWeights,
}

/// A number after the impact.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Row {
    pub observable: Observable,
    pub value: f64,
    /// Index of its noise among those of the block; `None` if its error is stated.
    pub noise: Option<usize>,
}

/// How the inputs and rows of a shot move with an unknown that all shots share.
#[derive(Clone, Debug)]
struct SharedShift {
    id: Id,
    mean: f64,
    by: DVector<f64>,
}

/// A shot of a table.
#[derive(Clone, Debug)]
pub(crate) struct RowShot {
    /// Whether it is of angles, in the collision frame.
    is_cut: bool,
    /// Measured inputs, in the order of the own unknowns.
    inputs: [f64; OWN],
    /// Errors of inputs and rows by the own unknowns.
    factor: DMatrix<f64>,
    /// Inverse of the lower Cholesky factor of the covariance that is left to the rows.
    rest: DMatrix<f64>,
    /// Of each own unknown; `None` of an unknown speed that a speed afterwards determines.
    pub priors: [Option<OwnPrior>; OWN],
    shifts: Vec<SharedShift>,
    /// Whether the speed before the impact is measured or follows from a speed afterwards.
    pub knows_speed: bool,
    /// Radius of the cue ball, m, and its moment of inertia over MR².
    radius: f64,
    inertia: f64,
    /// Spin that follows from the velocity, as a part of that of natural roll.
    roll: f64,
    /// Sign of the measured cut angle, from which angles are counted.
    side: f64,
    pub rows: Vec<Row>,
    /// Held outcome offset.
    pub offset: Correction,
}

/// A residual in units of its error, with its derivatives.
pub(crate) struct Residual {
    pub value: f64,
    pub by: Gradient,
    pub noise: Option<usize>,
}

/// The prediction of a shot.
pub(crate) struct Predicted {
    pub residuals: Vec<Residual>,
    pub sticks: bool,
    /// Topspin about the line of centres over the closing speed: the outcome has a kink at 0.
    pub topspin: Dual,
}

impl RowShot {
    /// Returns a shot whose unstated errors all have the noise of index 0. `needs_speed`: friction or
    /// restitution depends on the speed.
    pub fn new(shot: &Shot, dataset: &Dataset, needs_speed: bool) -> Result<Self, Unpredictable> {
        let mut rows = shot.after.clone();
        let is_cut = matches!(shot.before, Before::Angle { .. });
        let determined = match shot.before {
            Before::Angle { speed: None, .. } => determine_speed(shot, &mut rows, needs_speed)?,
            _ => None,
        };
        let (inputs, sds) = read_inputs(shot, determined)?;
        let variances = sds.into_iter().chain(rows.iter().map(|row| row.measured.sd.or(Some(1.0))));
        let variances = variances.map(|sd| sd.map_or(0.0, |sd| sd * sd)).collect();
        let covariance = match &shot.joint {
            Some(joint) => joint.covariance.clone(),
            None => DMatrix::from_diagonal(&DVector::from_vec(variances)),
        };
        let (mut factor, rest) = factorise(&covariance).ok_or(Unpredictable::NoWeights)?;
        let is_exact = |place: usize| factor.column(place).amax() == 0.0;
        let prior = |exact: bool| {
            Some(if exact { OwnPrior::Held } else { OwnPrior::Stated(Normal { mean: 0.0, sd: 1.0 }) })
        };
        let mut priors = std::array::from_fn(|place| prior(is_exact(place)));
        if determined.is_some() {
            (factor[(SPEED, SPEED)], priors[SPEED]) = (inputs[SPEED], None);
        }
        let cut = if is_cut { inputs[0] } else { inputs[2].atan2(inputs[1]) - inputs[0] };
        let row = |row: &Measurement| Row {
            observable: row.observable,
            value: row.measured.value,
            noise: row.measured.sd.is_none().then_some(0),
        };
        Ok(Self {
            is_cut,
            inputs,
            factor,
            rest,
            priors,
            shifts: list_shifts(shot, dataset),
            knows_speed: determined.is_some() || !matches!(shot.before, Before::Angle { speed: None, .. }),
            radius: dataset.ball.radius,
            inertia: dataset.ball.inertia,
            roll: if shot.spin == Spin::NaturalRoll { 1.0 } else { 0.0 },
            side: if cut.sin() < 0.0 { -1.0 } else { 1.0 },
            rows: rows.iter().map(row).collect(),
            offset: Correction::zeros(),
        })
    }

    /// Returns what is known of the own unknowns, each with its place.
    pub fn own_priors(&self) -> Vec<(usize, OwnPrior)> {
        self.priors.iter().enumerate().filter_map(|(place, prior)| Some((place, (*prior)?))).collect()
    }

    /// Returns the number of own unknowns of which nothing is known.
    pub fn own_unknowns_without_prior(&self) -> usize {
        self.priors.iter().filter(|prior| prior.is_none()).count()
    }

    /// Returns whether all inputs are exact.
    pub fn is_exact(&self) -> bool {
        self.priors.iter().all(|prior| *prior == Some(OwnPrior::Held))
    }

    /// Returns the own unknowns with derivatives by those that are not held.
    fn units(&self, own: &Own) -> [Dual; OWN] {
        std::array::from_fn(|place| {
            let unit = constant(own[place]);
            if self.priors[place] == Some(OwnPrior::Held) { unit } else { unit.derivative(place) }
        })
    }

    /// Returns the cue ball before the impact in the collision frame, with what the view of the balls
    /// afterwards takes.
    pub fn approach(&self, own: &Own, shared: &Shared) -> (Side, View) {
        let mut inputs = self.inputs.map(constant);
        let units = self.units(own);
        for (i, input) in inputs.iter_mut().enumerate() {
            for j in 0..OWN {
                if self.factor[(i, j)] != 0.0 {
                    *input += units[j] * self.factor[(i, j)];
                }
            }
            for shift in &self.shifts {
                *input += (shared.dual(shift.id) - shift.mean) * shift.by[i];
            }
        }
        let [first, second, third, w_x, w_y, w_z] = inputs;
        let (sin, cos) = if self.is_cut { (constant(0.0), constant(1.0)) } else { first.sin_cos() };
        let turn = |x: Dual, y: Dual| DualVector::new(x * cos + y * sin, y * cos - x * sin);
        let velocity = if self.is_cut {
            DualVector::new(second * first.cos(), second * first.sin())
        } else {
            turn(second, third)
        };
        let radius = self.radius;
        let spin = turn(w_x, w_y) * constant(radius);
        // ω = (−U_y, U_x, 0)/R of natural roll
        let spin = [spin.x - velocity.y * self.roll, spin.y + velocity.x * self.roll, w_z * radius];
        let cue = Side { velocity, rise: constant(0.0), spin, inertia: self.inertia };
        let view = View {
            cos,
            sin,
            cut: if self.is_cut { first } else { velocity.y.atan2(velocity.x) },
            speed: if self.is_cut { second } else { norm(&velocity) },
            side: self.side,
            radii: [constant(radius), shared.dual(Id::RadiusRatio).recip() * radius],
        };
        (cue, view)
    }

    /// Returns the residuals, those of unstated errors not yet divided by their noise.
    pub fn predict(&self, own: &Own, shared: &Shared, contact: &Contact) -> Result<Predicted, NotACollision> {
        let Differences { values: differences, sticks, topspin, .. } =
            self.differences(own, shared, contact)?;
        let residual = |(i, row): (usize, &Row)| {
            let mut whitened = differences[i] * self.rest[(i, i)];
            for j in (0..i).filter(|j| self.rest[(i, *j)] != 0.0) {
                whitened += differences[j] * self.rest[(i, j)];
            }
            Residual { value: whitened.re, by: gradient(&whitened), noise: row.noise }
        };
        let residuals = self.rows.iter().enumerate().map(residual).collect();
        Ok(Predicted { residuals, sticks, topspin })
    }

    /// Returns the predicted numbers less the measured ones.
    pub(super) fn differences(
        &self,
        own: &Own,
        shared: &Shared,
        contact: &Contact,
    ) -> Result<Differences, NotACollision> {
        let (cue, view) = self.approach(own, shared);
        let (sides, sticks) = contact.collide(&cue, shared, &self.offset)?;
        let units = self.units(own);
        let difference = |(i, row): (usize, &Row)| {
            let mut difference = view.observe(row.observable, &sides) - row.value;
            if row.observable.is_angle() {
                difference += wrap(difference.re) - difference.re;
            }
            for j in 0..OWN {
                let carried = self.factor[(OWN + i, j)];
                if carried != 0.0 {
                    difference -= units[j] * carried;
                }
            }
            for shift in &self.shifts {
                difference -= (shared.dual(shift.id) - shift.mean) * shift.by[OWN + i];
            }
            difference
        };
        Ok(Differences {
            values: self.rows.iter().enumerate().map(difference).collect(),
            sticks,
            topspin: cue.spin[1] / cue.velocity.x,
            view,
            spin: cue.spin.map(|spin| spin.re),
        })
    }

    /// Returns the errors of the rows that no error before the impact causes, those of unstated errors in
    /// units of their noise: the lower Cholesky factor of their covariance.
    pub(super) fn own_errors(&self) -> Option<DMatrix<f64>> {
        self.rest.clone().try_inverse()
    }
}

/// Predicted numbers less measured ones.
pub(super) struct Differences {
    pub values: Vec<Dual>,
    pub sticks: bool,
    /// Topspin about the line of centres over the closing speed.
    pub topspin: Dual,
    pub view: View,
    /// R ω of the cue ball before the impact in the collision frame, m/s.
    pub spin: [f64; 3],
}

/// Returns the first guess of an unknown speed from the best speed afterwards, which is made exact if
/// its error is not stated; `None` if no number depends on the speed.
fn determine_speed(
    shot: &Shot,
    rows: &mut [Measurement],
    needs_speed: bool,
) -> Result<Option<f64>, Unpredictable> {
    let place = SPEEDS.iter().find_map(|speed| rows.iter().position(|row| row.observable == *speed));
    let spins = matches!(shot.spin, Spin::Measured { spin, .. } if spin.norm() > 0.0);
    let Some(place) = place else {
        return match (spins, needs_speed) {
            (true, _) => Err(Unpredictable::SpinWithoutSpeed),
            (_, true) => Err(Unpredictable::FallsWithoutSpeed),
            _ => Ok(None),
        };
    };
    if rows.len() == 1 {
        return Err(Unpredictable::NothingLeft(rows[place].observable.column()));
    }
    let measured = &mut rows[place].measured;
    measured.sd = measured.sd.or(Some(EXACT * measured.value.abs()));
    Ok(Some(measured.value))
}

/// Returns the measured inputs and their standard deviations.
fn read_inputs(
    shot: &Shot,
    determined: Option<f64>,
) -> Result<([f64; OWN], [Option<f64>; OWN]), Unpredictable> {
    let exact = Measured { value: 0.0, sd: None };
    let [first, second, third] = match shot.before {
        Before::Impact { normal: [x, y], velocity } => {
            // a unit vector errs across itself: dα² = dn_x² + dn_y²
            let sd = x.sd.unwrap_or(0.0).hypot(y.sd.unwrap_or(0.0));
            [Measured { value: y.value.atan2(x.value), sd: Some(sd) }, velocity[0], velocity[1]]
        }
        Before::Angle { cut, speed } => {
            let unknown = Measured { value: determined.unwrap_or(1.0), ..exact };
            [cut, speed.unwrap_or(unknown), exact]
        }
    };
    let [w_x, w_y, w_z] = match shot.spin {
        Spin::Unknown => return Err(Unpredictable::UnknownSpin),
        Spin::Measured { spin, sd } => [0, 1, 2].map(|axis| Measured { value: spin[axis], sd: sd[axis] }),
        Spin::Stun | Spin::NaturalRoll => [exact; 3],
    };
    let all = [first, second, third, w_x, w_y, w_z];
    Ok((all.map(|measured| measured.value), all.map(|measured| measured.sd)))
}

/// Returns the partial Cholesky factor of a covariance by its first columns, 0 where a number follows
/// from those before it, and the inverse factor of what is left to the rows.
fn factorise(covariance: &DMatrix<f64>) -> Option<(DMatrix<f64>, DMatrix<f64>)> {
    let all = covariance.nrows();
    let mut factor = DMatrix::<f64>::zeros(all, OWN);
    for column in 0..OWN {
        let variance = covariance[(column, column)];
        let left = variance - factor.row(column).norm_squared();
        if left > DEPENDENT * variance {
            for row in column..all {
                let known = factor.row(row).dot(&factor.row(column));
                factor[(row, column)] = (covariance[(row, column)] - known) / left.sqrt();
            }
        }
    }
    let count = all - OWN;
    let carried = factor.rows(OWN, count);
    let rest = covariance.view((OWN, OWN), (count, count)) - carried * carried.transpose();
    let rest = rest.cholesky()?.l().solve_lower_triangular(&DMatrix::identity(count, count))?;
    Some((factor, rest))
}

/// Returns how the numbers of a shot that was extracted from a film move with what its shots share.
fn list_shifts(shot: &Shot, dataset: &Dataset) -> Vec<SharedShift> {
    let Some(joint) = &shot.joint else { return Vec::new() };
    let shift = |(common, _): (Common, f64)| {
        let (id, mean) = shared_unknown(common, dataset)?;
        Some(SharedShift { id, mean, by: joint.by_shared.get(common.place())?.clone() })
    };
    dataset.shared_errors().into_iter().filter_map(shift).collect()
}

/// Returns the unknown that stands for an error that all extracted shots share, and its mean.
pub(super) fn shared_unknown(common: Common, dataset: &Dataset) -> Option<(Id, f64)> {
    match common {
        Common::Sliding => Some((Id::MuK, dataset.sliding?.value)),
        Common::Rolling => Some((Id::MuR, dataset.rolling?.value)),
        Common::Lift => Some((Id::Bounce, 1.0)),
    }
}
