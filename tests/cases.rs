//! The program end to end, by cases of `tests/cases`: inputs from reports of users and other tools, the commands that are run on them,
//! and what must hold of their answers. A case is a folder that holds its input and a case.toml, or a file NAME.toml with its input in it.
//!
//! `CAROMFIT_CASE=NAME` runs the cases whose name contains NAME only.

use serde::Deserialize;

use crate::films_as_text::{Content, lacking, write_all};
use crate::prelude::*;

/// A case.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Case {
    /// Who reported it, what the input is, and what the truth is.
    about: String,
    /// Files and folders of the repository that are copied: where to, and where from.
    #[serde(default)]
    copy: BTreeMap<PathBuf, PathBuf>,
    /// Files that are written.
    #[serde(default)]
    files: BTreeMap<String, Content>,
    /// Whether commands that succeed write nothing to standard error, and others nothing to standard output.
    #[serde(default)]
    clean: bool,
    /// The commands, in order.
    run: Vec<Run>,
}

/// One command and what must hold of its answer.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Run {
    /// Arguments of the program, separated by spaces.
    #[serde(default)]
    command: String,
    /// Files that are written before, with their text.
    #[serde(default)]
    write: BTreeMap<String, String>,
    /// File, a text in it and what replaces it everywhere, before.
    #[serde(default)]
    replace: Vec<[String; 3]>,
    /// Exit status.
    #[serde(default)]
    exit: i32,
    /// Texts that standard output or standard error contains.
    #[serde(default)]
    says: Vec<String>,
    /// Those that it contains a number of times.
    #[serde(default)]
    times: BTreeMap<String, usize>,
    /// Texts that neither contains.
    #[serde(default)]
    never: Vec<String>,
    /// Values of the JSON on standard output, or of a file that the command wrote.
    #[serde(default)]
    values: Vec<Expected>,
    /// Files, with texts that they contain.
    #[serde(default)]
    contains: BTreeMap<PathBuf, Vec<String>>,
    /// Folders, with the names of all that they contain.
    #[serde(default)]
    lists: BTreeMap<PathBuf, Vec<String>>,
    /// Paths that are not there afterwards.
    #[serde(default)]
    absent: Vec<PathBuf>,
    /// Files that the command does not change.
    #[serde(default)]
    keeps: Vec<PathBuf>,
}

/// One value of a JSON document.
#[derive(Debug, Deserialize)]
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
    /// Number of elements.
    count: Option<usize>,
}

impl Expected {
    fn fault(&self, folder: &Path, stdout: &str) -> Option<String> {
        let text = match &self.file {
            Some(file) => fs::read_to_string(folder.join(file)).unwrap_or_default(),
            None => stdout.to_owned(),
        };
        let document: Value = serde_json::from_str(&text).unwrap_or_default();
        let Some(value) = document.pointer(&self.at) else {
            return Some(format!("no JSON document has {}", self.at));
        };
        let is = |expected: &Value| value == expected || value.is_null() && expected == "null";
        let is_inside = self
            .between
            .is_none_or(|[low, high]| value.as_f64().is_some_and(|value| (low..=high).contains(&value)));
        let count = value.as_array().map(Vec::len).or(value.as_object().map(serde_json::Map::len));
        let holds = is_inside
            && self.is.as_ref().is_none_or(is)
            && !self.is_not.iter().any(is)
            && (self.count.is_none() || self.count == count);
        (!holds).then(|| format!("{} is {value}; expected {self:?}", self.at))
    }
}

/// Names of the contents of a folder, in order.
fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).into_iter().flatten();
    let mut names: Vec<String> =
        entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

impl Run {
    /// Prepares files as the run says.
    fn prepare(&self, folder: &Path) {
        write_all(folder, self.write.clone());
        for [name, from, to] in &self.replace {
            let text = fs::read_to_string(folder.join(name)).unwrap();
            assert!(text.contains(from.as_str()), "{from:?} is not in {name}");
            fs::write(folder.join(name), text.replace(from.as_str(), to)).unwrap();
        }
    }

    /// What does not hold of the files afterwards.
    fn faults_of_files(&self, folder: &Path) -> Vec<String> {
        let mut faults = Vec::new();
        for (name, parts) in &self.contains {
            let text = fs::read(folder.join(name)).unwrap_or_default();
            let text = String::from_utf8_lossy(&text);
            faults.extend(lacking(&name.to_string_lossy(), &text, parts));
        }
        for (name, expected) in &self.lists {
            let found = names(&folder.join(name));
            if found != *expected {
                faults.push(format!("{} holds {found:?}; expected {expected:?}", name.display()));
            }
        }
        let present = self.absent.iter().filter(|path| folder.join(path).exists());
        faults.extend(present.map(|path| format!("there is {}", path.display())));
        faults
    }

    fn faults(&self, folder: &Path, is_clean: bool) -> Vec<String> {
        self.prepare(folder);
        let kept = || self.keeps.iter().map(|path| fs::read(folder.join(path)).ok()).collect::<Vec<_>>();
        let before = kept();
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
        let other = if self.exit == 0 { &stderr } else { &stdout };
        if is_clean && !other.is_empty() {
            faults.push(format!("the other stream says {other}"));
        }
        faults.extend(lacking("the answer", &answer, &self.says));
        let otherwise =
            self.times.iter().filter(|(text, times)| answer.matches(text.as_str()).count() != **times);
        faults.extend(otherwise.map(|(text, times)| format!("does not say {times} times {text:?}")));
        let forbidden = self.never.iter().filter(|text| answer.contains(text.as_str()));
        faults.extend(forbidden.map(|text| format!("says {text:?}")));
        faults.extend(self.values.iter().filter_map(|value| value.fault(folder, &stdout)));
        faults.extend(self.faults_of_files(folder));
        if before != kept() {
            faults.push(format!("changes one of {:?}", self.keeps));
        }
        if !faults.is_empty() {
            faults.insert(0, format!("caromfit {}: {stderr}", self.command));
        }
        faults
    }
}

/// Copies a file, or the files of a folder and its folders.
fn copy(from: &Path, to: &Path) {
    if from.is_file() {
        fs::create_dir_all(to.parent().unwrap()).unwrap();
        fs::copy(from, to).unwrap();
        return;
    }
    fs::create_dir_all(to).unwrap();
    for entry in fs::read_dir(from).unwrap().map(|entry| entry.unwrap()) {
        copy(&entry.path(), &to.join(entry.file_name()));
    }
}

/// Runs the commands of a case in a folder of its own; returns what does not hold.
fn faults_of(path: &Path) -> Vec<String> {
    let is_folder = path.is_dir();
    let text = if is_folder { fs::read_to_string(path.join("case.toml")) } else { fs::read_to_string(path) };
    let case: Case = match toml::from_str(&text.unwrap()) {
        Ok(case) => case,
        Err(error) => return vec![path.display().to_string(), error.to_string()],
    };
    let folder = tempfile::tempdir().unwrap();
    if is_folder {
        copy(path, folder.path());
    }
    for (to, from) in &case.copy {
        copy(&root().join(from), &folder.path().join(to));
    }
    write_all(folder.path(), case.files.iter().flat_map(|(name, content)| content.files(name)));
    let mut faults: Vec<String> =
        case.run.iter().flat_map(|run| run.faults(folder.path(), case.clean)).collect();
    if !faults.is_empty() {
        faults.insert(0, format!("{}\n{}", path.file_name().unwrap().display(), case.about));
    }
    faults
}

#[test]
fn every_case_is_answered_as_it_says() {
    let chosen = std::env::var("CAROMFIT_CASE").unwrap_or_default();
    let all = fs::read_dir(root().join("tests/cases")).unwrap();
    let mut paths: Vec<PathBuf> = all.map(|path| path.unwrap().path()).collect();
    paths.retain(|path| path.to_string_lossy().contains(&chosen));
    paths.sort();
    let faults: Vec<String> = paths.par_iter().flat_map(|path| faults_of(path)).collect();
    assert!(faults.is_empty(), "{}", faults.join("\n"));
    assert!(!paths.is_empty(), "no case is named {chosen}");
}
