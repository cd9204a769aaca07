//! Tracks: every quirk of the formats, in small files of our own.

use std::fs;

use caromfit::dataset::{self, Spin, Tracks};
use caromfit::track::{Sample, TrackedBall};

/// Loads files of these names and contents.
fn load(settings: &str, files: &[(&str, &[u8])]) -> Result<Tracks, String> {
    let folder = tempfile::tempdir().unwrap();
    for (name, content) in files {
        fs::write(folder.path().join(name), content).unwrap();
    }
    let names: Vec<_> = files.iter().map(|(name, _)| *name).filter(|name| *name != "shots.csv").collect();
    let spin = if settings.contains("cue_spin") { "" } else { "[cue_spin]\nassume = \"natural-roll\"\n" };
    let manifest = format!("name = \"t\"\nkind = \"tracks\"\nfiles = {names:?}\n{spin}{settings}\n");
    fs::write(folder.path().join("dataset.toml"), manifest).unwrap();
    let prefix = format!("{}/", folder.path().display());
    match dataset::load(folder.path()) {
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

fn good(settings: &str, file: &str, content: &str) -> Tracks {
    load(settings, &[(file, content.as_bytes())]).unwrap_or_else(|error| panic!("{error}"))
}

#[track_caller]
fn refused(settings: &str, content: &str, parts: &[&str]) {
    let error = load(settings, &[("a.txt", content.as_bytes())]).err().expect("is refused");
    for part in parts {
        assert!(error.contains(part), "{part:?} is not in: {error}");
    }
}

#[track_caller]
fn noted(tracks: &Tracks, part: &str) {
    assert!(tracks.notes.iter().any(|note| note.contains(part)), "{part:?} is not in: {:#?}", tracks.notes);
}

fn at(t: f64, x: f64, y: f64) -> Sample {
    Sample { t, x, y, sd: None }
}

#[test]
fn by_hand() {
    let Ok(list) = std::env::var("TRACKS_DIRS") else { return };
    for dir in list.split(':') {
        println!("=== {dir}");
        let begun = std::time::Instant::now();
        match dataset::load(std::path::Path::new(dir)) {
            Err(error) => println!("REFUSED {error}"),
            Ok(d) => {
                let t = d.tracks.unwrap();
                for n in t.notes {
                    println!("note: {n}");
                }
                for s in t.shots.iter().take(3) {
                    println!(
                        "{} fps {} cue {} {:?} {:?} object {} {:?} markers {:?}",
                        s.name,
                        s.fps,
                        s.cue.len(),
                        s.cue.first(),
                        s.cue.last(),
                        s.object.len(),
                        s.object.first(),
                        s.markers.iter().map(|m| (m.name.clone(), m.samples.len())).collect::<Vec<_>>()
                    );
                }
            }
        }
        println!("{:?}", begun.elapsed());
    }
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
    assert_eq!(shot.cue[1], at(0.01, -0.14, 0.056));
    noted(&tracks, "semicolons");
    noted(&tracks, "decimal comma");
    noted(&tracks, "\"mass A\" is [tracks] cue");
    // other separators, other orders of columns, further columns
    for sep in ["\t", ",", " ", "|"] {
        let text = format!(
            "#multi:\n,mass_A,,,mass_B,,,\nt,y,x,v,x,y,θ,\n0,1,2,,3,4,7\n0.01,1,2.1,99,3,4,7\n0.02,1,2.2,99,,,\n"
        )
        .replace(',', sep);
        let tracks = good(settings, "s.txt", &text);
        assert_eq!(tracks.shots[0].cue[1], at(0.01, 0.021, 0.01), "{sep:?}");
        assert_eq!(tracks.shots[0].object.len(), 2);
    }
    // one track, copied
    refused(settings, "\tmass_C\nt\tx\ty\n0.0\t1\t2\n0.01\t1\t2\n", &["no track \"A\"", "\"mass_C\""]);
    refused(settings, "t\ty\tx\n0.0\t1\t2\n0.01\t1\t2\n", &["no track \"A\"", "\"a\""]);
    refused(
        settings,
        "#multi:\n,A,,B,,\nt,x,y,x,y\n0,0,1,5,1,5,1,5,1,5\n",
        &["10 cells; expected 6", "decimal commas"],
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
    let twice = settings.replace("\"A\"", "\"A (2)\"").replace("\"B\"", "\"A (1)\"");
    let tracks = good(&twice, "a.txt", "#multi:\n;A;;A;\nt;x;y;x;y\n0;1;2;3;4\n0,01;1;2;3;4\n");
    assert_eq!(tracks.shots[0].cue[0], at(0.0, 0.03, 0.04));
}
