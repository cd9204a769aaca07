//! From films as they are to positions on the table: dropped frames, noise that lasts, and the search for the camera.
//!
//! The search begins at the distances of the centres at the contacts, which tell scale, aspect, shear and perspective. From there the
//! frames of all shots are fitted jointly with every [`Correction`] free, the films corrected by what was found, and again until nothing
//! is left to correct. What the frames do not call for is then left out.

mod start;

use nalgebra::{DMatrix, DVector};

use super::camera::{FoundCamera, FoundCorrection};
use super::footage;
use super::frames::filmed;
use super::outlying::outlying;
use super::settled::Settled;
use super::{FilmUnknowns, model_choice, samples};
use crate::extraction::{Unusable, contact, extract_all, noise_correlation, repair_drops_at_impacts};
use crate::film::camera::{Camera, Rows};
use crate::film::drops;
use crate::likelihood::frames::shared_unknowns;
use crate::likelihood::sample::Sample;
use crate::measurement::correction::Correction;
use crate::measurement::dataset::{Dataset, Shot, Tracks};
use crate::measurement::loss::Loss;
use crate::measurement::track::TrackShot;
use crate::measurement::values::Values;
use crate::physics::collision::Fidelity;
use crate::trajectory::scene::{LiftPrior, Scene};

/// With fewer shots only a scale that nobody stated is looked for; the rest of the camera is taken as stated.
const LEAST_SHOTS: usize = 6;

/// So many shots, spread evenly, calibrate a camera to some 1e-4.
const CALIBRATED_FROM: usize = 120;

/// Lengths that are off by more than this part are in another unit, or their scale is wrong by a factor.
const OTHER_UNIT: f64 = 0.1;

/// Rounds of fitting and correcting. Nothing is left to correct within this part of a standard error, or of what is usual of a
/// correction: its square is then far below a standard error.
const ROUNDS: usize = 8;
const AT_REST: f64 = 0.2;
const SMALL: f64 = 0.02;

/// A correction is called for where −2 log L falls by as much with it, as for effects of an impact.
const CALLED_FOR: f64 = 6.0;

/// Corrects footage of balls for its camera as far as the shots call for it, and says what its shots told of the scene meanwhile. Any
/// other data set, discs among them, is returned as it is. `same`: what another film by the same camera was counted from.
pub(super) fn calibrated(
    mut dataset: Dataset,
    same: Option<&FoundCamera>,
) -> (Dataset, Option<FoundCamera>, Option<Scene>) {
    let Some(tracks) = dataset.tracks.as_ref().filter(|tracks| tracks.discs.is_none()) else {
        return (dataset, None, None);
    };
    let scene = Scene { side_sd: dataset.side_sd, ..Scene::of(&dataset.model(Fidelity::Full)) };
    let mut tracks = tracks.clone();
    let dropped: Vec<usize> = tracks.shots.iter_mut().map(drops::repair).filter(|count| *count > 0).collect();
    let noise_correlation = noise_correlation(&tracks.shots, &scene);
    if let Some(found) = noise_correlation.filter(|found| found.adopted) {
        tracks.shots.iter_mut().for_each(|shot| shot.correlation = found.value);
    }
    let search = Search::new(&dataset, &tracks, &scene, same);
    let found = search.and_then(|search| search.best(same.is_some()));
    let coarsest = tracks.shots.iter().flat_map(|shot| shot.resolution).fold(0.0, f64::max);
    let (mut found, unit, last_scene) = found.unwrap_or_else(|| (FoundCamera::as_it_is(), 1.0, None));
    found.noise_correlation = noise_correlation;
    found.resolution = coarsest * unit;
    found.drops = [dropped.len(), dropped.iter().sum()];
    for shot in &mut tracks.shots {
        *shot = found.camera.shot(&in_metres(shot, unit));
    }
    if !dropped.is_empty() {
        // a camera that drops frames does so next to impacts, too
        let scene = last_scene.unwrap_or(scene);
        let at_impacts = repair_drops_at_impacts(&mut tracks.shots, &scene);
        found.drops = [found.drops[0] + at_impacts, found.drops[1] + at_impacts];
    }
    tracks.notes.extend(found.sentences());
    dataset.tracks = Some(tracks);
    (dataset, Some(found), last_scene)
}

/// A film with all lengths multiplied by the unit that they are in, m.
fn in_metres(film: &TrackShot, unit: f64) -> TrackShot {
    let mut shot = film.clone();
    if unit == 1.0 {
        return shot;
    }
    for sample in shot.samples_mut() {
        (sample.x, sample.y) = (sample.x * unit, sample.y * unit);
        sample.sd = sample.sd.map(|sd| sd.map(|sd| sd * unit));
    }
    shot.position_sd = shot.position_sd.map(|sd| sd * unit);
    shot.resolution = shot.resolution.map(|step| step * unit);
    shot
}

/// The unit of films, m, where straight lines near the contacts gave a first one: fits of the whole paths tell the distance of the
/// centres at the contact far better, while lines miss how the paths bend between slow frames. Only contacts that are seen not to be at
/// 2R tell anything.
fn finer_unit(films: &[TrackShot], first: f64, scene: &Scene) -> f64 {
    const ROUNDS: usize = 3;
    /// Of the shots: fewer that are not at 2R are those that something else is wrong with.
    const FEW: f64 = 0.2;
    let mut unit = first;
    for _ in 0..ROUNDS {
        let shots: Vec<TrackShot> = films.iter().map(|film| in_metres(film, unit)).collect();
        let off = extract_all(&shots, scene, &|| ()).into_iter().filter_map(|impact| match impact {
            Err(Unusable::Separation { measured, expected, .. }) => Some(expected / measured),
            _ => None,
        });
        let mut ratios: Vec<f64> = off.filter(|ratio| ratio.is_finite() && *ratio > 0.0).collect();
        if ratios.len() as f64 <= FEW * films.len() as f64 {
            break;
        }
        ratios.sort_by(f64::total_cmp);
        unit *= ratios[ratios.len() / 2];
    }
    unit
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
    /// How many shots the last joint fit used, and its χ²/dof.
    used: usize,
    misfit: f64,
}

/// What a joint fit says is left to correct, in the order of the free corrections.
struct Left {
    values: DVector<f64>,
    covariance: DMatrix<f64>,
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
        let mut apart: Vec<f64> = seen.iter().map(|[a, b]| (b[0] - a[0]).hypot(b[1] - a[1])).collect();
        apart.sort_by(f64::total_cmp);
        let ratio = scene.contact_distance() / apart[apart.len() / 2];
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
            misfit: f64::INFINITY,
        })
    }

    /// The camera from the first start that leads to a good one, or else to the best. With few contacts these may lead far astray, and so
    /// they may in slow films, of which lines see them badly; and as long as the camera is far off, shots whose balls seem not to touch at
    /// 2R belong to the search.
    fn best(self, is_same: bool) -> Option<(FoundCamera, f64, Option<Scene>)> {
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
            if is_good {
                break;
            }
        }
        let (search, found) = best?;
        let (search, found) = search.with_rows_that_agree(found);
        Some((found, search.unit, search.scene))
    }

    /// Where perspective tells rows of the picture from rows of the table, and a shutter rolls, those that agree better.
    fn with_rows_that_agree(self, found: FoundCamera) -> (Self, FoundCamera) {
        let rolls = found.adopted().any(Correction::is_of_time);
        let looks_askew =
            found.adopted().any(|which| matches!(which, Correction::PerspectiveX | Correction::PerspectiveY));
        if !(rolls && looks_askew) {
            return (self, found);
        }
        let mut other = self.clone();
        other.camera.rows = Rows::Table;
        match other.found() {
            Some(of_other) if other.is_better(&of_other, (&self, &found)) => (other, of_other),
            _ => (self, found),
        }
    }

    /// Whether nearly all shots agree on a camera.
    fn is_good(&self, found: &FoundCamera) -> bool {
        /// Of the shots: more are seldom wrong.
        const NEARLY_ALL: f64 = 0.8;
        /// χ²/dof of what may be wrong with balls and shots.
        const FAIR: f64 = 3.0;
        let agree = self.used as f64 >= NEARLY_ALL * self.contacts.len() as f64 && self.misfit < FAIR;
        found.converged && (agree || found.corrections.is_empty())
    }

    /// Than another one: by rest, then by how many shots agree, then by how well they do.
    fn is_better(&self, found: &FoundCamera, (other, of_other): (&Self, &FoundCamera)) -> bool {
        let rank = |search: &Self, found: &FoundCamera| (found.converged, search.used);
        match rank(self, found).cmp(&rank(other, of_other)) {
            std::cmp::Ordering::Equal => self.misfit < other.misfit,
            order => order.is_gt(),
        }
    }

    /// What the frames of the films as the camera corrects them say is left.
    fn left(&mut self, free: &[Correction]) -> Option<Left> {
        let shots: Vec<TrackShot> = self.films.iter().map(|film| self.camera.shot(film)).collect();
        let scene = match self.scene {
            Some(scene) => scene,
            None => {
                let side_sd = self.dataset.side_sd;
                let gap_sd = self.gap_sd;
                let scene = Scene { side_sd, gap_sd, ..Scene::of(&self.dataset.model(Fidelity::Full)) };
                footage::learned(self.dataset, &shots, &scene).0
            }
        };
        let (dataset, films) = footage::filmed_with(self.dataset, &shots, (scene, &self.camera));
        if 2 * dataset.shots.len() < self.films.len() {
            return None;
        }
        let mut film = FilmUnknowns::default();
        for which in free {
            film.corrections[*which as usize] = Some(which.neutral() - self.camera.get(*which));
        }
        let mut model = dataset.model_of_contact();
        if let LiftPrior::Model(of_lift, ..) = scene.lift {
            model.law = of_lift.law;
        }
        let initial = footage::near(&scene).unwrap_or_else(|| Values::usual(&dataset.settings));
        let all: Vec<&Shot> = dataset.shots.iter().collect();
        let (fitted, _) = model_choice::plan(&all, &model, &initial);
        let fitted = filmed(&fitted, &films)?;
        let known = (&model, &dataset.settings, initial);
        let sample = Sample {
            shared_errors: Vec::new(),
            unknowns: shared_unknowns::of_fit(film.unknowns()),
            loss: Loss::Squares,
            ..Sample::of(&dataset, &fitted, known)
        };
        let mut settled =
            Settled::from_starts(&samples::Search::of(sample.clone()), &[vec![initial]]).ok()?;
        // shots that fit no collision tell nothing of the camera
        let odd = outlying(&fitted, settled.minimum.residuals.as_slice());
        let others: Vec<_> = (0..fitted.len())
            .filter(|i| odd.iter().all(|odd| odd.place != *i))
            .map(|i| fitted[i].clone())
            .collect();
        if !odd.is_empty() {
            let start = settled.minimum.values.clone();
            settled =
                Settled::from_starts(&samples::Search::of(Sample { fitted: &others, ..sample }), &[start])
                    .ok()?;
        }
        (self.used, self.misfit) = (fitted.len() - odd.len(), settled.scale());
        let minimum = &settled.minimum;
        let covariance = minimum.covariance()?;
        // the noise may be stated too small, or what the camera does not explain be large
        let scale = settled.scale();
        let first = minimum.x.len() - free.len();
        let values = minimum.x.rows(first, free.len()).into_owned();
        let covariance = covariance.view((first, first), (free.len(), free.len())) * scale;
        // the lift of the next round is that of these coefficients
        let values_there = minimum.first();
        if let (LiftPrior::Model(model, _, sd), true) = (scene.lift, values_there.coefficients.mu > 0.0) {
            let lift = LiftPrior::Model(values_there.model(&model), values_there.coefficients, sd);
            self.scene = Some(Scene { lift, ..scene });
        }
        (values.iter().chain(covariance.iter()).all(|v| v.is_finite())).then_some(Left { values, covariance })
    }

    /// Corrects until nothing is left; the last covariance, and whether nothing is.
    fn converge(&mut self, free: &[Correction]) -> Option<(DMatrix<f64>, bool)> {
        let mut last = None;
        for _ in 0..ROUNDS {
            let Some(Left { values, covariance }) = self.left(free) else { break };
            for (which, by) in free.iter().zip(values.iter()) {
                self.camera = self.camera.with(*which, self.camera.get(*which) + by);
            }
            let rests = (0..free.len()).all(|i| {
                values[i].abs() < (AT_REST * covariance[(i, i)].sqrt()).max(SMALL * free[i].usual())
            });
            last = Some((covariance, rests));
            if rests {
                break;
            }
        }
        last
    }

    fn found(&mut self) -> Option<FoundCamera> {
        let all = self.free.clone();
        if all.is_empty() {
            let needs = self.unit != 1.0 || !self.camera.is_neutral();
            return needs.then(|| self.as_found(Vec::new(), true));
        }
        let Some((covariance, mut converged)) = self.converge(&all) else {
            // a film without a unit still has that of its balls
            return (self.unit != 1.0).then(|| self.as_found(Vec::new(), false));
        };
        let mut corrections: Vec<FoundCorrection> = all
            .iter()
            .enumerate()
            .map(|(i, which)| FoundCorrection {
                which: *which,
                value: self.camera.get(*which),
                std_error: covariance[(i, i)].sqrt(),
                adopted: false,
            })
            .collect();
        let adopted = self.called_for(&all, covariance);
        for (which, found) in all.iter().zip(&mut corrections) {
            found.adopted = adopted.contains(which);
            if !found.adopted {
                self.camera = self.camera.with(*which, which.neutral());
            }
        }
        if !adopted.is_empty() {
            let Some((covariance, rests)) = self.converge(&adopted) else {
                return Some(self.as_found(corrections, false));
            };
            converged = rests;
            for (i, which) in adopted.iter().enumerate() {
                if let Some(found) = corrections.iter_mut().find(|found| found.which == *which) {
                    (found.value, found.std_error) = (self.camera.get(*which), covariance[(i, i)].sqrt());
                }
            }
        }
        Some(self.as_found(corrections, converged))
    }

    /// The corrections without which −2 log L would be higher by as much as calls for them, one after the other left out; the camera
    /// goes where the others are then best.
    fn called_for(&mut self, all: &[Correction], mut covariance: DMatrix<f64>) -> Vec<Correction> {
        let mut kept: Vec<Correction> = all.to_vec();
        loop {
            let off = |which: &Correction| self.camera.get(*which) - which.neutral();
            // −2 log L rises by z² where a correction is left out
            let z2 = |i: usize, which: &Correction| off(which).powi(2) / covariance[(i, i)];
            // a scale that the balls gave is always needed
            let gave = self.from_balls || self.unit != 1.0;
            let needed = |which: &Correction| gave && *which == Correction::Scale;
            let least = kept.iter().enumerate().filter(|(_, which)| !needed(which));
            let least = least.map(|(i, which)| (i, z2(i, which))).min_by(|a, b| a.1.total_cmp(&b.1));
            let Some((out, _)) = least.filter(|(_, z2)| *z2 < CALLED_FOR) else { return kept };
            let by = off(&kept[out]) / covariance[(out, out)];
            for (i, which) in kept.iter().enumerate() {
                self.camera = self.camera.with(*which, self.camera.get(*which) - covariance[(i, out)] * by);
            }
            let column = covariance.column(out).into_owned();
            let rest = &covariance - &column * column.transpose() / column[out];
            covariance = rest.remove_row(out).remove_column(out);
            kept.remove(out);
        }
    }

    fn as_found(&self, mut corrections: Vec<FoundCorrection>, converged: bool) -> FoundCamera {
        for found in &mut corrections {
            if found.which == Correction::Scale {
                // film over table: of lengths in the film's own unit
                found.value /= self.unit;
                found.std_error /= self.unit;
            }
        }
        let (camera, unit, shots) = (self.camera, self.unit, self.contacts.len());
        let contacts = self.contacts.iter().map(|[a, b]| [0, 1].map(|i| 0.5 * (a[i] + b[i]))).collect();
        FoundCamera { camera, corrections, unit, shots, contacts, converged, ..FoundCamera::as_it_is() }
    }
}
