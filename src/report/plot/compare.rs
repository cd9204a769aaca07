//! The estimates of a comparison with their intervals.

use super::{Axis, Figure, Panel, Point, color};
use crate::compare::{Compared, Comparison};

/// Height of an estimate and of what stands about all of a quantity, pixels.
const LINE: u32 = 34;
const AROUND: u32 = 128;

/// Returns the estimates of each quantity with their intervals, below each other.
pub(crate) fn forest(comparison: &Comparison) -> Figure {
    let mut figure = Figure::new(format!("Estimates and 95 % intervals by {}", comparison.told_by));
    let has_interval = |q: &&Compared| q.estimates.iter().any(|value| value.interval_95.is_some());
    for compared in comparison.quantities.iter().filter(has_interval) {
        let height = AROUND + LINE * u32::try_from(compared.estimates.len()).unwrap_or(1);
        figure.add_rows(height, 1, vec![estimates(comparison, compared)]);
    }
    if figure.rows.is_empty() {
        figure.lines.push("Nothing here has an interval.".to_owned());
    }
    figure
}

fn estimates(comparison: &Comparison, compared: &Compared) -> Panel {
    let symbol = compared.quantity.symbol();
    let name = |label: usize| comparison.labels[label].clone();
    let values = || compared.estimates.iter().rev();
    let words = values().map(|value| value.label.map_or("all".to_owned(), name)).collect();
    let about = if compared.shared { "one value for all" } else { "" };
    let x = Axis::new(format!("{symbol}, {}", compared.quantity.meaning()));
    let mut panel = Panel::new(symbol, about, x, Axis::of_words(words));
    for (row, value) in values().enumerate() {
        let (y, series) = (row as f64, value.label.unwrap_or(0));
        if let Some([low, high]) = value.interval_95 {
            panel.line([[low, y], [high, y]], color(series), 3);
        }
        let opacity = if value.fitted { 1.0 } else { 0.35 };
        panel.points([Point { opacity, ..Point::new([value.value, y], series) }]);
    }
    panel
}
