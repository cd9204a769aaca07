//! What makes the first hour easy: init, check, export, baselines, completions.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::Command;

use serde_json::Value;

use super::cli::caromfit;

/// What it says on standard output and on standard error, where it ends with this status.
fn both<S: AsRef<std::ffi::OsStr>>(status: i32, args: impl IntoIterator<Item = S>) -> [String; 2] {
    let output = caromfit(args);
    let said = [output.stdout, output.stderr].map(|bytes| String::from_utf8(bytes).unwrap());
    assert_eq!(output.status.code(), Some(status), "{said:?}");
    said
}

fn done<S: AsRef<std::ffi::OsStr>>(args: impl IntoIterator<Item = S>) -> String {
    let [out, _] = both(0, args);
    out
}

fn refused<S: AsRef<std::ffi::OsStr>>(status: i32, args: impl IntoIterator<Item = S>) -> String {
    let [_, err] = both(status, args);
    err
}

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// A shot of the synthetic footage as Tracker would export it: two tracks side by side, times in seconds.
fn tracker() -> String {
    let table = fs::read_to_string(root().join("data/synthetic-natural-roll/tracks.csv")).unwrap();
    let mut frames: BTreeMap<u32, [String; 2]> = BTreeMap::new();
    for line in table.lines() {
        let cells: Vec<&str> = line.split(',').collect();
        let [shot, frame, ball, x, y] = cells[..] else { continue };
        if shot == "1" {
            frames.entry(frame.parse().unwrap()).or_default()[usize::from(ball == "object")] =
                format!("{x},{y}");
        }
    }
    let mut text = String::from("#multi:\n,white,,red,\nt,x,y,x,y\n");
    for (frame, balls) in frames {
        // a gap has empty cells
        let [cue, object] = balls.map(|ball| if ball.is_empty() { ",".to_string() } else { ball });
        text += &format!("{},{cue},{object}\n", f64::from(frame) / FPS);
    }
    text
}

/// Of the synthetic footage.
const FPS: f64 = 1000.0;

#[test]
fn init_drafts_a_dataset_that_needs_only_its_blanks_filled() {
    let folder = tempfile::tempdir().unwrap();
    let csv = folder.path().join("shot-1.csv");
    fs::write(&csv, tracker()).unwrap();
    let said = done([Path::new("init"), &csv]);
    for fragment in
        ["format tracker", "\"white\" moves first", "Fill in: capture_fps, cue_spin", "follow 1000"]
    {
        assert!(said.contains(fragment), "{fragment}:\n{said}");
    }
    let path = folder.path().join("dataset.toml");
    let draft = fs::read_to_string(&path).unwrap();
    for fragment in ["cue = \"white\"", "object = \"red\"", "kind = \"tracks\"", "FILL IN"] {
        assert!(draft.contains(fragment), "{fragment}:\n{draft}");
    }
    // what is left blank is asked for by name
    let asked = refused(2, [Path::new("check"), folder.path()]);
    assert!(asked.contains("cue_spin"), "{asked}");
    let filled = draft
        .replace("# assume = \"…\"", "assume = \"natural-roll\"")
        .replace("# capture_fps = …", "capture_fps = 1000");
    fs::write(&path, filled).unwrap();
    let found = done([Path::new("check"), folder.path()]);
    assert!(found.contains("1 shot can be used, 0 left out"), "{found}");
    assert!(found.contains("too few to tell how noisy"), "{found}");
    // nothing is overwritten
    assert!(refused(2, [Path::new("init"), &csv]).contains("is there already"));
}

#[test]
fn init_knows_every_shipped_table() {
    for (file, expected) in [
        (
            "synthetic-natural-roll/tracks.csv",
            &["kind = \"tracks\"", "cue = \"cue\"", "object = \"object\""][..],
        ),
        ("domenech-2023/throw.csv", &["kind = \"angles\""]),
        ("pucks-qualisys/two-pucks.tsv", &["kind = \"tracks\"", "length_unit = \"mm\"", "capture_fps = "]),
    ] {
        let path = root().join("data").join(file);
        let draft = done(["init", "--stdout", path.to_str().unwrap()]);
        for fragment in expected {
            assert!(draft.contains(fragment), "{file}: {fragment}:\n{draft}");
        }
        toml::from_str::<toml::Table>(&draft).unwrap();
    }
    assert!(refused(2, ["init", "/nowhere.csv"]).contains("/nowhere.csv"));
}

/// Rates are those of the camera, however coarsely the times are rounded and however many rows are missing.
#[test]
fn init_finds_the_rate_that_times_follow() {
    let folder = tempfile::tempdir().unwrap();
    let csv = folder.path().join("shot.csv");
    let table = |rate: f64, decimals: usize, missing: &dyn Fn(usize) -> bool| {
        let rows = (0..60).filter(|n| !missing(*n)).map(|n| {
            let t = n as f64 / rate;
            format!("{t:.decimals$},A,{},0\n{t:.decimals$},B,1,0\n", 0.02 * n as f64)
        });
        format!("t,ball,x,y\n{}", rows.collect::<String>())
    };
    for (rate, decimals, expected) in [
        (120.0, 3, "120"),
        (50.0, 2, "50"),
        (240.0, 3, "240"),
        (1000.0, 3, "1000"),
        (59.94, 4, "59.94"),
        (30.0, 2, "30"),
    ] {
        fs::write(&csv, table(rate, decimals, &|_| false)).unwrap();
        let draft = done([Path::new("init"), Path::new("--stdout"), &csv]);
        assert!(draft.contains(&format!("follow {expected} frames per second")), "{rate}:\n{draft}");
    }
    // mostly every second row, some in between: 50 Hz, not 25
    fs::write(&csv, table(50.0, 2, &|n| n % 2 == 1 && n % 9 != 0)).unwrap();
    assert!(done([Path::new("init"), Path::new("--stdout"), &csv]).contains("follow 50 frames per second"));
}

#[test]
fn init_does_not_paste_what_is_no_table() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("shots.csv");
    fs::write(&path, format!("{{\"shots\": [{}0]}}\n", "1, 2, ".repeat(100_000))).unwrap();
    let said = refused(2, [Path::new("init"), &path]);
    assert!(said.contains("shots.csv: is JSON; expected a table") && said.len() < 500, "{}", said.len());
    // a table of very many columns is not listed whole either
    fs::write(&path, format!("{}\n", "a column of a table,".repeat(10_000))).unwrap();
    let draft = done([Path::new("init"), Path::new("--stdout"), &path]);
    assert!(draft.len() < 5_000 && draft.contains("(10001 in all)"), "{}", draft.len());
    toml::from_str::<toml::Table>(&draft).unwrap();
}

/// What a fresh draft lacks is said all at once, and each thing once for all files.
#[test]
fn check_says_at_once_what_a_fresh_draft_lacks() {
    let folder = tempfile::tempdir().unwrap();
    for shot in 0..30 {
        let rows: String = (0..40).map(|n| format!("{n},red,{},0\n{n},white,{},0\n", n, 80 - n)).collect();
        fs::write(folder.path().join(format!("kick-{shot:02}.csv")), format!("frame,ball,x,y\n{rows}"))
            .unwrap();
    }
    done([Path::new("init"), folder.path()]);
    let said = refused(2, [Path::new("check"), folder.path()]);
    for fragment in [
        "expected [cue_spin] assume",
        "no track \"cue\"",
        "no track \"object\"",
        "expected [video] capture_fps",
    ] {
        assert_eq!(said.matches(fragment).count(), 1, "{fragment}:\n{said}");
    }
    assert!(said.contains("the same in") && said.contains("kick-02.csv:2 and 27 more"), "{said}");
    assert!(said.lines().count() < 12, "{said}");
}

#[test]
fn fit_says_where_the_report_is() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().to_str().unwrap();
    let [one, two] = ["data/mathavan-2014", "data/domenech-2023"].map(|data| root().join(data));
    let said = done(["fit", one.to_str().unwrap(), "--out", out]);
    let last = said.lines().last().unwrap();
    let report = last.strip_prefix("Report: ").unwrap();
    assert!(Path::new(report).is_file(), "{last}");
    let said = done(["fit", one.to_str().unwrap(), two.to_str().unwrap(), "--out", out]);
    let last = said.lines().last().unwrap();
    assert!(last.starts_with(&format!("Reports: {out}/*/report.html (2 data sets")), "{last}");
}

/// Words, not files, are offered where words are expected.
#[test]
fn completions_offer_words() {
    let script = done(["completions", "bash"]);
    for words in ["\"squares huber cauchy\"", "\"pooltool json toml\"", "films formats results"] {
        assert!(script.contains(words), "{words}");
    }
    assert!(refused(2, ["fit", "nowhere", "--loss", "hubert"]).contains("huber"));
    // where --effects is, its names are
    for command in ["fit", "collide"] {
        let help: String = done([command, "--help"]).split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(help.contains("cloth-on-cue, gravity, falling-friction"), "{help}");
    }
}

#[test]
fn check_says_what_is_suspicious() {
    let folder = tempfile::tempdir().unwrap();
    let head = "shot,nx,ny,cue_vx,cue_vy,cue_vx_after,cue_vy_after,obj_vx_after,obj_vy_after\n";
    // slow; the object ball at a right angle to the line of centres; more energy than there was
    let rows = "slow,1,0,0.1,0,0.003,0,0.097,0\naskew,1,0,1,0,0.1,0,0,0.9\nfree,1,0,1,0,0.5,0,1.2,0\n";
    fs::write(folder.path().join("a.csv"), format!("{head}{rows}")).unwrap();
    let manifest = "name = \"odd\"\nkind = \"impacts\"\nfiles = [\"a.csv\"]\n[ball]\nradius_m = 0.1\n\
                    [cue_spin]\nassume = \"stun\"\n";
    fs::write(folder.path().join("dataset.toml"), manifest).unwrap();
    let found = done([Path::new("check"), folder.path()]);
    for fragment in [
        "radius is 0.1 m",
        "3 shots can be used: too few",
        "nothing here tells μ_s",
        "no standard deviations",
        "shot slow: the cue ball comes at 0.10 m/s",
        "shot askew: the object ball leaves 90° off",
        "shot free: the balls have 1.69 times",
    ] {
        assert!(found.contains(fragment), "{fragment}:\n{found}");
    }
}

#[test]
fn export_gives_what_pooltool_reads_and_says_what_is_left_behind() {
    let fit = root().join("fits/synthetic-natural-roll");
    let [out, err] = both(0, ["export", fit.to_str().unwrap(), "--to", "pooltool"]);
    let value: Value = serde_json::from_str(&out).unwrap();
    let stored: Value = serde_json::from_str(&fs::read_to_string(fit.join("fit.json")).unwrap()).unwrap();
    assert_eq!(value["u_b"], stored["parameters"]["mu"]["estimate"]);
    assert_eq!(value["e_b"], stored["parameters"]["e"]["estimate"]);
    assert_eq!((value["R"].as_f64(), value["m"].as_f64()), (Some(0.028_575), Some(0.17)));
    // every key is one of BallParams
    let known = ["m", "R", "u_s", "u_r", "u_sp_proportionality", "u_b", "e_b", "e_c", "f_c", "g"];
    assert!(value.as_object().unwrap().keys().all(|key| known.contains(&key.as_str())), "{out}");
    for fragment in ["μ_s", "AverageBallBallFriction", "Standard errors"] {
        assert!(err.contains(fragment), "{fragment}:\n{err}");
    }
    let table: toml::Table =
        toml::from_str(&done(["export", fit.join("fit.json").to_str().unwrap(), "--to", "toml"])).unwrap();
    assert_eq!(table["mu"]["status"].as_str(), Some("free"));
    // a parameter that nothing told is not exported
    let slow = root().join("fits/alciatore-2006/slow");
    let [out, err] = both(0, ["export", slow.to_str().unwrap(), "--to", "json"]);
    assert!(!out.contains("mu_s") && err.contains("μ_s: the data do not tell it"), "{out}{err}");
    let several = root().join("fits/alciatore-2006");
    assert!(refused(2, ["export", several.to_str().unwrap(), "--to", "json"]).contains("holds 3 fits"));
}

/// μ(v) = μ + b·exp(−c·v): without b and c, μ is the friction at high slip only.
#[test]
fn export_carries_a_falling_friction_over_or_says_that_it_cannot() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().to_str().unwrap();
    let data = root().join("data/alciatore-2014-speed");
    for falling in ["fit", "0.1,1.5"] {
        done(["fit", data.to_str().unwrap(), "--out", out, "--falling", falling]);
        let path = folder.path().join("alciatore-2014-speed/fit.json");
        let stored: Value = serde_json::from_str(&fs::read_to_string(&path).unwrap()).unwrap();
        let of = |name: &str| stored["parameters"][name]["estimate"].as_f64().unwrap();
        let path = path.to_str().unwrap();
        let table: toml::Table = toml::from_str(&done(["export", path, "--to", "toml"])).unwrap();
        for name in ["mu", "mu_b", "mu_c"] {
            assert_eq!(table[name]["estimate"].as_float(), Some(of(name)), "{falling}: {name}");
        }
        assert!(table["friction"].as_str().unwrap().contains("mu_b exp(-mu_c v)"), "{table}");
        let [out, err] = both(0, ["export", path, "--to", "pooltool"]);
        assert!(!out.contains("u_b"), "{out}");
        let model = format!("AlciatoreBallBallFriction(a={}, b={}, c={})", of("mu"), of("mu_b"), of("mu_c"));
        assert!(err.contains(&model), "{model}:\n{err}");
    }
}

#[test]
fn a_baseline_tolerance_is_a_finite_number_of_standard_errors() {
    let data = root().join("data/mathavan-2014");
    let baseline = root().join("fits/mathavan-2014/fit.json");
    let [data, baseline] = [data.to_str().unwrap(), baseline.to_str().unwrap()];
    for wrong in ["nan", "-1", "inf", "x"] {
        let folder = tempfile::tempdir().unwrap();
        let out = folder.path().join("out");
        let path = out.to_str().unwrap();
        let all = ["fit", data, "--out", path, "--baseline", baseline, "--baseline-tolerance", wrong];
        let err = refused(2, all);
        assert!(err.contains("--baseline-tolerance") && !out.exists(), "{wrong}: {err}");
    }
}

#[test]
fn a_baseline_that_moved_ends_with_status_1_and_is_kept() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().to_str().unwrap();
    let data = root().join("data/mathavan-2014");
    let data = data.to_str().unwrap();
    let stored = folder.path().join("mathavan-2014/fit.json");
    let path = stored.to_str().unwrap();
    done(["fit", data, "--out", out]);
    done(["fit", data, "--out", out, "--baseline", path]);

    let mut value: Value = serde_json::from_str(&fs::read_to_string(&stored).unwrap()).unwrap();
    let mu = &mut value["parameters"]["mu"];
    let (estimate, error) = (mu["estimate"].as_f64().unwrap(), mu["std_error"].as_f64().unwrap());
    mu["estimate"] = (estimate - 2.0 * error).into();
    value["parameters"]["mu_s"]["status"] = "free".into();
    let changed = value.to_string();
    fs::write(&stored, &changed).unwrap();
    let err = refused(1, ["fit", data, "--out", out, "--baseline", path]);
    for fragment in ["+2.000 standard errors", "mu_s status", "at-lower-bound"] {
        assert!(err.contains(fragment), "{fragment}:\n{err}");
    }
    assert_eq!(fs::read_to_string(&stored).unwrap(), changed, "the baseline was overwritten");
    // a wider tolerance forgives the estimate, nothing forgives the status
    let err = refused(1, ["fit", data, "--out", out, "--baseline", path, "--baseline-tolerance", "3"]);
    assert!(!err.contains("standard errors\n") && err.contains("mu_s status"), "{err}");

    let other = root().join("fits/domenech-2023/fit.json");
    assert!(
        refused(2, ["fit", data, "--out", out, "--baseline", other.to_str().unwrap()])
            .contains("holds no fit of mathavan-2014")
    );
    fs::write(&stored, "{\"dataset\": 3}").unwrap();
    assert!(refused(2, ["fit", data, "--out", out, "--baseline", path]).contains("fit.json:1"));
}

#[test]
fn completions_name_every_command() {
    let help = done(["--help"]);
    let commands: Vec<&str> = help
        .lines()
        .skip_while(|line| !line.starts_with("Commands"))
        .skip(1)
        .take_while(|line| !line.is_empty())
        .filter_map(|line| line.split_whitespace().next())
        .filter(|word| *word != "help")
        .collect();
    assert!(commands.len() >= 9, "{help}");
    for shell in ["bash", "zsh", "fish"] {
        let script = done(["completions", shell]);
        assert!(commands.iter().all(|command| script.contains(command)), "{shell}");
    }
    for command in commands {
        let help = done([command, "--help"]);
        assert!(help.contains("Example"), "{command} has no example:\n{help}");
    }
}

/// No colour without a terminal, nor with NO_COLOR.
#[test]
fn no_colours_off_a_terminal() {
    for environment in [None, Some("1")] {
        let mut command = Command::new(env!("CARGO_BIN_EXE_caromfit"));
        if let Some(value) = environment {
            command.env("NO_COLOR", value);
        }
        for args in [&["--help"][..], &["fit", "--nothing"]] {
            let output = command.args(args).output().unwrap();
            assert!(!output.stdout.contains(&0x1b) && !output.stderr.contains(&0x1b));
            command = Command::new(env!("CARGO_BIN_EXE_caromfit"));
        }
    }
}

/// Ended while it fits (as Ctrl-C does; a test run may ignore that signal), nothing of what stands in the folder has changed and nothing is half written.
#[cfg(unix)]
#[test]
fn an_interrupted_run_leaves_what_was_there() {
    let folder = tempfile::tempdir().unwrap();
    let own = folder.path().join("domenech-2023");
    fs::create_dir_all(&own).unwrap();
    fs::write(own.join("fit.json"), "as it was").unwrap();
    let data = root().join("data/domenech-2023");
    let mut child = Command::new(env!("CARGO_BIN_EXE_caromfit"))
        .args(["fit", data.to_str().unwrap(), "--bootstrap", "1000000", "--out"])
        .arg(folder.path())
        .spawn()
        .unwrap();
    std::thread::sleep(std::time::Duration::from_millis(300));
    assert!(child.try_wait().unwrap().is_none(), "it was done before it could be interrupted");
    let killed = Command::new("kill").args(["-TERM", &child.id().to_string()]).status().unwrap();
    assert!(killed.success());
    assert!(!child.wait().unwrap().success());
    assert_eq!(fs::read_to_string(own.join("fit.json")).unwrap(), "as it was");
    assert_eq!(fs::read_dir(&own).unwrap().count(), 1);
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1, "something was left beside it");
}

/// One ball's part of [`tracker`], under the name that Tracker gives it, in the times of slow motion at 30 fps.
fn mass(name: &str, ball: usize) -> String {
    let mut text = format!(",{name},\nt,x,y\n");
    for line in tracker().lines().skip(3) {
        let cells: Vec<&str> = line.split(',').collect();
        let time: f64 = cells[0].parse().unwrap();
        text += &format!("{},{},{}\n", time * FPS / 30.0, cells[1 + 2 * ball], cells[2 + 2 * ball]);
    }
    text
}

/// A folder of exports of one ball each, of slow motion: what init drafts from it needs its blanks filled and no more, and
/// what is the same in every file is said once.
#[test]
fn a_folder_of_single_tracks_in_slow_motion() {
    let folder = tempfile::tempdir().unwrap();
    for shot in ["one", "two"] {
        for (ball, letter) in ["A", "B"].into_iter().enumerate() {
            let file = folder.path().join(format!("{shot}-{letter}.txt"));
            fs::write(file, mass(&format!("mass {letter}"), ball)).unwrap();
        }
    }
    let said = done([Path::new("init"), folder.path()]);
    assert!(said.contains("4 files of tracks") && said.contains("follow 30 frames"), "{said}");
    let path = folder.path().join("dataset.toml");
    let draft = fs::read_to_string(&path).unwrap();
    let filled = draft
        .replace("# assume = \"…\"", "assume = \"natural-roll\"")
        .replace("# capture_fps = …", "capture_fps = 1000");
    fs::write(&path, &filled).unwrap();
    let error = refused(2, [Path::new("check"), folder.path()]);
    assert!(error.contains("write playback_fps = 30"), "{error}");
    assert_eq!(error.matches("times are 0.0333").count(), 1, "{error}");
    assert!(error.contains("the same in "), "{error}");
    fs::write(&path, filled.replace("# playback_fps = 30", "playback_fps = 30")).unwrap();
    let said = done([Path::new("check"), folder.path()]);
    assert!(said.contains("2 shots can be used, 0 left out"), "{said}");
    assert!(said.contains("one-A.txt and 1 more: read as Tracker"), "{said}");
    fs::write(&path, filled.replace("# playback_fps = 30", "playback_fps = 15")).unwrap();
    let error = refused(2, [Path::new("check"), folder.path()]);
    assert!(error.contains("closer than [video] playback_fps = 15 allows"), "{error}");
}

#[test]
fn what_init_cannot_take_is_said() {
    let folder = tempfile::tempdir().unwrap();
    let error = refused(2, [Path::new("init"), folder.path()]);
    assert!(error.contains("holds no table (a file that ends in .csv, .txt"), "{error}");
    let film = folder.path().join("clip.mp4");
    fs::write(&film, [0_u8, 0, 0, 0x20, 0x66, 0x74, 0x79, 0x70, 0xff, 0xfe, 0x0a]).unwrap();
    let error = refused(2, [Path::new("init"), &film]);
    assert!(error.contains("not the film itself"), "{error}");
    assert!(!folder.path().join("dataset.toml").exists());
}

#[test]
fn a_folder_of_data_sets_is_none_but_says_which_it_holds() {
    let error = refused(2, [Path::new("fit"), &root().join("data")]);
    assert!(error.contains("alciatore-2006") && error.contains("more do"), "{error}");
}
