//! Two discs as a shot of two equal balls, the second at rest: what the collision model says of e and
//! of the friction between them is the same.

use nalgebra::{DMatrix, DVector, SMatrix};

use super::motion::{Dual, INPUTS, InputCovariance};
use super::quantities::Known;
use crate::measurement::dataset::{Before, Joint, Measured, Measurement, Shared, Shot};
use crate::measurement::observable::Observable;
use crate::measurement::spin::Spin;
use crate::measurement::track::TrackShot;
use crate::physics::ball::{Ball, Vec3};
use crate::physics::disc::Discs;
use crate::problem::film::dual::gradient;

const PLACES: usize = 6;

/// Smallest standard deviation: keeps what is held finite.
const LEAST_SD: f64 = 1e-9;

/// The equal discs: direction of the line of centres, velocity of the first before the impact, its spin
/// times the radius that both have, e and J_t/J_n; with their covariance.
#[derive(Clone, Debug)]
pub(super) struct Equal {
    values: [f64; PLACES],
    covariance: SMatrix<f64, PLACES, PLACES>,
    /// Whether the rotation of both discs was seen.
    turns: bool,
    /// Whether the slip and J_t/J_n are known.
    knows_slip: bool,
}

impl Known<'_> {
    /// Returns the equal discs. In the frame of the second disc before the impact the first has U = −g.
    /// Their slip is g_t − R(ω + Ω), so that all of R₁ω₁ + R₂ω₂ may be the first one's. J_t changes the
    /// slip by (1 + 1/ν)(1/m₁ + 1/m₂) J_t, so that J_t/J_n does not follow from how masses or radii
    /// differ.
    pub(super) fn equal(&self, inputs: &InputCovariance) -> Equal {
        let [first, second] = self.impact.velocities;
        let towards = first[0] - second[0];
        let turns = self.turns == [true; 2];
        let rim = |disc: usize| self.impact.spins[disc][0] * self.impact.radii[disc];
        let rims = if turns { rim(0) + rim(1) } else { Dual::from_re(0.0) };
        let [e, ratio] = self.outcome();
        let all = [self.impact.direction, towards.x, towards.y, rims, e, ratio];
        let by = SMatrix::<f64, PLACES, INPUTS>::from_fn(|i, j| gradient(&all[i])[j]);
        Equal {
            values: all.map(|dual| dual.re),
            covariance: by * inputs * by.transpose(),
            turns,
            knows_slip: self.knows_slip,
        }
    }
}

/// Returns the ball that stands for either of the equal discs, of discs that were measured to have these
/// radii (m) if none are stated. Its mass cancels; if the masses of the
/// discs are not stated it means nothing.
pub(crate) fn ball(discs: &Discs, radii: Option<[f64; 2]>) -> Ball {
    let radii = discs.radii.or(radii).unwrap_or([1.0; 2]);
    let mass = discs.masses.map_or(Ball::POOL.mass, |[first, second]| 0.5 * (first + second));
    Ball { radius: 0.5 * (radii[0] + radii[1]), inertia: discs.inertia, mass }
}

impl Equal {
    /// Returns the shot of the equal discs, which has the same restitution and the same friction. If the
    /// rotation of a disc was not seen, the slip is free and takes J_t/J_n up, so that e is left, unless
    /// the data set states that neither disc turns before the impact.
    pub fn shot(&self, track: &TrackShot, ball: &Ball) -> Shot {
        let Equal { values, covariance, turns, knows_slip } = self;
        // ω of the equal discs is the speed of the rims over their radius
        let scale = |i: usize| if i == 3 { 1.0 / ball.radius } else { 1.0 };
        // behind ω_x and ω_y in a joint covariance, which are 0
        let place = |i: usize| if i < 3 { i } else { i + 2 };
        let count = if *knows_slip { PLACES } else { PLACES - 1 };
        let mut joint = Joint {
            covariance: DMatrix::zeros(place(count), place(count)),
            by_shared: vec![DVector::zeros(place(count)); Shared::ALL.len()],
        };
        for i in 0..count {
            for j in 0..count {
                joint.covariance[(place(i), place(j))] = covariance[(i, j)] * scale(i) * scale(j);
            }
        }
        let sd = |i: usize| covariance[(i, i)].sqrt().max(LEAST_SD) * scale(i);
        let measured = |i: usize| Measured::new(values[i] * scale(i), sd(i));
        let (sin, cos) = values[0].sin_cos();
        // of second order if the other component is 0
        let component = |value: f64, across: f64| Measured::new(value, (sd(0) * across).hypot(sd(0) * sd(0)));
        let spin =
            Spin::Measured { spin: Vec3::new(0.0, 0.0, measured(3).value), sd: [None, None, measured(3).sd] };
        let after = [(Observable::Restitution, 4), (Observable::ImpulseRatio, 5)];
        let after = after.into_iter().take(count - 4);
        Shot {
            name: track.name.clone(),
            file: track.file.clone(),
            line: track.line,
            labels: track.labels.clone(),
            before: Before::Impact {
                normal: [component(cos, sin), component(sin, cos)],
                velocity: [measured(1), measured(2)],
            },
            // e does not depend on it
            spin: if *turns { spin } else { Spin::Stun },
            after: after.map(|(observable, i)| Measurement { observable, measured: measured(i) }).collect(),
            joint: Some(Box::new(joint)),
            side_sd: 0.0,
        }
    }
}
