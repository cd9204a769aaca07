//! Damaged and random input: loading ends with a data set or with an error that says something; no panic, no endless loop, and no position
//! that the text does not hold. `CAROMFIT_FUZZ=1000000` sets how many files.

use caromfit::io::load;
use rand::seq::IteratorRandom;

use crate::films_as_text::write_all;
use crate::loading::accepted;
use crate::prelude::*;

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

fn noise(rng: &mut ChaCha8Rng) -> Vec<u8> {
    /// More than a table of the shipped data has in a line.
    const LONGEST: usize = 200;
    let length = rng.random_range(0..LONGEST);
    if rng.random_bool(0.5) {
        (0..length).map(|_| rng.random()).collect()
    } else {
        (0..length / 4).flat_map(|_| PIECES[rng.random_range(0..PIECES.len())].bytes()).collect()
    }
}

/// A cell holds what was put into it, whatever that is.
#[test]
fn any_text_survives_in_a_quoted_cell() {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("dataset.toml"), &accepted("tables.toml")[0]["dataset.toml"]).unwrap();
    for _ in 0..1000 {
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

/// The files of a case, written down.
struct Written {
    texts: BTreeMap<String, String>,
    folder: tempfile::TempDir,
}

impl Written {
    fn new(texts: BTreeMap<String, String>) -> Self {
        let folder = tempfile::tempdir().unwrap();
        write_all(folder.path(), texts.clone());
        Self { texts, folder }
    }

    /// Whether positions are those of the text of its only table but for a power of ten: neither converted nor from several lines or cells.
    fn is_read_as_written(&self) -> bool {
        const CONVERTED: [&str; 5] = ["px", "\"in\"", "\"ft\"", "y_axis", "cue = ["];
        let settings = &self.texts["dataset.toml"];
        let is_json = self.texts.values().any(|text| text.starts_with(['[', '{']));
        self.texts.len() == 2 && !is_json && !CONVERTED.iter().any(|word| settings.contains(word))
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
    // a carriage return ends a line, or is a blank in it
    let lines: Vec<Vec<f64>> = text.split(['\n', '\r']).chain(text.split('\n')).map(numbers).collect();
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

/// What every loaded data set promises, and every error.
fn check(loaded: &Result<Dataset, io::DatasetError>) {
    match loaded {
        Ok(dataset) => {
            assert_eq!(dataset.faults(), Vec::<String>::new());
            assert!(!dataset.shots.is_empty() || dataset.tracks.is_some());
            assert!(dataset.shots.iter().all(|shot| !shot.name.is_empty() && shot.line > 1));
        }
        Err(error) => {
            assert!(!error.problems().is_empty());
            for problem in error.problems() {
                assert!(!problem.message.is_empty() && problem.line != Some(0), "{problem:?}");
            }
        }
    }
}

#[test]
fn damaged_files_are_refused_with_a_reason_or_read_as_they_are() {
    let count = count("CAROMFIT_FUZZ", 12_000) as u64;
    let books = ["tables.toml", "programs.toml", "positions.toml", "times.toml"];
    let all: Vec<Written> = books.into_iter().flat_map(accepted).map(Written::new).collect();
    let mut read = 0;
    for number in 0..count {
        let mut random = ChaCha8Rng::seed_from_u64(number);
        let case = all.iter().choose(&mut random).unwrap();
        let (name, text) = case.texts.iter().choose(&mut random).unwrap();
        // mostly damaged, else that of another case or nothing known
        let bytes = match random.random_range(0..10) {
            0 => noise(&mut random),
            1 => mutate(&mut random, all[number as usize % all.len()].texts.values().next_back().unwrap()),
            _ => mutate(&mut random, text),
        };
        let tried = std::panic::catch_unwind(|| {
            fs::write(case.folder.path().join(name), &bytes).unwrap();
            let loaded = load(case.folder.path());
            check(&loaded);
            let tracks = loaded.as_ref().ok().and_then(|dataset| dataset.tracks.as_ref());
            let is_plain = name != "dataset.toml" && case.is_read_as_written();
            if let (Some(tracks), Ok(text), true) = (tracks, std::str::from_utf8(&bytes), is_plain) {
                assert_faithful(tracks, text);
            }
            loaded.is_ok()
        });
        fs::write(case.folder.path().join(name), text).unwrap();
        let shown = String::from_utf8_lossy(&bytes);
        read += u64::from(tried.unwrap_or_else(|_| panic!("input {number}, {name}: {shown:?}")));
    }
    // the mutations are neither all fatal nor all harmless
    assert!((count / 50..count / 2).contains(&read), "{read}");
}
