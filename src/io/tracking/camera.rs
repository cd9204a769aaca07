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
#[derive(Clone, Debug, Default, Deserialize, JsonSchema)]
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
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(
    untagged,
    expecting = "expected \"auto\", \"none\", a number (for perspective two, along x and along y) or { mean = …, sd = … }"
)]
enum Stated {
    Word(Word),
    Exact(OneOrSeveral<f64>),
    Prior { mean: OneOrSeveral<f64>, sd: OneOrSeveral<f64> },
}

#[derive(Clone, Copy, Debug, Deserialize, JsonSchema, PartialEq)]
#[serde(rename_all = "lowercase")]
enum Word {
    Auto,
    None,
}

/// A number or a name, or a list of them.
#[derive(Clone, Debug, Deserialize, JsonSchema, PartialEq)]
#[serde(untagged, expecting = "expected the name of a track, or a list of the names of markers on one ball")]
pub(super) enum OneOrSeveral<T> {
    One(T),
    Several(Vec<T>),
}

impl<T> OneOrSeveral<T> {
    pub(super) fn each(&self) -> &[T] {
        match self {
            Self::One(value) => std::slice::from_ref(value),
            Self::Several(values) => values,
        }
    }
}

/// A key of the section: its corrections, their range, and the values expected beside `"auto"`.
struct Key(&'static str, &'static [Correction], [f64; 2], &'static str);

const KEYS: [Key; 7] = [
    Key("scale", &[Correction::Scale], [0.1, 10.0], "a length of the film over the true one, from 0.1 to 10"),
    Key("aspect", &[Correction::Aspect], [0.5, 2.0], "lengths along y over lengths along x, from 0.5 to 2"),
    Key("shear", &[Correction::Shear], [-0.5, 0.5], "a number from -0.5 to 0.5"),
    Key("perspective", &PERSPECTIVE, [-2.0, 2.0], "[x, y], each from -2 to 2 per metre"),
    Key("lens", &[Correction::Lens], [-0.3, 0.3], "a part of lengths at 0.5 m, from -0.3 to 0.3"),
    Key("shutter", &SHUTTER, [f64::NAN; 2], "the seconds from the first row of the picture to the last"),
    Key("parallax", &PARALLAX, [f64::NAN; 2], "no value"),
];
const PERSPECTIVE: [Correction; 2] = [Correction::PerspectiveX, Correction::PerspectiveY];
const SHUTTER: [Correction; 2] = [Correction::ShutterX, Correction::ShutterY];
const PARALLAX: [Correction; 3] = [Correction::ParallaxX, Correction::ParallaxY, Correction::Nearness];

impl Stated {
    /// Returns the stated values and standard deviations; empty and `None` for a word.
    fn numbers(&self) -> (&[f64], Option<&[f64]>) {
        match self {
            Self::Word(_) => (&[], None),
            Self::Exact(values) => (values.each(), None),
            Self::Prior { mean, sd } => (mean.each(), Some(sd.each())),
        }
    }

    fn is_good(&self, Key(_, corrections, [low, high], _): &Key) -> bool {
        let (means, sds) = self.numbers();
        let are_in_range = means.iter().all(|mean| (low..=high).contains(&mean));
        let are_sds =
            |sds: &[f64]| sds.len() == means.len() && sds.iter().all(|sd| *sd > 0.0 && sd.is_finite());
        matches!(self, Self::Word(_))
            || means.len() == corrections.len() && are_in_range && sds.is_none_or(are_sds)
    }
}

impl CameraSection {
    /// Returns the seconds from the first row of the picture to the last, if the section states
    /// them.
    pub(super) fn readout(&self) -> Option<f64> {
        if let Some(Stated::Exact(OneOrSeveral::One(seconds))) = self.shutter { Some(seconds) } else { None }
    }

    fn statements(&self) -> impl Iterator<Item = (&'static Key, &Stated)> {
        let Self { scale, aspect, shear, perspective, lens, shutter, parallax, .. } = self;
        let all = [scale, aspect, shear, perspective, lens, shutter, parallax];
        let stated = KEYS.iter().zip(all).filter_map(|(key, stated)| Some((key, stated.as_ref()?)));
        stated.filter(|(key, _)| key.0 != "shutter" || self.readout().is_none())
    }

    pub(super) fn check(&self, source: &Source) {
        for (Key(name, .., expected), _) in self.statements().filter(|(key, stated)| !stated.is_good(key)) {
            let path = format!("camera.{name}");
            let expected = format!("\"auto\", \"none\" or {expected}, and sd above 0");
            source.add(&Fault::new(&path, source.written(&path), expected));
        }
    }

    /// Returns the values that are stated, `None` for those to be estimated from the balls.
    /// Motion-capture systems correct positions for their cameras: distortions of one camera are
    /// estimated there only on request.
    pub(super) fn values(&self, is_motion_capture: bool) -> [Option<Measured>; Correction::COUNT] {
        let exact = |value: f64| Some(Measured { value, sd: None });
        let unstated = |which: Correction| is_motion_capture && which.is_of_one_camera();
        let mut values = Correction::ALL.map(|which| exact(which.neutral()).filter(|_| unstated(which)));
        for (Key(_, corrections, ..), stated) in self.statements() {
            let (means, sds) = stated.numbers();
            for (i, which) in corrections.iter().enumerate() {
                values[*which as usize] = match stated {
                    Stated::Word(Word::Auto) => None,
                    Stated::Word(Word::None) => exact(which.neutral()),
                    _ => Some(Measured { value: means[i], sd: sds.map(|sds| sds[i]) }),
                };
            }
        }
        // the centre of a stated lens distortion is the middle of the film
        let axis = match self.lens {
            None | Some(Stated::Prior { .. }) => return values,
            Some(Stated::Word(Word::Auto)) => None,
            Some(_) => exact(0.0),
        };
        (values[Correction::LensX as usize], values[Correction::LensY as usize]) = (axis, axis);
        values
    }
}

pub(crate) fn schema_of_camera(generator: &mut SchemaGenerator) -> Schema {
    let either = [generator.subschema_for::<String>(), generator.subschema_for::<CameraSection>()];
    json_schema!({ "anyOf": either })
}

pub(crate) fn label_or_section<'de, D: Deserializer<'de>>(
    deserializer: D,
) -> Result<CameraSection, D::Error> {
    struct Either;

    impl<'de> Visitor<'de> for Either {
        type Value = CameraSection;

        fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
            f.write_str("a label, as in camera = \"phone\", or a table, as in [camera] lens = \"none\"")
        }

        fn visit_str<E: Error>(self, label: &str) -> Result<Self::Value, E> {
            Ok(CameraSection { label: Some(label.to_owned()), ..CameraSection::default() })
        }

        fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Self::Value, A::Error> {
            CameraSection::deserialize(MapAccessDeserializer::new(map))
        }
    }

    deserializer.deserialize_any(Either)
}
