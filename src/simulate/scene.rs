//! Parts that specifications of synthetic data sets and of designs share: camera, cloth, spins,
//! ranges.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::measurement::fault::Fault;
use crate::name::worded;
use crate::physics::ball::{BallState, Vec3};
use crate::physics::contact_frame::cue_velocity;

/// Largest number of shots. More are a slip of the pen.
pub(crate) const MAX_SHOTS: usize = 1_000_000;

/// Largest number of frames of a shot before or after the impact. More would fill the memory.
const MAX_FRAMES: usize = 100_000;

/// The camera that films shots: section `[camera]`.
#[derive(Clone, Copy, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(default)]
pub(crate) struct Camera {
    /// Frames per second.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub(crate) fps: f64,
    /// Standard deviation of every coordinate, m.
    #[schemars(range(min = 0))]
    pub(crate) position_sd_m: f64,
    /// How long each shot is filmed before the impact, ms.
    #[schemars(range(min = 0))]
    pub(crate) before_ms: f64,
    /// How long each shot is filmed after the impact, ms.
    #[schemars(range(min = 0))]
    pub(crate) after_ms: f64,
    /// The fraction of the positions that are missing, 0 to 1.
    #[schemars(range(min = 0, max = 1))]
    pub(crate) gaps: f64,
    /// The fraction of the positions that are wrong, by up to 20 mm.
    #[schemars(range(min = 0, max = 1))]
    pub(crate) outliers: f64,
    /// How many points on each ball are marked, at random places; they are seen on its upper side.
    #[schemars(range(max = 100))]
    pub(crate) markers: usize,
}

impl Default for Camera {
    fn default() -> Self {
        let (fps, position_sd_m, time) = (1000.0, 1e-4, 40.0);
        Self { fps, position_sd_m, before_ms: time, after_ms: time, gaps: 0.0, outliers: 0.0, markers: 0 }
    }
}

impl Camera {
    /// Range of the places of impacts along x and along y, m.
    pub(crate) const FIELD_M: [f64; 2] = [0.3, 1.0];

    /// Returns the numbers of frames before and after the impact.
    pub(crate) fn frames(&self) -> [usize; 2] {
        [self.before_ms, self.after_ms].map(|ms| (1e-3 * ms * self.fps).round() as usize)
    }

    /// Returns the instants of all frames, s.
    pub(super) fn times(self) -> impl Iterator<Item = f64> {
        let [before, after] = self.frames();
        (0..=before + after).map(move |n| n as f64 / self.fps)
    }

    /// Returns what is wrong with it if a shot needs a number of frames on either side.
    pub(crate) fn faults(&self, least_frames: usize) -> impl Iterator<Item = Fault> {
        let fps = self.fps;
        let times = [("camera.before_ms", self.before_ms), ("camera.after_ms", self.after_ms)];
        times.into_iter().filter_map(move |(key, ms)| {
            let frames = (1e-3 * ms * fps).round();
            let is_possible = (least_frames as f64..=MAX_FRAMES as f64).contains(&frames);
            let value = format!("{ms}, which is {frames:.0} frames");
            let expected = format!("{least_frames} to {MAX_FRAMES} frames");
            // what is below 0 is named by the schema
            (!is_possible && frames >= 0.0 && fps > 0.0).then(|| Fault::new(key, value, expected))
        })
    }
}

worded! {
    /// How the cue ball is spinning before the impact.
    #[derive(Clone, Copy, Debug, Deserialize, Serialize, JsonSchema, PartialEq, Eq)]
    #[non_exhaustive]
    #[serde(rename_all = "kebab-case")]
    pub(crate) enum Played {
        /// It slides without any spin.
        Stun = "stun",
        /// It rolls on the cloth without slip.
        NaturalRoll = "natural-roll",
        /// Topspin of 90 % of the natural roll's: a ball that still slides a little.
        AlmostRoll = "almost-roll",
        /// Backspin of 30 to 100 % of the natural roll's.
        Draw = "draw",
        /// Side spin of up to the natural roll's, either way, on a sliding ball.
        Side = "side",
        /// Natural roll with side spin of up to a tenth of its spin, either way.
        SlightSide = "slight-side",
        /// Topspin or backspin of up to the natural roll's.
        Any = "any",
    }
    /// The name in a specification.
    pub fn name;
}

impl Played {
    /// Returns the ends of the range of its topspin, over natural roll.
    pub(crate) fn topspin(self) -> [f64; 2] {
        match self {
            Self::Stun | Self::Side => [0.0; 2],
            Self::NaturalRoll | Self::SlightSide => [1.0; 2],
            Self::AlmostRoll => [0.9; 2],
            Self::Draw => [-0.3, -1.0],
            Self::Any => [-1.0, 1.0],
        }
    }

    /// Returns its largest side spin either way, over the natural roll's spin.
    pub(crate) fn side(self) -> f64 {
        match self {
            Self::Side => 1.0,
            Self::SlightSide => 0.1,
            _ => 0.0,
        }
    }
}

/// Returns the cue ball in the collision frame, with topspin and side spin over natural roll.
pub(crate) fn cue_ball(speed: f64, cut_rad: f64, [topspin, side]: [f64; 2], radius: f64) -> BallState {
    let velocity = cue_velocity(speed, cut_rad);
    let roll = BallState::natural_roll(velocity, radius).spin;
    let sideways = Vec3::z() * (side * roll.norm());
    // a part that is 0 is left out: its zeros have signs, which files show
    let spin = match (topspin == 0.0, side == 0.0) {
        (true, true) => Vec3::zeros(),
        (true, false) => sideways,
        (false, true) => topspin * roll,
        (false, false) => topspin * roll + sideways,
    };
    BallState { velocity, spin }
}

/// Returns the number at this part of the way between two.
pub(crate) fn between([from, to]: [f64; 2], part: f64) -> f64 {
    from + (to - from) * part
}

/// Returns what is wrong with the speeds and the cut angles of the shots of a section.
pub(crate) fn faults_of_shots(section: &str, speed_m_s: [f64; 2], cut_deg: [f64; 2]) -> Vec<Fault> {
    let ([slow, fast], [thick, thin]) = (speed_m_s, cut_deg);
    let mut faults = Vec::new();
    if !(slow > 0.0 && slow <= fast && fast.is_finite()) {
        let (key, value) = (format!("{section}.speed_m_s"), format!("[{slow}, {fast}]"));
        faults.push(Fault::new(&key, value, "[slowest, fastest], above 0"));
    }
    if !(-90.0 < thick && thick <= thin && thin < 90.0) {
        let (key, value) = (format!("{section}.cut_deg"), format!("[{thick}, {thin}]"));
        faults.push(Fault::new(&key, value, "[least, most], between -90 and 90"));
    }
    faults
}
