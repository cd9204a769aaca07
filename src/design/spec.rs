//! What an experiment is expected to be like: the content of a SPEC.toml.

use std::path::Path;

use serde::Deserialize;
use toml::Spanned;

use super::{Expected, PlayedKind, SpinFrom};
use crate::io::DatasetError;
use crate::io::balls_section::{RawBall, RawObject, Shape};
use crate::io::toml_file;
use crate::io::toml_file::{Condition, POSITIVE, Source};
use crate::measurement::dataset::ObjectBall;
use crate::measurement::number::count_of;
use crate::measurement::parameter::Parameter;
use crate::physics::ball::Ball;
use crate::simulate::{Camera, ClothSpec, MOST_FRAMES, MOST_SHOTS};

/// Frames that an extraction needs on either side of the impact.
const LEAST_FRAMES: f64 = 3.0;

#[derive(Deserialize)]
#[serde(deny_unknown_fields, expecting = "the keys of a design")]
struct RawSpec {
    #[serde(default)]
    expected: RawExpected,
    #[serde(default)]
    ball: RawBall,
    object: Option<Spanned<RawObject>>,
    #[serde(default)]
    cloth: RawCloth,
    #[serde(default)]
    camera: RawCamera,
    #[serde(default)]
    want: RawExpected,
    #[serde(default)]
    kind: Vec<Spanned<RawKind>>,
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a table, as in [expected] mu = 0.05")]
struct RawExpected {
    mu: Option<Spanned<f64>>,
    mu_s: Option<Spanned<f64>>,
    e: Option<Spanned<f64>>,
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a table, as in [cloth] mu_k = 0.2")]
struct RawCloth {
    mu_k: Option<Spanned<f64>>,
    mu_r: Option<Spanned<f64>>,
    bounce: Option<Spanned<f64>>,
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a table, as in [camera] fps = 1000")]
struct RawCamera {
    fps: Option<Spanned<f64>>,
    position_sd_mm: Option<Spanned<f64>>,
    position_sd_px: Option<Spanned<f64>>,
    mm_per_px: Option<Spanned<f64>>,
    before_ms: Option<Spanned<f64>>,
    after_ms: Option<Spanned<f64>>,
}

#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum Word {
    Stun,
    NaturalRoll,
    Draw,
    Slide,
}

#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum From {
    Known,
    Motion,
    Markers,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields, expecting = "a table, as in [[kind]] name = \"thin rolls\"")]
struct RawKind {
    name: Spanned<String>,
    cue_spin: Option<Spanned<Word>>,
    topspin: Option<Spanned<f64>>,
    side: Option<Spanned<f64>>,
    spin_from: Option<Spanned<From>>,
    spin_sd_rad_s: Option<Spanned<[f64; 2]>>,
    speed_m_s: Option<Spanned<[f64; 2]>>,
    cut_deg: Option<Spanned<[f64; 2]>>,
    shots: Option<Spanned<i64>>,
}

impl Expected {
    /// Reads a SPEC.toml. What it leaves out is as in [`Expected::default`].
    ///
    /// # Errors
    /// Everything that is wrong with it, with line and position.
    pub fn read(path: &Path) -> Result<Self, DatasetError> {
        toml_file::read_checked(path, RawSpec::check)
    }
}

const PART: Condition = (|x| (0.0..=1.0).contains(&x), "a number from 0 to 1");

impl RawSpec {
    fn check(self, source: &Source) -> Expected {
        let default = Expected::default();
        let Expected { mut coefficients, mut cloth, .. } = default;
        let expected = &self.expected;
        coefficients.mu = source.number(expected.mu.as_ref(), "expected.mu", coefficients.mu, PART);
        coefficients.mu_s = source.number(expected.mu_s.as_ref(), "expected.mu_s", coefficients.mu_s, PART);
        coefficients.e = source.number(expected.e.as_ref(), "expected.e", coefficients.e, PART);
        let ClothSpec { mu_k, mu_r, bounce } = cloth;
        cloth.mu_k = source.number(self.cloth.mu_k.as_ref(), "cloth.mu_k", mu_k, PART);
        cloth.mu_r = source.number(self.cloth.mu_r.as_ref(), "cloth.mu_r", mu_r, PART);
        cloth.bounce = source.number(self.cloth.bounce.as_ref(), "cloth.bounce", bounce, PART);
        let camera = self.camera.check(source);
        let mut wanted = default.wanted;
        let want = [&self.want.mu, &self.want.mu_s, &self.want.e];
        if want.iter().any(|given| given.is_some()) {
            wanted = [None; 3];
            for (parameter, given) in Parameter::COEFFICIENTS.into_iter().zip(want) {
                let key = format!("want.{}", parameter.name());
                wanted[parameter as usize] =
                    given.as_ref().map(|given| source.number(Some(given), &key, 0.0, POSITIVE));
            }
        }
        let mut kinds: Vec<PlayedKind> = Vec::new();
        for raw in &self.kind {
            let kind = raw.as_ref().check(source);
            if kinds.iter().any(|known| known.name == kind.name) {
                source.wrong(
                    &raw.as_ref().name,
                    format!("a second kind named \"{}\"; expected another name", kind.name),
                );
            }
            kinds.push(kind);
        }
        if kinds.is_empty() {
            kinds = default.kinds;
        }
        let (ball, object) = self.balls(source);
        Expected { coefficients, ball, object, cloth, camera, kinds, wanted }
    }

    fn balls(&self, source: &Source) -> (Ball, Option<ObjectBall>) {
        if let Some(shape) = self.ball.shape.as_ref().filter(|shape| *shape.as_ref() == Shape::Disc) {
            source.wrong(shape, "shape is \"disc\"; expected balls, which designs are of".to_owned());
        }
        if let Some(poisson) = &self.ball.poisson {
            let message = "poisson tells how far a contact gives way; expected none, as designs are of a contact that is rigid along \
                           its surface";
            source.wrong(poisson, message.to_owned());
        }
        let object = self.object.as_ref().map(Spanned::as_ref);
        let (ball, _) = self.ball.check(object, source);
        let object = object.map(|object| object.ball(&self.ball, &ball, source));
        (ball, object)
    }
}

impl RawCamera {
    fn check(&self, source: &Source) -> Camera {
        let default = Camera::default();
        let fps = source.number(self.fps.as_ref(), "camera.fps", default.fps, POSITIVE);
        let mut noise = 1e3 * default.position_sd_m;
        match (&self.position_sd_mm, &self.position_sd_px, &self.mm_per_px) {
            (Some(mm), None, None) => {
                noise = source.number(Some(mm), "camera.position_sd_mm", noise, POSITIVE);
            }
            (None, Some(px), Some(mm_per_px)) => {
                noise = source.number(Some(px), "camera.position_sd_px", 1.0, POSITIVE)
                    * source.number(Some(mm_per_px), "camera.mm_per_px", 1.0, POSITIVE);
            }
            (None, None, None) => {}
            (given, px, scale) => {
                let message = "the noise is stated in part or twice; expected position_sd_mm, or position_sd_px with mm_per_px";
                if let Some(at) = px.as_ref().or(scale.as_ref()).or(given.as_ref()) {
                    source.wrong(at, message.to_owned());
                }
            }
        }
        let side = |given: Option<&Spanned<f64>>, key: &str, default: f64| {
            let ms = source.number(given, key, default, POSITIVE);
            let frames = (1e-3 * ms * fps).round();
            if !(LEAST_FRAMES..=MOST_FRAMES).contains(&frames)
                && let Some(at) = given.or(self.fps.as_ref())
            {
                let message = format!(
                    "{key} is {ms}, which is {} at {fps} fps; expected {LEAST_FRAMES} to {MOST_FRAMES}",
                    count_of(frames as usize, "frame")
                );
                source.wrong(at, message);
            }
            ms
        };
        let before_ms = side(self.before_ms.as_ref(), "camera.before_ms", default.before_ms);
        let after_ms = side(self.after_ms.as_ref(), "camera.after_ms", default.after_ms);
        Camera { fps, position_sd_m: 1e-3 * noise, before_ms, after_ms, ..default }
    }
}

/// Two numbers, if they are given.
fn pair(
    source: &Source,
    given: Option<&Spanned<[f64; 2]>>,
    good: fn(f64, f64) -> bool,
    otherwise: &str,
) -> Option<[f64; 2]> {
    let given = given?;
    let [first, second] = *given.as_ref();
    if !good(first, second) {
        source.wrong(given, otherwise.to_owned());
    }
    Some([first, second])
}

impl RawKind {
    fn check(&self, source: &Source) -> PlayedKind {
        let name = self.name.as_ref().trim().to_owned();
        if name.is_empty() {
            source.wrong(&self.name, "name is empty; expected one that the tables can show".to_owned());
        }
        let spins: Condition = (|x| x.abs() <= 2.0, "from -2 to 2, in parts of the natural roll's");
        let topspin = match (&self.cue_spin, &self.topspin) {
            (Some(word), None) => match word.as_ref() {
                Word::Stun => [0.0; 2],
                Word::NaturalRoll => [1.0; 2],
                Word::Draw => PlayedKind::DRAW,
                Word::Slide => [0.5; 2],
            },
            (None, Some(topspin)) => [source.number(Some(topspin), "topspin", 0.0, spins); 2],
            (Some(_), Some(topspin)) => {
                source.wrong(topspin, "both cue_spin and topspin; expected one of them".to_owned());
                [0.0; 2]
            }
            (None, None) => {
                let message =
                    format!("kind \"{name}\" has neither cue_spin nor topspin; expected one of them");
                source.wrong(&self.name, message);
                [0.0; 2]
            }
        };
        let side = source.number(self.side.as_ref(), "side", 0.0, spins);
        let sd = pair(
            source,
            self.spin_sd_rad_s.as_ref(),
            |cue, object| [cue, object].iter().all(|sd| *sd > 0.0 && sd.is_finite()),
            "spin_sd_rad_s is no pair of errors; expected [cue ball's, object ball's], above 0",
        );
        let from = self.spin_from.as_ref().map(|from| *from.as_ref());
        let from = match (from, PlayedKind::usual(topspin, side)) {
            (Some(From::Known), _) | (None, SpinFrom::Known) => SpinFrom::Known,
            (Some(From::Motion), _) | (None, SpinFrom::Motion) => SpinFrom::Motion,
            (Some(From::Markers), _) | (None, SpinFrom::Markers { .. }) => SpinFrom::Markers { sd },
        };
        if let (SpinFrom::Motion, true, Some(at)) = (from, side != 0.0, &self.spin_from) {
            let message = "spin_from is \"motion\", which does not show side spin; expected known or markers";
            source.wrong(at, message.to_owned());
        }
        let default = PlayedKind::default();
        let speed_m_s = pair(
            source,
            self.speed_m_s.as_ref(),
            |slow, fast| 0.0 < slow && slow <= fast && fast.is_finite(),
            "speed_m_s is no range; expected [slowest, fastest], above 0",
        );
        let cut_deg = pair(
            source,
            self.cut_deg.as_ref(),
            |thick, thin| -90.0 < thick && thick <= thin && thin < 90.0,
            "cut_deg is no range; expected [least, most], between -90 and 90",
        );
        let [speed_m_s, cut_deg] =
            [speed_m_s.unwrap_or(default.speed_m_s), cut_deg.unwrap_or(default.cut_deg)];
        let shots = self.shots.as_ref().map_or(default.shots as i64, |given| {
            let shots = *given.as_ref();
            if !(1..=MOST_SHOTS as i64).contains(&shots) {
                source.wrong(given, format!("shots is {shots}; expected 1 to {MOST_SHOTS}"));
            }
            shots
        });
        PlayedKind { name, topspin, side, from, speed_m_s, cut_deg, shots: shots.max(1) as usize }
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

    #[test]
    fn what_is_left_out_is_the_default() {
        let spec = read("[camera]\nposition_sd_px = 0.2\nmm_per_px = 0.5\n[want]\ne = 0.001\n").unwrap();
        assert!((spec.camera.position_sd_m - 1e-4).abs() < 1e-18);
        assert_eq!(spec.kinds.len(), Expected::default().kinds.len());
        assert_eq!(spec.wanted, [None, None, Some(0.001)]);
        let spec = read("[[kind]]\nname = \"a\"\ncue_spin = \"stun\"\nside = 0.5\n").unwrap();
        assert_eq!(spec.kinds[0].from, SpinFrom::Markers { sd: None });
    }

    #[test]
    fn everything_that_is_wrong_is_said_with_its_place() {
        for (text, expected) in [
            ("[expected]\nmu = -1", ":2: column 6: expected.mu is -1; expected a number from 0 to 1"),
            (
                "[camera]\nfps = 10\nbefore_ms = 40",
                ":3: column 13: camera.before_ms is 40, which is 0 frames",
            ),
            ("[camera]\nposition_sd_px = 1", "expected position_sd_mm, or position_sd_px with mm_per_px"),
            (
                "[camera]\nfps = 1000\nafter_ms = 1e12",
                ":3: column 12: camera.after_ms is 1000000000000, which is 1000000000000 frames",
            ),
            ("[cloth]\nbounce = 1.5", "cloth.bounce is 1.5; expected a number from 0 to 1"),
            ("[camera]\nfsp = 1", "unknown key \"fsp\" (did you mean \"fps\"?)"),
            ("[[kind]]\nname = \"a\"", "neither cue_spin nor topspin"),
            ("[[kind]]\nname = \"a\"\ncue_spin = \"role\"", "unknown word \"role\""),
            ("[[kind]]\nname = \"a\"\ntopspin = 3", "topspin is 3; expected from -2 to 2"),
            (
                "[[kind]]\nname = \"a\"\ntopspin = 0\nside = 1\nspin_from = \"motion\"",
                "does not show side spin",
            ),
            ("[[kind]]\nname = \"a\"\ntopspin = 0\nspeed_m_s = [2, 1]", "column 13: speed_m_s is no range"),
            ("[[kind]]\nname = \"a\"\ntopspin = 0\ncut_deg = [0, 90]", "cut_deg is no range"),
            ("[[kind]]\nname = \"a\"\ntopspin = 0\nshots = 0", "shots is 0; expected 1 to"),
            ("[want]\nmu = 0", "want.mu is 0; expected more than 0"),
            (
                "[[kind]]\nname = \"a\"\ntopspin = 0\n[[kind]]\nname = \"a\"\ntopspin = 1",
                "a second kind named \"a\"",
            ),
        ] {
            let error = read(text).expect_err(text);
            assert!(error.contains(expected), "{error}\nis not {expected}");
        }
    }
}
