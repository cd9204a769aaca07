//! A film's measured numbers against the model, one by one.

use super::{Film, OWN, Own, SHARED, SPIN, Shared, before_impact};
use crate::likelihood::corrected::Corrected;
use crate::measurement::correction::Correction;
use crate::measurement::observable::Axis;
use crate::measurement::track::TrackedBall;
use crate::physics::cloth_motion::{Cloth, Path};

/// The kind of a number that is measured of a ball.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Measured {
    /// A coordinate in a frame, m.
    Coordinate,
    /// A component of the cue ball's spin before the impact, rad/s, table frame.
    SpinBefore,
    /// A component of a spin that markers show after the impact, rad/s, table frame.
    SpinAfter,
}

/// A measured number, SI units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Row {
    /// The ball.
    pub ball: TrackedBall,
    /// The kind of the number.
    pub quantity: Measured,
    /// The axis of the component.
    pub axis: Axis,
    /// When a coordinate was measured, s.
    pub time: Option<f64>,
    /// The measured value.
    pub measured: f64,
    /// The value that the model predicts. For a spin that markers show, the components before it are taken into
    /// account, since their errors are correlated.
    pub predicted: f64,
    /// The standard deviation; for a spin that markers show, what remains of it once the components before it are
    /// known.
    pub sd: f64,
}

impl Row {
    /// (measured − predicted) / sd, dimensionless.
    #[must_use]
    pub fn standardized(&self) -> f64 {
        (self.measured - self.predicted) / self.sd
    }
}

impl Film {
    /// Every measured number of the shot against what the parameters and its own unknowns say. The squares of the standardized
    /// ones sum to χ² of the shot, less [`Film::prior_chi2`]. `None` where there is no collision.
    pub(crate) fn rows(&self, collision: &Corrected, shared: &Shared, own: &Own) -> Option<Vec<Row>> {
        let spins = self.spin.is_some().then(|| [own[OWN], own[OWN + 1], own[OWN + 2]]);
        let one = if self.one_unknown().is_some() { own[OWN] } else { 0.0 };
        let off: [f64; Correction::COUNT] = std::array::from_fn(|i| shared[SHARED + i]);
        let (launches, after) =
            self.launches(&own.as_slice()[..OWN], (spins, one), shared, |inputs| collide(collision, inputs))?;
        let cloth = Cloth { sliding: shared[3], rolling: shared[4], bounce: shared[5] };
        let time = own[0];
        let paths = [
            (
                &self.cue,
                TrackedBall::Cue,
                Path::before(&launches.before, &cloth),
                self.scene.seen(Path::after(&launches.cue, &cloth)),
            ),
            (
                &self.object,
                TrackedBall::Object,
                Path::at_rest(&launches.object),
                self.scene.seen(Path::after(&launches.object, &cloth)),
            ),
        ];
        let mut rows = Vec::new();
        for (frames, ball, before, later) in paths {
            for (frame, shift) in frames.frames() {
                let predicted = if frame.t < time { &before } else { &later }.position(frame.t);
                for (i, axis) in [Axis::X, Axis::Y].into_iter().enumerate() {
                    rows.push(Row {
                        ball,
                        quantity: Measured::Coordinate,
                        axis,
                        time: Some(frame.t),
                        measured: frame.position[i] + shift(&off)[i],
                        predicted: predicted[i],
                        sd: frame.weight[i].recip(),
                    });
                }
            }
        }
        let spin = |ball, quantity, axis: Axis, measured, predicted, sd| Row {
            ball,
            quantity,
            axis,
            time: None,
            measured,
            predicted,
            sd,
        };
        if let (Some(spins), Some((mean, sd))) = (spins, self.spin) {
            for axis in Axis::ALL {
                let i = axis.index();
                rows.push(spin(TrackedBall::Cue, Measured::SpinBefore, axis, mean[i], spins[i], sd[i]));
            }
        }
        for ((spins, seen), ball) in after.iter().zip(&self.seen).zip([TrackedBall::Cue, TrackedBall::Object])
        {
            let Some(seen) = seen else { continue };
            let off: [f64; SPIN] = std::array::from_fn(|i| spins[i] - seen.spin[i]);
            for axis in Axis::ALL {
                let i = axis.index();
                let sd = seen.whitening[(i, i)].recip();
                let standardized: f64 = (0..=i).map(|j| off[j] * seen.whitening[(i, j)]).sum();
                let predicted = seen.spin[i] + standardized * sd;
                rows.push(spin(ball, Measured::SpinAfter, axis, seen.spin[i], predicted, sd));
            }
        }
        Some(rows)
    }

    /// What is expected of an unknown spin beforehand, as part of χ².
    pub(crate) fn prior_chi2(&self, own: &Own) -> f64 {
        self.one_unknown().map_or(0.0, |(mean, sd)| ((own[OWN] - mean) / sd).powi(2))
    }
}

/// The collision, without derivatives.
fn collide(collision: &Corrected, inputs: &[f64; 8]) -> Option<[f64; 12]> {
    let (cue, coefficients) = before_impact(inputs);
    let (outcome, ..) = collision.collide_with_all(&cue, &coefficients).ok()?;
    Some(outcome.components().into())
}
