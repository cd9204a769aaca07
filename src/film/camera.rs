//! How a camera maps the table to its picture, as small corrections of a film that is calibrated roughly: scale, aspect, shear,
//! perspective, lens and rolling shutter.
//!
//! With p a point of the plane of the balls' centres (m, from the middle of the film), the film shows
//!
//!   q = s (p_x + h a p_y, a p_y)   scale s, aspect a, shear h
//!   q′ = q/(1 + k·q)               perspective k, 1/m
//!   d = q′ − c, f = c + d (1 + l |d|²/r₀²)   lens l: what it adds at r₀ = 0.5 m from its axis, c
//!
//! The first two lines are any projective map but for a turn and a shift of the table, which leave everything that is fitted as it is.
//! The lens distorts the picture that they give, alike in every direction. The film shows the point f at the instant
//! t + τ_x f_x/s + τ_y f_y/(s a), where t is that of the frame: a rolling shutter reads the rows of its sensor one after the other, τ in
//! s/m. Rows lie along x in the picture of a camera that is held upright, and askew in one that was turned.
//! In films that a program made, rows may be those of the table instead, t + τ_x p_x + τ_y p_y, or the lens distort the table, p, before
//! it is shown (`Arrangement`).
//!
//! Sources: Hartley and Zisserman, Multiple View Geometry (2004), § 2.4 (projective maps) and Eq. 7.5 (radial lens); Ait-Aider et
//! al., ECCV 2006 (rolling shutter).

use crate::measurement::correction::Correction;
use crate::measurement::track::{Sample, TrackShot};

/// The distance from the middle of the film at which the lens is stated, m.
const LENS_RADIUS: f64 = 0.5;

/// The equation of the lens is solved to this part of a length, in at most so many steps of Newton's method.
const LENS_TOLERANCE: f64 = 1e-14;
const LENS_STEPS: usize = 20;

/// What in a film comes after what. It matters where a camera looks askew, which shows the more of its picture to a metre of the table the
/// nearer that is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Arrangement {
    /// A rolling shutter reads strips of the table of equal width, instead of rows of the picture as cameras do.
    pub rows_of_table: bool,
    /// The lens distorts the table, and not the picture as lenses do.
    pub lens_first: bool,
}

/// A camera: a value for each correction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    values: [f64; Correction::COUNT],
    /// The middle of the film, from which positions are counted, x and y in m.
    pub middle: [f64; 2],
    pub(crate) arrangement: Arrangement,
}

impl Camera {
    /// A camera that shows the table as it is.
    #[must_use]
    pub fn neutral(middle: [f64; 2]) -> Self {
        Self { values: Correction::ALL.map(Correction::neutral), middle, arrangement: Arrangement::default() }
    }

    /// The value of a correction, in the unit of [`Correction::words`].
    #[must_use]
    pub fn get(&self, correction: Correction) -> f64 {
        self.values[correction as usize]
    }

    /// The same camera with another value of a correction.
    #[must_use]
    pub fn with(mut self, correction: Correction, value: f64) -> Self {
        self.values[correction as usize] = value;
        self
    }

    /// Whether the camera shows the table as it is.
    pub(crate) fn is_neutral(&self) -> bool {
        self.values == Self::neutral(self.middle).values
    }

    /// Table → film, m.
    #[must_use]
    pub fn film(&self, table: [f64; 2]) -> [f64; 2] {
        let [scale, aspect, shear, kx, ky, lens, cx, cy, ..] = self.values;
        let p = [table[0] - self.middle[0], table[1] - self.middle[1]];
        let askew = |p: [f64; 2]| {
            // q = s (p_x + h a p_y, a p_y)
            let q = [scale * (p[0] + shear * aspect * p[1]), scale * aspect * p[1]];
            // q′ = q/(1 + k·q)
            let shrunk = 1.0 + kx * q[0] + ky * q[1];
            q.map(|q| q / shrunk)
        };
        let through_lens = |q: [f64; 2]| {
            // d = q′ − c, f = c + d (1 + l |d|²/r₀²)
            let d = [q[0] - cx, q[1] - cy];
            let stretched = 1.0 + lens * (d[0] * d[0] + d[1] * d[1]) / (LENS_RADIUS * LENS_RADIUS);
            [cx + d[0] * stretched, cy + d[1] * stretched]
        };
        let f = if self.arrangement.lens_first { askew(through_lens(p)) } else { through_lens(askew(p)) };
        [f[0] + self.middle[0], f[1] + self.middle[1]]
    }

    /// Film → table, m; NaN where no point of the table is shown.
    #[must_use]
    pub fn table(&self, film: [f64; 2]) -> [f64; 2] {
        let [scale, aspect, shear, kx, ky, lens, cx, cy, ..] = self.values;
        let f = [film[0] - self.middle[0], film[1] - self.middle[1]];
        let upright = |q: [f64; 2]| {
            // q = q′/(1 − k·q′)
            let shrunk = 1.0 - (kx * q[0] + ky * q[1]);
            if !(shrunk > 0.0) {
                return [f64::NAN; 2];
            }
            let q = q.map(|q| q / shrunk);
            // p = ((q_x − h q_y)/s, q_y/(s a))
            [(q[0] - shear * q[1]) / scale, q[1] / (scale * aspect)]
        };
        let without_lens = |f: [f64; 2]| {
            let d = [f[0] - cx, f[1] - cy];
            let straight = unstretched(lens, d[0].hypot(d[1]));
            [cx + d[0] * straight, cy + d[1] * straight]
        };
        let p = if self.arrangement.lens_first { without_lens(upright(f)) } else { upright(without_lens(f)) };
        [p[0] + self.middle[0], p[1] + self.middle[1]]
    }

    /// By how much later a rolling shutter reads a point, in seconds by the unit of each of the two corrections for it.
    pub(crate) fn delays(&self, film: [f64; 2], table: [f64; 2]) -> [f64; 2] {
        let (scale, aspect) = (self.get(Correction::Scale), self.get(Correction::Aspect));
        if self.arrangement.rows_of_table {
            return [0, 1].map(|i| table[i] - self.middle[i]);
        }
        [(film[0] - self.middle[0]) / scale, (film[1] - self.middle[1]) / (scale * aspect)]
    }

    /// How the point of the table that a point of the film shows follows the corrections of places, m by the unit of each.
    pub(crate) fn derivatives(&self, film: [f64; 2]) -> [[f64; 2]; Correction::COUNT] {
        /// Of each, in usual errors: the map is smooth over far more.
        const STEP: f64 = 1e-4;
        Correction::ALL.map(|correction| {
            if !correction.is_of_place() {
                return [0.0; 2];
            }
            let (value, step) = (self.get(correction), STEP * correction.usual());
            let at = |by: f64| self.with(correction, value + by).table(film);
            let (up, down) = (at(step), at(-step));
            [0, 1].map(|i| (up[i] - down[i]) / (2.0 * step))
        })
    }

    /// Lengths on the table over lengths in the film near a point of it, along x and along y.
    pub(crate) fn magnification(&self, film: [f64; 2]) -> [f64; 2] {
        /// A millimetre: the map is nearly straight over it.
        const STEP: f64 = 1e-3;
        let here = self.table(film);
        let by = |shift: [f64; 2]| {
            let there = self.table([film[0] + shift[0], film[1] + shift[1]]);
            (there[0] - here[0]).hypot(there[1] - here[1]) / STEP
        };
        [by([STEP, 0.0]), by([0.0, STEP])]
    }

    /// A shot on the table, from its film; samples that show no point of the table are left out.
    #[must_use]
    pub fn shot(&self, film: &TrackShot) -> TrackShot {
        if self.is_neutral() {
            return film.clone();
        }
        let samples = |samples: &[Sample]| -> Vec<Sample> {
            let on_table = samples.iter().map(|sample| self.sample(sample));
            on_table.filter(|sample| sample.x.is_finite() && sample.y.is_finite()).collect()
        };
        let magnified = film.cue.first().map_or([1.0; 2], |sample| self.magnification([sample.x, sample.y]));
        let mean = (magnified[0] * magnified[1]).sqrt();
        let mut shot = film.clone();
        (shot.cue, shot.object) = (samples(&film.cue), samples(&film.object));
        for marker in &mut shot.markers {
            marker.samples = samples(&marker.samples);
        }
        shot.position_sd = shot.position_sd.map(|sd| sd * mean);
        shot.resolution = shot.resolution.map(|step| step * mean);
        shot
    }

    /// A frame on the table, at the instant at which its place was read.
    fn sample(&self, film: &Sample) -> Sample {
        let [x, y] = self.table([film.x, film.y]);
        let [by_x, by_y] = self.delays([film.x, film.y], [x, y]);
        let t = film.t + self.get(Correction::ShutterX) * by_x + self.get(Correction::ShutterY) * by_y;
        let sd = film.sd.map(|sd| {
            let magnified = self.magnification([film.x, film.y]);
            [0, 1].map(|i| sd[i] * magnified[i])
        });
        Sample { t, x, y, sd }
    }
}

/// |d|/|d′| with |d′| = |d| (1 + l |d|²/r₀²); NaN beyond the largest |q′| that a barrel shows.
fn unstretched(lens: f64, shown: f64) -> f64 {
    let strength = lens / (LENS_RADIUS * LENS_RADIUS);
    if strength == 0.0 || shown == 0.0 {
        return 1.0;
    }
    // r (1 + c r²) = r′ by Newton's method
    let mut r = shown;
    for _ in 0..LENS_STEPS {
        let slope = 1.0 + 3.0 * strength * r * r;
        if !(slope > 0.0) {
            return f64::NAN;
        }
        let step = (shown - r * (1.0 + strength * r * r)) / slope;
        r += step;
        if step.abs() < LENS_TOLERANCE * shown {
            return r / shown;
        }
    }
    f64::NAN
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Some twenty operations on numbers of order 1.
    const ROUNDING: f64 = 1e-13;

    fn askew() -> Camera {
        let values = [1.02, 0.99, 0.03, 0.1, -0.2, -0.02, 0.1, -0.05, 0.001, 0.003, 0.2, 0.1, 0.5];
        Camera { values, ..Camera::neutral([0.3, -0.1]) }
    }

    #[test]
    fn film_and_table_are_inverse() {
        let camera = askew();
        for table in [[0.3, -0.1], [0.8, 0.3], [-0.2, -0.6], [0.31, 0.5]] {
            let there = camera.table(camera.film(table));
            assert!((0..2).all(|i| (there[i] - table[i]).abs() < ROUNDING), "{table:?} {there:?}");
        }
        let neutral = Camera::neutral([0.3, -0.1]);
        assert!(neutral.is_neutral() && !camera.is_neutral());
        let same = neutral.film([0.5, 0.25]);
        assert!((same[0] - 0.5).abs() < ROUNDING && (same[1] - 0.25).abs() < ROUNDING);
    }

    #[test]
    fn what_shows_no_point_of_the_table_is_none() {
        let steep = Camera::neutral([0.0; 2]).with(Correction::PerspectiveY, 1.0);
        assert!(steep.table([0.0, 1.5])[1].is_nan());
        let barrel = Camera::neutral([0.0; 2]).with(Correction::Lens, -0.05);
        assert!(barrel.table([2.0, 0.0])[0].is_nan());
    }

    #[test]
    fn derivatives_are_those_of_the_map() {
        /// Central differences of steps ten times as long.
        const SAME: f64 = 1e-6;
        let (camera, film) = (askew(), [0.7, 0.2]);
        for (correction, by) in Correction::ALL.into_iter().zip(camera.derivatives(film)) {
            if !correction.is_of_place() {
                assert_eq!(by, [0.0; 2]);
                continue;
            }
            let step = 1e-3 * correction.usual();
            let at = |by: f64| camera.with(correction, camera.get(correction) + by).table(film);
            for i in 0..2 {
                let difference = (at(step)[i] - at(-step)[i]) / (2.0 * step);
                assert!((by[i] - difference).abs() < SAME, "{correction:?}");
            }
        }
    }
}
