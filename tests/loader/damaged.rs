//! Damaged files of every format of tracks: no panic, no endless loop, and no position that the text does not hold.
//! `CAROMFIT_FUZZ=1000000` sets how many.

use std::fs;
use std::path::Path;

use caromfit::io::load_text;
use caromfit::measurement::dataset::Tracks;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::hostile::mutate;

/// Settings, with ↵ for the end of a line.
const SETTINGS: &str = r#"
[video]↵capture_fps = 100↵[tracks]↵cue = "A"↵object = "B"
[tracks]↵cue = "A"↵object = "B"
[video]↵capture_fps = 30↵[scale]↵length_unit = "px"↵m_per_px = 0.001↵y_axis = "down"↵[tracks]↵cue = "A"↵object = "B"
[video]↵capture_fps = 240↵playback_fps = 30↵row_readout_s = 0.004↵rows = 720↵[scale]↵length_unit = "px"↵y_axis = "down"↵[[scale.point]]↵px = [0, 0]↵m = [0, 1]↵[[scale.point]]↵px = [100, 0]↵m = [1, 1]↵[[scale.point]]↵px = [100, 100]↵m = [1, 0]↵[[scale.point]]↵px = [0, 100]↵m = [0, 0]↵[tracks]↵cue = "A"↵object = "B"
[video]↵capture_fps = 60↵[tracks]↵cue = "A"↵object = "B"↵[tracks.columns]↵frame = "frame"↵ball = "disk_id"↵x = "cx"↵y = "cy"↵marker_x = "mx"↵marker_y = "my"
[tracks]↵cue = "A"↵object = "B"↵[tracks.columns]↵shot = "n"↵t = "t"↵cue_x = "ax"↵cue_y = "ay"↵object_x = "bx"↵object_y = "by"
[tracks]↵cue = "A"↵object = "B"↵[tracks.columns]↵t = 1↵cue_x = 2↵cue_y = 3↵object_x = 4↵object_y = 5"#;

/// In pixels and by points, lengths are converted.
const CONVERTED: [usize; 2] = [2, 3];

/// Files of every format, each with the number of settings that it can be read by; ⇥ is a tab, ␍ a carriage return, § a byte order mark.
const FILES: &str = r#"
0 ¦ shot,frame,ball,x,y↵1,0,A,0.001,2↵1,0,B,0.3,0.01↵1,1,A,1.5e-3,2↵1,1,B,,↵2,4,A,1,2↵2,4,B,-3,4↵
0 ¦ # c↵t;ball;point;x;y;x_sd;y_sd␍↵0,01;A;centre;1,5;2;0,1;0,2␍↵0,01;A;m1;1,6;2;;␍↵0,01;B;;3;4;;␍↵0,02;A;;1,7;2;0,1;0,2␍↵0,02;B;;3;4;;␍↵
0 ¦ §#multi:↵;mass A;;mass B;;↵t;x;y;x;y;↵0,00E0;−1,55E1;5,5E0;1,95E0;3,2E0↵1,00E−2;−1,49E1;5,6E0;;↵2,0E−2;−1,4E1;5,7E0;1,9E0;3,2E0↵
2 ¦ ⇥mass_A⇥⇥⇥⇥mass B↵t⇥y⇥x⇥v⇥θ⇥x⇥y↵0.000⇥1.5⇥2⇥⇥⇥3⇥4↵0.033⇥1.6⇥2.1⇥9⇥1⇥3⇥4↵0.067⇥1.7⇥2.2⇥⇥⇥⇥↵0.100⇥1.8⇥2.2⇥⇥⇥3⇥4.5↵
1 ¦ #Kinovea Trajectory data export↵#T X Y↵↵# A↵0.608 -84,99 -190,03 ↵0.617 -79,24 -191,06 ↵0.625 -76,86 -190,79 ↵↵# B↵0.608 1,5 2,5 ↵0.617 1,5 2,5 ↵
0 ¦ "Time","A/0/X","A/0/Y","B/0/X","B/0/Y"↵"0","1,5","2","3","4"↵"1","1,6","2,1","",""↵"2","1,7","2,2","3","4"↵
0 ¦ #T X Y↵# A↵0:00:00:00 1 2↵0:00:00:01 1.5 2↵0:00:00:02 2.5 2↵# B↵0:00:00:00 5 2↵0:00:00:01 5 2↵0:00:00:02 5 2↵
1 ¦ NO_OF_FRAMES⇥3↵NO_OF_MARKERS⇥2↵FREQUENCY⇥500↵DATA_INCLUDED⇥3D↵MARKER_NAMES⇥A⇥B↵A X⇥A Y⇥A Z⇥B X⇥B Y⇥B Z⇥↵1.5⇥2⇥-1⇥3⇥4⇥5↵1.6⇥2⇥-1⇥0.000⇥0.000⇥0.000↵1.7⇥2⇥-1⇥3⇥4⇥5↵
4 ¦ frame,disk_id,cx,cy,mx,my,r↵133,A,866.19,7.05,871.3,24.5,53↵133,B,1,2,3,4,5↵134,A,857.9,22.3,860.9,41.6,54↵134,B,1,2,3,4,5↵
5 ¦ n|t|ax|ay|bx|by↵1|0.00|1|2|3|4↵1|0.01|1.1|2|3|4↵2|0.02|1.2|2|3|4↵2|0.03|1.3|2|3|4↵
6 ¦ by hand↵0.00  1 2 3 4↵0.01  1.1 2 3 4↵0.02  1.2 2 3 4↵
1 ¦ sep=;↵a title↵↵t;ball;x [cm];y↵ms;;;cm↵10;A;1,5;2↵10;B;3;4↵30;A;1,7;2↵20;A;1,6;2↵20;B;3;4↵
1 ¦ FILE_VERSION⇥2.0.0↵NO_OF_FRAMES⇥2↵FREQUENCY⇥100↵MARKER_NAMES⇥A⇥B↵TRAJECTORY_TYPES⇥Mixed⇥Mixed↵1.5⇥2⇥-1⇥3⇥4⇥5↵1.6⇥2⇥-1⇥3.5⇥4⇥5↵
1 ¦ [{"name": "1", "fps": 100, "balls": [↵{"name": "A", "samples": [{"frame": 0, "x": 1.5, "y": 2},↵{"frame": 1, "x": null, "y": 2}]},↵{"name": "B", "samples": [{"frame": 0, "x": 3, "y": 4}]}]}]↵
3 ¦ shot,frame,ball,x,y↵1,0,A,0.001,2↵1,0,B,0.3,0.01↵1,1,A,1.5e-3,2↵1,1,B,,↵2,4,A,1,2↵2,4,B,-3,4↵"#;

/// The lines of a table with what its marks stand for.
fn lines(table: &str) -> Vec<String> {
    let plain =
        |line: &str| line.replace('↵', "\n").replace('⇥', "\t").replace('␍', "\r").replace('§', "\u{feff}");
    table.trim_start().lines().map(plain).collect()
}

/// Files, each with the number of its settings.
fn files() -> Vec<(usize, String)> {
    let mut files: Vec<(usize, String)> = Vec::new();
    for line in lines(FILES) {
        let (settings, text) = line.split_once(" ¦ ").unwrap();
        files.push((settings.parse().unwrap(), text.to_string()));
    }
    files
}

/// Loads a file; checks that it is refused for a reason, or read as it is written.
fn load(settings: &str, bytes: &[u8], folder: &Path) -> Option<Tracks> {
    let file = folder.join("a.txt");
    fs::write(&file, bytes).unwrap();
    let manifest = format!(
        "name = \"m\"\nkind = \"tracks\"\nfiles = [\"a.txt\"]\n[cue_spin]\nassume = \"unknown\"\n{settings}"
    );
    match load_text(&manifest, &folder.join("dataset.toml")) {
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

/// Checks that both coordinates of every position stand in one line, in metres or millimetres.
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
fn whole_files_are_read() {
    let folder = tempfile::tempdir().unwrap();
    let settings = lines(SETTINGS);
    for (number, text) in files() {
        let tracks = load(&settings[number], text.as_bytes(), folder.path());
        assert!(tracks.is_some_and(|tracks| !tracks.shots.is_empty()), "{text}");
    }
}

#[test]
fn damaged_files_give_no_position_that_they_do_not_hold() {
    let count = std::env::var("CAROMFIT_FUZZ").ok().and_then(|n| n.parse().ok()).unwrap_or(10_000_u64);
    let folder = tempfile::tempdir().unwrap();
    let (files, all) = (files(), lines(SETTINGS));
    for number in 0..count {
        let mut random = ChaCha8Rng::seed_from_u64(number);
        let (own, text) = &files[random.random_range(0..files.len())];
        let settings =
            if random.random_bool(0.9) { *own } else { files[random.random_range(0..files.len())].0 };
        let bytes = mutate(&mut random, text);
        let tried = std::panic::catch_unwind(|| {
            let tracks = load(&all[settings], &bytes, folder.path());
            // a sample of JSON may be spread over lines; other lengths are converted
            let is_plain = !CONVERTED.contains(&settings) && !text.starts_with('[');
            if let (Some(tracks), Ok(text), true) = (tracks, std::str::from_utf8(&bytes), is_plain) {
                assert_faithful(&tracks, text);
            }
        });
        let shown = String::from_utf8_lossy(&bytes);
        assert!(tried.is_ok(), "input {number}: {shown:?} with {}", all[settings]);
    }
}
