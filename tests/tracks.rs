//! Tracks: every quirk of the formats, in small files of our own.

use std::fs;

use caromfit::io;
use caromfit::measurement::correction::Correction;
use caromfit::measurement::dataset::{Measured, Tracks};
use caromfit::measurement::spin::Spin;
use caromfit::measurement::track::{Sample, TrackedBall};

/// Loads files of these names and contents.
pub fn load(settings: &str, files: &[(&str, &[u8])]) -> Result<Tracks, String> {
    let folder = tempfile::tempdir().unwrap();
    for (name, content) in files {
        fs::write(folder.path().join(name), content).unwrap();
    }
    let names: Vec<_> = files.iter().map(|(name, _)| *name).filter(|name| *name != "shots.csv").collect();
    let spin = if settings.contains("cue_spin") { "" } else { "[cue_spin]\nassume = \"natural-roll\"\n" };
    let manifest = format!("name = \"t\"\nkind = \"tracks\"\nfiles = {names:?}\n{spin}{settings}\n");
    fs::write(folder.path().join("dataset.toml"), manifest).unwrap();
    let prefix = format!("{}/", folder.path().display());
    match io::load(folder.path()) {
        Ok(dataset) => {
            let mut tracks = dataset.tracks.unwrap();
            for note in &mut tracks.notes {
                *note = note.replace(&prefix, "");
            }
            Ok(tracks)
        }
        Err(error) => Err(error.to_string().replace(&prefix, "")),
    }
}

pub fn good(settings: &str, file: &str, content: &str) -> Tracks {
    load(settings, &[(file, content.as_bytes())]).unwrap_or_else(|error| panic!("{error}"))
}

#[track_caller]
pub fn refused(settings: &str, content: &str, parts: &[&str]) {
    let error = load(settings, &[("a.txt", content.as_bytes())]).expect_err("is refused");
    for part in parts {
        assert!(error.contains(part), "{part:?} is not in: {error}");
    }
}

#[track_caller]
pub fn noted(tracks: &Tracks, part: &str) {
    assert!(tracks.notes.iter().any(|note| note.contains(part)), "{part:?} is not in: {:#?}", tracks.notes);
}

pub fn at(t: f64, x: f64, y: f64) -> Sample {
    Sample { t, x, y, sd: None }
}

#[test]
fn long_table() {
    let text = "shot,frame,ball,x,y\n1,0,cue,0,0\n1,0,object,0.3,0.01\n1,1,cue,0.001,0\n1,1,object,,\n1,2,cue,0.002,0\n1,2,object,0.3,0.01\n2,5,cue,1,2\n2,5,object,3,4\n";
    let tracks = good("[video]\ncapture_fps = 1000", "a.csv", text);
    assert_eq!(tracks.shots.len(), 2);
    let shot = &tracks.shots[0];
    assert_eq!((shot.name.as_str(), shot.line, shot.fps), ("1", 2, 1000.0));
    assert_eq!(shot.cue, [at(0.0, 0.0, 0.0), at(0.001, 0.001, 0.0), at(0.002, 0.002, 0.0)]);
    assert_eq!(shot.object, [at(0.0, 0.3, 0.01), at(0.002, 0.3, 0.01)]);
    assert_eq!(tracks.shots[1].cue, [at(0.005, 1.0, 2.0)]);
    assert_eq!(shot.spin, Spin::NaturalRoll);
    refused("", text, &["capture_fps"]);
    // without a column of shots, a file is one; markers and standard deviations; cm, y down
    let text = "frame,ball,point,x,y,x_sd,y_sd\n0,A,centre,1,2,0.1,0.2\n0,A,m1,1.5,2,,\n0,B,,5,5,0.1,0.1\n";
    let settings = "[video]\ncapture_fps = 500\n[scale]\nlength_unit = \"cm\"\ny_axis = \"down\"\n[tracks]\ncue = \"A\"\nobject = \"B\"\nposition_sd_m = 1e-4";
    let tracks = good(settings, "shot 7.csv", text);
    let shot = &tracks.shots[0];
    assert_eq!(shot.name, "shot 7");
    assert_eq!(shot.cue[0].sd, Some([0.001, 0.002]));
    assert_eq!((shot.cue[0].x, shot.cue[0].y), (0.01, -0.02));
    assert_eq!((shot.markers[0].ball, shot.markers[0].name.as_str()), (TrackedBall::Cue, "m1"));
    assert_eq!(shot.position_sd, Some(1e-4));
    refused(
        "[video]\ncapture_fps = 10",
        "shot,frame,ball,x,y\n1,0,cue,0,zero\n",
        &["a.txt:2: column y: \"zero\""],
    );
    refused(
        "[video]\ncapture_fps = 10",
        "shot,frame,ball,x,y\n1,0,cue,0\n",
        &["a.txt:2", "4 cells; expected 5"],
    );
    refused(
        "[video]\ncapture_fps = 10",
        "shot,frame,ball,x,y\n1,0,cue,0,1\n1,0,obj,0,1\n",
        &["no track \"object\"", "\"obj\""],
    );
}

#[test]
fn tracker_exports() {
    let settings =
        "[video]\ncapture_fps = 100\n[scale]\nlength_unit = \"cm\"\n[tracks]\ncue = \"A\"\nobject = \"B\"";
    let multi = "\u{feff}#multi:\r\n;mass A;;mass B;;\r\nt;x;y;x;y;\r\n0,000000E0;\u{2212}1,5E1;5,5E0;1,9E0;3,2E0\r\n1,000000E\u{2212}2;\u{2212}1,4E1;5,6E0;;\r\n2,000000E\u{2212}2;\u{2212}1,3E1;5,7E0;1,9E0;3,2E0\r\n";
    let tracks = good(settings, "kick.txt", multi);
    let shot = &tracks.shots[0];
    assert_eq!(shot.name, "kick");
    assert_eq!(shot.cue.len(), 3);
    assert_eq!(shot.object, [at(0.0, 0.019, 0.032), at(0.02, 0.019, 0.032)]);
    assert_eq!(shot.cue[1], at(0.01, -0.14, 5.6 / 100.0));
    noted(&tracks, "semicolons");
    noted(&tracks, "decimal comma");
    noted(&tracks, "\"mass A\" is [tracks] cue");
    // other separators, other orders of columns, further columns
    for sep in ["\t", ",", " ", "|"] {
        let text = "#multi:\n,mass_A,,,mass_B,,,\nt,y,x,v,x,y,θ,\n0,1,2,,3,4,7\n0.01,1,2.1,99,3,4,7\n0.02,1,2.2,99,,,\n".replace(',', sep);
        let tracks = good(settings, "s.txt", &text);
        assert_eq!(tracks.shots[0].cue[1], at(0.01, 0.021, 0.01), "{sep:?}");
        assert_eq!(tracks.shots[0].object.len(), 2);
    }
    refused(settings, "#multi:\n;A;;B;\nt;x;y;x;y\n", &["no rows"]);
    // one track, copied
    refused(settings, "\tmass_C\nt\tx\ty\n0.0\t1\t2\n0.01\t1\t2\n", &["no track \"A\"", "\"mass_C\""]);
    refused(settings, "t\ty\tx\n0.0\t1\t2\n0.01\t1\t2\n", &["no track \"B\"", "there are: \"a\""]);
    refused(
        settings,
        "#multi:\n,A,,B,,\nt,x,y,x,y\n0,0,1,5,1,5,1,5,1,5\n",
        &["10 cells; expected 5", "decimal commas"],
    );
    refused(
        settings,
        "#multi:\n;A;;B;\nt;x;y;x;y\n0;1,5;2;3;4\n0,01;1.5;2;3;4\n",
        &["decimal point, but line 4"],
    );
    refused(
        settings,
        "#multi:\n;A;;A;\nt;x;y;x;y\n0;1;2;3;4\n0,01;1;2;3;4\n",
        &["2 tracks are named \"A\"", "A (2)"],
    );
    let twice = settings.replace("\"A\"", "\"A (1)\"").replace("\"B\"", "\"A (2)\"");
    let tracks = good(&twice, "a.txt", "#multi:\n;A;;A;\nt;x;y;x;y\n0;1;2;3;4\n0,01;1;2;3;4\n");
    assert_eq!(tracks.shots[0].cue[0], at(0.0, 0.01, 0.02));
    let twice = settings.replace("\"A\"", "\"A (2)\"").replace("\"B\"", "\"A (1)\"");
    let tracks = good(&twice, "a.txt", "#multi:\n;A;;A;\nt;x;y;x;y\n0;1;2;3;4\n0,01;1;2;3;4\n");
    assert_eq!(tracks.shots[0].cue[0], at(0.0, 0.03, 0.04));
}

const AB: &str = "[tracks]\ncue = \"A\"\nobject = \"B\"\n";

/// A Tracker export of a ball that runs into another at rest, `rows` of time and positions.
fn export(times: &[&str], cue: &[[f64; 2]], object: &[[f64; 2]]) -> String {
    let mut text = "#multi:\n\tA\t\tB\t\nt\tx\ty\tx\ty\n".to_string();
    for ((t, a), b) in times.iter().zip(cue).zip(object) {
        text.push_str(&format!("{t}\t{}\t{}\t{}\t{}\n", a[0], a[1], b[0], b[1]));
    }
    text
}

fn straight(n: usize) -> (Vec<[f64; 2]>, Vec<[f64; 2]>) {
    let cue = (0..n).map(|i| [0.0101 * i as f64, 0.2 + 0.003 * (i as f64).sin()]).collect();
    let object = (0..n).map(|i| [0.5 + 1e-4 * (i as f64).cos(), 0.9]).collect();
    (cue, object)
}

#[test]
fn kinovea_exports() {
    let text = "#Kinovea Trajectory data export\n#T X Y\n\n# A\n0.608 -84,99 -190,03 \n0.617 -79,24 -191,06 \n0.625 -76,86 -190,79 \n\n# B\n0.617 1,5 2,5 \n0.625 1,5 2,5 \n";
    let settings = format!("[video]\ncapture_fps = 120\n[scale]\nlength_unit = \"cm\"\n{AB}");
    let tracks = good(&settings, "k.txt", text);
    let shot = &tracks.shots[0];
    assert_eq!(shot.cue[0], at(73.0 / 120.0, -0.8499, -1.9003));
    assert_eq!(shot.object[1], at(75.0 / 120.0, 0.015, 0.025));
    noted(&tracks, "in the coordinates, not in the times");
    noted(&tracks, "filtered");
    noted(&tracks, "frame number / capture_fps (120)");
    let text = text.replace("# B", "# A");
    refused(&settings, &text, &["2 tracks are named \"A\"", "\"A (1)\" (line 5), \"A (2)\" (line 10)"]);
    let csv = "\"Time\";\"A/0/X\";\"A/0/Y\";\"B/0/X\";\"B/0/Y\"\n\"0\";\"1,5\";\"2\";\"3\";\"4\"\n\"4\";\"1,6\";\"2,1\";\"\";\"\"\n\"8\";\"1,7\";\"2,2\";\"3\";\"4\"\n\"13\";\"1,7\";\"2,2\";\"3\";\"4\"\n\"17\";\"1,7\";\"2,2\";\"3\";\"4\"\n";
    let tracks = good(&settings.replace("120", "240"), "k.csv", csv);
    let times: Vec<_> = tracks.shots[0].cue.iter().map(|s| s.t * 240.0).collect();
    assert!(times.iter().enumerate().all(|(i, t)| (t - i as f64).abs() < 1e-9), "{times:?}");
    assert_eq!(tracks.shots[0].object.len(), 4);
    refused(&settings, csv, &["neither a frame", "time_unit"]);
    refused(&settings.replace("capture_fps = 120", ""), csv, &["capture_fps", "time_unit"]);
    // frames
    let frames = csv
        .replace("\"4\";\"1,6", "\"1\";\"1,6")
        .replace("\"8\"", "\"2\"")
        .replace("\"13\"", "\"3\"")
        .replace("\"17\"", "\"4\"");
    assert_eq!(good(&settings, "k.csv", &frames).shots[0].cue[1].t, 1.0 / 120.0);
    // commas between cells and in them
    let commas = csv.replace(';', ",");
    assert_eq!(good(&settings.replace("120", "240"), "k.csv", &commas).shots[0].cue[1].x, 0.016);
    // the clock, coarser than the frames: rows are counted
    let mut text = "#T X Y\n".to_string();
    for name in ["A", "B"] {
        text.push_str(&format!("# {name}\n"));
        for i in 0..12 {
            text.push_str(
                &format!("0:00:01:{:02} {i} {name}\n", 100 * i / 240)
                    .replace(" A", " 5")
                    .replace(" B", " 90"),
            );
        }
    }
    let tracks = good(&settings.replace("120", "240"), "k.txt", &text);
    assert!((tracks.shots[0].cue[11].t - 1.0 - 11.0 / 240.0).abs() < 1e-12);
    noted(&tracks, "number of the row");
    refused(&settings.replace("120", "300"), &text, &["coarser than frames"]);
}

#[test]
fn qualisys_exports() {
    let text = "NO_OF_FRAMES\t2\nFREQUENCY\t500\nMARKER_NAMES\ta1\ta2\tB\na1 X\ta1 Y\ta1 Z\ta2 X\ta2 Y\ta2 Z\tB X\tB Y\tB Z\t\n100\t10\t0\t200\t30\t0\t5\t6\t7\n101\t10\t0\t201\t30\t0\t0.000\t0.000\t0.000\n";
    let settings = "[tracks]\ncue = [\"a1\", \"a2\"]\nobject = \"B\"";
    let tracks = good(settings, "q.tsv", text);
    let shot = &tracks.shots[0];
    assert_eq!((shot.fps, shot.cue[1]), (500.0, at(0.002, 0.151, 0.02)));
    assert_eq!((shot.object.len(), shot.markers.len(), shot.markers[1].samples[0].x), (1, 2, 0.2));
    noted(&tracks, "\"B\" is at 0, 0");
    refused(&format!("[video]\ncapture_fps = 100\n{settings}"), text, &["500 fps", "capture_fps is 100"]);
    refused(&format!("[scale]\nlength_unit = \"cm\"\n{settings}"), text, &["which is in mm"]);
    refused(settings, &text.replace("FREQUENCY", "FREQ"), &["FREQUENCY is missing"]);
}

#[test]
fn mapped_columns() {
    let wide = "a comment\nshot no;frame;ax;ay;bx;by\n7;0;1,5;2;3;4\n7;1;1,6;2;;\n8;0;1;2;3;4\n";
    let columns = "[tracks.columns]\nshot = \"shot no\"\nframe = \"frame\"\ncue_x = \"ax\"\ncue_y = \"ay\"\nobject_x = \"bx\"\nobject_y = \"by\"";
    let settings = format!("[video]\ncapture_fps = 10\n{columns}");
    let tracks = good(&settings, "w.csv", wide);
    assert_eq!((tracks.shots[0].name.as_str(), tracks.shots[0].cue[1]), ("7", at(0.1, 1.6, 2.0)));
    assert_eq!((tracks.shots.len(), tracks.shots[0].object.len()), (2, 1));
    refused(&settings.replace("\"ay\"", "\"az\""), wide, &["a.txt:2", "\"az\" is missing"]);
    refused(&settings.replace("cue_y = \"ay\"\n", ""), wide, &["dataset.toml", "cue_y"]);
    let long = "133,0,866.5,7,871,24\n134,0,857,22,860,41\n133,1,1,2,3,4\n";
    let long = format!("f,id,cx,cy,mx,my\n{long}");
    let settings = "[video]\ncapture_fps = 60\n[scale]\nlength_unit = \"mm\"\n[tracks]\ncue = \"0\"\nobject = \"1\"\n[tracks.columns]\nframe = \"f\"\nball = \"id\"\nx = \"cx\"\ny = \"cy\"\nmarker_x = \"mx\"\nmarker_y = \"my\"";
    let tracks = good(settings, "l.csv", &long);
    assert_eq!(tracks.shots[0].cue[0], at(133.0 / 60.0, 0.8665, 0.007));
    assert_eq!(tracks.shots[0].markers[0].samples[1].x, 0.86);
    refused("", &long, &["no format begins like this", "[tracks.columns]"]);
}

#[test]
fn times_against_the_frame_rate() {
    let (cue, object) = straight(7);
    // rounded to ms, a frame missing
    let rounded = export(&["0.000", "0.033", "0.067", "0.100", "0.133", "0.200", "0.233"], &cue, &object);
    let tracks = good(&format!("[video]\ncapture_fps = 30\n{AB}"), "r.txt", &rounded);
    let times: Vec<_> = tracks.shots[0].cue.iter().map(|s| s.t).collect();
    assert_eq!(times, [0.0, 1.0, 2.0, 3.0, 4.0, 6.0, 7.0].map(|n| n / 30.0));
    // slow motion: the file follows the playback
    refused(
        &format!("[video]\ncapture_fps = 240\n{AB}"),
        &rounded,
        &["30.", "capture_fps is 240", "playback_fps"],
    );
    let tracks = good(&format!("[video]\ncapture_fps = 240\nplayback_fps = 30\n{AB}"), "r.txt", &rounded);
    assert_eq!((tracks.shots[0].fps, tracks.shots[0].cue[6].t), (240.0, 7.0 / 240.0));
    // without capture_fps, the times' own spacing
    let exact = export(&["0.5", "0.502", "0.504", "0.506", "0.508", "0.510", "0.512"], &cue, &object);
    let tracks = good(AB, "e.txt", &exact);
    assert!((tracks.shots[0].fps - 500.0).abs() < 1e-6);
    noted(&tracks, "capture_fps is not given");
    // every second frame tracked
    let settings = format!("[video]\ncapture_fps = 1000\nplayback_fps = 1000\n{AB}");
    assert_eq!(good(&settings, "e.txt", &exact).shots[0].cue[1].t, 0.502);
    // a camera that hiccups
    let odd = export(
        &["0.0", "0.0333333333", "0.0666666667", "0.1000000", "0.13833333333", "0.1716666667", "0.205"],
        &cue,
        &object,
    );
    let tracks = good(&format!("[video]\ncapture_fps = 30\n{AB}"), "o.txt", &odd);
    noted(&tracks, "taken as they are written");
    assert_eq!(tracks.shots[0].cue[6].t, 0.205);
    // a phone whose rate varies: the step in the middle of all is 5 % off their mean
    let varying = export(&["0.0", "0.0310", "0.0655", "0.0973", "0.1335", "0.1651", "0.2000"], &cue, &object);
    let tracks = good(&format!("[video]\ncapture_fps = 30\n{AB}"), "v.txt", &varying);
    noted(&tracks, "taken as they are written");
    assert_eq!(tracks.shots[0].cue[3].t, 0.0973);
    let rounded = export(&["0.00", "0.03", "0.11", "0.13", "0.19", "0.24", "0.25"], &cue, &object);
    refused(&format!("[video]\ncapture_fps = 30\n{AB}"), &rounded, &["a.txt:4"]);
    refused(AB, &rounded, &["not regularly spaced"]);
    let backwards = export(&["0.00", "0.01", "0.02", "0.00", "0.01", "0.02", "0.03"], &cue, &object);
    refused(&format!("[video]\ncapture_fps = 100\n{AB}"), &backwards, &["a.txt:7", "runs backwards"]);
    let reversed = export(&["0.06", "0.05", "0.04", "0.03", "0.02", "0.01", "0.00"], &cue, &object);
    let tracks = good(&format!("[video]\ncapture_fps = 100\n{AB}"), "b.txt", &reversed);
    assert_eq!((tracks.shots[0].cue[0].t, tracks.shots[0].cue[0].x), (0.0, cue[6][0]));
    let twice = export(&["0.00", "0.01", "0.02", "0.02", "0.03", "0.04", "0.05"], &cue, &object);
    refused(&format!("[video]\ncapture_fps = 100\n{AB}"), &twice, &["a.txt:7", "two places"]);
}

#[test]
fn repeated_frames_and_swapped_balls() {
    let settings = format!("[video]\ncapture_fps = 100\n{AB}");
    let times: Vec<String> = (0..12).map(|i| format!("{:.2}", f64::from(i) / 100.0)).collect();
    let times: Vec<&str> = times.iter().map(String::as_str).collect();
    let (mut cue, mut object) = straight(12);
    let tracks = good(&settings, "s.txt", &export(&times, &cue, &object));
    assert_eq!(tracks.shots[0].cue.len(), 12);
    let clean = tracks.shots[0].clone();
    // frame 5 shows frame 4 again
    let (first, second) = (cue.clone(), object.clone());
    (cue[5], object[5]) = (cue[4], object[4]);
    let tracks = good(&settings, "s.txt", &export(&times, &cue, &object));
    assert_eq!((tracks.shots[0].cue.len(), tracks.shots[0].object.len()), (11, 11));
    assert_eq!(tracks.shots[0].cue[5], clean.cue[6]);
    noted(&tracks, "s.txt:9: both balls are exactly where they were in line 8");
    // frame 4 comes twice and all others are late
    (cue, object) = (first.clone(), second.clone());
    cue.insert(5, cue[4]);
    object.insert(5, object[4]);
    refused(&settings, &export(&times, &cue, &object), &["a.txt:9", "renumbered"]);
    // the same row twice
    let mut rows = export(&times, &first, &second);
    let line = rows.lines().nth(6).unwrap().to_string();
    rows = rows.replace(&line, &format!("{line}\n{line}"));
    let tracks = good(&settings, "s.txt", &rows);
    assert_eq!(tracks.shots[0].cue, clean.cue);
    noted(&tracks, "has its time twice");
    // names exchanged from frame 7 on, and from 3 to 7
    for (from, until) in [(7, 12), (3, 7)] {
        (cue, object) = (first.clone(), second.clone());
        for i in from..until {
            std::mem::swap(&mut cue[i], &mut object[i]);
        }
        let tracks = good(&settings, "s.txt", &export(&times, &cue, &object));
        assert_eq!((&tracks.shots[0].cue, &tracks.shots[0].object), (&clean.cue, &clean.object));
        noted(&tracks, &format!("s.txt:{}: \"A\" and \"B\" have exchanged their names", from + 4));
    }
    // one stray position of one ball is no exchange
    (cue, object) = (first, second);
    cue[6] = object[6];
    assert_eq!(good(&settings, "s.txt", &export(&times, &cue, &object)).shots[0].cue[6].x, object[6][0]);
}

/// Whole pixels are said to be so in millimetres where a scale tells how long one is, else in pixels.
#[test]
fn coordinates_are_rounded_in_the_unit_that_is_known() {
    let mut text = "shot,frame,ball,x,y\n".to_owned();
    for frame in 0..40 {
        text.push_str(&format!(
            "1,{frame},cue,{},{}\n1,{frame},object,700,400\n",
            17 * frame,
            400 - 3 * frame
        ));
    }
    let scale = |more: &str| {
        format!("[video]\ncapture_fps = 100\n[scale]\nlength_unit = \"px\"\ny_axis = \"down\"\n{more}")
    };
    noted(
        &good(&scale(""), "a.csv", &text),
        "positions are rounded to 1.00 px: each errs by 0.29 px at least",
    );
    noted(
        &good(&scale("m_per_px = 0.002"), "a.csv", &text),
        "positions are rounded to 2.00 mm: each errs by 0.58 mm",
    );
    let mut fine = "shot,frame,ball,x,y\n".to_owned();
    for frame in 0..40 {
        let t = f64::from(frame);
        let [x, y] = [17.0 * t + 3.0 * (0.37 * t).sin(), 400.0 - 2.9 * t];
        fine.push_str(&format!("1,{frame},cue,{x:.2},{y:.2}\n1,{frame},object,700.02,400.01\n"));
    }
    let tracks = good(&scale(""), "a.csv", &fine);
    assert!(!tracks.notes.iter().any(|note| note.contains("rounded")), "{:?}", tracks.notes);
}

#[test]
fn table_of_shots() {
    let data = "shot,frame,ball,x,y\na,0,cue,0,0\na,0,object,1,0\nb,0,cue,0,0\nb,0,object,1,0\nc,0,cue,0,0\n";
    let with = |shots: &str, settings: &str| {
        let settings = format!("[video]\ncapture_fps = 100\n[tracks]\nshots = \"shots.csv\"\n{settings}");
        load(&settings, &[("d.csv", data.as_bytes()), ("shots.csv", shots.as_bytes())])
    };
    let shots = "shot,cue_spin,omega_x,omega_y,omega_z,skip,note,chalk\na,stun,,,,no,,blue\nb,,1,2,3,,,\nc,,,,,yes,object ball not seen,\n";
    let tracks = with(shots, "").unwrap();
    assert_eq!(tracks.left_out, [("c".to_string(), "skipped: object ball not seen".to_string())]);
    assert_eq!(tracks.shots[0].spin, Spin::Stun);
    assert_eq!(tracks.shots[0].labels["chalk"], "blue");
    assert!(matches!(tracks.shots[1].spin, Spin::Measured { spin, .. } if spin.y == 2.0));
    let error = |shots| with(shots, "").expect_err("is refused");
    assert!(error("shot,skip\nc,1\nd,1\n").contains("shots.csv:3: column shot: there is no shot \"d\""));
    assert!(error("shot,skip\nc,maybe\n").contains("neither true nor false"));
    assert!(error("shot,cue_spin\nc,stunned\n").contains("did you mean \"stun\""));
    assert!(error("shot,skip\n").contains("no rows"));
    let alone =
        load("[video]\ncapture_fps = 100\n[cue_spin]\nassume = \"unknown\"", &[("d.csv", data.as_bytes())]);
    // the others have both balls
    let alone = alone.unwrap();
    assert_eq!((alone.shots.len(), alone.left_out[0].0.as_str()), (2, "c"));
    assert!(alone.left_out[0].1.contains("d.csv:6: there is no track \"object\""), "{:?}", alone.left_out);
}

#[test]
fn no_spin_is_an_error() {
    let text = "frame,ball,x,y\n0,cue,0,0\n0,object,1,0\n";
    refused("[video]\ncapture_fps = 10\n[cue_spin]", text, &["the cue ball's spin of shot"]);
}

#[test]
fn settings_are_checked() {
    let data = "frame,ball,x,y\n0,cue,10,20\n0,object,30,40\n1,cue,11,20\n1,object,30,40\n";
    let video = "[video]\ncapture_fps = 100\n";
    for (settings, part) in [
        ("[video]\nfps = 3", "unknown key \"fps\""),
        ("[video]\ncapture_fps = -3", "capture_fps is -3"),
        ("[scale]\nm_per_px = 1e-3", "go with length_unit = \"px\""),
        ("[scale]\nlength_unit = \"inch\"", "unknown word \"inch\""),
        (
            "[scale]\nlength_unit = \"px\"\nm_per_px = 1\n[[scale.point]]\npx=[0,0]\nm=[0,0]",
            "expected one of them",
        ),
        ("[scale]\nlength_unit = \"px\"\n[[scale.point]]\npx=[0,0]\nm=[0,0]", "four or more"),
        ("[tracks]\ncue = 3", "name of a track, or a list"),
        ("[tracks]\ncue = \"A\"\nobject = [\"B\", \"A\"]", "both cue and object"),
        ("[tracks]\nformat = \"columns\"", "[tracks.columns]"),
        ("[tracks]\nformat = \"tracker\"", "expected an export of Tracker"),
        ("[video]\nplayback_fps = 30", "needs capture_fps"),
        ("[video]\ncapture_fps = 30\nrow_readout_s = 0.01\nrows = 100", "length_unit = \"px\" and y_axis"),
        ("[video]\ncapture_fps = 30\nrow_readout_s = 0.01", "go together"),
        ("[video]\ncapture_fps = 30\n[camera]\nshutter = 0.01", "go together"),
        ("[video]\ncapture_fps_sd = 1", "needs capture_fps beside it"),
        ("[video]\ncapture_fps = 30\ncapture_fps_sd = 0", "capture_fps_sd is 0; expected more than 0"),
        ("[table]\ntilt_sd = -1", "tilt_sd is -1; expected more than 0"),
        ("[camera]\nlense = 0.0", "unknown key \"lense\" (did you mean \"lens\"?)"),
        ("[camera]\nlens = 4", "camera.lens is 4; expected \"auto\", \"none\" or a part"),
        ("[camera]\nlens = { mean = 0.0, sd = 0 }", "expected \"auto\", \"none\" or a part"),
        ("[camera]\nlens = { mean = 0.0 }", "or { mean = …, sd = … }"),
    ] {
        refused(settings, data, &[part]);
    }
    // pixels of which nothing says what they mean: the balls do
    assert!(good(&format!("{video}[scale]\nlength_unit = \"px\""), "p.csv", data).from_balls);
    let settings = "[video]\ncapture_fps = 100\nrow_readout_s = 0.01\nrows = 1000\n[scale]\nlength_unit = \"px\"\nm_per_px = 0.001\ny_axis = \"down\"";
    let tracks = good(settings, "p.csv", data);
    let Sample { t, x, y, .. } = tracks.shots[0].cue[1];
    assert!((t - 0.0102).abs() < 1e-12 && (x - 0.011).abs() < 1e-12 && (y + 0.02).abs() < 1e-12);
    let points = "[scale]\nlength_unit = \"px\"\ny_axis = \"down\"\n[[scale.point]]\npx=[0,0]\nm=[0,1]\n[[scale.point]]\npx=[100,0]\nm=[1,1]\n[[scale.point]]\npx=[100,100]\nm=[1,0]\n[[scale.point]]\npx=[0,100]\nm=[0,0]";
    let tracks = good(&format!("{video}{points}"), "p.csv", data);
    assert!((tracks.shots[0].cue[0].x - 0.1).abs() < 1e-9 && (tracks.shots[0].cue[0].y - 0.8).abs() < 1e-9);
    noted(&tracks, "homography from 4 points");
    refused(&format!("{video}{}", points.replace("\"down\"", "\"up\"")), data, &["mirror image"]);
}

/// What is stated with an error is an unknown with this prior.
#[test]
fn statements_may_have_errors() {
    let data = "frame,ball,x,y\n0,cue,10,20\n0,object,30,40\n1,cue,11,20\n1,object,30,40\n";
    let settings = "[video]\ncapture_fps = 240\ncapture_fps_sd = 1.2\n[table]\ntilt_sd = 2e-4\n\
                    [camera]\nlabel = \"phone\"\nlens = { mean = 0.01, sd = 0.02 }\nperspective = { mean = [0, 0.1], sd = [0.2, 0.3] }\n\
                    shear = \"none\"\n[cue_spin]\nassume = \"stun\"\ntopspin_sd = 0.03";
    let tracks = good(settings, "p.csv", data);
    assert_eq!((tracks.rate_sd, tracks.tilt_sd, tracks.topspin_sd), (Some(0.005), Some(2e-4), Some(0.03)));
    for (which, stated) in [
        (Correction::Lens, Some(Measured::new(0.01, 0.02))),
        (Correction::LensX, None),
        (Correction::PerspectiveY, Some(Measured::new(0.1, 0.3))),
        (Correction::Shear, Some(Measured { value: 0.0, sd: None })),
        (Correction::Aspect, None),
    ] {
        assert_eq!(tracks.camera[which as usize], stated, "{which:?}");
    }
}

#[test]
fn two_files_of_one_ball_each_are_a_shot() {
    let settings = "[video]\ncapture_fps = 100\n[tracks]\ncue = \"A\"\nobject = \"B\"";
    let track = |name: &str, x: f64| format!("{name}\nt\tx\ty\n0.00\t{x}\t1\n0.01\t{x}\t2\n0.02\t{x}\t3\n");
    let (a, b) = (track("\tmass A", 1.0), track("\tmass B", 5.0));
    let (bare_a, bare_b) = (track("", 1.0), track("", 5.0));
    // by the track's name or by the file's
    for (first, second) in [(&a, &b), (&bare_a, &bare_b)] {
        let (first, second) = (first.as_bytes(), second.as_bytes());
        let files =
            [("kick 1-A.txt", first), ("kick 1-B.txt", second), ("2_b.txt", second), ("2_a.txt", first)];
        let tracks = load(settings, &files).unwrap();
        assert_eq!(tracks.shots.iter().map(|shot| shot.name.as_str()).collect::<Vec<_>>(), ["kick-1", "2"]);
        for shot in &tracks.shots {
            assert_eq!((shot.cue[2], shot.object[2]), (at(0.02, 1.0, 3.0), at(0.02, 5.0, 3.0)));
        }
        noted(&tracks, "kick 1-A.txt: is cue ball of the shot \"kick-1\", whose object ball is");
    }
    // two files in all need no names alike
    let tracks = load(settings, &[("one.txt", a.as_bytes()), ("other.txt", b.as_bytes())]).unwrap();
    assert_eq!((tracks.shots.len(), tracks.shots[0].name.as_str()), (1, "one"));
    // but of three or four it is not certain which go together
    let error = load(settings, &[("1.txt", a.as_bytes()), ("2.txt", b.as_bytes()), ("3.txt", b.as_bytes())]);
    assert!(error.unwrap_err().contains("names differ by the ball only, as in kick-A.txt and kick-B.txt"));
}

#[test]
fn what_a_long_table_passes_over_is_said() {
    let settings = "[video]\ncapture_fps = 1000";
    let text = "shot,frame,ball,x,y,z\n1,0,cue,0,0,0.03\n1,0,object,0.3,0,0.03\n";
    noted(&good(settings, "a.csv", text), "heights (z) are not used");
    let text = "shot,frame,ball,x,y\n# in the lab, on a Monday, at noon, by us, alone\n1,0,cue,0,0\n1,0,object,1,0\n\
                #2,0,cue,0,0\n#2,0,object,1,0\n\"#3\",0,cue,0,0\n\"#3\",0,object,1,0\n";
    let tracks = good(settings, "a.csv", text);
    assert_eq!(tracks.shots.iter().map(|shot| shot.name.as_str()).collect::<Vec<_>>(), ["1", "#3"]);
    noted(&tracks, "a.csv:5: 2 rows from here on begin with #");
}
