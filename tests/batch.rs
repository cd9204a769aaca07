//! Collisions in batches are those one at a time.

use caromfit::physics::ball::{Ball, BallState};
use caromfit::physics::collision::batch::{Arrays, Cues, Lengths};
use caromfit::physics::collision::{Coefficients, Fidelity, Jacobian, Model, NotACollision};
use caromfit::physics::friction_law::Law;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use super::collisions::Try;

const COEFFICIENTS: Coefficients = Coefficients { mu: 0.06, mu_s: 0.3, e: 0.94 };

/// Columns of many cue balls.
struct Columns([Vec<f64>; 5]);

impl Columns {
    fn new(cues: &[BallState]) -> Self {
        let column = |of: fn(&BallState) -> f64| cues.iter().map(of).collect();
        Self([
            column(|cue| cue.velocity.x),
            column(|cue| cue.velocity.y),
            column(|cue| cue.spin.x),
            column(|cue| cue.spin.y),
            column(|cue| cue.spin.z),
        ])
    }

    fn cues(&self) -> Cues<'_> {
        let [x, y, spins @ ..] = self.0.each_ref().map(Vec::as_slice);
        Cues { velocity: [x, y], spin: spins }
    }
}

/// Random shots, some of which are no collision; not a whole number of blocks.
fn cues(count: usize) -> Vec<BallState> {
    let mut rng = ChaCha8Rng::seed_from_u64(31);
    let mut cues: Vec<_> = (0..count).map(|_| Try::random(&mut rng, Fidelity::Full).cue).collect();
    cues[3].velocity.x = -1.0;
    cues[7].spin.y = f64::NAN;
    cues
}

#[test]
fn a_batch_is_its_shots_one_at_a_time() {
    for fidelity in Fidelity::ALL {
        let count = if fidelity.effects().cloth_on_cue { 150 } else { 1_000 };
        let cues = cues(count);
        let columns = Columns::new(&cues);
        for law in [Law::Constant, Law::Exponential { b: 0.05, c: 1.0 }] {
            let model = Model { law, tolerance: 1e-6, ..Model::new(fidelity, Ball::POOL) };
            let mut arrays = Arrays::new(count);
            let mut jacobians = vec![Jacobian::zeros(); count];
            let outcomes = &mut arrays.outcomes();
            model
                .collide_batch_with_jacobian(&columns.cues(), &COEFFICIENTS, outcomes, &mut jacobians)
                .unwrap();
            let with_jacobian = arrays.clone();
            model.collide_batch(&columns.cues(), &COEFFICIENTS, &mut arrays.outcomes()).unwrap();
            for (i, cue) in cues.iter().enumerate() {
                let one = model.collide_with_jacobian(cue, &COEFFICIENTS);
                let Ok((one, jacobian)) = one else {
                    assert!(i == 3 || i == 7);
                    // NaN is not equal to itself
                    assert_eq!(format!("{:?}", arrays.status[i]), format!("{:?}", one.map(|_| ())));
                    assert!(arrays.impulse[i].is_nan() && arrays.object_velocity[2][i].is_nan());
                    continue;
                };
                for arrays in [&arrays, &with_jacobian] {
                    assert_eq!(arrays.status[i], Ok(one.regime));
                    assert_eq!(arrays.impulse[i], one.impulse, "shot {i}, {fidelity:?}");
                    for axis in 0..3 {
                        assert_eq!(arrays.cue_velocity[axis][i], one.cue.velocity[axis]);
                        assert_eq!(arrays.cue_spin[axis][i], one.cue.spin[axis]);
                        assert_eq!(arrays.object_velocity[axis][i], one.object.velocity[axis]);
                        assert_eq!(arrays.object_spin[axis][i], one.object.spin[axis]);
                    }
                }
                assert_eq!(jacobians[i], jacobian);
            }
        }
    }
}

#[test]
fn wrong_coefficients_and_lengths_are_said() {
    let cues = cues(10);
    let columns = Columns::new(&cues);
    let model = Model::new(Fidelity::Full, Ball::POOL);
    let mut arrays = Arrays::new(10);
    let wrong = Coefficients { e: 2.0, ..COEFFICIENTS };
    model.collide_batch(&columns.cues(), &wrong, &mut arrays.outcomes()).unwrap();
    assert!(arrays.status.iter().all(|status| *status == Err(NotACollision::EOutOfRange(2.0))));

    arrays.cue_spin[2].pop();
    let unlike = model.collide_batch(&columns.cues(), &COEFFICIENTS, &mut arrays.outcomes()).unwrap_err();
    assert_eq!(unlike, Lengths { name: "cue spin", found: 9, expected: 10 });
    let short = Cues { spin: [&[0.0; 10], &[0.0; 10], &[0.0; 2]], ..columns.cues() };
    let unlike = model.collide_batch(&short, &COEFFICIENTS, &mut arrays.outcomes()).unwrap_err();
    assert_eq!(unlike.to_string(), "omega_z has 2 shots; expected 10, as velocity x has");
}
