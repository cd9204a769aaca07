//! Impacts extracted from synthetic footage, against what the shots really were.

use caromfit::ball::Ball;
use caromfit::impact::{self, Impact, Lifted, Quantity, Scene};
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
