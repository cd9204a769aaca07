//! design.svg and design.png: standard errors against the cut angle, a row of panels for each parameter, a column for each speed.

use super::{Axis, Figure, Panel, Point, color};
use crate::design::{Cell, Design};
use crate::measurement::parameter::Parameter;
use crate::report::number::plain;

/// Height of a row of panels, pixels.
const ROW: u32 = 380;

/// Largest standard errors that are drawn, times the smallest of a parameter.
const WORST: f64 = 1e3;

/// Largest number of speeds that are drawn.
const COLUMNS: usize = 3;

/// Returns the standard errors of all cells.
pub fn figure(design: &Design) -> Figure {
    let kinds = &design.expected.kinds;
    let mut figure = Figure::new("Standard errors that shots of one cut angle and speed give");
    figure.lines = vec!["Without a point: such shots by themselves do not determine it.".to_owned()];
    figure.series = kinds.iter().map(|kind| format!("{} ({} shots)", kind.name, kind.shots)).collect();
    let speeds: Vec<Vec<f64>> = (0..kinds.len()).map(|kind| design.speeds(kind)).collect();
    let columns = speeds.iter().map(Vec::len).max().unwrap_or(1).clamp(1, COLUMNS);
    for parameter in Parameter::COEFFICIENTS {
        let row = (0..columns).filter_map(|column| {
            let own: Vec<Option<f64>> = speeds.iter().map(|speeds| speeds.get(column).copied()).collect();
            panel(design, parameter, &own)
        });
        figure.add_rows(ROW, columns, row.collect());
    }
    if figure.rows.is_empty() {
        let line = "No shot at a single cut angle and speed determines a parameter by itself.";
        figure.lines = vec![line.to_owned()];
    }
    figure
}

/// Returns the standard errors of a parameter of each kind at its own speed; `None` if no kind determines it.
fn panel(design: &Design, parameter: Parameter, speeds: &[Option<f64>]) -> Option<Panel> {
    let symbol = parameter.symbol();
    let all = design.cells.iter().filter_map(|cell| cell.std_errors[parameter as usize]);
    let most = WORST * all.fold(f64::INFINITY, f64::min);
    let error = |cell: &Cell| {
        cell.std_errors[parameter as usize].filter(|error| *error > 0.0 && *error <= most).map(f64::log10)
    };
    let mut names: Vec<f64> = speeds.iter().flatten().copied().collect();
    names.sort_by(f64::total_cmp);
    names.dedup();
    let title = match names[..] {
        [] => String::new(),
        [one] => format!("{symbol}, {} m/s", plain(one, 3)),
        [least, .., most] => format!("{symbol}, {} to {} m/s", plain(least, 3), plain(most, 3)),
    };
    let y = Axis::logarithmic(format!("standard error of {symbol}"));
    let mut panel = Panel::new(title, "", Axis::new(super::CUT_AXIS), y);
    for (kind, speed) in speeds.iter().enumerate() {
        let own = design.cells.iter().filter(|cell| cell.kind == kind && Some(cell.speed_m_s) == *speed);
        let points: Vec<Option<[f64; 2]>> = own.map(|cell| Some([cell.cut_deg, error(cell)?])).collect();
        // a gap where it is not determined
        for part in points.split(Option::is_none).filter(|part| !part.is_empty()) {
            panel.line(part.iter().flatten().copied(), color(kind), 2);
            let points = part.iter().flatten().map(|at| Point::new(*at, kind));
            panel.points(points);
        }
    }
    (!panel.marks.is_empty()).then_some(panel)
}
