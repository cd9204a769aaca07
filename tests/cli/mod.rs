//! The program end to end: exit statuses, what it prints where, and what it leaves on the disk.

mod collide;
mod fit;

use std::collections::BTreeSet;
use std::fs;
use std::process::{Command, Output};

use serde_json::Value;

pub fn caromfit<S: AsRef<std::ffi::OsStr>>(args: impl IntoIterator<Item = S>) -> Output {
    Command::new(env!("CARGO_BIN_EXE_caromfit")).args(args).output().unwrap()
}

pub fn stdout(output: &Output) -> &str {
    std::str::from_utf8(&output.stdout).unwrap()
}

pub fn stderr(output: &Output) -> &str {
    std::str::from_utf8(&output.stderr).unwrap()
}

/// It was done, and nothing was said on standard error.
pub fn done(output: &Output) -> &str {
    assert_eq!(output.status.code(), Some(0), "{}", stderr(output));
    assert_eq!(stderr(output), "");
    stdout(output)
}

/// It ended with a status, and with nothing on standard output.
pub fn refused(output: &Output, status: i32) -> &str {
    assert_eq!(output.status.code(), Some(status), "{}{}", stdout(output), stderr(output));
    assert_eq!(stdout(output), "");
    stderr(output)
}

fn keys(value: &Value) -> BTreeSet<&str> {
    value.as_object().unwrap_or_else(|| panic!("{value}")).keys().map(String::as_str).collect()
}

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap_or_else(|| panic!("{value}")).iter().map(|x| x.as_f64().unwrap()).collect()
}

#[test]
fn help_version_and_usage() {
    for (args, status) in [
        (&["--help"][..], 0),
        (&["--version"], 0),
        (&["fit", "--help"], 0),
        (&["collide", "--help"], 0),
        (&[], 2),
        (&["nothing"], 2),
        (&["fit"], 2),
        (&["fit", "--nothing", "data"], 2),
        (&["collide"], 2),
        (&["collide", "--speed", "2"], 2),
        (&["collide", "--cases", "a.csv", "--mu", "0.1"], 2),
    ] {
        let output = caromfit(args);
        assert_eq!(output.status.code(), Some(status), "{args:?}");
        let (full, empty) =
            if status == 0 { (stdout(&output), stderr(&output)) } else { (stderr(&output), stdout(&output)) };
        assert!(!full.is_empty() && empty.is_empty(), "{args:?}");
    }
    assert_eq!(done(&caromfit(["--version"])), format!("caromfit {}\n", env!("CARGO_PKG_VERSION")));
}

/// The table, the CSV and the pictures, for seeded shots and for those of a data set.
#[test]
fn accuracy_against_time() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("accuracy");
    let output = caromfit(["accuracy", "--shots", "8", "--out", out.to_str().unwrap()]);
    assert!(done(&output).contains("Model error"), "{}", stdout(&output));
    assert!(stdout(&output).contains("Bias of a fit to 8 shots"), "{}", stdout(&output));
    let biases = fs::read_to_string(out.join("bias.csv")).unwrap();
    assert_eq!(biases.lines().count(), 1 + 7 * 3, "{biases}");
    for line in
        ["\nauto,1.2576,mu,0.05,", "\ninelastic,1.2576,mu,0.05,,,,\n", "\node compliant,1.2576,mu,0.05,"]
    {
        assert!(biases.contains(line), "{line}{biases}");
    }
    assert!(stdout(&output).contains("computed by contact with κ = 1.258"), "{}", stdout(&output));
    let csv = fs::read_to_string(out.join("accuracy.csv")).unwrap();
    // every fidelity but `contact`, which always resolves a compliant contact, against the exact solution
    for name in ["elastic", "inelastic", "linear", "full", "ode"] {
        assert!(csv.lines().any(|line| line.starts_with(&format!("{name},as-full,"))), "{name}");
    }
    assert!(!csv.contains("all,1e-6,exact") && csv.contains("contact,throw_deg"));
    let svg = fs::read_to_string(out.join("accuracy.svg")).unwrap();
    assert!(svg.contains("ode, compliant"));
    assert!(fs::read(out.join("accuracy.png")).unwrap().starts_with(b"\x89PNG"));

    let data = concat!(env!("CARGO_MANIFEST_DIR"), "/data/mathavan-2014");
    let output = caromfit(["accuracy", "--dataset", data, "--out", out.to_str().unwrap()]);
    assert!(done(&output).starts_with("5 shots"), "{}", stdout(&output));
    refused(&caromfit(["accuracy", "--shots", "0"]), 2);
}
