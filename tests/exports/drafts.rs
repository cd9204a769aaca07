//! `caromfit init` on what people export: what it drafts is read.

use std::fs;
use std::process::Command;

/// Writes files of these names and contents, in any encoding, and drafts for their folder; what it says.
pub fn init<T: AsRef<[u8]>>(files: &[(&str, T)]) -> (tempfile::TempDir, String) {
    let folder = tempfile::tempdir().unwrap();
    for (name, content) in files {
        let path = folder.path().join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, content).unwrap();
    }
    let output =
        Command::new(env!("CARGO_BIN_EXE_caromfit")).arg("init").arg(folder.path()).output().unwrap();
    assert_eq!(output.status.code(), Some(0), "{output:?}");
    let said = String::from_utf8(output.stdout).unwrap();
    (folder, said)
}

/// Drafts for files of these names and contents, with lines of the draft replaced, and loads what was drafted.
pub fn drafted<T: AsRef<[u8]>>(
    files: &[(&str, T)],
    fill: &[(&str, &str)],
    expected: &[&str],
) -> caromfit::measurement::dataset::Tracks {
    let (folder, _) = init(files);
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

pub const FPS: (&str, &str) = ("# capture_fps = …", "capture_fps = 100");
pub const SPIN: (&str, &str) = ("# assume = \"…\"", "assume = \"stun\"");

/// A row per frame of two balls, the first of which runs into the other, with `more` cells.
pub fn rows(separator: &str, frames: u32, row: impl Fn(u32, f64, f64) -> Vec<String>) -> String {
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
    let expected = [
        "format = \"columns\"",
        "t = \"Time [s]\"",
        // the second pair of columns is the ball that moves first
        "the ball of column \"x2 [cm]\" moves first, and so is the cue ball",
        "cue_y = \"y2 [cm]\"",
        "object_x = \"x1 [cm]\"",
        "length_unit = \"cm\"",
        "follow 100 frames",
    ];
    let tracks = drafted(&[("s.csv", &format!("{head}{table}"))], &[FPS, SPIN], &expected);
    assert_eq!((tracks.shots[0].cue[10].x, tracks.shots[0].object[0].y), (0.1, 0.5));
    // without names
    let numbers = table.replace(';', "\t");
    let expected = ["t = 1", "cue_x = 4", "length_unit = \"…\""];
    let tracks = drafted(
        &[("s.txt", &numbers)],
        &[FPS, SPIN, ("# length_unit = \"…\"", "length_unit = \"cm\"")],
        &expected,
    );
    assert_eq!(tracks.shots[0].cue[10].x, 0.1);
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
        "moves first, and so is the cue ball",
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
    let tracks = drafted(&[("kick.csv", long.as_str()), ("shots.csv", shots)], &[], &expected);
    assert_eq!((tracks.shots[0].name.as_str(), tracks.shots[0].fps), ("first", 480.0));
}

/// A film of both balls in a wide table, in parts of a metre.
fn wide(head: &str, of_metre: f64) -> String {
    let cells = |n: u32, a: f64, b: f64| {
        let lengths = [a, 0.5, b - 0.0029, 0.5].map(|x| format!("{:.4}", of_metre * x));
        [vec![format!("{:.2}", 0.01 * f64::from(n))], lengths.to_vec()].concat()
    };
    format!("{head}\n{}", rows(",", 60, cells))
}

/// Positions are metres only where the balls come as near as balls do.
#[test]
fn a_unit_that_the_balls_speak_against_is_asked_for() {
    let said = |head: &str, of_metre: f64| {
        let (folder, said) = init(&[("s.csv", &wide(head, of_metre))]);
        (said, fs::read_to_string(folder.path().join("dataset.toml")).unwrap())
    };
    let (_, draft) = said("t,x1,y1,x2,y2", 1.0);
    assert!(draft.contains("length_unit = \"m\"") && draft.contains("radius_m = 0.028575"), "{draft}");
    let (found, draft) = said("t,x1,y1,x2,y2", 1.0 / 0.3048);
    assert!(
        found.contains("not the diameter of a ball in metres; in feet they would come as near as 57.1 mm"),
        "{found}"
    );
    assert!(draft.contains("# length_unit = \"…\"") && draft.contains("radius_m = 0.028575"), "{draft}");
    let (found, draft) = said("t,x1 [dm],y1 [dm],x2 [dm],y2 [dm]", 10.0);
    assert!(found.contains("dm is not a known unit"), "{found}");
    assert!(draft.contains("# length_unit = \"…\""), "{draft}");
}

#[test]
fn times_that_are_no_seconds() {
    let film = |time: f64| {
        wide("t,x1,y1,x2,y2", 1.0)
            .lines()
            .enumerate()
            .map(|(n, line)| match line.split_once(',') {
                Some((_, rest)) if n > 0 => format!("{},{rest}\n", time * n as f64),
                _ => format!("{line}\n"),
            })
            .collect::<String>()
    };
    let fps = |fps| ("# capture_fps = …", fps);
    for (step, rate, unit) in [
        (4.0, "capture_fps = 250", "ms"),
        (1.0, "capture_fps = 250", "frames"),
        (4000.0, "capture_fps = 250", "us"),
    ] {
        let expected = format!("time_unit = \"{unit}\"");
        let tracks = drafted(&[("s.csv", &film(step))], &[fps(rate), SPIN], &[&expected]);
        assert_eq!(tracks.shots[0].fps, 250.0, "{unit}");
    }
}

/// What lies beside the tables is named and left out; tables may be one folder further down, and be called alike there.
#[test]
fn folders_as_people_have_them() {
    let film = wide("t,x1,y1,x2,y2", 1.0);
    let beside =
        [("s.csv", film.as_str()), ("README.txt", "Our shots.\n"), ("list.csv", "shot,comment\nS1,ok\n")];
    let (folder, said) = init(&beside);
    assert!(said.contains("README.txt: no table") && said.contains("list.csv: no table"), "{said}");
    let draft = fs::read_to_string(folder.path().join("dataset.toml")).unwrap();
    assert!(draft.contains("files = [\"s.csv\"]"), "{draft}");
    let below = [("A/1.csv", film.as_str()), ("B/1.csv", film.as_str())];
    let tracks = drafted(&below, &[FPS, SPIN], &["files = [\"A/1.csv\", \"B/1.csv\"]"]);
    assert_eq!([&tracks.shots[0].name, &tracks.shots[1].name], ["A/1", "B/1"]);
    let one = |folder: &str| {
        (
            format!("{folder}/1.csv"),
            film.lines()
                .map(|line| {
                    let cells: Vec<&str> = line.split(',').collect();
                    let first = if folder == "cue" { 1 } else { 3 };
                    format!(
                        "{},{},{}\n",
                        cells[0],
                        cells[first].replace("x1", "x"),
                        cells[first + 1].replace("y1", "y")
                    )
                })
                .collect::<String>()
                .replace("x2", "x")
                .replace("y2", "y"),
        )
    };
    let balls = [one("cue"), one("object")];
    let balls: Vec<(&str, &str)> = balls.iter().map(|(name, text)| (name.as_str(), text.as_str())).collect();
    let names = [("# cue = \"…\"", "cue = \"cue\""), ("# object = \"…\"", "object = \"object\"")];
    let fill: Vec<_> = [FPS, SPIN].into_iter().chain(names).collect();
    let tracks = drafted(&balls, &fill, &[]);
    assert_eq!((tracks.shots.len(), tracks.shots[0].name.as_str()), (1, "1"));
}

/// A header of several lines is shown whole, and columns may be given by their number.
#[test]
fn a_table_in_no_known_format() {
    let table: String = (0..5).map(|n| format!("{n},1.5,2.5,0.9,3.5,4.5,0.9\n")).collect();
    let head = "scorer,net,net,net,net,net,net\nparts,cue,cue,cue,obj,obj,obj\ncoords,p,q,like,p,q,like\n";
    let (folder, said) = init(&[("s.csv", &format!("{head}{table}"))]);
    assert!(said.contains("by its name or by its number"), "{said}");
    let draft = fs::read_to_string(folder.path().join("dataset.toml")).unwrap();
    for fragment in [
        "#   parts,cue,cue,cue,obj,obj,obj",
        "1: 0  2: 1.5",
        "# ball = …",
        "y_axis = \"up\"",
        "or by its number, t = 1",
    ] {
        assert!(draft.contains(fragment), "{fragment}:\n{draft}");
    }
}
