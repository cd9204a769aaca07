//! design.json: a design for programs.

use super::{Body, ByName, Made, document, each};
use crate::design::{self, Design, Mixture, OfKind, PlayedKind};
use crate::measurement::parameter::Parameter;

document! {
    /// design.json of caromfit, which caromfit design --json prints
    ///
    /// Errors that shots of each kind would have, before they are played. null stands for an
    /// undetermined one.
    DesignDocument(design: &Design) [made: Made] {
        /// The expected value of each coefficient, dimensionless.
        expected: ByName<f64> = {
            let expected = design.expected.coefficients;
            by_name([expected.mu, expected.mu_s, expected.e])
        },
        /// The cue ball, and the object ball unless that is stated to differ.
        ball: Body = Body::of_balls(&design.expected.ball, design.expected.object.as_ref(), 0),
        /// The object ball if it is stated to differ.
        #[serde(skip_serializing_if = "Option::is_none")]
        object: Option<Body> = {
            design.expected.object.as_ref().map(|object| Body::of_balls(&design.expected.ball, Some(object), 1))
        },
        /// Standard errors that are wanted.
        wanted: ByName<Option<f64>> = by_name(design.expected.wanted),
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
        /// Assumptions, in sentences.
        notes: Vec<String> = design.notes.clone(),
    }

    /// A kind of shots.
    Kind(kind: &PlayedKind, found: &OfKind) {
        /// The kind as it is planned.
        #[serde(flatten)]
        planned: PlayedKind = kind.clone(),
        /// Standard errors of the coefficients from these shots alone.
        std_error: ByName<Option<f64>> = by_name(found.std_errors),
        /// Number of shots that the wanted standard errors need.
        shots_needed: ByName<Option<u64>> = by_name(found.needed),
    }

    /// All planned shots together.
    Together(design: &Design) {
        /// Number of shots.
        shots: usize = design.planned.shots,
        /// Their standard errors, with those of the ratios of masses and radii that are uncertain.
        std_error: ByName<Option<f64>> = {
            let ratios = [Parameter::MassRatio, Parameter::RadiusRatio].into_iter().zip(design.planned.ratios);
            let ratios = ratios.filter(|(_, error)| error.is_some());
            by_name(design.planned.std_errors).into_iter().chain(ratios.map(|(p, error)| (p.name().to_owned(), error))).collect()
        },
        /// Difference between two cloths or pairs of balls, each filmed so, that is found in 80 of
        /// 100 cases.
        detectable_difference: ByName<Option<f64>> = {
            by_name(design.planned.std_errors.map(|error| error.map(|error| design::detectable() * error)))
        },
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
        std_error: ByName<Option<f64>> = by_name(mixture.std_errors),
    }

    /// Shots of a kind.
    CountedShots(of: &PlayedKind, count: u64) {
        /// Name of the kind.
        kind: String = of.name.clone(),
        /// Number of shots.
        shots: u64 = count,
    }
}

/// Returns a number for each of μ, μ_s and e, by its name.
fn by_name<T>(values: [T; 3]) -> ByName<T> {
    Parameter::COEFFICIENTS.map(|parameter| parameter.name().to_owned()).into_iter().zip(values).collect()
}
