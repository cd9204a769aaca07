//! `caromfit export`: what other programs read, and what is left behind.

use crate::cli::{done_in, refused_in};
use crate::prelude::*;

#[test]
fn export_gives_what_pooltool_reads_and_says_what_is_left_behind() {
    let fit = root().join("fits/synthetic-natural-roll");
    let [out, err] = done_in(root(), &["export", fit.to_str().unwrap(), "--to", "pooltool"]);
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
    let file = fit.join("fit.json");
    let [text, _] = done_in(root(), &["export", file.to_str().unwrap(), "--to", "toml"]);
    let table: toml::Table = toml::from_str(&text).unwrap();
    assert_eq!(table["mu"]["status"].as_str(), Some("free"));
    // a parameter that nothing told is not exported
    let slow = root().join("fits/alciatore-2006/slow");
    let [out, err] = done_in(root(), &["export", slow.to_str().unwrap(), "--to", "json"]);
    assert!(!out.contains("mu_s") && err.contains("μ_s: the data do not tell it"), "{out}{err}");
    let several = root().join("fits/alciatore-2006");
    assert!(
        refused_in(root(), 2, &["export", several.to_str().unwrap(), "--to", "json"])
            .contains("holds 3 fits")
    );
}

/// μ(v) = μ + b·exp(−c·v): without b and c, μ is the friction at high slip only.
#[test]
fn export_carries_a_falling_friction_over_or_says_that_it_cannot() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().to_str().unwrap();
    let data = root().join("data/alciatore-2014-speed");
    for falling in ["fit", "0.1,1.5"] {
        done_in(root(), &["fit", data.to_str().unwrap(), "--out", out, "--falling", falling]);
        let path = folder.path().join("alciatore-2014-speed/fit.json");
        let stored: Value = serde_json::from_str(&fs::read_to_string(&path).unwrap()).unwrap();
        let of = |name: &str| stored["parameters"][name]["estimate"].as_f64().unwrap();
        let path = path.to_str().unwrap();
        let [text, _] = done_in(root(), &["export", path, "--to", "toml"]);
        let table: toml::Table = toml::from_str(&text).unwrap();
        for name in ["mu", "mu_b", "mu_c"] {
            assert_eq!(table[name]["estimate"].as_float(), Some(of(name)), "{falling}: {name}");
        }
        assert!(table["friction"].as_str().unwrap().contains("mu_b exp(-mu_c v)"), "{table}");
        let [out, err] = done_in(root(), &["export", path, "--to", "pooltool"]);
        assert!(!out.contains("u_b"), "{out}");
        let model = format!("AlciatoreBallBallFriction(a={}, b={}, c={})", of("mu"), of("mu_b"), of("mu_c"));
        assert!(err.contains(&model), "{model}:\n{err}");
    }
}
