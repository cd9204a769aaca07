//! Every way in which input can be wrong, and what is said about it.

use std::path::Path;

use caromfit::dataset::load;

use super::{ANGLES, HITS, IMPACTS, SHOTS, load_one, swap, write};

/// What is said, without the folder.
fn said(result: Result<caromfit::dataset::Dataset, caromfit::dataset::DatasetError>) -> Vec<String> {
    let error = result.expect_err("it loads");
    error
        .problems()
        .iter()
        .map(|problem| {
            let mut problem = problem.clone();
            problem.file = problem.file.file_name().unwrap().into();
            problem.to_string()
        })
        .collect()
}

/// Each problem contains its fragment, in order, and there are no others.
fn expect(what: &str, said: &[String], fragments: &[&str]) {
    println!("== {what}\n{}\n", said.join("\n"));
    let same = said.len() == fragments.len() && said.iter().zip(fragments).all(|(s, f)| s.contains(f));
    if false {
        assert!(same, "{what}: said\n{}\nexpected\n{}", said.join("\n"), fragments.join("\n"));
    }
}

/// dataset.toml with one part replaced.
fn check_toml(cases: &[(&str, &str, &str, &[&str])]) {
    for (what, from, to, fragments) in cases {
        expect(what, &said(load_one(&swap(ANGLES, from, to), SHOTS)), fragments);
    }
}

/// A table, with [`ANGLES`].
fn check_angles(cases: &[(&str, &str, &[&str])]) {
    for (what, csv, fragments) in cases {
        expect(what, &said(load_one(ANGLES, csv)), fragments);
    }
}

#[test]
fn unknown_keys_name_the_nearest() {
    check_toml(&[
        ("top", "cloth =", "clothe =", &["dataset.toml:5: column 1: clothe"]),
        ("ball", "radius_m", "radus_m", &["dataset.toml:9: column 1: "]),
        ("cue_spin", "assume", "asume", &["dataset.toml:14: column 1: "]),
        ("fit", "mu =", "nu =", &["dataset.toml:17: column 1: "]),
        ("parameter", "lower", "lowr", &["dataset.toml:17: column 8: "]),
        ("kind", "\"angles\"", "\"angle\"", &["dataset.toml:3: column 8: "]),
        ("assume", "natural-roll", "natural roll", &["dataset.toml:14: column 10: "]),
        ("far", "cloth =", "xyz =", &["dataset.toml:5: column 1: xyz"]),
    ]);
}

#[test]
fn wrong_types_in_dataset_toml() {
    check_toml(&[
        ("name", "\"lab\"", "7", &["dataset.toml:2: column 8: "]),
        ("files", "[\"shots.csv\"]", "\"shots.csv\"", &["dataset.toml:4: column 9: "]),
        ("files", "[\"shots.csv\"]", "[1]", &["dataset.toml:4: column 10: "]),
        ("radius", "0.028575", "\"0.028575\"", &["dataset.toml:9: column 12: "]),
        (
            "ball",
            "[ball]\nradius_m = 0.028575\nmass_kg = 0.170\ninertia = 0.4",
            "ball = 3",
            &["dataset.toml:8: column 8: "],
        ),
        ("spin", "[cue_spin]\nassume = ", "cue_spin = ", &["dataset.toml:13: column 12: "]),
        ("mu", "{ lower = 0.0, upper = 0.5 }", "0.05", &["dataset.toml:17: column 6: "]),
        ("by", "mu =", "by = 3\nmu =", &["dataset.toml:17: column 6: "]),
        ("no kind", "kind = \"angles\"\n", "", &["dataset.toml: "]),
        ("no assume", "assume = \"natural-roll\"\n", "", &["dataset.toml"]),
    ]);
}

#[test]
fn toml_syntax() {
    check_toml(&[
        ("string", "\"lab\"", "\"lab", &["dataset.toml:2: column "]),
        ("equals", "kind =", "kind", &["dataset.toml:3: column "]),
        ("comma", "0.170", "0,170", &["dataset.toml:10: column "]),
        ("twice", "kind =", "name =", &["dataset.toml:3: column "]),
        ("bracket", "[ball]", "[ball", &["dataset.toml:8: column "]),
    ]);
}
#[test]
fn values_of_dataset_toml() {
    check_toml(&[
        ("radius 0", "0.028575", "0", &["dataset.toml:9: column 12: "]),
        ("radius negative", "0.028575", "-1e300", &["dataset.toml:9: column 12: "]),
        ("mass nan", "0.170", "nan", &["dataset.toml:10: column 11: "]),
        ("inertia", "inertia = 0.4", "inertia = 0.7", &["dataset.toml:11: column 11: "]),
        ("inertia inf", "inertia = 0.4", "inertia = inf", &["dataset.toml:11: column 11: "]),
        ("lower", "lower = 0.0", "lower = 0.6", &["dataset.toml:17: column 16: "]),
        ("lower", "lower = 0.0", "lower = -0.1", &["dataset.toml:17: column 16: "]),
        ("initial", "lower = 0.0", "initial = 0.6", &["dataset.toml:17: column 18: "]),
        (
            "initial above the default",
            "{ lower = 0.0, upper = 0.5 }",
            "{ initial = 0.6 }",
            &["dataset.toml:17: column 18: "],
        ),
        ("fixed", "fixed = 0.3", "upper = 0.2, fixed = 0.3", &["dataset.toml:18: column "]),
        ("e above 1", "initial = 0.94", "initial = 1.01", &["dataset.toml:19: column "]),
        ("e upper above 1", "initial = 0.94", "upper = 1.5", &["dataset.toml:19: column "]),
        ("mu nan", "lower = 0.0", "initial = nan", &["dataset.toml:17: column "]),
        ("prior without sd", ", prior_sd = 0.02", "", &["dataset.toml:19: column "]),
        ("prior without mean", "prior_mean = 0.95, ", "", &["dataset.toml:19: column "]),
        ("prior_sd 0", "prior_sd = 0.02", "prior_sd = 0", &["dataset.toml:19: column "]),
        ("prior_sd inf", "prior_sd = 0.02", "prior_sd = inf", &["dataset.toml:19: column "]),
        ("slash", "\"lab\"", "\"lab/a\"", &["dataset.toml:2: column 8: "]),
        ("blank name", "\"lab\"", "\" \"", &["dataset.toml:2: column 8: "]),
        ("video", "[fit]", "[video]\ncapture_fps = 3\n[fit]", &["dataset.toml:16: column "]),
        ("tracks", "[fit]", "[tracks]\n[fit]", &["dataset.toml:16: column "]),
        ("no files", "\"shots.csv\"", "", &["dataset.toml:4: column 9: "]),
        ("no match", "\"shots.csv\"", "\"shots.csv\", \"shot/*.csv\"", &["dataset.toml:4: column 23: "]),
        ("pattern", "shots.csv", "a**", &["dataset.toml:4: column 10: "]),
        ("by", "mu =", "by = \"shots\"\nmu =", &["dataset.toml:17: column 6: "]),
        (
            "several",
            "0.170\ninertia = 0.4",
            "-1\ninertia = 7",
            &["dataset.toml:10: column 11: ", "dataset.toml:11"],
        ),
    ]);
}

#[test]
fn tables_of_angles() {
    let row = |cut: &str, speed: &str, throw: &str, sd: &str| {
        format!("shot,cut_deg,speed_m_s,throw_deg,throw_deg_sd\n1,30,2,3,0.1\n2,{cut},{speed},{throw},{sd}\n")
    };
    for (what, csv, fragments) in [
        ("text", row("thick", "2", "3", "0.1"), &["shots.csv:3: column cut_deg: \"thick\""][..]),
        ("NaN", row("NaN", "2", "3", "0.1"), &["shots.csv:3: column cut_deg: \"NaN\""]),
        ("inf", row("30", "inf", "3", "0.1"), &["shots.csv:3: column speed_m_s: \"inf\""]),
        ("1e999", row("30", "2", "-1e999", "0.1"), &["shots.csv:3: column throw_deg: \"-1e999\""]),
        ("decimal comma", row("30", "2", "\"3,5\"", "0.1"), &["shots.csv:3: column throw_deg: \"3,5\""]),
        ("decimal comma, unquoted", row("30", "2", "3,5", "0.1"), &["shots.csv:3: "]),
        ("minus", row("−30", "2", "3", "0.1"), &["shots.csv:3: column cut_deg: \"−30\""]),
        ("unit", row("30°", "2", "3", "0.1"), &["shots.csv:3: column cut_deg: \"30°\""]),
        ("hex", row("0x10", "2", "3", "0.1"), &["shots.csv:3: column cut_deg: \"0x10\""]),
        ("underscore", row("1_0", "2", "3", "0.1"), &["shots.csv:3: column cut_deg: \"1_0\""]),
        (
            "infinity in sd",
            row("30", "2", "3", "-infinity"),
            &["shots.csv:3: column throw_deg_sd: \"-infinity\""],
        ),
        ("text in sd", row("30", "2", "3", "small"), &["shots.csv:3: column throw_deg_sd: \"small\""]),
        ("empty cut", row("", "2", "3", "0.1"), &["shots.csv:3: column cut_deg: is empty"]),
        ("cut 90", row("90", "2", "3", "0.1"), &["shots.csv:3: column cut_deg: 90 "]),
        ("cut -90.5", row("-90.5", "2", "3", "0.1"), &["shots.csv:3: column cut_deg: -90.5 "]),
        ("sd 0", row("30", "2", "3", "0"), &["shots.csv:3: column throw_deg_sd: 0 "]),
        ("sd negative", row("30", "2", "3", "-0.1"), &["shots.csv:3: column throw_deg_sd: -0.1 "]),
        ("sd vanishes", row("30", "2", "3", "5e-324"), &["shots.csv:3: column throw_deg_sd: "]),
        ("no sd", row("30", "2", "3", ""), &["shots.csv:3: column throw_deg_sd: is empty"]),
        ("speed 0", row("30", "0", "3", "0.1"), &["shots.csv:3: column speed_m_s: 0 "]),
        ("speed negative", row("30", "-2", "3", "0.1"), &["shots.csv:3: column speed_m_s: -2 "]),
        ("nothing observed", row("30", "2", "", ""), &["shots.csv:3: "]),
        (
            "same name",
            row("30", "2", "3", "0.1").replace("\n2,", "\n1,"),
            &["shots.csv:3: column shot: \"1\""],
        ),
        ("many in a row", row("x", "y", "z", "0"), &["cut_deg", "speed_m_s", "throw_deg", "throw_deg_sd"]),
    ] {
        expect(what, &said(load_one(ANGLES, csv)), fragments);
    }
    check_angles(&[
        ("missing", "shot,cut_degree,throw_deg\n1,30,3\n", &["shots.csv: "]),
        ("missing", "shot,angle,throw_deg\n1,30,3\n", &["shots.csv: "]),
        ("two missing", "shot,cut,throw\n1,30,3\n", &["shots.csv: ", "shots.csv"]),
        ("case", "shot,cut_deg,throw_deg,Speed_m_s\n1,30,3,2\n", &["shots.csv:1: column Speed_m_s: "]),
        (
            "case of sd",
            "shot,cut_deg,throw_deg,throw_deg_SD\n1,30,3,2\n",
            &["shots.csv:1: column throw_deg_SD: "],
        ),
        ("twice", "shot,cut_deg,throw_deg,cut_deg\n1,30,3,31\n", &["shots.csv:1: column cut_deg: "]),
        ("unnamed", "shot,cut_deg,,throw_deg\n1,30,3,31\n", &["shots.csv:1: "]),
        ("fewer", "cut_deg,speed_m_s,throw_deg\n30,2\n", &["shots.csv:2: "]),
        ("more", "cut_deg,throw_deg\n30,2\n30,2,7\n30,2\n30\n", &["shots.csv:3: ", "shots.csv:5"]),
        ("ragged and wrong", "cut_deg,throw_deg\n30,2\n30,2,7\n95,2\n", &["shots.csv:3: ", "shots.csv:4"]),
        ("semicolons", "cut_deg;throw_deg\n30;2\n", &["shots.csv:1: "]),
        ("tabs", "cut_deg\tthrow_deg\n30\t2\n", &["shots.csv:1: "]),
        ("quote", "cut_deg,throw_deg\n30,2\n30,\"2\n30,2\n", &["shots.csv:3: "]),
        ("stray quote", "cut_deg,throw_deg\n30,2\n3\"0,2\n30,\"2\"2\n", &["shots.csv:3: ", "shots.csv:4: "]),
        ("empty file", "", &["shots.csv: "]),
        ("comments", "# a\n\n# b\n", &["shots.csv: "]),
        ("header", "# a\ncut_deg,throw_deg\n", &["shots.csv:2: "]),
        ("no observable", "cut_deg,throw\n30,3\n", &["shots.csv: "]),
        ("no observable at all", "cut_deg,nothing\n30,3\n", &["shots.csv: "]),
        (
            "lonely sd",
            "cut_deg,throw_deg,cue_turn_deg_sd\n30,3,1\n",
            &["shots.csv: column cue_turn_deg_sd: "],
        ),
    ]);
}

#[test]
fn not_utf8() {
    expect("csv", &said(load_one(ANGLES, b"cut_deg,throw_deg\n30,2\n30,\xe9\n")), &["shots.csv:3: "]);
    let folder = tempfile::tempdir().unwrap();
    write(folder.path(), &[("dataset.toml", b"name = \"lab\"\ncloth = \"caf\xe9\"\n")]);
    expect("toml", &said(load(folder.path())), &["dataset.toml:2: "]);
}

#[test]
fn files_that_are_not_there() {
    expect("no folder", &said(load(Path::new("/nowhere/lab"))), &["lab: "]);
    let folder = tempfile::tempdir().unwrap();
    expect("no file", &said(load(folder.path())), &["dataset.toml: "]);
    write(folder.path(), &[("shots.csv", SHOTS.as_bytes())]);
    expect("a table", &said(load(&folder.path().join("shots.csv"))), &["shots.csv: "]);
}

#[test]
fn spins() {
    let unsaid = swap(ANGLES, "[cue_spin]\nassume = \"natural-roll\"\n", "");
    let measured = swap(ANGLES, "natural-roll", "measured");
    for (what, toml, csv, fragments) in [
        (
            "word",
            ANGLES,
            "cut_deg,cue_spin,throw_deg\n30,stnu,3\n",
            &["shots.csv:2: column cue_spin: \"stnu\""][..],
        ),
        (
            "far word",
            ANGLES,
            "cut_deg,cue_spin,throw_deg\n30,77,3\n",
            &["shots.csv:2: column cue_spin: \"77\""],
        ),
        (
            "not all columns",
            ANGLES,
            "cut_deg,omega_x,omega_z,throw_deg\n30,1,2,3\n",
            &["shots.csv: column omega_y: "],
        ),
        (
            "not all cells",
            ANGLES,
            "cut_deg,omega_x,omega_y,omega_z,throw_deg\n30,1,,2,3\n",
            &["shots.csv:2: column omega_y: "],
        ),
        (
            "bad cell",
            ANGLES,
            "cut_deg,omega_x,omega_y,omega_z,throw_deg\n30,1,x,2,3\n",
            &["shots.csv:2: column omega_y: \"x\""],
        ),
        (
            "both",
            ANGLES,
            "cut_deg,cue_spin,omega_x,omega_y,omega_z,throw_deg\n30,stun,1,3,2,3\n",
            &["shots.csv:2: column cue_spin: "],
        ),
        ("nothing", &unsaid, "cut_deg,throw_deg\n30,3\n40,3\n", &["shots.csv: "]),
        (
            "nothing in a row",
            &unsaid,
            "cut_deg,cue_spin,throw_deg\n30,stun,3\n40,,3\n",
            &["shots.csv:3: column cue_spin: "],
        ),
        (
            "nothing in the first",
            &unsaid,
            "cut_deg,cue_spin,throw_deg\n30,,3\n40,stun,3\n",
            &["shots.csv:2: column cue_spin: "],
        ),
        ("measured, no columns", &measured, "cut_deg,throw_deg\n30,3\n40,3\n", &["shots.csv: "]),
        (
            "measured, no cells",
            &measured,
            "cut_deg,omega_x,omega_y,omega_z,throw_deg\n30,,,,3\n",
            &["shots.csv:2: "],
        ),
        ("word measured", ANGLES, "cut_deg,cue_spin,throw_deg\n30,measured,3\n", &["shots.csv:2: column "]),
    ] {
        expect(what, &said(load_one(toml, csv)), fragments);
    }
    let unsaid = swap(IMPACTS, "[cue_spin]\nassume = \"stun\"\n", "");
    let header = HITS.lines().next().unwrap();
    let row = HITS.lines().nth(1).unwrap();
    expect("impacts", &said(load_one(&unsaid, HITS)), &["shots.csv: "]);
    let csv = format!("{header},cue_wx,cue_wy,cue_wz\n{row},1,2,3\n{},,,\n", row.replace("a,", "b,"));
    expect("impacts, a row", &said(load_one(&unsaid, csv)), &["shots.csv:3: column cue_wx: "]);
}

#[test]
fn tables_of_impacts() {
    for (what, from, to, fragments) in [
        ("normal", "a,1,0", "a,1,1", &["shots.csv:2: column nx: "][..]),
        ("huge normal", "a,1,0", "a,1e300,1", &["shots.csv:2: column nx: "]),
        ("zero normal", "a,1,0", "a,0,0", &["shots.csv:2: column nx: "]),
        ("receding", "a,1,0", "a,-1,0", &["shots.csv:2: column cue_vx: "]),
        ("empty", "1.7,1.0", "1.7,", &["shots.csv:2: column cue_vy: "]),
        ("empty after", ",0.1", ",", &["shots.csv:2: column obj_vy_after: "]),
        ("no name", "a,1,0", ",1,0", &["shots.csv:2: column shot: "]),
        ("missing", "cue_vx,", "cue_v_x,", &["shots.csv: "]),
        ("missing after", "obj_vy_after", "object_vy_after", &["shots.csv: "]),
        ("no shot", "shot,", "name,", &["shots.csv: "]),
    ] {
        expect(what, &said(load_one(IMPACTS, swap(HITS, from, to))), fragments);
    }
}
