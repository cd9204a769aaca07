//! Damaged files of every format of tracks: no panic, no endless loop, and no position that the text does not hold.
//! `CAROMFIT_FUZZ=1000000` sets how many.

use std::fs;
use std::path::Path;

use caromfit::io::load_text;
use caromfit::measurement::dataset::Tracks;
use rand::seq::IndexedRandom;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::hostile::mutate;
use crate::loading::accepted;

/// A file that is read as it is, and its dataset.toml.
struct Whole {
    settings: String,
    name: String,
    text: String,
}

impl Whole {
    /// Whether positions are those of the text but for a power of ten: neither converted nor from several lines or cells.
    fn is_read_as_written(&self) -> bool {
        const CONVERTED: [&str; 5] = ["px", "\"in\"", "\"ft\"", "y_axis", "cue = ["];
        let is_json = self.text.starts_with(['[', '{']);
        !is_json && !CONVERTED.iter().any(|word| self.settings.contains(word))
    }
}

/// Cases of one file each, of every format.
fn wholes() -> Vec<Whole> {
    let mut wholes = Vec::new();
    for mut texts in ["programs.toml", "positions.toml", "times.toml"].into_iter().flat_map(accepted) {
        let settings = texts.remove("dataset.toml").unwrap();
        if texts.len() == 1 {
            let (name, text) = texts.pop_first().unwrap();
            wholes.push(Whole { settings, name, text });
        }
    }
    assert!(wholes.len() > 60, "{}", wholes.len());
    wholes
}

/// Loads a file; checks that it is refused for a reason, or read as it is written.
fn load(whole: &Whole, bytes: &[u8], folder: &Path) -> Option<Tracks> {
    fs::write(folder.join(&whole.name), bytes).unwrap();
    match load_text(&whole.settings, &folder.join("dataset.toml")) {
        Err(error) => {
            assert!(!error.problems().is_empty(), "refused without a reason");
            None
        }
        Ok(dataset) => dataset.tracks,
    }
}

/// Every number that a line can be said to hold.
fn numbers(line: &str) -> Vec<f64> {
    let plain = line.replace('\u{2212}', "-").replace(['d', 'D'], "e").replace(',', ".");
    let bare = plain.replace('"', "");
    let mut cells: Vec<&str> = bare.split_whitespace().chain(plain.split('"')).collect();
    for separator in ['\t', ';', '.', '|', ' '] {
        cells.extend(bare.split(separator));
    }
    let commas = line.replace('\u{2212}', "-").replace('"', "");
    cells.extend(commas.split(','));
    cells.iter().filter_map(|cell| cell.trim().parse().ok()).collect()
}

/// Checks that both coordinates of every position stand in one line, in metres, centimetres or millimetres.
fn assert_faithful(tracks: &Tracks, text: &str) {
    let lines: Vec<Vec<f64>> = text.split(['\n', '\r']).map(numbers).collect();
    for shot in &tracks.shots {
        assert!(shot.fps > 0.0);
        for sample in shot.cue.iter().chain(&shot.object) {
            let holds = |line: &Vec<f64>, unit: f64| {
                [sample.x, sample.y].iter().all(|place| line.iter().any(|number| number / unit == *place))
            };
            assert!(
                lines.iter().any(|line| [1.0, 100.0, 1000.0].iter().any(|unit| holds(line, *unit))),
                "{sample:?} is not in {text:?}"
            );
        }
    }
}

#[test]
fn damaged_files_give_no_position_that_they_do_not_hold() {
    let count = std::env::var("CAROMFIT_FUZZ").ok().and_then(|n| n.parse().ok()).unwrap_or(10_000_u64);
    let folder = tempfile::tempdir().unwrap();
    let wholes = wholes();
    for number in 0..count {
        let mut random = ChaCha8Rng::seed_from_u64(number);
        let whole = wholes.choose(&mut random).unwrap();
        let settings = if random.random_bool(0.9) { whole } else { wholes.choose(&mut random).unwrap() };
        let bytes = mutate(&mut random, &whole.text);
        let tried = std::panic::catch_unwind(|| {
            let tracks = load(settings, &bytes, folder.path());
            let is_plain = whole.is_read_as_written() && settings.is_read_as_written();
            if let (Some(tracks), Ok(text), true) = (tracks, std::str::from_utf8(&bytes), is_plain) {
                assert_faithful(&tracks, text);
            }
        });
        let shown = String::from_utf8_lossy(&bytes);
        assert!(tried.is_ok(), "input {number}: {shown:?} with {}", settings.settings);
    }
}
