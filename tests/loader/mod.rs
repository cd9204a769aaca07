//! Loading of damaged and of random input.

mod damaged;
mod hostile;

use std::fs;
use std::path::Path;

/// A valid dataset.toml of kind `angles`.
pub const ANGLES: &str = r#"# a comment
name = "lab"
kind = "angles"
files = ["shots.csv"]
cloth = "Simonis 860"
source = "us"

[ball]
radius_m = 0.028575
mass_kg = 0.170
inertia = 0.4

[cue_spin]
assume = "natural-roll"

[fit]
mu = { lower = 0.0, upper = 0.5 }
mu_s = { fixed = 0.3 }
e = { initial = 0.94, prior_mean = 0.95, prior_sd = 0.02 }
"#;

/// A valid table of kind `angles`.
pub const SHOTS: &str = "shot,cut_deg,speed_m_s,throw_deg,throw_deg_sd\n1,30,2,3.0,0.1\n2,45,1.5,2.5,0.1\n";

/// A valid dataset.toml of kind `impacts`.
pub const IMPACTS: &str = r#"name = "lab"
kind = "impacts"
files = ["shots.csv"]

[cue_spin]
assume = "stun"
"#;

/// A valid table of kind `impacts`.
pub const HITS: &str = "shot,nx,ny,cue_vx,cue_vy,cue_vx_after,cue_vy_after,obj_vx_after,obj_vy_after\n\
                        a,1,0,1.7,1.0,0.05,0.9,1.6,0.1\n";

/// Writes files into a folder.
pub fn write(folder: &Path, files: &[(&str, &[u8])]) {
    for (name, content) in files {
        let path = folder.join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, content).unwrap();
    }
}

/// `text` with one part of it replaced, which must be there.
pub fn swap(text: &str, from: &str, to: &str) -> String {
    assert!(text.contains(from), "{from}");
    text.replacen(from, to, 1)
}
