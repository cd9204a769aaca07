//! Forward through the camera: from a place on the table and a height above it to the picture, with
//! all derivatives.
//!
//! The place on the table is p (m, from the middle of the film), and the height of the ball's
//! centre above its height at rest is h:
//!
//! ```text
//! l  = p + h (a + n p)                       parallax a, nearness n
//! f  = s (l_x + g r l_y, r l_y)              scale s, aspect r, shear g
//! q  = f/(1 + k·f)                           perspective k, 1/m
//! P  = q (1 + c ρ² + 2 d·q/r₀²) + d ρ²       lens c, decentring d, ρ² = |q|²/r₀²
//! ```
//!
//! Sources: Hartley and Zisserman, Multiple View Geometry (2004), § 2.4; Brown, Photogrammetric
//! Engineering 37 (1971) 855. Decentring is linear in its coefficients, so that it is determined
//! even if the lens has no radial distortion.

use nalgebra::{Matrix2, Vector2};

use crate::problem::unknowns::{CAMERA, PHYSICS, Shared};

/// Square of the distance r₀ = 0.5 m from the middle at which the lens is stated, m².
const LENS_SQUARE: f64 = 0.25;

/// A place on the table or in the picture, m.
pub(crate) type Point = Vector2<f64>;

/// A ball in the picture.
pub(crate) struct Seen {
    /// Place in the picture, m from its middle.
    pub(crate) place: Point,
    /// Derivative by the place on the table.
    pub(crate) by_place: Matrix2<f64>,
    /// Derivative by the height above the table.
    pub(crate) by_height: Point,
    /// Derivatives by the unknowns of the camera in their order; those by the shutter
    /// and by what a tracker does are 0, as they follow from the motion and the other ball.
    pub(crate) by_camera: [Point; CAMERA],
}

/// The map from table to picture: the unknowns from `Scale` to `ObjectScale`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Camera([f64; CAMERA]);

impl Camera {
    /// Values of no camera.
    pub const NONE: Self = Self([0.0; CAMERA]);

    pub fn new(shared: &Shared) -> Self {
        Self(std::array::from_fn(|i| shared.0[PHYSICS + i]))
    }

    /// Returns the unknown of this place in their order.
    pub fn get(&self, place: usize) -> f64 {
        self.0[place]
    }

    /// Returns how much later than the frame a body is where this place of the picture shows it, s:
    /// a rolling shutter reads it later, and the second body, whose frames last `frame` s, may be
    /// shown late. `frame` is 0 for the first body.
    pub(crate) fn delay(&self, picture: Point, frame: f64) -> f64 {
        let [.., x, y, _, _, _, late, _, _, _, _] = self.0;
        x * picture.x + y * picture.y - late * frame
    }

    /// Returns where a tracker finds a body, the first (0) or the second (1). The second, at P in the
    /// picture, is found at w P + a: light and shade change its scale by w and move it by a.
    pub(crate) fn find_tracked(&self, body: usize, mut seen: Seen) -> Seen {
        if body == 0 {
            return seen;
        }
        let [.., x, y, scale] = self.0;
        seen.by_camera.iter_mut().for_each(|by| *by *= scale);
        let [.., by_x, by_y, by_scale] = &mut seen.by_camera;
        (*by_x, *by_y, *by_scale) = (Point::x(), Point::y(), seen.place);
        seen.place = seen.place * scale + Point::new(x, y);
        seen.by_place *= scale;
        seen.by_height *= scale;
        seen
    }

    /// Returns the place on the table of a ball at rest height that is seen at a place of the
    /// picture, by Newton's method.
    pub fn find(&self, picture: Point) -> Option<Point> {
        /// With a lens that errs by 10 % at the edge the third step is less than 1e-9 m.
        const STEPS: usize = 4;
        let mut table = picture;
        for _ in 0..STEPS {
            let seen = self.look(table, 0.0);
            table += seen.by_place.try_inverse()? * (picture - seen.place);
        }
        Some(table)
    }

    /// Returns the picture of a ball at `table`, m from the middle of the film, `height` m above
    /// its height at rest.
    pub fn look(&self, table: Point, height: f64) -> Seen {
        let [scale, aspect, shear, k_x, k_y, lens, d_x, d_y, _, _, a_x, a_y, nearness, ..] = self.0;
        let [perspective, decentring, parallax] = [[k_x, k_y], [d_x, d_y], [a_x, a_y]].map(Point::from);
        // l = p + h (a + n p)
        let lifted = table + (parallax + table * nearness) * height;
        // f = s (l_x + g r l_y, r l_y)
        let affine = Matrix2::new(1.0, shear * aspect, 0.0, aspect) * scale;
        let flat = affine * lifted;
        // q = f/(1 + k·f)
        let depth = 1.0 + perspective.dot(&flat);
        let askew = flat / depth;
        // P = q (1 + c ρ² + 2 d·q/r₀²) + d ρ²
        let (square, off) = (askew.norm_squared() / LENS_SQUARE, decentring.dot(&askew) / LENS_SQUARE);
        let stretch = 1.0 + lens * square + 2.0 * off;
        let place = askew * stretch + decentring * square;

        let by_askew = Matrix2::identity() * stretch
            + (askew * (askew * lens + decentring).transpose() + decentring * askew.transpose())
                * (2.0 / LENS_SQUARE);
        let by_flat = by_askew * (Matrix2::identity() - askew * perspective.transpose()) / depth;
        let by_lifted = by_flat * affine;
        let by_depth = by_askew * askew / -depth;
        let mut by_camera = [Point::zeros(); CAMERA];
        let by_places = [
            by_flat * flat / scale,
            by_flat * Point::new(shear, 1.0) * (scale * lifted.y),
            by_flat.column(0) * (scale * aspect * lifted.y),
            by_depth * flat.x,
            by_depth * flat.y,
            askew * square,
            askew * (2.0 * askew.x / LENS_SQUARE) + Point::x() * square,
            askew * (2.0 * askew.y / LENS_SQUARE) + Point::y() * square,
            Point::zeros(),
            Point::zeros(),
            by_lifted.column(0) * height,
            by_lifted.column(1) * height,
            by_lifted * table * height,
        ];
        by_camera[..by_places.len()].copy_from_slice(&by_places);
        Seen {
            place,
            by_place: by_lifted * (1.0 + nearness * height),
            by_height: by_lifted * (parallax + table * nearness),
            by_camera,
        }
    }
}
