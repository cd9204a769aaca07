//! From films as they are to positions on the table: dropped frames, noise that lasts, and the search for the camera.
//!
//! The search begins at the distances of the centres at the contacts, which tell scale, aspect, shear and perspective. From there the
//! frames of all shots are fitted jointly with every [`Correction`] free, the films corrected by what was found, and again until nothing
//! is left to correct. What the frames do not call for is then left out.

use nalgebra::{DMatrix, DVector};

use super::camera::{FoundCamera, FoundCorrection};
use super::footage;
use super::frames::filmed;
use super::outlying::outlying;
use super::settled::Settled;
use super::{FilmUnknowns, model_choice, samples};
use crate::extraction::{Unusable, contact, extract_all, noise_correlation, repair_drops_at_impacts};
use crate::film::camera::{Camera, Correction};
use crate::film::drops;
use crate::likelihood::frames::shared_unknowns;
use crate::likelihood::sample::Sample;
use crate::measurement::dataset::{Dataset, Shot, Tracks};
use crate::measurement::loss::Loss;
use crate::measurement::track::TrackShot;
use crate::measurement::values::Values;
use crate::physics::collision::Fidelity;
use crate::trajectory::scene::{LiftPrior, Scene};

/// Of fewer shots the camera is taken as stated.
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
    let found = search.and_then(|search| {
        let from = |mut search: Search| Some((search.found()?, search.unit, search.scene));
        let mut started = search.clone();
        if same.is_none() {
            started.start();
        }
        let first = from(started);
        // lines see the contacts of slow films so badly that what they say of the camera may lead astray
        if first.as_ref().is_some_and(|(found, ..)| found.converged) { first } else { from(search).or(first) }
    });
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
        // one that is known to be the same is looked for where it was found
        let mut camera = same.map_or(Camera::neutral(middle), |same| same.camera);
        let mut free = Vec::new();
        for (which, stated) in Correction::ALL.into_iter().zip(tracks.camera) {
            match stated {
                Some(value) => camera = camera.with(which, value),
                None if seen.len() >= LEAST_SHOTS => free.push(which),
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
        })
    }

    /// Distances of the centres at the contacts over 2R, less 1.
    fn gaps(&self, camera: &Camera) -> DVector<f64> {
        let gap = |[cue, object]: &[[f64; 2]; 2]| {
            let [a, b] = [camera.table(*cue), camera.table(*object)];
            (b[0] - a[0]).hypot(b[1] - a[1]) / (2.0 * self.radius) - 1.0
        };
        DVector::from_iterator(self.contacts.len(), self.contacts.iter().map(gap))
    }

    /// Puts scale, aspect, shear and perspective where the contacts are 2R apart, by least squares of Huber's loss.
    fn start(&mut self) {
        let lens_or_shutter = [Correction::Lens, Correction::Shutter];
        let free: Vec<Correction> =
            self.free.iter().copied().filter(|which| !lens_or_shutter.contains(which)).collect();
        if free.is_empty() || self.contacts.len() < LEAST_SHOTS {
            return;
        }
        let Some((camera, error)) = self.at_contacts(self.camera, &free) else { return };
        let cost =
            |camera: &Camera| self.gaps(camera).iter().map(|gap| (gap / error).powi(2).min(9.0)).sum::<f64>();
        // as much as so many numbers fit by chance, and more
        if cost(&self.camera) - cost(&camera) > 2.0 * CALLED_FOR + free.len() as f64 {
            self.camera = camera;
        }
    }

    /// The camera with which the contacts are 2R apart, from another one; and how far they usually miss that, over 2R.
    fn at_contacts(&self, mut camera: Camera, free: &[Correction]) -> Option<(Camera, f64)> {
        const STEPS: usize = 30;
        /// No contact is seen better than to this part of 2R between two frames.
        const LEAST_ERROR: f64 = 1e-3;
        const HUBER: f64 = 1.345;
        /// What is usual of a camera holds back no start: few contacts that are far from 2R yet would not move it from there.
        const WIDER: f64 = 10.0;
        let usual = |gaps: &DVector<f64>| {
            let mut sizes: Vec<f64> = gaps.iter().map(|gap| gap.abs()).collect();
            sizes.sort_by(f64::total_cmp);
            sizes[sizes.len() / 2] / 0.6745
        };
        for _ in 0..STEPS {
            let gaps = self.gaps(&camera);
            let error = usual(&gaps).max(LEAST_ERROR);
            let weight = |gap: f64| (HUBER * error / gap.abs()).min(1.0) / (error * error);
            let mut normal = DMatrix::<f64>::zeros(free.len(), free.len());
            let mut gradient = DVector::<f64>::zeros(free.len());
            let by: Vec<DVector<f64>> = free
                .iter()
                .map(|which| {
                    let step = 1e-4 * which.usual();
                    let up = self.gaps(&camera.with(*which, camera.get(*which) + step));
                    (up - &gaps) / step
                })
                .collect();
            for i in 0..free.len() {
                let sum = |f: &dyn Fn(usize) -> f64| (0..gaps.len()).map(f).sum::<f64>();
                for j in 0..free.len() {
                    normal[(i, j)] = sum(&|n| weight(gaps[n]) * by[i][n] * by[j][n]);
                }
                let off = camera.get(free[i]) - free[i].neutral();
                let prior = (WIDER * free[i].usual()).powi(-2);
                normal[(i, i)] += prior;
                gradient[i] = sum(&|n| weight(gaps[n]) * by[i][n] * gaps[n]) + prior * off;
            }
            let step = normal.cholesky()?.solve(&gradient);
            if !step.iter().all(|s| s.is_finite()) {
                return None;
            }
            for (which, step) in free.iter().zip(step.iter()) {
                camera = camera.with(*which, camera.get(*which) - step);
            }
            if step.iter().zip(free).all(|(step, which)| step.abs() < 1e-6 * which.usual()) {
                break;
            }
        }
        let error = usual(&self.gaps(&camera));
        error.is_finite().then_some((camera, error.max(LEAST_ERROR)))
    }

    /// What the frames of the films as the camera corrects them say is left.
    fn left(&mut self, free: &[Correction]) -> Option<Left> {
        let shots: Vec<TrackShot> = self.films.iter().map(|film| self.camera.shot(film)).collect();
        let scene = match self.scene {
            Some(scene) => scene,
            None => {
                let side_sd = self.dataset.side_sd;
                let scene = Scene { side_sd, ..Scene::of(&self.dataset.model(Fidelity::Full)) };
                footage::learned(self.dataset, &shots, &scene).0
            }
        };
        let (dataset, films) = footage::filmed_with(self.dataset, &shots, (scene, &self.camera));
        if dataset.shots.len() < LEAST_SHOTS {
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
        if all.is_empty() || self.films.len() < LEAST_SHOTS {
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
