//! The data sets that ship, against independent calculations.

use caromfit::report::stored::Stored;

use crate::prelude::*;

/// All data sets that are fitted by the main job.
const SHIPPED: [&str; 12] = [
    "alciatore-2006",
    "alciatore-2014-speed",
    "alciatore-2014-treatments",
    "alciatore-one-law",
    "domenech-2023",
    "mathavan-2014",
    "pucks-chalmers-2023",
    "pucks-opencv",
    "pucks-qualisys",
    "synthetic-cloth-a",
    "synthetic-cloth-b",
    "synthetic-natural-roll",
];

/// The folder of the repository.
pub fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn folder(name: &str) -> PathBuf {
    root().join("data").join(name)
}

/// A data set that ships.
pub fn shipped(name: &str) -> Dataset {
    io::load(&folder(name)).unwrap()
}

/// Asserts that the fits of a data set are those that are stored, to a hundredth of an error; how many they are.
fn are_the_stored(name: &str, dataset: &Dataset, options: &Options) -> usize {
    let stored = Stored::read(&root().join("fits")).unwrap();
    let fits = fit::fit(dataset, options).unwrap();
    for fit in &fits {
        let moved = stored.moved(fit).unwrap();
        assert!(moved.is_empty(), "{name} {:?}: {moved:?}", fit.label());
    }
    fits.len()
}

/// These throws need the defaults of the program to be fitted at all.
#[test]
fn the_defaults_of_the_library_are_those_of_the_program() {
    for name in ["alciatore-2006", "pucks-chalmers-2023"] {
        are_the_stored(name, &shipped(name), &Options::default());
    }
}

fn estimate(fit: &Fit, parameter: Parameter) -> Estimate {
    fit.estimates()[parameter as usize]
}

fn rms_deg(fit: &Fit, observable: Observable) -> f64 {
    let noise = part(fit, "/noise");
    let is_of = |noise: &&Value| noise["observable"] == observable.column();
    noise.as_array().unwrap().iter().find(is_of).unwrap()["rms"].as_f64().unwrap()
}

#[test]
fn every_shipped_data_set_loads_whole_under_the_name_of_its_folder() {
    const SHOTS: [(&str, usize); 5] = [
        ("alciatore-2006", 39),
        ("alciatore-2014-speed", 5),
        ("alciatore-2014-treatments", 19),
        ("domenech-2023", 99),
        ("mathavan-2014", 5),
    ];
    let data = fs::read_dir(Path::new(env!("CARGO_MANIFEST_DIR")).join("data")).unwrap();
    let names = data.map(|entry| entry.unwrap().file_name().into_string().unwrap());
    let names: Vec<String> = names.filter(|name| folder(name).join("dataset.toml").is_file()).collect();
    assert!(names.len() > 10, "{names:?}");
    for name in names {
        let dataset = shipped(&name);
        assert_eq!(dataset.name, name);
        let expected = SHOTS.iter().find(|(known, _)| *known == name);
        assert!(expected.is_none_or(|(_, count)| dataset.shots.len() == *count), "{name}");
    }
}

/// Half of the last digit that the independent calculation gives.
fn agrees(value: f64, expected: f64, half_digit: f64) {
    assert!((value - expected).abs() <= half_digit, "{value}, expected {expected}");
}

#[test]
fn domenech_without_cloth() {
    let fit = &fit::fit(&shipped("domenech-2023"), &options::of_fit()).unwrap()[0];
    let (mu, e) = (estimate(fit, Parameter::Mu), estimate(fit, Parameter::E));
    agrees(mu.value, 0.1014, 5e-5);
    agrees(mu.std_error.unwrap(), 0.0027, 5e-5);
    agrees(e.value, 0.968, 5e-4);
    // 0.0033, and 205 g ± 0.5 g of each ball: 0.0034 of the ratio of the masses, whose half, times 1 + e, is of e
    agrees(e.std_error.unwrap(), 0.0033_f64.hypot(0.5 * 1.968 * 0.00345), 5e-5);
    agrees(rms_deg(fit, Observable::Throw), 0.69, 5e-3);
    agrees(rms_deg(fit, Observable::CueTurn), 1.70, 5e-3);
}

#[test]
fn alciatore_throw_falls_with_speed() {
    let fits = fit::fit(&shipped("alciatore-2006"), &options::of_fit()).unwrap();
    for (fit, (label, mu)) in fits.iter().zip([("slow", 0.095), ("medium", 0.070), ("fast", 0.049)]) {
        assert_eq!(fit.label(), Some(label));
        agrees(estimate(fit, Parameter::Mu).value, mu, 5e-4);
        assert_eq!(estimate(fit, Parameter::MuS).status, Status::NotIdentified);
        assert_eq!(estimate(fit, Parameter::E).status, Status::Fixed);
    }
}

/// One law for all throws with a speed: below 0.5 m/s that which Alciatore printed (0.010, 0.108, 1.088 s/m), above 1 m/s 0.02 more.
#[test]
fn alciatore_s_throws_by_one_law() {
    /// Of μ: a tenth at small slips; the law's own error at large ones.
    const NEAR: f64 = 0.1;
    const ERROR: f64 = 0.008;
    let fit = &fit::fit(&shipped("alciatore-one-law"), &Options { fidelity: None, ..options::of_fit() })
        .unwrap()[0];
    assert_eq!(fit.shots_used(), 44);
    let [a, b, c] = [Parameter::Mu, Parameter::B, Parameter::C].map(|p| fit.get(p).unwrap().value);
    let law = |slip: f64| a + b * (-c * slip).exp();
    let printed = |slip: f64| 0.010 + 0.108 * (-1.088 * slip).exp();
    for slip in [0.1, 0.3, 0.5] {
        assert!(
            (law(slip) / printed(slip) - 1.0).abs() < 1.2 * NEAR,
            "{slip}: {} {}",
            law(slip),
            printed(slip)
        );
    }
    for slip in [1.0, 2.0, 3.0] {
        assert!((law(slip) - printed(slip) - 0.02).abs() < ERROR, "{slip}: {} {}", law(slip), printed(slip));
    }
    assert!((rms_deg(fit, Observable::Throw) - 0.48).abs() < 0.01);
}

#[test]
fn throws_beyond_sticking_are_said_to_be_so() {
    let mut dataset = shipped("alciatore-2014-treatments");
    dataset.settings.compliance = Compliance::Rigid;
    for shot in &mut dataset.shots {
        let Before::Angle { cut, .. } = &mut shot.before else { panic!("{:?}", shot.before) };
        cut.sd = Some(1e-9);
    }
    let fits = fit::fit(&dataset, &options::of_fit()).unwrap();
    let fit = fits.iter().find(|fit| fit.label() == Some("new")).unwrap();
    let mu = estimate(fit, Parameter::Mu);
    // a stun shot sticks from tan φ = μβ_y(1 + e) on
    let sticks = 30_f64.to_radians().tan() / (3.5 * 1.94);
    agrees(mu.value, sticks, 1e-9);
    assert!(
        mu.std_error.is_none() && fit.warnings()[0].contains("the balls stick together where they touch"),
        "{:?}",
        fit.warnings()
    );
}

/// Changes a number by so many of its roundings as another processor's cosine may.
fn jogged(value: &mut f64, random: &mut ChaCha8Rng) {
    *value *= 1.0 + f64::from(random.random_range(-2..=2)) * f64::EPSILON;
}

/// What is stored is what this version gives, whatever the last digits that the computer rounds: within the tolerance of `--baseline`.
#[test]
fn the_shipped_results_are_those_of_this_version_on_any_computer() {
    let mut random = ChaCha8Rng::seed_from_u64(19);
    // as "caromfit fit" does
    let options = Options { fidelity: None, ..options::of_fit() };
    let mut compared = 0;
    for name in SHIPPED {
        let mut dataset = shipped(name);
        for shot in &mut dataset.shots {
            shot.after.iter_mut().for_each(|m| jogged(&mut m.measured.value, &mut random));
        }
        for shot in dataset.tracks.iter_mut().flat_map(|tracks| &mut tracks.shots) {
            for sample in shot.cue.iter_mut().chain(&mut shot.object) {
                jogged(&mut sample.x, &mut random);
                jogged(&mut sample.y, &mut random);
            }
        }
        compared += are_the_stored(name, &dataset, &options);
    }
    assert_eq!(compared, 29);
}

#[test]
fn synthetic_tracks_are_made_again_by_their_spec() {
    let spec = simulate::read(&folder("synthetic-natural-roll").join("spec.toml")).unwrap();
    for (name, content) in simulate::generate(&spec).unwrap() {
        let shipped = fs::read_to_string(folder("synthetic-natural-roll").join(name)).unwrap();
        // another machine's sine may round the last digit otherwise
        let cells = |text: &str| text.split([',', '\n']).map(str::to_string).collect::<Vec<_>>();
        for (i, (own, made)) in cells(&shipped).iter().zip(cells(&content)).enumerate() {
            let near = || Some((own.parse::<f64>().ok()? - made.parse::<f64>().ok()?).abs() < 2e-7);
            assert!(*own == made || near() == Some(true), "{name}: cell {i} is {own}, not {made}");
        }
    }
}
