//! Films of discs as blocks: pucks on ice or on air tables.

pub(crate) mod block;
pub(crate) mod first_guess;
mod frames;
pub(crate) mod impact;
mod law;
mod lines;
pub(crate) mod measure;
mod motion;
mod outcome;
mod own;
mod points;
mod priors;
pub(crate) mod quantities;
pub(crate) mod run;
pub(crate) mod stick;

#[cfg(test)]
mod tests {
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::block::Freedom;
    use super::first_guess::DiscFilm;
    use super::own::LEAD;
    use super::quantities::Quantity;
    use super::run::fit_discs;
    use crate::measurement::dataset::Dataset;
    use crate::measurement::spin::Spin;
    use crate::measurement::track::{Marker, Sample, TrackShot, TrackedBall};
    use crate::physics::ball::Ball;
    use crate::physics::disc::Discs;
    use crate::problem::block::Block;
    use crate::problem::findings::{Finding, Severity};
    use crate::problem::policy::Policy;
    use crate::problem::problem::{Problem, State};
    use crate::problem::unknowns::{Id, Shared};

    const E: f64 = 0.85;
    const MU: f64 = 0.12;
    const RADII: [f64; 2] = [0.03, 0.02];
    const MASSES: [f64; 2] = [0.05, 0.03];
    const FPS: f64 = 240.0;
    const NOISE: f64 = 1e-4;

    fn normal(rng: &mut ChaCha8Rng) -> f64 {
        (0..12).map(|_| rng.random::<f64>()).sum::<f64>() - 6.0
    }

    /// Both discs, with a mark near the rim each, 60 frames on either side of an impact along x at 0 s
    /// that scatters by 0.02 in e and 0.01 in J_t/J_n. Sliding friction, or glue.
    fn shot(rng: &mut ChaCha8Rng, glued: bool) -> TrackShot {
        let (closing, across) = (rng.random_range(0.4..0.8), rng.random_range(0.4..0.8));
        let slip: f64 = if rng.random::<bool>() { across } else { -across };
        let e = if glued { 0.0 } else { E + 0.02 * normal(rng) };
        let ratio = if glued { 0.0 } else { -MU * slip.signum() + 0.01 * normal(rng) };
        let reduced = MASSES[0] * MASSES[1] / (MASSES[0] + MASSES[1]);
        let impulse = reduced * (1.0 + e) * closing;
        let slip = if glued { 0.0 } else { slip };
        let before = [[closing, -slip], [0.0, 0.0]];
        let (turn, late) = (rng.random_range(0.0..6.0), rng.random_range(-0.5..0.5) / FPS);
        let mut bodies = [Vec::new(), Vec::new()];
        let mut marks = [Vec::new(), Vec::new()];
        for frame in -60..=60 {
            let t = f64::from(frame) / FPS;
            let after = t > late;
            for disc in 0..2 {
                let sign = if disc == 0 { -1.0 } else { 1.0 };
                let [mut x, mut y] = before[disc];
                let mut spin = 0.0;
                if after {
                    x += sign * impulse / MASSES[disc];
                    y += sign * ratio * impulse / MASSES[disc];
                    spin = -2.0 * ratio * impulse / (MASSES[disc] * RADII[disc]);
                }
                let place = [x * (t - late) + (RADII[0] + RADII[1]) * disc as f64, y * (t - late)];
                let (sin, cos) = f64::sin_cos(turn + spin * (t - late));
                let arm = 0.8 * RADII[disc];
                let mut seen =
                    |[x, y]: [f64; 2]| Sample::new(t, [x + NOISE * normal(rng), y + NOISE * normal(rng)]);
                bodies[disc].push(seen(place));
                marks[disc].push(seen([place[0] + arm * cos, place[1] + arm * sin]));
            }
        }
        let mut shot = TrackShot::new("shot", FPS, Spin::Unknown, bodies);
        let balls = [TrackedBall::Cue, TrackedBall::Object].into_iter().zip(marks);
        shot.markers =
            balls.map(|(ball, samples)| Marker { ball, name: "mark".to_owned(), samples }).collect();
        shot
    }

    fn film(shots: usize, seed: u64, glued: bool) -> Dataset {
        let rng = &mut ChaCha8Rng::seed_from_u64(seed);
        let shots = (0..shots).map(|_| shot(rng, glued)).collect();
        let mut dataset = Dataset::filmed("pucks", Ball::POOL, shots);
        let discs = Discs { radii: Some(RADII), masses: Some(MASSES), inertia: 0.5, in_seconds: true };
        dataset.tracks.as_mut().unwrap().discs = Some(discs);
        dataset
    }

    /// The gradient is half of the slope of χ², for every own and shared unknown.
    #[test]
    fn gradient_is_the_slope_of_chi2() {
        let DiscFilm { mut block, unknowns, own, .. } = DiscFilm::new(&film(3, 1, false)).unwrap();
        block.freedom = Freedom::Law;
        block.noise.iter_mut().for_each(|noise| (noise.sd, noise.rho) = (1e-2, 0.3));
        let mut problem = Problem::of_one(Block::Discs(block), unknowns);
        problem.unknown_mut(Id::Kappa).start = 1.3;
        let shared = problem.unknowns.iter().map(|unknown| unknown.start).collect();
        let mut state = State { own: vec![own], shared: Shared(shared) };
        (state.shared[Id::Slowing], state.own[0][1][LEAD]) = (0.05, 1e-3);
        let at = problem.evaluate(state.clone());
        let cost = |moved: State| problem.evaluate(moved).cost;
        let check = |name: &str, step: f64, slope: f64, moved: &dyn Fn(f64) -> State| {
            let difference = (cost(moved(step)) - cost(moved(-step))) / (4.0 * step);
            assert!((difference - slope).abs() < 2e-3 * (1.0 + slope.abs()), "{name}: {difference} {slope}");
        };
        for column in problem.free() {
            let unknown = &problem.unknowns[column];
            let pull = unknown.active_prior().map_or(0.0, |p| p.pull(state.shared.0[column]) / p.sd);
            let of_shot = |shot: &crate::problem::sums::Contribution| shot.slope(shot.held.len() + column);
            let slope = at.shots[0].iter().map(of_shot).sum::<f64>() + pull;
            check(unknown.id.name(), 1e-5, slope, &|by| {
                let mut state = state.clone();
                state.shared.0[column] += by;
                state
            });
        }
        let shot = &at.shots[0][1];
        for i in (0..shot.held.len()).filter(|i| !shot.held[*i]) {
            check(&format!("own {i}"), 1e-6, shot.slope(i), &|by| {
                let mut state = state.clone();
                state.own[0][1][i] += by;
                state
            });
        }
    }

    /// Shots that scatter give the truth within 4 standard errors of e and μ, and no doubt.
    #[test]
    fn truth_is_within_the_errors() {
        let fit = fit_discs(&film(12, 2, false), &Policy::default()).unwrap();
        assert_eq!(fit.solution.severity(), Severity::Note, "{:?}", fit.solution.findings);
        for (id, truth) in [(Id::E, E), (Id::Mu, MU)] {
            let estimate = fit.solution.get(id).unwrap();
            let sd = estimate.std_error.unwrap();
            assert!((estimate.value - truth).abs() < 4.0 * sd && sd < 0.012, "{} ± {sd}", estimate.value);
        }
        let scatter: Vec<f64> = fit.scatter.iter().take(2).map(|scatter| scatter.sd).collect();
        assert!((0.01..0.04).contains(&scatter[0]) && (0.005..0.02).contains(&scatter[1]), "{scatter:?}");
        for impact in &fit.impacts {
            let [paths, spin] =
                [Quantity::ImpulseRatio, Quantity::ImpulseRatioByFirstSpin].map(|q| impact.get(q));
            let (paths, spin) = (paths.unwrap(), spin.unwrap());
            assert!((paths.value - spin.value).abs() < 5.0 * paths.sd.unwrap().hypot(spin.sd.unwrap()));
        }
    }

    /// Masses that are stated the wrong way round contradict the frames, which is said.
    #[test]
    fn wrong_masses_are_named() {
        let mut dataset = film(8, 3, false);
        dataset.tracks.as_mut().unwrap().discs.as_mut().unwrap().masses = Some([MASSES[1], MASSES[0]]);
        let fit = fit_discs(&dataset, &Policy::default()).unwrap();
        let is_mass = |finding: &Finding| matches!(finding, Finding::Conflict { id: Id::MassRatio, .. });
        assert!(fit.solution.findings.iter().any(is_mass), "{:?}", fit.solution.findings);
        assert!(fit.solution.severity() >= Severity::Doubtful);
    }

    /// Films in which nothing collides, and discs that stick together, give an error.
    #[test]
    fn films_without_a_collision_give_an_error() {
        assert!(fit_discs(&film(2, 4, true), &Policy::default()).is_err());
        let mut away = film(2, 5, false);
        for shot in &mut away.tracks.as_mut().unwrap().shots {
            shot.samples_mut().for_each(|sample| sample.x = if sample.t > 0.0 { f64::NAN } else { sample.x });
        }
        assert!(fit_discs(&away, &Policy::default()).is_err());
    }
}
