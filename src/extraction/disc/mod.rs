//! Impacts of two discs: straight paths before and after, along which they may slow down evenly; both may move, masses and radii may differ.
//!
//! With the line of centres n from the first disc to the second, t = z × n, and the second disc's velocity
//! relative to the first g before and g' after the impact:
//!
//! - e = −g'·n / g·n;
//! - Δg = g' − g = J (1/m₁ + 1/m₂), so that J_t/J_n = Δg·t / Δg·n: neither needs the masses;
//! - m₂/m₁ = −Δu·n / Δv·n, u and v the velocities of the first and the second disc; what is left across
//!   the line of centres then checks the balance of momentum, or along it, too, where the masses are given;
//! - the spins change by −R J_t/(νMR²), which gives J_t/J_n once more from each disc's rotation;
//! - the slip of the contact point is s = g·t − R₁ω₁ − R₂ω₂, and friction on the second disc is against it.
//!
//! In g and s the collision is that of two equal discs, one of them at rest: [`DiscImpact::shot`].

mod contact;
mod initial_guess;
mod lines;
mod paths;
mod quantities;
mod rotation;
mod shot;
mod slowing;
mod stick;
mod unknowns;
mod verdict;

use nalgebra::SVector;
use rayon::prelude::*;

use self::paths::{DiscPaths, TrackedDiscs};
use self::slowing::{OwnSlowing, Slowing};
use super::path_fit::Tracked;
use super::unusable::Unusable;
use crate::film::discs::Calibrated;
use crate::film::frame_noise;
use crate::film::frame_noise::noise_near;
use crate::measurement::dataset::Measured;
use crate::measurement::track::{TrackShot, isolated};
use crate::physics::disc::Discs;

pub use quantities::Quantity;
pub use shot::ball;
pub use stick::Stuck;
pub(crate) use verdict::rigidity;

/// The impact of two discs. Velocities in m/s, spins in rad/s, table frame; where the frame rate is not
/// known, per frame.
#[derive(Clone, Debug)]
pub struct DiscImpact {
    /// The value of each [`Quantity`]; `None` where the tracks do not determine it.
    pub values: [Option<Measured>; Quantity::COUNT],
    /// The standard deviation of a coordinate, m: stated, or estimated from this shot's tracks.
    pub position_sd: f64,
    /// χ² per degree of freedom with the noise that second differences of the track show.
    pub reduced_chi2: f64,
    /// How many frames were used: of the first disc before and after the impact, and of the second before and after
    /// it.
    pub frames: [usize; 4],
    /// How many frames were left out as wrong.
    pub outliers: usize,
    /// The first and the last instant that was used, s.
    pub window: [f64; 2],
    /// The radii of the discs, m; where they are not stated, half the distance of the centres at the impact.
    pub radii: [f64; 2],
    /// How the discs stick together after the impact, where they do.
    pub stuck: Option<Stuck>,
    /// Deceleration of the discs of its film, m/s², if all its shots together show it; velocities are those at the impact.
    pub slowing: Option<Measured>,
    /// How many frames before and after the instant of impact were left out, since the discs still touch there.
    pub touching: usize,
    /// What speaks against these numbers: sentences without a capital letter and a full stop. Empty for a good shot.
    pub doubts: Vec<String>,
    unknowns: unknowns::Unknowns,
    equal: shot::Equal,
    own_slowing: Option<OwnSlowing>,
}

impl DiscImpact {
    /// The value of a quantity, where the tracks determine it.
    #[must_use]
    pub fn get(&self, quantity: Quantity) -> Option<Measured> {
        self.values[quantity as usize]
    }

    /// The fitted position of the centre of a disc (0 or 1) at a time (s), m.
    #[must_use]
    pub fn place(&self, disc: usize, time: f64) -> [f64; 2] {
        paths::place(self.outcome(), &self.unknowns.into(), disc, time)
    }

    /// Whether momentum is out of balance by more than its stated errors explain, though not by more than a camera's calibration
    /// does (then the shot is doubtful).
    pub(crate) fn is_out_of_balance(&self) -> bool {
        verdict::is_out_of_balance(self)
    }

    fn outcome(&self) -> Outcome {
        if self.stuck.is_some() { Outcome::Stick } else { Outcome::Part }
    }
}

/// What the discs do after the impact.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Outcome {
    /// Each goes its own way, straight on.
    Part,
    /// They move on as one rigid body.
    Stick,
}

/// Finds the impact of a shot. Of a film that was corrected by a camera and for discs that slow down, how far these may be off is part of
/// the errors of the impact.
fn extract(
    shot: &TrackShot,
    discs: &Discs,
    (camera, slowing): (Option<&Calibrated>, Slowing),
) -> Result<DiscImpact, Unusable> {
    let found = stick::find(shot);
    let guess = found.as_ref().map_or_else(|| initial_guess::guess(shot), |found| Ok(found.guess));
    // points that are not on one disc explain whatever else is wrong
    let rigid = rigidity(shot, guess.as_ref().ok().map(|guess| guess[unknowns::TIME]))?;
    let guess = guess?;
    let expected = discs.radii.map(|[first, second]| first + second);
    let settling = found.as_ref().map(|found| found.settling);
    let slowing = if settling.is_some() { Slowing::NONE } else { slowing };
    let is_one_dimensional = frame_noise::constant_axis(shot).is_some();
    let tracked = |touching: usize, time: f64| {
        let noise = noise_near(shot, guess[unknowns::TIME]);
        let reach = touching as f64 / shot.fps;
        let paths = DiscPaths { expected, settling, slowing, is_one_dimensional };
        let tracked = TrackedDiscs::new(shot, paths, noise);
        let tracked = settling.into_iter().fold(tracked, Tracked::outside);
        if touching > 0 { tracked.outside([time - reach, time + reach]) } else { tracked }
    };
    let stuck = found.map(|found| found.stuck);
    let (tracked, fitted, touching) = contact::fit(tracked, &guess, stuck.is_none())?;
    let centres = tracked.centres(&fitted, camera)?;
    let turns =
        [0, 1].map(|disc| rotation::turn(shot, disc, centres.unknowns[unknowns::TIME], fitted.window));
    let known = quantities::Known::new(
        &centres,
        turns,
        discs,
        (stuck.map(|stuck| stuck.restitution), is_one_dimensional),
    );
    let mut impact = DiscImpact {
        values: known.values(),
        position_sd: tracked.position_sd(&fitted),
        reduced_chi2: tracked.misfit(&fitted),
        frames: [fitted.frames[0][0], fitted.frames[0][1], fitted.frames[1][0], fitted.frames[1][1]],
        outliers: fitted.outliers(),
        window: fitted.window,
        radii: known.radii,
        stuck,
        slowing: None,
        touching,
        doubts: rigid.into_iter().collect(),
        unknowns: centres.unknowns,
        equal: known.equal(),
        own_slowing: centres.slowing,
    };
    verdict::judge(&mut impact);
    Ok(impact)
}

/// Finds the impacts of many shots in parallel, with one deceleration for the discs of all shots. However a shot fails, the others go on. Of
/// films that were corrected by a camera, its errors are those of the impacts, too.
pub(crate) fn extract_all(
    shots: &[TrackShot],
    discs: &Discs,
    camera: Option<&Calibrated>,
) -> Vec<Result<DiscImpact, Unusable>> {
    let first = extract_each(shots, discs, camera);
    let slowing = Slowing::prior(discs.in_seconds).of_film(first.iter().flatten());
    let mut impacts = extract_with(shots, discs, (camera, slowing));
    for impact in impacts.iter_mut().flatten().filter(|impact| impact.stuck.is_none()) {
        impact.slowing = slowing.significant();
    }
    verdict::compare_distances(&mut impacts);
    impacts
}

/// Each by itself, with the prior of its deceleration.
pub(crate) fn extract_each(
    shots: &[TrackShot],
    discs: &Discs,
    camera: Option<&Calibrated>,
) -> Vec<Result<DiscImpact, Unusable>> {
    extract_with(shots, discs, (camera, Slowing::prior(discs.in_seconds)))
}

fn extract_with(
    shots: &[TrackShot],
    discs: &Discs,
    known: (Option<&Calibrated>, Slowing),
) -> Vec<Result<DiscImpact, Unusable>> {
    let one =
        |shot| isolated(|| extract(shot, discs, known)).unwrap_or_else(|panic| Err(Unusable::Failed(panic)));
    shots.par_iter().map(one).collect()
}

/// A vector of numbers with derivatives by the fit's unknowns and the four spins.
type Dual = num_dual::DualSVec64<{ unknowns::INPUTS }>;

fn value(dual: &Dual) -> f64 {
    dual.re
}

fn gradient(dual: &Dual) -> SVector<f64, { unknowns::INPUTS }> {
    dual.eps.0.unwrap_or_else(SVector::zeros)
}
