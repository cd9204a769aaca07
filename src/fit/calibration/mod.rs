//! From films as they are to positions on the table: dropped frames, noise that lasts, and the search for the camera.
//!
//! The search begins at the distances of the centres at the contacts, which tell scale, aspect, shear and perspective. From there the
//! frames of all shots are fitted jointly with every [`Correction`] free, the films corrected by what was found, and again until nothing
//! is left to correct. What the frames do not call for is then left out. Discs calibrate their camera without a model of their collision
//! (`discs`).

mod adopted;
mod contact_frames;
mod corrected;
mod discs;
mod resting;
mod start;
mod stated_noise;
mod unit;

use rayon::prelude::*;

use self::unit::{finer_unit, in_metres};
use super::camera::{FoundCamera, LEAST_SHOTS};
use crate::extraction::{contact, leave_out_before_cushion, noise_correlation, repair_drops_at_impacts};
use crate::film::camera::{Arrangement, Camera};
use crate::film::drops;
use crate::measurement::correction::Correction;
use crate::measurement::dataset::{Dataset, Tracks};
use crate::measurement::track::TrackShot;
use crate::numerics::median;
use crate::physics::collision::Fidelity;
use crate::trajectory::scene::Scene;

/// So many shots, spread evenly, calibrate a camera to some 1e-4.
const CALIBRATED_FROM: usize = 120;

/// Noise looks like a dropped frame in some two of 10 000 clean shots (1000 frames per second, 0.1 mm). Where no larger part than this seems
/// to have dropped any, impacts are not searched for drops.
const SELDOM: f64 = 0.002;

/// Lengths that are off by more than this part are in another unit, or their scale is wrong by a factor.
const OTHER_UNIT: f64 = 0.1;

/// A correction is called for where −2 log L falls by as much with it, as for effects of an impact.
const CALLED_FOR: f64 = 6.0;

/// Corrects footage for its camera as far as the shots call for it, and says what its shots told of the scene meanwhile. Any other data
/// set is returned as it is. `same`: what another film of balls by the same camera was counted from. `quick`: only the first start is
/// tried if it leads to a camera, good or not.
pub(super) fn calibrated(
    mut dataset: Dataset,
    same: Option<&FoundCamera>,
    quick: bool,
) -> (Dataset, Option<FoundCamera>, Option<Scene>) {
    if dataset.tracks.as_ref().is_some_and(|tracks| tracks.discs.is_some()) {
        let (dataset, found) = calibrated_discs(dataset);
        return (dataset, found, None);
    }
    // the search copies the data set, which must not cost the frames of all shots
    let Some(mut tracks) = dataset.tracks.take() else { return (dataset, None, None) };
    let scene = Scene { side_sd: dataset.side_sd, ..Scene::of(&dataset.model(Fidelity::Full)) };
    let repaired = tracks.shots.par_iter_mut().map(drops::repair);
    let dropped: Vec<usize> = repaired.filter(|count| *count > 0).collect();
    let cushions = tracks
        .shots
        .par_iter_mut()
        .filter_map(|shot| leave_out_before_cushion(shot, &scene).then_some(()))
        .count();
    if cushions > 0 {
        tracks.notes.push(format!(
            "In {cushions} of {} shots the path of the cue ball has a corner before the impact, as where it is struck, or comes off a cushion: \
             its frames up to there are left out.",
            tracks.shots.len()
        ));
    }
    let noise_correlation = noise_correlation(&tracks.shots, &scene);
    if let Some(found) = noise_correlation.filter(|found| found.adopted) {
        tracks.shots.iter_mut().for_each(|shot| shot.correlation = found.value);
    }
    resting::leave_out_moving(&mut dataset, &mut tracks);
    let over_stated = stated_noise::over_stated(&tracks.shots);
    if let Some(times) = over_stated {
        stated_noise::replace(&mut tracks.shots, times);
        tracks.notes.extend(stated_noise::sentence(times));
    }
    let search = |tracks: &Tracks| Search::new(&dataset, tracks, &scene, same)?.best(same.is_some(), quick);
    let mut found = search(&tracks);
    if let Some(reach) = found.as_ref().and_then(|(found, ..)| found.spoiled) {
        tracks.shots.par_iter_mut().for_each(|shot| contact_frames::leave_out(shot, reach, &scene));
        if let Some((again, unit, scene)) = search(&tracks) {
            found = Some((FoundCamera { spoiled: Some(reach), ..again }, unit, scene));
        }
    }
    let coarsest = tracks.shots.iter().flat_map(|shot| shot.resolution).fold(0.0, f64::max);
    let (mut found, unit, last_scene) = found.unwrap_or_else(|| (FoundCamera::as_it_is(), 1.0, None));
    if !found.converged && loses_frames(&found.camera, &tracks.shots, unit) {
        found.camera = Camera::neutral([0.0; 2]);
        found.corrections.clear();
    }
    found.noise_correlation = noise_correlation;
    found.over_stated_noise = over_stated;
    found.resolution = coarsest * unit;
    found.drops = [dropped.len(), dropped.iter().sum()];
    for shot in &mut tracks.shots {
        *shot = found.camera.shot(&in_metres(shot, unit));
    }
    if dropped.len() as f64 > SELDOM * tracks.shots.len() as f64 {
        // a camera that drops frames does so next to impacts, too
        let scene = Scene { viewpoint: found.camera.viewpoint(), ..last_scene.unwrap_or(scene) };
        let at_impacts = repair_drops_at_impacts(&mut tracks.shots, &scene);
        found.drops = [found.drops[0] + at_impacts, found.drops[1] + at_impacts];
    }
    tracks.notes.extend(found.sentences());
    // where the stated unit is not that of the film, its lengths mean nothing without the balls
    tracks.from_balls |= found.unit != 1.0;
    tracks.viewpoint = found.camera.viewpoint();
    dataset.tracks = Some(tracks);
    (dataset, Some(found), last_scene)
}

/// Whether a camera that was not found for certain shows no point of the table where some of the positions are.
fn loses_frames(camera: &Camera, films: &[TrackShot], unit: f64) -> bool {
    films.iter().any(|film| {
        let film = in_metres(film, unit);
        let shot = camera.shot(&film);
        shot.cue.len() < film.cue.len() || shot.object.len() < film.object.len()
    })
}

/// Corrects footage of discs for its camera, as far as the shots call for it. Any other data set is returned as it is.
pub(super) fn calibrated_discs(mut dataset: Dataset) -> (Dataset, Option<FoundCamera>) {
    let Some((tracks, facts)) = dataset.tracks.as_mut().and_then(|tracks| {
        let facts = tracks.discs?;
        Some((tracks, facts))
    }) else {
        return (dataset, None);
    };
    let drops: Vec<usize> = tracks.shots.iter_mut().map(drops::repair).filter(|count| *count > 0).collect();
    let dropped =
        FoundCamera { drops: [drops.len(), drops.iter().sum()], of_discs: true, ..FoundCamera::as_it_is() };
    tracks.notes.extend(dropped.sentences());
    let Some((found, shots)) = discs::Search::new(tracks, facts).map(discs::Search::best) else {
        return (dataset, None);
    };
    tracks.shots = shots;
    tracks.notes.extend(found.sentences());
    (dataset, Some(found))
}

/// The search for a camera.
#[derive(Clone)]
struct Search<'a> {
    dataset: &'a Dataset,
    radius: f64,
    /// By which lengths are multiplied, and the films of the shots that calibrate, m.
    unit: f64,
    films: Vec<TrackShot>,
    /// Where the centres of both balls are at the contacts in these films, m.
    contacts: Vec<[[f64; 2]; 2]>,
    camera: Camera,
    free: Vec<Correction>,
    /// Whether lengths have no unit but the balls.
    from_balls: bool,
    /// With the lift that the shots tell, once they do.
    scene: Option<Scene>,
    /// By which part of 2R contacts may seem to be off it.
    gap_sd: f64,
    /// How many shots the last joint fit used and how many it left aside as odd, its χ²/dof, and −2 log L of a coordinate.
    used: usize,
    odd: usize,
    misfit: f64,
    unlikely: f64,
    /// How many frames next to the impacts were off in it.
    spoiled: Option<[usize; 2]>,
}

impl<'a> Search<'a> {
    fn new(
        dataset: &'a Dataset,
        tracks: &'a Tracks,
        scene: &Scene,
        same: Option<&FoundCamera>,
    ) -> Option<Self> {
        let from_balls = tracks.from_balls;
        let step = tracks.shots.len().div_ceil(CALIBRATED_FROM).max(1);
        let films: Vec<TrackShot> = tracks.shots.iter().step_by(step).cloned().collect();
        let contacts = |films: &[TrackShot]| -> Vec<[[f64; 2]; 2]> {
            films.iter().filter_map(|film| contact(film, scene)).collect()
        };
        let seen = contacts(&films);
        if seen.is_empty() || seen.len() < LEAST_SHOTS && !from_balls {
            return None;
        }
        let apart = seen.iter().map(|[a, b]| (b[0] - a[0]).hypot(b[1] - a[1]));
        let ratio = scene.contact_distance() / median(apart.collect());
        let other = from_balls || (ratio - 1.0).abs() > OTHER_UNIT;
        // a film that differs from the other by as much is by another camera
        let same = same.filter(|same| (same.unit / ratio - 1.0).abs() < OTHER_UNIT);
        let unit = match same {
            Some(same) => same.unit,
            None if other && ratio.is_finite() => finer_unit(&films, ratio, scene),
            None => 1.0,
        };
        let films: Vec<TrackShot> = films.iter().map(|film| in_metres(film, unit)).collect();
        let contacts = contacts(&films);
        let count = contacts.len().max(1) as f64;
        let middle = [0, 1].map(|i| contacts.iter().map(|[a, b]| 0.5 * (a[i] + b[i])).sum::<f64>() / count);
        // the search for a camera that is known to be the same begins where it was found
        let mut camera = same.map_or(Camera::neutral(middle), |same| same.camera);
        let mut free = Vec::new();
        for (which, stated) in Correction::ALL.into_iter().zip(tracks.camera) {
            match stated {
                Some(value) => camera = camera.with(which, value),
                None if seen.len() >= LEAST_SHOTS || from_balls && which == Correction::Scale => {
                    free.push(which);
                }
                None => {}
            }
        }
        Some(Self {
            dataset,
            radius: 0.5 * scene.contact_distance(),
            unit,
            films,
            contacts,
            camera,
            free,
            from_balls,
            scene: None,
            gap_sd: 0.0,
            used: 0,
            odd: 0,
            misfit: f64::INFINITY,
            unlikely: f64::INFINITY,
            spoiled: None,
        })
    }

    /// The camera from the first start that leads to a good one, or else to the best. With few contacts these may lead far astray, and so
    /// they may in slow films, of which lines see them badly; and as long as the camera is far off, shots whose balls seem not to touch at
    /// 2R belong to the search.
    fn best(self, is_same: bool, quick: bool) -> Option<(FoundCamera, f64, Option<Scene>)> {
        /// How many times wider than what is usual of a camera the priors are at the contacts, if the search begins at these, and by
        /// which part contacts may seem to be off.
        const STARTS: [(Option<f64>, f64); 5] =
            [(Some(10.0), 0.0), (Some(10.0), 0.1), (Some(1.0), 0.1), (None, 0.1), (None, 0.0)];
        let starts = STARTS.into_iter().filter(|(wider, _)| !(is_same && wider.is_some()));
        let mut best: Option<(Self, FoundCamera)> = None;
        for (wider, gap_sd) in starts {
            let mut search = Self { gap_sd, ..self.clone() };
            if let Some(wider) = wider {
                search.start(wider);
            }
            let Some(found) = search.found() else { continue };
            let is_good = search.is_good(&found);
            if best.as_ref().is_none_or(|(other, of_other)| search.is_better(&found, (other, of_other))) {
                best = Some((search, found));
            }
            if is_good || quick {
                break;
            }
        }
        let (search, found) = best?;
        if quick && !search.is_good(&found) {
            return Some((FoundCamera { is_settled: false, ..found }, search.unit, search.scene));
        }
        let (search, found) = search.arranged(found);
        // what no camera explains is more than some frames
        let spoiled = found.spoiled.filter(|_| search.is_good(&found));
        Some((FoundCamera { spoiled, ..found }, search.unit, search.scene))
    }

    /// Where a camera looks askew through a lens, or either of these with a rolling shutter: in the arrangement that agrees best.
    fn arranged(self, found: FoundCamera) -> (Self, FoundCamera) {
        type Is = fn(Correction) -> bool;
        type Other = ([Is; 2], fn(&mut Arrangement));
        const OTHERS: [Other; 2] = [
            ([Correction::is_of_perspective, Correction::is_of_lens], |camera| camera.lens_first = true),
            ([|which| which.is_of_perspective() || which.is_of_lens(), Correction::is_of_time], |camera| {
                camera.rows_of_table = true;
            }),
        ];
        let mut best = (self, found);
        for (needs, change) in OTHERS {
            if !needs.into_iter().all(|is| best.1.adopted().any(is)) {
                continue;
            }
            let mut other = best.0.clone();
            change(&mut other.camera.arrangement);
            if let Some(found) = other.found()
                && other.is_better(&found, (&best.0, &best.1))
            {
                best = (other, found);
            }
        }
        best
    }

    /// Whether nearly all shots agree on a camera, but for those that are plainly odd.
    fn is_good(&self, found: &FoundCamera) -> bool {
        /// Of the shots: more are seldom wrong.
        const NEARLY_ALL: f64 = 0.8;
        /// χ²/dof of what may be wrong with balls and shots.
        const FAIR: f64 = 3.0;
        let explained = self.used + self.odd;
        let agree = explained as f64 >= NEARLY_ALL * self.contacts.len() as f64 && self.misfit < FAIR;
        found.converged && (agree || found.corrections.is_empty())
    }

    /// Than another one: by rest, then by whether nearly all agree, by how many shots do, and by how likely they are.
    fn is_better(&self, found: &FoundCamera, (other, of_other): (&Self, &FoundCamera)) -> bool {
        let rank = |search: &Self, found: &FoundCamera| (found.converged, search.is_good(found), search.used);
        match rank(self, found).cmp(&rank(other, of_other)) {
            std::cmp::Ordering::Equal => self.unlikely < other.unlikely,
            order => order.is_gt(),
        }
    }
}
