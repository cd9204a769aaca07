//! The design of an experiment: which cut angles, speeds and spins determine μ, μ_s and e, what
//! standard errors a number of shots gives, and how many shots a wanted standard error needs.
//!
//! The Fisher information of N shots is N times that of the average one, to which the priors of a
//! fit are added; its inverse is the Cramér–Rao bound, which fits reach.

pub(crate) mod information;
mod plan;
mod spec;

use indexmap::IndexMap;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use statrs::distribution::{ContinuousCDF, Normal};

use crate::measurement::dataset::ObjectBall;
use crate::measurement::number::plain;
use crate::measurement::parameter::Parameter;
use crate::physics::ball::Ball;
use crate::physics::cloth_motion::Cloth;
use crate::physics::collision::{Coefficients, Fidelity, Model, NotACollision};
use crate::problem::Id;
use crate::simulate::{Camera, MAX_SHOTS};
use information::Information;

pub(crate) use plan::FewestShots;

/// Number of shots at one cut angle and speed that are compared.
const COMPARED: usize = 40;

/// A planned experiment and its wanted standard errors: a SPEC.toml.
#[derive(Clone, Debug)]
pub struct Expected {
    /// The coefficients that are expected.
    pub(crate) coefficients: Coefficients,
    /// The cue ball, and the object ball unless it differs.
    pub(crate) ball: Ball,
    /// The object ball with the errors of both balls; `None`: [`ObjectBall::unweighed`].
    pub(crate) object: Option<ObjectBall>,
    /// The cloth.
    pub(crate) cloth: Cloth,
    /// The camera; its gaps, outliers and markers are ignored.
    pub(crate) camera: Camera,
    /// The kinds of shot that can be played.
    pub(crate) kinds: Vec<PlayedKind>,
    /// The standard errors of μ, μ_s and e that are wanted; `None` if any will do.
    pub(crate) wanted: [Option<f64>; 3],
}

impl Expected {
    /// Returns the model of the collisions.
    pub(crate) fn model(&self) -> Model {
        Model { object: Some(self.object_ball().ball), ..Model::new(Fidelity::Full, self.ball) }
    }

    /// Returns the standard deviations of the ratios of masses and of radii as stated.
    pub(crate) fn ratio_sds(&self) -> [f64; 2] {
        self.object_ball().ratio_sds(self.ball).map(Option::unwrap_or_default)
    }

    fn object_ball(&self) -> ObjectBall {
        self.object.unwrap_or(ObjectBall::unweighed(self.ball))
    }
}

/// A kind of shot, spread evenly over its ranges: section `[[kind]]`.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema, PartialEq)]
#[serde(default)]
pub(crate) struct PlayedKind {
    /// Its name.
    pub(crate) name: String,
    /// Range of the topspin, in parts of natural roll; draw is negative.
    #[schemars(inner(range(min = -2, max = 2)))]
    pub(crate) topspin: [f64; 2],
    /// Side spin, in parts of natural roll; with positive cuts negative is outside spin.
    #[schemars(range(min = -2, max = 2))]
    pub(crate) side: f64,
    /// How the spin is known. `None`: roll and stun as played, other spins without side by their
    /// motion, side spin by markers.
    pub(crate) spin_from: Option<SpinFrom>,
    /// Standard errors by markers of the cue ball's and the object ball's spin, rad/s. `None`:
    /// about those of two markers on each ball, filmed by this camera.
    pub(crate) spin_sd_rad_s: Option<[f64; 2]>,
    /// Range of the speed before the impact, m/s.
    pub(crate) speed_m_s: [f64; 2],
    /// Range of the cut angle, degrees.
    pub(crate) cut_deg: [f64; 2],
    /// Number of shots that are planned.
    #[schemars(range(min = 1, max = MAX_SHOTS))]
    pub(crate) shots: usize,
}

/// How a fit knows the spin of a shot.
#[derive(Clone, Copy, Debug, Deserialize, Serialize, JsonSchema, PartialEq)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum SpinFrom {
    /// The spin is exactly as played.
    Known,
    /// The spin is found from the paths of the balls, for a ball struck without side.
    Motion,
    /// Markers show the spins before and after the impact.
    Markers,
}

impl PlayedKind {
    /// Returns how the spin is known.
    pub(crate) fn source(&self) -> SpinFrom {
        self.spin_from.unwrap_or(match (self.topspin, self.side) {
            ([from, to], 0.0) if from == to && (from == 0.0 || from == 1.0) => SpinFrom::Known,
            (_, 0.0) => SpinFrom::Motion,
            _ => SpinFrom::Markers,
        })
    }
}

impl Default for PlayedKind {
    /// 40 natural-roll shots.
    fn default() -> Self {
        Self {
            name: "roll".to_owned(),
            topspin: [1.0; 2],
            side: 0.0,
            spin_from: None,
            spin_sd_rad_s: None,
            speed_m_s: [1.0, 4.0],
            cut_deg: [0.0, 60.0],
            shots: 40,
        }
    }
}

impl Default for Expected {
    /// Pool balls filmed at 1000 fps, 40 shots each of roll, stun, draw and side spin either way.
    fn default() -> Self {
        let kinds = [
            ("roll", [1.0; 2], 0.0),
            ("stun", [0.0; 2], 0.0),
            ("draw", [-1.0, -0.3], 0.0),
            ("outside", [0.0; 2], -0.5),
            ("inside", [0.0; 2], 0.5),
        ];
        let kinds = kinds.map(|(name, topspin, side)| PlayedKind {
            name: name.to_owned(),
            topspin,
            side,
            ..PlayedKind::default()
        });
        Self {
            coefficients: Coefficients { mu: 0.05, mu_s: 0.3, e: 0.94 },
            ball: Ball::POOL,
            object: None,
            cloth: Cloth::default(),
            camera: Camera::default(),
            kinds: kinds.to_vec(),
            wanted: [Some(3e-4), Some(5e-3), Some(3e-4)],
        }
    }
}

/// Values for each of μ, μ_s and e, by its name.
pub(crate) type ByCoefficient<T> = IndexMap<&'static str, T>;

pub(crate) fn by_coefficient<T>(values: [T; 3]) -> ByCoefficient<T> {
    Parameter::COEFFICIENTS.map(Parameter::name).into_iter().zip(values).collect()
}

/// A kind of shots.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub(crate) struct Kind {
    /// The kind as it is planned.
    #[serde(flatten)]
    planned: PlayedKind,
    /// Standard errors of the coefficients from these shots alone.
    std_error: ByCoefficient<Option<f64>>,
    /// Number of shots that the wanted standard errors need.
    shots_needed: ByCoefficient<Option<u64>>,
    /// The Fisher information of one shot on average.
    #[serde(skip)]
    information: Information,
}

/// A kind of shot at one cut angle and one speed.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cell {
    /// The index of the kind in [`Expected::kinds`].
    pub(crate) kind: usize,
    pub(crate) speed_m_s: f64,
    /// The cut angle, degrees.
    pub(crate) cut_deg: f64,
    pub(crate) information: Information,
    /// The standard errors of μ, μ_s and e from as many shots as are planned of the kind.
    pub(crate) std_errors: [Option<f64>; 3],
}

/// All planned shots together.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub(crate) struct Together {
    /// Number of shots.
    shots: usize,
    /// Their standard errors, with those of the ratios of masses and radii that are uncertain.
    std_error: ByCoefficient<Option<f64>>,
    /// Difference between two cloths or pairs of balls, each filmed so, that is found in 80 of 100
    /// cases.
    detectable_difference: ByCoefficient<Option<f64>>,
}

/// A design: how well an experiment would determine the parameters.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Design {
    /// The experiment, with the standard errors of spins that markers show.
    pub(crate) expected: Expected,
    /// The kinds, in the order of [`Expected::kinds`].
    pub(crate) kinds: Vec<Kind>,
    /// The kinds at single cut angles and speeds.
    pub(crate) cells: Vec<Cell>,
    /// All planned shots together.
    pub(crate) together: Together,
    /// The fewest shots of each kind for each wanted standard error, and for all together.
    pub(crate) mixtures: Vec<FewestShots>,
    /// The conclusions, in sentences.
    pub(crate) words: Vec<String>,
    /// Remarks on what was adjusted or cannot be reached, in sentences.
    pub(crate) notes: Vec<String>,
}

/// Returns the difference between two such data sets, in standard errors of one, that a two-sided
/// test at 5 % finds in 80 % of cases: (z_0.975 + z_0.8)√2 = 3.962.
fn detectable() -> f64 {
    let normal = Normal::standard();
    (normal.inverse_cdf(0.975) + normal.inverse_cdf(0.8)) * std::f64::consts::SQRT_2
}

impl Design {
    /// Returns the standard errors of μ, μ_s and e from a number of shots of each kind; `None` for
    /// what they do not determine.
    pub fn std_errors(&self, shots: &[u64]) -> [Option<f64>; 3] {
        let weighted = self.kinds.iter().zip(shots);
        information::std_errors(&weighted.map(|(kind, count)| kind.information * *count as f64).sum())
    }
}

/// Computes what an experiment would determine.
///
/// # Errors
/// A shot is not a collision.
pub fn design(expected: &Expected) -> Result<Design, NotACollision> {
    let mut expected = expected.clone();
    let marker_errors = marker_errors(&expected.camera);
    for kind in &mut expected.kinds {
        let source = kind.source();
        kind.spin_from = Some(source);
        if source == SpinFrom::Markers {
            kind.spin_sd_rad_s.get_or_insert(marker_errors);
        }
    }
    let mut notes = Vec::new();
    let average = |kind: &PlayedKind| information::average(&expected, kind, None);
    let averages: Vec<Information> = expected.kinds.iter().map(average).collect::<Result<_, _>>()?;
    let weighted = averages.iter().zip(&expected.kinds);
    let total: Information = weighted.map(|(information, kind)| information * kind.shots as f64).sum();
    let together = together(&expected, &total);
    for parameter in Parameter::COEFFICIENTS {
        let std_error = together.std_error[parameter.name()];
        if std_error.is_none() && expected.wanted[parameter as usize].is_some() {
            notes.push(format!("No kind of shot offered determines {}.", parameter.symbol()));
        }
    }
    let (mut kinds, mut cells) = (Vec::new(), Vec::new());
    for (index, (kind, information)) in expected.kinds.iter().zip(averages).enumerate() {
        let only = |i: usize| std::array::from_fn(|j| expected.wanted[j].filter(|_| i == j));
        let std_errors = |of_one: Information| information::std_errors(&(of_one * kind.shots as f64));
        kinds.push(Kind {
            planned: kind.clone(),
            std_error: by_coefficient(std_errors(information)),
            shots_needed: by_coefficient(std::array::from_fn(|i| plan::needed(&information, &only(i)))),
            information,
        });
        for speed_m_s in speeds(kind.speed_m_s) {
            for cut_deg in cuts(kind.cut_deg) {
                let at = Some([speed_m_s, cut_deg]);
                let information = information::average(&expected, kind, at)?;
                let std_errors = std_errors(information);
                cells.push(Cell { kind: index, speed_m_s, cut_deg, information, std_errors });
            }
        }
    }
    let mixtures = plan::mixtures(&expected, &kinds);
    let words = Parameter::COEFFICIENTS.map(|parameter| best_shots(&expected, &cells, parameter)).to_vec();
    Ok(Design { expected, kinds, cells, together, mixtures, words, notes })
}

/// Returns the standard errors (rad/s) to which two markers on each ball show the spins of cue ball
/// and object ball. A frame rate f, an error σ of positions and a time T after the impact change
/// them as σ/(T√f), since markers go out of sight. The result is within a factor of 2 of what
/// extractions of simulated films of draw and side spin state, at 120 to 1000 fps, 0.1 to 0.5 mm
/// and 20 to 100 ms.
fn marker_errors(camera: &Camera) -> [f64; 2] {
    /// At 1000 fps, 0.1 mm and 40 ms.
    const TYPICAL: [f64; 2] = [0.12, 0.095];
    let typical = Camera::default();
    let time = typical.after_ms / camera.after_ms;
    let scale = camera.position_sd_m / typical.position_sd_m * (typical.fps / camera.fps).sqrt() * time;
    TYPICAL.map(|error| scale * error)
}

/// Returns the shots that determine a parameter best, and the kinds that do not.
fn best_shots(expected: &Expected, cells: &[Cell], parameter: Parameter) -> String {
    let error =
        |cell: &Cell| information::std_errors(&(cell.information * COMPARED as f64))[parameter as usize];
    let errors: Vec<(f64, &Cell)> = cells.iter().filter_map(|cell| Some((error(cell)?, cell))).collect();
    let what = format!("{} ({})", parameter.symbol(), parameter.meaning());
    let Some((least, best)) = errors.iter().min_by(|a, b| a.0.total_cmp(&b.0)) else {
        return format!("{what} is determined by none of these shots at one cut angle and speed.");
    };
    let mut line = format!(
        "{what} is determined best by \"{}\" at a cut of {}° and {} m/s: {COMPARED} such shots give ± {}.",
        expected.kinds[best.kind].name,
        plain(best.cut_deg, 3),
        plain(best.speed_m_s, 3),
        plain(*least, 2)
    );
    let kinds = expected.kinds.iter().enumerate();
    let undetermined = kinds.filter(|(kind, _)| errors.iter().all(|(_, cell)| cell.kind != *kind));
    let undetermined: Vec<String> = undetermined.map(|(_, kind)| format!("\"{}\"", kind.name)).collect();
    if !undetermined.is_empty() {
        line += &format!(" It is not determined by {}.", undetermined.join(", "));
    }
    line
}

/// Returns what all planned shots determine, from their information.
fn together(expected: &Expected, total: &Information) -> Together {
    let covariance = information::covariance(total);
    let std_errors = information::std_errors(total);
    let mut std_error = by_coefficient(std_errors);
    for (id, stated) in [Id::MassRatio, Id::RadiusRatio].into_iter().zip(expected.ratio_sds()) {
        let error = stated * covariance[(id as usize, id as usize)].sqrt();
        std_error.extend((error > 0.0).then_some((id.name(), Some(error))));
    }
    Together {
        shots: expected.kinds.iter().map(|kind| kind.shots).sum(),
        std_error,
        detectable_difference: by_coefficient(std_errors.map(|error| Some(detectable() * error?))),
    }
}

/// Returns the speeds of the cells of a kind, m/s: the ends of a range and their geometric mean.
pub(crate) fn speeds([slow, fast]: [f64; 2]) -> Vec<f64> {
    if slow == fast { vec![slow] } else { vec![slow, (slow * fast).sqrt(), fast] }
}

/// Returns cut angles from end to end, in steps of about 10°.
fn cuts([from, to]: [f64; 2]) -> Vec<f64> {
    if from == to {
        return vec![from];
    }
    let steps = (0.1 * (to - from)).round().max(1.0);
    (0..=steps as usize).map(|i| from + (to - from) * i as f64 / steps).collect()
}
