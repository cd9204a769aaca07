//! Every way in which input can be wrong, and what is said about it.

use std::path::Path;

use caromfit::io::{DatasetError, load};
use caromfit::measurement::dataset::Dataset;

use super::{ANGLES, HITS, IMPACTS, SHOTS, load_one, swap, write};

/// What is said, without the folder, a line for each problem.
fn said(folder: &Path, result: Result<Dataset, DatasetError>) -> String {
    let error = result.expect_err("it loads").to_string();
    let error =
        error.replace(&format!("{}/", folder.display()), "").replace(folder.to_str().unwrap(), "FOLDER");
    let (what, problems) = error.split_once("\n  ").unwrap();
    assert!(what.starts_with("the data set ") && what.ends_with(" cannot be used:"), "{what}");
    problems.replace("\n  ", "\n")
}

/// Exactly this is said of a data set.
fn expect(toml: &str, csv: impl AsRef<[u8]>, expected: &str) {
    let folder = tempfile::tempdir().unwrap();
    write(folder.path(), &[("dataset.toml", toml.as_bytes()), ("shots.csv", csv.as_ref())]);
    let said = said(folder.path(), load(folder.path()));
    assert!(said == expected, "said\n{said}\nexpected\n{expected}\n{toml}");
}

/// The parts of every line of a table, where ↵ stands for the end of a line.
fn parts<const N: usize>(table: &str) -> impl Iterator<Item = [String; N]> {
    table.lines().skip(1).map(|line| {
        let parts: Vec<String> = line.split(" ¦ ").map(|part| part.replace('↵', "\n")).collect();
        parts.try_into().unwrap_or_else(|_| panic!("{line}"))
    })
}

/// What of [`ANGLES`] is replaced, by what, and what is said.
const DATASETS: &str = r#"
cloth = ¦ clothe = ¦ dataset.toml:5: column 1: unknown key "clothe" (did you mean "cloth"?); expected one of name, kind, files, cloth, balls, source, ball, object, cue_spin, video, camera, table, scale, tracks, impacts, fit
radius_m ¦ radus_m ¦ dataset.toml:9: column 1: unknown key "radus_m" (did you mean "radius_m"?); expected one of shape, radius_m, radius_m_sd, mass_kg, mass_kg_sd, inertia, poisson
assume ¦ asume ¦ dataset.toml:14: column 1: unknown key "asume" (did you mean "assume"?); expected one of assume, side_sd, topspin_sd
mu = ¦ nu = ¦ dataset.toml:17: column 1: unknown key "nu" (did you mean "mu"?); expected one of mu, mu_s, e, mu_b, mu_c, kappa, e_slope, friction, by, loss
lower ¦ lowr ¦ dataset.toml:17: column 8: unknown key "lowr" (did you mean "lower"?); expected one of initial, lower, upper, fixed, prior_mean, prior_sd
"angles" ¦ "angle" ¦ dataset.toml:3: column 8: unknown word "angle" (did you mean "angles"?); expected one of tracks, impacts, angles
natural-roll ¦ natural roll ¦ dataset.toml:14: column 10: unknown word "natural roll" (did you mean "natural-roll"?); expected one of stun, natural-roll, measured, unknown
cloth = ¦ xyz = ¦ dataset.toml:5: column 1: unknown key "xyz"; expected one of name, kind, files, cloth, balls, source, ball, object, cue_spin, video, camera, table, scale, tracks, impacts, fit
"lab" ¦ 7 ¦ dataset.toml:2: column 8: 7 is of the wrong type; expected text in quotation marks
["shots.csv"] ¦ "shots.csv" ¦ dataset.toml:4: column 9: "shots.csv" is of the wrong type; expected a list, as in ["shots.csv"]
["shots.csv"] ¦ [1] ¦ dataset.toml:4: column 10: 1 is of the wrong type; expected text in quotation marks
0.028575 ¦ "0.028575" ¦ dataset.toml:9: column 12: "0.028575" is of the wrong type; expected a number, without quotation marks
[ball]↵radius_m = 0.028575↵mass_kg = 0.170↵inertia = 0.4 ¦ ball = 3 ¦ dataset.toml:8: column 8: 3 is of the wrong type; expected a table, as in [ball] radius_m = 0.028575
[ball]↵radius_m = 0.028575↵mass_kg = 0.170↵inertia = 0.4↵↵[cue_spin]↵assume =  ¦ cue_spin =  ¦ dataset.toml:8: column 12: "natural-roll" is of the wrong type; expected a table, as in [cue_spin] assume = "stun"
{ lower = 0.0, upper = 0.5 } ¦ 0.05 ¦ dataset.toml:17: column 6: 0.05 is of the wrong type; expected a table, as in { initial = 0.05, upper = 0.5 } or { fixed = 0.05 }
mu = ¦ by = 3↵mu = ¦ dataset.toml:17: column 6: 3 is of the wrong type; expected text in quotation marks
kind = "angles"↵ ¦  ¦ dataset.toml: the key kind is missing; expected kind = "tracks", "impacts" or "angles"
assume = "natural-roll"↵ ¦  ¦ shots.csv:1: the cue ball's spin is not stated; expected [cue_spin] assume = "stun", "natural-roll" or "unknown" in dataset.toml, a column cue_spin, or columns omega_x, omega_y, omega_z
"lab" ¦ "lab ¦ dataset.toml:2: column 12: invalid basic string, expected `"`
kind = ¦ kind ¦ dataset.toml:3: column 6: key with no value, expected `=`
0.170 ¦ 0,170 ¦ dataset.toml:10: column 12: unexpected key or value, expected newline, `#`; write decimals with a point, not a comma
kind = ¦ name = ¦ dataset.toml:3: column 1: the key name stands twice
[ball] ¦ [ball ¦ dataset.toml:8: column 6: unclosed table, expected `]`
0.028575 ¦ 0 ¦ dataset.toml:9: column 12: ball.radius_m is 0; expected more than 0
0.028575 ¦ -1e300 ¦ dataset.toml:9: column 12: ball.radius_m is -1e300; expected more than 0
0.170 ¦ nan ¦ dataset.toml:10: column 11: ball.mass_kg is nan; expected more than 0
inertia = 0.4 ¦ inertia = 0.7 ¦ dataset.toml:11: column 11: ball.inertia is 0.7; expected more than 0, at most 2/3 (a hollow sphere)
inertia = 0.4 ¦ inertia = inf ¦ dataset.toml:11: column 11: ball.inertia is inf; expected more than 0, at most 2/3 (a hollow sphere)
lower = 0.0 ¦ lower = 0.6 ¦ dataset.toml:17: column 16: mu.lower is 0.6, above mu.upper, 0.5; expected lower ≤ upper
lower = 0.0 ¦ lower = -0.1 ¦ dataset.toml:17: column 16: mu.lower is -0.1; expected 0 or more
lower = 0.0 ¦ initial = 0.6 ¦ dataset.toml:17: column 18: mu.initial is 0.6; expected 0.0 to 0.5, its bounds
{ lower = 0.0, upper = 0.5 } ¦ { initial = 0.6 } ¦ dataset.toml:17: column 18: mu.initial is 0.6; expected 0.0 to 0.5, its bounds (give mu.upper to move the upper one)
fixed = 0.3 ¦ upper = 0.2, fixed = 0.3 ¦ dataset.toml:18: column 31: mu_s.fixed is 0.3; expected 0.0 to 0.2, its bounds
initial = 0.94 ¦ initial = 1.01 ¦ dataset.toml:19: column 17: e.initial is 1.01; expected 0 to 1
initial = 0.94 ¦ upper = 1.5 ¦ dataset.toml:19: column 15: e.upper is 1.5; expected 0 to 1
lower = 0.0 ¦ initial = nan ¦ dataset.toml:17: column 18: mu.initial is nan; expected 0 or more
, prior_sd = 0.02 ¦  ¦ dataset.toml:19: column 36: e: only one of prior_mean and prior_sd; expected both or none
prior_mean = 0.95,  ¦  ¦ dataset.toml:19: column 34: e: only one of prior_mean and prior_sd; expected both or none
prior_sd = 0.02 ¦ prior_sd = 0 ¦ dataset.toml:19: column 53: e.prior_sd is 0; expected more than 0
prior_sd = 0.02 ¦ prior_sd = inf ¦ dataset.toml:19: column 53: e.prior_sd is inf; expected a finite number
"lab" ¦ "lab/a" ¦ dataset.toml:2: column 8: name is "lab/a"; expected one that can name a folder, without slashes, control characters and blanks around it
"lab" ¦ " " ¦ dataset.toml:2: column 8: name is " "; expected one that can name a folder, without slashes, control characters and blanks around it
[fit] ¦ [video]↵capture_fps = 3↵[fit] ¦ dataset.toml:16: column 1: [video] stands in a data set of kind "angles"; it goes with "tracks" only
[fit] ¦ [tracks]↵[fit] ¦ dataset.toml:16: column 1: [tracks] stands in a data set of kind "angles"; it goes with "tracks" only
"shots.csv" ¦  ¦ dataset.toml:4: column 9: files is empty; expected at least one, as in ["shots.csv"]
"shots.csv" ¦ "shots.csv", "shot/*.csv" ¦ dataset.toml:4: column 23: "shot/*.csv" names no file in FOLDER; expected at least one
shots.csv ¦ a** ¦ dataset.toml:4: column 10: "a**" is not a pattern: recursive wildcards must form a single path component
mu = ¦ by = "shots"↵mu = ¦ dataset.toml:17: column 6: by is "shots", but shots.csv has no such column (did you mean "shot"?)
0.170↵inertia = 0.4 ¦ -1↵inertia = 7 ¦ dataset.toml:10: column 11: ball.mass_kg is -1; expected more than 0↵dataset.toml:11: column 11: ball.inertia is 7; expected more than 0, at most 2/3 (a hollow sphere)"#;

#[test]
fn dataset_toml() {
    for [from, to, expected] in parts(DATASETS) {
        expect(&swap(ANGLES, &from, &to), SHOTS, &expected);
    }
}

/// The last row of a table of angles, and what is said.
const ROWS: &str = r#"
2,thick,2,3,0.1 ¦ shots.csv:3: column cut_deg: "thick" is not a finite number; expected one such as -1.5 or 2e-3
2,NaN,2,3,0.1 ¦ shots.csv:3: column cut_deg: "NaN" is not a finite number; expected an empty cell if the value is not known
2,30,inf,3,0.1 ¦ shots.csv:3: column speed_m_s: "inf" is not a finite number; expected one such as -1.5 or 2e-3
2,30,2,-1e999,0.1 ¦ shots.csv:3: column throw_deg: "-1e999" is not a finite number; expected one between -1.7976931348623157e308 and 1.7976931348623157e308
2,30,2,"3,5",0.1 ¦ shots.csv:3: column throw_deg: "3,5" is not a finite number; expected a decimal point, 3.5
2,30,2,3,5,0.1 ¦ shots.csv:3: 6 cells; expected 5, as in the header; write decimals with a point, and text that has commas in quotation marks
2,−30,2,3,0.1 ¦ shots.csv:3: column cut_deg: "−30" is not a finite number; expected a plain minus sign, -30
2,30°,2,3,0.1 ¦ shots.csv:3: column cut_deg: "30°" is not a finite number; expected one such as -1.5 or 2e-3
2,0x10,2,3,0.1 ¦ shots.csv:3: column cut_deg: "0x10" is not a finite number; expected one such as -1.5 or 2e-3
2,1_0,2,3,0.1 ¦ shots.csv:3: column cut_deg: "1_0" is not a finite number; expected one such as -1.5 or 2e-3
2,30,2,3,-infinity ¦ shots.csv:3: column throw_deg_sd: "-infinity" is not a finite number; expected one such as -1.5 or 2e-3
2,30,2,3,small ¦ shots.csv:3: column throw_deg_sd: "small" is not a finite number; expected one such as -1.5 or 2e-3
2,,2,3,0.1 ¦ shots.csv:3: column cut_deg: is empty; expected a value
2,90,2,3,0.1 ¦ shots.csv:3: column cut_deg: 90 is not a cut angle; expected degrees, more than -90 and less than 90
2,-90.5,2,3,0.1 ¦ shots.csv:3: column cut_deg: -90.5 is not a cut angle; expected degrees, more than -90 and less than 90
2,30,2,3,0 ¦ shots.csv:3: column throw_deg_sd: 0 is not a standard deviation; expected more than 0
2,30,2,3,-0.1 ¦ shots.csv:3: column throw_deg_sd: -0.1 is not a standard deviation; expected more than 0
2,30,2,3,5e-324 ¦ shots.csv:3: column throw_deg_sd: 5e-324 is not a standard deviation; expected more than 0
2,30,2,3, ¦ shots.csv:3: column throw_deg_sd: is empty, but line 2 has one; give a standard deviation for every throw_deg or for none
2,30,0,3,0.1 ¦ shots.csv:3: column speed_m_s: 0 is not a speed; expected more than 0
2,30,-2,3,0.1 ¦ shots.csv:3: column speed_m_s: -2 is not a speed; expected more than 0
2,30,2,, ¦ shots.csv:3: no observed value in this row; expected a value in throw_deg
2,x,y,z,0 ¦ shots.csv:3: column cut_deg: "x" is not a finite number; expected one such as -1.5 or 2e-3↵shots.csv:3: column speed_m_s: "y" is not a finite number; expected one such as -1.5 or 2e-3↵shots.csv:3: column throw_deg: "z" is not a finite number; expected one such as -1.5 or 2e-3↵shots.csv:3: column throw_deg_sd: 0 is not a standard deviation; expected more than 0
1,30,2,3,0.1 ¦ shots.csv:3: column shot: "1" also names the shot in line 2 of shots.csv; expected a name of its own"#;

/// A table of angles, and what is said.
const TABLES: &str = r#"
shot,cut_degree,throw_deg↵1,30,3↵ ¦ shots.csv:1: column cut_deg: is missing from the column names; is "cut_degree" meant to be it?
shot,angle,throw_deg↵1,30,3↵ ¦ shots.csv:1: column cut_deg: is missing from the column names
shot,cut,throw↵1,30,3↵ ¦ shots.csv:1: column cut_deg: is missing from the column names; is "cut" meant to be it?↵shots.csv:1: no column of anything observed; expected at least one of throw_deg, cue_turn_deg, separation_deg, object_speed_m_s, cue_speed_m_s, object_speed_ratio, object_speed_rolling_m_s, cue_speed_rolling_m_s, cue_turn_rolling_deg, object_angle_rolling_deg; is "throw" meant to be throw_deg?
shot,cut_deg,throw_deg,Speed_m_s↵1,30,3,2↵ ¦ shots.csv:1: column Speed_m_s: is not a known name; write speed_m_s
shot,cut_deg,throw_deg,throw_deg_SD↵1,30,3,2↵ ¦ shots.csv:1: column throw_deg_SD: is not a known name; write throw_deg_sd
shot,cut_deg,throw_deg,cut_deg↵1,30,3,31↵ ¦ shots.csv:1: column cut_deg: stands twice among the column names
shot,cut_deg,,throw_deg↵1,30,3,31↵ ¦ shots.csv:1: column 3 has no name
cut_deg,speed_m_s,throw_deg↵30,2↵ ¦ shots.csv:2: 2 cells; expected 3, as in the header; leave a cell empty, but keep its comma
cut_deg,throw_deg↵30,2↵30,2,7↵30,2↵30↵ ¦ shots.csv:3: 3 cells; expected 2, as in the header; write decimals with a point, and text that has commas in quotation marks↵shots.csv:5: 1 cell; expected 2, as in the header; leave a cell empty, but keep its comma
cut_deg,throw_deg↵30,2↵30,2,7↵95,2↵ ¦ shots.csv:3: 3 cells; expected 2, as in the header; write decimals with a point, and text that has commas in quotation marks↵shots.csv:4: column cut_deg: 95 is not a cut angle; expected degrees, more than -90 and less than 90
cut_deg;throw_deg↵30;2;1↵45↵ ¦ shots.csv:2: 3 cells; expected 2, as in the header; write text that has semicolons in quotation marks↵shots.csv:3: 1 cell; expected 2, as in the header; leave a cell empty, but keep its semicolon
cut_deg;throw_deg;speed_m_s↵30;2,5;1,874↵30;2,5;998↵ ¦ shots.csv:2: column speed_m_s: "1,874" beside "998" (line 3) may be thousands or have a decimal comma; expected numbers without a mark between thousands, and more digits where it is decimal
cut_deg;throw_deg;speed_m_s↵30;2,5;1.874,5↵ ¦ shots.csv:2: column speed_m_s: "1.874,5" is not a finite number; expected one such as -1.5 or 2e-3
cut_deg,throw_deg↵30,2↵30,"2↵30,2↵ ¦ shots.csv:3: a quotation mark opens here and is never closed
cut_deg,throw_deg↵30,2↵3"0,2↵30,"2"2↵ ¦ shots.csv:4: text follows a closing quotation mark; expected the end of the cell, or "" for a quotation mark within the cell↵shots.csv:3: column cut_deg: "3"0" is not a finite number; expected one such as -1.5 or 2e-3
 ¦ shots.csv: is empty; expected a line of column names, and rows below it
# a↵↵# b↵ ¦ shots.csv: is empty; expected a line of column names, and rows below it
# a↵cut_deg,throw_deg↵ ¦ shots.csv:2: no rows below the column names; expected at least one
cut_deg,throw↵30,3↵ ¦ shots.csv:1: no column of anything observed; expected at least one of throw_deg, cue_turn_deg, separation_deg, object_speed_m_s, cue_speed_m_s, object_speed_ratio, object_speed_rolling_m_s, cue_speed_rolling_m_s, cue_turn_rolling_deg, object_angle_rolling_deg; is "throw" meant to be throw_deg?
cut_deg,nothing↵30,3↵ ¦ shots.csv:1: no column of anything observed; expected at least one of throw_deg, cue_turn_deg, separation_deg, object_speed_m_s, cue_speed_m_s, object_speed_ratio, object_speed_rolling_m_s, cue_speed_rolling_m_s, cue_turn_rolling_deg, object_angle_rolling_deg
cut_deg,throw_deg,cue_turn_deg_sd↵30,3,1↵ ¦ shots.csv:1: column cue_turn_deg_sd: there is no column cue_turn_deg that it belongs to"#;

#[test]
fn tables_of_angles() {
    for [row, expected] in parts(ROWS) {
        let table = format!("shot,cut_deg,speed_m_s,throw_deg,throw_deg_sd\n1,30,2,3,0.1\n{row}\n");
        expect(ANGLES, table, &expected);
    }
    for [table, expected] in parts(TABLES) {
        expect(ANGLES, table, &expected);
    }
}

#[test]
fn not_utf8() {
    let table = b"cut_deg,throw_deg\n30,2\n30,\xe9\n";
    expect(ANGLES, table, "shots.csv:3: is not UTF-8 text; save the file as UTF-8");
    let folder = tempfile::tempdir().unwrap();
    write(folder.path(), &[("dataset.toml", b"name = \"lab\"\ncloth = \"caf\xe9\"\n")]);
    let toml = "dataset.toml:2: is not UTF-8 text; save the file as UTF-8";
    assert_eq!(said(folder.path(), load(folder.path())), toml);
}

#[test]
fn files_that_are_not_there() {
    let folder = tempfile::tempdir().unwrap();
    let said = |path: &str| said(folder.path(), load(&folder.path().join(path)));
    let none = "there is no such file; expected a dataset.toml, or a folder that holds one";
    assert_eq!(said("lab"), format!("lab: {none}"));
    assert_eq!(said(""), format!("dataset.toml: {none}"));
    write(folder.path(), &[("shots.csv", SHOTS.as_bytes())]);
    assert_eq!(
        said("shots.csv"),
        "shots.csv: is a table; expected the dataset.toml that names it under files"
    );
}

/// Which dataset.toml, a table, and what is said of its spins.
const SPINS: &str = r#"
ANGLES ¦ cut_deg,cue_spin,throw_deg↵30,stnu,3↵ ¦ shots.csv:2: column cue_spin: "stnu" is not a spin (did you mean "stun"?); expected stun, natural-roll, measured, unknown
ANGLES ¦ cut_deg,cue_spin,throw_deg↵30,77,3↵ ¦ shots.csv:2: column cue_spin: "77" is not a spin; expected stun, natural-roll, measured, unknown
ANGLES ¦ cut_deg,omega_x,omega_z,throw_deg↵30,1,2,3↵ ¦ shots.csv:1: column omega_y: is missing from the column names; expected all three of omega_x, omega_y, omega_z
ANGLES ¦ cut_deg,omega_x,omega_y,omega_z,throw_deg↵30,1,,2,3↵ ¦ shots.csv:2: column omega_y: is empty; expected all three components of the spin or none
ANGLES ¦ cut_deg,omega_x,omega_y,omega_z,throw_deg↵30,1,x,2,3↵ ¦ shots.csv:2: column omega_y: "x" is not a finite number; expected one such as -1.5 or 2e-3
ANGLES ¦ cut_deg,cue_spin,omega_x,omega_y,omega_z,throw_deg↵30,stun,1,3,2,3↵ ¦ shots.csv:2: column cue_spin: "stun", but omega_x, omega_y, omega_z have values; expected only one
UNSAID ¦ cut_deg,throw_deg↵30,3↵40,3↵ ¦ shots.csv:1: the cue ball's spin is not stated; expected [cue_spin] assume = "stun", "natural-roll" or "unknown" in dataset.toml, a column cue_spin, or columns omega_x, omega_y, omega_z
UNSAID ¦ cut_deg,cue_spin,throw_deg↵30,stun,3↵40,,3↵ ¦ shots.csv:3: column cue_spin: is empty, and dataset.toml has no [cue_spin]; expected a spin
UNSAID ¦ cut_deg,cue_spin,throw_deg↵30,,3↵40,stun,3↵ ¦ shots.csv:2: column cue_spin: is empty, and dataset.toml has no [cue_spin]; expected a spin
MEASURED ¦ cut_deg,throw_deg↵30,3↵40,3↵ ¦ shots.csv:1: [cue_spin] says that the spin is measured; expected columns omega_x, omega_y, omega_z
MEASURED ¦ cut_deg,omega_x,omega_y,omega_z,throw_deg↵30,,,,3↵ ¦ shots.csv:2: column omega_x: the spin is said to be measured; expected values in omega_x, omega_y, omega_z
ANGLES ¦ cut_deg,cue_spin,throw_deg↵30,measured,3↵ ¦ shots.csv:2: column cue_spin: the spin is said to be measured; expected values in omega_x, omega_y, omega_z"#;

#[test]
fn spins() {
    let without = |toml: &str, word: &str| swap(toml, &format!("[cue_spin]\nassume = \"{word}\"\n"), "");
    let unsaid = without(ANGLES, "natural-roll");
    let measured = swap(ANGLES, "natural-roll", "measured");
    for [which, table, expected] in parts(SPINS) {
        let toml = match which.as_str() {
            "UNSAID" => &unsaid,
            "MEASURED" => &measured,
            _ => ANGLES,
        };
        expect(toml, table, &expected);
    }
    let unsaid = without(IMPACTS, "stun");
    let (header, row) = (HITS.lines().next().unwrap(), HITS.lines().nth(1).unwrap());
    let expected = "shots.csv:1: the cue ball's spin is not stated; expected [cue_spin] assume = \"stun\", \"natural-roll\" or \"unknown\" in dataset.toml, a column cue_spin, or columns cue_wx, cue_wy, cue_wz";
    expect(&unsaid, HITS, expected);
    let csv = format!("{header},cue_wx,cue_wy,cue_wz\n{row},1,2,3\n{},,,\n", row.replace("a,", "b,"));
    let expected =
        "shots.csv:3: column cue_wx: is empty, and dataset.toml has no [cue_spin]; expected a spin";
    expect(&unsaid, csv, expected);
}

/// What of [`HITS`] is replaced, by what, and what is said.
const HITS_REPLACED: &str = r#"
a,1,0 ¦ a,1,1 ¦ shots.csv:2: column nx: the line of centres (nx, ny) = (1, 1) has the length 1.4142135623730951; expected a unit vector
a,1,0 ¦ a,1e300,1 ¦ shots.csv:2: column nx: the line of centres (nx, ny) = (1e300, 1) has the length 1e300; expected a unit vector
a,1,0 ¦ a,0,0 ¦ shots.csv:2: column nx: the line of centres (nx, ny) = (0, 0) has the length 0.0; expected a unit vector
a,1,0 ¦ a,-1,0 ¦ shots.csv:2: column cue_vx: the cue ball's velocity (1.7, 1.0) takes it away from the object ball; expected one that approaches along the line of centres (nx, ny) = (-1, 0), which points from cue ball to object ball
1.7,1.0 ¦ 1.7, ¦ shots.csv:2: column cue_vy: is empty; expected a value
,0.1 ¦ , ¦ shots.csv:2: column obj_vy_after: is empty; expected a value
a,1,0 ¦ ,1,0 ¦ shots.csv:2: column shot: is empty; expected a value
cue_vx, ¦ cue_v_x, ¦ shots.csv:1: column cue_v_x: is not a known name, but nearly cue_vx; write cue_vx, or give a label that is called so another name↵shots.csv:1: column cue_vx: is missing from the column names; is "cue_v_x" meant to be it?
obj_vy_after ¦ object_vy_after ¦ shots.csv:1: column obj_vy_after: is missing from the column names; is "object_vy_after" meant to be it?
shot, ¦ name, ¦ shots.csv:1: column shot: is missing from the column names"#;

#[test]
fn tables_of_impacts() {
    for [from, to, expected] in parts(HITS_REPLACED) {
        expect(IMPACTS, swap(HITS, &from, &to), &expected);
    }
}

#[test]
fn everything_wrong_is_said_at_once() {
    let folder = tempfile::tempdir().unwrap();
    let bad = |from: usize| (from..from + 15).map(|i| format!("30,x{i}")).collect::<Vec<_>>().join("\n");
    let toml = swap(ANGLES, "\"shots.csv\"", "\"a.csv\", \"b.csv\"");
    let toml = swap(&toml, "[fit]", "[fit]\nby = \"series\"");
    let (a, b) = (format!("cut_deg,throw_deg\n{}", bad(0)), format!("cut_deg,throw_deg\n{}", bad(15)));
    write(
        folder.path(),
        &[("dataset.toml", toml.as_bytes()), ("a.csv", a.as_bytes()), ("b.csv", b.as_bytes())],
    );
    let error = load(folder.path()).unwrap_err();
    assert_eq!(error.problems().len(), 32);
    let said = said(folder.path(), Err(error));
    let lines: Vec<_> = said.lines().collect();
    assert_eq!(lines.len(), 21);
    assert_eq!(lines[0], "dataset.toml:17: column 6: by is \"series\", but a.csv has no such column");
    let cell = "is not a finite number; expected one such as -1.5 or 2e-3";
    assert_eq!(lines[1], format!("a.csv:2: column throw_deg: \"x0\" {cell}"));
    assert_eq!(lines[16], "dataset.toml:17: column 6: by is \"series\", but b.csv has no such column");
    assert_eq!(lines[19], format!("b.csv:4: column throw_deg: \"x17\" {cell}"));
    assert_eq!(lines[20], "and 12 more");
}

#[test]
fn labels_to_fit_apart() {
    let toml = swap(ANGLES, "[fit]", "[fit]\nby = \"series\"");
    let expected = "shots.csv:3: column series: is empty; expected a label, since [fit] by names this column";
    expect(&toml, "series,cut_deg,throw_deg\na,30,3\n,30,3\n", expected);
}

#[test]
fn names_across_files() {
    let folder = tempfile::tempdir().unwrap();
    let toml = swap(ANGLES, "shots.csv", "?.csv");
    let csv = b"shot,cut_deg,throw_deg\nx,30,3\n";
    write(folder.path(), &[("dataset.toml", toml.as_bytes()), ("a.csv", csv), ("b.csv", csv)]);
    let expected =
        "b.csv:2: column shot: \"x\" also names the shot in line 2 of a.csv; expected a name of its own";
    assert_eq!(said(folder.path(), load(folder.path())), expected);
}

#[test]
fn every_unknown_key_on_a_line_of_its_own_is_named() {
    let toml = swap(&swap(&swap(ANGLES, "cloth =", "clothe ="), "mass_kg", "mass_g"), "source", "sourse");
    let error = load_one(&toml, SHOTS).unwrap_err();
    let mut lines: Vec<_> = error.problems().iter().map(|problem| problem.line).collect();
    lines.sort_unstable();
    assert_eq!(lines, [Some(5), Some(6), Some(10)], "{error}");
    let text = error.to_string();
    assert!(["\"clothe\"", "\"sourse\"", "\"mass_g\""].iter().all(|key| text.contains(key)), "{text}");
}

#[test]
fn what_is_fixed_has_no_prior() {
    let toml =
        swap(ANGLES, "mu_s = { fixed = 0.3 }", "mu_s = { fixed = 0.3, prior_mean = 0.2, prior_sd = 0.1 }");
    let error = load_one(&toml, SHOTS).unwrap_err().to_string();
    assert!(
        error.contains("dataset.toml:18") && error.contains("mu_s is fixed, so that its prior"),
        "{error}"
    );
}

#[test]
fn a_table_of_comments_only_is_said_to_be_one() {
    let error = load_one(ANGLES, SHOTS.replace("\n1,", "\n#1,").replace("\n2,", "\n#2,")).unwrap_err();
    assert!(
        error.to_string().contains("no rows below the column names; expected at least one (lines that begin")
    );
}

#[test]
fn mixed_noise_names_the_lines() {
    let dataset = |csv: &str| {
        let folder = tempfile::tempdir().unwrap();
        write(
            folder.path(),
            &[
                ("dataset.toml", swap(ANGLES, "[\"shots.csv\"]", "[\"a.csv\", \"b.csv\"]").as_bytes()),
                ("a.csv", SHOTS.as_bytes()),
                ("b.csv", csv.as_bytes()),
            ],
        );
        load(folder.path()).unwrap()
    };
    let dataset = dataset("shot,cut_deg,speed_m_s,throw_deg\n# plain\n9,30,2,3.1\n");
    let error = caromfit::fit::fit(&dataset, &crate::options::of_fit()).unwrap_err().to_string();
    assert!(
        error.contains("throw_deg has a standard deviation in") && error.contains("a.csv:2 (shot 1)"),
        "{error}"
    );
    assert!(error.contains("none in") && error.contains("b.csv:3 (shot 9)"), "{error}");
}
