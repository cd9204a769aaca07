//! Much footage from CSV to fitted parameters: time and memory of the whole program.
//!
//! `CAROMFIT_LARGE=100000 cargo test --release -- --nocapture large_footage` makes and fits 555 MB.

use std::process::Stdio;
use std::time::Duration;

use crate::prelude::*;

/// Peak resident memory of a process in MiB, where the system tells.
fn peak_mib(id: u32) -> Option<f64> {
    let status = fs::read_to_string(format!("/proc/{id}/status")).ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    Some(line.trim().strip_suffix("kB")?.trim().parse::<f64>().ok()? / 1024.0)
}

#[test]
fn large_footage() {
    /// Standard errors, and what many shots find that the model leaves out of the errors.
    const ERRORS: f64 = 5.0;
    const SYSTEMATIC: [f64; 3] = [2e-5, 5e-4, 2e-5];
    let shots = count("CAROMFIT_LARGE", 100);
    let spec = with(&spec("tracks", &["natural-roll"], shots, 3), "name = \"large\"");
    let folder = tempfile::tempdir().unwrap();
    for (name, content) in simulate::generate(&spec).unwrap() {
        fs::write(folder.path().join(name), content).unwrap();
    }
    let begun = Instant::now();
    let mut fit = Command::new(env!("CARGO_BIN_EXE_caromfit"));
    let mut child =
        fit.args(["fit", ".", "--out", "fits"]).current_dir(&folder).stdout(Stdio::null()).spawn().unwrap();
    let mut peak = 0.0_f64;
    let status = loop {
        peak = peak.max(peak_mib(child.id()).unwrap_or(0.0));
        if let Some(status) = child.try_wait().unwrap() {
            break status;
        }
        std::thread::sleep(Duration::from_millis(10));
    };
    let seconds = begun.elapsed().as_secs_f64();
    assert!(status.success());
    figure(format!("{shots} shots: {seconds:.1} s, at most {peak:.0} MiB"));
    let json = fs::read_to_string(folder.path().join("fits/large/fit.json")).unwrap();
    let fit: Value = serde_json::from_str(&json).unwrap();
    assert_eq!(fit["shots_used"], shots);
    for ((name, truth), systematic) in ["mu", "mu_s", "e"].into_iter().zip(TRUTH).zip(SYSTEMATIC) {
        let of = |key: &str| fit["parameters"][name][key].as_f64().unwrap();
        let (value, error) = (of("estimate"), of("std_error"));
        assert!((value - truth).abs() < ERRORS * error + systematic, "{name}: {value} ± {error}");
    }
}
