//! Films of balls, films of discs, and tables as one least-squares problem.
//!
//! Each shot has unknowns of its own: of a film instant, place, direction and velocity of the cue
//! ball, and what is uncertain of its spin; of a table the true inputs. All shots share those of
//! contact, balls, cloth and camera, each with a prior of what is known of it. Frames are predicted
//! forward into the picture: through the impact, the motion on the cloth, and the camera, at each
//! frame's own time. Velocities and angles of tables are predicted by the impact. Own unknowns are
//! eliminated (Schur complement; Triggs et al. 2000), so that a step costs time linear in the
//! frames. Noise of frames is autoregressive of first order and whitened exactly; its size and correlation,
//! and the spreads of spins from shot to shot, are estimated by restricted maximum likelihood.
//!
//! | file | what it holds |
//! | --- | --- |
//! | `unknowns`, `sums` | shared unknowns, and what a shot adds to the normal equations |
//! | `block`, `discs`, `film`, `rows` | what was measured: forward models with their derivatives |
//! | `problem`, `descent`, `minimise`, `noise` | normal equations, descent, starts, noise |
//! | `uncertainty` | errors, scores, conflicts, budget, influence |
//! | `solution` | a minimum, and what is known there |
//! | `findings`, `policy`, `run` | what is said, statistical choices, the fit from beginning to end |

mod block;
mod descent;
mod discs;
mod film;
mod findings;
mod identifiability;
mod intervals;
mod loss;
mod minimise;
mod noise;
mod offsets;
mod policy;
#[allow(clippy::module_inception)]
mod problem;
mod profile;
mod resample;
mod robust;
mod rows;
mod run;
mod solution;
mod sums;
mod uncertainty;
mod unknowns;

pub use discs::block::Component;
pub use discs::impact::{DiscImpact, Doubt};
pub use discs::measure::{MeasuredDiscs, measure_discs};
pub use discs::quantities::Quantity;
pub use discs::run::{DiscFit, Rival, Scatter, fit_discs};
pub use discs::stick::Stuck;
pub(crate) use film::camera::Camera;
pub use film::film_data::{FilmError, Modelling};
#[cfg(feature = "io")]
pub(crate) use film::planned::{Filming, PlannedShot, information, unknowns_of};
pub use film::shots::{FittedFrame, Impact, Motion, PicturePaths};
pub use findings::{Finding, Severity};
pub use identifiability::{Combination, Invariant, Remains};
pub use intervals::{Determined, Status};
pub(crate) use offsets::ShiftScore;
pub use offsets::{Offsets, Slope};
pub use policy::Policy;
pub use profile::End;
pub use rows::choices::{RowsChoices, RowsError};
pub(crate) use rows::deviations::Deviations;
pub use rows::prediction::{Prediction, predict};
pub use rows::run::{RowsFit, TableNoise, fit_rows};
pub use rows::shot::Unpredictable;
pub use run::fit_film;
pub use solution::{Budget, Estimate, ShotInfluence, Solution};
pub use sums::Noise;
pub use uncertainty::{Conflict, Score, Share};
pub use unknowns::{Id, Normal};
pub(crate) use {
    block::Block,
    descent::descend_until,
    film::{causes::comply, own},
    minimise::{descend_weighed, descend_with_noise},
    problem::{Evaluation, Problem, Sample, State},
    robust::robust_covariance,
    uncertainty::Estimates,
    unknowns::{Mode, Own, Shared, Unknown},
};

#[cfg(test)]
mod tests {
    // films of a simulator with its own equations of motion
    use super::block::Block;
    use super::film::film_data::{Film, Modelling};
    use super::film::own::OWN;
    use super::problem::{Problem, State};
    use super::run::fit_film;
    use super::unknowns::{Mode, Shared};
    use super::{FilmError, Finding, Id, Policy, Severity, Solution};
    use crate::measurement::dataset::Dataset;
    use crate::measurement::spin::Spin;
    use crate::measurement::track::{Sample, TrackShot};
    use crate::physics::ball::Ball;
    use crate::simulate::{self, Spec};

    const TRUTH: [(Id, f64); 3] = [(Id::Mu, 0.05), (Id::MuS, 0.25), (Id::E, 0.94)];

    /// A film of this many shots with this spin, 240 frames/s, noise 0.2 mm.
    fn film(shots: usize, spin: &str, seed: u64) -> Dataset {
        let spec: Spec = format!(
            r#"
            name = "film"
            kind = "tracks"
            seed = {seed}
            truth = {{ mu = 0.05, mu_s = 0.25, e = 0.94 }}
            shots = {{ count = {shots}, speed_m_s = [1, 4], cut_deg = [-50, 50], cue_spin = ["{spin}"] }}
            camera = {{ fps = 240, position_sd_m = 2e-4 }}
            "#
        )
        .parse()
        .unwrap();
        simulate::dataset(&spec).unwrap()
    }

    fn fitted(dataset: &Dataset) -> Result<Solution, FilmError> {
        fit_film(dataset, &Modelling::of(dataset), &Policy::default())
    }

    /// The gradient is half of the slope of χ², for every own and shared unknown, away from the minimum
    /// and with all corrections of the camera on.
    #[test]
    fn gradient_is_the_slope_of_chi2() {
        let Film { mut block, unknowns, own, .. } = {
            let dataset = film(5, "natural-roll", 1);
            Film::new(&dataset, &Modelling::of(&dataset)).unwrap()
        };
        block.world.noise = [super::Noise { sd: 0.05, rho: 0.3 }; 2];
        let problem = Problem::of_one(Block::Film(block), unknowns);
        let away = problem.unknowns.iter().map(|unknown| {
            let step =
                if unknown.mode == Mode::Free { unknown.prior.map_or(0.02, |p| p.sd.min(0.3)) } else { 0.0 };
            unknown.start + 0.1 * step
        });
        let state = State { own: vec![own], shared: Shared(away.collect()) };
        let at = problem.evaluate(state.clone());
        let cost = |moved: State| problem.evaluate(moved).cost;
        let offsets = Id::OFFSETS.map(|id| id as usize);
        for column in problem.free().into_iter().chain(offsets) {
            let unknown = &problem.unknowns[column];
            let moved = |by: f64| {
                let mut state = state.clone();
                state.shared.0[column] += by;
                state
            };
            let step = 1e-5;
            let difference = (cost(moved(step)) - cost(moved(-step))) / (4.0 * step);
            let pull = unknown.active_prior().map_or(0.0, |p| p.pull(state.shared.0[column]) / p.sd);
            let of_shot = |shot: &super::sums::Contribution| shot.slope(OWN + column);
            let slope = at.shots[0].iter().map(of_shot).sum::<f64>() + pull;
            let name = unknown.id.name();
            assert!((difference - slope).abs() < 1e-3 * (1.0 + slope.abs()), "{name}: {difference} {slope}");
        }
        for i in (0..OWN).filter(|i| !at.shots[0][3].held[*i]) {
            let moved = |by: f64| {
                let mut state = state.clone();
                state.own[0][3][i] += by;
                state
            };
            let difference = (cost(moved(1e-6)) - cost(moved(-1e-6))) / 4e-6;
            let slope = at.shots[0][3].slope(i);
            assert!((difference - slope).abs() < 1e-4 * (1.0 + slope.abs()), "own {i}: {difference} {slope}");
        }
    }

    /// Films of rolls, stun shots and rolls of unknown spin give the truth within 4 standard errors of
    /// each of 3 unknowns, and no doubt.
    #[test]
    fn truth_is_within_the_errors() {
        for (spin, unknown) in [("natural-roll", false), ("stun", false), ("natural-roll", true)] {
            let mut dataset = film(15, spin, 2);
            if unknown {
                for shot in &mut dataset.tracks.as_mut().unwrap().shots {
                    shot.spin = Spin::Unknown;
                }
            }
            let fit = fitted(&dataset).unwrap();
            assert_eq!(
                (fit.severity(), fit.names[0].len()),
                (Severity::Note, 15),
                "{spin}: {:?}",
                fit.findings
            );
            for (id, truth) in TRUTH {
                let Some(estimate) = fit.get(id) else { continue };
                let error = estimate.std_error.unwrap();
                let pull = (estimate.value - truth) / error;
                assert!(pull.abs() < 4.0, "{spin}: {} {} ± {error}", id.name(), estimate.value);
            }
            assert!(fit.get(Id::E).unwrap().std_error.unwrap() < 2e-3);
        }
    }

    /// The parts of a budget and the noise of the frames add up to the variance.
    #[test]
    fn budgets_add_up_to_the_variance() {
        let dataset = film(10, "natural-roll", 3);
        let fit = fitted(&dataset).unwrap();
        for id in Id::WANTED {
            let budget = fit.budget(id).unwrap();
            let error = fit.get(id).unwrap().std_error.unwrap();
            let sum = budget.shares.iter().map(|share| share.variance).sum::<f64>() + budget.noise;
            assert!((sum / (error * error) - 1.0).abs() < 1e-6);
        }
    }

    /// Without a shot, the estimates move as its influence says, to first order.
    #[test]
    fn influence_is_what_a_shot_changes() {
        let mut dataset = film(10, "natural-roll", 6);
        let all = fitted(&dataset).unwrap();
        let influence = all.influence();
        dataset.tracks.as_mut().unwrap().shots.remove(3);
        let without = fitted(&dataset).unwrap();
        for (id, change) in &influence[3].as_ref().unwrap().changes {
            if !Id::WANTED.contains(id) {
                continue;
            }
            let (before, after) = (all.get(*id).unwrap(), without.get(*id).unwrap());
            // the noise is estimated again, and χ² is no parabola
            let off = (after.value - before.value - change) / before.std_error.unwrap();
            assert!(off.abs() < 0.25, "{}: {off}", id.name());
        }
    }

    /// Balls of another size than stated, and cue balls that slide though natural roll is stated, are
    /// named, and the fit is doubtful.
    #[test]
    fn wrong_statements_are_named() {
        let mut dataset = film(15, "natural-roll", 4);
        dataset.ball.radius *= 1.09;
        let fit = fitted(&dataset).unwrap();
        let is_scale = |finding: &Finding| matches!(finding, Finding::Conflict { id: Id::Scale, .. });
        assert!(
            fit.findings.iter().any(is_scale) && fit.severity() == Severity::Doubtful,
            "{:?}",
            fit.findings
        );

        let mut dataset = film(15, "stun", 4);
        for shot in &mut dataset.tracks.as_mut().unwrap().shots {
            shot.spin = Spin::NaturalRoll;
        }
        let fit = fitted(&dataset).unwrap();
        let is_spin =
            |finding: &Finding| matches!(finding, Finding::Spins { topspin, .. } if topspin.abs() < 0.05);
        assert!(
            fit.findings.iter().any(is_spin) && fit.severity() == Severity::Doubtful,
            "{:?}",
            fit.findings
        );
    }

    /// Films of few shots, of few frames and of no collision give a fit or an error.
    #[test]
    fn poor_films_give_a_fit_or_an_error() {
        let one = film(1, "natural-roll", 5);
        assert!(fitted(&one).is_ok_and(|fit| fit.names[0].len() == 1));
        let samples = |count: usize, speed: f64| -> Vec<Sample> {
            (0..count).map(|n| Sample::new(n as f64 / 240.0, [speed * n as f64 / 240.0, 0.0])).collect()
        };
        for count in [0, 1, 2, 7, 40] {
            for speed in [0.0, 1.0, f64::NAN] {
                let tracks = [samples(count, speed), samples(count, 0.0)];
                let shot = TrackShot::new("shot", 240.0, Spin::NaturalRoll, tracks);
                let dataset = Dataset::filmed("film", Ball::POOL, vec![shot]);
                assert!(fitted(&dataset).is_err(), "{count} {speed}");
            }
        }
    }
}
