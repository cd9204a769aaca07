//! Shots that are not what the data set says, among good ones: double hits, kisses, a hand in the way. They are left out, and the film
//! is as good as its other shots.

use crate::camera::{by_phone, fitted, is_right, with_truth};
use crate::frames::dataset;
use crate::prelude::*;

const SHOTS: usize = 40;

/// A film of which in every shot that is chosen one ball goes on otherwise after the impact than the collision says.
fn film(seed: u64, is_false: impl Fn(usize) -> bool) -> Vec<TrackShot> {
    let spoiled = |(i, (mut shot, truth)): (usize, (TrackShot, TrueImpact))| {
        let samples = if i % 2 == 0 { &mut shot.cue } else { &mut shot.object };
        let at = samples.iter().position(|sample| sample.t > truth.time).unwrap();
        let [x, y] = [samples[at - 1].x, samples[at - 1].y];
        // faster or slower by a tenth to a half, and turned by up to 5°
        let spread = (i * 7 % 5) as f64;
        let (by, turn) =
            (if i % 3 == 0 { 0.9 - 0.1 * spread } else { 1.1 + 0.1 * spread }, 0.04 * (spread - 2.0));
        let (sin, cos) = turn.sin_cos();
        for sample in samples[at..].iter_mut().filter(|_| is_false(i)) {
            let (dx, dy) = (by * (sample.x - x), by * (sample.y - y));
            (sample.x, sample.y) = (x + cos * dx - sin * dy, y + sin * dx + cos * dy);
        }
        shot
    };
    with_truth(seed).into_iter().enumerate().map(spoiled).collect()
}

#[test]
fn a_third_of_false_shots_is_left_out() {
    let is_false = |i: usize| i % 3 == 1;
    let falsified = (0..SHOTS).filter(|i| is_false(*i)).count();
    let film = film(7600, is_false);
    let names: Vec<String> =
        film.iter().enumerate().filter(|(i, _)| is_false(*i)).map(|(_, shot)| shot.name.clone()).collect();
    for (seen, dataset) in [("from above", dataset(film.clone())), ("by a phone", by_phone(film))] {
        let (fit, _) = fitted(dataset);
        let mut left_out: Vec<&String> = fit.shots_rejected.iter().map(|rejected| &rejected.shot).collect();
        left_out.sort_by_key(|name| names.iter().position(|known| known == *name));
        assert!(left_out.into_iter().eq(&names), "{seen}: {:?}", fit.shots_rejected);
        assert!(is_right(&fit), "{seen}: {:?}", fit.estimates);
        let verdict = fit.verdict();
        assert_eq!(verdict.grade, Grade::Good, "{seen}: {}", verdict.sentence);
        assert!(
            verdict.sentence.contains(&format!("{falsified} of {SHOTS} shots were left out")),
            "{}",
            verdict.sentence
        );
    }
}

/// Where half of the shots contradict the other half, neither is taken for the truth.
#[test]
fn halves_that_contradict_each_other_are_no_result() {
    let (fit, _) = fitted(dataset(film(7601, |i| i % 2 == 1)));
    assert_ne!(fit.verdict().grade, Grade::Good, "{}", fit.verdict().sentence);
}
