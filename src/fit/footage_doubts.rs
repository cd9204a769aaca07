//! What footage shows to be wrong with itself or with what is stated of it, as reasons for doubt.

use super::check::{self, Finding, Kind, capital};
use super::{Fit, Rejected};
use crate::measurement::dataset::ON_REQUEST;
use crate::measurement::number::{self, plain};

/// Of all shots: with fewer than this part used, those that were left out may be the rule.
const FEW_USED: f64 = 0.6;

/// Of the shots: what so many of them show is no accident of one.
const MANY_SUSPICIOUS: f64 = 0.5;

/// Noise whose correlation from frame to frame is above this is that of a filter: trackers that follow a ball by themselves stay below.
const SMOOTHED: f64 = 0.93;

/// So many more frames are off after the impacts than before them where a tracker lags.
const LATE: usize = 2;

/// Shots that show whether the camera looks askew.
const LEAST_SHOTS: usize = 6;

/// χ²/dof of so many velocities that are extracted from frames, and fit better than their noise allows.
const TOO_GOOD: f64 = 0.25;
const ENOUGH: usize = 20;

impl Fit {
    /// That no billiard ball has the radius that is stated: all else may follow from it.
    pub(super) fn odd_radius(&self) -> Option<String> {
        let odd = self.diagnostics.suspicious.iter().find(|finding| finding.kind == Kind::Radius)?;
        Some(format!("{}.", capital(&odd.text)))
    }

    /// What the paths of the balls, or most shots, show to be wrong with the footage or its description.
    pub(super) fn wrong_footage(&self) -> Option<String> {
        let suspicious = &self.diagnostics.suspicious;
        let many = |finding: &&Finding| {
            let alike = suspicious.iter().filter(|other| other.kind == finding.kind).count();
            finding.shot.is_none() || alike as f64 > MANY_SUSPICIOUS * self.shots_used as f64
        };
        if let Some(finding) = suspicious.iter().find(many) {
            let whose =
                finding.shot.as_ref().map_or(String::new(), |shot| format!("in most shots, as in {shot}, "));
            return Some(format!("{}.", capital(&format!("{whose}{}", finding.text))));
        }
        if let Some(smoothed) = self.smoothed() {
            return Some(smoothed);
        }
        let camera = self.camera.as_ref()?;
        // what balls that touch or an exposure do to positions is alike before and after the impact
        if camera.spoiled.is_some_and(|[before, after]| after >= before + LATE) {
            return Some(format!("{}.", capital(&check::lag().text)));
        }
        None
    }

    /// That the positions seem to have been smoothed before they were exported, which leaves little to fit.
    pub(super) fn smoothed(&self) -> Option<String> {
        let noise = self.camera.as_ref()?.noise_correlation.filter(|noise| noise.adopted);
        if let Some(noise) = noise.filter(|noise| noise.value > SMOOTHED) {
            return Some(format!(
                "The errors of neighbouring frames are correlated by {}, as in tracks that were smoothed, and tell little: export \
                 the positions as they were measured.",
                plain(noise.value, 2)
            ));
        }
        let goodness = self.diagnostics.goodness.as_ref();
        let tested = goodness.filter(|found| self.frames.is_some() && found.dof >= ENOUGH)?;
        let reduced = tested.chi2 / tested.dof as f64;
        (reduced < TOO_GOOD).then(|| {
            format!(
                "The shots agree far better than the noise of their frames allows (χ²/dof of their velocities {}), as where positions \
                 were smoothed, or stand twice: export them as they were measured.",
                plain(reduced, 1)
            )
        })
    }

    /// That many shots were left out, which may be the rule.
    pub(super) fn few_used(&self) -> Option<String> {
        let unwanted = |rejected: &&Rejected| rejected.reason != ON_REQUEST;
        let rejected: Vec<&Rejected> = self.shots_rejected.iter().filter(unwanted).collect();
        let (used, all) = (self.shots_used, self.shots_used + rejected.len());
        let first = rejected.first().filter(|_| (used as f64) < FEW_USED * all as f64)?;
        Some(format!(
            "Only {used} of {all} shots could be used; the first that was left out is shot {}: {}.",
            first.shot, first.reason
        ))
    }

    /// That these shots are too few to show whether the camera looks askew, which other causes then seem to explain.
    pub(super) fn unseen_tilt(&self) -> Option<String> {
        let shots = self.shots_used + self.shots_rejected.len();
        (self.footage && self.discs.is_none() && shots < LEAST_SHOTS).then(|| {
            format!(
                "{} cannot show whether the camera looks askew, and that may be the reason: film at least {LEAST_SHOTS}, or \
                 straight from above.",
                number::count_of(shots, "shot")
            )
        })
    }
}
