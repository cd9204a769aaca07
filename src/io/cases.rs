//! Collisions that a file lists: `caromfit collide --cases`.

use std::path::Path;

use super::DatasetError;
use super::error::Problems;
use super::table::Table;
use crate::physics::ball::{BallState, Vec3};
use crate::physics::collision::{Coefficients, Fidelity, Model, NotACollision, Outcome};
use crate::physics::contact_frame;

/// One collision to compute, in the units of the file.
#[derive(Clone, Debug, PartialEq)]
pub struct Case {
    /// The name of the case.
    pub name: String,
    /// The cue ball's speed, m/s.
    pub speed: f64,
    /// The cut angle in degrees, between −90 and 90: positive if the cue ball moves towards +y.
    pub cut_deg: f64,
    /// The cue ball's spin in the collision frame, rad/s.
    pub spin: Vec3,
    /// Friction between the balls μ, dimensionless.
    pub mu: f64,
    /// Friction of the cloth on the object ball μ_s, dimensionless.
    pub mu_s: f64,
    /// Coefficient of restitution e, dimensionless.
    pub e: f64,
    /// The radius of the balls, m.
    pub radius: f64,
    /// The tangential compliance κ, dimensionless; `None`: as the command states.
    pub kappa: Option<f64>,
    /// The cue ball's mass over the object ball's; `None`: as the command states.
    pub mass_ratio: Option<f64>,
}

/// Reason for which a case cannot be computed.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum BadCase {
    /// The speed, given here in m/s, is not positive and finite.
    #[error("the speed is {0} m/s; expected more than 0")]
    Speed(f64),
    /// The cut angle, given here in degrees, is not between −90° and 90°.
    #[error("the cut angle is {0}°; expected more than −90° and less than 90°")]
    Cut(f64),
    /// The ratio of the masses is not positive and finite.
    #[error("mass_ratio is {0}; expected more than 0")]
    MassRatio(f64),
    /// A tangential compliance κ is stated for a fidelity whose contact is rigid.
    #[error(
        "kappa is {0} with {name}, which is rigid along the surface; expected the fidelity ode, contact or auto",
        name = .1.name()
    )]
    Rigid(f64, Fidelity),
    /// The numbers describe no collision.
    #[error(transparent)]
    NotACollision(#[from] NotACollision),
}

/// The columns of numbers that a file of cases must have, and those that it may have.
const NUMBERS: [&str; 9] =
    ["speed_m_s", "cut_deg", "omega_x", "omega_y", "omega_z", "mu", "mu_s", "e", "radius_m"];
const OPTIONAL: [&str; 2] = ["kappa", "mass_ratio"];

impl BadCase {
    /// Returns the column of the wrong value, if it is a single one.
    fn column(&self) -> Option<&'static str> {
        match self {
            Self::Speed(_) => Some("speed_m_s"),
            Self::Cut(_) => Some("cut_deg"),
            Self::MassRatio(_) => Some("mass_ratio"),
            Self::Rigid(..) => Some("kappa"),
            Self::NotACollision(error) => match error {
                NotACollision::OutOfRange { name, .. } => {
                    NUMBERS.into_iter().chain(OPTIONAL).find(|column| column == name)
                }
                NotACollision::MuSOutOfRange(..) => Some("mu_s"),
                _ => None,
            },
        }
    }
}

impl Case {
    /// Computes the case with a model that has its radius, κ and ratio of masses.
    ///
    /// # Errors
    /// Those of [`Case::before`] and of [`Model::collide`].
    pub fn collide(&self, model: &Model) -> Result<Outcome, BadCase> {
        let (cue, coefficients) = self.before()?;
        Ok(model.collide(&cue, &coefficients)?)
    }

    /// Returns the cue ball before the impact, and the coefficients.
    ///
    /// # Errors
    /// A speed that is not positive, a cut angle of 90° or more.
    pub fn before(&self) -> Result<(BallState, Coefficients), BadCase> {
        if !(self.speed > 0.0 && self.speed.is_finite()) {
            return Err(BadCase::Speed(self.speed));
        }
        if self.cut_deg.is_nan() || self.cut_deg.abs() >= 90.0 {
            return Err(BadCase::Cut(self.cut_deg));
        }
        let cue = BallState {
            velocity: contact_frame::cue_velocity(self.speed, self.cut_deg.to_radians()),
            spin: self.spin,
        };
        let coefficients = Coefficients { mu: self.mu, mu_s: self.mu_s, e: self.e };
        Ok((cue, coefficients))
    }
}

/// A case of a file and its outcome.
#[derive(Clone, Debug)]
pub struct Computed {
    /// The case as it stands in the file.
    pub case: Case,
    /// Its line in the file, from 1.
    pub line: usize,
    /// The model that computed it.
    pub model: Model,
    /// The outcome; [`NotACollision::NotIntegrated`] if the integration did not reach the end.
    pub outcome: Result<Outcome, NotACollision>,
}

/// Reads a CSV with the columns name, speed_m_s, cut_deg, omega_x, omega_y, omega_z, mu, mu_s, e,
/// radius_m, and optionally kappa and mass_ratio, and computes every row with the model that
/// `model` returns for it, also if the integration of other rows fails.
///
/// # Errors
/// Every cell that is not a number and every row that is not a collision, with its line.
pub fn collide_all(
    path: &Path,
    model: impl Fn(&Case) -> Result<Model, BadCase>,
) -> Result<Vec<Computed>, DatasetError> {
    let problems = Problems::new(format!("the cases {} cannot be computed:", path.display()));
    let Some(table) = Table::read(path, &problems) else { return Err(problems.into_error()) };
    let needed: Vec<_> = ["name"].into_iter().chain(NUMBERS).collect();
    let known: Vec<_> = needed.iter().copied().chain(OPTIONAL).collect();
    for column in &needed {
        table.require(column, &known);
    }
    let columns = NUMBERS.map(|column| table.numbers(column).unwrap_or_default());
    let optional = OPTIONAL.map(|column| table.numbers(column).unwrap_or_default());
    let mut collided = Vec::with_capacity(table.rows());
    for row in 0..table.rows() {
        let cells: Option<Vec<f64>> = columns.iter().map(|column| *column.get(row)?).collect();
        let cells = cells.unwrap_or_default();
        let [speed, cut_deg, x, y, z, mu, mu_s, e, radius] = cells[..] else { continue };
        let name = table.text("name", row).unwrap_or_default().to_string();
        let [kappa, mass_ratio] = optional.each_ref().map(|column| column.get(row).copied().flatten());
        let spin = Vec3::new(x, y, z);
        let case = Case { name, speed, cut_deg, spin, mu, mu_s, e, radius, kappa, mass_ratio };
        let computed = model(&case).and_then(|model| match case.collide(&model) {
            Ok(outcome) => Ok((model, Ok(outcome))),
            Err(BadCase::NotACollision(why @ NotACollision::NotIntegrated { .. })) => Ok((model, Err(why))),
            Err(error) => Err(error),
        });
        match computed {
            Ok((model, outcome)) => collided.push(Computed { case, line: table.line(row), model, outcome }),
            Err(error) => {
                let message = format!("\"{}\" is not a collision: {error}", case.name);
                table.wrong(row, error.column(), message);
            }
        }
    }
    problems.into_result(collided)
}
