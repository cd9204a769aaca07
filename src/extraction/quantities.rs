//! A fit of a shot's frames → values and covariance of what it is after.

use nalgebra::SMatrix;

use super::ball_paths::{AWAY, FittedBalls, TrackedBalls};
use super::path_fit::Errors;
use super::unusable::Unusable;
use super::{Impact, PathErrors, Quantity, Rolling};
use crate::measurement::spin::Spin;
use crate::trajectory::scene::LiftPrior;
use crate::trajectory::unknowns::unknown;

impl TrackedBalls<'_> {
    /// Values and covariance of what a fit is after.
    pub(crate) fn impact(&self, fitted: &FittedBalls) -> Result<(Impact, PathErrors), Unusable> {
        fitted.converged()?;
        if let Some((wrong, _)) = self.separation(fitted) {
            return Err(wrong);
        }
        if !(fitted.z[unknown::BEFORE] > 0.0) {
            return Err(Unusable::NotConverged(AWAY.to_string()));
        }
        self.quantities(fitted)
    }

    /// The same of what may not have converged.
    pub(crate) fn quantities(&self, fitted: &FittedBalls) -> Result<(Impact, PathErrors), Unusable> {
        let Errors { qr, inverse, factor } = self.errors(fitted)?;
        let z = &fitted.z;
        let covariance = factor * inverse;
        let mut all = SMatrix::<f64, { unknown::COUNT }, { unknown::COUNT }>::zeros();
        for (i, a) in fitted.free.iter().enumerate() {
            for (j, b) in fitted.free.iter().enumerate() {
                all[(*a, *b)] = covariance[(i, j)];
            }
        }
        // collision frame to table frame: w = (v_x cos α − v_y sin α, v_x sin α + v_y cos α)
        let (sin, cos) = z[unknown::DIRECTION].sin_cos();
        let mut values = [0.0; Quantity::COUNT];
        let mut by = SMatrix::<f64, { Quantity::COUNT }, { unknown::COUNT }>::zeros();
        let mut put = |quantity: Quantity, value: f64, terms: &[(usize, f64)]| {
            values[quantity as usize] = value;
            for (unknown, derivative) in terms {
                by[(quantity as usize, *unknown)] += derivative;
            }
        };
        put(Quantity::Direction, z[unknown::DIRECTION], &[(unknown::DIRECTION, 1.0)]);
        for (first, qx, qy) in [
            (unknown::BEFORE, Quantity::CueVxBefore, Quantity::CueVyBefore),
            (unknown::CUE, Quantity::CueVxAfter, Quantity::CueVyAfter),
            (unknown::BALL, Quantity::ObjVxAfter, Quantity::ObjVyAfter),
        ] {
            let (x, y) = (z[first] * cos - z[first + 1] * sin, z[first] * sin + z[first + 1] * cos);
            put(qx, x, &[(first, cos), (first + 1, -sin), (unknown::DIRECTION, -y)]);
            put(qy, y, &[(first, sin), (first + 1, cos), (unknown::DIRECTION, x)]);
        }
        let per_lift = match self.paths.model.spin {
            Spin::Unknown => z[unknown::BEFORE] * self.paths.model.vertical(z),
            _ => 1.0,
        };
        put(Quantity::Lift, per_lift * z[unknown::LIFT], &[(unknown::LIFT, per_lift)]);
        put(Quantity::Sliding, z[unknown::SLIDING], &[(unknown::SLIDING, 1.0)]);
        put(Quantity::Time, z[unknown::TIME], &[(unknown::TIME, 1.0)]);
        if self.paths.model.spin == Spin::Unknown {
            // ω = ρ ẑ × U/R
            let (roll, radius) = (z[unknown::ROLL], self.paths.scene.ball.radius);
            let (first, second) = (unknown::BEFORE, unknown::BEFORE + 1);
            let (x, y) = (z[first] * cos - z[second] * sin, z[first] * sin + z[second] * cos);
            let part = roll / radius;
            let by_x = [(first, -part * sin), (second, -part * cos), (unknown::DIRECTION, -part * x)];
            put(Quantity::CueSpinX, -part * y, &by_x);
            put(Quantity::CueSpinX, -part * y, &[(unknown::ROLL, -y / radius)]);
            let by_y = [(first, part * cos), (second, -part * sin), (unknown::DIRECTION, -part * y)];
            put(Quantity::CueSpinY, part * x, &by_y);
            put(Quantity::CueSpinY, part * x, &[(unknown::ROLL, x / radius)]);
        }
        // what the collision model says of the lift
        let of_model = matches!(self.paths.scene.lift, LiftPrior::Model(..)) && per_lift > 0.0;
        let lift_held = fitted.priors.iter().find(|(i, ..)| of_model && *i == unknown::LIFT);
        let (by_rolling, step, information) = self.rolling(fitted, &qr);
        let assumed = z[unknown::ROLLING];
        let impact = Impact {
            values,
            covariance: by * all * by.transpose(),
            lifted: self.paths.model.lift(z),
            position_sd: self.position_sd(fitted),
            reduced_chi2: self.misfit(fitted),
            frames: [fitted.frames[0][0], fitted.frames[0][1], fitted.frames[1][1]],
            outliers: fitted.outliers(),
            window: fitted.window,
            unknowns: *z,
            rolling: Rolling {
                assumed,
                best: assumed + step,
                information: information / factor,
                by: by * by_rolling,
            },
            at_model: None,
            lift_held: lift_held.map(|(_, mean, sd)| (per_lift * mean, per_lift * sd * factor.sqrt())),
            wrong: fitted.wrong.clone(),
            scale: factor.sqrt(),
            chi2: fitted.chi2 / factor,
            noise: self.noise,
            spin: self.paths.model.spin,
            rotations: None,
        };
        Ok((impact, PathErrors { unknowns: all, by_rolling, quantities: by }))
    }
}
