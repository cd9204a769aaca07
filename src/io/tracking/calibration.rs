//! Calibration of a file's lengths: to metres on the table, x right and y up as seen from above.

use nalgebra::{DMatrix, Matrix2, Matrix3, Point2, Vector2, Vector3};
use schemars::JsonSchema;
use serde::Deserialize;

/// Map from a file's coordinates to metres.
#[derive(Clone, Debug, Default)]
pub(crate) struct Calibration {
    /// Metres per unit as factor and divisor; the latter is whole, so that 5.6 cm is 0.056 m.
    pub(crate) scale: (f64, f64),
    /// Whether the file's y axis points up.
    pub(crate) is_up: bool,
    /// Map of homogeneous pixels, which replaces the scale.
    pub(crate) homography: Option<Matrix3<f64>>,
    /// A rolling shutter: the seconds in which the rows of a picture are exposed, one after the
    /// other from the top, and their number.
    pub(crate) readout: Option<[f64; 2]>,
}

/// A place in the picture and on the table.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema)]
pub(super) struct Point {
    px: [f64; 2],
    m: [f64; 2],
}

const COLLINEAR: &str =
    "the [[scale.point]] lie on one line, or all but one do; expected four of which no three are on a line";

const BEHIND: &str = "the [[scale.point]] cannot be pictures of points in one plane in front of a camera; expected each \
                      px with its own m";

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
        let p = map * homogeneous([x, y]);
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
/// normalised points), and a note on its residuals. `is_up` is the direction of the pixels' y axis
/// if it is known: the metres must then be seen from above.
pub(super) fn homography(points: &[Point], is_up: Option<bool>) -> Result<(Matrix3<f64>, String), String> {
    let count = points.len();
    if count < 4 {
        return Err(format!("{count} points; a homography needs four or more [[scale.point]]"));
    }
    if points.iter().flat_map(|point| [point.px, point.m]).flatten().any(|x| !x.is_finite()) {
        return Err("a [[scale.point]] is not finite; expected numbers".to_string());
    }
    let map = least_squares(points).ok_or(COLLINEAR)?;
    if !points.iter().all(|point| (map * homogeneous(point.px)).z > 0.0) {
        return Err(BEHIND.to_string());
    }
    if let Some(is_up) = is_up.filter(|is_up| (map.determinant() > 0.0) != *is_up) {
        let direction = if is_up { "up" } else { "down" };
        return Err(format!(
            "the [[scale.point]] are a mirror image: with y_axis = \"{direction}\" in the picture, m must have x \
             to the right and y up as seen from above; expected m turned so, or the other y_axis"
        ));
    }
    let square =
        |point: &Point| (map.transform_point(&point.px.into()) - Point2::from(point.m)).norm_squared();
    let rms = (points.iter().map(square).sum::<f64>() / count as f64).sqrt() * 1e3;
    let exact = if count == 4 { " (exact through four points: not a check)" } else { "" };
    Ok((map, format!("homography from {count} points, residual {rms:.3} mm{exact}")))
}

/// Returns the map of pixels to metres, positive at their mean; `None` if the points do not
/// determine it.
fn least_squares(points: &[Point]) -> Option<Matrix3<f64>> {
    let (pixels, metres): (Vec<_>, Vec<_>) = points.iter().map(|point| (point.px, point.m)).unzip();
    let (from, to) = (normaliser(&pixels)?, normaliser(&metres)?);
    let mut rows = DMatrix::zeros((2 * points.len()).max(9), 9);
    for (i, point) in points.iter().enumerate() {
        let (p, q) = (from * homogeneous(point.px), to * homogeneous(point.m));
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
    let mean: Vector3<f64> = pixels.into_iter().map(homogeneous).sum();
    Some(if (map * mean).z < 0.0 { -map } else { map })
}

fn homogeneous([x, y]: [f64; 2]) -> Vector3<f64> {
    Vector3::new(x, y, 1.0)
}

/// Returns the map of points to mean 0 and mean distance √2; `None` if they lie on a line.
fn normaliser(points: &[[f64; 2]]) -> Option<Matrix3<f64>> {
    let n = points.len() as f64;
    let points = points.iter().map(|point| Vector2::from(*point));
    let mean = points.clone().sum::<Vector2<f64>>() / n;
    let spread: Matrix2<f64> = points.map(|point| (point - mean) * (point - mean).transpose()).sum();
    let (trace, det) = (spread.trace(), spread.determinant());
    if !(trace > 0.0 && trace.is_finite()) || det < 1e-8 * trace * trace {
        return None;
    }
    let scale = (2.0 * n / trace).sqrt();
    Some(Matrix3::new(scale, 0.0, -scale * mean.x, 0.0, scale, -scale * mean.y, 0.0, 0.0, 1.0))
}
