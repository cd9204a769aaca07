//! What `check`, `extract`, `synth` and `collide` print with `--json`.

use schemars::JsonSchema;
use serde::Serialize;

use super::{ByName, Made};
use crate::fit::{Rejected, check};
use crate::io::cases::Computed;
use crate::measurement::dataset::Dataset;
use crate::measurement::written::ByParameter;
use crate::physics::ball::BallState;
use crate::physics::collision::{Fidelity, effects};
use crate::report::unit_of;
use crate::simulate::Spec;

/// What caromfit check --json prints, an element
///
/// The findings about one data set: caromfit check --json prints an array of these. Keys may be added; none is renamed or dropped.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct CheckDocument {
    /// What made it.
    #[serde(flatten)]
    pub made: Made,
    /// Name of the data set.
    pub dataset: String,
    /// Number of shots that can be used.
    pub shots: usize,
    /// What was detected in the files and repaired, and what was assumed, in sentences.
    pub notes: Vec<String>,
    /// Shots that cannot be used.
    pub left_out: Vec<Rejected>,
    /// What is suspicious or good to know.
    pub findings: Vec<check::Finding>,
}

impl CheckDocument {
    /// Returns what was found of a data set.
    #[must_use]
    pub fn new(dataset: &Dataset, findings: &[check::Finding]) -> Self {
        Self {
            made: Made::default(),
            dataset: dataset.name.clone(),
            shots: dataset.count_usable(),
            notes: dataset.notes().cloned().collect(),
            left_out: left_out(dataset),
            findings: findings.to_vec(),
        }
    }
}

/// Returns the shots of a data set that were left out.
fn left_out(dataset: &Dataset) -> Vec<Rejected> {
    let reason = |(shot, reason): &(String, String)| Rejected { shot: shot.clone(), reason: reason.clone() };
    dataset.left_out.iter().map(reason).collect()
}

/// What caromfit extract --json prints, an element
///
/// The impacts of one data set: caromfit extract --json prints an array of these. Keys may be added; none is renamed or dropped.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct ExtractDocument {
    /// What made it.
    #[serde(flatten)]
    pub made: Made,
    /// Name of the data set.
    pub dataset: String,
    /// Where its files are.
    pub folder: String,
    /// Number of shots that were extracted.
    pub shots: usize,
    /// What there is to say, in sentences.
    pub notes: Vec<String>,
    /// Shots that cannot be used.
    pub left_out: Vec<Rejected>,
}

impl ExtractDocument {
    /// Returns what was extracted of a data set into a folder.
    #[must_use]
    pub fn new(dataset: &Dataset, folder: &std::path::Path, shots: usize, notes: Vec<String>) -> Self {
        Self {
            made: Made::default(),
            dataset: dataset.name.clone(),
            folder: folder.display().to_string(),
            shots,
            notes,
            left_out: left_out(dataset),
        }
    }
}

/// What caromfit synth --json prints
///
/// A synthetic data set. Keys may be added; none is renamed or dropped. null stands for what is not known.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct SynthDocument {
    /// What made it.
    #[serde(flatten)]
    pub made: Made,
    /// Its name.
    pub dataset: String,
    /// What is measured of each shot: tracks, impacts or angles.
    pub kind: &'static str,
    /// Where the files are.
    pub folder: String,
    /// Names of the files that were written, in the folder.
    pub files: Vec<String>,
    /// Number of shots.
    pub shots: usize,
    /// Seed of the random numbers.
    pub seed: u64,
    /// The fidelity by which the collisions were computed.
    pub fidelity: Fidelity,
    /// What the shots were made with, by parameter.
    #[schemars(with = "ByParameter<Truth>")]
    pub parameters: ByName<Truth>,
}

/// The true value of a parameter.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct Truth {
    /// The value that the data were made with, in its unit.
    pub truth: f64,
    /// Its unit: 1 for a ratio, or s/m.
    pub unit: &'static str,
}

impl SynthDocument {
    /// Returns what was made by a specification.
    #[must_use]
    pub fn new(spec: &Spec, fidelity: Fidelity, folder: &std::path::Path, files: Vec<String>) -> Self {
        let truths = spec.truths().into_iter().map(|(parameter, truth)| {
            (parameter.name().to_owned(), Truth { truth, unit: unit_of(parameter) })
        });
        Self {
            made: Made::default(),
            dataset: spec.name.clone(),
            kind: spec.kind.name(),
            folder: folder.display().to_string(),
            files,
            shots: spec.shots.count,
            seed: spec.seed,
            fidelity,
            parameters: truths.collect(),
        }
    }
}

/// What caromfit collide --json prints
///
/// One collision; with --cases, caromfit collide --json prints an array of these. The frame is that of the collision: x from the
/// cue ball to the object ball, y 90° counter-clockwise from it seen from above, z upwards. Keys may be added; none is renamed or
/// dropped.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct CollideDocument {
    /// What made it.
    #[serde(flatten)]
    pub made: Made,
    /// Name of the case.
    pub name: String,
    /// Collision model: elastic, inelastic, linear, full, ode or contact.
    pub fidelity: Fidelity,
    /// The outcome; left out if there is none.
    #[serde(flatten)]
    pub outcome: Option<CollideOutcome>,
    /// With --explain: every effect.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub effects: Option<Vec<effects::Estimate>>,
    /// With --explain: what the motion afterwards needs.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub motion: Option<Vec<effects::Estimate>>,
    /// Why it is no collision, instead of all numbers.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub error: Option<String>,
}

/// The outcome of a collision.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct CollideOutcome {
    /// Whether the contact slips or sticks at its end: slide or stick.
    pub regime: &'static str,
    /// Normal impulse over the mass of the cue ball, m/s.
    pub impulse: f64,
    /// The cue ball after the impact.
    pub cue: Motion,
    /// The object ball after the impact.
    pub object: Motion,
}

/// The motion of a ball.
#[derive(Clone, Copy, Debug, Serialize, JsonSchema)]
pub struct Motion {
    /// Velocity x, y and z, m/s.
    pub velocity: [f64; 3],
    /// Angular velocity x, y and z, rad/s.
    pub spin: [f64; 3],
}

impl From<&BallState> for Motion {
    fn from(state: &BallState) -> Self {
        Self { velocity: state.velocity.into(), spin: state.spin.into() }
    }
}

impl CollideDocument {
    /// Returns what was computed of a case, with all effects and those of the motion afterwards if they are explained.
    #[must_use]
    pub fn new(computed: &Computed, explained: Option<(&[effects::Estimate], &[effects::Estimate])>) -> Self {
        let outcome = computed.outcome.as_ref().map(|outcome| CollideOutcome {
            regime: outcome.regime.name(),
            impulse: outcome.impulse,
            cue: Motion::from(&outcome.cue),
            object: Motion::from(&outcome.object),
        });
        Self {
            made: Made::default(),
            name: computed.case.name.clone(),
            fidelity: computed.model.fidelity,
            error: outcome.as_ref().err().map(ToString::to_string),
            outcome: outcome.ok(),
            effects: explained.map(|(effects, _)| effects.to_vec()),
            motion: explained.map(|(_, motion)| motion.to_vec()),
        }
    }
}
