//! `[camera]`: what of the camera is found from the balls, stated, or taken as right.

use std::fmt;
use std::ops::RangeInclusive;

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
    parallax: Option<Spanned<Stated>>,
}

/// What is said of a correction.
#[derive(Debug)]
enum Stated {
    Auto,
    None,
    /// One, or two along x and along y.
    Values(Vec<f64>),
}

impl<'de> Deserialize<'de> for Stated {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Either;
        impl<'de> Visitor<'de> for Either {
            type Value = Stated;

            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("\"auto\", \"none\" or a number (for perspective two, along x and along y)")
            }

            fn visit_f64<E>(self, value: f64) -> Result<Stated, E> {
                Ok(Stated::Values(vec![value]))
            }

            fn visit_i64<E>(self, value: i64) -> Result<Stated, E> {
                Ok(Stated::Values(vec![value as f64]))
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
                Ok(Stated::Values(vec![next(0)?, next(1)?]))
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
        let mut take =
            |key: &str, given: &Option<Spanned<Stated>>, which: &[Correction], limits, expected| {
                let limits: &[RangeInclusive<f64>] = limits;
                let Some(given) = given else { return };
                let stated = given.as_ref();
                let good = |values: &[f64]| {
                    values.len() == limits.len()
                        && values.iter().zip(limits).all(|(x, within)| within.contains(x))
                };
                for (i, which) in which.iter().enumerate() {
                    wanted[*which as usize] = match stated {
                        Stated::Auto => Wanted::Auto,
                        Stated::None => Wanted::Value(which.neutral()),
                        Stated::Values(values) if good(values) => Wanted::Value(values[i]),
                        Stated::Values(_) => Wanted::LeftOut,
                    };
                }
                if matches!(stated, Stated::Values(values) if !good(values)) {
                    source.wrong(given, format!("{key} is {stated}; expected \"auto\"{expected}"));
                }
            };
        let expected = ", \"none\" or a length of the film over the true one, from 0.1 to 10";
        take("scale", &self.scale, &[Correction::Scale], &[0.1..=10.0], expected);
        let expected = ", \"none\" or lengths along y over lengths along x, from 0.5 to 2";
        take("aspect", &self.aspect, &[Correction::Aspect], &[0.5..=2.0], expected);
        let expected = ", \"none\" or a number from -0.5 to 0.5";
        take("shear", &self.shear, &[Correction::Shear], &[-0.5..=0.5], expected);
        let expected = ", \"none\" or a part of lengths at 0.5 m, from -0.3 to 0.3";
        take("lens", &self.lens, &[Correction::Lens], &[-0.3..=0.3], expected);
        let both = [Correction::PerspectiveX, Correction::PerspectiveY];
        let expected = ", \"none\" or [x, y], each from -2 to 2 per metre";
        take("perspective", &self.perspective, &both, &[-2.0..=2.0, -2.0..=2.0], expected);
        let both = [Correction::ShutterX, Correction::ShutterY];
        let expected = " or \"none\": a known read-out time is [video] row_readout_s with rows";
        take("shutter", &self.shutter, &both, &[], expected);
        let all = [Correction::ParallaxX, Correction::ParallaxY, Correction::Nearness];
        let expected = " or \"none\"";
        take("parallax", &self.parallax, &all, &[], expected);
        // a lens that is stated is about the middle of the film
        let middle = match wanted[Correction::Lens as usize] {
            Wanted::Value(_) => Wanted::Value(0.0),
            other => other,
        };
        wanted[Correction::LensX as usize] = middle;
        wanted[Correction::LensY as usize] = middle;
        wanted
    }
}

impl fmt::Display for Stated {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Self::Auto => f.write_str("\"auto\""),
            Self::None => f.write_str("\"none\""),
            Self::Values(values) => match values.as_slice() {
                [value] => write!(f, "{value}"),
                values => write!(f, "[{}]", values.iter().map(f64::to_string).collect::<Vec<_>>().join(", ")),
            },
        }
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
