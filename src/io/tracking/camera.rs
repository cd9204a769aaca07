//! `[camera]`: corrections for the camera, stated exactly, with an error, or left free.

use schemars::JsonSchema;
use serde::Deserialize;

use crate::io::toml_file::Source;
use crate::measurement::correction::Correction;
use crate::measurement::fault::Fault;
use crate::measurement::observable::Measured;

/// The section, or only its label: `camera = "phone"`.
#[derive(Deserialize, JsonSchema)]
#[serde(untagged)]
pub(crate) enum Camera {
    Label(String),
    Section(Box<CameraSection>),
}

/// A key that is left out is `"auto"`.
#[derive(Clone, Debug, Default, Deserialize, JsonSchema)]
pub(crate) struct CameraSection {
    /// Data sets with one label were filmed by one camera that was not moved.
    pub(crate) label: Option<String>,
    scale: Option<Stated>,
    aspect: Option<Stated>,
    shear: Option<Stated>,
    perspective: Option<Stated>,
    lens: Option<Stated>,
    /// Seconds from the first row of the picture to the last.
    shutter: Option<NumberOr<Word>>,
    parallax: Option<Word>,
}

/// A statement about a correction.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(untagged)]
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

/// A number above 0, or a word.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema, PartialEq)]
#[serde(untagged)]
pub(super) enum NumberOr<Word> {
    Number(#[schemars(extend("exclusiveMinimum" = 0))] f64),
    Word(Word),
}

impl<Word> NumberOr<Word> {
    pub(super) fn number(self) -> Option<f64> {
        if let Self::Number(number) = self { Some(number) } else { None }
    }

    pub(super) fn word(self) -> Option<Word> {
        if let Self::Word(word) = self { Some(word) } else { None }
    }
}

/// A number or a name, or a list of them.
#[derive(Clone, Debug, Deserialize, JsonSchema, PartialEq)]
#[serde(untagged)]
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

const KEYS: [Key; 5] = [
    Key("scale", &[Correction::Scale], [0.1, 10.0], "a length of the film over the true one, from 0.1 to 10"),
    Key("aspect", &[Correction::Aspect], [0.5, 2.0], "lengths along y over lengths along x, from 0.5 to 2"),
    Key("shear", &[Correction::Shear], [-0.5, 0.5], "a number from -0.5 to 0.5"),
    Key(
        "perspective",
        &[Correction::PerspectiveX, Correction::PerspectiveY],
        [-2.0, 2.0],
        "[x, y], each from -2 to 2 per metre",
    ),
    Key("lens", &[Correction::Lens], [-0.3, 0.3], "a part of lengths at 0.5 m, from -0.3 to 0.3"),
];
const SHUTTER: [Correction; 2] = [Correction::ShutterX, Correction::ShutterY];
const PARALLAX: [Correction; 3] = [Correction::ParallaxX, Correction::ParallaxY, Correction::Nearness];

fn exact(value: f64) -> Option<Measured> {
    Some(Measured { value, sd: None })
}

impl Word {
    /// Returns the value of a correction: `None` if it is to be estimated.
    fn value(self, which: Correction) -> Option<Measured> {
        exact(which.neutral()).filter(|_| self == Self::None)
    }
}

impl Stated {
    /// Returns the value of each correction of a key; `None` unless they are as expected.
    fn values(&self, Key(_, corrections, [low, high], _): &Key) -> Option<Vec<Option<Measured>>> {
        let (means, sds) = match self {
            Self::Word(word) => return Some(corrections.iter().map(|which| word.value(*which)).collect()),
            Self::Exact(values) => (values.each(), vec![None; corrections.len()]),
            Self::Prior { mean, sd } => (mean.each(), sd.each().iter().copied().map(Some).collect()),
        };
        let values = means.iter().zip(&sds).map(|(value, sd)| Some(Measured { value: *value, sd: *sd }));
        let is_good = [means.len(), sds.len()] == [corrections.len(); 2]
            && means.iter().all(|mean| (low..=high).contains(&mean))
            && sds.iter().flatten().all(|sd| *sd > 0.0 && sd.is_finite());
        is_good.then(|| values.collect())
    }
}

impl Camera {
    pub(crate) fn section(self) -> CameraSection {
        match self {
            Self::Label(label) => CameraSection { label: Some(label), ..CameraSection::default() },
            Self::Section(section) => *section,
        }
    }
}

impl CameraSection {
    /// Returns the seconds from the first row of the picture to the last, if the section states
    /// them.
    pub(super) fn readout(&self) -> Option<f64> {
        self.shutter.and_then(NumberOr::number)
    }

    fn statements(&self) -> impl Iterator<Item = (&'static Key, &Stated)> {
        let all = [&self.scale, &self.aspect, &self.shear, &self.perspective, &self.lens];
        KEYS.iter().zip(all).filter_map(|(key, stated)| Some((key, stated.as_ref()?)))
    }

    pub(super) fn check(&self, source: &Source) {
        for (key, _) in self.statements().filter(|(key, stated)| stated.values(key).is_none()) {
            let expected = format!("\"auto\", \"none\" or {}, and sd above 0", key.3);
            let path = format!("camera.{}", key.0);
            source.add(&[Fault::new(&path, source.written(&path), expected)]);
        }
    }

    /// Returns the values that are stated, `None` for those to be estimated from the balls.
    /// Motion-capture systems correct positions for their cameras: distortions of one camera are
    /// estimated there only on request.
    pub(super) fn values(&self, is_motion_capture: bool) -> [Option<Measured>; Correction::COUNT] {
        let unstated = |which: Correction| is_motion_capture && which.is_of_one_camera();
        let mut values = Correction::ALL.map(|which| exact(which.neutral()).filter(|_| unstated(which)));
        for (key, stated) in self.statements() {
            for (which, value) in key.1.iter().zip(stated.values(key).into_iter().flatten()) {
                values[*which as usize] = value;
            }
        }
        let shutter = self.shutter.and_then(NumberOr::word).map(|word| (word, &SHUTTER[..]));
        for (word, corrections) in shutter.into_iter().chain(self.parallax.map(|word| (word, &PARALLAX[..])))
        {
            for which in corrections {
                values[*which as usize] = word.value(*which);
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
