//! The SPEC.toml of a design.

use std::path::Path;
use std::str::FromStr;

use schemars::JsonSchema;
use serde::Deserialize;

use super::{Expected, PlayedKind, SpinFrom};
use crate::io::DatasetError;
use crate::io::balls::{self, BallSection};
use crate::io::toml_file::{self, Source};
use crate::measurement::fault::{FRACTION, Fault, INERTIA, POSITIVE};
use crate::measurement::parameter::Parameter;
use crate::physics::cloth_motion::Cloth;
use crate::physics::collision::Coefficients;
use crate::simulate::{Camera, faults_of_shots};

/// Number of frames on either side of the impact that an extraction needs.
const LEAST_FRAMES: usize = 3;

#[derive(Default, Deserialize, JsonSchema)]
#[serde(default)]
struct Keys {
    expected: CoefficientsSection,
    ball: BallSection,
    object: Option<BallSection>,
    cloth: Cloth,
    camera: Camera,
    want: CoefficientsSection,
    kind: Vec<PlayedKind>,
}

#[derive(Default, Deserialize, JsonSchema)]
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
        toml_file::checked(path, None, format!("{} cannot be used:", path.display()), Keys::checked)
    }
}

/// The text of a SPEC.toml.
impl FromStr for Expected {
    type Err = DatasetError;

    fn from_str(text: &str) -> Result<Self, DatasetError> {
        let what = "the design cannot be used:";
        toml_file::checked(Path::new("SPEC.toml"), Some(text), what, Keys::checked)
    }
}

impl Keys {
    /// Returns the design; adds what is wrong beyond its schema to the problems of its file.
    fn checked(self, source: &Source) -> Expected {
        let Self { expected, ball, object, cloth, camera, want, kind } = self;
        let default = Expected::default();
        let Coefficients { mu, mu_s, e } = default.coefficients;
        let cue = ball.cue(object.as_ref());
        let wanted = [want.mu, want.mu_s, want.e];
        let expected = Expected {
            coefficients: Coefficients {
                mu: expected.mu.unwrap_or(mu),
                mu_s: expected.mu_s.unwrap_or(mu_s),
                e: expected.e.unwrap_or(e),
            },
            ball: cue,
            object: object.map(|object| object.object(&ball, cue)),
            cloth,
            camera,
            kinds: if kind.is_empty() { default.kinds } else { kind },
            wanted: if wanted == [None; 3] { default.wanted } else { wanted },
        };
        source.add(&expected.faults());
        expected
    }
}

impl Expected {
    fn faults(&self) -> Vec<Fault> {
        let Self { coefficients, ball, camera, kinds, wanted, .. } = self;
        let object = self.object.map_or(*ball, |object| object.ball);
        let mut faults = balls::faults(*ball, object, INERTIA);
        faults.extend(camera.faults(LEAST_FRAMES));
        faults.extend(Fault::of_number("camera.position_sd_m", camera.position_sd_m, POSITIVE));
        let values = [coefficients.mu, coefficients.mu_s, coefficients.e];
        for (parameter, value) in Parameter::COEFFICIENTS.into_iter().zip(values) {
            let name = parameter.name();
            let wanted = wanted[parameter as usize].unwrap_or(1.0);
            faults.extend(Fault::of_number(&format!("expected.{name}"), value, FRACTION));
            faults.extend(Fault::of_number(&format!("want.{name}"), wanted, POSITIVE));
        }
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
            let sds = kind.spin_sd_rad_s.into_iter().flatten();
            faults.extend(sds.filter_map(|sd| Fault::of_number(&key("spin_sd_rad_s"), sd, POSITIVE)));
            faults.extend(faults_of_shots(&section, kind.speed_m_s, kind.cut_deg));
        }
        faults
    }
}
