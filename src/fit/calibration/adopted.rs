//! Corrects films for their camera until nothing is left to correct, and leaves out what the frames do not call for: for balls and discs
//! alike.

use nalgebra::{DMatrix, DVector};

use crate::film::camera::Camera;
use crate::fit::camera::{FoundCamera, FoundCorrection};
use crate::measurement::correction::Correction;

/// Rounds of fitting and correcting. Nothing is left to correct within this part of a standard error, or of what is usual of a
/// correction: its square is then far below a standard error.
const ROUNDS: usize = 8;
const AT_REST: f64 = 0.2;
const SMALL: f64 = 0.02;

/// A value that is further from that of a perfect camera than so many times what is usual is of no camera.
const FAR: f64 = 10.0;
/// Positions that are stated in parts of the picture's width and height have its aspect besides that of the camera.
const PICTURES: [f64; 2] = [0.4, 2.5];

/// A correction is not determined where its standard error is above this part of what is usual: shots all played in one direction with
/// one cut tell only some combinations of them.
const UNDETERMINED: f64 = 0.25;

/// What the frames say is left to correct, in the order of the free corrections.
pub(super) struct Left {
    pub values: DVector<f64>,
    pub covariance: DMatrix<f64>,
}

/// Films that tell their camera.
pub(super) trait Calibrates {
    /// What the frames of the films as the camera corrects them say is left.
    fn left(&mut self, free: &[Correction]) -> Option<Left>;

    /// The camera as far as it is found.
    fn camera(&mut self) -> &mut Camera;

    /// Whether a correction is needed whatever the frames call for.
    fn needs(&self, which: Correction) -> bool;

    /// A correction is called for where −2 log L falls by as much with it.
    fn called_for(&self) -> f64;

    /// How near to rest, in standard errors, shows which corrections are called for.
    fn shows_within(&self) -> f64 {
        AT_REST
    }

    /// The camera with what was found of it.
    fn as_found(&self, corrections: Vec<FoundCorrection>, converged: bool) -> FoundCamera;

    /// Corrects until nothing is left but this part of a standard error; the last covariance, and whether nothing is. None if this leads to
    /// what no camera does.
    fn converge(&mut self, free: &[Correction], at_rest: f64) -> Option<(DMatrix<f64>, bool)> {
        let mut last = None;
        for _ in 0..ROUNDS {
            let Some(Left { values, covariance }) = self.left(free) else { break };
            let camera = self.camera();
            for (which, by) in free.iter().zip(values.iter()) {
                *camera = camera.with(*which, camera.get(*which) + by);
            }
            if free.iter().any(|which| !is_of_a_camera(*which, camera.get(*which))) {
                return None;
            }
            let rests = (0..free.len()).all(|i| {
                values[i].abs() < (at_rest * covariance[(i, i)].sqrt()).max(SMALL * free[i].usual())
            });
            last = Some((covariance, rests));
            if rests {
                break;
            }
        }
        last
    }

    /// The camera with the corrections of these that the frames call for. None if this leads to what no camera does.
    fn adopted(&mut self, all: &[Correction]) -> Option<FoundCamera> {
        let (covariance, mut converged) = self.converge(all, self.shows_within())?;
        let mut corrections: Vec<FoundCorrection> = all
            .iter()
            .enumerate()
            .map(|(i, which)| FoundCorrection {
                which: *which,
                value: self.camera().get(*which),
                std_error: covariance[(i, i)].sqrt(),
                adopted: false,
            })
            .collect();
        let mut adopted = self.kept(all, covariance);
        // what the frames call for may not be called for where others were left out
        loop {
            for found in &mut corrections {
                found.adopted = adopted.contains(&found.which);
                if !found.adopted {
                    let camera = self.camera();
                    *camera = camera.with(found.which, found.which.neutral());
                }
            }
            if adopted.is_empty() {
                break;
            }
            let Some((covariance, rests)) = self.converge(&adopted, AT_REST) else {
                return Some(self.as_found(corrections, false));
            };
            converged = rests;
            for (i, which) in adopted.iter().enumerate() {
                if let Some(found) = corrections.iter_mut().find(|found| found.which == *which) {
                    (found.value, found.std_error) = (self.camera().get(*which), covariance[(i, i)].sqrt());
                }
            }
            let still = self.kept(&adopted, covariance);
            if still.len() == adopted.len() {
                break;
            }
            adopted = still;
        }
        Some(self.as_found(corrections, converged))
    }

    /// The corrections that the frames determine and without which −2 log L would be higher by as much as calls for them, one after the
    /// other left out; the camera goes where the others are then best.
    fn kept(&mut self, all: &[Correction], mut covariance: DMatrix<f64>) -> Vec<Correction> {
        let mut kept: Vec<Correction> = all.to_vec();
        loop {
            let camera = *self.camera();
            let off = |which: &Correction| camera.get(*which) - which.neutral();
            // −2 log L rises by z² where a correction is left out
            let z2 = |i: usize, which: &Correction| off(which).powi(2) / covariance[(i, i)];
            // a camera that looks askew has all of an affine map, whether few shots show it or not: without it, cuts to one side bend μ
            let askew = kept.iter().any(|which| which.is_of_perspective());
            let belongs = |which: Correction| {
                askew && matches!(which, Correction::Scale | Correction::Aspect | Correction::Shear)
            };
            let open: Vec<usize> =
                (0..kept.len()).filter(|i| !self.needs(kept[*i]) && !belongs(kept[*i])).collect();
            let unsure = |i: &usize| covariance[(*i, *i)].sqrt() / kept[*i].usual();
            let undetermined = open.iter().copied().max_by(|a, b| unsure(a).total_cmp(&unsure(b)));
            let undetermined = undetermined.filter(|i| unsure(i) > UNDETERMINED);
            let least = open.iter().map(|i| (*i, z2(*i, &kept[*i]))).min_by(|a, b| a.1.total_cmp(&b.1));
            // only a camera that is near sees heights at an angle
            let is_near =
                kept.iter().any(|which| which.is_of_perspective() || *which == Correction::Nearness);
            let needless = || kept.iter().position(|which| which.is_of_height()).filter(|_| !is_near);
            let least = least.filter(|(_, z2)| *z2 < self.called_for());
            let Some(out) = undetermined.or(least.map(|(i, _)| i)).or_else(needless) else { return kept };
            let by = off(&kept[out]) / covariance[(out, out)];
            let camera = self.camera();
            for (i, which) in kept.iter().enumerate() {
                *camera = camera.with(*which, camera.get(*which) - covariance[(i, out)] * by);
            }
            let column = covariance.column(out).into_owned();
            let rest = &covariance - &column * column.transpose() / column[out];
            covariance = rest.remove_row(out).remove_column(out);
            kept.remove(out);
        }
    }
}

/// Whether some camera has a correction of this value.
fn is_of_a_camera(which: Correction, value: f64) -> bool {
    match which {
        Correction::Aspect => (PICTURES[0]..PICTURES[1]).contains(&value),
        _ => (value - which.neutral()).abs() <= FAR * which.usual(),
    }
}
