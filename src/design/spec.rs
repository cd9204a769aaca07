//! What an experiment is expected to be like: the content of a SPEC.toml.

use std::path::Path;

use serde::Deserialize;

use super::{Expected, PlayedKind, SpinFrom};
use crate::io::DatasetError;
use crate::io::balls_section::{BallSection, Shape};
use crate::io::stated_object::StatedObject;
use crate::io::toml_file::{self, Source};
use crate::measurement::number::count_of;
use crate::measurement::parameter::Parameter;
use crate::measurement::valid::{Condition, FRACTION, POSITIVE};
use crate::simulate::{Camera, ClothSpec, MAX_FRAMES, MAX_SHOTS, faults_of_ranges};

#[derive(Deserialize)]
#[serde(deny_unknown_fields, expecting = "the keys of a design")]
struct Keys {
    #[serde(default)]
    expected: CoefficientsSection,
    #[serde(default)]
    ball: BallSection,
    object: Option<StatedObject>,
    #[serde(default)]
    cloth: ClothSpec,
    #[serde(default)]
    camera: CameraSection,
    #[serde(default)]
    want: CoefficientsSection,
    #[serde(default)]
    kind: Vec<KindSection>,
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a table, as in [expected] mu = 0.05")]
struct CoefficientsSection {
    mu: Option<f64>,
    mu_s: Option<f64>,
    e: Option<f64>,
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a table, as in [camera] fps = 1000")]
struct CameraSection {
    fps: Option<f64>,
    position_sd_mm: Option<f64>,
    position_sd_px: Option<f64>,
    mm_per_px: Option<f64>,
    before_ms: Option<f64>,
    after_ms: Option<f64>,
}

#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum Word {
    Stun,
    NaturalRoll,
    Draw,
    Slide,
}

#[derive(Clone, Copy, Deserialize, PartialEq)]
#[serde(rename_all = "kebab-case")]
enum From {
    Known,
    Motion,
    Markers,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields, expecting = "a table, as in [[kind]] name = \"thin rolls\"")]
struct KindSection {
    name: String,
    cue_spin: Option<Word>,
    topspin: Option<f64>,
    side: Option<f64>,
    spin_from: Option<From>,
    spin_sd_rad_s: Option<[f64; 2]>,
    speed_m_s: Option<[f64; 2]>,
    cut_deg: Option<[f64; 2]>,
    shots: Option<i64>,
}

impl Expected {
    /// Reads a SPEC.toml; [`Expected::default`] has the values of keys that are missing.
    ///
    /// # Errors
    /// Everything that is wrong with it, with line and position.
    pub fn read(path: &Path) -> Result<Self, DatasetError> {
        toml_file::read_checked(path, Keys::check)
    }
}

impl CoefficientsSection {
    /// Returns the values that are stated, in the order of [`Parameter::COEFFICIENTS`].
    fn check(&self, section: &str, condition: Condition, source: &Source) -> [Option<f64>; 3] {
        let given = [self.mu, self.mu_s, self.e];
        Parameter::COEFFICIENTS.map(|parameter| {
            source.number(&format!("{section}.{}", parameter.name()), given[parameter as usize], condition)
        })
    }
}

impl Keys {
    fn check(self, source: &Source) -> Expected {
        let mut expected = Expected { cloth: self.cloth, ..Expected::default() };
        let coefficients = &mut expected.coefficients;
        let [mu, mu_s, e] = self.expected.check("expected", FRACTION, source);
        coefficients.mu = mu.unwrap_or(coefficients.mu);
        coefficients.mu_s = mu_s.unwrap_or(coefficients.mu_s);
        coefficients.e = e.unwrap_or(coefficients.e);
        let ClothSpec { mu_k, mu_r, bounce } = self.cloth;
        for (key, value) in [("cloth.mu_k", mu_k), ("cloth.mu_r", mu_r), ("cloth.bounce", bounce)] {
            source.number(key, Some(value), FRACTION);
        }
        let wanted = self.want.check("want", POSITIVE, source);
        if wanted != [None; 3] {
            expected.wanted = wanted;
        }
        let mut kinds: Vec<PlayedKind> = Vec::new();
        for (place, section) in self.kind.iter().enumerate() {
            let kind = section.check(&format!("kind.{place}"), source);
            if kinds.iter().any(|known| known.name == kind.name) {
                let message = format!("a second kind named \"{}\"; expected another name", kind.name);
                source.wrong(&format!("kind.{place}.name"), message);
            }
            kinds.push(kind);
        }
        if !kinds.is_empty() {
            expected.kinds = kinds;
        }
        expected.camera = self.camera.check(source);
        if self.ball.shape == Shape::Disc {
            source.wrong("ball.shape", "shape is \"disc\"; expected balls, which designs are of");
        }
        if self.ball.poisson.is_some() {
            let message = "poisson determines how compliant a contact is; expected none, as designs are of a contact that is rigid along \
                           its surface";
            source.wrong("ball.poisson", message);
        }
        (expected.ball, _) = self.ball.check(self.object.as_ref(), source);
        expected.object = self.object.map(|object| object.ball(&self.ball, &expected.ball, source));
        expected
    }
}

impl CameraSection {
    fn check(&self, source: &Source) -> Camera {
        let default = Camera::default();
        let positive = |key: &str, given| source.number(key, given, POSITIVE);
        let fps = positive("camera.fps", self.fps).unwrap_or(default.fps);
        let mm = positive("camera.position_sd_mm", self.position_sd_mm);
        let px = positive("camera.position_sd_px", self.position_sd_px);
        let mm_per_px = positive("camera.mm_per_px", self.mm_per_px);
        let position_sd_m = match (mm, px, mm_per_px) {
            (Some(mm), None, None) => 1e-3 * mm,
            (None, Some(px), Some(mm_per_px)) => 1e-3 * px * mm_per_px,
            (None, None, None) => default.position_sd_m,
            _ => {
                let message = "the noise is stated in part or twice; expected position_sd_mm, or position_sd_px with mm_per_px";
                let keys = ["camera.position_sd_px", "camera.mm_per_px", "camera.position_sd_mm"];
                source.wrong_of_first(&keys, message);
                default.position_sd_m
            }
        };
        // an extraction needs three frames on either side of the impact
        let expected = 3..=MAX_FRAMES;
        let side = |key: &str, given: Option<f64>, default: f64| {
            let ms = positive(key, given).unwrap_or(default);
            let frames = (1e-3 * ms * fps).round() as usize;
            if ms > 0.0 && fps > 0.0 && !expected.contains(&frames) {
                let count = count_of(frames, "frame");
                let [least, most] = [expected.start(), expected.end()];
                let message =
                    format!("{key} is {ms}, which is {count} at {fps} fps; expected {least} to {most}");
                source.wrong_of_first(&[key, "camera.fps"], message);
            }
            ms
        };
        let before_ms = side("camera.before_ms", self.before_ms, default.before_ms);
        let after_ms = side("camera.after_ms", self.after_ms, default.after_ms);
        Camera { fps, position_sd_m, before_ms, after_ms, ..default }
    }
}

impl KindSection {
    /// Returns the kind of the table at `key`.
    fn check(&self, section: &str, source: &Source) -> PlayedKind {
        const SPINS: Condition = (|x| x.abs() <= 2.0, "from -2 to 2, in parts of the natural roll's");
        let key = |name: &str| format!("{section}.{name}");
        let wrong = |name: &str, message: String| source.wrong(&key(name), message);
        let name = self.name.trim().to_owned();
        if name.is_empty() {
            wrong("name", "name is empty; expected one that the tables can show".to_owned());
        }
        let topspin = source.number(&key("topspin"), self.topspin, SPINS);
        if self.cue_spin.is_some() && topspin.is_some() {
            wrong("topspin", "both cue_spin and topspin; expected one of them".to_owned());
        }
        let topspin = match (self.cue_spin, topspin) {
            (Some(Word::Stun), _) => [0.0; 2],
            (Some(Word::NaturalRoll), _) => [1.0; 2],
            (Some(Word::Draw), _) => PlayedKind::DRAW,
            (Some(Word::Slide), _) => [0.5; 2],
            (None, Some(topspin)) => [topspin; 2],
            (None, None) => {
                let message =
                    format!("kind \"{name}\" has neither cue_spin nor topspin; expected one of them");
                wrong("name", message);
                [0.0; 2]
            }
        };
        let side = source.number(&key("side"), self.side, SPINS).unwrap_or(0.0);
        let sd = self.spin_sd_rad_s;
        for (which, sd) in sd.into_iter().flatten().enumerate() {
            source.number(&key(&format!("spin_sd_rad_s.{which}")), Some(sd), POSITIVE);
        }
        let from = match (self.spin_from, PlayedKind::usual(topspin, side)) {
            (Some(From::Known), _) => SpinFrom::Known,
            (Some(From::Motion), _) => SpinFrom::Motion,
            (Some(From::Markers), _) | (None, SpinFrom::Markers { .. }) => SpinFrom::Markers { sd },
            (None, usual) => usual,
        };
        if self.spin_from == Some(From::Motion) && side != 0.0 {
            let message = "spin_from is \"motion\", which does not show side spin; expected known or markers";
            wrong("spin_from", message.to_owned());
        }
        let default = PlayedKind::default();
        let speed_m_s = self.speed_m_s.unwrap_or(default.speed_m_s);
        let cut_deg = self.cut_deg.unwrap_or(default.cut_deg);
        for fault in &faults_of_ranges(section, speed_m_s, cut_deg) {
            source.add(fault);
        }
        let shots = self.shots.map_or(Ok(default.shots), usize::try_from).unwrap_or(0);
        if !(1..=MAX_SHOTS).contains(&shots) {
            let shots = self.shots.unwrap_or_default();
            wrong("shots", format!("shots is {shots}; expected 1 to {MAX_SHOTS}"));
        }
        PlayedKind { name, topspin, side, from, speed_m_s, cut_deg, shots }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<Expected, String> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("spec.toml");
        std::fs::write(&path, text).unwrap();
        Expected::read(&path).map_err(|error| error.to_string())
    }

    /// A kind of this name and with these keys.
    fn kind(keys: &str) -> String {
        format!("[[kind]]\nname = \"a\"\n{}", keys.replace(", ", "\n"))
    }

    #[test]
    fn missing_keys_have_their_defaults() {
        let spec = read("[camera]\nposition_sd_px = 0.2\nmm_per_px = 0.5\n[want]\ne = 0.001\n").unwrap();
        assert!((spec.camera.position_sd_m - 1e-4).abs() < 1e-18);
        assert_eq!(spec.kinds.len(), Expected::default().kinds.len());
        assert_eq!(spec.wanted, [None, None, Some(0.001)]);
        let spec = read(&kind("cue_spin = \"stun\", side = 0.5")).unwrap();
        assert_eq!(spec.kinds[0].from, SpinFrom::Markers { sd: None });
    }

    #[test]
    fn everything_wrong_is_named_with_its_place() {
        let camera = |keys: &str| format!("[camera]\n{}", keys.replace(", ", "\n"));
        let motion = kind("topspin = 0, side = 1, spin_from = \"motion\"");
        let twice = kind("topspin = 0") + "\n" + &kind("topspin = 1");
        for (text, expected) in [
            (
                "[expected]\nmu = -1".to_owned(),
                ":2: column 6: expected.mu is -1; expected a number from 0 to 1",
            ),
            (camera("fps = 10, before_ms = 40"), ":3: column 13: camera.before_ms is 40, which is 0 frames"),
            (camera("position_sd_px = 1"), "expected position_sd_mm, or position_sd_px with mm_per_px"),
            (
                camera("fps = 1000, after_ms = 1e12"),
                ":3: column 12: camera.after_ms is 1000000000000, which is 1000000000000 frames",
            ),
            (camera("fsp = 1"), "unknown key \"fsp\" (did you mean \"fps\"?)"),
            ("[cloth]\nbounce = 1.5".to_owned(), "cloth.bounce is 1.5; expected a number from 0 to 1"),
            ("[want]\nmu = 0".to_owned(), "want.mu is 0; expected more than 0"),
            (kind(""), "neither cue_spin nor topspin"),
            (kind("cue_spin = \"role\""), "unknown word \"role\""),
            (kind("topspin = 3"), "topspin is 3; expected from -2 to 2"),
            (motion, "does not show side spin"),
            (
                kind("topspin = 0, speed_m_s = [2,1]"),
                "column 13: kind.speed_m_s is [2, 1]; expected [slowest, fastest]",
            ),
            (kind("topspin = 0, cut_deg = [0,90]"), "kind.cut_deg is [0, 90]; expected [least, most]"),
            (kind("topspin = 0, shots = 0"), "shots is 0; expected 1 to"),
            (twice, "a second kind named \"a\""),
        ] {
            let error = read(&text).expect_err(&text);
            assert!(error.contains(expected), "{error}\nis not {expected}");
        }
    }
}
