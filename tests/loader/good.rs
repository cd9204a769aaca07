//! Good input: how it may be written, and the numbers that become of it.

use std::path::Path;

use caromfit::io::load;
use caromfit::measurement::dataset::{Before, Dataset, Measured};
use caromfit::measurement::observable::{Axis, Observable};
use caromfit::measurement::parameter::{Parameter, Prior};
use caromfit::measurement::spin::Spin;
use caromfit::physics::ball::{Ball, Vec3};

use super::{ANGLES, HITS, IMPACTS, SHOTS, load_one, swap, write};

fn plain(value: f64) -> Measured {
    Measured { value, sd: None }
}

/// Name, line and first measured value of every shot.
fn summary(dataset: &Dataset) -> Vec<(&str, usize, f64)> {
    let first = |shot: &caromfit::measurement::dataset::Shot| shot.after[0].measured.value;
    dataset.shots.iter().map(|shot| (shot.name.as_str(), shot.line, first(shot))).collect()
}

#[test]
fn a_data_set_of_angles() {
    let dataset = load_one(ANGLES, SHOTS).unwrap();
    assert_eq!(dataset.name, "lab");
    assert_eq!((dataset.cloth.as_deref(), dataset.source.as_deref()), (Some("Simonis 860"), Some("us")));
    assert_eq!(dataset.ball, Ball { radius: 0.028_575, mass: 0.170, inertia: 0.4 });
    assert_eq!(dataset.by, None);
    let settings = &dataset.settings;
    assert_eq!((settings[Parameter::Mu].lower, settings[Parameter::Mu].upper), (0.0, 0.5));
    assert_eq!((settings[Parameter::MuS].initial, settings[Parameter::MuS].fixed), (0.3, true));
    assert_eq!(settings[Parameter::E].prior, Some(Prior { mean: 0.95, sd: 0.02 }));
    assert!(!settings[Parameter::E].fixed);

    let [first, _] = dataset.shots.as_slice() else { panic!("{:?}", dataset.shots) };
    assert_eq!((first.name.as_str(), first.line), ("1", 2));
    assert_eq!(first.file.file_name().unwrap(), "shots.csv");
    assert_eq!(first.before, Before::Angle { cut: plain(30.0_f64.to_radians()), speed: Some(plain(2.0)) });
    assert_eq!(first.spin, Spin::NaturalRoll);
    assert_eq!(first.after.len(), 1);
    assert_eq!(first.after[0].observable, Observable::Throw);
    let throw = Measured { value: 3.0_f64.to_radians(), sd: Some(0.1_f64.to_radians()) };
    assert_eq!(first.after[0].measured, throw);
}

#[test]
fn a_data_set_of_impacts() {
    let csv = "shot,nx,ny,nx_sd,cue_vx,cue_vy,cue_vx_sd,cue_vx_after,cue_vy_after,obj_vx_after,obj_vy_after,\
               obj_wz_after,cue_wx,cue_wy,cue_wz,cue_wy_sd,table\n\
               a,0.6,0.8,0.01,1.7,1.0,0.02,0.05,0.9,1.6,0.1,-3,1,2,3,0.5,left\n\
               b,0.6,0.8,,1.7,1.0,,0.05,0.9,1.6,0.1,,,,,,right\n";
    let dataset = load_one(IMPACTS, csv).unwrap();
    assert_eq!(dataset.ball, Ball::POOL);
    let [a, b] = dataset.shots.as_slice() else { panic!("{:?}", dataset.shots) };
    let normal = [Measured { value: 0.6, sd: Some(0.01) }, plain(0.8)];
    let velocity = [Measured { value: 1.7, sd: Some(0.02) }, plain(1.0)];
    assert_eq!(a.before, Before::Impact { normal, velocity });
    assert_eq!(a.spin, Spin::Measured { spin: Vec3::new(1.0, 2.0, 3.0), sd: [None, Some(0.5), None] });
    assert_eq!(b.spin, Spin::Stun, "an empty cell follows [cue_spin]");
    assert_eq!((a.after.len(), b.after.len()), (5, 4));
    assert_eq!(a.after[4].observable, Observable::ObjectSpin(Axis::Z));
    assert_eq!(a.after[4].measured, plain(-3.0));
    assert_eq!((a.labels.len(), a.labels["table"].as_str()), (1, "left"));
}

#[test]
fn a_line_of_centres_is_made_a_unit_vector() {
    let dataset = load_one(IMPACTS, swap(HITS, "a,1,0", "a,0.6004,0.7998")).unwrap();
    let Before::Impact { normal: [x, y], .. } = dataset.shots[0].before else { panic!() };
    // two roundings
    assert!((x.value.hypot(y.value) - 1.0).abs() < 2.0 * f64::EPSILON);
}

#[test]
fn ways_to_write_a_table() {
    for (what, csv, expected) in [
        ("byte order mark", format!("\u{feff}{SHOTS}"), [2, 3]),
        ("carriage returns", SHOTS.replace('\n', "\r\n"), [2, 3]),
        ("old carriage returns", SHOTS.replace('\n', "\r"), [2, 3]),
        ("semicolons and decimal commas", SHOTS.replace(',', ";").replace('.', ","), [2, 3]),
        ("tabs", SHOTS.replace(',', "\t"), [2, 3]),
        ("told separator", format!("sep=;\n{}", SHOTS.replace(',', ";")), [3, 4]),
        ("no line end", SHOTS.trim_end().to_string(), [2, 3]),
        ("comments", format!("# one, \"two\n  # three\n{}#four", SHOTS.replace("\n2", "\n#five\n2")), [4, 6]),
        ("blank lines", format!("\n \n{}\n\n , ,\t,,\n", SHOTS.replace("\n2", "\n\n2")), [4, 6]),
        ("blanks", SHOTS.replace(',', " ,\t "), [2, 3]),
        ("quoted", format!("\"{}\"", SHOTS.replace(',', "\" , \"").replace('\n', "\"\n \"")), [2, 3]),
        ("numbers", SHOTS.replace("30", "+3e1").replace("45", "45."), [2, 3]),
        (
            "other order",
            "throw_deg,cut_deg,shot,throw_deg_sd\n3.0,30,1,0.1\n2.5,45,2,0.1".to_string(),
            [2, 3],
        ),
    ] {
        // the last quotation mark of "quoted" opens a cell of its own
        let csv = if what == "quoted" { csv.trim_end_matches(" \"\"").to_string() } else { csv };
        let dataset = load_one(ANGLES, &csv).unwrap_or_else(|error| panic!("{what}: {error}"));
        let [(one, line_1, first), (two, line_2, second)] = summary(&dataset)[..] else { panic!("{what}") };
        assert_eq!((one, two, [line_1, line_2]), ("1", "2", expected), "{what}");
        assert_eq!((first, second), (3.0_f64.to_radians(), 2.5_f64.to_radians()));
    }
}

#[test]
fn a_table_in_utf_16() {
    let utf16 = |mark: &[u8]| -> Vec<u8> {
        mark.iter().copied().chain(SHOTS.encode_utf16().flat_map(u16::to_le_bytes)).collect()
    };
    for mark in [&b"\xff\xfe"[..], b""] {
        let dataset = load_one(ANGLES, utf16(mark)).unwrap();
        assert_eq!(summary(&dataset)[1], ("2", 3, 2.5_f64.to_radians()));
    }
}

#[test]
fn quoted_cells_and_labels() {
    let csv = "shot,cut_deg,throw_deg,note,\"who, when\"\n\
               \"a, b\",30,3,\"two\nlines, a \"\"word\"\"\",2 1/4\" ball\n\
               c,45,2.5,,Åsa\n";
    let dataset = load_one(ANGLES, csv).unwrap();
    let lines: Vec<_> = dataset.shots.iter().map(|shot| (shot.name.as_str(), shot.line)).collect();
    assert_eq!(lines, [("a, b", 2), ("c", 4)]);
    let labels =
        |i: usize| dataset.shots[i].labels.iter().map(|(k, v)| (k.as_str(), v.as_str())).collect::<Vec<_>>();
    assert_eq!(labels(0), [("note", "two\nlines, a \"word\""), ("who, when", "2 1/4\" ball")]);
    assert_eq!(labels(1), [("note", ""), ("who, when", "Åsa")]);
}

#[test]
fn a_column_of_spins_overrides_dataset_toml() {
    let csv = "cut_deg,cue_spin,omega_x,omega_y,omega_z,throw_deg\n\
               30,stun,,,,3\n30,natural-roll,,,,3\n30,unknown,,,,3\n30,,,,,3\n30,,1,-2,3e1,3\n30,measured,0,0,0,3\n";
    let dataset = load_one(&swap(ANGLES, "natural-roll", "stun"), csv).unwrap();
    let spins: Vec<_> = dataset.shots.iter().map(|shot| shot.spin).collect();
    let measured = |x, y, z| Spin::Measured { spin: Vec3::new(x, y, z), sd: [None; 3] };
    let expected = [
        Spin::Stun,
        Spin::NaturalRoll,
        Spin::Unknown,
        Spin::Stun,
        measured(1.0, -2.0, 30.0),
        measured(0.0, 0.0, 0.0),
    ];
    assert_eq!(spins, expected);
    let toml = swap(ANGLES, "[cue_spin]\nassume = \"natural-roll\"\n", "");
    assert_eq!(load_one(&toml, "cut_deg,cue_spin,throw_deg\n30,stun,3\n").unwrap().shots[0].spin, Spin::Stun);
}

#[test]
fn several_files() {
    let folder = tempfile::tempdir().unwrap();
    // characters that mean something in a pattern
    let folder = folder.path().join("lab [1]*");
    let toml = swap(ANGLES, "[\"shots.csv\"]", "[\"day-*/*.csv\", \"day-1/b.csv\", \"more.csv\"]");
    write(
        &folder,
        &[
            ("dataset.toml", toml.as_bytes()),
            ("day-1/b.csv", b"cut_deg,throw_deg\n30,1\n30,2\n"),
            ("day-1/a.csv", b"cut_deg,throw_deg\n30,0\n"),
            ("day-2/c.csv", b"throw_deg,cut_deg,shot\n3,30,x\n"),
            ("more.csv", b"shot,cut_deg,cue_turn_deg\n,30,40\n6,30,40\n2,30,50\n"),
            ("day-2/c.txt", b"nothing"),
        ],
    );
    let dataset = load(&folder).unwrap();
    let names: Vec<_> = dataset.shots.iter().map(|shot| shot.name.as_str()).collect();
    // a number that another file gives away is not taken
    assert_eq!(names, ["1", "2 (b.csv:2)", "3", "x", "5", "6", "2"]);
    let again = load(&folder.join("dataset.toml")).unwrap();
    assert_eq!(again.shots.len(), dataset.shots.len());
    assert_eq!(again.path, dataset.path);
}

#[test]
fn dataset_toml_with_byte_order_mark_and_carriage_returns() {
    let toml = format!("\u{feff}{}", ANGLES.replace('\n', "\r\n"));
    assert_eq!(load_one(&toml, SHOTS).unwrap().shots.len(), 2);
    let error = load_one(&swap(&toml, "\"lab\"", "\"l/ab\""), SHOTS).unwrap_err();
    assert_eq!((error.problems()[0].line, error.problems()[0].column.as_deref()), (Some(2), Some("8")));
}

#[test]
fn labels_to_fit_apart() {
    let toml = swap(ANGLES, "mu =", "by = \"ball set\"\nmu =");
    let dataset = load_one(&toml, "ball set,cut_deg,throw_deg\nold,30,3\nnew,30,2\n").unwrap();
    assert_eq!(dataset.by.as_deref(), Some("ball set"));
    assert_eq!(dataset.shots[1].labels["ball set"], "new");
    // also a column that is an input
    let dataset = load_one(&swap(&toml, "ball set", "cut_deg"), "cut_deg,throw_deg\n30.0,3\n").unwrap();
    assert_eq!(dataset.shots[0].labels["cut_deg"], "30.0");
}

#[test]
fn every_shipped_data_set_loads() {
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("data");
    let mut loaded = Vec::new();
    for entry in std::fs::read_dir(&data).unwrap() {
        let folder = entry.unwrap().path();
        if folder.join("dataset.toml").is_file() {
            let dataset = load(&folder).unwrap_or_else(|error| panic!("{error}"));
            assert_eq!(folder.file_name().unwrap().to_str().unwrap(), dataset.name);
            loaded.push(dataset);
        }
    }
    loaded.sort_by(|a, b| a.name.cmp(&b.name));
    let shots = |name: &str| {
        let found = loaded.iter().find(|dataset| dataset.name == name);
        &found.unwrap_or_else(|| panic!("{name} is missing")).shots
    };
    for (name, count) in [
        ("alciatore-2006", 39),
        ("alciatore-2014-speed", 5),
        ("alciatore-2014-treatments", 19),
        ("domenech-2023", 99),
        ("mathavan-2014", 5),
    ] {
        assert_eq!(shots(name).len(), count, "{name}");
    }
    let first = &shots("mathavan-2014")[0];
    let cut = plain(33.83_f64.to_radians());
    assert_eq!(first.before, Before::Angle { cut, speed: Some(plain(1.539)) });
    assert_eq!(first.after.len(), 3);
    assert_eq!(first.after[2].observable, Observable::CueTurnRolling);
    assert_eq!(first.after[2].measured, plain(35.96_f64.to_radians()));
    let slow = &shots("alciatore-2006")[1];
    assert_eq!((slow.labels["series"].as_str(), slow.spin), ("slow", Spin::Stun));
    assert_eq!(slow.after[0].measured, plain(0.194_f64.to_radians()));
    let unknown_speed = &shots("alciatore-2014-speed")[0];
    assert_eq!(unknown_speed.before, Before::Angle { cut: plain(30.0_f64.to_radians()), speed: None });
}
