//! The SPEC.toml of a design.

use std::path::Path;
use std::str::FromStr;

use serde::Deserialize;

use super::{Expected, PlayedKind, SpinFrom};
use crate::io::DatasetError;
use crate::io::balls::{BallSection, Shape};
use crate::io::error::Problems;
use crate::io::toml_file::{self, Source};
use crate::measurement::fault::{Condition, FRACTION, Fault, Faults, POSITIVE};
use crate::measurement::parameter::Parameter;
use crate::physics::cloth_motion::Cloth;
use crate::physics::collision::Coefficients;
use crate::simulate::{Camera, checked, faults_of, faults_of_shots};

/// Number of frames on either side of the impact that an extraction needs.
const LEAST_FRAMES: usize = 3;

const SPINS: Condition = (|x| x.abs() <= 2.0, "from -2 to 2, in parts of the natural roll's");

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields, default, expecting = "the keys of a design")]
struct Keys {
    expected: CoefficientsSection,
    ball: BallSection,
    object: Option<BallSection>,
    cloth: Cloth,
    camera: Camera,
    want: CoefficientsSection,
    kind: Vec<PlayedKind>,
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields, default, expecting = "a table, as in [expected] mu = 0.05")]
struct CoefficientsSection {
    mu: Option<f64>,
    mu_s: Option<f64>,
    e: Option<f64>,
}

impl Expected {
    /// Reads a SPEC.toml; [`Expected::default`] has the values of keys that are missing.
    ///
    /// # Errors
    /// Everything that is wrong with it, with line and position.
    pub fn read(path: &Path) -> Result<Self, DatasetError> {
        toml_file::read_checked(path, |keys: Keys, source| checked(keys.expected(source), source))
    }
}

/// The text of a SPEC.toml.
impl FromStr for Expected {
    type Err = DatasetError;

    fn from_str(text: &str) -> Result<Self, DatasetError> {
        let problems = Problems::new("the design cannot be used:");
        let read = |keys: Keys, source: &Source| checked(keys.expected(source), source);
        toml_file::checked(Path::new("SPEC.toml"), Some(text), problems, read)
    }
}

impl Keys {
    fn expected(self, source: &Source) -> Expected {
        let Self { expected, ball, object, cloth, camera, want, kind } = self;
        if ball.shape == Shape::Disc {
            source.wrong("ball.shape", "shape is \"disc\"; expected balls, which designs are of");
        }
        if ball.poisson.is_some() {
            let message = "poisson is of a compliant contact; expected none, as that of designs is rigid";
            source.wrong("ball.poisson", message);
        }
        let default = Expected::default();
        let Coefficients { mu, mu_s, e } = default.coefficients;
        let cue = ball.cue(object.as_ref(), source);
        let wanted = [want.mu, want.mu_s, want.e];
        Expected {
            coefficients: Coefficients {
                mu: expected.mu.unwrap_or(mu),
                mu_s: expected.mu_s.unwrap_or(mu_s),
                e: expected.e.unwrap_or(e),
            },
            ball: cue,
            object: object.map(|object| object.object(&ball, cue, source)),
            cloth,
            camera,
            kinds: if kind.is_empty() { default.kinds } else { kind },
            wanted: if wanted == [None; 3] { default.wanted } else { wanted },
        }
    }
}

impl Faults for Expected {
    fn faults(&self) -> Vec<Fault> {
        let Self { coefficients, cloth, camera, kinds, wanted, .. } = self;
        let mut faults = Vec::new();
        let values = [coefficients.mu, coefficients.mu_s, coefficients.e];
        for (parameter, value) in Parameter::COEFFICIENTS.into_iter().zip(values) {
            let name = parameter.name();
            let wanted = wanted[parameter as usize].unwrap_or(1.0);
            let [expected, want] = ["expected", "want"].map(|section| format!("{section}.{name}"));
            faults.extend(faults_of(&[(&expected, value, FRACTION), (&want, wanted, POSITIVE)]));
        }
        faults.extend(cloth.faults());
        faults.extend(camera.faults(LEAST_FRAMES, POSITIVE));
        for (place, kind) in kinds.iter().enumerate() {
            let section = format!("kind.{place}");
            let key = |name: &str| format!("{section}.{name}");
            let is_repeated = kinds[..place].iter().any(|other| other.name == kind.name);
            if kind.name.is_empty() || is_repeated {
                let value = format!("\"{}\"", kind.name);
                faults.push(Fault::new(&key("name"), value, "a name that no other kind has"));
            }
            if kind.source() == SpinFrom::Motion && kind.side != 0.0 {
                let value = "\"motion\", which does not show side spin";
                faults.push(Fault::new(&key("spin_from"), value, "known or markers"));
            }
            let [cue_sd, object_sd] = kind.spin_sd_rad_s.unwrap_or([1.0; 2]);
            faults.extend(faults_of(&[
                (&key("spin_sd_rad_s.0"), cue_sd, POSITIVE),
                (&key("spin_sd_rad_s.1"), object_sd, POSITIVE),
                (&key("topspin.0"), kind.topspin[0], SPINS),
                (&key("topspin.1"), kind.topspin[1], SPINS),
                (&key("side"), kind.side, SPINS),
            ]));
            faults.extend(faults_of_shots(&section, ("shots", kind.shots), kind.speed_m_s, kind.cut_deg));
        }
        faults
    }
}
