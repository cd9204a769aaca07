//! The part of a draft about lengths: the unit of the positions, and the radius of the balls.

use super::Survey;
use super::draft_text::{Draft, TEXT};
use super::tracking::metres;

/// Plausible extents of positions, m: a table is 2.84 m long; films show a few centimetres.
const METRES: std::ops::Range<f64> = 0.02..4.0;

/// Plausible diameters of balls, m, with allowance for noise and slow cameras.
const DIAMETERS: std::ops::Range<f64> = 0.045..0.072;

/// Balls and their radii, mm, the largest first.
const BALLS: [(&str, f64); 4] = [("pyramid", 34.0), ("carom", 30.75), ("pool", 28.575), ("snooker", 26.25)];

/// Largest ratio of a diameter to the distance of centres that noise explains.
const NEARER: f64 = 1.02;

/// The lengths in the files, in their own unit.
pub(super) struct Lengths {
    extent: f64,
    /// Least distance of the centres of two balls; infinite without balls.
    nearest: f64,
    stated: Option<&'static str>,
    are_discs: bool,
}

impl Lengths {
    pub(super) fn of(surveys: &[&Survey]) -> Self {
        let surveys = || surveys.iter();
        Self {
            extent: surveys().map(|survey| survey.extent).fold(0.0, f64::max),
            nearest: surveys().filter_map(|survey| survey.closest).fold(f64::INFINITY, f64::min),
            stated: surveys().next().and_then(|survey| survey.unit),
            are_discs: surveys().any(|survey| survey.are_discs),
        }
    }

    /// Returns whether the positions are taken as metres without a statement: balls then touch.
    fn look_like_metres(&self) -> bool {
        let may_touch = self.are_discs || self.nearest.is_infinite() || DIAMETERS.contains(&self.nearest);
        METRES.contains(&self.extent) && may_touch
    }

    /// Drafts the radius: at most half of the least distance of the centres, if the scale is known.
    pub(super) fn describe_radius(&self, draft: &mut Draft) {
        let unit = self.stated.or(self.look_like_metres().then_some("m"));
        let nearest = unit.and_then(metres).map(|metres| 1e3 * self.nearest * metres);
        if let Some(nearest) = nearest.filter(|mm| mm.is_finite()) {
            let ball = BALLS.iter().find(|(_, radius)| *radius <= 0.5 * NEARER * nearest);
            if let Some((ball, radius)) = ball.filter(|_| 1e-3 * nearest < DIAMETERS.end) {
                let near = format!("he centres come as near as {nearest:.1} mm");
                let most = 0.5 * nearest;
                draft.find(format!("T{near}: radius at most {most:.2} mm, as {ball} balls have."));
                let why = format!("a {ball} ball: t{near}");
                return draft.state("radius_m", format!("{:?}", 1e-3 * radius), why);
            }
            if let Some(stated) = self.stated {
                draft.find(format!(
                    "The centres come no nearer than {nearest:.1} mm, which is not the diameter of a ball: is {stated}, as the file \
                     states, the right unit, and are the two tracks those of the balls?"
                ));
            }
        }
        let why = "a pool ball; carom 0.03075, snooker 0.02625: correct it if it is another";
        draft.state("radius_m", "0.028575", why);
    }

    /// Drafts the unit of lengths.
    pub(super) fn describe_scale(&self, draft: &mut Draft) {
        let &Self { extent, nearest, .. } = self;
        draft.line("\n[scale]");
        if let Some(unit) = self.stated {
            draft.state("length_unit", format!("\"{unit}\""), "as the file states");
        } else if self.look_like_metres() {
            let why = format!("the positions span {extent:.3}: metres, if the film was calibrated");
            draft.state("length_unit", "\"m\"", why);
        } else {
            if METRES.contains(&extent) {
                draft.find(format!(
                    "The positions span {extent:.3}, but the centres come no nearer than {nearest:.4}, which is not the diameter of a \
                     ball in metres. Where the unit is not known, write px: the balls are then the ruler."
                ));
            }
            let why = format!(
                "m, cm, mm, in, ft, or px (the balls are then the ruler, unless m_per_px = … or four [[scale.point]] are given); the \
                 positions span {extent:.*}",
                if METRES.contains(&extent) { 3 } else { 0 }
            );
            draft.blank("length_unit", "length_unit", TEXT, why);
        }
        suggest_y_axis(draft);
    }
}

pub(super) fn suggest_y_axis(draft: &mut Draft) {
    draft.state("y_axis", "\"up\"", "\"down\" if y grows downwards, as in pixels of a picture");
}
