//! Small inputs from reports of users and other tools: every folder of `tests/cases` holds the input, and a `case.toml` with the
//! commands that are run in a copy of the folder and what must hold of their answers.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use rayon::prelude::*;
use serde::Deserialize;
use serde_json::Value;

/// A `case.toml`.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Case {
    /// Who reported it, what the input is, and what the truth is.
    about: String,
    /// The commands, in order.
    run: Vec<Run>,
}

/// One command and what must hold of its answer.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Run {
    /// Arguments of the program, separated by spaces.
    command: String,
    /// Exit status.
    #[serde(default)]
    exit: i32,
    /// Texts that standard output or standard error contains.
    #[serde(default)]
    says: Vec<String>,
    /// Texts that neither contains.
    #[serde(default)]
    never: Vec<String>,
    /// Values of the JSON on standard output, or of a file that the command wrote.
    #[serde(default)]
    values: Vec<Expected>,
}

/// One value of a JSON document.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Expected {
    /// The file that holds the document, relative to the folder; standard output if left out.
    file: Option<PathBuf>,
    /// JSON pointer of the value.
    at: String,
    /// Lowest and highest number.
    between: Option<[f64; 2]>,
    /// The value, of any type; `"null"` for null.
    is: Option<Value>,
    /// Values that it must not have.
    #[serde(default)]
    is_not: Vec<Value>,
}

impl Expected {
    fn fault(&self, folder: &Path, stdout: &str) -> Option<String> {
        let text = match &self.file {
            Some(file) => fs::read_to_string(folder.join(file)).unwrap_or_default(),
            None => stdout.to_owned(),
        };
        let Ok(document) = serde_json::from_str::<Value>(&text) else {
            return Some(format!("no JSON document holds {}", self.at));
        };
        let Some(value) = document.pointer(&self.at) else {
            return Some(format!("the document has no {}", self.at));
        };
        let is_null = |expected: &Value| value.is_null() && expected == "null";
        let is_inside = self
            .between
            .is_none_or(|[low, high]| value.as_f64().is_some_and(|value| (low..=high).contains(&value)));
        let is_equal = self.is.as_ref().is_none_or(|expected| expected == value || is_null(expected));
        let is_other = !self.is_not.iter().any(|other| other == value || is_null(other));
        let holds = is_inside && is_equal && is_other;
        let expected = || format!("between {:?}, is {:?}, is not {:?}", self.between, self.is, self.is_not);
        (!holds).then(|| format!("{} is {value}; expected {}", self.at, expected()))
    }
}

impl Run {
    fn faults(&self, folder: &Path) -> Vec<String> {
        let output = Command::new(env!("CARGO_BIN_EXE_caromfit"))
            .args(self.command.split_whitespace())
            .current_dir(folder)
            .output()
            .unwrap();
        let stdout = String::from_utf8_lossy(&output.stdout);
        let stderr = String::from_utf8_lossy(&output.stderr);
        let answer = format!("{stdout}{stderr}");
        let mut faults = Vec::new();
        if output.status.code() != Some(self.exit) {
            faults.push(format!("exit status {:?}; expected {}", output.status.code(), self.exit));
        }
        let missing = self.says.iter().filter(|text| !answer.contains(text.as_str()));
        faults.extend(missing.map(|text| format!("does not say {text:?}")));
        let forbidden = self.never.iter().filter(|text| answer.contains(text.as_str()));
        faults.extend(forbidden.map(|text| format!("says {text:?}")));
        faults.extend(self.values.iter().filter_map(|value| value.fault(folder, &stdout)));
        if !faults.is_empty() {
            const SHOWN: usize = 3000;
            let shown: String = answer.chars().take(SHOWN).collect();
            faults.insert(0, format!("caromfit {}", self.command));
            faults.push(format!("It answered:\n{shown}"));
        }
        faults
    }
}

/// Copies the files of a folder, and its folders.
fn copy_folder(from: &Path, to: &Path) {
    fs::create_dir_all(to).unwrap();
    for entry in fs::read_dir(from).unwrap().map(|entry| entry.unwrap()) {
        let there = to.join(entry.file_name());
        if entry.path().is_dir() {
            copy_folder(&entry.path(), &there);
        } else {
            fs::copy(entry.path(), there).unwrap();
        }
    }
}

/// Runs the commands of a case in a copy of its folder; returns what does not hold.
fn faults_of(folder: &Path) -> Vec<String> {
    let text = fs::read_to_string(folder.join("case.toml")).unwrap();
    let case: Case = match toml::from_str(&text) {
        Ok(case) => case,
        Err(error) => return vec![error.to_string()],
    };
    let copy = tempfile::tempdir().unwrap();
    copy_folder(folder, copy.path());
    let mut faults: Vec<String> = case.run.iter().flat_map(|run| run.faults(copy.path())).collect();
    if !faults.is_empty() {
        faults.insert(0, format!("{}\n{}", folder.file_name().unwrap().display(), case.about));
    }
    faults
}

/// `CAROMFIT_CASE=NAME` runs the cases whose name contains NAME only.
#[test]
fn every_reported_case_is_answered_right() {
    let chosen = std::env::var("CAROMFIT_CASE").unwrap_or_default();
    let folders = fs::read_dir(Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/cases")).unwrap();
    let mut folders: Vec<PathBuf> = folders.map(|folder| folder.unwrap().path()).collect();
    folders.retain(|folder| folder.to_string_lossy().contains(&chosen));
    folders.sort();
    let faults: Vec<String> = folders.par_iter().flat_map(|folder| faults_of(folder)).collect();
    assert!(faults.is_empty(), "{}", faults.join("\n"));
    assert!(!folders.is_empty(), "no case is named {chosen}");
}
