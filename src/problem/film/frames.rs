//! The frames of a shot against the paths of its balls.

use nalgebra::SVector;

use super::camera::{Camera, Point};
use super::dual::{INPUTS, gradient};
use super::impact::{Contact, Correction};
use super::motion::{COEFFICIENTS, Paths, Piece, StatedSpin, Struck, follow_balls};
use super::own::{self, OWN};
use crate::problem::frames::{Columns, Frame, Sight, add_track, whiten};
use crate::problem::sums::{Contribution, Noise};
use crate::problem::unknowns::{CAMERA, Id, Own, PHYSICS, Shared};

/// Derivatives by the coefficients of a piece and by the camera, and the residual.
const ROW: usize = COEFFICIENTS + CAMERA + 1;

/// The frames of a shot.
#[derive(Clone, Debug)]
pub(crate) struct ShotFrames {
    /// Of the cue ball and of the object ball.
    pub tracks: [Vec<Frame>; 2],
    /// Frames per second.
    pub fps: f64,
    /// Side spins of the balls just after the impact that markers show.
    pub spins: Vec<MeasuredSpin>,
}

/// The side spin of a ball just after the impact. Spins about horizontal axes change unevenly: the cloth does
/// not touch a ball that hops.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MeasuredSpin {
    /// 0 for the cue ball, 1 for the object ball.
    pub ball: usize,
    /// rad/s.
    pub spin: f64,
    /// Its standard error, rad/s.
    pub sd: f64,
}

/// What the shots of a film have in common besides unknowns: the collision model, and the noise of
/// each ball.
#[derive(Clone, Copy, Debug)]
pub(crate) struct World {
    pub contact: Contact,
    pub noise: [Noise; 2],
}

impl ShotFrames {
    /// Returns the sums of residuals and derivatives, in units of the noise of each ball.
    pub fn contribute(
        &self,
        values: &Own,
        shared: &Shared,
        spin: &StatedSpin,
        (world, correction): (&World, &Correction),
    ) -> Contribution {
        let World { contact, noise } = world;
        let Ok(paths) = follow_balls(values, shared, spin, (contact, correction)) else {
            return Contribution::impossible(OWN, PHYSICS + CAMERA, 2);
        };
        let mut total = Contribution::empty(OWN, PHYSICS + CAMERA, 2);
        total.sticks = paths.struck.sticks;
        for spin in &self.spins {
            add_spin(spin, &paths.struck, contact.object().radius, &mut total);
        }
        let inputs: [usize; INPUTS] = std::array::from_fn(|i| i);
        let others: [usize; CAMERA + 1] = std::array::from_fn(|i| INPUTS + i);
        let columns = Columns { inputs: &inputs, others: &others };
        for (body, sights) in self.look(values, shared, &paths, noise).into_iter().enumerate() {
            add_track(&mut total, sights, &paths.pieces[body], &columns, [body; 2]);
        }
        total.or_impossible()
    }

    /// Returns the used frames of each ball, whitened; none if the unknowns describe no collision.
    pub fn sights(
        &self,
        values: &Own,
        shared: &Shared,
        spin: &StatedSpin,
        (world, correction): (&World, &Correction),
    ) -> [Vec<Sight<ROW>>; 2] {
        match follow_balls(values, shared, spin, (&world.contact, correction)) {
            Ok(paths) => self.look(values, shared, &paths, &world.noise),
            Err(_) => [Vec::new(), Vec::new()],
        }
    }

    fn look(&self, values: &Own, shared: &Shared, paths: &Paths, noise: &[Noise; 2]) -> [Vec<Sight<ROW>>; 2] {
        let camera = Camera::new(shared);
        [0, 1].map(|body| {
            let Noise { sd, rho } = noise[body];
            whiten(&self.tracks[body], ([rho; 2], self.fps), true, |frame| {
                see(frame, values[own::TIME], &paths.pieces[body], &camera, sd)
            })
        })
    }
}

/// Adds what markers show of a side spin after the impact.
fn add_spin(measured: &MeasuredSpin, struck: &Struck, radius: f64, total: &mut Contribution) {
    let predicted = struck.after[measured.ball].spin[2] / radius;
    let last = total.products.ncols() - 1;
    let by = gradient(&predicted) / measured.sd;
    let off = (predicted.re - measured.spin) / measured.sd;
    let mut block = total.products.fixed_view_mut::<INPUTS, INPUTS>(0, 0);
    block += by * by.transpose();
    let mut beside = total.products.fixed_view_mut::<INPUTS, 1>(0, last);
    beside += by * off;
    total.products[(last, last)] += off * off;
    total.cost += off * off;
}

/// Returns where on the table a ball is on a piece so long after the first guess of the impact, and how high.
pub(super) fn locate(at: &[f64], time: f64) -> (Point, f64) {
    let of = |i: usize| at[3 * i] + at[3 * i + 1] * time + at[3 * i + 2] * (0.5 * time * time);
    (Point::new(of(0), of(1)), of(2))
}

/// Returns the index of the piece that a ball is on in a frame, and the rows of both coordinates.
fn see(
    frame: &Frame,
    instant: f64,
    pieces: &[Piece],
    camera: &Camera,
    sd: f64,
) -> (usize, [SVector<f64, ROW>; 2]) {
    let time = frame.time - instant + camera.delay(frame.seen);
    let index = pieces.partition_point(|piece| piece.start <= time).saturating_sub(1);
    let at = &pieces[index].at;
    let powers = [1.0, time, 0.5 * time * time];
    let (place, height) = locate(at.as_slice(), time);
    let [v_x, v_y, v_h] = [0, 1, 2].map(|i| at[3 * i + 1] + at[3 * i + 2] * time);
    let mut seen = camera.look(place, height);
    // a later reading sees the ball further along its path
    let by_time = seen.by_place * Point::new(v_x, v_y) + seen.by_height * v_h;
    seen.by_camera[Id::ShutterX as usize - PHYSICS] = by_time * frame.seen.x;
    seen.by_camera[Id::ShutterY as usize - PHYSICS] = by_time * frame.seen.y;
    let rows = [0, 1].map(|axis| {
        let by = [seen.by_place[(axis, 0)], seen.by_place[(axis, 1)], seen.by_height[axis]];
        let mut row = SVector::<f64, ROW>::zeros();
        for i in 0..COEFFICIENTS {
            row[i] = by[i / 3] * powers[i % 3];
        }
        for i in 0..CAMERA {
            row[COEFFICIENTS + i] = seen.by_camera[i][axis];
        }
        row[ROW - 1] = seen.place[axis] - frame.seen[axis];
        row * (frame.weight[axis] / sd)
    });
    (index, rows)
}
