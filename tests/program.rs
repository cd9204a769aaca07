//! Runs of the program whose results stay: baselines that moved, interruptions.

use crate::cli::{done_in, refused_in};
use crate::prelude::*;

#[test]
fn a_baseline_that_moved_ends_with_status_1_and_is_kept() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().to_str().unwrap();
    let data = root().join("data/mathavan-2014");
    let data = data.to_str().unwrap();
    let stored = folder.path().join("mathavan-2014/fit.json");
    let path = stored.to_str().unwrap();
    done_in(root(), &["fit", data, "--out", out]);
    done_in(root(), &["fit", data, "--out", out, "--baseline", path]);

    let mut value: Value = serde_json::from_str(&fs::read_to_string(&stored).unwrap()).unwrap();
    let mu = &mut value["parameters"]["mu"];
    let (estimate, error) = (mu["estimate"].as_f64().unwrap(), mu["std_error"].as_f64().unwrap());
    mu["estimate"] = (estimate - 2.0 * error).into();
    value["parameters"]["mu_s"]["status"] = "free".into();
    let changed = value.to_string();
    fs::write(&stored, &changed).unwrap();
    let err = refused_in(root(), 1, &["fit", data, "--out", out, "--baseline", path]);
    for fragment in ["+2.000 standard errors", "mu_s status", "at-lower-bound"] {
        assert!(err.contains(fragment), "{fragment}:\n{err}");
    }
    assert_eq!(fs::read_to_string(&stored).unwrap(), changed, "the baseline was overwritten");
    let other = root().join("fits/domenech-2023/fit.json");
    assert!(
        refused_in(root(), 2, &["fit", data, "--out", out, "--baseline", other.to_str().unwrap()])
            .contains("holds no fit of mathavan-2014")
    );
    fs::write(&stored, "{\"dataset\": 3}").unwrap();
    assert!(refused_in(root(), 2, &["fit", data, "--out", out, "--baseline", path]).contains("fit.json:1"));
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
