//! `[camera]`: corrections for the camera, stated exactly, with an error, or left free.

use std::fmt;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::Deserialize;
use serde::de::{Deserializer, Error, MapAccess, Visitor, value::MapAccessDeserializer};

use crate::io::toml_file::Source;
use crate::measurement::correction::Correction;
use crate::measurement::fault::Fault;
use crate::measurement::observable::Measured;

/// The section, or only a label: `camera = "phone"`. A key that is left out is `"auto"`.
#[derive(Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub(crate) struct CameraSection {
    /// Data sets with one label were filmed by one camera that was not moved.
    pub(crate) label: Option<String>,
    scale: Option<Stated>,
    aspect: Option<Stated>,
    shear: Option<Stated>,
    perspective: Option<Stated>,
    lens: Option<Stated>,
    shutter: Option<Stated>,
    parallax: Option<Stated>,
}

/// A statement about a correction.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(
    untagged,
    expecting = "expected \"auto\", \"none\", a number (for perspective two, along x and along y) or { mean = …, sd = … }"
)]
enum Stated {
    Word(Word),
    Exact(Values),
    Prior { mean: Values, sd: Values },
}

#[derive(Clone, Copy, Debug, Deserialize, JsonSchema, PartialEq)]
#[serde(rename_all = "lowercase")]
enum Word {
    Auto,
    None,
}

#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
#[serde(untagged)]
enum Values {
    One(f64),
    /// Along x and along y.
    Two([f64; 2]),
}

impl Values {
    fn each(&self) -> &[f64] {
        match self {
            Self::One(value) => std::slice::from_ref(value),
            Self::Two(values) => values,
        }
    }
}

/// A key of the section: its corrections, their range, and the values expected beside `"auto"`.
struct Key {
    name: &'static str,
    corrections: &'static [Correction],
    range: [f64; 2],
    expected: &'static str,
}

const fn key(
    name: &'static str,
    corrections: &'static [Correction],
    range: [f64; 2],
    expected: &'static str,
) -> Key {
    Key { name, corrections, range, expected }
}

const KEYS: [Key; 7] = [
    key("scale", &[Correction::Scale], [0.1, 10.0], "a length of the film over the true one, from 0.1 to 10"),
    key("aspect", &[Correction::Aspect], [0.5, 2.0], "lengths along y over lengths along x, from 0.5 to 2"),
    key("shear", &[Correction::Shear], [-0.5, 0.5], "a number from -0.5 to 0.5"),
    key("perspective", &PERSPECTIVE, [-2.0, 2.0], "[x, y], each from -2 to 2 per metre"),
    key("lens", &[Correction::Lens], [-0.3, 0.3], "a part of lengths at 0.5 m, from -0.3 to 0.3"),
    key("shutter", &SHUTTER, [f64::NAN; 2], "the seconds from the first row of the picture to the last"),
    key("parallax", &PARALLAX, [f64::NAN; 2], "no value"),
];
const PERSPECTIVE: [Correction; 2] = [Correction::PerspectiveX, Correction::PerspectiveY];
const SHUTTER: [Correction; 2] = [Correction::ShutterX, Correction::ShutterY];
const PARALLAX: [Correction; 3] = [Correction::ParallaxX, Correction::ParallaxY, Correction::Nearness];

/// The statement about one correction.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) enum Wanted {
    #[default]
    LeftOut,
    Auto,
    Value(Measured),
}

/// The statement about each correction, in the order of [`Correction::ALL`].
pub(super) type WantedCamera = [Wanted; Correction::COUNT];

fn exact(value: f64) -> Measured {
    Measured { value, sd: None }
}

/// Returns the values that are stated, `None` for those to be estimated from the balls.
/// Motion-capture systems correct positions for their cameras: distortions of one camera are
/// estimated there only on request.
pub(super) fn stated(
    wanted: &WantedCamera,
    is_motion_capture: bool,
) -> [Option<Measured>; Correction::COUNT] {
    Correction::ALL.map(|which| match wanted[which as usize] {
        Wanted::Value(value) => Some(value),
        Wanted::LeftOut if is_motion_capture && which.is_of_one_camera() => Some(exact(which.neutral())),
        Wanted::LeftOut | Wanted::Auto => None,
    })
}

impl CameraSection {
    /// Returns the seconds from the first row of the picture to the last, if the section states
    /// them.
    pub(super) fn readout(&self) -> Option<f64> {
        if let Some(Stated::Exact(Values::One(seconds))) = self.shutter { Some(seconds) } else { None }
    }

    pub(super) fn check(&self, source: &Source) -> WantedCamera {
        let mut wanted = WantedCamera::default();
        let Self { scale, aspect, shear, perspective, lens, shutter, parallax, .. } = self;
        let shutter = &shutter.filter(|_| self.readout().is_none());
        for (key, given) in KEYS.iter().zip([scale, aspect, shear, perspective, lens, shutter, parallax]) {
            let Some(stated) = given else { continue };
            let (means, sds) = match stated {
                Stated::Word(word) => {
                    for which in key.corrections {
                        let neutral = Wanted::Value(exact(which.neutral()));
                        wanted[*which as usize] = if *word == Word::Auto { Wanted::Auto } else { neutral };
                    }
                    continue;
                }
                Stated::Exact(values) => (values.each(), None),
                Stated::Prior { mean, sd } => (mean.each(), Some(sd.each())),
            };
            let are_good = means.len() == key.corrections.len()
                && means.iter().all(|mean| (key.range[0]..=key.range[1]).contains(mean))
                && sds.is_none_or(|sds| {
                    sds.len() == means.len() && sds.iter().all(|sd| *sd > 0.0 && sd.is_finite())
                });
            if !are_good {
                let path = format!("camera.{}", key.name);
                let value = source.written(&path).unwrap_or_default();
                let expected = format!("\"auto\", \"none\" or {}, and sd above 0", key.expected);
                source.add(&Fault::new(&path, value, expected));
                continue;
            }
            for (i, which) in key.corrections.iter().enumerate() {
                let sd = sds.map(|sds| sds[i]);
                wanted[*which as usize] = Wanted::Value(Measured { value: means[i], sd });
            }
        }
        // the centre of a stated lens distortion is the middle of the film
        let axis = match wanted[Correction::Lens as usize] {
            Wanted::Value(Measured { sd: None, .. }) => Wanted::Value(exact(0.0)),
            Wanted::Value(_) => Wanted::LeftOut,
            other => other,
        };
        wanted[Correction::LensX as usize] = axis;
        wanted[Correction::LensY as usize] = axis;
        wanted
    }
}

pub(crate) fn schema_of_camera(generator: &mut SchemaGenerator) -> Schema {
    let either = [generator.subschema_for::<String>(), generator.subschema_for::<CameraSection>()];
    json_schema!({ "anyOf": either })
}

pub(crate) fn label_or_section<'de, D: Deserializer<'de>>(
    deserializer: D,
) -> Result<Option<CameraSection>, D::Error> {
    struct Either;

    impl<'de> Visitor<'de> for Either {
        type Value = Option<CameraSection>;

        fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
            f.write_str("a label, as in camera = \"phone\", or a table, as in [camera] lens = \"none\"")
        }

        fn visit_str<E: Error>(self, label: &str) -> Result<Self::Value, E> {
            Ok(Some(CameraSection { label: Some(label.to_owned()), ..CameraSection::default() }))
        }

        fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Self::Value, A::Error> {
            CameraSection::deserialize(MapAccessDeserializer::new(map)).map(Some)
        }
    }

    deserializer.deserialize_any(Either)
}
