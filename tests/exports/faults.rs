//! What trackers write for a ball that they lost, several clips in one table, spins that nothing measures, paths as Windows writes them.

use crate::tracks::{good, load, noted, refused};

const SETTINGS: &str = "[video]\ncapture_fps = 100\n[tracks.columns]\nt = \"t\"\ncue_x = \"a\"\ncue_y = \"b\"\nobject_x = \"c\"\nobject_y = \"d\"";

/// Both balls in 40 frames from this time on: one runs into the other, somewhere on the table.
fn clip(start: f64, place: f64) -> Vec<[f64; 5]> {
    let frame = |n: u32| {
        let cue = place + 0.01 * f64::from(n.min(20));
        let object = place + 0.26 + 0.009 * f64::from(n.max(20) - 20);
        [start + 0.01 * f64::from(n), cue, 0.5, object, 0.5 + 1e-4 * f64::from(n % 3)]
    };
    (0..40).map(frame).collect()
}

fn table(rows: &[[f64; 5]]) -> String {
    let row = |[t, a, b, c, d]: &[f64; 5]| format!("{t:.3},{a:.4},{b:.4},{c:.4},{d:.4}\n");
    format!("t,a,b,c,d\n{}", rows.iter().map(row).collect::<String>())
}

#[test]
fn a_ball_that_is_lost_is_a_gap() {
    let clean = good(SETTINGS, "s.csv", &table(&clip(0.0, 0.4)));
    for [x, y] in [[0.0, 0.0], [-1.0, -1.0], [9999.0, 9999.0], [-0.5, 3.0]] {
        let mut rows = clip(0.0, 0.4);
        // the object ball from frame 22, the cue ball from frame 23 on: no exchange of names
        for row in &mut rows[22..26] {
            (row[3], row[4]) = (x, y);
        }
        for row in &mut rows[23..27] {
            (row[1], row[2]) = (x, y);
        }
        let tracks = good(SETTINGS, "s.csv", &table(&rows));
        let shot = &tracks.shots[0];
        assert_eq!((shot.cue.len(), shot.object.len()), (36, 36), "{x}, {y}");
        let expected: Vec<_> =
            clean.shots[0].cue.iter().filter(|s| !(0.225..0.265).contains(&s.t)).copied().collect();
        assert_eq!(shot.cue, expected);
        noted(&tracks, &format!("s.csv:24 and 3 more: \"object\" is at ({x}, {y}), far from its path"));
        assert!(!tracks.notes.iter().any(|note| note.contains("exchanged")), "{:?}", tracks.notes);
    }
    // before the impact, too, and a single frame of a place that programs are known to write
    let mut rows = clip(0.0, 0.4);
    for at in [0, 1, 7] {
        (rows[at][3], rows[at][4]) = (0.0, 0.0);
    }
    assert_eq!(good(SETTINGS, "s.csv", &table(&rows)).shots[0].object.len(), 37);
    // a ball that lies still in the origin of the coordinates is there
    let origin: Vec<_> =
        clip(0.0, 0.4).iter().map(|[t, a, b, c, _]| [*t, a - 0.66, b - 0.5, c - 0.66, 0.0]).collect();
    let tracks = good(SETTINGS, "s.csv", &table(&origin));
    assert_eq!((tracks.shots[0].object.len(), tracks.shots[0].object[3].x), (40, 0.0));
}

#[test]
fn clips_in_one_table_are_shots() {
    let clips = [clip(10.0, 0.4), clip(20.0, 1.2), clip(35.0, 0.1)];
    let tracks = good(SETTINGS, "all.csv", &table(&clips.concat()));
    let shots: Vec<_> =
        tracks.shots.iter().map(|shot| (shot.name.as_str(), shot.line, shot.cue.len())).collect();
    assert_eq!(shots, [("1", 2, 40), ("2", 42, 40), ("3", 82, 40)]);
    noted(&tracks, "all.csv: holds 3 clips");
    // a clock that goes on: both balls jump
    let on: Vec<[f64; 5]> = clips
        .concat()
        .iter()
        .enumerate()
        .map(|(n, row)| [0.01 * n as f64, row[1], row[2], row[3], row[4]])
        .collect();
    assert_eq!(good(SETTINGS, "all.csv", &table(&on)).shots.len(), 3);
    // of several files
    let two = table(&clips[..2].concat());
    let tracks =
        load(SETTINGS, &[("p.csv", two.as_bytes()), ("q.csv", table(&clips[0]).as_bytes())]).unwrap();
    let names: Vec<_> = tracks.shots.iter().map(|shot| shot.name.as_str()).collect();
    assert_eq!(names, ["p-1", "p-2", "q"]);
    // balls that are not seen for some frames are one clip
    let mut gap = clip(0.0, 0.4);
    gap.drain(10..16);
    assert_eq!(good(SETTINGS, "all.csv", &table(&gap)).shots.len(), 1);
}

#[test]
fn a_spin_that_nothing_measures() {
    let measured = format!("{SETTINGS}\n[cue_spin]\nassume = \"measured\"");
    refused(
        &measured,
        &table(&clip(0.0, 0.4)),
        &["dataset.toml", "[cue_spin] assume is \"measured\"", "shot \"a\"", "omega_x"],
    );
}

#[test]
fn paths_with_backslashes() {
    let film = table(&clip(0.0, 0.4));
    let settings = SETTINGS.replace("[tracks.columns]", "[tracks]\nshots = \"shots.csv\"\n[tracks.columns]");
    for path in ["C:\\Users\\me\\k.csv", ".\\k.csv", "k.csv"] {
        let shots = format!("shot,file\nfirst,{path}\n");
        let tracks = load(&settings, &[("k.csv", film.as_bytes()), ("shots.csv", shots.as_bytes())]);
        assert_eq!(tracks.unwrap_or_else(|error| panic!("{path}: {error}")).shots[0].name, "first");
    }
    let elsewhere = "shot,file\nfirst,other\\k.csv\n";
    let error =
        load(&settings, &[("k.csv", film.as_bytes()), ("shots.csv", elsewhere.as_bytes())]).unwrap_err();
    assert!(error.contains("is not among the files"), "{error}");
    let folder = tempfile::tempdir().unwrap();
    std::fs::create_dir(folder.path().join("films")).unwrap();
    std::fs::write(folder.path().join("films/k.csv"), film).unwrap();
    let loaded = |files: &str| {
        let text = format!(
            "name = \"t\"\nkind = \"tracks\"\nfiles = [{files}]\n[cue_spin]\nassume = \"stun\"\n{SETTINGS}\n"
        );
        std::fs::write(folder.path().join("dataset.toml"), text).unwrap();
        caromfit::io::load(folder.path())
    };
    assert!(loaded("\"films\\\\*.csv\"").is_ok() && loaded("'films\\*.csv'").is_ok());
    let error = loaded("\"films\\*.csv\"").unwrap_err().to_string();
    assert!(error.contains("write / between folders"), "{error}");
}

/// What holds for several shots of one file is said once, with how many they are.
#[test]
fn a_note_counts_shots_of_one_file() {
    let rows = |shot: u32| -> String {
        let row =
            |n: u32| format!("{shot},{n},A,{},500\n{shot},{n},B,{},501\n", 300 + 9 * n, 900 + n * n / 9);
        (0..30).map(row).collect()
    };
    let table = format!("shot,frame,ball,x,y\n{}{}", rows(1), rows(2));
    let settings =
        "[video]\ncapture_fps = 100\n[scale]\nlength_unit = \"px\"\n[tracks]\ncue = \"A\"\nobject = \"B\"";
    noted(&good(settings, "all.csv", &table), "all.csv (2 shots): positions are rounded to 9.00 px");
}
