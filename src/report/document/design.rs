//! design.json: a design for programs.

use serde::{Serialize, Serializer};

use super::{Body, Made, document};
use crate::design::information::{IN_UNITS, Information};
use crate::design::{self, Design, Expected, Mixture, OfKind, Planned, PlayedKind, SpinFrom};
use crate::measurement::parameter::Parameter;
use crate::problem::Id;
use crate::simulate::{self, ClothSpec};

document! {
    /// design.json of caromfit, which caromfit design --json prints
    ///
    /// What shots of each kind would determine before they are played. null stands for what is not determined. Keys may be added; none
    /// is renamed or dropped.
    DesignDocument(design: &Design) {
        /// What made it.
        #[serde(flatten)]
        made: Made = Made::default(),
        /// What is expected, dimensionless.
        expected: Coefficients<f64> = {
            let expected = design.expected.coefficients;
            [expected.mu, expected.mu_s, expected.e].into()
        },
        /// The cue ball, and the object ball unless that is stated to differ.
        ball: Body = Body::of_balls(&design.expected.ball, design.expected.object.as_ref(), 0),
        /// The object ball if it is stated to differ.
        #[serde(skip_serializing_if = "Option::is_none")]
        object: Option<Body> = {
            design.expected.object.as_ref().map(|object| Body::of_balls(&design.expected.ball, Some(object), 1))
        },
        /// The cloth, all dimensionless.
        cloth: ClothSpec = design.expected.cloth,
        /// The camera.
        camera: Camera = Camera::new(&design.expected.camera),
        /// Standard errors that are wanted.
        wanted: Coefficients<Option<f64>> = design.expected.wanted.into(),
        /// The kinds of shots.
        kinds: Vec<Kind> = {
            let kinds = design.expected.kinds.iter().zip(&design.kinds);
            kinds.map(|(kind, found)| Kind::new(&design.expected, kind, found)).collect()
        },
        /// Small ranges of speed and cut angle, one by one.
        cells: Vec<Cell> = design.cells.iter().map(|cell| Cell::new(&design.expected, cell)).collect(),
        /// All planned shots.
        together: Together = Together::new(design),
        /// Mixtures with the fewest shots that reach what is wanted.
        fewest_shots: Vec<FewestShots> = {
            design.mixtures.iter().map(|mixture| FewestShots::new(design, mixture)).collect()
        },
        /// The design in sentences.
        in_words: Vec<String> = design.words.clone(),
        /// What was assumed, in sentences.
        notes: Vec<String> = design.notes.clone(),
    }

    /// The camera.
    Camera(camera: &simulate::Camera) {
        /// Frames per second.
        fps: f64 = camera.fps,
        /// Standard deviation of a coordinate, mm.
        position_sd_mm: f64 = 1e3 * camera.position_sd_m,
        /// Filmed before the impact, ms.
        before_ms: f64 = camera.before_ms,
        /// Filmed after the impact, ms.
        after_ms: f64 = camera.after_ms,
    }

    /// A kind of shots.
    Kind(expected: &Expected, kind: &PlayedKind, found: &OfKind) {
        /// Its name.
        name: String = kind.name.clone(),
        /// Range of the topspin, in parts of natural roll; draw is negative.
        topspin: [f64; 2] = kind.topspin,
        /// Side spin, in parts of natural roll; with positive cuts negative is outside spin.
        side: f64 = kind.side,
        /// How the spin is known: known, motion or markers.
        spin_from: &'static str = match kind.from {
            SpinFrom::Known => "known",
            SpinFrom::Motion => "motion",
            SpinFrom::Markers { .. } => "markers",
        },
        /// Of markers: standard errors of the cue ball's and the object ball's spin, rad/s.
        spin_sd_rad_s: Option<[f64; 2]> = match kind.from {
            SpinFrom::Markers { sd } => sd,
            _ => None,
        },
        /// Range of the speed before the impact, m/s.
        speed_m_s: [f64; 2] = kind.speed_m_s,
        /// Range of the cut angle, degrees.
        cut_deg: [f64; 2] = kind.cut_deg,
        /// Number of shots that are planned.
        shots: usize = kind.shots,
        /// Standard errors from these shots alone.
        std_error: Coefficients<Option<f64>> = found.std_errors.into(),
        /// Number of shots that the wanted standard errors need.
        shots_needed: Coefficients<Option<u64>> = found.needed.into(),
        /// Number of shots that all of them need.
        shots_needed_for_all: Option<u64> = found.needed_all,
        /// Part by which one more shot reduces the standard error.
        gain_of_one_more: Coefficients<Option<f64>> = found.gain.into(),
        /// Part of the shots that determine nothing, 0 to 1.
        unusable: f64 = found.unusable,
        /// Fisher information of one shot, by mu, mu_s, e, mu_k, mu_r, row by row, and by those ratios of the balls that are stated
        /// with an error, which is their unit.
        information_of_one: Vec<Vec<f64>> = information(expected, &found.information),
    }

    /// Shots of a kind.
    CountedShots(expected: &Expected, kind: usize, cell: Option<&design::Cell>, count: u64) {
        /// Name of the kind.
        kind: String = expected.kinds[kind].name.clone(),
        /// Of cells: speed, m/s.
        #[serde(skip_serializing_if = "Option::is_none")]
        speed_m_s: Option<f64> = cell.map(|cell| cell.speed_m_s),
        /// Of cells: cut angle, degrees.
        #[serde(skip_serializing_if = "Option::is_none")]
        cut_deg: Option<f64> = cell.map(|cell| cell.cut_deg),
        /// Number of shots.
        shots: u64 = count,
    }

    /// A small range of speed and cut angle of a kind.
    Cell(expected: &Expected, cell: &design::Cell) {
        /// The kind, speed and cut angle, and the number of shots.
        #[serde(flatten)]
        shots: CountedShots = {
            CountedShots::new(expected, cell.kind, Some(cell), expected.kinds[cell.kind].shots as u64)
        },
        /// Standard errors if all shots of the kind were like this.
        std_error: Coefficients<Option<f64>> = cell.std_errors.into(),
        /// Fisher information of one shot, as that of the kinds.
        information_of_one: Vec<Vec<f64>> = information(expected, &cell.information),
    }

    /// All planned shots together.
    Together(design: &Design) {
        /// Number of shots.
        shots: usize = design.planned.shots,
        /// Their standard errors.
        std_error: PlannedErrors = PlannedErrors::new(&design.planned),
        /// Difference between two cloths or pairs of balls, each filmed so, that is found in 80 of 100 cases.
        detectable_difference: Coefficients<Option<f64>> = detectable(design).into(),
    }

    /// Standard errors of all planned shots.
    PlannedErrors(planned: &Planned) {
        /// Of the coefficients.
        #[serde(flatten)]
        coefficients: Coefficients<Option<f64>> = planned.std_errors.into(),
        /// Of m_cue/m_object, unless the masses are exact.
        #[serde(skip_serializing_if = "Option::is_none")]
        mass_ratio: Option<f64> = planned.ratios[0],
        /// Of R_cue/R_object if the radii are stated with errors.
        #[serde(skip_serializing_if = "Option::is_none")]
        radius_ratio: Option<f64> = planned.ratios[1],
    }

    /// A mixture of shots.
    FewestShots(design: &Design, mixture: &Mixture) {
        /// The parameter, or all.
        r#for: &'static str = mixture.parameter.map_or("all", Parameter::name),
        /// What is mixed: kinds or cells.
        of: &'static str = if mixture.of_cells { "cells" } else { "kinds" },
        /// Number of shots.
        total: u64 = mixture.total(),
        /// Number of shots of each.
        shots: Vec<CountedShots> = {
            let counted = |(index, shots): &(usize, u64)| {
                let cell = mixture.of_cells.then(|| &design.cells[*index]);
                CountedShots::new(&design.expected, cell.map_or(*index, |cell| cell.kind), cell, *shots)
            };
            mixture.shots.iter().map(counted).collect()
        },
        /// Standard errors of the mixture.
        std_error: Coefficients<Option<f64>> = mixture.std_errors.into(),
    }
}

/// As design.json.
impl Serialize for Design {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        DesignDocument::new(self).serialize(serializer)
    }
}

/// A number for each coefficient.
#[derive(Clone, Copy, Debug, Serialize, schemars::JsonSchema)]
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

/// Returns the differences between two such data sets that are found in 80 of 100 cases.
pub(in crate::report) fn detectable(design: &Design) -> [Option<f64>; 3] {
    design.planned.std_errors.map(|error| error.map(|error| design::detectable() * error))
}

/// Returns the rows of the Fisher information of one shot.
fn information(expected: &Expected, information: &Information) -> Vec<Vec<f64>> {
    let ratios = [Id::MassRatio, Id::RadiusRatio].into_iter().zip(expected.ratio_sds());
    let ratios = ratios.filter(|(_, sd)| *sd > 0.0).map(|(id, _)| id);
    let ids: Vec<Id> = IN_UNITS.into_iter().map(|(id, _)| id).chain(ratios).collect();
    let element = |row: Id, column: Id| information[(row as usize, column as usize)];
    ids.iter().map(|row| ids.iter().map(|column| element(*row, *column)).collect()).collect()
}
