//! design.json: a design for programs.

use schemars::JsonSchema;
use serde::{Serialize, Serializer};

use super::{Body, Made};
use crate::design::information::{IN_UNITS, Information};
use crate::design::{self, Design, Expected, Mixture, OfKind, PlayedKind, SpinFrom};
use crate::measurement::parameter::Parameter;
use crate::problem::Id;
use crate::simulate::ClothSpec;

/// design.json of caromfit, which caromfit design --json prints
///
/// What shots of each kind would determine before they are played. null stands for what is not determined. Keys may be added; none
/// is renamed or dropped.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct DesignDocument {
    /// What made it.
    #[serde(flatten)]
    pub made: Made,
    /// What is expected, dimensionless.
    pub expected: Coefficients<f64>,
    /// The cue ball, and the object ball unless that is stated to differ.
    pub ball: Body,
    /// The object ball if it is stated to differ.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub object: Option<Body>,
    /// The cloth, all dimensionless.
    pub cloth: ClothSpec,
    /// The camera.
    pub camera: Camera,
    /// Standard errors that are wanted.
    pub wanted: Coefficients<Option<f64>>,
    /// The kinds of shots.
    pub kinds: Vec<Kind>,
    /// Small ranges of speed and cut angle, one by one.
    pub cells: Vec<Cell>,
    /// All planned shots.
    pub together: Together,
    /// Mixtures with the fewest shots that reach what is wanted.
    pub fewest_shots: Vec<FewestShots>,
    /// The design in sentences.
    pub in_words: Vec<String>,
    /// What was assumed, in sentences.
    pub notes: Vec<String>,
}

/// A number for each coefficient.
#[derive(Clone, Copy, Debug, Serialize, JsonSchema)]
pub struct Coefficients<T> {
    /// Of the friction between the balls.
    pub mu: T,
    /// Of the friction of the cloth on the object ball.
    pub mu_s: T,
    /// Of the restitution.
    pub e: T,
}

impl<T> From<[T; 3]> for Coefficients<T> {
    fn from([mu, mu_s, e]: [T; 3]) -> Self {
        Self { mu, mu_s, e }
    }
}

/// The camera.
#[derive(Clone, Copy, Debug, Serialize, JsonSchema)]
pub struct Camera {
    /// Frames per second.
    pub fps: f64,
    /// Standard deviation of a coordinate, mm.
    pub position_sd_mm: f64,
    /// Filmed before the impact, ms.
    pub before_ms: f64,
    /// Filmed after the impact, ms.
    pub after_ms: f64,
}

/// A kind of shots.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct Kind {
    /// Its name.
    pub name: String,
    /// Range of the topspin, in parts of natural roll; draw is negative.
    pub topspin: [f64; 2],
    /// Side spin, in parts of natural roll; with positive cuts negative is outside spin.
    pub side: f64,
    /// How the spin is known: known, motion or markers.
    pub spin_from: &'static str,
    /// Of markers: standard errors of the cue ball's and the object ball's spin, rad/s.
    pub spin_sd_rad_s: Option<[f64; 2]>,
    /// Range of the speed before the impact, m/s.
    pub speed_m_s: [f64; 2],
    /// Range of the cut angle, degrees.
    pub cut_deg: [f64; 2],
    /// Number of shots that are planned.
    pub shots: usize,
    /// Standard errors from these shots alone.
    pub std_error: Coefficients<Option<f64>>,
    /// Number of shots that the wanted standard errors need.
    pub shots_needed: Coefficients<Option<u64>>,
    /// Number of shots that all of them need.
    pub shots_needed_for_all: Option<u64>,
    /// Part by which one more shot reduces the standard error.
    pub gain_of_one_more: Coefficients<Option<f64>>,
    /// Part of the shots that determine nothing, 0 to 1.
    pub unusable: f64,
    /// Fisher information of one shot, by mu, mu_s, e, mu_k, mu_r, row by row, and by those ratios of the balls that are stated
    /// with an error, which is their unit.
    pub information_of_one: Vec<Vec<f64>>,
}

/// Shots of a kind.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct CountedShots {
    /// Name of the kind.
    pub kind: String,
    /// Of cells: speed, m/s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub speed_m_s: Option<f64>,
    /// Of cells: cut angle, degrees.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cut_deg: Option<f64>,
    /// Number of shots.
    pub shots: u64,
}

/// A small range of speed and cut angle of a kind.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct Cell {
    /// The kind, speed and cut angle, and the number of shots.
    #[serde(flatten)]
    pub shots: CountedShots,
    /// Standard errors if all shots of the kind were like this.
    pub std_error: Coefficients<Option<f64>>,
    /// Fisher information of one shot, as that of the kinds.
    pub information_of_one: Vec<Vec<f64>>,
}

/// All planned shots together.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct Together {
    /// Number of shots.
    pub shots: usize,
    /// Their standard errors.
    pub std_error: PlannedErrors,
    /// Difference between two cloths or pairs of balls, each filmed so, that is found in 80 of 100 cases.
    pub detectable_difference: Coefficients<Option<f64>>,
}

/// Standard errors of all planned shots.
#[derive(Clone, Copy, Debug, Serialize, JsonSchema)]
pub struct PlannedErrors {
    /// Of the coefficients.
    #[serde(flatten)]
    pub coefficients: Coefficients<Option<f64>>,
    /// Of m_cue/m_object, unless the masses are exact.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mass_ratio: Option<f64>,
    /// Of R_cue/R_object if the radii are stated with errors.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub radius_ratio: Option<f64>,
}

/// A mixture of shots.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct FewestShots {
    /// The parameter, or all.
    pub r#for: &'static str,
    /// What is mixed: kinds or cells.
    pub of: &'static str,
    /// Number of shots.
    pub total: u64,
    /// Number of shots of each.
    pub shots: Vec<CountedShots>,
    /// Standard errors of the mixture.
    pub std_error: Coefficients<Option<f64>>,
}

/// As design.json.
impl Serialize for Design {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        DesignDocument::from(self).serialize(serializer)
    }
}

impl From<&Design> for DesignDocument {
    fn from(design: &Design) -> Self {
        let expected = &design.expected;
        let coefficients = &expected.coefficients;
        let camera = &expected.camera;
        Self {
            made: Made::default(),
            expected: [coefficients.mu, coefficients.mu_s, coefficients.e].into(),
            ball: Body::new(&expected.ball, expected.object.as_ref(), 0),
            object: expected.object.as_ref().map(|object| Body::new(&object.ball, Some(object), 1)),
            cloth: expected.cloth,
            camera: Camera {
                fps: camera.fps,
                position_sd_mm: 1e3 * camera.position_sd_m,
                before_ms: camera.before_ms,
                after_ms: camera.after_ms,
            },
            wanted: expected.wanted.into(),
            kinds: expected
                .kinds
                .iter()
                .zip(&design.kinds)
                .map(|(kind, found)| of_kind(expected, kind, found))
                .collect(),
            cells: design.cells.iter().map(|cell| of_cell(expected, cell)).collect(),
            together: together(design),
            fewest_shots: design.mixtures.iter().map(|mixture| fewest(design, mixture)).collect(),
            in_words: design.words.clone(),
            notes: design.notes.clone(),
        }
    }
}

fn of_kind(expected: &Expected, kind: &PlayedKind, found: &OfKind) -> Kind {
    let (spin_from, spin_sd_rad_s) = match kind.from {
        SpinFrom::Known => ("known", None),
        SpinFrom::Motion => ("motion", None),
        SpinFrom::Markers { sd } => ("markers", sd),
    };
    Kind {
        name: kind.name.clone(),
        topspin: kind.topspin,
        side: kind.side,
        spin_from,
        spin_sd_rad_s,
        speed_m_s: kind.speed_m_s,
        cut_deg: kind.cut_deg,
        shots: kind.shots,
        std_error: found.std_errors.into(),
        shots_needed: found.needed.into(),
        shots_needed_for_all: found.needed_all,
        gain_of_one_more: found.gain.into(),
        unusable: found.unusable,
        information_of_one: information(expected, &found.information),
    }
}

fn of_cell(expected: &Expected, cell: &design::Cell) -> Cell {
    Cell {
        shots: shots_of_cell(expected, cell, expected.kinds[cell.kind].shots as u64),
        std_error: cell.std_errors.into(),
        information_of_one: information(expected, &cell.information),
    }
}

fn shots_of_cell(expected: &Expected, cell: &design::Cell, shots: u64) -> CountedShots {
    CountedShots {
        kind: expected.kinds[cell.kind].name.clone(),
        speed_m_s: Some(cell.speed_m_s),
        cut_deg: Some(cell.cut_deg),
        shots,
    }
}

fn together(design: &Design) -> Together {
    let [mass_ratio, radius_ratio] = design.planned.ratios;
    Together {
        shots: design.planned.shots,
        std_error: PlannedErrors { coefficients: design.planned.std_errors.into(), mass_ratio, radius_ratio },
        detectable_difference: detectable(design).into(),
    }
}

/// Returns the differences between two such data sets that are found in 80 of 100 cases.
pub(in crate::report) fn detectable(design: &Design) -> [Option<f64>; 3] {
    design.planned.std_errors.map(|error| error.map(|error| design::detectable() * error))
}

fn fewest(design: &Design, mixture: &Mixture) -> FewestShots {
    let expected = &design.expected;
    let counted = |(index, shots): &(usize, u64)| {
        if mixture.of_cells {
            return shots_of_cell(expected, &design.cells[*index], *shots);
        }
        CountedShots {
            kind: expected.kinds[*index].name.clone(),
            speed_m_s: None,
            cut_deg: None,
            shots: *shots,
        }
    };
    FewestShots {
        r#for: mixture.parameter.map_or("all", Parameter::name),
        of: if mixture.of_cells { "cells" } else { "kinds" },
        total: mixture.total(),
        shots: mixture.shots.iter().map(counted).collect(),
        std_error: mixture.std_errors.into(),
    }
}

/// Returns the rows of the Fisher information of one shot.
fn information(expected: &Expected, information: &Information) -> Vec<Vec<f64>> {
    let ratios = [Id::MassRatio, Id::RadiusRatio].into_iter().zip(expected.ratio_sds());
    let ratios = ratios.filter(|(_, sd)| *sd > 0.0).map(|(id, _)| id);
    let ids: Vec<Id> = IN_UNITS.into_iter().map(|(id, _)| id).chain(ratios).collect();
    let element = |row: Id, column: Id| information[(row as usize, column as usize)];
    ids.iter().map(|row| ids.iter().map(|column| element(*row, *column)).collect()).collect()
}
