//! Where the search for a camera begins: at the distances of the centres where the balls touch.

use nalgebra::{DMatrix, DVector};

use super::{CALLED_FOR, Search};
use crate::film::camera::Camera;
use crate::fit::camera::LEAST_SHOTS;
use crate::measurement::correction::Correction;
use crate::numerics::robust_scale;

impl Search<'_> {
    /// Distances of the centres at the contacts over 2R, less 1.
    fn gaps(&self, camera: &Camera) -> DVector<f64> {
        let gap = |[cue, object]: &[[f64; 2]; 2]| {
            let [a, b] = [camera.table(*cue), camera.table(*object)];
            (b[0] - a[0]).hypot(b[1] - a[1]) / (2.0 * self.radius) - 1.0
        };
        DVector::from_iterator(self.contacts.len(), self.contacts.iter().map(gap))
    }

    /// Puts scale, aspect, shear and perspective where the contacts are 2R apart, by least squares of Huber's loss.
    pub(super) fn start(&mut self, wider: f64) {
        let is_told = |which: &Correction| !which.is_of_lens() && which.is_of_place();
        let free: Vec<Correction> = self.free.iter().copied().filter(is_told).collect();
        if free.is_empty() || self.contacts.len() < LEAST_SHOTS {
            return;
        }
        let Some((camera, error)) = self.at_contacts(self.camera, &free, wider) else { return };
        let cost =
            |camera: &Camera| self.gaps(camera).iter().map(|gap| (gap / error).powi(2).min(9.0)).sum::<f64>();
        // as much as so many numbers fit by chance, and more
        if cost(&self.camera) - cost(&camera) > 2.0 * CALLED_FOR + free.len() as f64 {
            self.camera = camera;
        }
    }

    /// The camera with which the contacts are 2R apart, from another one, with priors that are so many times wider than what is usual of
    /// cameras: with few contacts, the usual ones would hold it where it begins. And how far contacts usually miss that, over 2R.
    fn at_contacts(&self, mut camera: Camera, free: &[Correction], wider: f64) -> Option<(Camera, f64)> {
        const STEPS: usize = 30;
        /// No contact is seen better than to this part of 2R between two frames.
        const LEAST_ERROR: f64 = 1e-3;
        const HUBER: f64 = 1.345;
        let usual = |gaps: &DVector<f64>| robust_scale(gaps.iter().copied());
        for _ in 0..STEPS {
            let gaps = self.gaps(&camera);
            let error = usual(&gaps).max(LEAST_ERROR);
            let weight = |gap: f64| (HUBER * error / gap.abs()).min(1.0) / (error * error);
            let mut normal = DMatrix::<f64>::zeros(free.len(), free.len());
            let mut gradient = DVector::<f64>::zeros(free.len());
            let by: Vec<DVector<f64>> = free
                .iter()
                .map(|which| {
                    let step = 1e-4 * which.usual();
                    let up = self.gaps(&camera.with(*which, camera.get(*which) + step));
                    (up - &gaps) / step
                })
                .collect();
            for i in 0..free.len() {
                let sum = |f: &dyn Fn(usize) -> f64| (0..gaps.len()).map(f).sum::<f64>();
                for j in 0..free.len() {
                    normal[(i, j)] = sum(&|n| weight(gaps[n]) * by[i][n] * by[j][n]);
                }
                let off = camera.get(free[i]) - free[i].neutral();
                let prior = (wider * free[i].usual()).powi(-2);
                normal[(i, i)] += prior;
                gradient[i] = sum(&|n| weight(gaps[n]) * by[i][n] * gaps[n]) + prior * off;
            }
            let step = normal.cholesky()?.solve(&gradient);
            if !step.iter().all(|s| s.is_finite()) {
                return None;
            }
            for (which, step) in free.iter().zip(step.iter()) {
                camera = camera.with(*which, camera.get(*which) - step);
            }
            if step.iter().zip(free).all(|(step, which)| step.abs() < 1e-6 * which.usual()) {
                break;
            }
        }
        let error = usual(&self.gaps(&camera));
        error.is_finite().then_some((camera, error.max(LEAST_ERROR)))
    }
}
