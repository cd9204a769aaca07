//! Damaged and random input: loading ends with a data set or with an error that says something; no panic, no endless loop, and no position
//! that the text does not hold. `CAROMFIT_FUZZ=1000000` sets how many files of tracks.

use caromfit::io::{load, load_text};
use rand::seq::IndexedRandom;

use crate::loading::accepted;
use crate::prelude::*;

/// Of each kind of input: thousands in all, and a second or two.
const TRIES: usize = 1000;

/// More than a table of the shipped data has in a line.
const LONGEST_NOISE: usize = 200;

/// Pieces that mean something, or look as if they did.
const PIECES: [&str; 24] = [
    "\"", "\"\"", ",", "\n", "\r", "\n\n", "#", "\u{feff}", "\0", "NaN", "-", "1e999", "0", "é", "−3", "=",
    "[", "]", "{", "}", "[[fit]]", "\"\"\"", "shot", "_sd",
];

/// Bytes flipped, deleted, doubled, spliced and inserted.
fn mutate(rng: &mut ChaCha8Rng, text: &str) -> Vec<u8> {
    let mut bytes = text.as_bytes().to_vec();
    for _ in 0..rng.random_range(1..=4) {
        let (a, b) = (rng.random_range(0..=bytes.len()), rng.random_range(0..=bytes.len()));
        let (from, to) = (a.min(b), a.max(b));
        // mostly short stretches
        let to = if rng.random_bool(0.8) { to.min(from + 8) } else { to };
        match rng.random_range(0..6) {
            0 if from < bytes.len() => bytes[from] ^= 1 << rng.random_range(0..8),
            1 if from < bytes.len() => bytes[from] = rng.random(),
            2 => drop(bytes.drain(from..to)),
            3 => {
                let again = bytes[from..to].to_vec();
                bytes.splice(to..to, again);
            }
            4 => {
                let piece = bytes[from..to].to_vec();
                let at = rng.random_range(0..=bytes.len());
                bytes.splice(at..at, piece);
            }
            _ => {
                let piece = PIECES[rng.random_range(0..PIECES.len())];
                bytes.splice(from..from, piece.bytes());
            }
        }
    }
    bytes
}

/// A data set of angles and one of impacts.
fn tables() -> [BTreeMap<String, String>; 2] {
    let mut all = accepted("tables.toml").into_iter();
    [0, 1].map(|_| all.next().unwrap())
}

fn noise(rng: &mut ChaCha8Rng) -> Vec<u8> {
    let length = rng.random_range(0..LONGEST_NOISE);
    if rng.random_bool(0.5) {
        (0..length).map(|_| rng.random()).collect()
    } else {
        (0..length / 4).flat_map(|_| PIECES[rng.random_range(0..PIECES.len())].bytes()).collect()
    }
}

/// What every loaded data set promises.
fn check(dataset: &Dataset) {
    assert_eq!(dataset.faults(), Vec::<String>::new());
    assert!(!dataset.shots.is_empty());
    assert!(dataset.shots.iter().all(|shot| !shot.name.is_empty() && shot.line > 1), "{:?}", dataset.shots);
}

/// Loads; how many lines of the table are shots, 0 if it does not load.
fn try_load(folder: &Path) -> usize {
    match load(folder) {
        Ok(dataset) => {
            check(&dataset);
            dataset.shots.len()
        }
        Err(error) => {
            assert!(!error.problems().is_empty());
            for problem in error.problems() {
                assert!(!problem.message.is_empty() && problem.line != Some(0), "{problem:?}");
            }
            0
        }
    }
}

#[test]
fn mutated_and_random_input_never_panics() {
    let mut rng = ChaCha8Rng::seed_from_u64(20_240_213);
    let folder = tempfile::tempdir().unwrap();
    let (toml, csv) = (folder.path().join("dataset.toml"), folder.path().join("shots.csv"));
    let mut loaded = 0;
    for texts in tables() {
        let (good_toml, good_csv) = (&texts["dataset.toml"], &texts["shots.csv"]);
        fs::write(&toml, good_toml).unwrap();
        fs::write(&csv, good_csv).unwrap();
        assert!(try_load(folder.path()) > 0);
        for _ in 0..TRIES {
            fs::write(&csv, mutate(&mut rng, good_csv)).unwrap();
            loaded += usize::from(try_load(folder.path()) > 0);
        }
        for _ in 0..TRIES {
            fs::write(&csv, noise(&mut rng)).unwrap();
            try_load(folder.path());
        }
        fs::write(&csv, good_csv).unwrap();
        for _ in 0..TRIES {
            fs::write(&toml, mutate(&mut rng, good_toml)).unwrap();
            loaded += usize::from(try_load(folder.path()) > 0);
        }
        for _ in 0..TRIES {
            fs::write(&toml, noise(&mut rng)).unwrap();
            try_load(folder.path());
        }
    }
    // the mutations are neither all fatal nor all harmless; a slip in the name of a column is fatal
    assert!((TRIES / 20..4 * TRIES).contains(&loaded), "{loaded}");
}

/// A cell holds what was put into it, whatever that is.
#[test]
fn any_text_survives_in_a_quoted_cell() {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("dataset.toml"), &tables()[0]["dataset.toml"]).unwrap();
    for _ in 0..TRIES {
        let notes: Vec<String> =
            (0..3).map(|_| String::from_utf8_lossy(&noise(&mut rng)).replace('\u{feff}', "")).collect();
        let row = |note: &String| format!("\"{}\",30,3", note.replace('"', "\"\""));
        let rows: Vec<_> = notes.iter().map(row).collect();
        let csv = format!("note,cut_deg,throw_deg\n{}\n", rows.join("\n"));
        fs::write(folder.path().join("shots.csv"), csv).unwrap();
        let dataset = load(folder.path()).unwrap_or_else(|error| panic!("{error}\n{notes:?}"));
        let mut line = 2;
        for (shot, note) in dataset.shots.iter().zip(&notes) {
            assert_eq!((shot.labels["note"].as_str(), shot.line), (note.trim(), line));
            line += 1 + note.matches('\n').count();
        }
        assert_eq!(dataset.shots.len(), notes.len());
    }
}

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
fn load_tracks(whole: &Whole, bytes: &[u8], folder: &Path) -> Option<Tracks> {
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
    let count = count("CAROMFIT_FUZZ", 10_000) as u64;
    let folder = tempfile::tempdir().unwrap();
    let wholes = wholes();
    for number in 0..count {
        let mut random = ChaCha8Rng::seed_from_u64(number);
        let whole = wholes.choose(&mut random).unwrap();
        let settings = if random.random_bool(0.9) { whole } else { wholes.choose(&mut random).unwrap() };
        let bytes = mutate(&mut random, &whole.text);
        let tried = std::panic::catch_unwind(|| {
            let tracks = load_tracks(settings, &bytes, folder.path());
            let is_plain = whole.is_read_as_written() && settings.is_read_as_written();
            if let (Some(tracks), Ok(text), true) = (tracks, std::str::from_utf8(&bytes), is_plain) {
                assert_faithful(&tracks, text);
            }
        });
        let shown = String::from_utf8_lossy(&bytes);
        assert!(tried.is_ok(), "input {number}: {shown:?} with {}", settings.settings);
    }
}
