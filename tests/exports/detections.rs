//! Exports whose rows need more than names of columns: two boxes a row, balls that nothing tells apart, unlikely positions, tables below each
//! other, heights called y, files of one frame each.

use std::fs;
use std::process::Command;

use super::drafts::{FPS, SPIN, drafted, init};
use super::noted;
use super::programs::{FRAMES, MM, balls, check, filled, long};

/// A row per frame, with these cells of each ball.
fn wide(head: &str, cells: impl Fn(u32, usize, [f64; 2]) -> String) -> String {
    let row = |n: u32| format!("{n},{},{}\n", cells(n, 0, balls(n)[0]), cells(n, 1, balls(n)[1]));
    format!("{head}\n{}", (0..FRAMES).map(row).collect::<String>())
}

#[test]
fn both_boxes_in_a_row() {
    let corners = "cue_x1,cue_y1,cue_x2,cue_y2,object_x1,object_y1,object_x2,object_y2";
    let (by_corners, by_size) = ("{left},{top},{right},{bottom}", "{left},{top},{width},{height}");
    // the ball of the first box, too, may be that which does not move first
    for (head, cells, first, expected) in [
        (corners, by_corners, 0, "object_x2 = \"object_x2\""),
        (corners, by_corners, 1, "cue_y2 = \"cue_y2\""),
        (
            "a_left,a_top,a_width,a_height,b_left,b_top,b_width,b_height",
            by_size,
            0,
            "cue_width = \"a_width\"",
        ),
        ("cue_x,cue_y,cue_w,cue_h,obj_x,obj_y,obj_w,obj_h", by_size, 0, "object_height = \"obj_h\""),
        ("w_x,w_y,w_w,w_h,r_x,r_y,r_w,r_h", by_size, 1, "cue_width = \"r_w\""),
    ] {
        let text = wide(&format!("frame,{head}"), |n, ball, _| filled(cells, n, ball.abs_diff(first)));
        let tracks = drafted(&[("s.csv", text)], &[FPS, SPIN, MM], &[expected]);
        // names that say which ball it is are believed
        if expected != "cue_y2 = \"cue_y2\"" {
            check(&tracks, head);
        }
    }
}

/// ImageJ lists the particles of every slice from the top of the picture on: now one ball comes first, now the other.
#[test]
fn particles_that_nothing_tells_apart() {
    for (head, more) in [(" ,Area,Mean,X,Y,XM,YM,Slice", true), (" ,Area,Mean,X,Y,Frame", false)] {
        let row = |n: u32, i: usize| {
            let [x, y] = balls(n)[(i + (n as usize / 7) % 2) % 2];
            let masses = if more { format!(",{},{}", x + 0.3, y - 0.2) } else { String::new() };
            format!("{},2041,128.1,{x},{y}{masses},{}\n", 2 * n as usize + i + 1, n)
        };
        let rows: String = (0..FRAMES).flat_map(|n| [row(n, 0), row(n, 1)]).collect();
        // dust
        let dust = if more { "999,3,10,900,900,900,900,12\n" } else { "" };
        let tracks = drafted(
            &[("Results.csv", format!("{head}\n{rows}{dust}"))],
            &[FPS, SPIN, MM],
            &["x = \"X\"", "cue = \"cue\" "],
        );
        check(&tracks, head);
        noted(&tracks, "both balls are followed from frame to frame");
        if more {
            noted(&tracks, "1 row of other objects");
        }
    }
}

/// Several clips in a file, of which another ball comes first in each; names that change where a tracker lost a ball; detections of MOT.
#[test]
fn clips_and_names_that_change() {
    let clips: String = (0..3)
        .flat_map(|clip| (0..2 * FRAMES).map(move |i| (clip, i / 2, i % 2)))
        .map(|(clip, n, ball)| {
            let [x, y] = balls(n)[(ball as usize + clip) % 2];
            format!("{},{x},{y}\n", 1000 * clip + n as usize)
        })
        .collect();
    let tracks =
        drafted(&[("s.csv", format!("frame,x,y\n{clips}"))], &[FPS, SPIN, MM], &["frame = \"frame\""]);
    assert_eq!(tracks.shots.len(), 3);
    for shot in &tracks.shots {
        assert_eq!((shot.cue[0].x, shot.object[0].x), (0.0, 0.26));
    }
    let named = long("frame,id,x,y", |n, ball, [x, y]| {
        format!("{n},{},{x},{y}", if ball == 1 && n > 25 { 7 } else { ball })
    });
    check(&drafted(&[("s.csv", named)], &[FPS, SPIN, MM], &["cue = \"cue\" "]), "names that change");
    let mot = "{n},-1,{left},{top},{width},{height},0.9,-1,-1,-1";
    let detected = long("", |n, ball, _| filled(mot, n, ball));
    check(&drafted(&[("s.txt", detected.trim_start())], &[FPS, SPIN, MM], &["\nwidth = 5"]), "MOT");
    for (text, hint) in [
        ("frame,white,red\n0,\"(1.5, 2)\",\"(3, 4)\"\n1,\"(2.5, 2)\",\"(3, 4)\"\n", "hold x and y together"),
        (" ,Label,Area,X,Y\n1,a:1,9,1,2\n2,a:1,9,3,4\n3,a:2,9,1,2\n", "tick Stack position"),
        (
            "Run 1: T,Run 1: X,Run 1: Y,Run 1: X 2,Run 1: Y 2,Run 2: T,Run 2: X,Run 2: Y,Run 2: X 2,Run 2: Y 2\n0,1,2,3,4,0,1,2,3,4\n1,1,2,3,4,1,1,2,3,4\n",
            "Several runs",
        ),
    ] {
        let (_, said) = init(&[("s.csv", text)]);
        assert!(said.contains(hint), "{said}");
    }
}

#[test]
fn unlikely_positions_are_left_out() {
    let row = |n: u32, ball: usize, [x, y]: [f64; 2]| {
        let (off, likelihood) = if n % 17 == 5 + ball as u32 { (150.0, 0.04) } else { (0.0, 0.98) };
        format!("{},{},{likelihood}", x + off, y - off)
    };
    let net = ",DLC_net".repeat(6);
    let head =
        format!("scorer{net}\nbodyparts,cue,cue,cue,obj,obj,obj\ncoords,x,y,likelihood,x,y,likelihood");
    let likely = "cue_likelihood = \"cue likelihood\"";
    let in_long = |n: u32, ball: usize, at: [f64; 2]| format!("{n},{ball},{}", row(n, ball, at));
    for (text, expected) in [
        (wide(&head, row), likely),
        (long("frame,id,x,y,likelihood", in_long), "likelihood = \"likelihood\""),
    ] {
        let tracks = drafted(&[("s.csv", text)], &[FPS, SPIN, MM], &[expected]);
        assert_eq!((tracks.shots[0].cue.len(), tracks.shots[0].object.len()), (37, 38));
        noted(&tracks, "likelihood below 0.6");
    }
    // what detectors call confidence is on no scale that is known
    let text = long("frame,id,x,y,confidence", |n, ball, [x, y]| format!("{n},{ball},{x},{y},0.4"));
    let tracks = drafted(&[("s.csv", text)], &[FPS, SPIN, MM], &["# likelihood = \"confidence\""]);
    check(&tracks, "confidence");
}

/// Copied from Tracker one track after the other into one file.
#[test]
fn tracks_below_each_other() {
    let track = |name: &str, ball: usize, end: &str| {
        let row =
            |n: u32| format!("{:.2},{},{}{end}\n", 0.01 * f64::from(n), balls(n)[ball][0], balls(n)[ball][1]);
        format!("{name}\nt,x,y{end}\n{}", (0..FRAMES).map(row).collect::<String>())
    };
    for (names, between, end) in [
        (["mass A", "mass B"], "\n", ""),
        (["mass A,,", "mass B,,"], "", ""),
        (["#mass A", "#mass B"], "", ""),
        (["mass A", "mass B"], "\n\n", ","),
    ] {
        let text = format!("{}{between}{}", track(names[0], 0, end), track(names[1], 1, end));
        for text in [text.replace(',', "\t"), text] {
            let tracks = drafted(
                &[("kick.txt", text)],
                &[FPS, SPIN, MM],
                &["cue = \"mass A\"", "object = \"mass B\""],
            );
            check(&tracks, names[0]);
        }
    }
}

/// Motive calls the height y.
#[test]
fn heights_called_y() {
    let head = "Format Version,1.23,Take Name,T,Capture Frame Rate,100.000000\n\n,,Marker,Marker,Marker,Marker,Marker,Marker\n,,cue,cue,cue,obj,obj,obj\n,,\"A1\",\"A1\",\"A1\",\"A2\",\"A2\",\"A2\"\n,,Position,Position,Position,Position,Position,Position\nFrame,Time (Seconds),X,Y,Z,X,Y,Z\n";
    let row = |n: u32| {
        // z and x, seen from above, are as x and y
        let cells = balls(n).map(|[x, y]| format!("{y},28.{},{x}", n % 3)).join(",");
        format!("{n},{:.6},{cells}\n", 0.01 * f64::from(n))
    };
    let text = format!("{head}{}", (0..FRAMES).map(row).collect::<String>());
    check(&drafted(&[("s.csv", text)], &[FPS, SPIN, MM], &["cue_y = \"A1 Position X\""]), "Motive");
}

/// Files of one frame each are not read, but it is said how to join them; what is joined is read.
#[test]
fn yolo_writes_a_file_per_frame() {
    let folder = tempfile::tempdir().unwrap();
    let labels = folder.path().join("runs/labels");
    fs::create_dir_all(&labels).unwrap();
    let boxes = |n: u32| -> String {
        balls(n)
            .map(|[x, y]| {
                format!("32 {} {} {} 0.05 0.9\n", x / 1920.0, y / 1080.0, 0.03 + 1e-4 * f64::from(n % 3))
            })
            .concat()
    };
    for n in 0..FRAMES {
        fs::write(labels.join(format!("frame_{n:06}.txt")), boxes(n)).unwrap();
    }
    let output =
        Command::new(env!("CARGO_BIN_EXE_caromfit")).arg("init").arg(folder.path()).output().unwrap();
    let said = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2), "{said}");
    assert!(said.contains("40 files like frame_000000.txt hold one frame each"), "{said}");
    let row =
        |n: u32, at: [f64; 2]| format!("{n} 32 {} {} {} 54\n", at[0], at[1], 57.6 + 0.2 * f64::from(n % 3));
    let rows: String = (0..FRAMES).flat_map(|n| balls(n).map(|at| row(n, at))).collect();
    let text = format!("frame class x_center y_center width height\n{rows}");
    check(&drafted(&[("shot1.dat", text)], &[FPS, SPIN, MM], &["x = \"x_center\""]), "joined");
}

/// Short tracks without names are not taken for such files: the number in front of their rows counts up.
#[test]
fn short_tracks_are_no_files_of_one_frame() {
    let row = |n: u32| {
        let [[x, y], [other_x, other_y]] = balls(n + FRAMES / 2 - 9);
        format!("{n} {x} {y} {other_x} {other_y}\n")
    };
    let names: Vec<String> = (0..12).map(|shot| format!("shot{shot:02}.txt")).collect();
    let films: Vec<(&str, String)> =
        names.iter().map(|name| (name.as_str(), (0..18).map(row).collect())).collect();
    let (_, said) = init(&films);
    assert!(said.contains("12 files of tracks"), "{said}");
}
