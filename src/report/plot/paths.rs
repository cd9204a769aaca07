//! A figure of a film: the paths of both balls in all shots, seen from above.

use super::{Figure, INK, Panel, Point, cm, color};
use crate::fit::FittedFilm;
use crate::problem::Impact;
use crate::report::number::count_of;

/// Height of the panel, pixels.
const ROW: u32 = 760;

/// Largest number of shots that are drawn, spread over all: more would only cover each other.
const MOST_SHOTS: usize = 60;

/// Instants of a fitted path, and largest number of frames of a ball.
const STEPS: u32 = 60;
const MOST_FRAMES: usize = 20;

/// Returns the figure, which is empty if no shot shows an impact.
pub fn figure(name: &str, film: &FittedFilm) -> Figure {
    let names = film.names();
    let each = names.len().div_ceil(MOST_SHOTS).max(1);
    let shots: Vec<Impact> = names.iter().step_by(each).filter_map(|name| film.impact(name)).collect();
    let mut figure = Figure::new(name);
    if shots.is_empty() {
        return figure;
    }
    let mut panel = Panel::of_places("", "");
    for impact in &shots {
        add(&mut panel, impact);
    }
    let counted = if shots.len() == names.len() { String::new() } else { format!("{} of ", shots.len()) };
    let words = "seen from above; points: tracked; lines: fitted; bars: line of centres at the impact";
    figure.lines = vec![format!("{counted}{}, {words}", count_of(names.len(), "shot"))];
    figure.series = ["cue ball", "object ball"].map(str::to_owned).to_vec();
    figure.add_rows(ROW, 1, vec![panel]);
    figure
}

/// Adds the paths of a shot, in centimetres.
fn add(panel: &mut Panel, impact: &Impact) {
    let place = |ball: usize, time: f64| cm(impact.paths.place(ball, time));
    for (ball, seen) in impact.seen.iter().enumerate() {
        let (Some((first, _)), Some((last, _))) = (seen.first(), seen.last()) else { continue };
        let instants = (0..=STEPS).map(|step| first + (last - first) * f64::from(step) / f64::from(STEPS));
        panel.line(instants.map(|time| place(ball, time)), color(ball), 1);
        let frames = seen.iter().step_by(seen.len().div_ceil(MOST_FRAMES));
        let points = frames.map(|(_, at)| Point { opacity: 0.5, ..Point::new(cm(*at), ball) });
        panel.points(points);
    }
    panel.line([0, 1].map(|ball| place(ball, impact.time)), INK, 2);
}
