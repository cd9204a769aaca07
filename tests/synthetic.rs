//! Synthetic data sets for other tests.

use crate::prelude::*;

/// μ, μ_s and e of the specifications.
pub const TRUTH: [f64; 3] = [0.05, 0.3, 0.94];

/// Standard errors by which an estimate may be off: one in 2000 is by chance.
pub const ERRORS: f64 = 3.5;

/// Noise of footage of 250 fps, of 1000 fps, and none.
const USUAL: &str =
    "noise = { velocity_m_s = 0.004, line_of_centres_deg = 0.05, spin_rad_s = 0.5, angle_deg = 0.2 }";
pub const FINE: &str =
    "noise = { velocity_m_s = 0.001, line_of_centres_deg = 0.02, spin_rad_s = 0.1, angle_deg = 0.2 }";
pub const EXACT: &str =
    "noise = { velocity_m_s = 0, line_of_centres_deg = 0, spin_rad_s = 0, angle_deg = 0 }";

/// Usual shots with usual values and, unless they are tracks, the noise of footage of 250 fps.
pub fn spec(kind: &str, cue_spin: &[&str], count: usize, seed: u64) -> Spec {
    let noise = if kind == "tracks" { "" } else { USUAL };
    let text = format!(
        "name = \"synthetic\"\nkind = \"{kind}\"\nseed = {seed}\ntruth = {{ mu = 0.05, mu_s = 0.3, e = 0.94 }}\n{noise}\n\
         shots = {{ count = {count}, speed_m_s = [1, 4], cut_deg = [-50, 50], cue_spin = {cue_spin:?} }}"
    );
    text.parse().unwrap()
}

/// A specification with some keys of its own.
pub fn with(spec: &Spec, keys: &str) -> Spec {
    fn replace(keys: toml::Table, of: &mut toml::Table) {
        for (key, value) in keys {
            match (value, of.get_mut(&key)) {
                (toml::Value::Table(keys), Some(toml::Value::Table(of))) => replace(keys, of),
                (value, _) => _ = of.insert(key, value),
            }
        }
    }
    let mut all = toml::Table::try_from(spec).unwrap();
    replace(keys.parse().unwrap(), &mut all);
    all.to_string().parse().unwrap()
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
    write(spec, model, folder.path());
    io::load(folder.path()).unwrap()
}

/// Writes the files of a specification with the collisions of a model into a folder, which is made.
pub fn write(spec: &Spec, model: &Model, folder: &Path) {
    fs::create_dir_all(folder).unwrap();
    for (name, content) in simulate::generate_with(spec, model).unwrap() {
        fs::write(folder.join(name), content).unwrap();
    }
}

/// The fit of a data set with the fidelity that its data call for.
pub fn auto(dataset: &Dataset) -> Fit {
    options::fitted_with(dataset, &Options { fidelity: None, ..options::of_fit() })
}

/// Asserts that a parameter was found within its error.
pub fn is_right(fit: &Fit, parameter: Parameter, truth: f64) {
    let found = fit.get(parameter).unwrap();
    let error = found.std_error.unwrap_or_else(|| panic!("{parameter:?} has no error: {:?}", found.status));
    assert!((found.value - truth).abs() < ERRORS * error, "{parameter:?}: {} ± {error}", found.value);
}
