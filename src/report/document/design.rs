//! design.json: a design for programs. Its cells, one by one, are in design.csv.

use serde::{Serialize, Serializer};

use super::{Body, Made, document, each};
use crate::design::{self, Design, Mixture, OfKind, Planned, PlayedKind};
use crate::measurement::parameter::Parameter;

document! {
    /// design.json of caromfit, which caromfit design --json prints
    ///
    /// What shots of each kind would determine before they are played. null stands for what is not determined.
    DesignDocument(design: &Design) [made: Made] {
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
        /// Standard errors that are wanted.
        wanted: Coefficients<Option<f64>> = design.expected.wanted.into(),
        /// The kinds of shots.
        kinds: Vec<Kind> = {
            let kinds = design.expected.kinds.iter().zip(&design.kinds);
            kinds.map(|(kind, found)| Kind::new(kind, found)).collect()
        },
        /// All planned shots.
        together: Together = Together::new(design),
        /// Mixtures with the fewest shots that reach what is wanted.
        fewest_shots: Vec<FewestShots> = each(&design.mixtures, |mixture| FewestShots::new(design, mixture)),
        /// The design in sentences.
        in_words: Vec<String> = design.words.clone(),
        /// What was assumed, in sentences.
        notes: Vec<String> = design.notes.clone(),
    }

    /// A kind of shots.
    Kind(kind: &PlayedKind, found: &OfKind) {
        /// The kind as it is planned.
        #[serde(flatten)]
        planned: PlayedKind = kind.clone(),
        /// Standard errors from these shots alone.
        std_error: Coefficients<Option<f64>> = found.std_errors.into(),
        /// Number of shots that the wanted standard errors need.
        shots_needed: Coefficients<Option<u64>> = found.needed.into(),
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
        /// Number of shots.
        total: u64 = mixture.total(),
        /// Number of shots of each.
        shots: Vec<CountedShots> = {
            each(&mixture.shots, |(kind, shots)| CountedShots::new(&design.expected.kinds[*kind], *shots))
        },
        /// Standard errors of the mixture.
        std_error: Coefficients<Option<f64>> = mixture.std_errors.into(),
    }

    /// Shots of a kind.
    CountedShots(of: &PlayedKind, count: u64) {
        /// Name of the kind.
        kind: String = of.name.clone(),
        /// Number of shots.
        shots: u64 = count,
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
pub(crate) struct Coefficients<T> {
    /// Of the friction between the balls.
    pub(crate) mu: T,
    /// Of the friction of the cloth on the object ball.
    pub(crate) mu_s: T,
    /// Of the restitution.
    pub(crate) e: T,
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
