//! What the library refuses of data sets that a program made, as the loader refuses it of files; and what it says where the
//! data do not tell everything.

use std::fmt::Debug;
use std::str::FromStr;

use caromfit::compare::CompareError;
use caromfit::measurement::parameter::Prior;
use caromfit::name::UnknownName;

use crate::prelude::*;

fn good() -> Dataset {
    made(&spec("impacts", &["natural-roll"], 10, 1))
}

/// A program's own measurements, without files: exact ones give the parameters that they were made with.
#[test]
fn a_data_set_from_vectors_is_fitted() {
    /// Noise is stated to weigh the values, but there is none: what is left is the tolerance of the search.
    const EXACT: f64 = 1e-6;
    let model = Model::new(Fidelity::Full, Ball::POOL);
    let truth = Coefficients { mu: 0.06, mu_s: 0.25, e: 0.95 };
    let shots = (1..=9).map(|i| {
        let (cut, speed) = (f64::from(6 * i).to_radians(), 1.0 + 0.3 * f64::from(i));
        let (sin, cos) = cut.sin_cos();
        let roll = speed / Ball::POOL.radius;
        let cue = BallState {
            velocity: [speed * cos, speed * sin, 0.0].into(),
            spin: [-roll * sin, roll * cos, 0.0].into(),
        };
        let after = model.collide(&cue, &truth).unwrap();
        let plane = |ball: &BallState| [ball.velocity.x, ball.velocity.y].map(|v| Measured::new(v, 1e-3));
        // a line of centres of any length
        Shot::impact(
            i.to_string(),
            ([2.0, 0.0], Some(1e-3)),
            Spin::NaturalRoll,
            plane(&cue),
            [plane(&after.cue), plane(&after.object)],
        )
    });
    let dataset = Dataset::new("vectors", Ball::POOL, shots.collect());
    assert_eq!(dataset.faults(), Vec::<String>::new());
    let fits = fit::fit(&dataset, &options::of_fit()).unwrap();
    let found = [fits[0].mu(), fits[0].mu_s(), fits[0].e()].map(|estimate| estimate.unwrap().value);
    for (found, truth) in found.into_iter().zip([truth.mu, truth.mu_s, truth.e]) {
        assert!((found - truth).abs() < EXACT, "{found} for {truth}");
    }
    assert!(fits[0].get(Parameter::C).is_none());
}

/// A change that makes a data set useless.
type Spoil<'a> = &'a dyn Fn(&mut Dataset);

#[test]
fn what_cannot_be_fitted_is_refused_by_its_name() {
    let zero = Prior { mean: 0.05, sd: 0.0 };
    let short = |dataset: &mut Dataset| {
        let Before::Impact { normal, .. } = &mut dataset.shots[0].before else { panic!() };
        for component in normal {
            component.value *= 0.1;
        }
    };
    let negative = |d: &mut Dataset| d.shots[3].after[0].measured.sd = Some(-0.004);
    let cases: [(Spoil, &str); 12] = [
        (&|d| d.settings[Parameter::Mu].initial = 0.7, "mu.initial is 0.7; expected 0.0 to 0.5, its bounds"),
        (&|d| d.settings[Parameter::E].upper = 1.5, "e.upper is 1.5; expected 0 to 1"),
        (&|d| d.settings[Parameter::MuS].lower = 2.0, "mu_s.lower is 2.0; expected at most mu_s.upper, 1.0"),
        (&|d| d.settings[Parameter::Mu].initial = f64::NAN, "mu.initial is NaN; expected 0 or more"),
        (&|d| d.settings[Parameter::Mu].prior = Some(zero), "mu.prior_sd is 0; expected more than 0"),
        (&negative, "shot 4 ("),
        (&negative, "cue_vx_after_sd is -0.004; expected more than 0"),
        (&|d| d.shots[6].after[1].measured.value = f64::NAN, "cue_vy_after is NaN; expected a finite number"),
        (&short, "expected a unit vector"),
        (&|d| d.shots[2].after.clear(), "no observation"),
        (
            &|d| d.shots[3].name = d.shots[0].name.clone(),
            "2 shots are named \"1\"; expected names that differ",
        ),
        (&|d| d.by = Some("cloht".to_owned()), "by is \"cloht\", but no shot has such a label"),
    ];
    for (spoil, expected) in cases {
        let mut bad = good();
        spoil(&mut bad);
        let error = fit::fit(&bad, &options::of_fit()).unwrap_err();
        assert!(error.is_bad_input() && error.to_string().contains(expected), "{error}; expected {expected}");
        let error = compare::compare(&[good(), bad], &options::of_comparison()).unwrap_err();
        assert!(matches!(error, CompareError::Fit(FitError::Invalid { .. })), "{error}");
        assert!(error.to_string().contains(expected), "{error}; expected {expected}");
    }
}

/// One entry for every kind of data; where the extraction is the caller's, a forgotten one is named by what the caller can call.
#[test]
fn footage_is_prepared_by_whatever_fits_or_compares_it() {
    let tracks = made(&spec("tracks", &["natural-roll"], 8, 1));
    let options = Options { depth: Depth::Estimates, ..options::of_fit() };
    let one = fit::fit(&tracks, &options).unwrap().remove(0);
    assert_eq!(one.method_name(), "joint");
    // again, from impacts that were extracted before
    let extracted = fit::extract(tracks.clone());
    let of_impacts = fit::fit(&extracted, &options).unwrap().remove(0);
    assert_eq!((of_impacts.method_name(), of_impacts.shots_used()), ("direct", one.shots_used()));
    let other = made(&with(&spec("tracks", &["natural-roll"], 8, 2), "name = \"other\""));
    let comparison = compare::compare(&[tracks.clone(), other], &options::of_comparison()).unwrap();
    assert_eq!(part(&comparison, "/method"), "joint");
    assert_eq!(part(&comparison, "/samples").as_array().unwrap().len(), 2);
}

/// The choices of a fit are looked at as the data are.
#[test]
fn options_that_are_none_are_refused() {
    let refused = |options: Options, expected: &str| {
        let error = fit::fit(&good(), &options).unwrap_err();
        assert!(matches!(error, FitError::Options(_)) && error.is_bad_input(), "{error}");
        assert!(error.to_string().contains(expected), "{error}; expected {expected}");
    };
    for tolerance in [f64::NAN, 0.0, 0.1] {
        refused(Options { tolerance, ..Options::default() }, "expected 1e-12 to 1e-2");
    }
    let falling = Falling::Held { b: f64::NAN, c: 1.0 };
    refused(
        Options { falling, ..Options::default() },
        "mu_b of a friction that decreases is NaN; expected 0 or more",
    );
}

/// A film that a program made is looked at as one that was read.
#[test]
fn films_from_vectors_that_are_none_are_refused() {
    let film = |spoil: fn(&mut TrackShot)| {
        let rolls = |x: f64| (0..40).map(|i| Sample::new(f64::from(i) * 1e-3, [x, 0.0])).collect();
        let mut shot = TrackShot::new("a", 1000.0, "natural-roll".parse().unwrap(), [rolls(0.0), rolls(0.1)]);
        spoil(&mut shot);
        Dataset::filmed("film", Ball::POOL, vec![shot])
    };
    assert_eq!(film(|_| ()).faults(), Vec::<String>::new());
    let refused = |spoil, expected: &str| {
        let error = fit::fit(&film(spoil), &Options::default()).unwrap_err();
        assert!(error.is_bad_input() && error.to_string().contains(expected), "{error}; expected {expected}");
    };
    refused(|shot| shot.fps = 0.0, "shot a: fps is 0; expected more than 0");
    refused(|shot| shot.cue[3].x = f64::NAN, "cue has the position t = 0.003, x = NaN");
    refused(|shot| shot.object[5].sd = Some([0.0, 1.0]), "standard deviations above 0");
    refused(
        |shot| shot.object.swap(7, 8),
        "object is at t = 0.007 after t = 0.008; expected times that rise",
    );
    refused(|shot| shot.correlation = 1.0, "correlation is 1; expected 0 to below 1");
}

/// What has a name is found by it, and by no other.
#[test]
fn names_are_read_back() {
    fn all<T: FromStr<Err = UnknownName> + Copy + PartialEq + Debug>(all: &[T], name: fn(T) -> &'static str) {
        for one in all {
            assert_eq!(name(*one).parse::<T>().unwrap(), *one);
        }
        assert!("nothing".parse::<T>().unwrap_err().to_string().contains("\"nothing\" is no "));
    }
    all(&Fidelity::ALL, Fidelity::name);
    all(&Loss::ALL, Loss::name);
    all(&Spin::WORDS, Spin::name);
    all(&Status::ALL, Status::name);
    all(&Grade::ALL, Grade::name);
    all(&Observable::ANGLES, Observable::column);
    all(&Observable::IMPACTS, Observable::column);
    all(&Observable::DISCS, Observable::column);
    let error = "fulll".parse::<Fidelity>().unwrap_err().to_string();
    assert!(error.ends_with("expected one of elastic, inelastic, linear, full, ode, contact"), "{error}");
    // as they stand in a specification
    for played in ["stun", "natural-roll", "almost-roll", "draw", "side", "slight-side", "any"] {
        let text = toml::to_string(&spec("tracks", &[played], 1, 1)).unwrap();
        assert!(text.contains(&format!("[\"{played}\"]")) && text.contains("\"tracks\""), "{text}");
        assert_eq!(toml::to_string(&text.parse::<Spec>().unwrap()).unwrap(), text);
    }
    let film = "
        name = 'film'
        kind = 'tracks'
        seed = 1
        truth = { mu = 0.05, mu_s = 0.3, e = 0.94 }
        shots = { count = 1, speed_m_s = [1, 2], cut_deg = [0, 30], cue_spin = ['natural-roll'] }
        ";
    for (sections, expected) in [
        ("ball = { radius_m = 0 }", "SPEC.toml:7: column 29: ball.radius_m is 0; expected more than 0"),
        ("camera = { after_ms = 1e9 }", "camera.after_ms is 1000000000, which is 1000000000 frames"),
        ("camera = { markers = 101 }", "camera.markers is 101; expected at least 0, at most 100"),
        ("cloth = { mu_k = nan }", "cloth.mu_k is nan; expected at least 0"),
    ] {
        let error = (film.to_owned() + sections).parse::<Spec>().unwrap_err().to_string();
        assert!(error.contains(expected), "{error}\nlacks {expected}");
    }
    let error = "name = 3".parse::<Spec>().unwrap_err().to_string();
    assert!(error.contains("the specification cannot be used") && error.contains("SPEC.toml:1"), "{error}");
}
