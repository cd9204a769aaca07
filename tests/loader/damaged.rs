//! Damaged files of every format of tracks: no panic, no endless loop, and no position that the text does not hold.
//! `CAROMFIT_FUZZ=1000000` sets how many.

use std::fs;
use std::path::Path;

use caromfit::io::load_text;
use caromfit::measurement::dataset::Tracks;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::hostile::mutate;

const RATE: &str = "[video]\ncapture_fps = 100\n[tracks]\ncue = \"A\"\nobject = \"B\"";
const NO_RATE: &str = "[tracks]\ncue = \"A\"\nobject = \"B\"";
const PIXELS: &str = "[video]\ncapture_fps = 30\n[scale]\nlength_unit = \"px\"\nm_per_px = 0.001\ny_axis = \"down\"\n[tracks]\ncue = \"A\"\nobject = \"B\"";
const POINTS: &str = "[video]\ncapture_fps = 240\nplayback_fps = 30\nrow_readout_s = 0.004\nrows = 720\n[scale]\nlength_unit = \"px\"\ny_axis = \"down\"\n[[scale.point]]\npx = [0, 0]\nm = [0, 1]\n[[scale.point]]\npx = [100, 0]\nm = [1, 1]\n[[scale.point]]\npx = [100, 100]\nm = [1, 0]\n[[scale.point]]\npx = [0, 100]\nm = [0, 0]\n[tracks]\ncue = \"A\"\nobject = \"B\"";
const LONG_COLUMNS: &str = "[video]\ncapture_fps = 60\n[tracks]\ncue = \"A\"\nobject = \"B\"\n[tracks.columns]\nframe = \"frame\"\nball = \"disk_id\"\nx = \"cx\"\ny = \"cy\"\nmarker_x = \"mx\"\nmarker_y = \"my\"";
const WIDE_COLUMNS: &str = "[tracks]\ncue = \"A\"\nobject = \"B\"\n[tracks.columns]\nshot = \"n\"\nt = \"t\"\ncue_x = \"ax\"\ncue_y = \"ay\"\nobject_x = \"bx\"\nobject_y = \"by\"";
const NUMBERED_COLUMNS: &str = "[tracks]\ncue = \"A\"\nobject = \"B\"\n[tracks.columns]\nt = 1\ncue_x = 2\ncue_y = 3\nobject_x = 4\nobject_y = 5";

/// Files of every format, each with settings that it can be read by.
const FILES: [(&str, &str); 15] = [
    (
        RATE,
        "shot,frame,ball,x,y\n1,0,A,0.001,2\n1,0,B,0.3,0.01\n1,1,A,1.5e-3,2\n1,1,B,,\n2,4,A,1,2\n2,4,B,-3,4\n",
    ),
    (
        RATE,
        "# c\nt;ball;point;x;y;x_sd;y_sd\r\n0,01;A;centre;1,5;2;0,1;0,2\r\n0,01;A;m1;1,6;2;;\r\n0,01;B;;3;4;;\r\n0,02;A;;1,7;2;0,1;0,2\r\n0,02;B;;3;4;;\r\n",
    ),
    (
        RATE,
        "\u{feff}#multi:\n;mass A;;mass B;;\nt;x;y;x;y;\n0,00E0;\u{2212}1,55E1;5,5E0;1,95E0;3,2E0\n1,00E\u{2212}2;\u{2212}1,49E1;5,6E0;;\n2,0E\u{2212}2;\u{2212}1,4E1;5,7E0;1,9E0;3,2E0\n",
    ),
    (
        PIXELS,
        "\tmass_A\t\t\t\tmass B\nt\ty\tx\tv\tθ\tx\ty\n0.000\t1.5\t2\t\t\t3\t4\n0.033\t1.6\t2.1\t9\t1\t3\t4\n0.067\t1.7\t2.2\t\t\t\t\n0.100\t1.8\t2.2\t\t\t3\t4.5\n",
    ),
    (
        NO_RATE,
        "#Kinovea Trajectory data export\n#T X Y\n\n# A\n0.608 -84,99 -190,03 \n0.617 -79,24 -191,06 \n0.625 -76,86 -190,79 \n\n# B\n0.608 1,5 2,5 \n0.617 1,5 2,5 \n",
    ),
    (
        RATE,
        "\"Time\",\"A/0/X\",\"A/0/Y\",\"B/0/X\",\"B/0/Y\"\n\"0\",\"1,5\",\"2\",\"3\",\"4\"\n\"1\",\"1,6\",\"2,1\",\"\",\"\"\n\"2\",\"1,7\",\"2,2\",\"3\",\"4\"\n",
    ),
    (
        RATE,
        "#T X Y\n# A\n0:00:00:00 1 2\n0:00:00:01 1.5 2\n0:00:00:02 2.5 2\n# B\n0:00:00:00 5 2\n0:00:00:01 5 2\n0:00:00:02 5 2\n",
    ),
    (
        NO_RATE,
        "NO_OF_FRAMES\t3\nNO_OF_MARKERS\t2\nFREQUENCY\t500\nDATA_INCLUDED\t3D\nMARKER_NAMES\tA\tB\nA X\tA Y\tA Z\tB X\tB Y\tB Z\t\n1.5\t2\t-1\t3\t4\t5\n1.6\t2\t-1\t0.000\t0.000\t0.000\n1.7\t2\t-1\t3\t4\t5\n",
    ),
    (
        LONG_COLUMNS,
        "frame,disk_id,cx,cy,mx,my,r\n133,A,866.19,7.05,871.3,24.5,53\n133,B,1,2,3,4,5\n134,A,857.9,22.3,860.9,41.6,54\n134,B,1,2,3,4,5\n",
    ),
    (WIDE_COLUMNS, "n|t|ax|ay|bx|by\n1|0.00|1|2|3|4\n1|0.01|1.1|2|3|4\n2|0.02|1.2|2|3|4\n"),
    (NUMBERED_COLUMNS, "by hand\n0.00  1 2 3 4\n0.01  1.1 2 3 4\n0.02  1.2 2 3 4\n"),
    (
        NO_RATE,
        "sep=;\na title\n\nt;ball;x [cm];y\nms;;;cm\n10;A;1,5;2\n10;B;3;4\n30;A;1,7;2\n20;A;1,6;2\n20;B;3;4\n",
    ),
    (
        NO_RATE,
        "FILE_VERSION\t2.0.0\nNO_OF_FRAMES\t2\nFREQUENCY\t100\nMARKER_NAMES\tA\tB\nTRAJECTORY_TYPES\tMixed\tMixed\n1.5\t2\t-1\t3\t4\t5\n1.6\t2\t-1\t3.5\t4\t5\n",
    ),
    (
        NO_RATE,
        "[{\"name\": \"1\", \"fps\": 100, \"balls\": [\n{\"name\": \"A\", \"samples\": [{\"frame\": 0, \"x\": 1.5, \"y\": 2},\n{\"frame\": 1, \"x\": null, \"y\": 2}]},\n{\"name\": \"B\", \"samples\": [{\"frame\": 0, \"x\": 3, \"y\": 4}]}]}]\n",
    ),
    (
        POINTS,
        "shot,frame,ball,x,y\n1,0,A,0.001,2\n1,0,B,0.3,0.01\n1,1,A,1.5e-3,2\n1,1,B,,\n2,4,A,1,2\n2,4,B,-3,4\n",
    ),
];

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
    for (settings, text) in FILES {
        let tracks = load(settings, text.as_bytes(), folder.path());
        assert!(tracks.is_some_and(|tracks| !tracks.shots.is_empty()), "{text}");
    }
}

#[test]
fn damaged_files_give_no_position_that_they_do_not_hold() {
    let count = std::env::var("CAROMFIT_FUZZ").ok().and_then(|n| n.parse().ok()).unwrap_or(10_000_u64);
    let folder = tempfile::tempdir().unwrap();
    for number in 0..count {
        let mut random = ChaCha8Rng::seed_from_u64(number);
        let (settings, text) = FILES[random.random_range(0..FILES.len())];
        let settings =
            if random.random_bool(0.9) { settings } else { FILES[random.random_range(0..FILES.len())].0 };
        let bytes = mutate(&mut random, text);
        let tried = std::panic::catch_unwind(|| {
            let tracks = load(settings, &bytes, folder.path());
            // a sample of JSON may be spread over lines; other lengths are converted
            let is_plain = ![PIXELS, POINTS].contains(&settings) && !text.starts_with('[');
            if let (Some(tracks), Ok(text), true) = (tracks, std::str::from_utf8(&bytes), is_plain) {
                assert_faithful(&tracks, text);
            }
        });
        let shown = String::from_utf8_lossy(&bytes);
        assert!(tried.is_ok(), "input {number}: {shown:?} with {settings}");
    }
}
