//! Synthetic data sets from known parameters and noise: what a fit must recover.

mod check;
mod spec;
mod tracks;

use std::fmt::Write as _;
use std::path::Path;

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use statrs::distribution::{ContinuousCDF, Normal};

use crate::io::{DatasetError, balls_section, toml_file};
use crate::measurement::dataset::{Before, Dataset, Measured, Measurement, ObjectBall, Shot};
use crate::measurement::observable::Observable;
use crate::measurement::spin::Spin;
use crate::measurement::track::TrackShot;
use crate::measurement::valid::Fault;
use crate::physics::ball::{Ball, BallState, Vec3};
use crate::physics::collision::{Coefficients, Model, NotACollision};
use crate::physics::contact_frame::{CollisionFrame, cue_velocity};
use crate::problem::{Unpredictable, predict};

pub use crate::io::Kind;
pub(crate) use check::{MOST_FRAMES, MOST_SHOTS, faults_of_ranges};
pub use spec::{BallSpec, Noise, Played, Shots, Spec, Truth};
pub use tracks::{Camera, ClothSpec, TrueImpact, noise_free};

/// Standard deviations in a file are positive: this part stands for 0.
const NOT_ZERO: f64 = 1e-6;

/// Why a specification cannot be followed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum BadSpec {
    /// A value of the specification is out of its range.
    #[error(transparent)]
    Value(#[from] Fault),
    /// One of its shots is no collision.
    #[error("a shot of this specification is no collision: {0}")]
    NotACollision(#[from] NotACollision),
    /// One of its shots cannot be predicted.
    #[error("a shot of this specification cannot be predicted: {0}")]
    Unpredictable(#[from] Unpredictable),
}

/// Reads a SPEC.toml.
///
/// # Errors
/// What is wrong with it, with line and position.
pub fn read(path: &Path) -> Result<Spec, DatasetError> {
    toml_file::read_checked(path, checked)
}

/// Adds what is wrong with a specification, each with its place.
fn checked(spec: Spec, source: &toml_file::Source) -> Spec {
    spec.faults().iter().for_each(|fault| source.add(fault));
    spec
}

/// Makes the files of a synthetic data set with the `full` collision model, or `ode` where the contact gives way or its friction falls
/// with the slip: name and content of `dataset.toml`, of the tables that it names, and of `truth.json`.
///
/// # Errors
/// A value out of its range, named with what was expected.
pub fn generate(spec: &Spec) -> Result<Vec<(&'static str, String)>, BadSpec> {
    generate_with(spec, &spec.usual_model())
}

/// As [`generate`] with another collision model, whose balls are replaced by those that the specification states, and what the specification
/// states of their contact with it.
///
/// # Errors
/// As [`generate`]; or the model's contact is rigid along its surface, and the specification's is not.
pub fn generate_with(spec: &Spec, model: &Model) -> Result<Vec<(&'static str, String)>, BadSpec> {
    spec.check()?;
    let kappa = spec.truth.kappa.filter(|kappa| *kappa != 0.0);
    if let Some(kappa) = kappa.filter(|_| !model.fidelity.effects().compliance) {
        let value = format!("{kappa}, with the fidelity {}", model.fidelity.name());
        let expected =
            "the fidelity ode or contact with it, or none (ode), as all others are rigid along the surface";
        return Err(Fault::new("truth.kappa", value, expected).into());
    }
    let mut maker = Maker::new(spec, model);
    let mut files = match spec.kind {
        Kind::Impacts => vec![("shots.csv", maker.impacts()?)],
        Kind::Angles => vec![("shots.csv", maker.angles()?)],
        Kind::Tracks => {
            let shots = maker.tracks()?;
            let mut files = vec![("tracks.csv", tracks::long_csv(&shots))];
            if spec.assumed().is_none() {
                files.push(("shots.csv", tracks::shots_csv(&shots)));
            }
            files
        }
    };
    let truths = spec.truths().into_iter().map(|(p, value)| (p.name().to_owned(), value.into()));
    let mut truth: serde_json::Map<String, serde_json::Value> = truths.collect();
    truth.insert("seed".to_owned(), spec.seed.into());
    let truth = serde_json::Value::Object(truth);
    files.insert(0, ("dataset.toml", manifest_text(spec)));
    files.push(("truth.json", format!("{truth:#}\n")));
    Ok(files)
}

/// The data set of a specification, as if it had been written to files and loaded.
///
/// # Errors
/// As [`generate`]; and where the files, which go through the folder of temporary files, cannot be written or read.
pub fn dataset(spec: &Spec) -> Result<Dataset, SynthError> {
    let folder = tempfile::tempdir()?;
    for (name, text) in generate(spec)? {
        std::fs::write(folder.path().join(name), text)?;
    }
    Ok(crate::io::load(folder.path())?)
}

/// Why a synthetic data set cannot be made.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SynthError {
    /// The specification cannot be followed.
    #[error(transparent)]
    Spec(#[from] BadSpec),
    /// The files cannot be written.
    #[error("the folder of temporary files cannot be written: {0}")]
    Write(#[from] std::io::Error),
    /// The files cannot be read back.
    #[error(transparent)]
    Load(#[from] DatasetError),
}

/// The shots of a specification of kind `tracks` as a camera sees them, and what they really were.
///
/// # Errors
/// As [`generate`].
pub fn filmed(spec: &Spec) -> Result<Vec<(TrackShot, TrueImpact)>, BadSpec> {
    spec.check()?;
    Maker::new(spec, &spec.usual_model()).tracks()
}

/// `dataset.toml` of the made data.
fn manifest_text(spec: &Spec) -> String {
    let (cue, object) = stated_balls(spec);
    let kind = spec.kind.name();
    let files = if spec.kind == Kind::Tracks { "tracks.csv" } else { "shots.csv" };
    let name = toml::Value::from(spec.name.as_str());
    let assume = match spec.assumed() {
        Some(Played::Stun) => "stun",
        Some(_) => "natural-roll",
        None => "measured",
    };
    let truths: Vec<String> =
        spec.truths().iter().map(|(parameter, value)| format!("{} = {value}", parameter.name())).collect();
    format!(
        "# Synthetic: {}, seed {}.\nname = {name}\nkind = \"{kind}\"\nfiles = [\"{files}\"]\n\
         source = \"synthetic, caromfit {}\"\n\n{}\n[cue_spin]\nassume = \"{assume}\"\n",
        truths.join(", "),
        spec.seed,
        env!("CARGO_PKG_VERSION"),
        balls_section::text(&cue, object.as_ref(), None),
    ) + &video_text(spec)
}

/// Both balls as whoever weighs and measures them finds them: off by the errors of the scale and of the calliper, where these count.
fn stated_balls(spec: &Spec) -> (Ball, Option<ObjectBall>) {
    let (mut cue, mut object) = spec.balls();
    // apart from the shots, which do not depend on it
    let mut rng = ChaCha8Rng::seed_from_u64(spec.seed);
    rng.set_stream(1);
    let normal = Normal::standard();
    let mut off = |sd: f64| sd * normal.inverse_cdf(rng.random_range(f64::EPSILON..1.0));
    if let Some(ObjectBall { ball, mass_sd, radius_sd }) = &mut object {
        let mass_sd = mass_sd.unwrap_or_default();
        cue.mass += off(mass_sd[0]);
        ball.mass += off(mass_sd[1]);
        cue.radius += off(radius_sd[0]);
        ball.radius += off(radius_sd[1]);
    }
    (cue, object)
}

/// What dataset.toml says of the footage, for kind `tracks`.
fn video_text(spec: &Spec) -> String {
    if spec.kind != Kind::Tracks {
        return String::new();
    }
    let table = if spec.assumed().is_none() { "shots = \"shots.csv\"\n" } else { "" };
    format!(
        "\n[video]\ncapture_fps = {:?}\n\n[scale]\nlength_unit = \"m\"\n\n[tracks]\ncue = \"cue\"\nobject = \"object\"\n{table}",
        spec.camera.fps
    )
}

impl Spec {
    /// The one spin that every shot plays, where the data need no spin columns.
    fn assumed(&self) -> Option<Played> {
        let first = *self.shots.cue_spin.first()?;
        // markers show it
        let known = self.camera.markers == 0 && matches!(first, Played::Stun | Played::NaturalRoll);
        (known && self.shots.cue_spin.iter().all(|played| *played == first)).then_some(first)
    }
}

struct Maker<'a> {
    spec: &'a Spec,
    rng: ChaCha8Rng,
    normal: Normal,
    model: Model,
    coefficients: Coefficients,
}

impl<'a> Maker<'a> {
    fn new(spec: &'a Spec, model: &Model) -> Self {
        Self {
            spec,
            rng: ChaCha8Rng::seed_from_u64(spec.seed),
            normal: Normal::standard(),
            model: spec.with_truth(model),
            coefficients: spec.coefficients(),
        }
    }

    /// A draw from a normal distribution; `sd` = 0 uses up a random number all the same, so that
    /// the shots do not depend on the noise.
    fn noise(&mut self, sd: f64) -> f64 {
        let uniform = self.rng.random_range(f64::EPSILON..1.0);
        sd * self.normal.inverse_cdf(uniform)
    }

    fn between(&mut self, [from, to]: [f64; 2]) -> f64 {
        from + (to - from) * self.rng.random::<f64>()
    }

    /// Speed, cut angle (rad), and the cue ball in the collision frame.
    fn shot(&mut self, number: usize) -> (f64, f64, BallState) {
        let spec = self.spec;
        let speed = self.between(spec.shots.speed_m_s);
        let cut = self.between(spec.shots.cut_deg).to_radians();
        let share = self.rng.random::<f64>();
        let velocity = cue_velocity(speed, cut);
        let rolling = BallState::natural_roll(velocity, self.model.ball.radius);
        let spin = match spec.shots.cue_spin[number % spec.shots.cue_spin.len()] {
            Played::Stun => Vec3::zeros(),
            Played::NaturalRoll => rolling.spin,
            Played::AlmostRoll => 0.9 * rolling.spin,
            Played::Draw => -(0.3 + 0.7 * share) * rolling.spin,
            Played::Any => (2.0 * share - 1.0) * rolling.spin,
            Played::Side => Vec3::z() * ((2.0 * share - 1.0) * rolling.spin.norm()),
            Played::SlightSide => {
                rolling.spin + Vec3::z() * (0.1 * (2.0 * share - 1.0) * rolling.spin.norm())
            }
        };
        (speed, cut, BallState { velocity, spin })
    }

    fn impacts(&mut self) -> Result<String, BadSpec> {
        let noise = self.spec.noise;
        let spins_shown = self.spec.assumed().is_none();
        let line_sd = noise.line_of_centres_deg.to_radians();
        let mut table = String::new();
        for number in 0..self.spec.shots.count {
            let (_, _, cue) = self.shot(number);
            let direction = self.between([-std::f64::consts::PI, std::f64::consts::PI]);
            let line = self.noise(line_sd);
            let before = [0; 2].map(|_| self.noise(noise.velocity_m_s));
            let spin = [0; 3].map(|_| self.noise(noise.spin_rad_s));
            let after = [0; 4].map(|_| self.noise(noise.velocity_m_s));
            let outcome = self.model.collide(&cue, &self.coefficients)?;
            let frame = CollisionFrame::from_direction(direction);
            let seen = direction + line;
            // n = (cos α, sin α): dn = (−sin α, cos α) dα; nearly 0 where a component is exact
            let turned = |across: f64| line_sd * across.abs().max(NOT_ZERO);
            let (sin, cos) = (seen.sin(), seen.cos());
            // columns: name, value, standard deviation
            let mut columns = vec![("nx", cos, turned(sin)), ("ny", sin, turned(cos))];
            let mut add = |names: &[&'static str], exact: &[f64], noise: &[f64], sd: f64| {
                let values = exact.iter().zip(noise).map(|(exact, noise)| exact + noise);
                columns.extend(names.iter().zip(values).map(|(name, value)| (*name, value, sd)));
            };
            let velocity = frame.to_table(cue.velocity);
            add(&["cue_vx", "cue_vy"], &velocity.as_slice()[..2], &before, noise.velocity_m_s);
            if spins_shown {
                let exact = frame.to_table(cue.spin);
                add(&["cue_wx", "cue_wy", "cue_wz"], exact.as_slice(), &spin, noise.spin_rad_s);
            }
            let [cue, object] = [outcome.cue, outcome.object].map(|ball| frame.to_table(ball.velocity));
            let names = ["cue_vx_after", "cue_vy_after", "obj_vx_after", "obj_vy_after"];
            add(&names, &[cue.x, cue.y, object.x, object.y], &after, noise.velocity_m_s);
            // a column of standard deviations for every noisy column
            let noisy = || columns.iter().filter(|(.., sd)| *sd > 0.0);
            if number == 0 {
                let names = columns.iter().map(|(name, ..)| format!(",{name}"));
                let sds = noisy().map(|(name, ..)| format!(",{name}_sd"));
                _ = writeln!(table, "shot{}", names.chain(sds).collect::<String>());
            }
            let numbers = columns.iter().map(|(_, value, _)| value).chain(noisy().map(|(.., sd)| sd));
            let numbers = numbers.map(|number| format!(",{number}"));
            _ = writeln!(table, "{}{}", number + 1, numbers.collect::<String>());
        }
        Ok(table)
    }

    fn angles(&mut self) -> Result<String, BadSpec> {
        let noise = self.spec.noise;
        let asked = [Observable::Throw, Observable::CueTurn, Observable::ObjectSpeed, Observable::CueSpeed];
        let sd = |o: Observable| if o.is_angle() { noise.angle_deg } else { noise.velocity_m_s };
        let spins = self.spec.assumed().is_none();
        let mut columns = vec!["shot", "speed_m_s", "cut_deg"];
        if spins {
            columns.extend(["omega_x", "omega_y", "omega_z"]);
        }
        let mut table = columns.join(",");
        for observable in asked {
            _ = write!(table, ",{}", observable.column());
            if sd(observable) > 0.0 {
                _ = write!(table, ",{}_sd", observable.column());
            }
        }
        table.push('\n');
        let exact = |value| Measured { value, sd: None };
        for number in 0..self.spec.shots.count {
            let (speed, cut, cue) = self.shot(number);
            let before = Before::Angle { cut: exact(cut), speed: Some(exact(speed)) };
            let spin = Spin::Measured { spin: cue.spin, sd: [None; 3] };
            let after = asked.map(|observable| Measurement { observable, measured: exact(0.0) });
            let shot = Shot::new("", before, spin, after.to_vec());
            let prediction = predict(&shot, &self.model, &self.coefficients)?;
            _ = write!(table, "{},{speed},{}", number + 1, cut.to_degrees());
            if spins {
                _ = write!(table, ",{},{},{}", cue.spin.x, cue.spin.y, cue.spin.z);
            }
            for (row, observable) in asked.into_iter().enumerate() {
                let value = prediction.values[row] / observable.unit_si() + self.noise(sd(observable));
                _ = write!(table, ",{value}");
                if sd(observable) > 0.0 {
                    _ = write!(table, ",{}", sd(observable));
                }
            }
            table.push('\n');
        }
        Ok(table)
    }
}
