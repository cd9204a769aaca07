//! `caromfit init` on what people export: what it drafts is read.

use std::fs;
use std::process::Command;

/// Drafts for files of these names and contents, with lines of the draft replaced, and loads what was drafted.
fn drafted(
    files: &[(&str, &str)],
    fill: &[(&str, &str)],
    expected: &[&str],
) -> caromfit::measurement::dataset::Tracks {
    let folder = tempfile::tempdir().unwrap();
    for (name, content) in files {
        fs::write(folder.path().join(name), content).unwrap();
    }
    let output =
        Command::new(env!("CARGO_BIN_EXE_caromfit")).arg("init").arg(folder.path()).output().unwrap();
    assert_eq!(output.status.code(), Some(0), "{output:?}");
    let path = folder.path().join("dataset.toml");
    let mut draft = fs::read_to_string(&path).unwrap();
    for fragment in expected {
        assert!(draft.contains(fragment), "{fragment}:\n{draft}");
    }
    for (from, to) in fill {
        assert!(draft.contains(from), "{from}:\n{draft}");
        draft = draft.replacen(from, to, 1);
    }
    fs::write(&path, &draft).unwrap();
    let dataset = caromfit::io::load(folder.path()).unwrap_or_else(|error| panic!("{error}\n{draft}"));
    dataset.tracks.unwrap()
}

const FPS: (&str, &str) = ("# capture_fps = …", "capture_fps = 100");
const SPIN: (&str, &str) = ("# assume = \"…\"", "assume = \"stun\"");

/// A row per frame of two balls, the first of which runs into the other, with `more` cells.
fn rows(separator: &str, frames: u32, row: impl Fn(u32, f64, f64) -> Vec<String>) -> String {
    let line = |n: u32| {
        let cue = 0.01 * f64::from(n.min(20));
        let object = 0.26 + 0.009 * f64::from(n.max(20) - 20);
        row(n, cue, object).join(separator) + "\n"
    };
    (0..frames).map(line).collect()
}

#[test]
fn spreadsheets_of_any_names() {
    let table = rows(";", 40, |n, a, b| {
        vec![
            format!("{:.2}", 0.01 * f64::from(n)),
            format!("{:.2}", 100.0 * b),
            "50".into(),
            format!("{:.2}", 100.0 * a),
            "50".into(),
        ]
    });
    let head = "sep=;\nMonday, third try\nTime [s];x1 [cm];y1 [cm];x2 [cm];y2 [cm]\n";
    // the second pair of columns is the ball that moves first
    let exchange = [
        ("cue_x = \"x1", "object_x = \"x1"),
        ("cue_y = \"y1", "object_y = \"y1"),
        ("object_x = \"x2", "cue_x = \"x2"),
        ("object_y = \"y2", "cue_y = \"y2"),
    ];
    let fill: Vec<_> = [FPS, SPIN].into_iter().chain(exchange).collect();
    let expected = [
        "format = \"columns\"",
        "t = \"Time [s]\"",
        "exchange them",
        "length_unit = \"cm\"",
        "follow 100 frames",
    ];
    let tracks = drafted(&[("s.csv", &format!("{head}{table}"))], &fill, &expected);
    assert_eq!((tracks.shots[0].cue[10].x, tracks.shots[0].object[0].y), (0.1, 0.5));
    // without names
    let numbers = table.replace(';', "\t");
    let expected = ["t = 1", "cue_x = 2", "length_unit = \"…\""];
    let tracks = drafted(
        &[("s.txt", &numbers)],
        &[FPS, SPIN, ("# length_unit = \"…\"", "length_unit = \"cm\"")],
        &expected,
    );
    assert_eq!(tracks.shots[0].object[10].x, 0.1);
}

#[test]
fn discs_with_angles_and_discs_of_markers() {
    let table = rows(",", 40, |n, a, b| {
        let n = f64::from(n);
        vec![a.to_string(), "0.5".into(), (0.2 * n).to_string(), b.to_string(), "0.52".into(), "2".into()]
    });
    let head = "c_a_x,c_a_y,ang_a,c_b_x,c_b_y,ang_b\n";
    let expected = [
        "shape = \"disc\"",
        "cue_angle = \"ang_a\"",
        "angle_unit = \"rad\"",
        "length_unit = \"m\" ",
        "that of cue_x, cue_y",
    ];
    let tracks = drafted(&[("102.csv", &format!("{head}{table}"))], &[FPS], expected.as_slice());
    assert!(tracks.discs.is_some());
    assert_eq!((tracks.shots[0].markers.len(), tracks.shots[0].cue.len()), (2, 40));

    // six markers in any order, other ones on each disc in each file
    let film = |order: [usize; 6]| {
        let rows = rows("\t", 60, |n, a, b| {
            let point = |i: usize| {
                let (centre, turn) = if i < 3 { (a, 0.02) } else { (b, -0.03) };
                let (sin, cos) = (2.2 * i as f64 + turn * f64::from(n)).sin_cos();
                [1e3 * centre + 23.0 * cos, 500.0 + 23.0 * sin, 0.0].map(|x| format!("{x:.3}"))
            };
            order.iter().flat_map(|i| point(*i)).collect()
        });
        format!(
            "FILE_VERSION\t2.0.0\nNO_OF_FRAMES\t60\nFREQUENCY\t500\nMARKER_NAMES\tp\tq\tr\ts\tt\tu\n{rows}"
        )
    };
    let files = [("1.tsv", film([0, 1, 2, 3, 4, 5])), ("2.tsv", film([3, 0, 4, 1, 5, 2]))];
    let files: Vec<(&str, &str)> = files.iter().map(|(name, text)| (*name, text.as_str())).collect();
    let expected = ["shape = \"disc\"", "capture_fps = 500", "length_unit = \"mm\"", "found for every shot"];
    let tracks = drafted(&files, &[], &expected);
    for (shot, cue) in tracks.shots.iter().zip([["p", "q", "r"], ["q", "s", "u"]]) {
        let own = |marker: &&caromfit::measurement::track::Marker| {
            marker.ball == caromfit::measurement::track::TrackedBall::Cue
        };
        let names: Vec<_> = shot.markers.iter().filter(own).map(|marker| marker.name.as_str()).collect();
        assert_eq!(names, cue);
        // the centre of the circle, in files written to a micrometre
        assert!((shot.cue[10].x - 0.1).abs() < 3e-6 && (shot.object[10].x - 0.26).abs() < 3e-6);
    }
}

#[test]
fn json_and_a_table_of_shots() {
    let ball = |name: &str, x: f64| {
        let samples: Vec<String> = (0..9)
            .map(|n| format!("{{\"frame\": {n}, \"x\": {}, \"y\": 0.5}}", x + 0.01 * f64::from(n)))
            .collect();
        format!("{{\"name\": \"{name}\", \"samples\": [{}]}}", samples.join(","))
    };
    let web = format!(
        "[{{\"name\": \"k1\", \"fps\": 240, \"balls\": [{}, {}]}}]",
        ball("white", 0.0),
        ball("red", 0.5)
    );
    let names = [("# cue = \"…\"", "cue = \"white\""), ("# object = \"…\"", "object = \"red\"")];
    let fill: Vec<_> = [SPIN].into_iter().chain(names).collect();
    let tracks = drafted(&[("web.json", &web)], &fill, &["capture_fps = 240", "\"white\", \"red\""]);
    assert_eq!((tracks.shots[0].name.as_str(), tracks.shots[0].fps), ("k1", 240.0));

    let long: String =
        (0..9).map(|n| format!("{n},A,{},0.5\n{n},B,0.5,0.5\n", 0.01 * f64::from(n))).collect();
    let long = format!("frame,ball,x,y\n{long}");
    let shots = "shot,file,capture_fps,cue_spin\nfirst,kick.csv,480,stun\n";
    let expected = ["files = [\"kick.csv\"]", "\nshots = \"shots.csv\""];
    let tracks = drafted(&[("kick.csv", &long), ("shots.csv", shots)], &[], &expected);
    assert_eq!((tracks.shots[0].name.as_str(), tracks.shots[0].fps), ("first", 480.0));
}
