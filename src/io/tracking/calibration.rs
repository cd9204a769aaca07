//! Calibration of a file's lengths: to metres on the table, x right and y up as seen from above.

use nalgebra::{DMatrix, Matrix3, Vector3};

/// Map from a file's coordinates to metres.
#[derive(Clone, Debug)]
pub(super) struct Calibration {
    map: Map,
    readout: Option<ReadOut>,
}

#[derive(Clone, Debug)]
enum Map {
    /// `up` is 1 or −1. The divisor is a whole number for every unit, so that 5.6 cm is 0.056 m.
    Linear {
        factor: f64,
        divisor: f64,
        up: f64,
    },
    Homography(Matrix3<f64>),
}

/// A rolling shutter: the rows of a picture are exposed one after the other, from the top.
#[derive(Clone, Copy, Debug)]
pub(super) struct ReadOut {
    /// Time from the first row to the last, s.
    pub(crate) seconds: f64,
    pub(crate) rows: f64,
    /// Whether the file's y grows from the bottom of the picture upwards.
    pub(crate) up: bool,
}

impl Calibration {
    /// Returns a calibration by a scale: metres are `factor / divisor` of the file's unit.
    pub(super) fn linear(factor: f64, divisor: f64, up: bool, readout: Option<ReadOut>) -> Self {
        Self { map: Map::Linear { factor, divisor, up: if up { 1.0 } else { -1.0 } }, readout }
    }

    /// Returns the calibration by least squares over pairs of pixels and metres (direct linear
    /// transform of normalised points), and a note on its residuals. `up` is the direction of the
    /// pixels' y axis if it is known: the metres must then be seen from above.
    pub(super) fn homography(
        pairs: &[([f64; 2], [f64; 2])],
        up: Option<bool>,
        readout: Option<ReadOut>,
    ) -> Result<(Self, String), String> {
        if pairs.len() < 4 {
            return Err(format!("{} points; a homography needs four or more [[scale.point]]", pairs.len()));
        }
        if pairs.iter().any(|(px, m)| px.iter().chain(m).any(|x| !x.is_finite())) {
            return Err("a [[scale.point]] is not finite; expected numbers".to_string());
        }
        let (pixels, metres): (Vec<_>, Vec<_>) = pairs.iter().copied().unzip();
        let collinear = "the [[scale.point]] lie on one line, or all but one do; expected four of which no three are on a line";
        let (from, to) = (normaliser(&pixels).ok_or(collinear)?, normaliser(&metres).ok_or(collinear)?);
        let mut rows = DMatrix::zeros((2 * pairs.len()).max(9), 9);
        for (i, (px, m)) in pairs.iter().enumerate() {
            let (p, q) = (from * homogeneous(px), to * homogeneous(m));
            for k in 0..3 {
                rows[(2 * i, k)] = p[k];
                rows[(2 * i, 6 + k)] = -q.x * p[k];
                rows[(2 * i + 1, 3 + k)] = p[k];
                rows[(2 * i + 1, 6 + k)] = -q.y * p[k];
            }
        }
        let svd = rows.svd(false, true);
        let v = svd.v_t.ok_or(collinear)?;
        let mut order: Vec<usize> = (0..9).collect();
        order.sort_by(|a, b| svd.singular_values[*a].total_cmp(&svd.singular_values[*b]));
        // two solutions: the points do not determine it
        if svd.singular_values[order[1]] < 1e-6 * svd.singular_values[order[8]] {
            return Err(collinear.to_string());
        }
        let normalised = Matrix3::from_row_iterator(v.row(order[0]).iter().copied());
        let back = to.try_inverse().ok_or(collinear)?;
        let mut map = back * normalised * from;
        let mean: Vector3<f64> = pixels.iter().map(homogeneous).sum();
        if (map * mean).z < 0.0 {
            map = -map;
        }
        if !pixels.iter().all(|p| (map * homogeneous(p)).z > 0.0) {
            let message = "the [[scale.point]] cannot be pictures of points in one plane in front of a camera; expected each \
                           px with its own m";
            return Err(message.to_string());
        }
        let calibration = Self { map: Map::Homography(map), readout };
        if let Some(up) = up
            && (map.determinant() > 0.0) != up
        {
            let down = if up { "up" } else { "down" };
            return Err(format!(
                "the [[scale.point]] are a mirror image: with y_axis = \"{down}\" in the picture, m must have x \
                 to the right and y up as seen from above; expected m turned so, or the other y_axis"
            ));
        }
        let squares: f64 = pairs
            .iter()
            .map(|(px, m)| {
                let at = calibration.metres(px[0], px[1]);
                (at[0] - m[0]).powi(2) + (at[1] - m[1]).powi(2)
            })
            .sum();
        let rms = (squares / pairs.len() as f64).sqrt() * 1e3;
        let exact = if pairs.len() == 4 { " (exact through four points: not a check)" } else { "" };
        let note = format!("homography from {} points, residual {rms:.3} mm{exact}", pairs.len());
        Ok((calibration, note))
    }

    pub(super) fn metres(&self, x: f64, y: f64) -> [f64; 2] {
        match &self.map {
            Map::Linear { factor, divisor, up } => [factor * x / divisor, factor * up * y / divisor],
            Map::Homography(h) => {
                let p = h * Vector3::new(x, y, 1.0);
                [p.x / p.z, p.y / p.z]
            }
        }
    }

    /// Returns standard deviations in metres at a position; arguments are in the file's unit.
    pub(super) fn sd(&self, x: f64, y: f64, sd: [f64; 2]) -> [f64; 2] {
        match &self.map {
            Map::Linear { factor, divisor, .. } => sd.map(|sd| factor * sd / divisor),
            Map::Homography(h) => {
                let p = h * Vector3::new(x, y, 1.0);
                let row = |i: usize| {
                    let d = |k: usize| (h[(i, k)] - p[i] / p.z * h[(2, k)]) / p.z;
                    (d(0) * sd[0]).hypot(d(1) * sd[1])
                };
                [row(0), row(1)]
            }
        }
    }

    /// Returns the time between the first row of a picture and a position, s.
    pub(super) fn delay(&self, y: f64) -> f64 {
        self.readout.map_or(0.0, |readout| {
            let row = if readout.up { readout.rows - y } else { y };
            readout.seconds * row / readout.rows
        })
    }

    /// Returns the calibration of a file with another unit, of `factor / divisor` metres.
    pub(super) fn in_unit(&self, (factor, divisor): (f64, f64)) -> Self {
        match self.map {
            Map::Linear { up, .. } => Self::linear(factor, divisor, up > 0.0, None),
            Map::Homography(_) => self.clone(),
        }
    }
}

fn homogeneous([x, y]: &[f64; 2]) -> Vector3<f64> {
    Vector3::new(*x, *y, 1.0)
}

/// Returns the map of points to mean 0 and mean distance √2; `None` if they lie on a line.
fn normaliser(points: &[[f64; 2]]) -> Option<Matrix3<f64>> {
    let n = points.len() as f64;
    let mean = [0, 1].map(|k| points.iter().map(|p| p[k]).sum::<f64>() / n);
    let (mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0);
    for p in points {
        let (dx, dy) = (p[0] - mean[0], p[1] - mean[1]);
        (xx, xy, yy) = (xx + dx * dx, xy + dx * dy, yy + dy * dy);
    }
    let (trace, det) = (xx + yy, xx * yy - xy * xy);
    if !(trace > 0.0 && trace.is_finite()) || det < 1e-8 * trace * trace {
        return None;
    }
    let scale = (2.0 * n / trace).sqrt();
    Some(Matrix3::new(scale, 0.0, -scale * mean[0], 0.0, scale, -scale * mean[1], 0.0, 0.0, 1.0))
}
