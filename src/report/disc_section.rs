//! What was measured of every shot of discs, as a section of a report.

use super::content::{Section, Table};
use super::number::{plain, with_error};
use crate::fit::{Fit, mean_of_shots};
use crate::measurement::dataset::Measured;
use crate::problem::{DiscImpact, Quantity};

/// A column of the table.
struct Column {
    name: &'static str,
    quantity: Quantity,
    /// Whether a mean over shots says something.
    has_mean: bool,
}

const COLUMNS: [Column; 8] = [
    Column { name: "closing speed", quantity: Quantity::ClosingSpeed, has_mean: false },
    Column { name: "slip/closing", quantity: Quantity::SlipRatio, has_mean: false },
    Column { name: "e", quantity: Quantity::Restitution, has_mean: true },
    Column { name: "J_t/J_n", quantity: Quantity::ImpulseRatio, has_mean: false },
    Column { name: "momentum along", quantity: Quantity::MomentumAlong, has_mean: true },
    Column { name: "momentum across", quantity: Quantity::MomentumAcross, has_mean: true },
    Column { name: "angular momentum", quantity: Quantity::AngularMomentum, has_mean: true },
    Column { name: "energy lost", quantity: Quantity::EnergyLost, has_mean: true },
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
    let used = |shot: &&DiscImpact| fit.residuals.iter().any(|residual| residual.shot == shot.name);
    let value = |measured: Option<Measured>| {
        measured.map_or(String::new(), |found| with_error(found.value, found.sd.unwrap_or_default()))
    };
    let row = |shot: &DiscImpact| {
        let is_rejected = fit.shots_rejected.iter().any(|rejected| rejected.shot == shot.name);
        let state = match (used(&shot), shot.stuck.is_some(), is_rejected) {
            (_, true, _) => "sticks",
            (true, ..) => "",
            (false, _, true) => "doubtful, not fitted",
            (false, ..) => "not fitted",
        };
        line(&shot.name, COLUMNS.iter().map(|column| value(shot.get(column.quantity))).collect(), state)
    };
    let means = COLUMNS.map(|column| {
        let values = fit.disc_shots.iter().filter(used).filter_map(|shot| shot.get(column.quantity));
        mean_of_shots(&values.collect::<Vec<_>>()).filter(|_| column.has_mean)
    });
    let mean = means.iter().map(|mean| value(mean.map(|mean| Measured::new(mean.value, mean.std_error))));
    let scatter = means.iter().map(|mean| mean.map_or(String::new(), |mean| plain(mean.scatter, 2)));
    let last = [line("mean", mean.collect(), ""), line("scatter", scatter.collect(), "")];
    let rows = fit.disc_shots.iter().map(row).chain(last);
    let head = ["shot"].into_iter().chain(COLUMNS.map(|column| column.name)).chain([""]);
    let table = Table::new(head, rows).with_numbers(1..1 + COLUMNS.len());
    Section::new("What was measured of every shot", ABOUT, [table.into()])
}

fn line(name: &str, values: Vec<String>, state: &str) -> Vec<String> {
    [name.to_owned()].into_iter().chain(values).chain([state.to_owned()]).collect()
}
