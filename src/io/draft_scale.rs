//! The part of a draft that is about lengths: the unit of the positions, and the radius of the balls.

use std::path::{Path, PathBuf};

use super::draft_text::Draft;
use super::tracking::{metres, strange_unit};
use super::{Survey, header};

/// A table is 2.84 m long, and no shot is filmed on less than a few centimetres.
const METRES: std::ops::Range<f64> = 0.02..4.0;

/// Diameters of balls, m, with what noise and slow cameras add: centres that come nearer or stay further apart are in another unit.
const DIAMETERS: std::ops::Range<f64> = 0.045..0.072;

/// Units that tracks may be in without saying so, and how sentences name them.
const UNITS: [(&str, &str); 5] =
    [("m", "metres"), ("cm", "centimetres"), ("mm", "millimetres"), ("in", "inches"), ("ft", "feet")];

/// Balls and their radii, mm, the largest first.
const BALLS: [(&str, f64); 4] = [("pyramid", 34.0), ("carom", 30.75), ("pool", 28.575), ("snooker", 26.25)];

/// Noise lets centres come nearer by so much.
const NEARER: f64 = 1.02;

/// What the files show of lengths, in their own unit.
pub(super) struct Lengths {
    extent: f64,
    /// How near the centres of two balls come to each other; infinite where nothing shows it.
    nearest: f64,
    stated: Option<&'static str>,
    are_discs: bool,
    /// A unit in brackets that is none of those known.
    strange: Option<(PathBuf, String)>,
}

impl Lengths {
    pub(super) fn of(all: &[(&PathBuf, &Survey)]) -> Self {
        let surveys = || all.iter().map(|(_, survey)| survey);
        let strange = |file: &Path| {
            let names = header(file).ok()?;
            Some((file.to_path_buf(), names.iter().find_map(|name| strange_unit(name))?.to_owned()))
        };
        Self {
            extent: surveys().map(|survey| survey.extent).fold(0.0, f64::max),
            nearest: surveys().filter_map(|survey| survey.closest).fold(f64::INFINITY, f64::min),
            stated: surveys().next().and_then(|survey| survey.unit),
            are_discs: surveys().any(|survey| survey.are_discs),
            strange: all.first().and_then(|(file, _)| strange(file)),
        }
    }

    /// Whether centres that come so near are those of balls that touch, in this unit; also where nothing shows it.
    fn could_be(&self, unit: &str) -> bool {
        let touch = |metres: f64| DIAMETERS.contains(&(self.nearest * metres));
        self.are_discs || self.nearest.is_infinite() || metres(unit).is_some_and(touch)
    }

    /// Whether the positions are taken as metres, though nothing says so.
    fn look_like_metres(&self) -> bool {
        self.strange.is_none() && METRES.contains(&self.extent) && self.could_be("m")
    }

    /// Another unit in which the centres come as near as those of balls that touch: `; in feet they would come as near as 57.5 mm`.
    fn other_unit(&self) -> String {
        let said = |(unit, name): &(&str, &str)| {
            let millimetres = 1e3 * self.nearest * metres(unit).filter(|_| self.could_be(unit))?;
            Some(format!("in {name} they would come as near as {millimetres:.1} mm, as balls that touch"))
        };
        if self.are_discs || self.nearest.is_infinite() {
            return String::new();
        }
        let found: Vec<String> = UNITS.iter().filter_map(said).collect();
        if found.is_empty() { String::new() } else { format!("; {}", found.join(", ")) }
    }

    /// The radius: at most half of how near the centres come to each other, where the scale is known.
    pub(super) fn describe_radius(&self, draft: &mut Draft) {
        let unit = self.stated.or(self.look_like_metres().then_some("m"));
        let nearest =
            unit.and_then(metres).map(|metres| 1e3 * self.nearest * metres).filter(|mm| mm.is_finite());
        let ball = nearest.filter(|mm| 1e-3 * mm < DIAMETERS.end).and_then(|nearest| {
            let (ball, radius) = BALLS.iter().find(|(_, radius)| *radius <= 0.5 * NEARER * nearest)?;
            Some((nearest, ball, radius))
        });
        if let Some((nearest, ball, radius)) = ball {
            draft.find(format!(
                "The centres come as near as {nearest:.1} mm: radius at most {:.2} mm, as {ball} balls have.",
                0.5 * nearest
            ));
            let why = format!("a {ball} ball: the centres come as near as {nearest:.1} mm");
            return draft.noted(format!("radius_m = {:?}", 1e-3 * radius), why);
        }
        if let (Some(nearest), Some(stated)) = (nearest, self.stated) {
            draft.find(format!(
                "The centres come no nearer than {nearest:.1} mm, which is not the diameter of a ball: is {stated}, as the file \
                 states, the right unit, and are the two tracks those of the balls?{}",
                self.other_unit().replacen(';', " Else", 1)
            ));
        }
        let why = "a pool ball; carom 0.03075, snooker 0.02625: correct it if it is another";
        draft.noted("radius_m = 0.028575", why);
    }

    pub(super) fn describe_scale(&self, draft: &mut Draft) {
        let (extent, nearest) = (self.extent, self.nearest);
        draft.line("\n[scale]");
        if let Some(unit) = self.stated {
            draft.noted(format!("length_unit = \"{unit}\""), "as the file states");
        } else if self.look_like_metres() {
            let why = format!("the positions span {extent:.3}: metres, if the film was calibrated");
            draft.noted("length_unit = \"m\"", why);
        } else {
            let other = self.other_unit();
            if let Some((file, unit)) = &self.strange {
                draft.find(format!(
                    "{}: {unit} is no unit that is known here (m, cm, mm, in, ft, px): with length_unit = \"px\" the balls are \
                     the ruler, whatever the unit is.",
                    file.display()
                ));
            } else if METRES.contains(&extent) {
                draft.find(format!(
                    "The positions span {extent:.3}, but the centres come no nearer than {nearest:.4}, which is not the diameter \
                     of a ball in metres{other}. Where the unit is not known, write px: the balls are then the ruler."
                ));
            }
            let extent =
                if METRES.contains(&extent) { format!("{extent:.3}") } else { format!("{extent:.0}") };
            let why = format!(
                "m, cm, mm, in, ft, or px (the balls are then the ruler, unless m_per_px = … or four [[scale.point]] are given); the positions span {extent}{}",
                if other.is_empty() {
                    other
                } else {
                    format!(", the centres come as near as {nearest:.4}{other}")
                }
            );
            draft.blank("length_unit", &why);
        }
        describe_y_axis(draft);
    }
}

pub(super) fn describe_y_axis(draft: &mut Draft) {
    draft.noted("y_axis = \"up\"", "\"down\" where y grows downwards, as in pixels of a picture");
}
