//! What was measured of every shot of discs, as a section of a report.

use super::content::{Section, Table};
use super::number::{plain, with_error};
use crate::fit::{Fit, mean_of_shots};
use crate::measurement::dataset::{DiscShot, Measured};

/// A column of the table.
struct Column {
    name: &'static str,
    of: fn(&DiscShot) -> Option<Measured>,
    /// Whether a mean over shots says something.
    has_mean: bool,
}

const COLUMNS: [Column; 8] = [
    Column { name: "closing speed", of: |shot| shot.closing_speed, has_mean: false },
    Column { name: "slip/closing", of: |shot| shot.slip_ratio, has_mean: false },
    Column { name: "e", of: |shot| shot.restitution, has_mean: true },
    Column { name: "J_t/J_n", of: |shot| shot.impulse_ratio, has_mean: false },
    Column { name: "momentum along", of: |shot| shot.momentum[0], has_mean: true },
    Column { name: "momentum across", of: |shot| shot.momentum[1], has_mean: true },
    Column { name: "angular momentum", of: |shot| shot.angular_momentum, has_mean: true },
    Column { name: "energy lost", of: |shot| shot.energy_lost, has_mean: true },
];

const ABOUT: &str = "± one standard error of the frames' noise. Momentum: what both discs gain along and across the line of centres, over \
                     the normal impulse; angular momentum: what they gain about the contact point, over the normal impulse times the \
                     distance of the centres; energy lost: part of the energy of motion and rotation. J_t/J_n and slip: on the second disc, \
                     90° counter-clockwise from the line of centres. Scatter: standard deviation between the shots that were fitted, beyond \
                     their own errors.";

/// `None` of balls.
pub(super) fn section(fit: &Fit) -> Option<Section> {
    if fit.disc_shots.is_empty() {
        return None;
    }
    let used = |shot: &&DiscShot| fit.residuals.iter().any(|residual| residual.shot == shot.name);
    let value = |measured: Option<Measured>| {
        measured.map_or(String::new(), |found| with_error(found.value, found.sd.unwrap_or_default()))
    };
    let row = |shot: &DiscShot| {
        let state = match (used(&shot), shot.sticks, shot.doubts.is_empty()) {
            (_, true, _) => "sticks",
            (true, _, true) => "",
            (true, _, false) => "doubtful",
            (false, _, false) => "doubtful, not fitted",
            (false, _, true) => "not fitted",
        };
        line(&shot.name, COLUMNS.iter().map(|column| value((column.of)(shot))).collect(), state)
    };
    let mut rows: Vec<Vec<String>> = fit.disc_shots.iter().map(row).collect();
    let means: Vec<_> = COLUMNS
        .iter()
        .map(|column| {
            let values = fit.disc_shots.iter().filter(used).filter_map(|shot| (column.of)(shot));
            mean_of_shots(&values.collect::<Vec<_>>()).filter(|_| column.has_mean)
        })
        .collect();
    let mean = means.iter().map(|mean| value(mean.map(|mean| Measured::new(mean.value, mean.std_error))));
    let scatter = means.iter().map(|mean| mean.map_or(String::new(), |mean| plain(mean.scatter, 2)));
    rows.extend([line("mean", mean.collect(), ""), line("scatter", scatter.collect(), "")]);
    let head = ["shot"].into_iter().chain(COLUMNS.map(|column| column.name)).chain([""]);
    let table = Table::new(head, rows).with_numbers(1..1 + COLUMNS.len());
    Some(Section::table("What was measured of every shot", ABOUT, table))
}

fn line(name: &str, values: Vec<String>, state: &str) -> Vec<String> {
    [name.to_owned()].into_iter().chain(values).chain([state.to_owned()]).collect()
}
