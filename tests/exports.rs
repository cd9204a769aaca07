//! What people export from other programs and type into spreadsheets, as they do it.

mod columns;
mod detections;
mod drafts;
mod faults;
mod programs;

use caromfit::measurement::dataset::Tracks;

use super::tracks::{at, good, load, noted, refused};

/// `[tracks]` of balls that are called A and B.
const AB: &str = "[tracks]\ncue = \"A\"\nobject = \"B\"";

/// Qualisys Track Manager 2025 begins with the version of the file, and may leave out the row of column names.
#[test]
fn qualisys_with_a_version_and_without_names() {
    let head = "FILE_VERSION\t2.0.0\nNO_OF_FRAMES\t2\nNO_OF_CAMERAS\t2\nNO_OF_MARKERS\t2\nFREQUENCY\t100\nDESCRIPTION\t--\nTIME_STAMP\t2025-11-16, 16:36:52.070\t235999.51255370\nDATA_INCLUDED\t3D\nMARKER_NAMES\tA\tB\nTRAJECTORY_TYPES\tMixed\tMeasured\n";
    let rows = "482.031\t619.826\t-19.321\t462.785\t616.601\t-19.704\n481.884\t617.119\t-19.294\t462.683\t613.559\t-19.718\n";
    let check = |tracks: &Tracks| {
        let shot = &tracks.shots[0];
        assert_eq!(shot.fps, 100.0);
        assert_eq!(shot.cue, [at(0.0, 0.482_031, 0.619_826), at(0.01, 481.884 / 1000.0, 0.617_119)]);
        assert_eq!(shot.object[1], at(0.01, 0.462_683, 0.613_559));
        noted(tracks, "lengths are in mm");
    };
    check(&good(AB, "q.tsv", &format!("{head}{rows}")));
    // numbers of frames and times in front
    let counted: String =
        rows.lines().enumerate().map(|(i, row)| format!("{}\t0.0{i}\t{row}\t\n", i + 1)).collect();
    check(&good(AB, "q.tsv", &format!("{head}{counted}")));
    let names = "Frame\tTime\tA X\tA Y\tA Z\tB X\tB Y\tB Z\n";
    check(&good(AB, "q.tsv", &format!("{head}{names}{counted}")));
    // a first row that begins with a gap is a row
    let gap = format!("{head}\t\t\t462.8\t616.6\t-19.7\n{rows}");
    let tracks = good(AB, "q.tsv", &gap);
    assert_eq!((tracks.shots[0].cue.len(), tracks.shots[0].object.len()), (2, 3));
    refused(AB, &format!("{head}{}", rows.replace('\n', "\t1\t2\t3\n")), &["9 cells; expected 6"]);
    // every second frame, and rows that were deleted
    let jumps = |line: &str, frame: u32| format!("{frame}\t{:.5}\t{line}\n", f64::from(frame) / 100.0);
    let rows = [
        "482.0\t619.0\t1\t462.0\t616.0\t1",
        "481.0\t617.0\t1\t462.5\t613.5\t1",
        "480.0\t615.0\t1\t463.0\t611.0\t1",
    ];
    let some: String = rows.iter().zip([3, 5, 12]).map(|(row, frame)| jumps(row, frame)).collect();
    for names in ["", names] {
        let times: Vec<f64> = good(AB, "q.tsv", &format!("{head}{names}{some}")).shots[0]
            .cue
            .iter()
            .map(|sample| sample.t)
            .collect();
        assert_eq!(times, [0.0, 0.02, 0.09]);
    }
}

/// The names of the columns of frames and times stand in the line of the markers' names.
#[test]
fn trc_files_count_their_frames() {
    let head = "PathFileType\t4\t(X/Y/Z)\tx.trc\nDataRate\tNumFrames\tUnits\n200.00\t3\tmm\nFrame#\tTime\tA\t\t\tB\t\t\n\t\tX1\tY1\tZ1\tX2\tY2\tZ2\n\n";
    let rows = |frames: &[u32]| -> String {
        let row = |(i, frame): (u32, &u32)| {
            format!("{frame}\t{:.5}\t{}\t300\t5\t500\t400\t5\n", 0.01 * f64::from(i), 300 + 8 * i)
        };
        (0..).zip(frames).map(row).collect()
    };
    let columns = "[scale]\nlength_unit = \"mm\"\n[tracks.columns]\ncue_x = \"X1\"\ncue_y = \"Y1\"\nobject_x = \"X2\"\nobject_y = \"Y2\"";
    let settings = format!("[video]\ncapture_fps = 200\n{columns}");
    let times = |settings: &str, frames: &[u32]| -> Vec<f64> {
        let tracks = good(settings, "x.trc", &format!("{head}{}", rows(frames)));
        tracks.shots[0].cue.iter().map(|sample| sample.t).collect()
    };
    assert_eq!(times(&settings, &[1, 3, 5]), [0.005, 0.015, 0.025]);
    // without a frame rate the times are all there is
    assert_eq!(times(columns, &[1, 3, 5]), [0.0, 0.01, 0.02]);
    refused(
        &settings,
        &format!("{head}{}", rows(&[1, 2, 3, 4, 5])),
        &["Frame# and Time contradict each other at 200 fps"],
    );
}

#[test]
fn inches_and_feet() {
    let text = "frame,ball,x,y\n0,A,1,2\n0,B,10,-5\n1,A,1.5,2\n1,B,10,-5\n";
    let settings = |unit| format!("[video]\ncapture_fps = 100\n[scale]\nlength_unit = \"{unit}\"\n{AB}");
    let inches = good(&settings("in"), "a.csv", text);
    assert_eq!((inches.shots[0].cue[0].x, inches.shots[0].object[0].y), (0.0254, -0.127));
    let feet = good(&settings("ft"), "a.csv", text);
    assert_eq!((feet.shots[0].cue[0].x, feet.shots[0].object[0].x), (0.3048, 3.048));
    refused(&settings("inch"), text, &["dataset.toml", "\"inch\"", "did you mean \"in\""]);
}

/// A title, `sep=;`, units beside the names or below them, rows in any order.
#[test]
fn spreadsheets() {
    let settings = format!("[video]\ncapture_fps = 100\n{AB}");
    let expected = [at(0.01, 0.015, 0.02), at(0.02, 0.016, 0.02), at(0.03, 0.017, 0.02)];
    let rows = "10;A;1,5;2\n10;B;3;4\n30;A;1,7;2\n20;A;1,6;2\n20;B;3;4\n";
    for head in [
        "sep=;\nShots of Monday\nt [ms];ball;x [cm];y [cm]\n",
        "\"sep=;\"\n\nt;ball;x;y\nms;;cm;cm\n",
        "Shots of Monday;;;\n;;;\nT (ms);Ball;X (cm);Y (cm)\n",
        "t;ball;x [cm];y\n[ms];;;(cm)\n",
    ] {
        let tracks = good(&settings, "s.csv", &format!("{head}{rows}"));
        assert_eq!(tracks.shots[0].cue, expected, "{head}");
        noted(&tracks, "lengths are in cm, as the file says");
        noted(&tracks, "not in the order of time");
    }
    // the same of a table like that of Tracker, and of one that is mapped
    let wide = "Monday\n;A;;B;\nt [s];x [cm];y [cm];x [cm];y [cm]\n0,02;1,6;2;3;4\n0,03;1,7;2;3;4\n0,01;1,5;2;3;4\n0,04;1,8;2;3;4\n";
    assert_eq!(good(&settings, "s.csv", wide).shots[0].cue[..3], expected);
    let mapped = format!(
        "{settings}\n[tracks.columns]\nt = \"zeit\"\ncue_x = \"ax [cm]\"\ncue_y = \"ay\"\nobject_x = \"bx\"\nobject_y = \"by\""
    );
    let table =
        "sep=,\nMonday\nzeit,ax [cm],ay,bx,by\ns,,cm,cm,cm\n0.02,1.6,2,3,4\n0.01,1.5,2,3,4\n0.03,1.7,2,3,4\n";
    assert_eq!(good(&mapped, "s.csv", table).shots[0].cue, expected);
    // what the header says is not overridden in silence
    let head = "t [ms];ball;x [cm];y [cm]\n";
    let text = format!("{head}{rows}");
    refused(
        &format!("{settings}\n[scale]\nlength_unit = \"m\""),
        &text,
        &["a.txt", "in cm", "length_unit = \"cm\""],
    );
    refused(
        &format!("{settings}\ntime_unit = \"s\""),
        &text,
        &["a.txt:1: column t: is in ms", "time_unit is \"s\""],
    );
    refused(&settings, &text.replace("y [cm]", "y [mm]"), &["a.txt:1: column y: is in mm; expected cm"]);
    refused(&settings, &text.replace("[cm]", "[px]"), &["in pixels", "length_unit = \"px\""]);
    refused(&settings, &text.replace("y [cm]", "y [s]"), &["a.txt:1: column y: is in s; expected cm"]);
    // two clips in one file are not shuffled into one
    let clips = "t;ball;x;y\n5;A;1;2\n6;A;2;2\n7;A;3;2\n1;A;7;2\n2;A;8;2\n5;B;3;4\n";
    refused(&settings.replace("100", "1"), clips, &["a.txt:5", "runs backwards"]);
}

/// Where there is no header, columns have numbers; where there is no time, rows are frames.
#[test]
fn columns_by_number_and_rows_as_frames() {
    let numbers = "[tracks.columns]\nt = 2\ncue_x = 3\ncue_y = 4\nobject_x = 5\nobject_y = 6";
    let settings = format!("[video]\ncapture_fps = 100\n{AB}\n{numbers}");
    for text in [
        "7,0.00,1,2,3,4\n7,0.01,1.5,2,3,4\n",
        "made by hand\n\n7;0,00;1;2;3;4\n7;0,01;1,5;2;3;4\n",
        "  7  0.00  1 2   3 4\n  7  0.01  1.5 2 3 4\n",
    ] {
        let tracks = good(&settings, "n.txt", text);
        assert_eq!(tracks.shots[0].cue, [at(0.0, 1.0, 2.0), at(0.01, 1.5, 2.0)], "{text}");
        assert_eq!(tracks.shots[0].line, 1 + text.lines().position(|line| line.contains('7')).unwrap());
    }
    let long = "0,white,1,2\n0,red,3,4\n1,white,1.5,2\n1,red,3,4\n";
    let by_ball = "[video]\ncapture_fps = 100\n[tracks]\ncue = \"white\"\nobject = \"red\"\n[tracks.columns]\nframe = 1\nball = 2\nx = 3\ny = 4";
    assert_eq!(good(by_ball, "n.txt", long).shots[0].cue[1], at(0.01, 1.5, 2.0));
    refused(&settings.replace("= 6", "= 7"), "7,0.00,1,2,3,4\n", &["numbers in the columns 2, 3, 4, 5, 7"]);
    refused(&settings.replace("= 6", "= 0"), "7,0.00,1,2,3,4\n", &["dataset.toml", "from 1 on"]);
    refused(
        &settings.replace("= 6", "= \"by\""),
        "7,0.00,1,2,3,4\n",
        &["dataset.toml", "by name and some by number"],
    );
    refused(&settings, "7,0.00,1,2,3,4\n7,0.01,1,2,3,x\n", &["a.txt:2: column column 6: \"x\""]);
    // no time at all
    let columns = "[tracks.columns]\nshot = \"n\"\ncue_x = \"ax\"\ncue_y = \"ay\"\nobject_x = \"bx\"\nobject_y = \"by\"";
    let rows = "n,ax,ay,bx,by\n1,1,2,3,4\n1,1.5,2,3,4\n2,1,2,3,4\n2,1.5,2,3,4\n2,2,2,3,4\n";
    let tracks = good(&format!("[video]\ncapture_fps = 100\n{AB}\n{columns}"), "n.csv", rows);
    assert_eq!(tracks.shots[0].cue[1], at(0.01, 1.5, 2.0));
    assert_eq!(tracks.shots[1].cue[2], at(0.02, 2.0, 2.0));
    noted(&tracks, "every row is taken as one frame");
    refused(&format!("{AB}\n{columns}"), rows, &["capture_fps"]);
}

/// Names, rates and files that differ from shot to shot stand in the table of shots.
#[test]
fn what_differs_from_shot_to_shot() {
    let multi = |cue: &str, object: &str| {
        format!("#multi:\n,{cue},,{object},\nframe,x,y,x,y\n0,1,2,3,4\n1,1.5,2,3,4\n")
    };
    let (one, two) = (multi("red", "blue"), multi("m 1", "m 2"));
    let shots = "sep=,\nshot,file,cue,object,capture_fps,who\na,kick 1.txt,red,blue,,me\nb,day/kick 2.txt,m 2,m 1,50,you\n";
    let files = |table: &str| {
        let table = table.replace("day/", "");
        let files =
            [("kick 1.txt", one.as_bytes()), ("kick 2.txt", two.as_bytes()), ("shots.csv", table.as_bytes())];
        load("[video]\ncapture_fps = 100\n[tracks]\nshots = \"shots.csv\"", &files)
    };
    let tracks = files(shots).unwrap();
    let [a, b] = tracks.shots.as_slice() else { panic!("{:?}", tracks.shots) };
    assert_eq!((a.name.as_str(), a.fps, a.cue[1]), ("a", 100.0, at(0.01, 1.5, 2.0)));
    assert_eq!((b.name.as_str(), b.fps, b.object[1]), ("b", 50.0, at(0.02, 1.5, 2.0)));
    assert_eq!((a.labels.len(), b.labels["who"].as_str()), (1, "you"));
    let wrong = |from: &str, to: &str, parts: &[&str]| {
        let error = files(&shots.replace(from, to)).unwrap_err();
        for part in parts {
            assert!(error.contains(part), "{part:?} is not in: {error}");
        }
    };
    wrong("kick 1", "kick 3", &["shots.csv:3: column file: \"kick 3.txt\"", "did you mean"]);
    wrong("kick 1", "kick 2", &["shots.csv:4: column file", "also the file of line 3"]);
    wrong(",50,", ",-5,", &["shots.csv:4: column capture_fps", "-5 is not a frame rate"]);
    wrong("m 2,m 1", "m 2;;,m 1", &["shots.csv:4: column cue: \"m 2;;\""]);
    wrong("red,blue", "red,green", &["no track \"green\"", "\"blue\""]);
}

/// A centre and points on the rim, each with a name of its own.
#[test]
fn markers_beside_the_centre() {
    let text = "NO_OF_FRAMES\t2\nFREQUENCY\t500\nMARKER_NAMES\tc\tr1\tr2\tB\n10\t0\t0\t20\t0\t0\t10\t12\t0\t90\t0\t0\n11\t0\t0\t21\t0\t0\t11\t12\t0\t90\t0\t0\n";
    let stated = "[tracks]\ncue = \"c\"\nobject = \"B\"\ncue_markers = [\"r1\", \"r2\"]";
    let shots = "shot,cue_markers\nq,r1; r2\n";
    let table = "[tracks]\ncue = \"c\"\nobject = \"B\"\nshots = \"shots.csv\"";
    for (settings, more) in [(stated, None), (table, Some(("shots.csv", shots.as_bytes())))] {
        let files: Vec<(&str, &[u8])> = [("q.tsv", text.as_bytes())].into_iter().chain(more).collect();
        let tracks = load(settings, &files).unwrap();
        let shot = &tracks.shots[0];
        assert_eq!(shot.cue[1], at(0.002, 0.011, 0.0));
        let markers: Vec<_> =
            shot.markers.iter().map(|marker| (marker.name.as_str(), marker.samples[1])).collect();
        assert_eq!(markers, [("r1", at(0.002, 0.021, 0.0)), ("r2", at(0.002, 0.011, 0.012))]);
    }
    refused(&stated.replace("\"r2\"", "\"c\""), text, &["dataset.toml", "both cue and cue_markers"]);
}

/// JSON as tools in the browser save it, in its several shapes.
#[test]
fn json_of_shots_with_balls_with_samples() {
    let settings = "[video]\ncapture_fps = 100\n[tracks]\ncue = \"white\"\nobject = \"red\"";
    let cue = [at(0.0, 1.0, 2.0), at(0.01, 1.5, 2.0), at(0.03, 2.5, 2.0)];
    for text in [
        r#"[{"name": "one", "balls": [
            {"name": "white", "samples": [{"t": 0, "x": 1, "y": 2}, {"t": 0.01, "x": 1.5, "y": 2}, {"t": 0.02, "x": null, "y": null}, {"t": 0.03, "x": 2.5, "y": 2}]},
            {"name": "red", "samples": [{"t": 0, "x": 3, "y": 4}, {"t": 0.01, "x": 3, "y": 4}]}]}]"#,
        r#"{"unit": "m", "shots": [{"id": "one", "tracks": {"white": [[0, 1, 2], [0.01, 1.5, 2], [0.02, null, null], [0.03, 2.5, 2]], "red": [[0, 3, 4], [0.01, 3, 4]]}}]}"#,
        r#"[{"shot": "one", "fps": 100, "balls": [
            {"ball": "white", "points": [{"frame": 0, "position": {"x": 1, "y": 2}}, {"frame": 1, "position": [1.5, 2]}, {"frame": 3, "position": [2.5, 2]}]},
            {"ball": "red", "points": [{"frame": 0, "x": 3, "y": 4}, {"frame": 1, "x": 3, "y": 4}]}]}]"#,
    ] {
        let tracks = good(settings, "web.json", text);
        let [shot] = tracks.shots.as_slice() else { panic!("{text}") };
        assert_eq!((shot.name.as_str(), shot.fps), ("one", 100.0));
        assert_eq!(shot.cue, cue, "{text}");
        assert_eq!(shot.object[1], at(0.01, 3.0, 4.0));
        noted(&tracks, "read as JSON, 1 shot");
    }
    // frames and their rate are in the file, lengths in cm; shots without names
    let ball =
        |name: &str| format!("{{\"name\": \"{name}\", \"samples\": [{{\"frame\": 7, \"x\": 1, \"y\": 2}}]}}");
    let shot = format!("{{\"fps\": 50, \"balls\": [{}, {}]}}", ball("cue"), ball("object"));
    let tracks = good("", "web.json", &format!("{{\"length_unit\": \"cm\", \"shots\": [{shot},\n{shot}]}}"));
    let found: Vec<_> =
        tracks.shots.iter().map(|shot| (shot.name.as_str(), shot.line, shot.cue[0])).collect();
    assert_eq!(found, [("web-1", 1, at(0.14, 0.01, 0.02)), ("web-2", 2, at(0.14, 0.01, 0.02))]);
    // every complaint knows its line
    refused(
        settings,
        "[{\"name\": 1,\n\"balls\": [{\"name\": \"white\",\n\"samples\": [\n{\"t\": 0, \"x\": \"1\", \"y\": 2}]}]}]",
        &["a.txt:4: column x: \"1\"; expected a number"],
    );
    refused(
        settings,
        "[{\"balls\": [{\"name\": \"white\", \"samples\": [\n{\"x\": 1, \"y\": 2}]}]}]",
        &["a.txt:2", "without t or frame"],
    );
    refused(settings, "[{\"name\": \"one\"}]", &["a.txt:1", "\"one\" has no \"balls\""]);
    refused(settings, "{\"shots\": 3}", &["holds no shots"]);
    refused(settings, "[{\"balls\": [\n,]}]", &["a.txt:2", "is not JSON"]);
    refused(
        settings,
        "{\"unit\": \"yard\", \"shots\": [{\"balls\": []}]}",
        &["length_unit: \"yard\" is not a unit"],
    );
}

/// Angles in the place of points: they turn as the file's axes do.
#[test]
fn angles_of_discs() {
    let columns = "[tracks.columns]\nframe = \"n\"\ncue_x = \"ax\"\ncue_y = \"ay\"\nobject_x = \"bx\"\nobject_y = \"by\"\ncue_angle = \"a\"\nobject_angle = \"b\"";
    let discs = "[ball]\nshape = \"disc\"\n[video]\ncapture_fps = 100\n";
    let table = "n,ax,ay,a [deg],bx,by,b [rad]\n0,1,2,0,3,4,0.5\n1,1,2,30,3,4,\n2,1,2,370,3,4,-0.5\n";
    let angle = |settings: &str, text: &str, marker: usize| {
        let tracks = good(&format!("[cue_spin]\nassume = \"unknown\"\n{settings}"), "t.csv", text);
        let shot = &tracks.shots[0];
        let (marker, centres) = (&shot.markers[marker], [&shot.cue, &shot.object][marker]);
        let of = |s: &caromfit::measurement::track::Sample| {
            let centre = centres.iter().find(|centre| centre.t == s.t).unwrap();
            (s.t, (s.y - centre.y).atan2(s.x - centre.x))
        };
        marker.samples.iter().map(of).collect::<Vec<_>>()
    };
    let near = |found: Vec<(f64, f64)>, expected: &[(f64, f64)]| {
        assert_eq!(found.len(), expected.len(), "{found:?}");
        for ((t, angle), (expected_t, expected_angle)) in found.iter().zip(expected) {
            // rounding of a sine and back
            assert!(t == expected_t && (angle - expected_angle).abs() < 1e-12, "{found:?}");
        }
    };
    let (half, thirty) = (0.5, 30.0_f64.to_radians());
    near(angle(&format!("{discs}{columns}"), table, 0), &[(0.0, 0.0), (0.01, thirty), (0.02, thirty / 3.0)]);
    near(angle(&format!("{discs}{columns}"), table, 1), &[(0.0, half), (0.02, -half)]);
    let down = format!("{discs}[scale]\nlength_unit = \"mm\"\ny_axis = \"down\"\n{columns}");
    near(angle(&down, table, 1), &[(0.0, -half), (0.02, half)]);
    let bare = table.replace(" [deg]", "").replace(" [rad]", "");
    near(
        angle(&format!("{discs}{columns}\nangle_unit = \"deg\""), &bare, 0),
        &[(0.0, 0.0), (0.01, thirty), (0.02, thirty / 3.0)],
    );
    let long = "n,disc,x,y,turn\n0,A,1,2,0.1\n0,B,3,4,0.2\n1,A,1,2,0.3\n";
    let by_disc = format!(
        "{discs}{AB}\n[tracks.columns]\nframe = \"n\"\nball = \"disc\"\nx = \"x\"\ny = \"y\"\nangle = \"turn\"\nangle_unit = \"rad\""
    );
    near(angle(&by_disc, long, 0), &[(0.0, 0.1), (0.01, 0.3)]);
    let assume = "[cue_spin]\nassume = \"unknown\"\n";
    refused(
        &format!("{assume}{discs}{columns}"),
        &bare,
        &["a.txt:1: column a: the unit of these angles", "angle_unit"],
    );
    refused(
        &format!("{assume}{discs}{columns}\nangle_unit = \"deg\""),
        table,
        &["column b: is in rad", "\"deg\""],
    );
    refused(&format!("[video]\ncapture_fps = 100\n{columns}"), table, &["dataset.toml", "shape = \"disc\""]);
}

/// How programs write times, gaps and numbers.
#[test]
fn times_of_clocks_gaps_and_thousands() {
    let columns = "[tracks]\ncue = \"A\"\nobject = \"B\"\n[tracks.columns]\nt = \"t\"\ncue_x = \"ax\"\ncue_y = \"ay\"\nobject_x = \"bx\"\nobject_y = \"by\"";
    let settings = format!("[video]\ncapture_fps = 100\n{columns}");
    let table = |times: [&str; 3]| {
        let rows = times.map(|t| format!("{t};1,5;2;3;4\n"));
        format!("t;ax;ay;bx;by\n{}", rows.concat())
    };
    for times in [
        ["00:00:01.00", "00:00:01.01", "00:00:01.02"],
        ["0:00:01:00", "0:00:01:01", "0:00:01:02"],
        ["2024-05-01T00:00:01.00Z", "2024-05-01T00:00:01.01Z", "2024-05-01T00:00:01.02Z"],
    ] {
        let tracks = good(&settings, "a.csv", &table(times));
        assert_eq!(
            tracks.shots[0].cue,
            [at(1.0, 1.5, 2.0), at(1.01, 1.5, 2.0), at(1.02, 1.5, 2.0)],
            "{times:?}"
        );
    }
    refused(
        &settings,
        &table(["00:00:01.00", "00:00:01.01", "1.02"]),
        &["a.txt:4: column t: \"1.02\" is a plain number"],
    );
    refused(
        &settings,
        &table(["0:0x", "1", "2"]),
        &["a.txt:2: column t: \"0:0x\" is not a time", "h:mm:ss.fff"],
    );
    // a time code: frame 29 is followed by the next second
    let code = table(["00:00:01:28", "00:00:01:29", "00:00:02:00"]);
    let tracks = good(&settings, "a.csv", &code);
    assert_eq!(tracks.shots[0].cue.iter().map(|s| s.t).collect::<Vec<_>>(), [0.58, 0.59, 0.6]);
    noted(&tracks, "30 frames to a second");
    for gap in ["-", "--", "n/a", "#N/A", "None", "\\N", "NaN", "null"] {
        let text = format!("t;ax;ay;bx;by\n0,00;1;2;3;4\n0,01;{gap};{gap};3;4\n0,02;1,5;2;3;4\n");
        let tracks = good(&settings, "a.csv", &text);
        assert_eq!((tracks.shots[0].cue.len(), tracks.shots[0].object.len()), (2, 3), "{gap}");
    }
    let text = table(["0,00", "0,01", "0,02"]).replace("1,5", "2,5D-01");
    assert_eq!(good(&settings, "a.csv", &text).shots[0].cue[0].x, 0.25);
    refused(
        &settings,
        &text.replace("2,5D-01", "lost"),
        &["column ax: \"lost\" is not a number", "an empty cell"],
    );
    let text = "t;ax;ay;bx;by\n0,00;998;200;300;400\n0,01;1,002;200;300;400\n";
    refused(&settings, text, &["a.txt:3: column ax: \"1,002\" beside \"998\"", "thousands"]);
    // a standard deviation is in the same unit, but tells nothing
    let with_sd = "frame,ball,x,y,x_sd,y_sd\n0,A,998,200,1.000,1.000\n0,B,300,400,1.000,1.000\n";
    good(&format!("[video]\ncapture_fps = 100\n{AB}"), "a.csv", with_sd);
    let long = "frame,ball,x,y\n0,A,998,200\n1,A,1.002,200\n0,B,300,400\n1,B,300,400\n";
    refused(
        "[video]\ncapture_fps = 100\n[tracks]\ncue = \"A\"\nobject = \"B\"",
        long,
        &["a.txt:3: column x: \"1.002\""],
    );
}

/// Single rows that no ball can have been at are gaps, and are told.
#[test]
fn rows_at_impossible_places_and_times() {
    let row = |n: i32, name: &str, x: f64| format!("{n},{name},{x:.3},0.5\n");
    let text: String = (0..20).flat_map(|n| [row(n, "A", 0.01 * f64::from(n)), row(n, "B", 0.4)]).collect();
    let text = format!("frame,ball,x,y\n{text}");
    let settings = format!("[video]\ncapture_fps = 100\n{AB}");
    for (from, to) in [
        ("7,A,0.070", "7,A,70"),
        ("7,A,0.070", "7,A,1e308"),
        ("18,A,0.180", "-18,A,0.180"),
        ("7,A,", "1e300,A,"),
    ] {
        assert!(text.contains(from));
        let tracks = good(&settings, "a.csv", &text.replacen(from, to, 1));
        assert_eq!((tracks.shots[0].cue.len(), tracks.shots[0].object.len()), (19, 20), "{to}");
        noted(&tracks, "by itself at an impossible");
    }
}

/// What is no table of positions is told what it lacks, and does no harm to a terminal.
#[test]
fn headers_that_lack_something() {
    refused("[video]\ncapture_fps = 100", "shot,frame,ball,x\n1,0,A,1\n", &["are without y"]);
    refused("[video]\ncapture_fps = 100", "shot,frame,x,y\n1,0,1,2\n", &["are without ball"]);
    let error = load("", &[("a.txt", b"\x1b[2Jw]n\x07\n".as_slice())]).unwrap_err();
    assert!(error.contains("\\u{1b}[2J") && !error.contains('\x1b') && !error.contains('\x07'), "{error}");
}

/// Logger Pro and others write one ball a file with capital names.
#[test]
fn one_ball_a_file_in_capitals() {
    let ball = |x: &str| format!("Time (s),X (m),Y (m),X Velocity (m/s)\n0.00,{x},2,9\n0.01,{x},2,9\n");
    let settings = "[video]\ncapture_fps = 100\n[tracks]\ncue = \"white\"\nobject = \"red\"";
    let (white, red) = (ball("0.5"), ball("0.7"));
    let tracks =
        load(settings, &[("kick1-white.csv", white.as_bytes()), ("kick1-red.csv", red.as_bytes())]).unwrap();
    assert_eq!((tracks.shots[0].cue[1], tracks.shots[0].object[0].x), (at(0.01, 0.5, 2.0), 0.7));
}
