//! From the tracks of a data set to the block of its frames: in metres from the middle of the impacts,
//! with first guesses.

use rayon::prelude::*;

use super::block::{ANY, DiscBlock};
use super::frames::{NOISES, PointTrack, ShotFrames, TOUCHING};
use super::lines::{Line, Meeting};
use super::own::{self, CORE};
use super::points::{DISCS, Turning, centre, check_rigidity, is_of_points, points};
use super::priors::list_unknowns;
use super::stick::{self, Stuck};
use crate::extraction::Unusable;
use crate::film::{drops, frame_noise};
use crate::measurement::dataset::Dataset;
use crate::measurement::spin::Spin;
use crate::measurement::track::{Sample, TrackShot};
use crate::numerics::median;
use crate::physics::disc::Discs;
use crate::problem::film::camera::Point;
use crate::problem::film::film_data::FilmError;
use crate::problem::film::reading::Reading;
use crate::problem::findings::Finding;
use crate::problem::sums::{Noise, OwnPrior};
use crate::problem::unknowns::{Id, Normal, Own, Shared, Unknown};

/// A distance of the centres of which nothing is known, m.
const ANY_DISTANCE: Normal = Normal { mean: 0.0, sd: 1e3 };

/// Noise of the first descents, as a part of the distance of the centres: lines through the frames next
/// to an impact miss the discs by as much.
const COARSE: f64 = 0.01;

/// Standard error of a parabola through 15 frames at twice their reach, over the noise of a frame:
/// √(1 + 3x² + 5(3x² − 1)²/4)/√15 at x = 3.
const EXTRAPOLATED: f64 = 7.6;

/// A film of discs as a block, with its shared unknowns and first guesses.
pub(crate) struct DiscFilm {
    pub block: DiscBlock,
    pub unknowns: Vec<Unknown>,
    /// First guesses.
    pub own: Vec<Own>,
    /// Names and reasons of the shots that are not in the block.
    pub left_out: Vec<(String, String)>,
    /// What was repaired.
    pub findings: Vec<Finding>,
    /// Metres in a unit of length of the film.
    pub unit: f64,
    /// Middle of the impacts in the film, in its unit.
    pub middle: Point,
}

/// A shot that can be fitted.
struct Guessed {
    shot: TrackShot,
    meeting: Meeting,
    stuck: Option<Stuck>,
}

impl DiscFilm {
    /// Returns the block of a data set's films.
    ///
    /// # Errors
    /// See [`FilmError`].
    pub fn new(dataset: &Dataset) -> Result<Self, FilmError> {
        let tracks = dataset.tracks.as_ref().filter(|tracks| !tracks.shots.is_empty());
        let tracks = tracks.ok_or(FilmError::NoFilm)?;
        let discs = tracks.discs.ok_or(FilmError::NoFilm)?;
        let mut shots = tracks.shots.clone();
        // each disc has its own noise, which is estimated
        for shot in &mut shots {
            shot.position_sd = None;
        }
        let drops: Vec<usize> = shots.par_iter_mut().map(drops::repair).filter(|count| *count > 0).collect();
        let dropped = Finding::Drops { shots: drops.len(), drops: drops.iter().sum() };
        let guess = |shot: TrackShot| -> Result<Guessed, (String, Unusable)> {
            let stuck = stick::find(&shot);
            let meeting = meeting(&shot, stuck.as_ref());
            // points that are not on one disc explain whatever else is wrong
            let rigid = check_rigidity(&shot, meeting.as_ref().ok().map(|meeting| meeting.time));
            match rigid.and(meeting) {
                Ok(meeting) => Ok(Guessed { shot, meeting, stuck }),
                Err(why) => Err((shot.name, why)),
            }
        };
        let mut guessed = Vec::new();
        let mut left_out = tracks.left_out.clone();
        for guess in shots.into_par_iter().map(guess).collect::<Vec<_>>() {
            match guess {
                Ok(guess) => guessed.push(guess),
                Err((name, why)) => left_out.push((name, why.to_string())),
            }
        }
        if guessed.is_empty() {
            return Err(FilmError::NoImpact(left_out));
        }
        let middle_of = |axis: usize| median(guessed.iter().map(|g| g.meeting.places[0][axis]).collect());
        let middle = Point::new(middle_of(0), middle_of(1));
        let distance = median(guessed.iter().map(|guessed| guessed.meeting.distance()).collect());
        let stated = discs.radii.map(|[first, second]| first + second);
        let unit = stated.filter(|_| tracks.from_balls).map_or(1.0, |stated| stated / distance);
        let mass_ratio = median(guessed.iter().map(|guessed| guessed.meeting.mass_ratio()).collect());
        let is_flat = guessed.iter().any(|guessed| frame_noise::constant_axis(&guessed.shot).is_some());
        let means = [unit * distance, mass_ratio];
        let unknowns = list_unknowns(dataset, tracks, &discs, means, (guessed.len(), is_flat));
        let shared = Shared::starts(&unknowns);
        let (shots, mut own): (Vec<ShotFrames>, Vec<Own>) =
            guessed.iter().map(|guessed| frames_of(guessed, &discs, (middle, unit), &shared)).unzip();
        let noise = |Guessed { shot, meeting, .. }: &Guessed| {
            let sd = frame_noise::noise_near(shot, meeting.time);
            let sd = unit * (COARSE * meeting.distance()).max(EXTRAPOLATED * sd);
            [Noise { sd, rho: shot.correlation }; NOISES]
        };
        let block = DiscBlock::new(shots, discs, guessed.iter().flat_map(noise).collect());
        for (i, own) in own.iter_mut().enumerate() {
            let outcome = [own[own::RESTITUTION], own[own::RATIO]];
            block.set_outcome(i, own, &shared, outcome);
        }
        let findings = if drops.is_empty() { Vec::new() } else { vec![dropped] };
        Ok(Self { block, unknowns, own, left_out, findings, unit, middle })
    }
}

/// Returns where the discs of a shot meet. Those that stick together have no paths of their own after it.
fn meeting(shot: &TrackShot, stuck: Option<&Stuck>) -> Result<Meeting, Unusable> {
    let Some(Stuck { settling: [time, _], .. }) = stuck else { return Meeting::find(shot) };
    let lines = [&shot.cue, &shot.object].map(|samples| Line::beside(samples, *time, shot.fps.recip()));
    let line = |disc: usize, side: usize| lines[disc][side].unwrap_or_default();
    Ok(Meeting {
        time: *time,
        places: [0, 1].map(|disc| line(disc, 0).position),
        velocities: [0, 1].map(|disc| [line(disc, 0).velocity, line(disc, 1).velocity]),
    })
}

/// Returns the frames of a shot and a first guess of its own unknowns.
fn frames_of(
    guessed: &Guessed,
    discs: &Discs,
    (middle, unit): (Point, f64),
    shared: &Shared,
) -> (ShotFrames, Own) {
    let Guessed { shot, meeting, stuck } = guessed;
    let flat = frame_noise::constant_axis(shot);
    let mut marks = Vec::new();
    let mut tracks = Vec::new();
    let mut spins = [[0.0; 2]; 2];
    let mut turns = [false; 2];
    for (disc, which) in DISCS.into_iter().enumerate() {
        let own = if flat.is_some() { Vec::new() } else { points(shot, which) };
        let turnings =
            own.iter().map(|marker| Turning::of(marker, centre(shot, which), meeting.time, shot.fps));
        let seen: Vec<(&[Sample], Turning)> =
            own.iter().copied().zip(turnings).filter_map(|(own, turning)| Some((own, turning?))).collect();
        let is_circle = is_of_points(shot, which);
        if !is_circle || seen.is_empty() {
            tracks.push((disc, None, centre(shot, which)));
        }
        let first = CORE + marks.len();
        for (i, (marker, _)) in seen.iter().enumerate() {
            let radius = if is_circle { first + seen.len() } else { first + seen.len() + i };
            tracks.push((disc, Some([first + i, radius]), marker));
        }
        turns[disc] = !seen.is_empty();
        if turns[disc] {
            spins[disc] =
                [0, 1].map(|side| median(seen.iter().map(|(_, turning)| turning.rates[side]).collect()));
            marks.extend(seen.iter().map(|(_, turning)| turning.direction));
            let radii: Vec<f64> = seen.iter().map(|(_, turning)| unit * turning.radius).collect();
            if is_circle { marks.push(median(radii)) } else { marks.extend(radii) }
        }
    }
    let reading = Reading { middle, unit, states_noise: false, may_be_held: false };
    let track_of = |(disc, marker, samples): &(usize, Option<[usize; 2]>, &[Sample])| {
        let mut frames = reading.frames(shot, samples, shot.resolution[*disc]);
        frames.retain(|frame| frame.used);
        if let Some(axis) = flat {
            for frame in &mut frames {
                frame.weight[axis] = 0.0;
            }
        }
        PointTrack { disc: *disc, marker: *marker, frames }
    };
    let knows_slip = turns == [true; 2] || shot.spin == Spin::Stun;
    let unseen = (0..2).filter(|disc| !turns[*disc]);
    let mut held: Vec<usize> = unseen.flat_map(|disc| [own::SPIN + disc, own::SPIN_RATIO + disc]).collect();
    let mut known = Vec::new();
    if let Some(axis) = flat {
        held.extend([own::X + axis, own::VELOCITY + axis, own::VELOCITY + 2 + axis, own::DIRECTION]);
        held.extend([own::RATIO, own::MOMENTUM + 1, own::LEAD]);
        known.push((own::DISTANCE, OwnPrior::Stated(ANY_DISTANCE)));
    } else if stuck.is_some() || !knows_slip {
        known.push((own::RATIO, OwnPrior::Stated(ANY)));
    }
    if stuck.is_some() {
        held.extend([own::RESTITUTION, own::LEAD, own::SPIN_RATIO, own::SPIN_RATIO + 1]);
    } else if flat.is_none() {
        known.push((own::LEAD, OwnPrior::Stated(Normal { mean: 0.0, sd: shot.fps.recip() })));
    }
    held.sort_unstable();
    held.dedup();
    known.extend(held.into_iter().map(|place| (place, OwnPrior::Held)));
    let position_sd = DISCS.map(|disc| {
        let centre = [centre(shot, disc)];
        [&centre[..], &points(shot, disc)]
            .map(|tracks| unit * frame_noise::noise_of_near(tracks, shot, meeting.time))
    });
    let frames = ShotFrames {
        name: shot.name.clone(),
        tracks: tracks.iter().map(track_of).collect(),
        fps: shot.fps,
        turns,
        knows_slip: knows_slip && flat.is_none(),
        flat,
        stuck: *stuck,
        own: CORE + marks.len(),
        own_known: known,
        position_sd,
        reach: 0,
        touching: TOUCHING,
        outliers: 0,
        tried: Vec::new(),
        is_settled: false,
    };

    let mut values = Own::zeros(CORE + marks.len());
    values.rows_mut(CORE, marks.len()).copy_from_slice(&marks);
    let [first, second] = meeting.places.map(|place| (place - middle) * unit);
    let velocity = |disc: usize, side: usize| meeting.velocities[disc][side] * unit;
    values[own::TIME] = meeting.time;
    values.fixed_rows_mut::<2>(own::X).copy_from(&first);
    let relative = [0, 1].map(|side| velocity(1, side) - velocity(0, side));
    // marks on the edges that touch are at no distance
    let across = if flat.is_some() { -relative[0] } else { second - first };
    values[own::DIRECTION] = across.y.atan2(across.x);
    let n = across.normalize();
    values[own::DISTANCE] =
        stuck.map_or((second - first).dot(&n), |stuck| unit * stuck.distance) - shared[Id::ContactDistance];
    values.fixed_rows_mut::<2>(own::VELOCITY).copy_from(&velocity(0, 0));
    values.fixed_rows_mut::<2>(own::VELOCITY + 2).copy_from(&velocity(1, 0));
    for disc in 0..2 {
        values[own::SPIN + disc] = spins[disc][0];
    }
    if stuck.is_some() {
        return (frames, values);
    }
    let change = relative[1] - relative[0];
    let t = Point::new(-n.y, n.x);
    let ratio = change.dot(&t) / change.dot(&n);
    // the outcome, of which the law's part is taken later
    values[own::RESTITUTION] = -relative[1].dot(&n) / relative[0].dot(&n);
    values[own::RATIO] = ratio;
    for disc in (0..2).filter(|disc| turns[*disc]) {
        // Δω = −(J_t/J_n + d_S) (J_n/m)/(ν R)
        let radius = discs.radii.map_or(0.5 * unit * meeting.distance(), |radii| radii[disc]);
        let normal = (velocity(disc, 1) - velocity(disc, 0)).dot(&n).abs();
        let turned = spins[disc][1] - spins[disc][0];
        values[own::SPIN_RATIO + disc] = -turned * discs.inertia * radius / normal - ratio;
    }
    (frames, values)
}
