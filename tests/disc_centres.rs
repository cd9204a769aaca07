//! Which of three points on a disc is its centre, where the film does not say it and the discs hardly turn.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_3};

use caromfit::problem::{DiscImpact, Quantity};

use crate::discs::{E, SETTINGS, film_of, load, with_discs};

const TOUCHING: f64 = 0.050;
const RADII: &str = "radius_m = 0.030\nmass_kg = 0.050\n[object]\nradius_m = 0.020\nmass_kg = 0.030\n";

/// A centre with two points a right angle apart, with two that stand to each other as either does to the centre, and none.
const POINTS: [[[f64; 2]; 3]; 3] = [
    [[0.9, 0.0], [0.0, 0.0], [0.9, FRAC_PI_2]],
    [[0.9, 0.0], [0.9, FRAC_PI_3], [0.0, 0.0]],
    [[0.9, 0.0], [0.9, 1.8], [0.9, 3.7]],
];

/// Discs turn by a sixth of a radian at most before the impact. In every shot the points have other names, as in exports of Qualisys.
fn film(shots: usize, seed: u64, points: [[f64; 2]; 3]) -> String {
    let friction = |slip: f64, _: f64| -0.08 * slip.signum();
    let (mut table, _) = film_of(shots, seed, friction, points);
    for shot in 0..shots {
        for (i, name) in ["a0", "a1", "a2", "b0", "b1", "b2"].into_iter().enumerate() {
            let other = (i * [1, 5][shot % 2] + shot) % 6;
            let named = |line: &str| {
                if line.starts_with(&format!("{shot},")) {
                    line.replace(&format!(",{name},"), &format!(",New {other},"))
                } else {
                    line.to_string()
                }
            };
            table = table.lines().map(named).collect::<Vec<_>>().join("\n");
        }
    }
    table
}

/// The settings without names, and without what is known of the discs or with it.
fn settings(known: bool) -> String {
    let (unnamed, _) = SETTINGS.split_once("[tracks]").unwrap();
    assert!(unnamed.contains(RADII));
    if known { unnamed.to_string() } else { unnamed.replace(RADII, "") }
}

fn is_right(impact: &DiscImpact) -> bool {
    let value = |quantity: Quantity| impact.get(quantity).unwrap();
    let e = value(Quantity::Restitution);
    (value(Quantity::ContactDistance).value - TOUCHING).abs() < 5e-4
        && (e.value - E).abs() < 5.0 * e.sd.unwrap()
}

#[test]
fn all_shots_tell_which_point_is_the_centre() {
    for (seed, points) in POINTS.into_iter().enumerate() {
        let dataset = load(&settings(false), &film(10, 60 + seed as u64, points)).unwrap();
        let (dataset, extracted) = with_discs(dataset);
        assert!(extracted.iter().all(|(_, impact)| is_right(impact)), "{points:?}");
        // of three that stand alike, two may by chance be as far from the other disc as the centre is
        let told = extracted.len() + dataset.tracks.unwrap().left_out.len();
        assert!(extracted.len() >= if seed == 1 { 6 } else { 10 } && told == 10, "{points:?}: {told}");
    }
}

/// In one shot the radii tell it, and nothing where these are unknown.
#[test]
fn the_radii_tell_which_point_is_the_centre() {
    let table = film(1, 70, POINTS[0]);
    let (_, extracted) = with_discs(load(&settings(true), &table).unwrap());
    assert!(extracted.len() == 1 && is_right(&extracted[0].1));
    let error = load(&settings(false), &table).unwrap_err();
    assert!(
        error.contains("hardly turns") && error.contains("no distance at which the discs hit"),
        "{error}"
    );
}
