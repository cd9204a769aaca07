//! Footage that cannot be used, or not all of it: what is said of each shot, and that what ends the window
//! does not touch the answer.

use std::fmt::Write as _;
use std::fs;
use std::process::{Command, Output};

use caromfit::measurement::track::{Sample, TrackShot};
use caromfit::simulate;
use caromfit::simulate::{Camera, Kind, Played, Shots, Spec, TrueImpact};

use crate::synthetic::spec;

/// Frames before the impact, at 1000 fps.
const BEFORE: usize = 40;

fn film(count: usize, seed: u64, after_ms: f64) -> Vec<(TrackShot, TrueImpact)> {
    let usual = spec(Kind::Tracks, &[Played::NaturalRoll], count, seed);
    let spec = Spec {
        shots: Shots { speed_m_s: [1.0, 3.0], ..usual.shots },
        camera: Camera { after_ms, ..usual.camera },
        ..usual
    };
    simulate::filmed(&spec).unwrap()
}

fn table(shots: &[TrackShot]) -> String {
    let mut table = String::from("shot,frame,ball,x,y\n");
    for shot in shots {
        for (ball, samples) in [("cue", &shot.cue), ("object", &shot.object)] {
            for s in samples {
                _ = writeln!(table, "{},{},{ball},{},{}", shot.name, (s.t * shot.fps).round(), s.x, s.y);
            }
        }
    }
    table
}

/// `caromfit extract` of these shots: what the program says, and impacts.csv if there is one.
fn extract(shots: &[TrackShot]) -> (Output, Option<String>) {
    extract_with(shots, "[cue_spin]\nassume = \"natural-roll\"")
}

/// The same, with these lines of dataset.toml.
fn extract_with(shots: &[TrackShot], spin: &str) -> (Output, Option<String>) {
    let folder = tempfile::tempdir().unwrap();
    let settings = format!(
        "name = \"lab\"\nkind = \"tracks\"\nfiles = [\"tracks.csv\"]\n[video]\ncapture_fps = 1000\n{spin}\n"
    );
    fs::write(folder.path().join("dataset.toml"), settings).unwrap();
    fs::write(folder.path().join("tracks.csv"), table(shots)).unwrap();
    let out = folder.path().join("out");
    let output = Command::new(env!("CARGO_BIN_EXE_caromfit"))
        .args(["extract", "--no-pictures", "--out"])
        .args([&out, &folder.path().to_path_buf()])
        .output()
        .unwrap();
    (output, fs::read_to_string(out.join("lab/impacts.csv")).ok())
}

/// A shot with every sample moved, or left out.
fn changed(
    shot: &TrackShot,
    name: &str,
    cue: impl Fn(Sample) -> Option<Sample>,
    object: impl Fn(Sample) -> Option<Sample>,
) -> TrackShot {
    TrackShot {
        name: name.to_string(),
        cue: shot.cue.iter().copied().filter_map(cue).collect(),
        object: shot.object.iter().copied().filter_map(object).collect(),
        ..shot.clone()
    }
}

/// Alone it ends with status 1, nothing written, and the reason.
#[track_caller]
fn unusable(shot: TrackShot, reason: &str) {
    let (output, impacts) = extract(&[shot]);
    let error = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!((output.status.code(), impacts), (Some(1), None), "{error}");
    assert!(error.contains("no shot can be used") && error.contains(reason), "{reason:?} is not in: {error}");
}

#[test]
fn every_reason_is_said() {
    let film = film(1, 3, 40.0);
    let (shot, truth) = &film[0];
    let impact = truth.time;
    let frame = 1e-3;
    let keep = |from: f64, to: f64| move |s: Sample| (from <= s.t && s.t <= to).then_some(s);
    let all = Some;

    let few = changed(shot, "few", keep(0.0, 0.0041), keep(0.0, 0.0041));
    unusable(
        few,
        "the tracks are too short: 5 frames of the cue ball, 5 of the object ball; expected at least 6",
    );
    let early = impact - 5.0 * frame;
    unusable(changed(shot, "early", keep(0.0, early), keep(0.0, early)), "no collision found");
    // a ball that is hit while nobody films the cue ball's approach
    let late = changed(shot, "late", keep(impact - 2.0 * frame, 1.0), all);
    unusable(late, "too few frames of the cue ball before the impact: 1; expected at least 3");
    let gone = changed(shot, "gone", keep(0.0, impact + 2.0 * frame), all);
    unusable(gone, "too few frames of the cue ball after the impact: 2; expected at least 3");
    let hidden = changed(shot, "hidden", all, |s| (s.t < impact || s.t > impact + 0.0383).then_some(s));
    unusable(hidden, "no collision found: the object ball is not set in motion");
    let stays = shot.object[0];
    let missed = changed(shot, "missed", all, |s| Some(Sample { t: s.t, ..stays }));
    unusable(missed, "no collision found: the object ball is not set in motion");
    // 0.1 m/s from the first frame on
    let moving = |s: Sample| Some(Sample { x: s.x + 0.1 * (s.t - impact), ..s });
    unusable(
        changed(shot, "moving", all, moving),
        "the object ball was moving before the impact, with 0.099 m/s",
    );
    // a scale that is twice what is stated
    let larger = |s: Sample| Some(Sample { x: 2.0 * s.x, y: 2.0 * s.y, ..s });
    // …and balls that are too far apart, which a single shot cannot tell from it
    let far = |s: Sample| Some(Sample { x: s.x + 0.2, ..s });
    for shot in [changed(shot, "larger", larger, larger), changed(shot, "far", far, all)] {
        let (output, _) = extract(&[shot]);
        let said = String::from_utf8(output.stdout).unwrap();
        assert!(said.contains("[scale]"), "{said}");
    }
    // the cue ball is hit once more right after the impact
    let again = |s: Sample| {
        let late = s.t - impact - 4.0 * frame;
        let x = if late > 0.0 { s.x + 4.0 * late } else { s.x };
        Some(Sample { x, ..s })
    };
    let (output, _) = extract(&[changed(shot, "again", again, all)]);
    let said = String::from_utf8(output.stdout).unwrap();
    assert!(said.contains("times their noise"), "{said}");
}

/// Where the object ball moves first in all shots, it is likely the cue ball.
#[test]
fn balls_that_are_interchanged_in_all_shots() {
    let film = film(2, 5, 40.0);
    let swapped: Vec<TrackShot> = film
        .iter()
        .map(|(shot, _)| TrackShot { cue: shot.object.clone(), object: shot.cue.clone(), ..shot.clone() })
        .collect();
    let error = |settings: &str| {
        let (output, _) = extract_with(&swapped, settings);
        assert_eq!(output.status.code(), Some(1));
        String::from_utf8(output.stderr).unwrap()
    };
    let spin = "[cue_spin]\nassume = \"natural-roll\"\n";
    let asks = "as in all shots: are cue and object interchanged ([tracks] cue, object)?";
    let said = error(spin);
    assert!(said.contains(asks) && said.contains(" m/s"), "{said}");
    // nothing is known in metres before some shot shows how large the balls are
    let said = error(&format!("{spin}[scale]\nlength_unit = \"px\""));
    assert!(said.contains(asks) && !said.contains("m/s"), "{said}");
}

/// Programs that follow every second frame, or the balls in turn.
#[test]
fn tracks_that_have_only_some_frames() {
    let film = film(3, 6, 80.0);
    let number = |s: &Sample| (s.t * 1e3).round() as u32;
    for (cue, object) in [([0, 2], [0, 2]), ([0, 2], [1, 3]), ([0, 1], [0, 1])] {
        let some = |kept: [u32; 2]| move |s: Sample| kept.contains(&(number(&s) % 4)).then_some(s);
        let shots: Vec<_> =
            film.iter().map(|(shot, _)| changed(shot, &shot.name, some(cue), some(object))).collect();
        let (output, _) = extract(&shots);
        let said = String::from_utf8_lossy(&output.stdout).into_owned();
        assert!(said.contains("3 shots extracted, 0 left out"), "{cue:?} {object:?}: {said}{output:?}");
    }
}

#[test]
fn spins_that_are_found_to_be_natural_roll_are_counted() {
    let film = film(3, 4, 40.0);
    let shots: Vec<TrackShot> = film.iter().map(|(shot, _)| shot.clone()).collect();
    let (output, _) = extract_with(&shots, "[cue_spin]\nassume = \"unknown\"");
    let said = String::from_utf8(output.stdout).unwrap();
    let expected = "Of 3 cue balls of unknown spin, 3 were found to roll naturally before the impact";
    assert!(said.contains(expected), "{said}");
}

#[test]
fn the_rest_of_the_shots_goes_on() {
    let film = film(3, 4, 40.0);
    let mut shots: Vec<TrackShot> = film.iter().map(|(shot, _)| shot.clone()).collect();
    let impact = film[1].1.time;
    shots[1] = changed(&shots[1], "bad", |s| (s.t < impact).then_some(s), |s| (s.t < impact).then_some(s));
    let (output, impacts) = extract(&shots);
    let said = String::from_utf8(output.stdout).unwrap();
    assert_eq!(output.status.code(), Some(0));
    assert!(said.contains("2 shots extracted, 1 left out"), "{said}");
    assert!(said.contains("left out: shot bad: no collision found"), "{said}");
    assert_eq!(impacts.unwrap().lines().count(), 3);
}

/// How far the velocities of impacts.csv are off the truth, in their standard deviations.
fn pulls(impacts: &str, truths: &[(TrackShot, TrueImpact)]) -> Vec<f64> {
    let mut lines = impacts.lines();
    let names: Vec<&str> = lines.next().unwrap().split(',').collect();
    let mut pulls = Vec::new();
    for line in lines {
        let cells: Vec<&str> = line.split(',').collect();
        let number = |name: &str| {
            let column = names.iter().position(|n| *n == name).unwrap_or_else(|| panic!("{name}"));
            cells[column].parse::<f64>().unwrap()
        };
        let (_, truth) = truths.iter().find(|(shot, _)| shot.name == cells[0]).unwrap();
        let (u, c, v) = (truth.cue_before.velocity, truth.cue_after.velocity, truth.object_after.velocity);
        for (name, truth) in [
            ("cue_vx", u.x),
            ("cue_vy", u.y),
            ("cue_vx_after", c.x),
            ("cue_vy_after", c.y),
            ("obj_vx_after", v.x),
            ("obj_vy_after", v.y),
        ] {
            let pull = (number(name) - truth) / number(&format!("{name}_sd"));
            pulls.push(pull);
        }
    }
    pulls
}

/// The answer stays within its errors: their squares have mean 1, and none is beyond what chance gives.
#[track_caller]
fn right(what: &str, shots: &[TrackShot], truths: &[(TrackShot, TrueImpact)]) {
    /// Of one in 240 normal deviates, beyond this once in 2000 such tests.
    const MOST: f64 = 5.0;
    /// Of 40 shots: three standard deviations √(2/240) of a mean square above 1, and what a window costs
    /// that ends a little late.
    const MEAN_SQUARE: f64 = 1.5;
    let (output, impacts) = extract(shots);
    assert_eq!(output.status.code(), Some(0), "{what}");
    let impacts = impacts.unwrap();
    assert_eq!(
        impacts.lines().count(),
        shots.len() + 1,
        "{what}: {}",
        String::from_utf8_lossy(&output.stdout)
    );
    let pulls = pulls(&impacts, truths);
    let mean_square = pulls.iter().map(|p| p * p).sum::<f64>() / pulls.len() as f64;
    let most = pulls.iter().fold(0.0_f64, |most, pull| most.max(pull.abs()));
    println!("{what}: mean square {mean_square:.3}, most {most:.2}");
    assert!(mean_square < MEAN_SQUARE && most < MOST, "{what}: mean square {mean_square}, most {most}");
}

#[test]
fn what_ends_the_window_does_not_touch_the_answer() {
    let film = film(40, 17, 80.0);
    let of_all = |change: &dyn Fn(&TrackShot, &TrueImpact) -> TrackShot| {
        film.iter().map(|(shot, truth)| change(shot, truth)).collect::<Vec<_>>()
    };
    right("nothing", &of_all(&|shot, _| shot.clone()), &film);
    // the object ball comes back from a cushion, 25 to 45 ms after the impact
    let bounced = |shot: &TrackShot, truth: &TrueImpact| {
        let number = shot.name.parse::<f64>().unwrap();
        let when = truth.time + 1e-3 * (25.0 + number / 2.0);
        let wall = shot.object.iter().rev().find(|s| s.t <= when).copied().unwrap();
        let object = |s: Sample| Some(if s.t > when { Sample { x: 2.0 * wall.x - s.x, ..s } } else { s });
        changed(shot, &shot.name, Some, object)
    };
    right("a cushion", &of_all(&bounced), &film);
    // the cue ball meets a third ball and loses half of its speed; one that flies nearly straight up after a
    // thick hit is left alone: what it loses there looks like its landing
    let met = |shot: &TrackShot, truth: &TrueImpact| {
        if truth.cue_after.velocity.xy().norm() < 0.3 {
            return shot.clone();
        }
        let when = truth.time + 0.03;
        let there = shot.cue.iter().rev().find(|s| s.t <= when).copied().unwrap();
        let cue = |s: Sample| {
            let half = |a: f64, b: f64| a + 0.5 * (b - a);
            let late = Sample { x: half(there.x, s.x), y: half(there.y, s.y), ..s };
            Some(if s.t > when { late } else { s })
        };
        changed(shot, &shot.name, cue, Some)
    };
    right("a second collision", &of_all(&met), &film);
    // the object ball leaves the picture, and comes in late where it was not seen at rest
    let left = |shot: &TrackShot, truth: &TrueImpact| {
        let seen = move |s: Sample| (s.t < truth.time + 0.02 && s.t > 0.5e-3 * BEFORE as f64).then_some(s);
        changed(shot, &shot.name, |s: Sample| (s.t > 1e-2).then_some(s), seen)
    };
    right("out of the picture", &of_all(&left), &film);
}
