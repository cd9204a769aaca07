//! Synthetic data sets for other tests.

use caromfit::io;
use caromfit::measurement::dataset::{Dataset, ObjectBall};
use caromfit::physics::ball::Ball;
use caromfit::physics::collision::Model;
use caromfit::simulate;
use caromfit::simulate::{BallSpec, Camera, ClothSpec, Kind, Noise, Played, Shots, Spec, Truth};

/// Usual shots with usual values and, unless they are tracks, the noise of footage of 250 fps.
pub fn spec(kind: Kind, cue_spin: &[Played], count: usize, seed: u64) -> Spec {
    let measured = Noise { velocity_m_s: 0.004, line_of_centres_deg: 0.05, spin_rad_s: 0.5, angle_deg: 0.2 };
    Spec {
        name: "synthetic".to_owned(),
        kind,
        seed,
        truth: Truth { mu: 0.05, mu_s: 0.3, e: 0.94, ..Truth::default() },
        shots: Shots { count, speed_m_s: [1.0, 4.0], cut_deg: [-50.0, 50.0], cue_spin: cue_spin.to_vec() },
        noise: if kind == Kind::Tracks { Noise::default() } else { measured },
        ball: BallSpec::default(),
        object: None,
        camera: Camera::default(),
        cloth: ClothSpec::default(),
    }
}

/// The data set that a specification makes.
pub fn made(spec: &Spec) -> Dataset {
    simulate::dataset(spec).unwrap()
}

/// The data set that a specification makes, with masses that are known to be equal.
pub fn made_of_weighed_balls(spec: &Spec) -> Dataset {
    Dataset { object: Some(ObjectBall::exact(Ball::POOL)), ..made(spec) }
}

/// The data set that a specification makes with the collisions of a model.
pub fn made_with(spec: &Spec, model: &Model) -> Dataset {
    let folder = tempfile::tempdir().unwrap();
    for (name, content) in simulate::generate_with(spec, model).unwrap() {
        std::fs::write(folder.path().join(name), content).unwrap();
    }
    io::load(folder.path()).unwrap()
}
