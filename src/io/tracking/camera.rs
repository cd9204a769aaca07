//! `[camera]`: what of the camera is found from the balls, stated, or taken as right.

use serde::Deserialize;
use serde::de::{SeqAccess, Unexpected, Visitor};
use toml::Spanned;

use crate::io::toml_file::Source;
use crate::measurement::correction::Correction;

/// The section. A key that is left out is `"auto"`.
#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct RawCamera {
    scale: Option<Spanned<Stated>>,
    aspect: Option<Spanned<Stated>>,
    shear: Option<Spanned<Stated>>,
    perspective: Option<Spanned<Stated>>,
    lens: Option<Spanned<Stated>>,
    shutter: Option<Spanned<Stated>>,
}

/// What is said of a correction.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Stated {
    Auto,
    None,
    Value(f64),
    /// Along x and along y.
    Pair([f64; 2]),
}

impl<'de> Deserialize<'de> for Stated {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Either;
        impl<'de> Visitor<'de> for Either {
            type Value = Stated;

            fn expecting(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
                f.write_str("\"auto\", \"none\" or a number (for perspective two, along x and along y)")
            }

            fn visit_f64<E>(self, value: f64) -> Result<Stated, E> {
                Ok(Stated::Value(value))
            }

            fn visit_i64<E>(self, value: i64) -> Result<Stated, E> {
                Ok(Stated::Value(value as f64))
            }

            fn visit_str<E: serde::de::Error>(self, word: &str) -> Result<Stated, E> {
                match word {
                    "auto" => Ok(Stated::Auto),
                    "none" => Ok(Stated::None),
                    _ => Err(E::invalid_value(Unexpected::Str(word), &self)),
                }
            }

            fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<Stated, A::Error> {
                let mut next = |at: usize| {
                    list.next_element()?.ok_or_else(|| serde::de::Error::invalid_length(at, &self))
                };
                Ok(Stated::Pair([next(0)?, next(1)?]))
            }
        }
        deserializer.deserialize_any(Either)
    }
}

/// What dataset.toml says of a correction.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) enum Wanted {
    #[default]
    LeftOut,
    Auto,
    Value(f64),
}

/// What dataset.toml says of each, in the order of [`Correction::ALL`].
pub(super) type WantedCamera = [Wanted; Correction::COUNT];

/// The values that are stated; `None`: found from the balls. A motion-capture system has corrected its positions for its cameras, so
/// that what only a camera does is looked for there if dataset.toml asks for it.
pub(super) fn stated(wanted: &WantedCamera, is_motion_capture: bool) -> [Option<f64>; Correction::COUNT] {
    let of = |which: Correction| match wanted[which as usize] {
        Wanted::Value(value) => Some(value),
        Wanted::LeftOut if is_motion_capture && which.is_of_one_camera() => Some(which.neutral()),
        Wanted::LeftOut | Wanted::Auto => None,
    };
    Correction::ALL.map(of)
}

impl RawCamera {
    /// What is wanted, of keys that are right.
    pub(super) fn check(&self, source: &Source) -> WantedCamera {
        let mut wanted = WantedCamera::default();
        let single = [
            (
                "scale",
                Correction::Scale,
                &self.scale,
                "a length of the film over the true one, from 0.1 to 10",
            ),
            (
                "aspect",
                Correction::Aspect,
                &self.aspect,
                "lengths along y over lengths along x, from 0.5 to 2",
            ),
            ("shear", Correction::Shear, &self.shear, "a number from -0.5 to 0.5"),
            ("lens", Correction::Lens, &self.lens, "a part of lengths at 0.5 m, from -0.3 to 0.3"),
        ];
        for (key, which, given, expected) in single {
            let Some(given) = given else { continue };
            let [low, high] = match which {
                Correction::Scale => [0.1, 10.0],
                Correction::Aspect => [0.5, 2.0],
                Correction::Lens => [-0.3, 0.3],
                _ => [-0.5, 0.5],
            };
            wanted[which as usize] = match *given.as_ref() {
                Stated::Auto => Wanted::Auto,
                Stated::None => Wanted::Value(which.neutral()),
                Stated::Value(value) if (low..=high).contains(&value) => Wanted::Value(value),
                other => {
                    let message =
                        format!("{key} is {}; expected \"auto\", \"none\" or {expected}", shown(other));
                    source.wrong(given, message);
                    Wanted::LeftOut
                }
            };
        }
        if let Some(given) = &self.perspective {
            let both = match *given.as_ref() {
                Stated::Auto => [Wanted::Auto; 2],
                Stated::None => [Wanted::Value(0.0); 2],
                Stated::Pair(pair) if pair.iter().all(|value| value.abs() <= 2.0) => pair.map(Wanted::Value),
                other => {
                    let message = format!(
                        "perspective is {}; expected \"auto\", \"none\" or [x, y], each from -2 to 2 per metre",
                        shown(other)
                    );
                    source.wrong(given, message);
                    [Wanted::LeftOut; 2]
                }
            };
            wanted[Correction::PerspectiveX as usize] = both[0];
            wanted[Correction::PerspectiveY as usize] = both[1];
        }
        // a lens that is stated is about the middle of the film
        let middle = match wanted[Correction::Lens as usize] {
            Wanted::Value(_) => Wanted::Value(0.0),
            other => other,
        };
        wanted[Correction::LensX as usize] = middle;
        wanted[Correction::LensY as usize] = middle;
        if let Some(given) = &self.shutter {
            let both = match *given.as_ref() {
                Stated::Auto => Wanted::Auto,
                Stated::None => Wanted::Value(0.0),
                other => {
                    let message = format!(
                        "shutter is {}; expected \"auto\" or \"none\": a known read-out time is [video] row_readout_s with rows",
                        shown(other)
                    );
                    source.wrong(given, message);
                    Wanted::LeftOut
                }
            };
            wanted[Correction::ShutterX as usize] = both;
            wanted[Correction::ShutterY as usize] = both;
        }
        wanted
    }
}

fn shown(stated: Stated) -> String {
    match stated {
        Stated::Auto => "\"auto\"".to_string(),
        Stated::None => "\"none\"".to_string(),
        Stated::Value(value) => value.to_string(),
        Stated::Pair([x, y]) => format!("[{x}, {y}]"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn motion_capture_is_corrected_for_its_cameras_already() {
        let mut wanted = WantedCamera::default();
        wanted[Correction::ShutterY as usize] = Wanted::Auto;
        wanted[Correction::Aspect as usize] = Wanted::Value(1.01);
        let stated = |is_motion_capture| {
            let values = stated(&wanted, is_motion_capture);
            move |which: Correction| values[which as usize]
        };
        let (plain, captured) = (stated(false), stated(true));
        for which in [Correction::PerspectiveX, Correction::Lens, Correction::LensY, Correction::ShutterX] {
            assert_eq!(plain(which), None);
            assert_eq!(captured(which), Some(0.0));
        }
        assert_eq!(captured(Correction::ShutterY), None);
        assert_eq!(captured(Correction::Scale), None);
        assert_eq!((plain(Correction::Aspect), captured(Correction::Aspect)), (Some(1.01), Some(1.01)));
    }
}
