//! What a joint fit writes of each frame: frames.csv.

use caromfit::fit;
use caromfit::fit::{Depth, Fit, Method, Options, footage};
use caromfit::report::frame_table;
use caromfit::simulate;
use caromfit::simulate::{BallSpec, Camera, ClothSpec, Kind, Noise, Played, Shots, Spec, Truth};

use crate::extraction::dataset;

/// A fit of all frames.
fn fitted() -> Fit {
    let spec = Spec {
        name: "synthetic".to_string(),
        kind: Kind::Tracks,
        seed: 5,
        truth: Truth { mu: 0.05, mu_s: 0.3, e: 0.94 },
        shots: Shots {
            count: 30,
            speed_m_s: [1.0, 4.0],
            cut_deg: [-50.0, 50.0],
            cue_spin: vec![Played::NaturalRoll],
        },
        noise: Noise::default(),
        ball: BallSpec::default(),
        camera: Camera::default(),
        cloth: ClothSpec::default(),
    };
    let tracks = simulate::filmed(&spec).unwrap().into_iter().map(|(shot, _)| shot).collect();
    let (dataset, extracted, scene) = footage::with_impacts(dataset(tracks), &|| ());
    let films = footage::films(&extracted, &scene, None, usize::MAX);
    let options = Options { method: Method::Joint, depth: Depth::Estimates, ..Options::default() };
    fit::fit_watched(&dataset, &films, &options, &|| ()).unwrap().remove(0)
}

/// The cells of a column, in the order of the rows.
fn column(table: &str, name: &str) -> Vec<String> {
    let place = table.lines().next().unwrap().split(',').position(|column| column == name);
    let place = place.unwrap_or_else(|| panic!("no column {name}"));
    table.lines().skip(1).map(|line| line.split(',').nth(place).unwrap().to_owned()).collect()
}

fn numbers(table: &str, name: &str) -> Vec<f64> {
    column(table, name).iter().map(|cell| cell.parse().unwrap()).collect()
}

/// frames.csv has the frames that χ² is of.
#[test]
fn frames_add_up_to_chi2() {
    /// Standardized residuals have four decimals.
    const ROUNDING: f64 = 1e-4;
    let fit = fitted();
    let mut table = Vec::new();
    frame_table::write(fit.frames.as_ref().unwrap(), &mut table).unwrap();
    let table = String::from_utf8(table).unwrap();
    let sum: f64 = ["x_standardized", "y_standardized"]
        .iter()
        .flat_map(|name| numbers(&table, name))
        .map(|z| z * z)
        .sum();
    let expected = fit.chi2 - fit.prior_chi2;
    assert!((sum - expected).abs() < ROUNDING * expected, "{sum}, not {expected}");
    let rows = fit.diagnostics.joint.as_ref().unwrap().observations;
    assert_eq!(2 * (table.lines().count() - 1), rows);
    for (name, [measured, predicted, sd]) in [
        ("x_standardized", ["x_m", "x_predicted_m", "x_sd_m"]),
        ("y_standardized", ["y_m", "y_predicted_m", "y_sd_m"]),
    ] {
        let [measured, predicted, sd] = [measured, predicted, sd].map(|name| numbers(&table, name));
        for (i, z) in numbers(&table, name).into_iter().enumerate() {
            assert!(((measured[i] - predicted[i]) / sd[i] - z).abs() < 1e-3 * (1.0 + z.abs()), "{name} {i}");
        }
    }
}
