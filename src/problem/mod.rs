//! Films of balls, films of discs, and tables as one least-squares problem.
//!
//! Each shot has unknowns of its own: of a film instant, place, direction and velocity of the cue
//! ball, and what is uncertain of its spin; of a table the true inputs. All shots share the
//! unknowns of contact, balls, cloth and camera, each with its prior. Frames are predicted
//! forward into the picture: through the impact, the motion on the cloth, and the camera, at each
//! frame's own time. Velocities and angles of tables are predicted by the impact. Own unknowns are
//! eliminated (Schur complement; Triggs et al. 2000), so that a step costs time linear in the
//! frames. Noise of frames is autoregressive of first order and whitened exactly; its size, and
//! the spreads of spins from shot to shot, are estimated by restricted maximum likelihood, its
//! correlation from that of the residuals.
//!
//! | file | what it holds |
//! | --- | --- |
//! | `unknowns`, `sums`, `eliminated` | shared unknowns, and what a shot adds to the normal equations |
//! | `discs`, `film`, `rows`, `frames` | measurements: forward models and derivatives |
//! | `problem`, `minimise`, `noise` | blocks of measurements, normal equations, descents and their starts, noise |
//! | `effects` | compliance, weight and cloth, adopted if they make the data likelier |
//! | `uncertainty` | errors, scores, conflicts, combinations |
//! | `solution` | a minimum, and what is known there: estimates, budget, influence |
//! | `findings`, `policy`, `run` | findings, statistical choices, the fit from beginning to end |
//! | `false_shots` | shots that fit no collision, clips that are there twice |

mod discs;
mod effects;
mod eliminated;
mod evaluation;
mod false_shots;
mod film;
mod findings;
mod frames;
mod intervals;
mod loss;
mod minimise;
mod noise;
mod offsets;
mod policy;
#[allow(clippy::module_inception)]
mod problem;
mod profile;
mod rows;
mod run;
mod solution;
mod sums;
mod uncertainty;
mod unknowns;

pub use discs::impact::DiscImpact;
pub(crate) use discs::law::{DiscFit, fit_discs};
pub(crate) use discs::measure::measure_discs;
pub(crate) use discs::own::Component;
pub(crate) use false_shots::find_copies;
pub(crate) use film::camera::Camera;
pub use film::film_data::FilmError;
pub(crate) use film::film_data::OTHER_UNIT;
#[cfg(feature = "io")]
pub(crate) use film::planned::{Filming, PlannedShot, information, unknowns_of};
pub(crate) use film::shots::Impact;
#[cfg(feature = "report")]
pub(crate) use film::shots::ShownPaths;
pub(crate) use findings::{Finding, Severity};
pub(crate) use intervals::{FitEnd, MANY_SHOTS, MISLEADING};
pub use intervals::{ParameterEstimate, Status};
pub(crate) use offsets::{ShiftScore, Slope};
pub(crate) use policy::{Choices, POLICY};
pub use rows::block::{Prediction, predict};
pub(crate) use rows::run::{fit_rows, refutes};
pub(crate) use rows::shot::Deviations;
pub use rows::shot::RowsError;
#[cfg(feature = "io")]
pub use rows::shot::Unpredictable;
pub(crate) use rows::table::TableNoise;
pub(crate) use run::fit_film;
#[cfg(feature = "report")]
pub(crate) use solution::Estimate;
pub(crate) use solution::{Budget, ShotInfluence, Solution};
pub use unknowns::Id;
pub(crate) use unknowns::Normal;
pub(crate) use {
    effects::comply,
    evaluation::Evaluation,
    film::own,
    minimise::{Descent, MUS, descend, descend_with_noise},
    problem::{Block, Problem, Record, Sample, State},
    uncertainty::{Combination, Estimates, robust_covariance, worst_direction},
    unknowns::{Mode, Own, Shared, Unknown},
};

#[cfg(test)]
mod tests {
    // Derivatives of all blocks, and films and tables that no test of the whole program has.

    use std::path::Path;

    use super::discs::first_guess::prepare_discs;
    use super::discs::own::LEAD;
    use super::film::film_data::prepare_film;
    use super::film::own::MOVING;
    use super::problem::{Prepared, Problem, State};
    use super::rows::table::prepare_table;
    use super::sums::Noise;
    use super::unknowns::Own;
    use super::{Choices, FitEnd, Id, ParameterEstimate, Status, fit_film, fit_rows};
    use crate::io;
    use crate::measurement::dataset::{Before, Dataset};
    use crate::measurement::loss::Loss;
    use crate::measurement::parameter::{Parameter, Settings};
    use crate::measurement::spin::Spin;
    use crate::measurement::track::{Sample, TrackShot};
    use crate::physics::ball::Ball;
    use crate::physics::collision::Fidelity;
    use crate::simulate;

    const FULL: Choices =
        Choices { fidelity: Some(Fidelity::Full), loss: None, tolerance: None, without_profiles: false };

    /// Shots of this kind, with these spins, this friction and these cut angles; noise 0.2 mm and
    /// the like.
    fn made(kind: &str, count: usize, spins: &str, mu: f64, cuts: [f64; 2], seed: u64) -> Dataset {
        let spec = format!(
            r#"
        name = "made"
        kind = "{kind}"
        seed = {seed}
        truth = {{ mu = {mu}, mu_s = 0.25, e = 0.94 }}
        shots = {{ count = {count}, speed_m_s = [1, 4], cut_deg = {cuts:?}, cue_spin = [{spins}] }}
        noise = {{ velocity_m_s = 0.004, line_of_centres_deg = 0.05, spin_rad_s = 0.5, angle_deg = 0.2 }}
        camera = {{ fps = 240, position_sd_m = 2e-4 }}
        "#
        );
        simulate::dataset(&spec.parse().unwrap()).unwrap()
    }

    fn rolls(shots: usize, seed: u64) -> Dataset {
        made("tracks", shots, r#""natural-roll""#, 0.05, [-50.0, 50.0], seed)
    }

    fn fitted(dataset: &Dataset) -> FitEnd {
        fit_rows(dataset, &FULL).unwrap()
    }

    fn get(fit: &FitEnd, parameter: Parameter) -> ParameterEstimate {
        fit.estimates(&[parameter], &Settings::default())[0]
    }

    /// Checks that the gradient is half of the slope of χ², for these shared unknowns to one
    /// tolerance and for every own unknown of a shot to the other.
    fn check_gradient(problem: &Problem, state: &State, columns: &[usize], shot: usize, most: [f64; 2]) {
        let check = |name: &str, moved: &dyn Fn(&mut State, f64), (step, slope, most): (f64, f64, f64)| {
            let cost = |by: f64| {
                let mut state = state.clone();
                moved(&mut state, by);
                problem.evaluate(state).cost
            };
            let difference = (cost(step) - cost(-step)) / (4.0 * step);
            assert!((difference - slope).abs() < most * (1.0 + slope.abs()), "{name}: {difference} {slope}");
        };
        for column in columns {
            let unknown = &problem.unknowns[*column];
            let pull = unknown.active_prior().map_or(0.0, |p| p.pull(state.shared.0[*column]) / p.sd);
            let shots = (0..state.own[0].len()).map(|i| problem.contribute(state, (0, i)));
            let slope = shots.map(|shot| shot.slope(shot.sums.held.len() + column)).sum::<f64>() + pull;
            check(unknown.id.name(), &|state, by| state.shared.0[*column] += by, (1e-5, slope, most[0]));
        }
        let contribution = problem.contribute(state, (0, shot));
        let held = &contribution.sums.held;
        for i in (0..held.len()).filter(|i| !held[*i]) {
            let values = (1e-6, contribution.slope(i), most[1]);
            check(&format!("own {i}"), &|state, by| state.own[0][shot][i] += by, values);
        }
    }

    /// Away from the minimum, with all corrections of the camera on and outcome offsets.
    #[test]
    fn gradients_of_films_are_slopes_of_chi2() {
        let dataset = rolls(5, 1);
        let Prepared { mut problem, start: mut state, .. } =
            prepare_film(&dataset, &Choices::default()).unwrap();
        problem.film_mut().unwrap().variation.noises = vec![Noise { sd: 0.05, rho: 0.3 }; 2];
        let columns: Vec<usize> =
            problem.free().into_iter().chain(Id::OFFSETS.map(|id| id as usize)).collect();
        for column in problem.free() {
            state.shared.0[column] += 0.1 * problem.unknowns[column].prior.map_or(0.02, |p| p.sd.min(0.3));
        }
        check_gradient(&problem, &state, &columns, 3, [1e-3, 1e-4]);
    }

    /// Tables of velocities and angles have them, with a robust loss and falling friction.
    #[test]
    fn gradients_of_tables_are_slopes_of_chi2() {
        for (kind, loss, falls) in [("impacts", Loss::Cauchy, false), ("angles", Loss::Squares, true)] {
            let mut dataset = made(kind, 20, r#""natural-roll", "stun", "any""#, 0.05, [-50.0, 50.0], 1);
            dataset.settings.falls = falls;
            let table = prepare_table(&dataset, &Choices { loss: Some(loss), ..FULL }).unwrap();
            let (problem, mut state) = (&table.problem, table.start.clone());
            for (i, own) in state.own[0].iter_mut().enumerate() {
                let held = &problem.evaluate(table.start.clone()).shots[0][i].held;
                let moved =
                    |place: usize| if held[place] { 0.0 } else { 0.3 * ((i + 2 * place) as f64).sin() };
                *own = Own::from_fn(MOVING, |place, _| moved(place));
            }
            check_gradient(problem, &state, &problem.free(), 2, [1e-4; 2]);
        }
    }

    /// Discs have them, with a compliant contact, friction that leads, and a deceleration.
    #[test]
    fn gradients_of_discs_are_slopes_of_chi2() {
        let dataset = io::load(Path::new("data/pucks-chalmers-2023")).unwrap();
        let Prepared { mut problem, start: mut state, .. } = prepare_discs(&dataset).unwrap();
        let block = problem.discs_mut().unwrap();
        block.has_law = true;
        block.variation.noises.iter_mut().for_each(|noise| (noise.sd, noise.rho) = (1e-2, 0.3));
        (state.shared[Id::Slowing], state.shared[Id::Kappa]) = (0.05, 1.3);
        state.own[0][1][LEAD] = 1e-3;
        check_gradient(&problem, &state, &problem.free(), 1, [2e-3; 2]);
    }

    /// Without a shot, the estimates of a film move as its influence says, to first order: the
    /// noise is estimated again, and χ² is not a parabola.
    #[test]
    fn influence_is_what_a_shot_changes() {
        let mut dataset = rolls(10, 6);
        let fitted = |dataset: &Dataset| fit_film(dataset, &Choices::default()).unwrap();
        let all = fitted(&dataset);
        let influence = all.influence()[3].clone().unwrap();
        dataset.tracks.as_mut().unwrap().shots.remove(3);
        let without = fitted(&dataset);
        for (id, change) in influence.changes.into_iter().filter(|(id, _)| Id::WANTED.contains(id)) {
            let (before, after) = (all.get(id).unwrap(), without.get(id).unwrap());
            let off = (after.value - before.value - change) / before.std_error.unwrap();
            assert!(off.abs() < 0.25, "{}: {off}", id.name());
        }
    }

    /// Films of one shot, of few frames and of no collision give a fit or an error.
    #[test]
    fn poor_films_give_a_fit_or_an_error() {
        let fitted = |dataset: &Dataset| fit_film(dataset, &Choices::default());
        assert!(fitted(&rolls(1, 5)).is_ok_and(|fit| fit.names().len() == 1));
        for count in [0, 1, 2, 7, 40] {
            for speed in [0.0, 1.0, f64::NAN] {
                let sample =
                    |speed: f64, n: usize| Sample::new(n as f64 / 240.0, [speed * n as f64 / 240.0, 0.0]);
                let tracks = [speed, 0.0].map(|speed| (0..count).map(|n| sample(speed, n)).collect());
                let shot = TrackShot::new("shot", 240.0, Spin::NaturalRoll, tracks);
                assert!(fitted(&Dataset::filmed("film", Ball::POOL, vec![shot])).is_err(), "{count} {speed}");
            }
        }
    }

    /// A speed before the impact that is not measured follows from a speed afterwards: without its
    /// column the estimates stay within a standard error.
    #[test]
    fn unknown_speeds_follow_from_speeds_afterwards() {
        let mut dataset = made("angles", 20, r#""natural-roll", "stun""#, 0.05, [10.0, 50.0], 5);
        let with = fitted(&dataset);
        for shot in &mut dataset.shots {
            let Before::Angle { speed, .. } = &mut shot.before else { panic!("{:?}", shot.before) };
            *speed = None;
        }
        let without = fitted(&dataset);
        for parameter in [Parameter::Mu, Parameter::E] {
            let (with, without) = (get(&with, parameter), get(&without, parameter));
            assert!((with.value - without.value).abs() < without.std_error.unwrap(), "{}", parameter.name());
        }
    }

    /// Contacts that all stick leave μ at the edge of the range of values that fit equally well,
    /// which its interval holds.
    #[test]
    fn contacts_that_all_stick_give_the_edge_of_their_range() {
        let mu = get(&fitted(&made("impacts", 20, r#""stun""#, 0.3, [-8.0, 8.0], 7)), Parameter::Mu);
        let [low, high] = mu.interval_95.unwrap();
        assert!(mu.std_error.is_none() && mu.value < 0.2 && low < mu.value && high == 0.5, "{mu:?}");
        assert_ne!(mu.status, Status::NotIdentified);
    }
}
