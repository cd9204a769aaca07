//! Damaged files of every format: no panic, no endless loop, and no number that the text does not hold.
//! `CAROMFIT_FUZZ=1000000` sets how many.

use std::collections::HashMap;
use std::path::Path;

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::finish::{self, Facts};
use super::input::Context;
use super::raw::{Notes, RawShot};
use super::settings::tests::settings;
use super::settings::{Format, TrackSettings};
use super::{bodies, calibration_for, read};
use crate::io::error::Problems;
use crate::io::text::{decode, lines};

const FILES: [&str; 14] = [
    "shot,frame,ball,x,y\n1,0,A,0.001,2\n1,0,B,0.3,0.01\n1,1,A,1.5e-3,2\n1,1,B,,\n2,4,A,1,2\n2,4,B,-3,4\n",
    "# c\nt;ball;point;x;y;x_sd;y_sd\r\n0,01;A;centre;1,5;2;0,1;0,2\r\n0,01;A;m1;1,6;2;;\r\n0,01;B;;3;4;;\r\n0,02;A;;1,7;2;0,1;0,2\r\n0,02;B;;3;4;;\r\n",
    "\u{feff}#multi:\n;mass A;;mass B;;\nt;x;y;x;y;\n0,00E0;\u{2212}1,55E1;5,5E0;1,95E0;3,2E0\n1,00E\u{2212}2;\u{2212}1,49E1;5,6E0;;\n2,0E\u{2212}2;\u{2212}1,4E1;5,7E0;1,9E0;3,2E0\n",
    "\tmass_A\t\t\t\tmass B\nt\ty\tx\tv\tθ\tx\ty\n0.000\t1.5\t2\t\t\t3\t4\n0.033\t1.6\t2.1\t9\t1\t3\t4\n0.067\t1.7\t2.2\t\t\t\t\n0.100\t1.8\t2.2\t\t\t3\t4.5\n",
    "#Kinovea Trajectory data export\n#T X Y\n\n# A\n0.608 -84,99 -190,03 \n0.617 -79,24 -191,06 \n0.625 -76,86 -190,79 \n\n# B\n0.608 1,5 2,5 \n0.617 1,5 2,5 \n",
    "\"Time\",\"A/0/X\",\"A/0/Y\",\"B/0/X\",\"B/0/Y\"\n\"0\",\"1,5\",\"2\",\"3\",\"4\"\n\"1\",\"1,6\",\"2,1\",\"\",\"\"\n\"2\",\"1,7\",\"2,2\",\"3\",\"4\"\n",
    "#T X Y\n# A\n0:00:00:00 1 2\n0:00:00:01 1.5 2\n0:00:00:01 2.5 2\n# B\n0:00:00:00 5 2\n0:00:00:01 5 2\n0:00:00:01 5 2\n",
    "NO_OF_FRAMES\t3\nNO_OF_MARKERS\t2\nFREQUENCY\t500\nDATA_INCLUDED\t3D\nMARKER_NAMES\tA\tB\nA X\tA Y\tA Z\tB X\tB Y\tB Z\t\n1.5\t2\t-1\t3\t4\t5\n1.6\t2\t-1\t0.000\t0.000\t0.000\n1.7\t2\t-1\t3\t4\t5\n",
    "frame,disk_id,cx,cy,mx,my,r\n133,A,866.19,7.05,871.3,24.5,53\n133,B,1,2,3,4,5\n134,A,857.9,22.3,860.9,41.6,54\n134,B,1,2,3,4,5\n",
    "n|t|ax|ay|bx|by\n1|0.00|1|2|3|4\n1|0.01|1.1|2|3|4\n2|0.02|1.2|2|3|4\n",
    "by hand\n0.00  1 2 3 4\n0.01  1.1 2 3 4\n0.02  1.2 2 3 4\n",
    "sep=;\na title\n\nt;ball;x [cm];y\nms;;;cm\n10;A;1,5;2\n10;B;3;4\n30;A;1,7;2\n20;A;1,6;2\n20;B;3;4\n",
    "FILE_VERSION\t2.0.0\nNO_OF_FRAMES\t2\nFREQUENCY\t100\nMARKER_NAMES\tA\tB\nTRAJECTORY_TYPES\tMixed\tMixed\n1.5\t2\t-1\t3\t4\t5\n1.6\t2\t-1\t3.5\t4\t5\n",
    "[{\"name\": \"1\", \"fps\": 100, \"balls\": [\n{\"name\": \"A\", \"samples\": [{\"frame\": 0, \"x\": 1.5, \"y\": 2},\n{\"frame\": 1, \"x\": null, \"y\": 2}]},\n{\"name\": \"B\", \"samples\": [{\"frame\": 0, \"x\": 3, \"y\": 4}]}]}]\n",
];

const SETTINGS: [&str; 7] = [
    "[video]\ncapture_fps = 100\n[tracks]\ncue = \"A\"\nobject = \"B\"",
    "[video]\ncapture_fps = 30\n[scale]\nlength_unit = \"px\"\nm_per_px = 0.001\ny_axis = \"down\"\n[tracks]\ncue = \"A\"\nobject = \"B\"",
    "[tracks]\ncue = \"A\"\nobject = \"B\"",
    "[video]\ncapture_fps = 240\nplayback_fps = 30\nrow_readout_s = 0.004\nrows = 720\n[scale]\nlength_unit = \"px\"\ny_axis = \"down\"\n[[scale.point]]\npx = [0, 0]\nm = [0, 1]\n[[scale.point]]\npx = [100, 0]\nm = [1, 1]\n[[scale.point]]\npx = [100, 100]\nm = [1, 0]\n[[scale.point]]\npx = [0, 100]\nm = [0, 0]\n[tracks]\ncue = \"A\"\nobject = \"B\"",
    "[video]\ncapture_fps = 60\n[tracks]\ncue = \"A\"\nobject = \"B\"\n[tracks.columns]\nframe = \"frame\"\nball = \"disk_id\"\nx = \"cx\"\ny = \"cy\"\nmarker_x = \"mx\"\nmarker_y = \"my\"",
    "[tracks]\ncue = \"A\"\nobject = \"B\"\n[tracks.columns]\nshot = \"n\"\nt = \"t\"\ncue_x = \"ax\"\ncue_y = \"ay\"\nobject_x = \"bx\"\nobject_y = \"by\"",
    "[tracks]\ncue = \"A\"\nobject = \"B\"\n[tracks.columns]\nt = 1\ncue_x = 2\ncue_y = 3\nobject_x = 4\nobject_y = 5",
];

const PIECES: [&str; 34] = [
    "\n",
    "\r\n",
    "\r",
    "\t",
    ";",
    ",",
    " ",
    "|",
    "\"",
    "\"\"",
    "#",
    "# A",
    ".",
    "-",
    "\u{2212}",
    "+",
    "e",
    "E5",
    "1e999",
    "nan",
    "inf",
    ":",
    "0:00:00:01",
    "0",
    "1,5",
    "1.5",
    "1.000,5",
    "A",
    "B",
    "\u{feff}",
    "\0",
    "99999999999999999999",
    "é",
    "x",
];

/// Damages a file.
fn damage(random: &mut ChaCha8Rng, bytes: &mut Vec<u8>) {
    for _ in 0..random.random_range(0..5) {
        let at = random.random_range(0..=bytes.len());
        let end = (at + random.random_range(0..8)).min(bytes.len());
        match random.random_range(0..8) {
            0 => drop(bytes.drain(at..end)),
            1 => bytes.truncate(at),
            2 => {
                let piece = PIECES[random.random_range(0..PIECES.len())];
                drop(bytes.splice(at..at, piece.bytes()));
            }
            3 => {
                let piece = PIECES[random.random_range(0..PIECES.len())];
                drop(bytes.splice(at..end, piece.bytes()));
            }
            4 if at < bytes.len() => bytes[at] = random.random(),
            5 => {
                // a line again, elsewhere
                let all: Vec<Vec<u8>> = bytes.split_inclusive(|b| *b == b'\n').map(<[u8]>::to_vec).collect();
                if !all.is_empty() {
                    let line = all[random.random_range(0..all.len())].clone();
                    let mut all = all;
                    all.insert(random.random_range(0..=all.len()), line);
                    *bytes = all.concat();
                }
            }
            6 => {
                let (from, to) =
                    [(b',', b';'), (b'\t', b','), (b';', b'\t'), (b'.', b','), (b',', b'.'), (b'1', b'2')]
                        [random.random_range(0..6)];
                bytes.iter_mut().filter(|b| **b == from).for_each(|b| *b = to);
            }
            _ => {
                let other = FILES[random.random_range(0..FILES.len())].as_bytes();
                let from = random.random_range(0..other.len());
                drop(bytes.splice(at..end, other[from..].iter().copied()));
            }
        }
    }
}

/// Every number that a line can be said to hold.
fn numbers(line: &str) -> Vec<f64> {
    let plain = line.replace('\u{2212}', "-").replace('"', "").replace(['d', 'D'], "e");
    let mut found = Vec::new();
    found.extend(plain.split_whitespace().filter_map(|cell| cell.replace(',', ".").parse::<f64>().ok()));
    for separators in [&['\t'][..], &[';'], &[','], &['|'], &[' ']] {
        for cell in plain.split(separators) {
            found.extend(cell.trim().replace(',', ".").parse::<f64>());
        }
    }
    // quoted cells with a comma inside, commas between
    found.extend(
        line.split('"')
            .filter_map(|cell| cell.trim().replace('\u{2212}', "-").replace(',', ".").parse::<f64>().ok()),
    );
    found
}

/// Checks that rows hold what their lines say.
fn faithful(shots: &[RawShot], text: &str) {
    let all: Vec<(usize, &str)> = lines(text).collect();
    for track in shots.iter().flat_map(|shot| &shot.tracks) {
        assert!(track.sds.is_empty() || track.sds.len() == track.rows.len());
        for row in track.seen() {
            let line = all[row.line - 1].1;
            let held = numbers(line);
            for value in [row.x, row.y] {
                assert!(held.contains(&value), "{value} is not in {line:?} (line {})", row.line);
            }
        }
    }
}

/// Reads a file and makes shots of it; checks what must hold.
fn try_one(bytes: &[u8], settings: &TrackSettings) {
    let file = Path::new("a.txt");
    let (problems, notes) = (Problems::new(""), Notes::default());
    let context = Context { settings, problems: &problems, notes: &notes };
    let Some(read::Tracked { shots, format, unit }) = read::bytes(file, bytes, context) else {
        assert!(!problems.is_empty(), "refused without a reason");
        return;
    };
    // of JSON, a sample may be spread over lines
    if format != Format::Json {
        faithful(&shots, &decode(bytes).0);
    }
    let calibration = calibration_for(format, unit, file, context);
    let mut work: Vec<_> = shots.into_iter().map(|raw| (raw, Facts::unknown())).collect();
    let calibrations = HashMap::from([(file.to_path_buf(), calibration.clone())]);
    bodies::group(&mut work, settings, &calibrations, None);
    for (raw, facts) in work {
        let Ok(shot) = finish::shot(raw, facts, settings, &calibration, &notes) else { continue };
        assert!(shot.fps > 0.0);
        let markers = shot.markers.iter().map(|marker| &marker.samples);
        for samples in [&shot.cue, &shot.object].into_iter().chain(markers) {
            assert!(samples.iter().all(|s| s.t.is_finite() && s.x.is_finite() && s.y.is_finite()));
        }
    }
}

#[test]
fn damaged_files() {
    let count = std::env::var("CAROMFIT_FUZZ").ok().and_then(|n| n.parse().ok()).unwrap_or(10_000_u64);
    let settings = SETTINGS.map(settings);
    for number in 0..count {
        let mut random = ChaCha8Rng::seed_from_u64(number);
        let which = random.random_range(0..FILES.len());
        let mut bytes = FILES[which].as_bytes().to_vec();
        damage(&mut random, &mut bytes);
        let own = which.saturating_sub(4);
        let chosen = if (4..settings.len()).contains(&own) && random.random_bool(0.9) {
            own
        } else {
            random.random_range(0..settings.len())
        };
        let settings = &settings[chosen];
        let tried = std::panic::catch_unwind(|| try_one(&bytes, settings));
        assert!(
            tried.is_ok(),
            "input {number}: {:?} with {}",
            String::from_utf8_lossy(&bytes),
            SETTINGS[chosen]
        );
    }
}

#[test]
fn whole_files_are_read() {
    for (i, text) in FILES.iter().enumerate() {
        let chosen = match i {
            8..=10 => i - 4,
            // rounded to ms, at 30 fps
            3 => 1,
            4 | 7 | 11..=13 => 2,
            _ => 0,
        };
        let settings = settings(SETTINGS[chosen]);
        let (problems, notes) = (Problems::new(""), Notes::default());
        let context = Context { settings: &settings, problems: &problems, notes: &notes };
        let read::Tracked { shots, .. } =
            read::bytes(Path::new("a.txt"), text.as_bytes(), context).unwrap_or_else(|| panic!("file {i}"));
        assert!(problems.is_empty(), "file {i}: {}", problems.into_error());
        assert!(!shots.is_empty() && shots.iter().all(|shot| !shot.tracks.is_empty()), "file {i}");
    }
}
