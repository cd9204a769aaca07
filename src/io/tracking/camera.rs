//! `[camera]`: corrections, stated exactly, with an error, or left free; calibration of lengths to
//! metres on the table, x right and y up as seen from above.

use nalgebra::{DMatrix, Matrix3, Point2, Vector2, Vector3};
use schemars::JsonSchema;
use serde::Deserialize;

use crate::measurement::correction::Correction::{
    self, AsideX, AsideY, Aspect, Late, Lens, LensX, LensY, Nearness, ObjectScale, ParallaxX, ParallaxY,
    PerspectiveX, PerspectiveY, Push, Scale, Shear, ShutterX, ShutterY,
};
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
    pub(super) shutter: Option<NumberOr<Word>>,
    parallax: Option<Word>,
    /// Faults of the tracker: late_frames, push_m, aside_x_m, aside_y_m and object_scale in fit.json.
    tracker: Option<Word>,
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
pub(super) enum Word {
    Auto,
    None,
}

/// A number above 0, or a word.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema, PartialEq)]
#[serde(untagged)]
pub(super) enum NumberOr<Word> {
    Number(#[schemars(range(max = 100_000), extend("exclusiveMinimum" = 0))] f64),
    Word(Word),
}

impl<Word> NumberOr<Word> {
    pub(super) fn number(self) -> Option<f64> {
        if let Self::Number(number) = self { Some(number) } else { None }
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

/// The corrections of each key of the section; rules.jinja has the ranges of its numbers.
const KEYS: [&[Correction]; 8] = [
    &[Scale],
    &[Aspect],
    &[Shear],
    &[PerspectiveX, PerspectiveY],
    &[Lens],
    &[ShutterX, ShutterY],
    &[ParallaxX, ParallaxY, Nearness],
    &[Late, Push, AsideX, AsideY, ObjectScale],
];

fn exact(value: f64) -> Option<Measured> {
    Some(Measured { value, sd: None })
}

impl Stated {
    /// Returns the value of each correction of a key, `None` for those to be estimated.
    fn values(&self, corrections: &[Correction]) -> Vec<Option<Measured>> {
        match self {
            Self::Word(Word::Auto) => vec![None; corrections.len()],
            Self::Word(Word::None) => corrections.iter().map(|it| exact(it.neutral())).collect(),
            Self::Exact(values) => values.each().iter().map(|value| exact(*value)).collect(),
            Self::Prior { mean, sd } => {
                let both = mean.each().iter().zip(sd.each());
                both.map(|(mean, sd)| Some(Measured::new(*mean, *sd))).collect()
            }
        }
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
    /// Returns the values that are stated, `None` for those to be estimated from the balls.
    /// Motion-capture systems correct positions for their cameras: distortions of one camera are
    /// estimated there only on request.
    pub(super) fn values(&self, is_motion_capture: bool) -> [Option<Measured>; Correction::COUNT] {
        let unstated = |which: Correction| is_motion_capture && which.is_of_one_camera();
        let mut values = Correction::ALL.map(|which| exact(which.neutral()).filter(|_| unstated(which)));
        let shutter = if let Some(NumberOr::Word(word)) = self.shutter { Some(word) } else { None };
        let words = [shutter, self.parallax, self.tracker].map(|word| word.map(Stated::Word));
        let keys = [&self.scale, &self.aspect, &self.shear, &self.perspective, &self.lens];
        for (corrections, stated) in KEYS.into_iter().zip(keys.into_iter().chain(&words)) {
            let stated = stated.iter().flat_map(|stated| stated.values(corrections));
            for (which, value) in corrections.iter().zip(stated) {
                values[*which as usize] = value;
            }
        }
        // the centre of a stated lens distortion is the middle of the film
        let axis = match self.lens {
            None | Some(Stated::Prior { .. }) => return values,
            Some(Stated::Word(Word::Auto)) => None,
            Some(_) => exact(0.0),
        };
        (values[LensX as usize], values[LensY as usize]) = (axis, axis);
        values
    }
}

/// Map from a file's coordinates to metres.
#[derive(Clone, Debug, Default)]
pub(crate) struct Calibration {
    /// Metres per unit as factor and divisor; the latter is whole, so that 5.6 cm is 0.056 m.
    pub(crate) scale: (f64, f64),
    /// Whether the file's y axis points up.
    pub(crate) is_up: bool,
    /// Map of homogeneous pixels, which replaces the scale.
    pub(crate) homography: Option<Matrix3<f64>>,
    /// Rolling shutter: seconds from the first row of the picture to the last, and their number.
    pub(crate) readout: Option<[f64; 2]>,
}

/// A place in the picture and on the table.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
pub(super) struct Point {
    px: [f64; 2],
    m: [f64; 2],
}

impl Calibration {
    pub(super) fn metres(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let (factor, divisor) = self.scale;
        match &self.homography {
            None if self.is_up => [factor * x / divisor, factor * y / divisor],
            None => [factor * x / divisor, -factor * y / divisor],
            Some(map) => map.transform_point(&Point2::new(x, y)).into(),
        }
    }

    /// Returns standard deviations in metres at a position; arguments are in the file's unit.
    pub(super) fn sd(&self, [x, y]: [f64; 2], sd: [f64; 2]) -> [f64; 2] {
        let (factor, divisor) = self.scale;
        let Some(map) = &self.homography else { return sd.map(|sd| factor * sd / divisor) };
        let p = map * Point2::new(x, y).to_homogeneous();
        [0, 1].map(|i| {
            let slope = |k: usize| (map[(i, k)] - p[i] / p.z * map[(2, k)]) / p.z;
            (slope(0) * sd[0]).hypot(slope(1) * sd[1])
        })
    }

    /// Returns the time between the first row of a picture and a position, s.
    pub(super) fn delay(&self, y: f64) -> f64 {
        self.readout.map_or(0.0, |[seconds, rows]| seconds * if self.is_up { rows - y } else { y } / rows)
    }
}

/// Returns the homography of pixels to metres by least squares (direct linear transform of
/// normalised points), and a note on its residuals. `is_up`: the direction of the pixels' y axis.
pub(super) fn homography(points: &[Point], is_up: Option<bool>) -> Result<(Matrix3<f64>, String), String> {
    let count = points.len();
    let map = least_squares(points)
        .ok_or("the [[scale.point]] lie nearly on a line; expected four of which no three are on a line")?;
    if !points.iter().all(|point| (map * Point2::from(point.px).to_homogeneous()).z > 0.0) {
        let message = "the [[scale.point]] are no picture of one plane in front of a camera; expected each px with its own m";
        return Err(message.to_string());
    }
    if is_up.is_some_and(|is_up| (map.determinant() > 0.0) != is_up) {
        let message = "the [[scale.point]] are a mirror image; expected m with x to the right and y up as seen from above, or the \
                       other y_axis";
        return Err(message.to_string());
    }
    let square =
        |point: &Point| (map.transform_point(&point.px.into()) - Point2::from(point.m)).norm_squared();
    let rms = (points.iter().map(square).sum::<f64>() / count as f64).sqrt() * 1e3;
    let exact = if count == 4 { " (exact through four points: not a check)" } else { "" };
    Ok((map, format!("homography from {count} points, residual {rms:.3} mm{exact}")))
}

/// Returns the map of pixels to metres, positive at their mean; `None` if not determined.
fn least_squares(points: &[Point]) -> Option<Matrix3<f64>> {
    let (pixels, metres): (Vec<_>, Vec<_>) = points.iter().map(|point| (point.px, point.m)).unzip();
    let (from, to) = (normaliser(&pixels)?, normaliser(&metres)?);
    let mut rows = DMatrix::zeros((2 * points.len()).max(9), 9);
    for (i, point) in points.iter().enumerate() {
        let p = from * Point2::from(point.px).to_homogeneous();
        let q = to * Point2::from(point.m).to_homogeneous();
        for k in 0..3 {
            rows[(2 * i, k)] = p[k];
            rows[(2 * i, 6 + k)] = -q.x * p[k];
            rows[(2 * i + 1, 3 + k)] = p[k];
            rows[(2 * i + 1, 6 + k)] = -q.y * p[k];
        }
    }
    // the singular values decrease
    let svd = rows.svd(false, true);
    // two solutions: the points do not determine it
    if svd.singular_values[7] < 1e-6 * svd.singular_values[0] {
        return None;
    }
    let normalised = Matrix3::from_row_iterator(svd.v_t?.row(8).iter().copied());
    let map = to.try_inverse()? * normalised * from;
    let mean: Vector3<f64> = pixels.into_iter().map(|px| Point2::from(px).to_homogeneous()).sum();
    Some(if (map * mean).z < 0.0 { -map } else { map })
}

/// Returns the map of points to mean 0 and rms distance √2; `None` if they are one point.
fn normaliser(points: &[[f64; 2]]) -> Option<Matrix3<f64>> {
    let n = points.len() as f64;
    let points = points.iter().map(|point| Vector2::from(*point));
    let mean = points.clone().sum::<Vector2<f64>>() / n;
    let scale = (2.0 * n / points.map(|point| (point - mean).norm_squared()).sum::<f64>()).sqrt();
    let map = Matrix3::new(scale, 0.0, -scale * mean.x, 0.0, scale, -scale * mean.y, 0.0, 0.0, 1.0);
    (scale > 0.0 && scale.is_finite()).then_some(map)
}
