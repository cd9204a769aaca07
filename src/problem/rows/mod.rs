//! Tables as blocks: velocities and spins, or angles and speeds, before and after impacts.
//!
//! The own unknowns of a shot are the errors of its inputs, in units in which they are independent
//! with variance 1; its outcome is predicted from the true inputs (errors in variables: Fuller,
//! Measurement Error Models, 1987, § 3.2).

pub(crate) mod block;
pub(crate) mod choices;
pub(crate) mod deviations;
pub(crate) mod fidelity;
mod leverage;
mod outliers;
pub(crate) mod prediction;
pub(crate) mod run;
mod settle;
pub(crate) mod shot;
mod table;
mod view;

#[cfg(test)]
mod tests {
    use nalgebra::{DMatrix, DVector};

    use super::choices::{RowsChoices, RowsError};
    use super::run::{RowsFit, fit_rows};
    use super::shot::OWN;
    use super::table::Table;
    use crate::measurement::dataset::{
        Before, Dataset, Joint, Measured, Measurement, Shared as Common, Shot,
    };
    use crate::measurement::loss::Loss;
    use crate::measurement::observable::Observable;
    use crate::measurement::parameter::Parameter;
    use crate::measurement::spin::Spin;
    use crate::physics::ball::Ball;
    use crate::physics::collision::{Fidelity, FidelityChoice};
    use crate::problem::intervals::Status;
    use crate::problem::problem::State;
    use crate::problem::unknowns::Mode;
    use crate::problem::{Finding, Id, Policy};
    use crate::simulate::{self, Spec};

    const TRUTH: [(Id, f64); 3] = [(Id::Mu, 0.05), (Id::MuS, 0.25), (Id::E, 0.94)];
    const FULL: RowsChoices =
        RowsChoices { fidelity: FidelityChoice::Of(Fidelity::Full), loss: None, without_profiles: false };

    /// A table of this kind, these spins and this friction.
    fn table(kind: &str, spins: &str, mu: f64, cuts: [f64; 2], seed: u64) -> Dataset {
        let [low, high] = cuts;
        let spec: Spec = format!(
            r#"
            name = "table"
            kind = "{kind}"
            seed = {seed}
            truth = {{ mu = {mu}, mu_s = 0.25, e = 0.94 }}
            shots = {{ count = 20, speed_m_s = [1, 4], cut_deg = [{low}, {high}], cue_spin = [{spins}] }}
            noise = {{ velocity_m_s = 0.004, line_of_centres_deg = 0.05, spin_rad_s = 0.5, angle_deg = 0.2 }}
            "#
        )
        .parse()
        .unwrap();
        simulate::dataset(&spec).unwrap()
    }

    fn mixed(kind: &str, seed: u64) -> Dataset {
        table(kind, r#""natural-roll", "stun", "any""#, 0.05, [-50.0, 50.0], seed)
    }

    fn fitted(dataset: &Dataset, choices: &RowsChoices) -> Result<RowsFit, RowsError> {
        fit_rows(dataset, &dataset.shots.iter().collect::<Vec<_>>(), choices, &Policy::default())
    }

    fn without_errors(mut dataset: Dataset) -> Dataset {
        dataset.shots.iter_mut().flat_map(|shot| &mut shot.after).for_each(|row| row.measured.sd = None);
        dataset
    }

    impl RowsFit {
        fn get(&self, id: Id) -> crate::problem::Determined {
            *self.estimates.iter().find(|estimate| estimate.id == id).unwrap()
        }
    }

    /// The gradient is half of the slope of χ², for every own and shared unknown, away from the minimum,
    /// for velocities and angles, robust losses, falling friction and a compliant contact.
    #[test]
    fn gradient_is_the_slope_of_chi2() {
        for (kind, loss, falls) in [("impacts", Loss::Cauchy, false), ("angles", Loss::Squares, true)] {
            let mut dataset = mixed(kind, 1);
            dataset.settings.falls = falls;
            let shots: Vec<&Shot> = dataset.shots.iter().collect();
            let choices = RowsChoices { loss: Some(loss), ..FULL };
            let problem = Table::new(&dataset, &shots, &choices).unwrap().problem;
            let mut state = Table::new(&dataset, &shots, &choices).unwrap().start();
            for (i, own) in state.own[0].iter_mut().enumerate() {
                let moved = |place: usize| 0.3 * ((i + 2 * place) as f64).sin();
                let is_free = |place: usize| {
                    problem.rows().unwrap().shots[i].priors[place].is_some_and(|p| p.normal(&[]).is_some())
                };
                *own = DVector::from_fn(OWN, |place, _| if is_free(place) { moved(place) } else { 0.0 });
            }
            let at = problem.evaluate(state.clone());
            let slope_of = |moved: &dyn Fn(&mut State, f64)| {
                let cost = |by: f64| {
                    let mut state = state.clone();
                    moved(&mut state, by);
                    problem.evaluate(state).cost
                };
                (cost(1e-6) - cost(-1e-6)) / 4e-6
            };
            for column in problem.free() {
                let unknown = &problem.unknowns[column];
                let pull = unknown.active_prior().map_or(0.0, |p| p.pull(state.shared.0[column]) / p.sd);
                let slope = at.shots[0].iter().map(|shot| shot.slope(OWN + column)).sum::<f64>() + pull;
                let difference = slope_of(&|state, by| state.shared.0[column] += by);
                let name = unknown.id.name();
                assert!(
                    (difference - slope).abs() < 1e-4 * (1.0 + slope.abs()),
                    "{name}: {difference} {slope}"
                );
            }
            for place in (0..OWN).filter(|place| !at.shots[0][2].held[*place]) {
                let slope = at.shots[0][2].slope(place);
                let difference = slope_of(&|state, by| state.own[0][2][place] += by);
                assert!(
                    (difference - slope).abs() < 1e-4 * (1.0 + slope.abs()),
                    "{place}: {difference} {slope}"
                );
            }
        }
    }

    /// Tables of velocities and of angles, with and without stated errors, give the truth within 4 standard
    /// errors of each of 3 unknowns, and the noise where it is not stated.
    #[test]
    fn truth_is_within_the_errors() {
        for kind in ["impacts", "angles"] {
            for dataset in [mixed(kind, 2), without_errors(mixed(kind, 3))] {
                let fit = fitted(&dataset, &FULL).unwrap();
                for (id, truth) in TRUTH {
                    let estimate = fit.get(id);
                    let pull = (estimate.value - truth) / estimate.std_error.unwrap();
                    assert!(pull.abs() < 4.0, "{kind} {}: {pull}", id.name());
                }
                for noise in &fit.noises {
                    let truth = if noise.observables[0].is_angle() { 0.2_f64.to_radians() } else { 0.004 };
                    assert!((noise.sd / truth).ln().abs() < 0.5 && noise.dof > 10.0, "{noise:?}");
                }
            }
        }
    }

    /// χ², least over all other unknowns, is t² above its minimum at both ends of an interval, as close as
    /// they are looked for, and no lower from another start.
    #[test]
    fn profiles_end_where_chi2_has_risen_by_t_squared() {
        let fit = fitted(&mixed("impacts", 4), &FULL).unwrap();
        for (id, _) in TRUTH {
            for end in fit.get(id).profile.unwrap() {
                assert!((end.rise / 3.8415 - 1.0).abs() < 0.01, "{}: {end:?}", id.name());
                let mut held = fit.solution.problem.clone();
                let unknown = held.unknown_mut(id);
                (unknown.mode, unknown.start) = (Mode::Fixed, end.value);
                let mut start = fit.solution.state().clone();
                start.shared[id] = end.value;
                let again = crate::problem::minimise::fit(&mut held, &start).unwrap();
                let rise = again.end.cost - fit.solution.at.cost;
                assert!((rise - end.rise).abs() < 0.03, "{}: {rise} {}", id.name(), end.rise);
            }
        }
    }

    /// A speed before the impact that is not measured follows from a speed afterwards: without its column
    /// the estimates stay within a standard error.
    #[test]
    fn unknown_speeds_follow_from_speeds_afterwards() {
        let mut dataset = table("angles", r#""natural-roll", "stun""#, 0.05, [10.0, 50.0], 5);
        let with = fitted(&dataset, &FULL).unwrap();
        for shot in &mut dataset.shots {
            if let Before::Angle { speed, .. } = &mut shot.before {
                *speed = None;
            }
        }
        let without = fitted(&dataset, &FULL).unwrap();
        for id in [Id::Mu, Id::E] {
            let (with, without) = (with.get(id), without.get(id));
            assert!((with.value - without.value).abs() < without.std_error.unwrap(), "{}", id.name());
        }
    }

    /// What no number depends on is held and said to be not identified, contacts that all stick give the edge
    /// of their range, and textbook collisions their bounds exactly.
    #[test]
    fn limits_are_met_exactly() {
        let stun = fitted(&table("impacts", r#""stun""#, 0.05, [-50.0, 50.0], 6), &FULL).unwrap();
        assert_eq!(stun.get(Id::MuS).status, Status::NotIdentified);
        assert!(
            stun.solution.findings.iter().any(|f| matches!(f, Finding::Undetermined { id: Id::MuS, .. }))
        );

        let thick = fitted(&table("impacts", r#""stun""#, 0.3, [-8.0, 8.0], 7), &FULL).unwrap();
        let mu = thick.get(Id::Mu);
        assert!(mu.std_error.is_none() && mu.value < 0.2 && mu.interval.unwrap()[1] == 0.5, "{mu:?}");
        assert!(mu.interval.unwrap()[0] < mu.value, "{mu:?}");

        let exact = |value: f64| Measured { value, sd: None };
        let shot = |speed: f64| {
            let before = [exact(speed), exact(0.5)];
            let after = [[exact(0.0), exact(0.5)], [exact(speed), exact(0.0)]];
            Shot::impact(format!("{speed}"), ([1.0, 0.0], None), Spin::Stun, before, after)
        };
        let textbook =
            Dataset::new("textbook", Ball::POOL, (1..6).map(|i| shot(f64::from(i) + 0.05)).collect());
        let fit = fitted(&textbook, &FULL).unwrap();
        assert_eq!((fit.get(Id::Mu).value, fit.get(Id::E).value), (0.0, 1.0));
        assert_eq!(
            (fit.get(Id::Mu).status, fit.get(Id::E).status),
            (Status::AtLowerBound, Status::AtUpperBound)
        );
    }

    /// A shot that fits no collision that the others fit is left out, or counts little by a robust loss; a
    /// column whose errors are stated in some rows only is refused.
    #[test]
    fn wrong_rows_are_left_out_or_refused() {
        let mut dataset = mixed("impacts", 8);
        dataset.shots[4].after[0].measured.value += 0.5;
        let name = dataset.shots[4].name.clone();
        let fit = fitted(&dataset, &FULL).unwrap();
        assert!(fit.solution.findings.contains(&Finding::LostShots { names: vec![name] }));
        let robust = fitted(&dataset, &RowsChoices { loss: Some(Loss::Cauchy), ..FULL }).unwrap();
        assert!(robust.solution.weights()[4] < 0.01 && robust.solution.names[0].len() == 20);
        for (id, truth) in TRUTH {
            let pull = (robust.get(id).value - truth) / robust.get(id).std_error.unwrap();
            assert!(pull.abs() < 4.0, "{}: {pull}", id.name());
        }
        dataset.shots[4].after[0].measured.sd = None;
        assert!(matches!(fitted(&dataset, &FULL), Err(RowsError::MixedNoise { .. })));
    }

    /// Joint errors that are not correlated change nothing; an error that all shots share widens the errors.
    #[test]
    fn joint_errors_are_those_of_each_number() {
        let mut dataset = table("impacts", r#""stun", "side""#, 0.05, [-50.0, 50.0], 9);
        let plain = fitted(&dataset, &FULL).unwrap();
        for shot in &mut dataset.shots {
            let Before::Impact { normal: [x, y], velocity } = shot.before else { panic!() };
            let Spin::Measured { sd, .. } = shot.spin else { panic!() };
            let direction = x.sd.unwrap().hypot(y.sd.unwrap());
            let inputs = [Some(direction), velocity[0].sd, velocity[1].sd, sd[0], sd[1], sd[2]];
            let all = inputs.into_iter().chain(shot.after.iter().map(|row| row.measured.sd));
            let variances: Vec<f64> = all.map(|sd| sd.unwrap_or(0.0).powi(2)).collect();
            let rows = variances.len();
            let covariance = DMatrix::from_diagonal(&DVector::from_vec(variances));
            let by = DVector::from_fn(rows, |row, _| if row == Joint::BEFORE + 2 { 1.0 } else { 0.0 });
            let by_shared = Common::ALL.map(|_| by.clone()).to_vec();
            shot.joint = Some(Box::new(Joint { covariance, by_shared }));
        }
        let joint = fitted(&dataset, &FULL).unwrap();
        for (a, b) in plain.estimates.iter().zip(&joint.estimates) {
            assert!((a.value - b.value).abs() < 1e-6, "{a:?} {b:?}");
        }
        dataset.sliding = Some(Measured::new(0.2, 0.02));
        let shared = fitted(&dataset, &FULL).unwrap();
        assert!(shared.get(Id::E).std_error.unwrap() > joint.get(Id::E).std_error.unwrap());
    }

    /// Shots computed with the balls' weight are fitted with its offsets: `full` misses μ, `auto` does not.
    #[test]
    fn weight_is_let_in_if_the_shots_call_for_it() {
        let mut dataset = mixed("impacts", 10);
        let model = crate::physics::collision::Model::new(Fidelity::Contact, Ball::POOL);
        let full = dataset.model(Fidelity::Full);
        let truth = crate::physics::collision::Coefficients { mu: 0.05, mu_s: 0.25, e: 0.94 };
        for shot in &mut dataset.shots {
            let Before::Impact { normal, velocity } = shot.before else { panic!() };
            let cue = crate::physics::ball::BallState::stun(nalgebra::Vector3::new(
                velocity[0].value,
                velocity[1].value,
                0.0,
            ));
            let line = normal.map(|n| n.value);
            let outcomes = [model, full].map(|model| model.collide_on_table(line, &cue, &truth).unwrap());
            assert!((outcomes[0].components() - outcomes[1].components()).norm() > 0.0);
            shot.spin = Spin::Stun;
            let sd = 2e-5;
            shot.before = Before::Impact {
                normal: normal.map(|n| Measured { sd: None, ..n }),
                velocity: velocity.map(|v| Measured { sd: None, ..v }),
            };
            let after = [outcomes[0].cue.velocity, outcomes[0].object.velocity];
            let of = |observable: fn(crate::measurement::observable::Axis) -> Observable,
                      v: nalgebra::Vector3<f64>| {
                let axes = crate::measurement::observable::Axis::ALL.into_iter().take(2);
                axes.map(move |axis| Measurement {
                    observable: observable(axis),
                    measured: Measured::new(v[axis.index()], sd),
                })
                .collect::<Vec<_>>()
            };
            shot.after =
                [of(Observable::CueVelocity, after[0]), of(Observable::ObjectVelocity, after[1])].concat();
        }
        let auto = fitted(&dataset, &RowsChoices::default()).unwrap();
        let is_weighed = |finding: &Finding| matches!(finding, Finding::Weight { adopted: true, .. });
        assert!(auto.solution.findings.iter().any(is_weighed), "{:?}", auto.solution.findings);
        let off = |fit: &RowsFit| (fit.get(Id::Mu).value - 0.05) / fit.get(Id::Mu).std_error.unwrap();
        let full = fitted(&dataset, &FULL).unwrap();
        assert!(
            off(&auto).abs() < 0.5 && off(&full).abs() > off(&auto).abs(),
            "{} {}",
            off(&auto),
            off(&full)
        );
    }

    /// Throws at one speed and one cut determine friction at one slip only: neither part of a friction that
    /// falls is identified, and both are named together.
    #[test]
    fn undetermined_combinations_are_named() {
        let exact = |value: f64| Measured { value, sd: None };
        let shot = |i: u32| {
            let before = Before::Angle { cut: exact(0.6), speed: Some(exact(2.0)) };
            let throw = Measured::new(0.06 + 0.001 * f64::from(i % 3), 0.002);
            let after = vec![Measurement { observable: Observable::Throw, measured: throw }];
            Shot::new(format!("{i}"), before, Spin::Stun, after)
        };
        let mut dataset = Dataset::new("one slip", Ball::POOL, (0..6).map(shot).collect());
        dataset.settings.falls = true;
        dataset.settings[Parameter::E] = crate::measurement::parameter::Setting::held(0.94);
        let fit = fitted(&dataset, &FULL).unwrap();
        for id in [Id::Mu, Id::FallB] {
            assert_eq!(fit.get(id).status, Status::NotIdentified, "{}", id.name());
        }
        let values = [Id::Mu, Id::FallB].map(|id| (id, fit.solution.value(id)));
        let worst = fit.solution.worst_direction(&values).unwrap();
        assert!(worst.is_undetermined && worst.terms.len() == 2, "{worst:?}");
    }
}
