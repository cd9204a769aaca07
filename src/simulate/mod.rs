//! Synthetic data sets from known parameters and noise: what a fit must recover.

mod scene;
mod spec;
mod tracks;

use std::f64::consts::PI;
use std::path::Path;

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use statrs::distribution::{ContinuousCDF, Normal};

use crate::io::{DatasetError, balls, toml_file};
use crate::measurement::dataset::{Before, Dataset, Measured, Measurement, ObjectBall, Shot};
use crate::measurement::fault::Fault;
use crate::measurement::observable::Observable;
use crate::measurement::spin::Spin;
use crate::measurement::track::TrackShot;
use crate::physics::ball::{Ball, BallState};
use crate::physics::collision::{Coefficients, Model, NotACollision};
use crate::physics::contact_frame::CollisionFrame;
use crate::problem::{Unpredictable, predict};

pub use crate::io::Kind;
pub(crate) use scene::{Camera, Played};
pub(crate) use scene::{MAX_SHOTS, between, cue_ball, faults_of_shots};
pub(crate) use spec::Shots;
pub use spec::Spec;
pub use tracks::TrueImpact;

/// Why a synthetic data set cannot be made.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SynthError {
    /// A value of the specification is out of its range.
    #[error(transparent)]
    Value(#[from] Fault),
    /// One of its shots is not a collision.
    #[error("a shot of this specification is not a collision: {0}")]
    NotACollision(#[from] NotACollision),
    /// One of its shots cannot be predicted.
    #[error("a shot of this specification cannot be predicted: {0}")]
    Unpredictable(#[from] Unpredictable),
    /// It has more positions than a table can hold.
    #[error(transparent)]
    Table(#[from] polars::error::PolarsError),
    /// The files cannot be written.
    #[error("the folder of temporary files cannot be written: {0}")]
    Write(#[from] std::io::Error),
    /// The files cannot be read back.
    #[error(transparent)]
    Load(#[from] DatasetError),
}

/// Reads a SPEC.toml.
///
/// # Errors
/// Every problem of the file, with line and position.
pub fn read(path: &Path) -> Result<Spec, DatasetError> {
    toml_file::checked(path, None, format!("{} cannot be used:", path.display()), Spec::checked)
}

/// Makes the files of a synthetic data set with the `full` collision model, or `ode` if the contact
/// is compliant: name and content of `dataset.toml`, its tables and `truth.json`.
///
/// # Errors
/// A value out of its range, named with what was expected.
pub fn generate(spec: &Spec) -> Result<Vec<(&'static str, String)>, SynthError> {
    generate_with(spec, &spec.usual_model())
}

/// Makes the files as [`generate`] with another collision model, but its own balls and contact.
///
/// # Errors
/// Those of [`generate`]; or only the model's contact is rigid along its surface.
pub fn generate_with(spec: &Spec, model: &Model) -> Result<Vec<(&'static str, String)>, SynthError> {
    let mut maker = Maker::new(spec, model)?;
    if let Some(kappa) = spec.truth.kappa.filter(|kappa| *kappa != 0.0)
        && !model.fidelity.effects().compliance
    {
        let value = format!("{kappa}, with the fidelity {}", model.fidelity.name());
        let expected =
            "the fidelity ode or contact with it, or none (ode), as all others are rigid along the surface";
        return Err(Fault::new("truth.kappa", value, expected).into());
    }
    let mut files = vec![("dataset.toml", manifest_text(spec))];
    match spec.kind {
        Kind::Impacts => files.push(("shots.csv", maker.impacts()?)),
        Kind::Angles => files.push(("shots.csv", maker.angles()?)),
        Kind::Tracks => {
            let shots = maker.tracks()?;
            files.push(("tracks.csv", tracks::long_csv(&shots)?));
            if spec.assumed().is_none() {
                files.push(("shots.csv", tracks::shots_csv(&shots)));
            }
        }
    }
    let truths = spec.truths().into_iter().map(|(p, value)| (p.name().to_owned(), value.into()));
    let truth = truths.chain([("seed".to_owned(), spec.seed.into())]).collect();
    files.push(("truth.json", format!("{:#}\n", serde_json::Value::Object(truth))));
    Ok(files)
}

/// Returns the data set of a specification, as if it had been written to files and loaded.
///
/// # Errors
/// Those of [`generate`]; or the temporary files cannot be written or read.
pub fn dataset(spec: &Spec) -> Result<Dataset, SynthError> {
    let folder = tempfile::tempdir()?;
    for (name, text) in generate(spec)? {
        std::fs::write(folder.path().join(name), text)?;
    }
    Ok(crate::io::load(folder.path())?)
}

/// Returns the shots of a specification of kind `tracks` as a camera sees them, with the truth.
///
/// # Errors
/// Those of [`generate`].
pub fn filmed(spec: &Spec) -> Result<Vec<(TrackShot, TrueImpact)>, SynthError> {
    Maker::new(spec, &spec.usual_model())?.tracks()
}

/// Returns `dataset.toml` of the made data.
fn manifest_text(spec: &Spec) -> String {
    let (cue, object) = stated_balls(spec);
    let is_filmed = spec.kind == Kind::Tracks;
    let assumed = spec.assumed();
    let truths =
        spec.truths().into_iter().map(|(parameter, value)| format!("{} = {value}", parameter.name()));
    let mut text = format!(
        "# Synthetic: {}, seed {}.\nname = {}\nkind = \"{}\"\nfiles = [\"{}\"]\n\
         source = \"synthetic, caromfit {}\"\n\n{}\n[cue_spin]\nassume = \"{}\"\n",
        truths.collect::<Vec<_>>().join(", "),
        spec.seed,
        toml::Value::from(spec.name.as_str()),
        spec.kind.name(),
        if is_filmed { "tracks.csv" } else { "shots.csv" },
        env!("CARGO_PKG_VERSION"),
        balls::text(&cue, object.as_ref(), None),
        assumed.map_or("measured", Played::name),
    );
    if is_filmed {
        text += &format!(
            "\n[video]\ncapture_fps = {:?}\n\n[scale]\nlength_unit = \"m\"\n\n[tracks]\ncue = \"cue\"\nobject = \"object\"\n",
            spec.camera.fps
        );
        if assumed.is_none() {
            text += "shots = \"shots.csv\"\n";
        }
    }
    text
}

/// Returns both balls as they are weighed and measured, with errors.
fn stated_balls(spec: &Spec) -> (Ball, Option<ObjectBall>) {
    let (mut cue, mut object) = spec.balls();
    // a stream of its own, so that the shots do not depend on it
    let mut rng = ChaCha8Rng::seed_from_u64(spec.seed);
    rng.set_stream(1);
    if let Some(ObjectBall { ball, mass_sd, radius_sd }) = &mut object {
        let mass_sd = mass_sd.unwrap_or_default();
        cue.mass += mass_sd[0] * standard_normal(&mut rng);
        ball.mass += mass_sd[1] * standard_normal(&mut rng);
        cue.radius += radius_sd[0] * standard_normal(&mut rng);
        ball.radius += radius_sd[1] * standard_normal(&mut rng);
    }
    (cue, object)
}

fn standard_normal(rng: &mut ChaCha8Rng) -> f64 {
    Normal::standard().inverse_cdf(rng.random_range(f64::EPSILON..1.0))
}

/// Adds a row for a shot to a table, before the first one the names of its columns.
fn add_row(table: &mut String, number: usize, cells: &[(String, f64)]) {
    if number == 0 {
        let names = cells.iter().map(|(name, _)| format!(",{name}"));
        *table += &format!("shot{}\n", names.collect::<String>());
    }
    let values = cells.iter().map(|(_, value)| format!(",{value}"));
    *table += &format!("{}{}\n", number + 1, values.collect::<String>());
}

/// A shot before it is measured, in the collision frame.
struct PlayedShot {
    speed: f64,
    cut: f64,
    cue: BallState,
}

struct Maker<'a> {
    spec: &'a Spec,
    rng: ChaCha8Rng,
    model: Model,
    coefficients: Coefficients,
}

impl<'a> Maker<'a> {
    /// Returns a maker of the shots of a specification, or its first fault.
    fn new(spec: &'a Spec, model: &Model) -> Result<Self, Fault> {
        let rng = ChaCha8Rng::seed_from_u64(spec.seed);
        let maker = Self { spec, rng, model: spec.with_truth(model), coefficients: spec.coefficients() };
        spec.faults().into_iter().next().map_or(Ok(maker), Err)
    }

    /// Returns a normal draw; `sd` = 0 uses up a random number, too: shots are then the same.
    fn noise(&mut self, sd: f64) -> f64 {
        sd * standard_normal(&mut self.rng)
    }

    fn between(&mut self, range: [f64; 2]) -> f64 {
        between(range, self.rng.random())
    }

    fn shot(&mut self, number: usize) -> PlayedShot {
        let Shots { speed_m_s, cut_deg, ref cue_spin, .. } = self.spec.shots;
        let played = cue_spin[number % cue_spin.len()];
        let speed = self.between(speed_m_s);
        let cut = self.between(cut_deg).to_radians();
        let share = self.rng.random::<f64>();
        let spins = [between(played.topspin(), share), played.side() * (2.0 * share - 1.0)];
        PlayedShot { speed, cut, cue: cue_ball(speed, cut, spins, self.model.ball.radius) }
    }

    fn impacts(&mut self) -> Result<String, SynthError> {
        let noise = self.spec.noise;
        let line_sd = noise.line_of_centres_deg.to_radians();
        let is_measured = self.spec.assumed().is_none();
        let mut table = String::new();
        for number in 0..self.spec.shots.count {
            let cue = self.shot(number).cue;
            let direction = self.between([-PI, PI]);
            let seen = direction + self.noise(line_sd);
            let outcome = self.model.collide(&cue, &self.coefficients)?;
            let frame = CollisionFrame::from_direction(direction);
            let (mut cells, mut sds) = (Vec::new(), Vec::new());
            let mut add = |name: &str, value: f64, sd: f64| {
                cells.push((name.to_owned(), value));
                sds.extend((sd > 0.0).then(|| (format!("{name}_sd"), sd)));
            };
            // n = (cos α, sin α): dn = (−sin α, cos α) dα; those in a file are positive
            let (sin, cos) = (seen.sin(), seen.cos());
            add("nx", cos, line_sd * sin.abs().max(1e-6));
            add("ny", sin, line_sd * cos.abs().max(1e-6));
            let before = frame.to_table(cue.velocity);
            let spin = frame.to_table(cue.spin);
            let [cue, object] = [outcome.cue, outcome.object].map(|ball| frame.to_table(ball.velocity));
            for (name, exact, sd) in [
                ("cue_vx", before.x, noise.velocity_m_s),
                ("cue_vy", before.y, noise.velocity_m_s),
                ("cue_wx", spin.x, noise.spin_rad_s),
                ("cue_wy", spin.y, noise.spin_rad_s),
                ("cue_wz", spin.z, noise.spin_rad_s),
                ("cue_vx_after", cue.x, noise.velocity_m_s),
                ("cue_vy_after", cue.y, noise.velocity_m_s),
                ("obj_vx_after", object.x, noise.velocity_m_s),
                ("obj_vy_after", object.y, noise.velocity_m_s),
            ] {
                // random numbers do not depend on what is written
                let value = exact + self.noise(sd);
                if is_measured || !name.starts_with("cue_w") {
                    add(name, value, sd);
                }
            }
            cells.extend(sds);
            add_row(&mut table, number, &cells);
        }
        Ok(table)
    }

    fn angles(&mut self) -> Result<String, SynthError> {
        let noise = self.spec.noise;
        let asked = [Observable::Throw, Observable::CueTurn, Observable::ObjectSpeed, Observable::CueSpeed];
        let exact = |value| Measured { value, sd: None };
        let mut table = String::new();
        for number in 0..self.spec.shots.count {
            let PlayedShot { speed, cut, cue } = self.shot(number);
            let before = Before::Angle { cut: exact(cut), speed: Some(exact(speed)) };
            let spin = Spin::Measured { spin: cue.spin, sd: [None; 3] };
            let after = asked.map(|observable| Measurement { observable, measured: exact(0.0) });
            let shot = Shot::new("", before, spin, after.to_vec());
            let prediction = predict(&shot, &self.model, &self.coefficients)?;
            let mut cells = vec![("speed_m_s".to_owned(), speed), ("cut_deg".to_owned(), cut.to_degrees())];
            if self.spec.assumed().is_none() {
                let names = ["omega_x", "omega_y", "omega_z"].map(str::to_owned);
                cells.extend(names.into_iter().zip(cue.spin.iter().copied()));
            }
            for (observable, value) in asked.into_iter().zip(&prediction.values) {
                let sd = if observable.is_angle() { noise.angle_deg } else { noise.velocity_m_s };
                let name = observable.column();
                cells.push((name.to_owned(), value / observable.unit_si() + self.noise(sd)));
                cells.extend((sd > 0.0).then(|| (format!("{name}_sd"), sd)));
            }
            add_row(&mut table, number, &cells);
        }
        Ok(table)
    }
}
