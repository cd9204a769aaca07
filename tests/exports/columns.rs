//! `caromfit init` on tables whose columns it has to guess.

use std::fs;

use super::drafts::{FPS, SPIN, drafted, init, rows};

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

/// One cell that cannot be read does not throw away what was understood of the rest, and is named.
#[test]
fn a_bad_cell_is_quoted() {
    let table =
        wide("t,x1,y1,x2,y2", ",", |n| format!("{:.2}", 0.01 * f64::from(n))) + "Mean,0.5,0.5,0.5,0.5\n";
    let (folder, said) = init(&[("s.csv", table)]);
    assert!(said.contains("s.csv:42: column t: \"Mean\" is not a number"), "{said}");
    let draft = fs::read_to_string(folder.path().join("dataset.toml")).unwrap();
    assert!(draft.contains("cue_x = \"x1\""), "{draft}");
}
