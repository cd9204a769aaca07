//! What a joint fit writes of each shot and each frame: shots.csv and frames.csv.

use caromfit::fit;
use caromfit::fit::{Depth, Fit, Method, Options, footage};
use caromfit::measurement::spin::Spin;
use caromfit::report::{frame_table, shot_table};
use caromfit::simulate;
use caromfit::simulate::{BallSpec, Camera, ClothSpec, Kind, Noise, Played, Shots, Spec, TrueImpact, Truth};

use crate::extraction::dataset;
use crate::options;

/// A fit of all frames, and what the shots were.
fn fitted(played: Played, unknown: bool) -> (Fit, Vec<TrueImpact>) {
    let spec = Spec {
        name: "synthetic".to_string(),
        kind: Kind::Tracks,
        seed: 5,
        truth: Truth { mu: 0.05, mu_s: 0.3, e: 0.94, ..Truth::default() },
        shots: Shots { count: 30, speed_m_s: [1.0, 4.0], cut_deg: [-50.0, 50.0], cue_spin: vec![played] },
        noise: Noise::default(),
        ball: BallSpec::default(),
        object: None,
        camera: Camera::default(),
        cloth: ClothSpec::default(),
    };
    let (mut tracks, truth): (Vec<_>, Vec<_>) = simulate::filmed(&spec).unwrap().into_iter().unzip();
    if unknown {
        for shot in &mut tracks {
            shot.spin = Spin::Unknown;
        }
    }
    let (dataset, extracted, scene) = footage::with_impacts(dataset(tracks), &|| ());
    let films = footage::films(&extracted, &scene, None, usize::MAX);
    let options = Options { method: Some(Method::Joint), depth: Depth::Estimates, ..options::of_fit() };
    (fit::fit_watched(&dataset, &films, &options, &|| ()).unwrap().remove(0), truth)
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

/// Estimates of shots are off the truth by as much as their errors say.
#[test]
fn the_estimates_of_a_shot_are_as_far_off_as_their_errors_say() {
    /// χ² of 30 numbers, over 30, lies within this in all but one of 10⁴ cases.
    const USUAL: std::ops::Range<f64> = 0.3..2.3;
    for (played, unknown) in [(Played::NaturalRoll, false), (Played::Draw, true)] {
        let (fit, truth) = fitted(played, unknown);
        let table = shot_table::render(&fit);
        let shots: Vec<usize> =
            column(&table, "shot").iter().map(|name| name.parse::<usize>().unwrap() - 1).collect();
        assert!(shots.len() > 25, "{} shots", shots.len());
        let radius = fit.ball.radius;
        let of = |impact: &TrueImpact, column: &str| match column {
            "impact_t_s" => impact.time,
            "object_x_m" => impact.object[0],
            "object_y_m" => impact.object[1],
            "normal_deg" => impact.direction.to_degrees(),
            "cue_vx" => impact.cue_before.velocity.x,
            "cue_vy" => impact.cue_before.velocity.y,
            _ => {
                let along = impact.cue_before.velocity / impact.cue_before.velocity.norm();
                let forward = impact.cue_before.spin.y * along.x - impact.cue_before.spin.x * along.y;
                forward * radius / impact.cue_before.velocity.norm()
            }
        };
        let usual = ["impact_t_s", "object_x_m", "object_y_m", "normal_deg", "cue_vx", "cue_vy"];
        for name in usual.into_iter().chain(unknown.then_some("cue_topspin_of_roll")) {
            let (values, errors) = (numbers(&table, name), numbers(&table, &format!("{name}_sd")));
            let pulls = shots.iter().zip(values.iter().zip(&errors)).map(|(shot, (value, error))| {
                let off = value - of(&truth[*shot], name);
                // a direction may be given a whole turn away
                let off = if name == "normal_deg" { (off + 180.0).rem_euclid(360.0) - 180.0 } else { off };
                off / error
            });
            let chi2 = pulls.map(|pull| pull * pull).sum::<f64>() / shots.len() as f64;
            println!("{name}: {chi2:.2}");
            assert!(USUAL.contains(&chi2), "{name}, {played:?}: {chi2}");
        }
        assert_eq!(table.contains("cue_topspin_of_roll"), unknown);
    }
}

/// frames.csv has the frames that χ² is of, and the errors of shots end where the model does.
#[test]
fn frames_add_up_to_chi2() {
    /// Standardized residuals have four decimals.
    const ROUNDING: f64 = 1e-4;
    let (mut fit, _) = fitted(Played::NaturalRoll, false);
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

    let errors = |fit: &Fit| column(&shot_table::render(fit), "cue_vx_sd");
    assert!(errors(&fit).iter().all(|cell| !cell.is_empty()));
    fit.refuted =
        Some(fit::Refuted { reduced_chi2: 9.0, p_value: 0.0, if_model_held: Vec::new(), restitution: None });
    assert!(errors(&fit).iter().all(String::is_empty));
}
