//! The measured impact of two discs: quantities that follow from own and shared unknowns, with
//! exact derivatives, and doubts.

use num_dual::DualNum;
use statrs::distribution::{ContinuousCDF, Normal};

use super::block::ShotFrames;
use super::motion::{Dual, Motion};
use super::own::{self, DISTANCE_SD, LEAST_SHOTS};
use super::stuck::Stuck;
use crate::film::unusable::Unusable;
use crate::measurement::dataset::Measured;
use crate::measurement::number::with_error;
use crate::numerics::median;
use crate::physics::disc::Discs;
use crate::problem::false_shots::find_copies;
use crate::problem::film::camera::Point;
use crate::problem::frames::PicturePaths;
use crate::problem::policy::POLICY;

/// Part of the distance of the centres by which the frames of a collision are off the paths at
/// most.
const MAX_FRAME_DEVIATION: f64 = 0.02;

/// The column of the distance of the centres.
const DISTANCE: &str = "contact_distance_mm";

/// The columns of the velocities before the impact and after it, and of the spins.
const STATES: &str = "cue_vx cue_vy obj_vx obj_vy cue_vx_after cue_vy_after obj_vx_after obj_vy_after \
                      cue_wz cue_wz_after obj_wz obj_wz_after";

/// The measured impact of a shot, without a law of friction. Velocities are in m/s and
/// spins in rad/s in the frame of the table; if the frame rate is not known, per frame.
#[derive(Clone, Debug)]
pub struct DiscImpact {
    /// Name of the shot.
    pub(crate) name: String,
    /// Each quantity under the name of its column in discs.csv; `None` if the tracks do not
    /// determine it.
    pub(crate) values: Vec<(&'static str, Option<Measured>)>,
    /// Standard deviation of a coordinate of the disc that is followed worse, m.
    pub(crate) position_sd: f64,
    /// Variance of the frames about the paths over that of their noise before anything was fitted.
    pub(crate) misfit: f64,
    /// Number of frames that were used, of both discs.
    pub(crate) frames: usize,
    /// Number of frames that were left out as wrong.
    pub(crate) outliers: usize,
    /// First and last instant that was used, s.
    pub(crate) window: [f64; 2],
    /// Whether the discs still touch in frames next to the impact, which are off the paths.
    pub(crate) touches: bool,
    /// Radii of the discs; if they are not stated, half the distance of the centres at the impact,
    /// m.
    pub(crate) radii: [f64; 2],
    /// How the discs stick together after the impact, if they do.
    pub(crate) stuck: Option<Stuck>,
    /// Doubts of the measurements, as clauses.
    pub(crate) doubts: Vec<String>,
    pub(super) paths: PicturePaths,
    /// Metres in a unit of length of the film, and its middle in that unit.
    pub(super) film: (f64, Point),
}

impl DiscImpact {
    /// Returns the quantity of a column of discs.csv, in the unit of that column, if the tracks
    /// determine it.
    pub fn get(&self, column: &str) -> Option<Measured> {
        self.values.iter().find(|(name, _)| *name == column)?.1
    }

    /// Returns the place of the centre of a disc (0 or 1) in the film at a time (s), in its unit.
    pub fn place(&self, disc: usize, time: f64) -> [f64; 2] {
        let (unit, middle) = self.film;
        (Point::from(self.paths.place(disc, time)) / unit + middle).into()
    }

    /// Returns the doubts of its numbers as clauses, also that the discs stick together.
    pub fn doubts(&self) -> Vec<String> {
        self.stuck.iter().map(Stuck::sentence).chain(self.doubts.iter().cloned()).collect()
    }

    /// Returns the number of frames that were left out as wrong.
    pub fn outliers(&self) -> usize {
        self.outliers
    }

    /// Returns the reason for which no law can be fitted to the shot, if there is one.
    pub(crate) fn find_fault(&self) -> Option<String> {
        let Some(stuck) = &self.stuck else { return self.find_impossible_restitution() };
        Some(format!(
            "{}. What is fitted describes discs that part again; \"caromfit extract\" gives the motion of this shot",
            stuck.sentence()
        ))
    }

    /// Returns the reason for which the shot cannot be used: its frames show no single collision,
    /// or other discs than those with these radii.
    pub(super) fn find_unusable(&self, radii: Option<[f64; 2]>) -> Option<Unusable> {
        // films of one dimension show no distance
        self.get("impulse_ratio")?;
        let distance = 1e-3 * self.get(DISTANCE)?.value.abs();
        if distance > 0.0 && self.position_sd > MAX_FRAME_DEVIATION * distance {
            let rms_mm = 1e3 * self.position_sd;
            return Some(Unusable::BadFit { reduced_chi2: self.misfit, rms_mm });
        }
        let expected = 1e3 * radii?.into_iter().sum::<f64>();
        let [measured, error] = self.find_difference(DISTANCE, expected, DISTANCE_SD * expected)?;
        Some(Unusable::Separation { measured, expected, error })
    }

    /// Returns the doubt of an e that is not that of an impact.
    fn find_impossible_restitution(&self) -> Option<String> {
        let possible = self.get("e")?.value.clamp(0.0, 1.0);
        let [e, sd] = self.find_difference("e", possible, 0.0)?;
        let e = with_error(e, sd);
        Some(format!("its e of {e} is not between 0 and 1, as that of any passive impact is"))
    }

    /// Returns a quantity and its standard error if it differs from an expectation with a standard
    /// deviation as seldom by chance as an outlying shot does.
    fn find_difference(&self, column: &str, expected: f64, sd: f64) -> Option<[f64; 2]> {
        let Measured { value, sd: Some(error) } = self.get(column)? else { return None };
        let normal = Normal::new(0.0, error.hypot(sd)).ok()?;
        (normal.sf((value - expected).abs()) < POLICY.shot_tail).then_some([value, error])
    }

    fn find_imbalance(&self) -> Option<String> {
        ["along", "across"].into_iter().find_map(|direction| {
            let [gained, sd] = self.find_difference(&format!("momentum_{direction}"), 0.0, 0.0)?;
            let verb = if gained < 0.0 { "lose" } else { "gain" };
            let (gained, sd) = (100.0 * gained.abs(), 100.0 * sd);
            Some(format!(
                "its momentum is not conserved: {direction} the line of centres both discs together {verb} {gained:.1} ± {sd:.1} % \
                 of the impulse; the masses, the scale or the frames are wrong, or something else pushed a disc"
            ))
        })
    }
}

/// Adds what speaks against the impacts of a film.
pub(super) fn find_doubts(impacts: &mut [DiscImpact]) {
    let all: Vec<f64> = impacts.iter().filter_map(|impact| Some(impact.get(DISTANCE)?.value)).collect();
    let typical = (all.len() >= LEAST_SHOTS).then(|| median(all));
    let states = |impact: &DiscImpact| STATES.split(' ').filter_map(|column| impact.get(column)).collect();
    for [i, j] in find_copies(&impacts.iter().map(states).collect::<Vec<_>>()) {
        let name = &impacts[j].name;
        let copy = format!(
            "its impact is that of shot {name} within the errors: expected each clip once, a copy makes errors too small"
        );
        impacts[i].doubts.push(copy);
    }
    for impact in impacts {
        let other = typical.and_then(|typical| {
            let [distance, _] =
                impact.find_difference(DISTANCE, typical, DISTANCE_SD * typical)?;
            Some(format!(
                "its discs are {distance:.1} mm apart at the contact, where the median of all shots is {typical:.1} mm: the same \
                 discs touch at the same distance, so that these are others, or the scale or the tracked points are"
            ))
        });
        let bent = (impact.misfit > POLICY.refuted).then(|| {
            format!(
                "its paths are not straight before and after one instant: they are off by {:.0} times the noise of the frames \
                 (χ²/dof is {:.0}); the contact lasts for several frames, or points were mistaken",
                impact.misfit.sqrt(),
                impact.misfit
            )
        });
        let all = [impact.find_imbalance(), bent, impact.find_impossible_restitution(), other];
        impact.doubts.extend(all.into_iter().flatten());
    }
}

impl Motion {
    /// Returns each quantity of the impact under the name of its column in discs.csv (the guide to
    /// films defines them), `None` if the frames of the shot do not show it.
    pub(super) fn quantities(&self, shot: &ShotFrames, discs: &Discs) -> Vec<(&'static str, Option<Dual>)> {
        let Self { own, velocities, spins, radii, .. } = self;
        let change = |disc: usize| self.along(&(velocities[disc][1] - velocities[disc][0]));
        let ([u_n, u_t], [v_n, v_t]) = (change(0), change(1));
        let [[parting, slip], [parting_after, slip_after]] = [0, 1].map(|side| self.relative(side));
        let stated = discs.masses.map(|[first, second]| Dual::from_re(second / first));
        let mass_ratio = stated.unwrap_or(-u_n / v_n);
        // νRΔω; J_n/m₁ = −Δu_n, J_n/m₂ = Δv_n
        let [first, second] =
            [0, 1].map(|disc| (spins[disc][1] - spins[disc][0]) * radii[disc] * discs.inertia);
        // of both discs about the contact point, per unit of m₁: R (t × v) and νR²ω
        let angular = (first - u_t) * radii[0] + mass_ratio * (second + v_t) * radii[1];
        let [before, after] = [0, 1].map(|side| {
            let energy = |disc: usize| {
                let rim = spins[disc][side] * radii[disc];
                velocities[disc][side].norm_squared() + rim * rim * discs.inertia
            };
            energy(0) + mass_ratio * energy(1)
        });
        let if_both = |value: Dual| (shot.turns == [true; 2]).then_some(value);
        let if_across = |value: Dual| shot.flat.is_none().then_some(value);
        let if_slip = |value: Dual| shot.knows_slip.then_some(value);
        let mut all = vec![
            ("e", Some(-parting_after / parting)),
            ("impulse_ratio", if_across((v_t - u_t) / (v_n - u_n))),
            // Δω = −R J_t/(νMR²)
            ("impulse_ratio_by_cue_spin", shot.turns[0].then(|| first / u_n)),
            ("impulse_ratio_by_obj_spin", shot.turns[1].then(|| -second / v_n)),
            ("mass_ratio", Some(mass_ratio)),
            ("momentum_along", stated.map(|ratio| (u_n + ratio * v_n) / -u_n)),
            ("momentum_across", if_across((u_t + mass_ratio * v_t) / -u_n)),
            ("angular_momentum", if_both(angular / (-u_n * (radii[0] + radii[1])))),
            ("energy_lost", if_both(-after / before + 1.0)),
            ("closing_speed", Some(-parting)),
            ("slip_ratio", if_slip(-slip / parting)),
            ("slip", if_slip(slip)),
            ("slip_after", if_both(slip_after)),
            ("nx", Some(own[own::DIRECTION].cos())),
            ("ny", Some(own[own::DIRECTION].sin())),
            (DISTANCE, Some(self.distance * 1e3)),
        ];
        let of_velocities = [0, 1]
            .map(|side| velocities.map(|of| [Some(of[side].x), Some(of[side].y)]))
            .into_iter()
            .flatten();
        let of_spins = [0, 1].map(|disc| spins[disc].map(|spin| shot.turns[disc].then_some(spin)));
        all.extend(STATES.split(' ').zip(of_velocities.chain(of_spins).flatten()));
        all.push(("impact_time_s", Some(own[own::TIME])));
        all
    }
}
