//! The camera of discs, found without any model of their collision: points on one disc keep their distances, centres move straight on, and
//! at the impacts they are as far apart as the discs touch.
//!
//! Residuals of all three are made small by least squares with the usual priors, one camera after the other until nothing is left. The
//! noise is that of each shot, but no camera does what real discs do besides: shots that tell different corrections than others, by
//! more than their noise, make all errors so much larger.
//!
//! How far the camera may be off, in all that is free whether the shots call for it or not, is part of the errors of all that is measured
//! of the impacts, and all shots share it ([`Calibrated`]).

mod paths;
mod rigid;
mod sums;

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use self::paths::Contact;
use self::sums::{COLUMNS, Sums};
use super::adopted::{Calibrates, Left};
use crate::extraction::disc::{DiscImpact, Quantity};
use crate::extraction::{Unusable, disc};
use crate::film::camera::Camera;
use crate::film::discs::{Calibrated, DISCS, is_of_points};
use crate::film::frame_noise::constant_axis;
use crate::fit::camera::LEAST_SHOTS;
use crate::fit::camera::{FoundCamera, FoundCorrection};
use crate::measurement::correction::Correction;
use crate::measurement::dataset::Tracks;
use crate::measurement::track::TrackShot;
use crate::numerics::{median, robust_scale};
use crate::physics::disc::Discs;

/// Stated radii are known to this part, rubber bands and the give of rims included: a scale that is wrong by less is not seen.
const RADII_PART: f64 = 0.005;

/// Contacts that are fewer than so many more than what they are to tell say nothing of how they scatter, which is then taken to be as
/// well known as radii are.
const SPARE: usize = 2;

/// A shot is left out where what it says differs by this many times more than usual.
const ODD: f64 = 10.0;

/// Normal deviates from which on Huber's loss is linear.
const HUBER: f64 = 1.345;

/// A distance that nothing is known of: to a hundred times itself.
const FLAT: f64 = 1e-4;

/// −2 log L must fall by this much with a correction, twice as much as of balls: how much the shots differ, which the errors rest on, is
/// known from no more of them than there are.
const CALLED_FOR: f64 = 2.0 * super::CALLED_FOR;

/// The search for the camera of discs.
pub(super) struct Search<'a> {
    films: &'a [TrackShot],
    discs: Discs,
    /// Of each disc of each shot, whether its centre was computed from points on it.
    of_points: Vec<[bool; 2]>,
    camera: Camera,
    free: Vec<Correction>,
    /// Where the centres are at the impacts, in the films.
    contacts: Vec<[f64; 2]>,
}

/// What one shot tells.
struct Told {
    sums: Sums,
    contact: Option<Contact>,
}

impl<'a> Search<'a> {
    /// `None` where there is nothing to correct: too few shots, and nothing is stated.
    pub(super) fn new(tracks: &'a Tracks, discs: Discs) -> Option<Self> {
        let films = &tracks.shots;
        let of_points: Vec<[bool; 2]> =
            films.par_iter().map(|film| DISCS.map(|disc| is_of_points(film, disc))).collect();
        let impacts = impacts(films, discs);
        let middle = |impact: &DiscImpact| {
            let time = impact.get(Quantity::Time)?.value;
            let [a, b] = [0, 1].map(|disc| impact.place(disc, time));
            Some([0, 1].map(|k| 0.5 * (a[k] + b[k])))
        };
        let contacts: Vec<[f64; 2]> = impacts.iter().flatten().filter_map(middle).collect();
        let count = contacts.len().max(1) as f64;
        let mut camera =
            Camera::neutral([0, 1].map(|k| contacts.iter().map(|at| at[k]).sum::<f64>() / count));
        let mut free = Vec::new();
        // one coordinate does not show how the other was filmed
        let is_one_dimensional = films.iter().any(|film| constant_axis(film).is_some());
        for (which, stated) in Correction::ALL.into_iter().zip(tracks.camera) {
            let is_told = match which {
                _ if is_one_dimensional => false,
                Correction::Scale => discs.radii.is_some(),
                // a delay means nothing without a unit of time
                Correction::ShutterX | Correction::ShutterY => discs.in_seconds,
                // discs do not hop
                _ if which.is_of_height() => false,
                _ => true,
            };
            match stated {
                Some(value) => camera = camera.with(which, value),
                None if is_told && contacts.len() >= LEAST_SHOTS => free.push(which),
                None => {}
            }
        }
        let needed = !free.is_empty() || !camera.is_neutral();
        needed.then_some(Self { films, discs, of_points, camera, free, contacts })
    }

    /// The camera, and the shots on the table.
    pub(super) fn best(mut self) -> (FoundCamera, Vec<TrackShot>) {
        let (free, stated) = (self.free.clone(), self.camera);
        let found = if free.is_empty() { None } else { self.adopted(&free) };
        if found.is_none() {
            self.camera = stated;
        }
        let mut found = found.unwrap_or_else(|| self.as_found(Vec::new(), free.is_empty()));
        found.calibrated = self.calibrated(&free);
        let shots = self.shots();
        (found, shots)
    }

    /// How far the camera may be off: the columns of a root of the covariance, L Lᵀ.
    fn calibrated(&mut self, free: &[Correction]) -> Option<Calibrated> {
        let Left { covariance, .. } = if free.is_empty() { None } else { self.left(free) }?;
        let root = covariance.cholesky()?.l();
        let way = |k: usize| {
            let mut way = [0.0; Correction::COUNT];
            free.iter().enumerate().for_each(|(i, which)| way[*which as usize] = root[(i, k)]);
            way
        };
        Some(Calibrated { camera: self.camera, ways: (0..free.len()).map(way).collect() })
    }

    /// The films as the camera corrects them.
    fn shots(&self) -> Vec<TrackShot> {
        let films = self.films.par_iter().zip(&self.of_points);
        films.map(|(film, of_points)| self.camera.discs(film, *of_points)).collect()
    }

    /// What every shot tells that shows an impact.
    fn told(&self) -> Vec<Told> {
        let shots = self.shots();
        let impacts = impacts(&shots, self.discs);
        let told = |((shot, of_points), impact): ((&TrackShot, &[bool; 2]), &Result<DiscImpact, _>)| {
            let impact = impact.as_ref().ok()?;
            let time = impact.get(Quantity::Time)?.value;
            // beyond the window in which the paths are straight, there may be a hand or a rail
            let mut sums = rigid::rigid(shot, &self.camera, *of_points, impact.window);
            let (of_paths, contact) = match impact.stuck {
                None => paths::paths(shot, &self.camera, time, impact.window),
                Some(_) => (Sums::zero(), None),
            };
            sums.add_all(&of_paths);
            Some(Told { sums, contact })
        };
        shots.par_iter().zip(&self.of_points).zip(&impacts).filter_map(told).collect()
    }

    /// The sums of the contacts: each is as far from the stated distance as the others, or without radii from the usual one.
    fn contacts(&self, told: &[Told], unknowns: usize) -> Vec<Option<Sums>> {
        let contacts: Vec<&Contact> = told.iter().filter_map(|told| told.contact.as_ref()).collect();
        let n = contacts.len();
        let usual = median(contacts.iter().map(|contact| contact.distance).collect());
        let stated = self.discs.radii.map_or(usual, |[first, second]| first + second);
        let off = robust_scale(contacts.iter().map(|contact| contact.distance - usual));
        let scatter = match n.checked_sub(unknowns) {
            Some(spare) if spare >= SPARE => off * off * n as f64 / spare as f64,
            _ => (RADII_PART * stated).powi(2),
        };
        let of = |told: &Told| {
            let contact = told.contact.as_ref()?;
            let mut by = contact.by;
            by[COLUMNS - 1] = -stated;
            let mut sums = Sums::zero();
            let residual = contact.distance - stated;
            let variance = contact.variance.max(scatter);
            // a contact that is far off counts less
            let huber = (HUBER * variance.sqrt() / (contact.distance - usual).abs()).min(1.0);
            sums.add(&by, residual, huber / variance);
            Some(sums)
        };
        told.iter().map(of).collect()
    }
}

impl Calibrates for Search<'_> {
    fn left(&mut self, free: &[Correction]) -> Option<Left> {
        let told = self.told();
        let of_contacts = self.contacts(&told, free.len());
        let mut shots: Vec<Sums> = told.into_iter().map(|told| told.sums).collect();
        for (sums, contact) in shots.iter_mut().zip(&of_contacts) {
            if let Some(contact) = contact {
                sums.add_all(contact);
            }
        }
        let radii = if self.discs.radii.is_some() { RADII_PART.powi(-2) } else { FLAT };
        let places: Vec<usize> = free.iter().map(|which| *which as usize).chain([COLUMNS - 1]).collect();
        let mut prior = DMatrix::zeros(places.len(), places.len());
        let mut towards = DVector::zeros(places.len());
        for (i, which) in free.iter().enumerate() {
            prior[(i, i)] = which.usual().powi(-2);
            towards[i] = prior[(i, i)] * (which.neutral() - self.camera.get(*which));
        }
        prior[(free.len(), free.len())] = radii;
        let own: Vec<(DMatrix<f64>, DVector<f64>)> = shots
            .iter()
            .map(|sums| {
                let n = places.len();
                let normal = DMatrix::from_fn(n, n, |i, j| sums.normal[(places[i], places[j])]);
                (normal, DVector::from_fn(n, |i, _| sums.right[places[i]]))
            })
            .collect();
        let agreed = agreed(own, &prior, &towards)?;
        let n = free.len();
        let values = agreed.values.rows(0, n).into_owned();
        let covariance = agreed.covariance.view((0, 0), (n, n)).into_owned();
        (values.iter().chain(covariance.iter()).all(|v| v.is_finite())).then_some(Left { values, covariance })
    }

    fn camera(&mut self) -> &mut Camera {
        &mut self.camera
    }

    fn needs(&self, _: Correction) -> bool {
        false
    }

    fn called_for(&self) -> f64 {
        CALLED_FOR
    }

    fn as_found(&self, corrections: Vec<FoundCorrection>, converged: bool) -> FoundCamera {
        let contacts = self.contacts.clone();
        FoundCamera {
            camera: self.camera,
            corrections,
            shots: contacts.len(),
            contacts,
            converged,
            of_discs: true,
            ..FoundCamera::as_it_is()
        }
    }
}

/// The step that all shots agree about, with an error that includes how far they do not.
fn agreed(
    mut shots: Vec<(DMatrix<f64>, DVector<f64>)>,
    prior: &DMatrix<f64>,
    towards: &DVector<f64>,
) -> Option<Left> {
    let step = |shots: &[(DMatrix<f64>, DVector<f64>)], less: f64| -> Option<(DVector<f64>, DMatrix<f64>)> {
        let (mut normal, mut right) = (prior.clone(), towards.clone());
        for (own, side) in shots {
            normal += own / less;
            right += side / less;
        }
        let covariance = normal.cholesky()?.inverse();
        Some((&covariance * right, covariance))
    };
    let (mut values, _) = step(&shots, 1.0)?;
    // by how much a shot speaks against what all say, of that which its noise explains
    let against = |shots: &[(DMatrix<f64>, DVector<f64>)], values: &DVector<f64>| -> Option<Vec<[f64; 2]>> {
        let of = |(normal, right): &(DMatrix<f64>, DVector<f64>)| {
            let left = right - normal * values;
            let inverse = (normal + prior).cholesky()?.inverse();
            Some([left.dot(&(&inverse * &left)), (&inverse * normal).trace()])
        };
        shots.iter().map(of).collect()
    };
    let found = against(&shots, &values)?;
    let ratio = |[square, count]: &[f64; 2]| if *count > 0.0 { square / count } else { 0.0 };
    let usual = median(found.iter().map(ratio).collect()).max(1.0);
    let mut of_shot = found.iter();
    let all = shots.len();
    let mut kept = shots.clone();
    kept.retain(|_| of_shot.next().is_some_and(|own| ratio(own) <= ODD * usual));
    if kept.len() < all && 4 * (all - kept.len()) <= all {
        shots = kept;
        (values, _) = step(&shots, 1.0)?;
    }
    if shots.len() < LEAST_SHOTS {
        return None;
    }
    let found = against(&shots, &values)?;
    let [square, count] = found.iter().fold([0.0; 2], |sum, own| [sum[0] + own[0], sum[1] + own[1]]);
    let (_, covariance) = step(&shots, 1.0)?;
    let used = prior.nrows() as f64 - (&covariance * prior).trace();
    let less = (square / (count - used).max(1.0)).max(1.0);
    let (values, covariance) = step(&shots, less)?;
    // and no correction is surer than shots that each have their own say
    let mut scores = DMatrix::zeros(prior.nrows(), prior.nrows());
    for (normal, right) in &shots {
        let left = (right - normal * &values) / less;
        scores += &left * left.transpose();
    }
    let n = shots.len() as f64;
    let by_shots = &covariance * scores * &covariance * (n / (n - 1.0));
    let wider: Vec<f64> =
        (0..prior.nrows()).map(|k| (by_shots[(k, k)] / covariance[(k, k)]).max(1.0).sqrt()).collect();
    let covariance =
        DMatrix::from_fn(prior.nrows(), prior.nrows(), |i, j| covariance[(i, j)] * wider[i] * wider[j]);
    Some(Left { values, covariance })
}

/// The impacts of the centres. As long as the camera is not known, points on a disc may not look rigid, nor discs touch at the sum of their
/// radii.
fn impacts(shots: &[TrackShot], discs: Discs) -> Vec<Result<DiscImpact, Unusable>> {
    let centres: Vec<TrackShot> =
        shots.iter().map(|shot| TrackShot { markers: Vec::new(), ..shot.clone() }).collect();
    disc::extract_each(&centres, &Discs { radii: None, ..discs }, None)
}
