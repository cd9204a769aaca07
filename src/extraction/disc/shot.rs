//! Two discs as a shot of two equal balls, the second at rest: what the collision model then says of e
//! and of the friction between them is the same.

use nalgebra::{DMatrix, DVector, SMatrix, SVector};

use super::quantities::Known;
use super::unknowns::INPUTS;
use super::{DiscImpact, Dual, Quantity, gradient, value};
use crate::measurement::dataset::{Before, DiscShot, Joint, Measured, Measurement, Shared, Shot};
use crate::measurement::observable::Observable;
use crate::measurement::spin::Spin;
use crate::measurement::track::TrackShot;
use crate::physics::ball::{Ball, Vec3};
use crate::physics::disc::Discs;

/// The equal discs: direction, velocity of the first before, its spin (times the radius that both have), e and J_t/J_n; with
/// their covariance.
#[derive(Clone, Debug)]
pub(super) struct Equal {
    values: [f64; PLACES],
    covariance: SMatrix<f64, PLACES, PLACES>,
    /// How they move in each way in which the camera may be off.
    by_camera: Vec<SVector<f64, PLACES>>,
    turning: bool,
    /// Whether J_t/J_n was measured.
    has_ratio: bool,
}

const PLACES: usize = 6;

impl Known {
    /// In the frame of the second disc before the impact the first has U = −g. Their slip is g_t − R(ω + Ω), so that all of
    /// R₁ω₁ + R₂ω₂ may be the first one's. J_t changes the slip by (1 + 1/ν)(1/m₁ + 1/m₂) J_t, so that J_t/J_n does not follow from
    /// how masses or radii differ.
    pub(super) fn equal(&self) -> Equal {
        let (sin, cos) = num_dual::DualNum::sin_cos(&self.direction());
        let table = |[n, t]: [Dual; 2]| [n * cos - t * sin, n * sin + t * cos];
        let (g, h) = (self.relative(0), self.relative(1));
        let [ux, uy] = table(g.map(|g| -g));
        let rim = self.rim(0);
        let all = [
            self.direction(),
            ux,
            uy,
            rim.unwrap_or_else(|| ux * 0.0),
            -h[0] / g[0],
            (h[1] - g[1]) / (h[0] - g[0]),
        ];
        let by = SMatrix::<f64, PLACES, INPUTS>::from_fn(|i, j| gradient(&all[i])[j]);
        Equal {
            values: all.map(|dual| value(&dual)),
            covariance: by * self.covariance * by.transpose(),
            by_camera: self.by_camera.iter().map(|moved| by * moved).collect(),
            turning: rim.is_some(),
            has_ratio: self.is_seen_across(),
        }
    }
}

/// The ball that stands for either of the equal discs. Its mass cancels; where the discs' masses are not stated it means nothing.
#[must_use]
pub fn ball(discs: &Discs, impacts: &[&DiscImpact]) -> Ball {
    let radius = |[first, second]: [f64; 2]| 0.5 * (first + second);
    let radius = radius(discs.radii.or(impacts.first().map(|impact| impact.radii)).unwrap_or([1.0; 2]));
    let mass = discs.masses.map_or(Ball::POOL.mass, |[first, second]| 0.5 * (first + second));
    Ball { radius, inertia: discs.inertia, mass }
}

impl DiscImpact {
    /// The shot of equal discs that has the same restitution and the same friction. Where a disc's rotation was not seen, the slip
    /// is free and takes J_t/J_n up, so that e is left, unless the data set states that neither disc turns before the impact.
    #[must_use]
    pub fn shot(&self, track: &TrackShot, ball: &Ball) -> Shot {
        let Equal { values, covariance, by_camera, turning, has_ratio } = &self.equal;
        // ω of the equal discs is the rims' speed over their radius
        let scale = |i: usize| if i == 3 { 1.0 / ball.radius } else { 1.0 };
        // behind ω_x and ω_y in a joint covariance, which are 0
        let place = |i: usize| if i < 3 { i } else { i + 2 };
        let knows_slip = *has_ratio && (*turning || track.spin == Spin::Stun);
        let count = if knows_slip { PLACES } else { PLACES - 1 };
        let places = place(count);
        let mut joint = Joint {
            covariance: DMatrix::zeros(places, places),
            by_shared: vec![DVector::zeros(places); Shared::ALL.len() + by_camera.len()],
        };
        for i in 0..count {
            for (way, moved) in by_camera.iter().enumerate() {
                joint.by_shared[Shared::Camera(way).place()][place(i)] = moved[i] * scale(i);
            }
            for j in 0..count {
                joint.covariance[(place(i), place(j))] = covariance[(i, j)] * scale(i) * scale(j);
            }
        }
        let measured = |i: usize| Measured {
            value: values[i] * scale(i),
            sd: Some(covariance[(i, i)].max(0.0).sqrt() * scale(i)),
        };
        let (sin, cos) = values[0].sin_cos();
        let sd = covariance[(0, 0)].max(0.0).sqrt();
        let normal =
            // of second order where the other component is 0
            [(cos, sin), (sin, cos)].map(|(value, across)| Measured { value, sd: Some((sd * across).hypot(sd * sd)) });
        let spin =
            Spin::Measured { spin: Vec3::new(0.0, 0.0, measured(3).value), sd: [None, None, measured(3).sd] };
        let after = [(Observable::Restitution, 4), (Observable::ImpulseRatio, 5)];
        let after = after.into_iter().take(count - 4);
        Shot {
            name: track.name.clone(),
            file: track.file.clone(),
            line: track.line,
            labels: track.labels.clone(),
            before: Before::Impact { normal, velocity: [measured(1), measured(2)] },
            // e does not depend on it
            spin: if *turning { spin } else { Spin::Stun },
            after: after.map(|(observable, i)| Measurement { observable, measured: measured(i) }).collect(),
            joint: Some(Box::new(joint)),
            side_sd: 0.0,
        }
    }

    /// The row of this shot in the table of a fit.
    pub(crate) fn of_table(&self, track: &TrackShot) -> DiscShot {
        let get = |quantity| self.get(quantity);
        DiscShot {
            name: track.name.clone(),
            restitution: get(Quantity::Restitution),
            impulse_ratio: get(Quantity::ImpulseRatio),
            momentum: [Quantity::MomentumAlong, Quantity::MomentumAcross].map(get),
            angular_momentum: get(Quantity::AngularMomentum),
            energy_lost: get(Quantity::EnergyLost),
            closing_speed: get(Quantity::ClosingSpeed),
            slip_ratio: get(Quantity::SlipRatio),
            sticks: self.stuck.is_some(),
            doubts: self.doubts.join("; "),
        }
    }
}
