//! Impacts extracted from synthetic footage, against what the shots really were.

use caromfit::ball::Ball;
use caromfit::dataset::Dataset;
use caromfit::fit::Options;
use caromfit::impact::{self, Impact, Lifted, Quantity, Scene};
use caromfit::parameters::Settings;
use caromfit::synth::{
    self, BallSpec, Camera, ClothSpec, Kind, Noise, Played, Shots, Spec, TrueImpact, Truth,
};

fn spec(cue_spin: Played, count: usize, camera: Camera) -> Spec {
    Spec {
        name: "synthetic".to_string(),
        kind: Kind::Tracks,
        seed: 11,
        truth: Truth { mu: 0.05, mu_s: 0.3, e: 0.94 },
        shots: Shots { count, speed_m_s: [1.0, 4.0], cut_deg: [-50.0, 50.0], cue_spin: vec![cue_spin] },
        noise: Noise::default(),
        ball: BallSpec::default(),
        camera,
        cloth: ClothSpec::default(),
    }
}

fn truths(truth: &TrueImpact, impact: &Impact) -> [f64; Quantity::COUNT] {
    let (u, c, v) = (truth.cue_before.velocity, truth.cue_after.velocity, truth.object_after.velocity);
    let lift = match impact.lifted {
        Lifted::Neither => 0.0,
        Lifted::Cue => c.z,
        Lifted::Object => v.z,
    };
    [truth.direction, u.x, u.y, c.x, c.y, v.x, v.y, lift, 0.2, truth.time]
}

#[test]
fn errors_are_what_they_are_stated_to_be() {
    let count: usize = std::env::var("CAROMFIT_SHOTS").ok().and_then(|n| n.parse().ok()).unwrap_or(500);
    for spin in [Played::NaturalRoll, Played::Stun, Played::Draw] {
        let filmed = synth::filmed(&spec(spin, count, Camera::default())).unwrap();
        let begun = std::time::Instant::now();
        let mut pulls = vec![Vec::new(); Quantity::COUNT];
        let mut rejected = Vec::new();
        let shots: Vec<_> = filmed.iter().map(|(shot, _)| shot.clone()).collect();
        let impacts = impact::extract_all(&shots, &Scene::new(Ball::POOL));
        for ((_, truth), impact) in filmed.iter().zip(impacts) {
            let impact = match impact {
                Ok(impact) => impact,
                Err(error) => {
                    rejected.push(error.to_string());
                    continue;
                }
            };
            for (i, expected) in truths(truth, &impact).into_iter().enumerate() {
                let sd = impact.covariance[(i, i)].sqrt();
                if sd > 0.0 {
                    let mut off = impact.values[i] - expected;
                    if i == 0 {
                        off = caromfit::predict::wrap(off);
                    }
                    pulls[i].push(off / sd);
                }
            }
        }
        println!(
            "{spin:?}: {} rejected, {:?} per shot; {:?}",
            rejected.len(),
            begun.elapsed() / count as u32,
            rejected.first()
        );
        for (i, pulls) in pulls.iter().enumerate().filter(|(_, pulls)| !pulls.is_empty()) {
            let n = pulls.len() as f64;
            let mean = pulls.iter().sum::<f64>() / n;
            let sd = (pulls.iter().map(|p| (p - mean).powi(2)).sum::<f64>() / (n - 1.0)).sqrt();
            println!("  {i}: mean {mean:.3} sd {sd:.3} ({n})");
        }
    }
}

#[test]
fn fits_of_tracks_recover_the_parameters() {
    let sets: u64 = std::env::var("CAROMFIT_SETS").ok().and_then(|n| n.parse().ok()).unwrap_or(50);
    let mut pulls = [const { Vec::new() }; 3];
    let mut errors = [0.0; 3];
    let mut covered = [0.0; 3];
    for seed in 0..sets {
        let spec = Spec { seed: 1000 + seed, ..spec(Played::NaturalRoll, 40, Camera::default()) };
        let tracks: Vec<_> = synth::filmed(&spec).unwrap().into_iter().map(|(shot, _)| shot).collect();
        let impacts = impact::extract_all(&tracks, &Scene::new(Ball::POOL));
        let sliding = impact::shots::sliding(impacts.iter().flatten());
        let shots = tracks
            .iter()
            .zip(&impacts)
            .filter_map(|(track, impact)| Some(impact::shots::shot(track, impact.as_ref().ok()?, sliding)));
        let dataset = Dataset {
            name: "tracks".into(),
            path: "tracks".into(),
            cloth: None,
            source: None,
            ball: Ball::POOL,
            settings: Settings::default(),
            by: None,
            shots: shots.collect(),
            left_out: Vec::new(),
            sliding,
        };
        let fit = caromfit::fit::fit(&dataset, &Options::default()).unwrap().remove(0);
        for (i, truth) in [0.05, 0.3, 0.94].into_iter().enumerate() {
            let estimate = fit.estimates[i];
            let error = estimate.std_error.unwrap();
            pulls[i].push((estimate.value - truth) / error);
            errors[i] += error / sets as f64;
            let [low, high] = estimate.interval_95.unwrap();
            covered[i] += f64::from(u8::from((low..=high).contains(&truth))) / sets as f64;
        }
        if seed == 0 {
            println!("μ_k {:?}, χ²/dof {}", sliding, fit.chi2 / fit.dof as f64);
        }
    }
    for i in 0..3 {
        let n = pulls[i].len() as f64;
        let mean = pulls[i].iter().sum::<f64>() / n;
        let sd = (pulls[i].iter().map(|p| (p - mean).powi(2)).sum::<f64>() / (n - 1.0)).sqrt();
        println!(
            "parameter {i}: error {:.5}, pull {mean:.3} ± {sd:.3}, covered {:.3}",
            errors[i], covered[i]
        );
    }
}
