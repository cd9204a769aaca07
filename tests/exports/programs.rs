//! `caromfit init` on what trackers and detectors export: the columns that it finds hold the balls.

use caromfit::measurement::dataset::Tracks;

use super::drafts::{FPS, SPIN, drafted, init};

pub const FRAMES: u32 = 40;
/// Positions are in millimetres, which the files do not say.
pub const MM: (&str, &str) = ("# length_unit = \"…\"", "length_unit = \"mm\"");
/// Rounding of lengths written to a micrometre.
const ROUNDED: f64 = 2e-6;

/// Where both balls are in a frame, mm.
pub fn balls(n: u32) -> [[f64; 2]; 2] {
    let moved = |n: u32| f64::from(n);
    [[10.0 * moved(n.min(20)), 500.0], [260.0 + 9.0 * moved(n.max(20) - 20), 520.0]]
}

/// A row per ball and frame.
pub fn long(head: &str, row: impl Fn(u32, usize, [f64; 2]) -> String) -> String {
    let row = &row;
    let rows = (0..FRAMES).flat_map(|n| [0, 1].map(|ball| row(n, ball, balls(n)[ball]) + "\n"));
    format!("{head}\n{}", rows.collect::<String>())
}

/// A row per frame, with what stands behind the position of a ball.
pub fn wide(head: &str, behind: &str) -> String {
    let ball = |[x, y]: [f64; 2]| format!(",{x:.3},{y:.3}{behind}");
    let rows = (0..FRAMES).map(|n| format!("{n}{}\n", balls(n).map(ball).concat()));
    format!("{head}\n{}", rows.collect::<String>())
}

/// Corner and size of a box about a ball, which is not quite as large in every frame.
fn boxed(n: u32, [x, y]: [f64; 2]) -> [f64; 4] {
    let half = 28.0 + f64::from(n % 3);
    [x - half, y - half, 2.0 * half, 2.0 * half]
}

pub fn check(tracks: &Tracks, what: &str) {
    let shot = &tracks.shots[0];
    assert_eq!((shot.cue.len(), shot.object.len(), shot.markers.len()), (40, 40, 0), "{what}");
    for (samples, ball) in [(&shot.cue, 0), (&shot.object, 1)] {
        for (n, sample) in (0..FRAMES).zip(samples) {
            let [x, y] = balls(n)[ball];
            let off = (sample.x - 1e-3 * x).hypot(sample.y - 1e-3 * y);
            assert!(off < ROUNDED, "{what}: frame {n} of ball {ball} at {}, {}", sample.x, sample.y);
        }
    }
}

/// A row in which `{n}` stands for the frame and `{s}` for its time, `{ball}` and `{id}` for the ball from 0 and from 1 on, `{name}` for its name, `{x}` and `{y}`
/// for its middle, and `{left}`, `{top}`, `{right}`, `{bottom}`, `{width}` and `{height}` for the box about it.
pub fn filled(row: &str, n: u32, ball: usize) -> String {
    let [x, y] = balls(n)[ball];
    let [left, top, width, height] = boxed(n, [x, y]);
    let sides = [("left", left), ("top", top), ("right", left + width), ("bottom", top + height)];
    let lengths = sides.into_iter().chain([("x", x), ("y", y), ("width", width), ("height", height)]);
    let names = [("n", n.to_string()), ("ball", ball.to_string()), ("id", (ball + 1).to_string())];
    let time = [("s", format!("{:.2}", 0.01 * f64::from(n)))];
    let cells = names.into_iter().chain(time).chain(lengths.map(|(key, length)| (key, length.to_string())));
    let cells = cells.chain([("name", ["white", "red"][ball].to_string())]);
    cells.fold(row.to_string(), |row, (key, cell)| row.replace(&format!("{{{key}}}"), &cell))
}

/// What is exported, its header and its rows, and what stands in the draft, where ↵ is the end of a line.
const TABLES: &str = r#"
MOT ¦ frame,id,bb_left,bb_top,bb_width,bb_height,conf,x,y,z ¦ {n},{id},{left},{top},{width},{height},0.9,-1,-1,-1 ¦ width = "bb_width"
MOT without names ¦  ¦ {n},{id},{left},{top},{width},{height},1,-1,-1,-1 ¦ width = 5
track and corners ¦ frame,track_id,x1,y1,x2,y2,conf,class ¦ {n},{ball},{left},{top},{right},{bottom},0.9,32 ¦ x2 = "x2"
id, corners and centre ¦ frame,id,x1,y1,x2,y2,cx,cy ¦ {n},{ball},{left},{top},{right},{bottom},{x},{y} ¦ ball = "id"
class and corners ¦ frame,xmin,ymin,xmax,ymax,confidence,class,name ¦ {n},{left},{top},{right},{bottom},0.9,{ball},{name} ball ¦ y2 = "ymax"
a box in the words of COCO ¦ frame,bbox_x,bbox_y,bbox_w,bbox_h,name ¦ {n},{left},{top},{width},{height},{name} ball ¦ height = "bbox_h"
middle and size ¦ frame,track_id,x,y,w,h ¦ {n},{ball},{x},{y},57,58 ¦ # of a box: take the # away
middle and size that changes ¦ frame,track_id,x,y,w,h ¦ {n},{ball},{x},{y},{width},58 ¦ x = "x"
corner and size, by how smooth the paths are ¦ frame,track_id,x,y,w,h ¦ {n},{ball},{left},{top},{width},{height} ¦ ↵width = "w"
the same beside the names of balls ¦ frame,ball,x,y,width,height ¦ {n},{name},{left},{top},{width},{height} ¦ ↵height = "height"
no table of Tracker, whatever balls are called ¦ frame,track_id,x,y ¦ {n},{ball},{x},{y} ¦ ball = "track_id"
balls before times ¦ id,t,x,y ¦ {ball},{s},{x},{y} ¦ ball = "id"
an index without a name ¦ ,y,x,mass,frame,particle ¦ {n},{y},{x},3,{n},{ball} ¦ ball = "particle"
standard deviations ¦ time,ball,x,y,x_sd,y_sd ¦ {s},{ball},{x},{y},0.1,0.1 ¦ x_sd = "x_sd"
velocities ¦ Frame,ball_id,X,Y,VX,VY ¦ {n},{ball},{x},{y},1,1 ¦ y = "Y"
nothing says which ball it is ¦ frame,xmin,ymin,xmax,ymax,name ¦ {n},{left},{top},{right},{bottom},sports ball ¦ # it moves first
"#;

/// Tables with a row per ball and frame; detectors write boxes, whose middle is the ball.
#[test]
fn rows_of_balls_and_boxes_about_them() {
    for line in TABLES.trim().lines() {
        let [what, head, row, expected] = line.split(" ¦ ").collect::<Vec<_>>()[..] else {
            panic!("{line}")
        };
        let text = long(head, |n, ball, _| filled(row, n, ball));
        let expected = expected.replace('↵', "\n");
        check(&drafted(&[("s.csv", text.trim_start())], &[FPS, SPIN, MM], &[&expected]), what);
    }
}

/// Headers of several lines, above the line that names columns or below it.
#[test]
fn headers_of_several_lines() {
    let trackmate = "LABEL,ID,TRACK_ID,QUALITY,POSITION_X,POSITION_Y,POSITION_T,FRAME\nLabel,Spot ID,Track ID,Quality,X,Y,T,Frame\nLabel,Spot ID,Track ID,Quality,X,Y,T,Frame\n,,,(quality),(mm),(mm),(sec),";
    let spots = long(trackmate, |n, ball, [x, y]| {
        format!("ID{n}{ball},{n}{ball},{ball},3.3,{x},{y},{:.2},{n}", 0.01 * f64::from(n))
    });
    check(
        &drafted(&[("spots.csv", &spots)], &[FPS, SPIN], &["frame = \"FRAME\"", "length_unit = \"mm\""]),
        "TrackMate",
    );

    let net = ",DLC_net".repeat(6);
    let coords = "coords,x,y,likelihood,x,y,likelihood";
    for (what, head, expected) in [
        (
            "DeepLabCut",
            format!("scorer{net}\nbodyparts,cue,cue,cue,obj,obj,obj\n{coords}"),
            "cue_x = \"cue x\"",
        ),
        (
            "DeepLabCut, several animals",
            format!("scorer{net}\nindividuals,b1,b1,b1,b2,b2,b2\nbodyparts{}\n{coords}", ",mid".repeat(6)),
            "object_y = \"b2 mid y\"",
        ),
        (
            "SLEAP",
            "frame_idx,cue.x,cue.y,cue.score,object.x,object.y,object.score".to_string(),
            "cue_x = \"cue.x\"",
        ),
        (
            "merged cells",
            ",White ball,,,Red ball,,\nframe,x,y,score,x,y,score".to_string(),
            "cue = \"White ball\"",
        ),
        ("pandas", "ball,c,c,c,o,o,o\ncoord,x,y,p,x,y,p\nframe,,,,,,".to_string(), "cue_x = \"c x\""),
        (
            "explained",
            "n,x1,y1,p1,x2,y2,p2\nframe,cue ball x,cue ball y,surely,object ball x,object ball y,surely"
                .to_string(),
            "frame = \"n\"",
        ),
    ] {
        check(&drafted(&[("s.csv", wide(&head, ",0.9"))], &[FPS, SPIN, MM], &[expected]), what);
    }
    // of a column of tracks that names one only
    let nodes = wide("track,frame_idx,cue.x,cue.y,object.x,object.y", "");
    let nodes = nodes.replace('\n', "\ntrack_0,").replacen("track_0,track", "track", 1);
    let nodes = nodes.trim_end_matches("track_0,");
    check(&drafted(&[("s.csv", nodes)], &[FPS, SPIN, MM], &["frame = \"frame_idx\""]), "SLEAP, one track");
}

/// Shots, times and balls as several languages call them, in one file of two shots.
#[test]
fn columns_in_several_languages() {
    for head in [
        "Tir;Image;Bille",
        "N° essai;Image;Boule",
        "Stoß;Bild;Kugel",
        "Tiro;Fotograma;Bola",
        "Tiro;Fotogramma;Biglia",
        "Stoot;Beeld;Bal",
    ] {
        let shot = |shot: u32| long("", |n, ball, [x, y]| format!("{shot};{n};{ball};{x};{y}"));
        let text = format!("{head};x;y\n{}{}", shot(1).trim_start(), shot(2).trim_start());
        let column = head.split(';').next().unwrap();
        let tracks = drafted(&[("s.csv", text)], &[FPS, SPIN, MM], &[&format!("shot = \"{column}\"")]);
        assert_eq!(tracks.shots.len(), 2, "{head}");
        check(&tracks, head);
    }
}

/// Old versions of Kinovea put nothing but blank lines between the balls; newer ones name the unit of times.
#[test]
fn kinovea_without_names_and_with_a_unit() {
    let section = |ball: usize| -> String {
        (0..FRAMES)
            .map(|n| format!("{:.2} {} {} \n", 0.01 * f64::from(n), balls(n)[ball][0], balls(n)[ball][1]))
            .collect()
    };
    let text = format!("#Kinovea Trajectory data export\n#T X Y\n{}\n\n{}\n\n", section(0), section(1));
    let found = ["cue = \"1\"", "object = \"2\""];
    check(&drafted(&[("s.txt", text)], &[FPS, SPIN, MM], &found), "text");
    let table = wide("Time (ms),A/0/X,A/0/Y,B/0/X,B/0/Y", "");
    let table: String = table
        .lines()
        .map(|line| line.replacen(',', "0,", usize::from(!line.starts_with('T'))) + "\n")
        .collect();
    check(&drafted(&[("s.csv", table)], &[FPS, SPIN, MM], &["cue = \"A\""]), "CSV");
}

/// A table without rows is left out; ImageJ's tables are text, whatever their ending says; empty cells go on.
#[test]
fn tables_without_rows_and_with_odd_ends() {
    let film = wide("frame,x1,y1,x2,y2", "");
    let (folder, said) = init(&[("a.csv", film.as_str()), ("b.csv", "frame,x1,y1,x2,y2\n")]);
    assert!(said.contains("b.csv: no table of positions") && said.contains("1 file of tracks"), "{said}");
    let draft = std::fs::read_to_string(folder.path().join("dataset.toml")).unwrap();
    assert!(draft.contains("files = [\"a.csv\"]"), "{draft}");
    let manual = long(" \tTrack n°\tSlice n°\tX\tY\tPixel Value", |n, ball, [x, y]| {
        format!("{}\t{}\t{}\t{x}\t{y}\t34", 2 * n, ball + 1, n)
    });
    let latin: Vec<u8> = manual.chars().map(|c| c as u8).collect();
    check(&drafted(&[("Results.xls", latin)], &[FPS, SPIN, MM], &["ball = \"Track n°\""]), "ImageJ");
    let film = film.replace(",520.000", ",520.000,,,,");
    check(&drafted(&[("s.csv", film)], &[FPS, SPIN, MM], &[]), "empty cells");
    // a second pair of columns is no export of Tracker with one track
    let capstone = wide("Time (s) Run #1,x (m) Run #1,y (m) Run #1,x 2 (m) Run #1,y 2 (m) Run #1", "");
    let (folder, _) = init(&[("s.csv", capstone)]);
    let draft = std::fs::read_to_string(folder.path().join("dataset.toml")).unwrap();
    assert!(draft.contains("object_x = \"x 2 (m) Run #1\""), "{draft}");
}
