//! `caromfit init` on tables whose columns it has to guess.

use std::fs;
use std::process::Command;

use super::drafts::{FPS, SPIN, drafted, rows};

/// Forty rows of a wide table with times of any kind: as many columns as there are names.
fn wide(names: &str, separator: &str, time: impl Fn(u32) -> String) -> String {
    let metres = |x: f64| format!("{x:.3}");
    let row = |n, a, b| vec![time(n), metres(a), "0.5".into(), metres(b), "0.52".into()];
    format!("{names}\n{}", rows(separator, 40, row))
}

/// What is not named as caromfit names it, and what spreadsheets and programs write around it.
#[test]
fn headers_as_programs_write_them() {
    let seconds = |n: u32| format!("{:.2}", 0.01 * f64::from(n));
    let plain = [FPS, SPIN];
    let german = wide("Zeit;Weiß x;Weiß y;Rot x;Rot y", ";", seconds);
    let german = german.replace('.', ",");
    let utf16: Vec<u8> =
        [0xff, 0xfe].into_iter().chain(german.encode_utf16().flat_map(u16::to_le_bytes)).collect();
    let latin: Vec<u8> = german.chars().map(|c| c as u8).collect();
    let cases: [(&str, Vec<u8>, &str); 10] = [
        ("red in German", german.clone().into_bytes(), "object_x = \"Rot x\""),
        ("UTF-16", utf16, "object_x = \"Rot x\""),
        ("Latin-1", latin, "cue_x = \"Weiß x\""),
        ("CR", german.replace('\n', "\r").into_bytes(), "t = \"Zeit\""),
        ("numpy", wide("# t x1 y1 x2 y2", " ", seconds).into_bytes(), "cue_x = \"x1\""),
        ("aligned", wide("   t     x1    y1   x2   y2", "   ", seconds).into_bytes(), "cue_x = \"x1\""),
        ("suffix", wide("t_s,x1_m,y1_m,x2_m,y2_m", ",", seconds).into_bytes(), "length_unit = \"m\""),
        (
            "capitals",
            wide("Time (s),X (m),Y (m),X 2 (m),Y 2 (m)", ",", seconds).into_bytes(),
            "object_x = \"X 2 (m)\"",
        ),
        ("frames", wide("n,x1,y1,x2,y2", ",", |n| n.to_string()).into_bytes(), "frame = \"n\""),
        (
            "clock",
            wide("Time,x1,y1,x2,y2", ",", |n| format!("00:00:00.{n:02}")).into_bytes(),
            "follow 100 frames",
        ),
    ];
    for (what, bytes, expected) in cases {
        let tracks = drafted(&[("s.csv", bytes)], &plain, &[expected]);
        let shot = &tracks.shots[0];
        assert_eq!(
            (shot.cue.len(), shot.cue[10].x, shot.cue[10].t, shot.object[0].y),
            (40, 0.1, 0.1, 0.52),
            "{what}"
        );
    }
}

/// Tables with a row per ball and frame are none of Tracker's, whatever the column of balls is called.
#[test]
fn long_tables_of_any_names() {
    let table = |names: &str, order: fn(u32, &str, f64) -> String| {
        let ball =
            |name: &str, x: fn(u32) -> f64| (0..40).map(|n| order(n, name, x(n)) + "\n").collect::<String>();
        let cue = ball("1", |n| 0.01 * f64::from(n.min(20)));
        format!("{names}\n{cue}{}", ball("2", |n| 0.26 + 0.009 * f64::from(n.max(20) - 20)))
    };
    for (names, order, expected) in [
        (
            "frame,track_id,x,y",
            (|n, ball, x| format!("{n},{ball},{x:.3},0.5")) as fn(u32, &str, f64) -> String,
            "ball = \"track_id\"",
        ),
        ("id,t,x,y", |n, ball, x| format!("{ball},{:.2},{x:.3},0.5", 0.01 * f64::from(n)), "ball = \"id\""),
        (
            ",y,x,mass,frame,particle",
            |n, ball, x| format!("{n},0.5,{x:.3},3,{n},{ball}"),
            "ball = \"particle\"",
        ),
        (
            "time,ball,x,y,x_sd,y_sd",
            |n, ball, x| format!("{:.2},{ball},{x:.3},0.5,0.001,0.001", 0.01 * f64::from(n)),
            "x_sd = \"x_sd\"",
        ),
        ("Frame,ball_id,X,Y,VX,VY", |n, ball, x| format!("{n},{ball},{x:.3},0.5,1,1"), "y = \"Y\""),
    ] {
        let tracks = drafted(&[("s.csv", &table(names, order))], &[FPS, SPIN], &[expected, "cue = \"1\""]);
        let shot = &tracks.shots[0];
        assert_eq!((shot.cue[10].x, shot.object[0].x, shot.markers.len()), (0.1, 0.26, 0), "{names}");
    }
}

/// One cell that cannot be read does not throw away what was understood of the rest, and is named.
#[test]
fn a_bad_cell_is_quoted() {
    let folder = tempfile::tempdir().unwrap();
    let table =
        wide("t,x1,y1,x2,y2", ",", |n| format!("{:.2}", 0.01 * f64::from(n))) + "Mean,0.5,0.5,0.5,0.5\n";
    fs::write(folder.path().join("s.csv"), table).unwrap();
    let output =
        Command::new(env!("CARGO_BIN_EXE_caromfit")).arg("init").arg(folder.path()).output().unwrap();
    let said = String::from_utf8(output.stdout).unwrap();
    assert!(said.contains("s.csv:42: column t: \"Mean\" is no number"), "{said}");
    let draft = fs::read_to_string(folder.path().join("dataset.toml")).unwrap();
    assert!(draft.contains("cue_x = \"x1\""), "{draft}");
}
