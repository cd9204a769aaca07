//! Collisions that a file lists: `caromfit collide --cases`.

use std::path::Path;

use super::DatasetError;
use super::error::Log;
use super::table::{Column, Table};
use crate::measurement::fault::FINITE;
use crate::physics::ball::{BallState, Vec3};
use crate::physics::collision::{Coefficients, Model, NotACollision, Outcome};
use crate::physics::contact_frame;

/// One collision to compute, in the units of the file.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Case {
    pub(crate) name: String,
    /// The cue ball's speed, m/s.
    pub(crate) speed: f64,
    /// The cut angle in degrees, between −90 and 90: positive if the cue ball moves towards +y.
    pub(crate) cut_deg: f64,
    /// The cue ball's spin in the collision frame, rad/s.
    pub(crate) spin: Vec3,
    pub(crate) coefficients: Coefficients,
    /// The radius of the balls, m.
    pub(crate) radius: f64,
    /// The tangential compliance κ; `None`: as the command states.
    pub(crate) kappa: Option<f64>,
    /// The cue ball's mass over the object ball's; `None`: as the command states.
    pub(crate) mass_ratio: Option<f64>,
}

/// The columns of numbers that a file of cases must have, and those that it may have.
const NUMBERS: &str = "speed_m_s cut_deg omega_x omega_y omega_z mu mu_s e radius_m";
const OPTIONAL: [&str; 2] = ["kappa", "mass_ratio"];

impl Case {
    /// Returns the cue ball before the impact, and the coefficients; `Err` if one is out of range.
    pub(crate) fn before(&self) -> Result<(BallState, Coefficients), NotACollision> {
        let Self { speed, cut_deg, spin, coefficients, .. } = *self;
        let checked = |is_good: bool, name: &'static str, value: f64, expected: &'static str| {
            if is_good { Ok(()) } else { Err(NotACollision::OutOfRange { name, value, expected }) }
        };
        checked(speed > 0.0 && speed.is_finite(), "speed_m_s", speed, "more than 0")?;
        checked(cut_deg.abs() < 90.0, "cut_deg", cut_deg, "degrees, more than -90 and less than 90")?;
        let cue = BallState { velocity: contact_frame::cue_velocity(speed, cut_deg.to_radians()), spin };
        Ok((cue, coefficients))
    }

    /// Computes it with the model that `model` returns. An integration that fails is an outcome.
    pub(crate) fn compute(
        self,
        line: usize,
        model: impl Fn(&Self) -> Result<Model, NotACollision>,
    ) -> Result<Computed, NotACollision> {
        let (cue, coefficients) = self.before()?;
        let model = model(&self)?;
        match model.collide(&cue, &coefficients) {
            Err(error) if !matches!(error, NotACollision::NotIntegrated { .. }) => Err(error),
            outcome => Ok(Computed { case: self, line, model, outcome }),
        }
    }
}

/// A case of a file and its outcome.
#[derive(Clone, Debug)]
pub(crate) struct Computed {
    pub(crate) case: Case,
    pub(crate) line: usize,
    pub(crate) model: Model,
    /// The outcome; [`NotACollision::NotIntegrated`] if the integration did not reach the end.
    pub(crate) outcome: Result<Outcome, NotACollision>,
}

/// Reads a CSV with the columns of [`Case`] and computes every row with the model that `model`
/// returns for it. Reports every cell that is not a number and every row that is not a collision.
pub(crate) fn collide_all(
    path: &Path,
    model: impl Fn(&Case) -> Result<Model, NotACollision>,
) -> Result<Vec<Computed>, DatasetError> {
    let (log, what) = (Log::default(), format!("the cases {} cannot be computed:", path.display()));
    let columns: Vec<Column> = NUMBERS.split(' ').chain(OPTIONAL).map(|name| (name, 1.0, FINITE)).collect();
    let Some(table) = Table::read(path, &log) else { return Err(log.into_error(what)) };
    let table = table.with("name", &columns, &format!("name {NUMBERS}"), "");
    let mut collided = Vec::new();
    for row in table.rows() {
        let at = |column| table.at(column, row).map(|number| number.value);
        let cells: Vec<f64> = NUMBERS.split(' ').filter_map(at).collect();
        let [speed, cut_deg, x, y, z, mu, mu_s, e, radius] = cells[..] else { continue };
        let name = table.text("name", row).unwrap_or_default();
        let [kappa, mass_ratio] = OPTIONAL.map(at);
        let (spin, coefficients) = (Vec3::new(x, y, z), Coefficients { mu, mu_s, e });
        let case =
            Case { name: name.to_owned(), speed, cut_deg, spin, coefficients, radius, kappa, mass_ratio };
        match case.compute(table.line(row), &model) {
            Ok(computed) => collided.push(computed),
            Err(error) => {
                let column = match error {
                    NotACollision::OutOfRange { name, .. } => Some(name).filter(|name| table.has(name)),
                    NotACollision::MuSOutOfRange(..) => Some("mu_s"),
                    _ => None,
                };
                table.wrong(row, column, format!("\"{name}\" is not a collision: {error}"));
            }
        }
    }
    log.into_result(collided, what)
}
