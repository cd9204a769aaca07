//! Much footage from CSV to fitted parameters: time and memory of the whole program.
//!
//! `CAROMFIT_LARGE=100000 cargo test --release -- --nocapture large_footage` makes and fits 555 MB.

use std::process::Stdio;
use std::time::Duration;

use crate::prelude::*;

const SPEC: &str = r#"
name = "large"
kind = "tracks"
seed = 3
truth = { mu = 0.06, mu_s = 0.25, e = 0.95 }
[shots]
count = 100
speed_m_s = [1.0, 4.0]
cut_deg = [-50.0, 50.0]
cue_spin = ["natural-roll"]
"#;

/// A fit may be this many of its standard errors off.
const ERRORS: f64 = 5.0;

/// Many shots find what the model leaves out of the errors: besides those, an estimate may be off by this.
const SYSTEMATIC: [f64; 3] = [2e-5, 5e-4, 2e-5];

/// Peak resident memory of a process in MiB, where the system tells.
fn peak_mib(id: u32) -> Option<f64> {
    let status = fs::read_to_string(format!("/proc/{id}/status")).ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    Some(line.trim().strip_suffix("kB")?.trim().parse::<f64>().ok()? / 1024.0)
}

#[test]
fn large_footage() {
    let count = count("CAROMFIT_LARGE", 100);
    let mut spec: Spec = toml::from_str(SPEC).unwrap();
    spec.shots.count = count;
    let folder = tempfile::tempdir().unwrap();
    let mut bytes = 0;
    for (name, content) in simulate::generate(&spec).unwrap() {
        bytes += content.len();
        fs::write(folder.path().join(name), content).unwrap();
    }
    let begun = Instant::now();
    let mut child = Command::new(env!("CARGO_BIN_EXE_caromfit"))
        .arg("fit")
        .arg(folder.path())
        .arg("--out")
        .arg(folder.path().join("fits"))
        .stdout(Stdio::null())
        .spawn()
        .unwrap();
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
    figure(format!("{count} shots, {} MB: {seconds:.1} s, at most {peak:.0} MiB", bytes / 1_000_000));
    let json = fs::read_to_string(folder.path().join("fits/large/fit.json")).unwrap();
    let fit: Value = serde_json::from_str(&json).unwrap();
    assert_eq!(fit["shots_used"], count);
    for ((name, truth), systematic) in [("mu", 0.06), ("mu_s", 0.25), ("e", 0.95)].into_iter().zip(SYSTEMATIC)
    {
        let parameter = &fit["parameters"][name];
        let (value, error) =
            (parameter["estimate"].as_f64().unwrap(), parameter["std_error"].as_f64().unwrap());
        assert!((value - truth).abs() < ERRORS * error + systematic, "{name}: {value} ± {error}");
    }
}
