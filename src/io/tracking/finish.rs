//! From rows to shots: clips, pieces of tracks, balls, times, and positions in metres.

use super::camera::Calibration;
use super::follow::name_followed;
use super::names::{assign, find, find_discs};
use super::raw::{Job, RawShot, RawTrack, Row, jump_speed, sorted, stem};
use super::repair::{self, remove_lost};
use super::words::Unit;
use super::{Facts, time};
use crate::film::rigid_body::circle_centres;
use crate::io::error::{Subject, listed, message};
use crate::io::manifest::StatedSpin;
use crate::io::text::shortened;
use crate::measurement::dataset::Tracks;
use crate::measurement::track::{Marker, Sample, TrackShot, TrackedBall};
use crate::numerics::{EXACT, median};

/// Least pause between clips, s.
const MIN_PAUSE_S: f64 = 1.0;
/// Least number of frames of both balls in a clip.
const MIN_FRAMES: usize = 6;
/// Ratio of a ball's speed to the fastest before that noise of short steps explains.
const CLEAR_RATIO: f64 = 2.0;

/// Returns the shots of a file: positions of lost balls are left out, one shot that is several
/// clips is separated, and pieces of tracks are joined. `alone`: the names of clips are their
/// numbers, without the file's name.
pub(super) fn clips(mut shots: Vec<RawShot>, alone: bool, job: Job) -> Vec<RawShot> {
    for shot in &mut shots {
        remove_lost(shot, job);
    }
    // names of shots in the table are believed
    if let [shot] = shots.as_slice()
        && shot.name == stem(job.file)
    {
        let clips = clips_of(shot, job.settings.known_fps(), alone);
        let is_seen = |track: &&RawTrack| track.seen().count() >= MIN_FRAMES;
        let are_clips = clips.iter().all(|clip| clip.tracks.iter().filter(is_seen).count() > 1);
        if clips.len() > 1 && are_clips {
            let names = listed(&clips.iter().map(|clip| clip.name.as_str()).collect::<Vec<_>>());
            job.note(Subject::Names, None, message!("clips", names));
            shots = clips;
        }
    }
    for shot in &mut shots {
        name_followed(shot, job.settings);
        join(shot, job);
    }
    shots
}

/// Returns the clips of a shot, which may be one: each begins where the time begins again or, if it
/// does not, after a long pause or where both balls jump.
fn clips_of(shot: &RawShot, fps: Option<f64>, alone: bool) -> Vec<RawShot> {
    let restarts: Vec<Vec<Row>> = shot.tracks.iter().map(RawTrack::restarts).collect();
    let count = restarts.iter().map(Vec::len).max().unwrap_or(0);
    let begins = if count == 0 { beginnings(shot, fps) } else { Vec::new() };
    let clip = |i: usize| {
        let name = if alone { format!("{}", i + 1) } else { format!("{}-{}", shot.name, i + 1) };
        let mut clip = RawShot { name, ..shot.clone() };
        for (track, restarts) in clip.tracks.iter_mut().zip(&restarts) {
            let number = |row: &Row| {
                let restarts = restarts.partition_point(|restart| restart.line <= row.line);
                restarts + begins.partition_point(|begin| *begin <= row.time)
            };
            track.rows.retain(|row| number(row) == i);
        }
        clip.tracks.retain(|track| !track.rows.is_empty());
        clip.line = clip.tracks.iter().map(RawTrack::line).min().unwrap_or(shot.line);
        clip
    };
    let count = count + begins.len();
    (0..=count).map(clip).collect()
}

/// Returns the times at which clips begin: after a long pause, or where both balls jump.
fn beginnings(shot: &RawShot, fps: Option<f64>) -> Vec<f64> {
    // without a unit, ms and frames cannot be distinguished
    let Some(unit) = shot.stated.time else { return Vec::new() };
    let fps = shot.stated.fps.or(fps).unwrap_or(Tracks::MAX_PLAYBACK);
    let pause = MIN_PAUSE_S / unit.seconds().unwrap_or(fps.recip());
    let times = shot.times();
    let step = median(times.windows(2).map(|two| two[1] - two[0]).collect());
    let is_short = |time: f64| time > 0.0 && time < 1.5 * step;
    let centres = shot.centres();
    let steps = centres.iter().flatten().flat_map(|track| track.steps());
    let jump = step * jump_speed(steps.filter(|[_, time]| is_short(*time)), 0.9);
    let frames = centres.map_or(Vec::new(), |[one, other]| one.frames_with(other));
    let jumps = |two: &&[[Row; 2]]| {
        let ([one, other], [one_next, other_next]) = (two[0], two[1]);
        let steps = [one.distance(&one_next), other.distance(&other_next), one.distance(&other_next)];
        is_short(one_next.time - one.time) && steps.iter().all(|step| *step > jump)
    };
    let jumps = frames.windows(2).filter(jumps).map(|two| two[1][0].time);
    let pauses = times.windows(2).filter(|two| two[1] - two[0] > pause).map(|two| two[1]);
    sorted(pauses.chain(jumps))
}

/// Joins pieces to both balls' tracks, as named or, if two at most are seen at a time, the first.
fn join(shot: &mut RawShot, job: Job) {
    let is_plain = |track: &RawTrack| track.point.is_none() && !track.rows.is_empty();
    if shot.tracks.len() < 3 || !shot.tracks.iter().all(is_plain) {
        return;
    }
    let mut order: Vec<usize> = (0..shot.tracks.len()).collect();
    order.sort_by(|a, b| shot.tracks[*a].rows[0].time.total_cmp(&shot.tracks[*b].rows[0].time));
    let find = |name: &str| Some(find(&shot.tracks, name)).filter(|found| found.len() == 1)?.pop();
    let count = |time: f64| shot.tracks.iter().filter(|track| track.at(time).is_some()).count();
    let heads = match job.settings.single_names().map(|names| names.map(find)) {
        Some([Some(cue), Some(object)]) => [cue, object],
        _ if shot.times().into_iter().all(|time| count(time) <= 2) => [order[0], order[1]],
        _ => return,
    };
    for piece in order.into_iter().filter(|i| !heads.contains(i)) {
        let Some(head) = continued(&shot.tracks, heads, &shot.tracks[piece]) else { continue };
        let piece = std::mem::take(&mut shot.tracks[piece]);
        let track = &mut shot.tracks[head];
        let (last, [name, own]) = (track.rows.last().map_or(1, |row| row.line), [&track.name, &piece.name]);
        job.note(Subject::Names, piece.line(), message!("continued", own, name, last));
        track.rows.extend(piece.rows);
        track.rows.sort_by(|a, b| a.time.total_cmp(&b.time));
    }
    shot.tracks.retain(|track| !track.rows.is_empty());
}

/// Returns the track that a piece continues: the nearer of those that have ended, if a ball may
/// come from there, and if the names differ in numbers only.
fn continued(tracks: &[RawTrack], heads: [usize; 2], piece: &RawTrack) -> Option<usize> {
    let first = piece.seen().next()?;
    let ended = heads.into_iter().filter_map(|head| {
        let last = tracks[head].seen().last().filter(|last| last.time < first.time)?;
        Some((head, last.step(first)))
    });
    let (head, [distance, time]) = ended.min_by(|a, b| a.1[0].total_cmp(&b.1[0]))?;
    let steps = heads.iter().flat_map(|head| tracks[*head].steps());
    let fastest = steps.map(|[length, time]| length / time).fold(0.0, f64::max);
    // track_1 and track_6
    let words = |name: &str| name.replace(|c: char| c.is_ascii_digit(), "");
    let name = &tracks[head].name;
    let are_ids = words(name) == words(&piece.name) && name.ends_with(|c: char| c.is_ascii_digit());
    (are_ids && distance <= CLEAR_RATIO * fastest * time).then_some(head)
}

/// Least number of different steps between neighbouring coordinates: fewer fit some grid by chance.
const MIN_GAPS: usize = 8;
/// Largest ratio of the smallest step between coordinates to the grid: fast balls skip steps.
const MAX_SKIPPED: usize = 12;

/// Returns the shot of a file's rows; `None`, with problems or damage, if that fails.
pub(super) fn shot(mut raw: RawShot, facts: &Facts, job: Job) -> Option<TrackShot> {
    /// Measurements of spin.
    const MEASURED: &str = "omega_x, omega_y and omega_z of the table that [tracks] shots names, or markers on the cue ball ([tracks] cue_markers)";
    let (settings, mut facts) = (job.settings, facts.clone());
    if facts.stated == StatedSpin::Unstated {
        job.wrong(raw.line, None, facts.stated.complaint(MEASURED));
    }
    let names_balls = facts.names_balls || settings.tracks.cue.is_some() || settings.tracks.object.is_some();
    if settings.film.discs.is_some() && !names_balls {
        find_discs(&raw, &mut facts, job)?;
    }
    let are_assigned = assign(&mut raw, &facts, job);
    if are_assigned {
        for other in raw.tracks.extract_if(.., |track| track.role.is_none()) {
            job.note(Subject::Names, other.line(), message!("other_track", name => shortened(&other.name)));
        }
        raw.tracks.sort_by_key(|track| track.role);
    }
    let fps = time::convert(&mut raw, facts.capture_fps, job);
    let fps = fps.map_err(|message| job.wrong(raw.line, None, message)).ok().filter(|_| are_assigned)?;
    repair::unite_frames(&mut raw, job)?;
    let mut centres = [0, 1].map(|ball| centre(&mut raw.tracks, ball));
    let of =
        |key: usize| raw.tracks.iter().filter(move |track| track.role.is_some_and(|role| role[0] == key));
    let step = grid_step(&centres.each_ref()).unwrap_or(0.0);
    let swapped = repair::undo_swaps(&mut centres, job);
    if let Some(line) = swapped.filter(|_| !raw.tracks.is_empty()) {
        job.note(Subject::Damage, line, message!("swapped_with_markers"));
        return None;
    }
    repair::remove_shared(&mut centres, job);
    for track in &mut centres {
        repair::remove_filled(track, (step, fps), job);
    }
    let calibration = &settings.calibration(raw.stated.unit);
    let resolution = resolution(&centres, calibration, job);
    let mut paths = centres.each_ref().map(|centre| samples(centre, centre, calibration));
    let mut markers: Vec<Marker> = Vec::new();
    for (i, ball) in [TrackedBall::Cue, TrackedBall::Object].into_iter().enumerate() {
        let first = markers.len();
        for track in of(i + 2).chain(of(i)) {
            let name = track.point.as_ref().unwrap_or(&track.name).clone();
            markers.push(Marker { ball, name, samples: samples(track, &centres[i], calibration) });
        }
        if settings.film.discs.is_some() && of(i).next().is_some() {
            let points = markers[first..].iter().map(|marker| marker.samples.as_slice());
            let points: Vec<&[Sample]> = points.collect();
            let damaged = |message| job.note(Subject::Damage, raw.line, message);
            paths[i] = circle_centres(&points).map_err(damaged).ok()?;
        }
    }
    if facts.stated == StatedSpin::Measured && settings.film.discs.is_none() && markers.is_empty() {
        job.wrong(raw.line, None, facts.stated.complaint(MEASURED));
    }
    let spin = facts.spin();
    let mut shot = TrackShot {
        file: raw.file,
        line: raw.line,
        labels: facts.labels,
        markers,
        position_sd: settings.tracks.position_sd_m,
        resolution,
        ..TrackShot::new(raw.name, fps, spin, paths)
    };
    let is_finite = |s: &mut Sample| [s.t, s.x, s.y].iter().all(|number| number.is_finite());
    if !shot.tracks_mut().flatten().all(is_finite) {
        return job.refuse(shot.line, "a position or time is too large to be converted");
    }
    Some(shot)
}

/// Removes and returns the centre of a ball, or returns the mean of several points, which remain.
fn centre(tracks: &mut Vec<RawTrack>, ball: usize) -> RawTrack {
    let is_of = |track: &RawTrack| track.role.is_some_and(|role| role[0] == ball);
    let points: Vec<&RawTrack> = tracks.iter().filter(|track| is_of(track)).collect();
    if points.len() < 2 {
        return tracks.extract_if(.., |track| is_of(track)).next().unwrap_or_default();
    }
    let mean = |row: &Row| {
        let place = |track: &&RawTrack, k: usize| track.at(row.time).map_or(f64::NAN, |row| row.place[k]);
        let axis = |k: usize| points.iter().map(|track| place(track, k)).sum::<f64>();
        Row { place: [axis(0), axis(1)].map(|sum| sum / points.len() as f64), ..*row }
    };
    let names: Vec<_> = points.iter().map(|track| track.name.as_str()).collect();
    let rows = points[0].rows.iter().map(mean).collect();
    RawTrack { name: names.join(" + "), rows, ..RawTrack::default() }
}

/// Returns the grid step of the coordinates of each ball, m, at its first position (0 without a
/// grid), and notes if one is coarse, in pixels if the scale is not known. The step is determined
/// in the file's unit, since a calibration by points bends the grid. A ball that is nearly at rest
/// has the other ball's step.
fn resolution(centres: &[RawTrack; 2], calibration: &Calibration, job: Job) -> [f64; 2] {
    /// Step of the coordinates, m and px, above which it is noted: good tracking errs by as much.
    const COARSE_STEP: f64 = 1.5e-4;
    const COARSE_PX: f64 = 0.1;
    let step = |track: &RawTrack| {
        let step = grid_step(&[track]).or_else(|| grid_step(&centres.each_ref()))?;
        let first = track.seen().next()?;
        let [x, y] = calibration.sd(first.place, [step; 2]);
        Some((0.5 * (x * x + y * y)).sqrt()).filter(|step| step.is_finite())
    };
    let steps = centres.each_ref().map(|track| step(track).unwrap_or(0.0));
    let coarsest = steps[0].max(steps[1]);
    let (limit, rounded, unit) = match job.settings.scale.length_unit {
        Some(Unit::Px) if job.settings.film.from_balls => (COARSE_PX, coarsest, "px"),
        _ => (COARSE_STEP, 1e3 * coarsest, "mm"),
    };
    if coarsest > limit {
        let least = rounded / 12.0_f64.sqrt();
        let message = format!("positions are rounded to {rounded:.2} {unit}: each errs by {least:.2} {unit}");
        job.note(Subject::Format, None, message);
    }
    steps
}

/// Returns the step of the grid on which all coordinates of some tracks lie, in the unit of the
/// file; `None` if they lie on none, or if too few differ.
fn grid_step(tracks: &[&RawTrack]) -> Option<f64> {
    let mut gaps = Vec::new();
    for axis in [0, 1] {
        let mut values = sorted(tracks.iter().flat_map(|track| track.seen()).map(|row| row.place[axis]));
        values.dedup_by(|later, earlier| *later - *earlier <= EXACT * later.abs());
        gaps.extend(values.windows(2).map(|two| two[1] - two[0]));
    }
    let gaps = sorted(gaps.into_iter());
    let smallest = gaps.first().filter(|_| gaps.len() >= MIN_GAPS)?;
    let step = (1..=MAX_SKIPPED).find_map(|parts| fitted(&gaps, smallest / parts as f64))?;
    (step > 0.0 && step.is_finite()).then_some(step)
}

/// Returns the step near `guess` of which all these lengths (ascending) are multiples.
fn fitted(gaps: &[f64], guess: f64) -> Option<f64> {
    // least squares of d = k·step, each length with the step from all shorter ones
    let (mut products, mut squares) = (guess, 1.0);
    for gap in gaps {
        let step: f64 = products / squares;
        let multiple = (gap / step).round();
        if !((gap / step - multiple).abs() <= time::MAX_OFF && multiple >= 1.0) {
            return None;
        }
        products += multiple * gap;
        squares += multiple * multiple;
    }
    Some(products / squares)
}

/// Returns the samples of a track about the centre of its ball.
fn samples(track: &RawTrack, centre: &RawTrack, calibration: &Calibration) -> Vec<Sample> {
    if track.is_angle {
        return turned(track, centre, calibration);
    }
    let sample = |row: &Row| {
        let (t, sd) = (row.time + calibration.delay(row.place[1]), row.sd);
        let sd = sd.map(|sd| calibration.sd(row.place, sd));
        Sample { sd, ..Sample::new(t, calibration.metres(row.place)) }
    };
    // all shots stay in memory
    let mut samples: Vec<Sample> = track.seen().map(sample).collect();
    samples.shrink_to_fit();
    samples
}

/// Returns a point that turns with the disc, from angles measured from the file's x axis.
fn turned(angles: &RawTrack, centre: &RawTrack, calibration: &Calibration) -> Vec<Sample> {
    /// Distance of the point from the centre, m; arbitrary.
    const ARM: f64 = 0.02;
    let point = |[row, Row { place: middle, .. }]: [Row; 2]| {
        let (sin, cos) = row.place[0].sin_cos();
        let [x, y] = calibration.metres(middle);
        let [along, up] = calibration.metres([middle[0] + cos, middle[1] + sin]);
        let length = (along - x).hypot(up - y);
        let place = [x + ARM * (along - x) / length, y + ARM * (up - y) / length];
        Sample::new(row.time + calibration.delay(middle[1]), place)
    };
    angles.frames_with(centre).into_iter().map(point).collect()
}
