//! Films that are not quite what the model takes them for: positions that are off where the balls touch, an object ball that does not lie
//! still, noise that is stated wrongly, all shots in one direction.

use crate::camera::{TRUTH, fitted, is_recovered, is_right, rolls, shown, with_truth};
use crate::frames::dataset;
use crate::prelude::*;

const FPS: f64 = 1000.0;

fn film(seed: u64, change: impl Fn(&mut TrackShot, &TrueImpact)) -> Dataset {
    let changed = |(mut shot, truth): (TrackShot, TrueImpact)| {
        change(&mut shot, &truth);
        shot
    };
    dataset(shown(with_truth(seed).into_iter().map(changed).collect(), |x, y| [x, y]))
}

/// Balls next to each other are seen as one for some frames, so that their positions are drawn together.
fn drawn_together(shot: &mut TrackShot, truth: &TrueImpact) {
    const FRAMES: f64 = 3.5;
    const BY: f64 = 2e-4;
    let near = |sample: &Sample| (sample.t - truth.time).abs() < FRAMES / FPS;
    for (cue, object) in shot.cue.iter_mut().zip(&mut shot.object).filter(|(cue, _)| near(cue)) {
        let (dx, dy) = (object.x - cue.x, object.y - cue.y);
        let apart = dx.hypot(dy);
        cue.x += BY * dx / apart;
        cue.y += BY * dy / apart;
        object.x -= BY * dx / apart;
        object.y -= BY * dy / apart;
    }
}

/// An exposure of a whole frame of a slow camera: the frame of the impact shows a ball on neither of its paths.
fn exposed(shot: &mut TrackShot, truth: &TrueImpact) {
    const TIMES: usize = 9;
    for samples in [&mut shot.cue, &mut shot.object] {
        let sharp = samples.clone();
        let at = |t: f64| {
            let i = sharp.partition_point(|s| s.t < t).clamp(1, sharp.len() - 1);
            let (a, b) = (sharp[i - 1], sharp[i]);
            let part = (t - a.t) / (b.t - a.t);
            [a.x + part * (b.x - a.x), a.y + part * (b.y - a.y)]
        };
        let long = 8.0 / FPS;
        samples.retain(|s| ((s.t * FPS).round() as i64) % 8 == 0);
        for sample in samples.iter_mut().filter(|s| (s.t - truth.time).abs() < long) {
            let times = (0..TIMES).map(|k| sample.t + long * (k as f64 / (TIMES - 1) as f64 - 0.5));
            let seen: Vec<[f64; 2]> = times.map(at).collect();
            let mean = |k: usize| seen.iter().map(|place| place[k]).sum::<f64>() / TIMES as f64;
            (sample.x, sample.y) = (mean(0), mean(1));
        }
    }
    shot.fps = FPS / 8.0;
}

/// Numbers of frames before and after all impacts that were left out.
fn left_out(fit: &Fit) -> [f64; 2] {
    ["before", "after"].map(|side| number(fit, &format!("/film/left_out_at_impacts/{side}")))
}

#[test]
fn balls_that_seem_drawn_together_do_no_harm() {
    let (reference, _) = fitted(film(7700, |_, _| ()));
    assert!(part(&reference, "/film/left_out_at_impacts").is_null());
    let (fit, camera) = fitted(film(7700, drawn_together));
    let push = camera.found(Correction::Push).unwrap();
    assert!(push.value < -3.0 * push.sd.unwrap(), "{push:?}");
    is_recovered("drawn together", &fit, &reference);
}

/// Six frames to a contact, with noise that would show a velocity that jumps.
#[test]
fn frames_in_which_the_balls_touch_fit_like_all_others() {
    let fast =
        with(&rolls(7706), "camera = { fps = 20000, before_ms = 3, after_ms = 3, position_sd_m = 2e-6 }");
    let tracks = simulate::filmed(&fast).unwrap().into_iter().map(|(shot, _)| shot);
    let fit = options::fitted(&dataset(tracks.collect()), Depth::Estimates);
    assert!(part(&fit, "/film/left_out_at_impacts").is_null());
    assert!(is_right(&fit), "{:?}", fit.estimates());
}

/// A point that jumps off the object ball before the impact, and a frame that shows the one before it.
#[test]
fn wrong_and_repeated_frames_are_neither_a_ball_that_moves_nor_a_drop() {
    let spoiled = |shot: &mut TrackShot, truth: &TrueImpact| {
        let before = shot.object.partition_point(|sample| sample.t < truth.time);
        shot.object[before - 8].x += 0.02;
        let after = before + 8;
        for samples in [&mut shot.cue, &mut shot.object] {
            (samples[after].x, samples[after].y) = (samples[after - 1].x, samples[after - 1].y);
        }
    };
    let [(reference, _), (fit, _)] = [fitted(film(7709, |_, _| ())), fitted(film(7709, spoiled))];
    assert!(fit.shots_rejected().is_empty(), "{:?}", fit.shots_rejected());
    assert_eq!(part(&fit, "/film/dropped_frames/drops"), 0);
    is_recovered("wrong and repeated frames", &fit, &reference);
}

/// Each clip once more, begun later, moved and rounded: errors would be too small by √2.
#[test]
fn copies_of_clips_are_found() {
    let mut twice = film(7709, |_, _| ());
    let shots = &mut twice.tracks.as_mut().unwrap().shots;
    let copies: Vec<TrackShot> = shots.iter().take(12).cloned().collect();
    shots.truncate(12);
    for mut copy in copies {
        copy.name += " again";
        for samples in [&mut copy.cue, &mut copy.object] {
            samples.drain(..2);
            for sample in samples.iter_mut() {
                (sample.x, sample.y) =
                    ((sample.x * 1e5).round() / 1e5 + 0.01, (sample.y * 1e5).round() / 1e5);
            }
        }
        shots.push(copy);
    }
    let fit = options::fitted(&twice, Depth::Estimates);
    let says = |warning: &&str| warning.contains("within the errors: expected each clip once");
    assert!(fit.warnings().iter().any(says), "{:?}", fit.warnings());
}

#[test]
fn frames_that_are_exposed_over_the_impact_are_left_out() {
    let (fit, _) = fitted(film(7701, exposed));
    let [before, after] = left_out(&fit);
    assert!((1.0..=2.0).contains(&(before + after)), "{before} {after}");
    assert!(is_right(&fit), "{:?}", fit.estimates());
}

/// Noise that is stated three times too small is what the frames show; three times too large is said.
#[test]
fn noise_that_is_stated_wrongly_is_not_blamed_on_the_model() {
    let stated = |times: f64| {
        let mut stated = film(7703, |_, _| ());
        for shot in &mut stated.tracks.as_mut().unwrap().shots {
            shot.position_sd = Some(times * 1e-4);
        }
        options::fitted(&stated, Depth::Intervals)
    };
    let small = stated(1.0 / 3.0);
    assert!(is_right(&small) && small.verdict().grade == Grade::Good, "{}", small.verdict().sentence);
    let told = small
        .notes()
        .iter()
        .any(|note| note.starts_with("Neighbouring frames scatter by 3.0 times the stated noise"));
    assert!(told, "{:?}", small.notes());
    let large = stated(3.0).verdict();
    assert!(large.grade == Grade::Doubtful && large.sentence.contains("position_sd_m"), "{}", large.sentence);
}

/// Noise is stated in metres, also of a film in pixels whose ruler the balls are.
#[test]
fn noise_that_is_stated_rightly_is_taken_in_pixels_too() {
    let in_pixels = |shot: &mut TrackShot, _: &TrueImpact| {
        for sample in shot.cue.iter_mut().chain(&mut shot.object) {
            (sample.x, sample.y) = (900.0 * sample.x, 900.0 * sample.y);
        }
        shot.position_sd = Some(1e-4);
    };
    let mut film = film(7703, in_pixels);
    let tracks = film.tracks.as_mut().unwrap();
    (tracks.from_balls, tracks.scale_sd) = (true, None);
    let fit = options::fitted(&film, Depth::Estimates);
    assert!(is_right(&fit), "{:?}", fit.estimates());
    let notes = fit.notes();
    assert!(!notes.iter().any(|note| note.starts_with("Neighbouring frames")), "{notes:?}");
}

/// A tracker that errs similarly in neighbouring frames: the correlation is found, and what the film determines is right.
#[test]
fn noise_that_lasts_is_found() {
    /// Noise beside which that of the film, a fifth of it, takes 4 % from the correlation, m.
    const SD: f64 = 5e-4;
    /// These 4 %, and three standard errors of less than 0.02 each.
    const WITHIN: f64 = 0.1;
    for rho in [0.3_f64, 0.6] {
        let errs = |shot: &mut TrackShot, _: &TrueImpact| {
            let mut random = ChaCha8Rng::seed_from_u64(shot.name.parse().unwrap());
            // a sum of twelve uniform numbers is as good as normal
            let mut normal = || (0..12).map(|_| random.random_range(-0.5..0.5)).sum::<f64>();
            for samples in [&mut shot.cue, &mut shot.object] {
                let mut last = [normal(), normal()];
                for sample in samples {
                    last = last.map(|error| rho * error + (1.0 - rho * rho).sqrt() * normal());
                    (sample.x, sample.y) = (sample.x + SD * last[0], sample.y + SD * last[1]);
                }
            }
        };
        let (fit, _) = fitted(film(7707, errs));
        let note =
            fit.notes().into_iter().find_map(|note| note.split_once("correlated by ")).expect("a note");
        let found: f64 = note.1.split(' ').next().unwrap().parse().unwrap();
        assert!((found - rho).abs() < WITHIN, "{rho}: {found}");
        for (parameter, truth) in [(Parameter::Mu, TRUTH[0]), (Parameter::E, TRUTH[2])] {
            let estimate = fit.get(parameter).unwrap();
            assert!(
                (estimate.value - truth).abs() < 3.0 * estimate.std_error.unwrap(),
                "{rho}: {estimate:?}"
            );
        }
    }
}

/// A ramp plays all shots in one direction with one cut, which hardly tells aspect, shear and rolling shutter apart: where they are
/// stated the fit is right, where they are not the errors include them.
#[test]
fn one_direction_does_not_bend_the_camera() {
    for seed in [7704, 7705] {
        let [mu, _, e] = TRUTH;
        let ramp = with(&rolls(seed), "shots.cut_deg = [30, 30]");
        let turned = |(mut shot, truth): (TrackShot, TrueImpact)| {
            // the line of centres 40 degrees from the x axis
            let (sin, cos) = (40_f64.to_radians() - truth.direction).sin_cos();
            for sample in shot.cue.iter_mut().chain(&mut shot.object) {
                (sample.x, sample.y) = (cos * sample.x - sin * sample.y, sin * sample.x + cos * sample.y);
            }
            shot
        };
        let film = simulate::filmed(&ramp).unwrap().into_iter().map(turned).collect();
        let mut stated = dataset(shown(film, |x, y| [x, y]));
        let error_of_e = |stated: &Dataset| {
            let (fit, _) = fitted(stated.clone());
            for (parameter, truth) in [(Parameter::Mu, mu), (Parameter::E, e)] {
                let found = fit.get(parameter).unwrap();
                assert!((found.value - truth).abs() < 3.0 * found.std_error.unwrap(), "{found:?}");
            }
            fit.get(Parameter::E).unwrap().std_error.unwrap()
        };
        let unstated = error_of_e(&stated);
        for which in [Correction::Aspect, Correction::Shear, Correction::ShutterX, Correction::ShutterY] {
            stated.tracks.as_mut().unwrap().camera[which as usize] =
                Some(Measured { value: which.neutral(), sd: None });
        }
        let known = error_of_e(&stated);
        assert!(known < 0.1 * unstated, "{known} {unstated}");
    }
}
