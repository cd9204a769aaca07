//! The JSON that `compare`, `design`, `check`, `extract`, `synth`, `collide` and `accuracy` print
//! with `--json`.

use std::path::Path;

use super::{Body, ByName, Made, document, each, named};
use crate::compare::{Compared, Comparison, Robust, SampleSummary};
use crate::design::{ByCoefficient, Design, FewestShots, Kind, Together, by_coefficient};
use crate::fit::{Computed, Counted, Rejected, Verdict, check};
use crate::io::cases;
use crate::measurement::dataset::Dataset;
use crate::physics::ball::BallState;
use crate::physics::collision::{Coefficients, Fidelity, Outcome, effects};
use crate::report::{ascii, compare as words};
use crate::simulate::Spec;
use crate::studies::accuracy::Row;
use crate::studies::bias;

document! {
    /// compare.json of caromfit
    ///
    /// A comparison of data sets. Numbers are SI and radians except where a unit stands beside
    /// them; null stands for what is not known.
    CompareDocument(comparison: &Comparison) [made: Made, of Comparison] {
        /// Whether the numbers can be used.
        verdict: Verdict = words::verdict(comparison),
        /// Collision model.
        fidelity: &'static str = comparison.fidelity.map_or("auto", Fidelity::name),
        /// joint: all frames of films of balls at once; direct: the numbers of tables.
        #[schemars(extend("enum" = ["joint", "direct"]))]
        method: &'static str = if words::counted(comparison) == Counted::Coordinates { "joint" } else { "direct" },
        /// How many shots were computed at which fidelity.
        computed: Vec<Computed> = Computed::of(&comparison.solution, comparison.fidelity),
        /// Shots that count less under a robust loss.
        robust: Option<Robust> = comparison.robust.clone(),
        /// Notes, in sentences.
        notes: Vec<String> = each(&comparison.notes(), |note| (*note).to_owned()),
        /// The distinction of the labels: cloth, data set, or a column.
        told_by: String = comparison.told_by.clone(),
        /// The compared quantities.
        labels: Vec<String> = comparison.labels.clone(),
        /// Warnings, in sentences, the most important first.
        warnings: Vec<String> = each(&comparison.warnings(), |warning| (*warning).to_owned()),
        /// The data sets or labels, with their shots.
        samples: Vec<SampleSummary> = comparison.samples.clone(),
        /// The parameters.
        parameters: Vec<Compared> = comparison.quantities.clone(),
        /// The numbers that chi2 and dof count: angles (and speeds), velocities, coordinates of
        /// frames, or impulses of discs.
        counted: Counted = words::counted(comparison),
        /// Sum of the squared standardized residuals, priors included.
        #[schemars(with = "Option<f64>")]
        chi2: f64 = comparison.chi2(),
        /// Degrees of freedom.
        dof: usize = comparison.solution.dof(),
        /// Whether the noise was estimated from the residuals.
        noise_estimated: bool = comparison.noise_estimated,
        /// Whether the search ended at a minimum.
        converged: bool = comparison.solution.converged,
        /// Why the search ended.
        termination: &'static str = words::termination(comparison),
    }

    /// design.json of caromfit, which caromfit design --json prints
    ///
    /// Errors that shots of each kind would have, before they are played. null stands for an
    /// undetermined one.
    DesignDocument(design: &Design) [made: Made, of Design] {
        /// The expected value of each coefficient, dimensionless.
        expected: ByCoefficient<f64> = {
            let Coefficients { mu, mu_s, e } = design.expected.coefficients;
            by_coefficient([mu, mu_s, e])
        },
        /// The cue ball, and the object ball unless that is stated to differ.
        ball: Body = Body::of_balls(&design.expected.ball, design.expected.object.as_ref(), 0),
        /// The object ball if it is stated to differ.
        #[serde(skip_serializing_if = "Option::is_none")]
        object: Option<Body> = {
            design.expected.object.as_ref().map(|object| Body::of_balls(&design.expected.ball, Some(object), 1))
        },
        /// Standard errors that are wanted.
        wanted: ByCoefficient<Option<f64>> = by_coefficient(design.expected.wanted),
        /// The kinds of shots.
        kinds: Vec<Kind> = design.kinds.clone(),
        /// All planned shots.
        together: Together = design.together.clone(),
        /// Mixtures with the fewest shots that reach what is wanted.
        fewest_shots: Vec<FewestShots> = design.mixtures.clone(),
        /// The design in sentences.
        in_words: Vec<String> = design.words.clone(),
        /// Assumptions, in sentences.
        notes: Vec<String> = design.notes.clone(),
    }

    /// An element of the list that caromfit check --json prints
    ///
    /// The findings about one data set: caromfit check --json prints an array of these.
    CheckDocument(checked: &Dataset, found: &[check::Finding]) [made: Made] {
        /// Name of the data set.
        dataset: String = checked.name.clone(),
        /// Number of shots that can be used.
        shots: usize = checked.count_usable(),
        /// Detections, repairs and assumptions, in sentences.
        notes: Vec<String> = {
            let is_other = |note: &&String| found.iter().all(|finding| finding.text != **note);
            checked.notes().filter(is_other).cloned().collect()
        },
        /// Shots that cannot be used.
        left_out: Vec<Rejected> = left_out(checked),
        /// Suspicions and notes.
        findings: Vec<check::Finding> = found.to_vec(),
    }

    /// An element of the list that caromfit extract --json prints
    ///
    /// The impacts of one data set: caromfit extract --json prints an array of these.
    ExtractDocument(extracted: &Dataset, place: &Path, count: usize, lines: Vec<String>) [made: Made] {
        /// Name of the data set.
        dataset: String = extracted.name.clone(),
        /// The folder of its files.
        folder: String = place.display().to_string(),
        /// Number of shots that were extracted.
        shots: usize = count,
        /// Notes, in sentences.
        notes: Vec<String> = lines,
        /// Shots that cannot be used.
        left_out: Vec<Rejected> = left_out(extracted),
    }

    /// The object that caromfit synth --json prints
    ///
    /// A synthetic data set. null stands for what is not known.
    SynthDocument(spec: &Spec, by: Fidelity, place: &Path, written: Vec<String>) [made: Made] {
        /// Its name.
        dataset: String = spec.name.clone(),
        /// The measurements of each shot: tracks, impacts or angles.
        kind: &'static str = spec.kind.name(),
        /// The folder of the files.
        folder: String = place.display().to_string(),
        /// Names of the files that were written, in the folder.
        files: Vec<String> = written,
        /// Number of shots.
        shots: usize = spec.shots.count,
        /// Seed of the random numbers.
        seed: u64 = spec.seed,
        /// The fidelity by which the collisions were computed.
        fidelity: Fidelity = by,
        /// The true values, by parameter.
        parameters: ByName<Truth> = named(&spec.truths(), |(p, truth)| (p.name(), Truth::new(*truth, ascii(p.unit())))),
    }

    /// The true value of a parameter.
    Truth(value: f64, of: &'static str) {
        /// The value that the data were made with, in its unit.
        truth: f64 = value,
        /// Its unit: 1 for a ratio, or s/m.
        unit: &'static str = of,
    }

    /// The object that caromfit collide --json prints
    ///
    /// One collision; with --cases, caromfit collide --json prints an array of these. The frame is
    /// that of the collision: x from the cue ball to the object ball, y 90° counter-clockwise from
    /// it seen from above, z upwards.
    CollideDocument(computed: &cases::Computed, explained: Option<[effects::Estimate; 10]>) [made: Made] {
        /// Name of the case.
        name: String = computed.case.name.clone(),
        /// Collision model: elastic, inelastic, linear, full, ode or contact.
        fidelity: Fidelity = computed.model.fidelity,
        /// The outcome; left out without a collision.
        #[serde(flatten)]
        outcome: Option<CollideOutcome> = computed.outcome.as_ref().ok().map(CollideOutcome::new),
        /// Every effect, with --explain.
        #[serde(skip_serializing_if = "Option::is_none")]
        effects: Option<Vec<effects::Estimate>> = explained.map(Vec::from),
        /// The reason why it is not a collision, instead of all numbers.
        #[serde(skip_serializing_if = "Option::is_none")]
        error: Option<String> = computed.outcome.as_ref().err().map(ToString::to_string),
    }

    /// The outcome of a collision.
    CollideOutcome(outcome: &Outcome) {
        /// Whether the contact slips or sticks at its end: slide or stick.
        regime: &'static str = outcome.regime.name(),
        /// Normal impulse over the mass of the cue ball, m/s.
        impulse: f64 = outcome.impulse,
        /// Velocity (m/s) and spin (rad/s) of the cue ball after the impact, each x, y and z.
        cue: ByName<[f64; 3]> = motion(&outcome.cue),
        /// Those of the object ball.
        object: ByName<[f64; 3]> = motion(&outcome.object),
    }

    /// The object that caromfit accuracy --json prints
    ///
    /// Errors against time of every fidelity, and the bias of fits. null stands for what is not
    /// known.
    AccuracyDocument(rows: &[Row], found: &[bias::Row], computed: usize, unusable: usize) [made: Made] {
        /// Number of shots that were computed.
        shots: usize = computed,
        /// Number of shots of the data set that could not be used.
        left_out: usize = unusable,
        /// Ways to compute a collision.
        ways: Vec<Row> = rows.to_vec(),
        /// Fits to the shots without noise, computed by contact with all effects.
        biases: Vec<bias::Row> = found.to_vec(),
    }
}

fn motion(state: &BallState) -> ByName<[f64; 3]> {
    named(&[("velocity", state.velocity), ("spin", state.spin)], |(name, vector)| (name, (*vector).into()))
}

fn left_out(dataset: &Dataset) -> Vec<Rejected> {
    each(&dataset.left_out, |(shot, reason)| Rejected { shot: shot.clone(), reason: reason.clone() })
}
