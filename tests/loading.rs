//! What is read of data sets, and what is said of those that cannot be read. Each file of `tests/loading` keeps one promise by cases:
//! an input, and what must hold of what is read of it.
//!
//! `CAROMFIT_CASE=TEXT` runs the cases only whose name or `about` contains TEXT.

mod described;

use serde::Deserialize;
use toml::Table;

use crate::films_as_text::{Content, lacking, write_all};
use crate::prelude::*;
use described::{described, differences};

/// A file of cases.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Book {
    /// The promise.
    about: String,
    /// dataset.toml of tracks without name, kind and files, for the cases without their own.
    #[serde(default)]
    settings: String,
    /// Files by name, to which a case adds; a dataset.toml among them replaces `settings`.
    #[serde(default)]
    files: BTreeMap<String, Content>,
    /// Blanks in drafts of `init` by a name: the text of the blank and what is filled in.
    #[serde(default)]
    blanks: BTreeMap<String, [String; 2]>,
    /// What every case has that does not state it otherwise.
    #[serde(default)]
    each: Table,
    /// Cases; one with `but` stands for several, each with what the case and its entry of `but` state.
    case: Vec<Table>,
}

/// A table with the entries of another, which replace its own.
fn merged(base: &Table, own: &Table) -> Table {
    let mut all = base.clone();
    for (key, value) in own {
        match (all.get_mut(key), value) {
            (Some(toml::Value::Table(inner)), toml::Value::Table(own)) => *inner = merged(inner, own),
            _ => _ = all.insert(key.clone(), value.clone()),
        }
    }
    all
}

impl Book {
    fn cases(&self) -> Vec<Case> {
        let of_entry = |entry: &Table| {
            let mut case = merged(&self.each, entry);
            let Some(but) = case.remove("but") else { return vec![case] };
            let variants = but.as_array().unwrap().iter();
            variants.map(|variant| merged(&case, variant.as_table().unwrap())).collect()
        };
        let parsed = |case: Table| case.clone().try_into().unwrap_or_else(|error| panic!("{error}\n{case}"));
        self.case.iter().flat_map(of_entry).map(parsed).collect()
    }
}

/// An input and what must hold of it.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Case {
    #[serde(default)]
    about: String,
    settings: Option<String>,
    /// Lines below the settings.
    #[serde(default)]
    more: String,
    #[serde(default)]
    files: BTreeMap<String, Content>,
    /// File, text in it and what replaces it everywhere.
    #[serde(default)]
    replace: Vec<[String; 3]>,
    /// Encoding of a file: utf-16, utf-16 without mark, latin-1, cr or crlf.
    #[serde(default)]
    encoding: BTreeMap<String, String>,
    /// The dataset.toml is drafted by `caromfit init`.
    init: Option<Init>,
    /// All problems, exactly, a line each.
    problems: Option<String>,
    /// Texts in the error.
    #[serde(default)]
    refused: Vec<String>,
    /// Texts each in some note on the tracks.
    #[serde(default)]
    notes: Vec<String>,
    /// Texts in no note.
    #[serde(default)]
    no_note: Vec<String>,
    /// Values of what is read; of numbers up to `tolerance`, relatively where above 1.
    is: Option<toml::Value>,
    #[serde(default = "rounding")]
    tolerance: f64,
    /// The tracks are those of [`crate::films_as_text`].
    #[serde(default)]
    film: bool,
}

/// What is said by `init`, and what of its draft is filled in.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Init {
    #[serde(default)]
    exit: i32,
    #[serde(default)]
    says: Vec<String>,
    #[serde(default)]
    draft: Vec<String>,
    #[serde(default)]
    fill: Vec<Blank>,
    /// The filled draft is not loaded.
    #[serde(default)]
    only: bool,
}

/// A blank in a draft: one of the book by its name, or a text and what replaces it.
#[derive(Deserialize)]
#[serde(untagged)]
enum Blank {
    Named(String),
    Texts([String; 2]),
}

/// Two roundings.
fn rounding() -> f64 {
    2.0 * f64::EPSILON
}

impl Init {
    /// Runs `init` and fills its draft; returns what does not hold.
    fn faults(&self, book: &Book, folder: &Path) -> Vec<String> {
        let output = Command::new(env!("CARGO_BIN_EXE_caromfit")).arg("init").arg(folder).output().unwrap();
        let said = String::from_utf8_lossy(&[output.stdout, output.stderr].concat()).into_owned();
        let mut faults = lacking("init", &said, &self.says);
        if output.status.code() != Some(self.exit) {
            faults.push(format!("init ends with {:?}: {said}", output.status.code()));
        }
        let path = folder.join("dataset.toml");
        let mut draft = fs::read_to_string(&path).unwrap_or_default();
        faults.extend(lacking("the draft", &draft, &self.draft));
        for blank in &self.fill {
            let [from, to] = match blank {
                Blank::Named(name) => &book.blanks[name],
                Blank::Texts(texts) => texts,
            };
            if !draft.contains(from.as_str()) {
                faults.push(format!("{from:?} is not in the draft: {draft}"));
            }
            draft = draft.replacen(from.as_str(), to, 1);
        }
        fs::write(&path, draft).unwrap();
        faults
    }
}

impl Case {
    /// The files of the case, dataset.toml among them unless it is drafted.
    fn texts(&self, book: &Book) -> BTreeMap<String, String> {
        let contents = book.files.iter().chain(&self.files);
        let mut texts: BTreeMap<String, String> =
            contents.flat_map(|(name, content)| content.files(name)).collect();
        if self.init.is_none() && !texts.contains_key("dataset.toml") {
            let settings = format!("{}\n{}", self.settings.as_ref().unwrap_or(&book.settings), self.more);
            let names: Vec<&String> = texts.keys().filter(|name| *name != "shots.csv").collect();
            let spin = "[cue_spin]\nassume = \"natural-roll\"\n";
            let spin = if settings.contains("cue_spin") { "" } else { spin };
            let text = format!("name = \"t\"\nkind = \"tracks\"\nfiles = {names:?}\n{spin}{settings}\n");
            texts.insert("dataset.toml".to_owned(), text);
        }
        for [file, from, to] in &self.replace {
            let text = texts.get_mut(file).unwrap_or_else(|| panic!("there is no {file}"));
            assert!(text.contains(from.as_str()), "{from:?} is not in {file}");
            *text = text.replace(from.as_str(), to);
        }
        texts
    }

    fn write(&self, book: &Book, folder: &Path) {
        for (name, text) in self.texts(book) {
            let bytes = match self.encoding.get(&name).map(String::as_str) {
                None => text.into_bytes(),
                Some("utf-16") => {
                    format!("\u{feff}{text}").encode_utf16().flat_map(u16::to_le_bytes).collect()
                }
                Some("utf-16 without mark") => text.encode_utf16().flat_map(u16::to_le_bytes).collect(),
                Some("latin-1") => text.chars().map(|c| c as u8).collect(),
                Some("cr") => text.replace('\n', "\r").into_bytes(),
                Some("crlf") => text.replace('\n', "\r\n").into_bytes(),
                Some(other) => panic!("{other} is not an encoding"),
            };
            write_all(folder, [(name, bytes)]);
        }
    }

    /// What does not hold of what is read.
    fn faults_of_data(&self, dataset: &Dataset, folder: &str) -> Vec<String> {
        let mut faults = Vec::new();
        if self.problems.is_some() || !self.refused.is_empty() {
            faults.push("is read, and should be refused".to_owned());
        }
        let notes = dataset.tracks.as_ref().map_or(&[][..], |tracks| &tracks.notes).join("\n");
        let notes = notes.replace(folder, "");
        faults.extend(lacking("the notes", &notes, &self.notes));
        let present = self.no_note.iter().filter(|part| notes.contains(part.as_str()));
        faults.extend(present.map(|part| format!("{part:?} is in the notes: {notes}")));
        if let Some(expected) = &self.is {
            let expected = serde_json::to_value(expected).unwrap();
            faults.extend(differences(&expected, &described(dataset, folder), self.tolerance));
        }
        if self.film {
            faults.extend(crate::films_as_text::faults(dataset.tracks.as_ref().unwrap()));
        }
        faults
    }

    fn faults(&self, book: &Book) -> Vec<String> {
        let folder = tempfile::tempdir().unwrap();
        self.write(book, folder.path());
        let mut faults = Vec::new();
        if let Some(init) = &self.init {
            faults = init.faults(book, folder.path());
            if init.only || !faults.is_empty() {
                return faults;
            }
        }
        let prefix = format!("{}/", folder.path().display());
        match io::load(folder.path()) {
            Ok(dataset) => faults.extend(self.faults_of_data(&dataset, &prefix)),
            Err(error) => {
                let text = error.to_string().replace(&prefix, "");
                let text = text.replace(folder.path().to_str().unwrap(), "FOLDER");
                faults.extend(lacking("the error", &text, &self.refused));
                let (what, problems) = text.split_once("\n  ").unwrap_or((&text, ""));
                let problems = problems.replace("\n  ", "\n");
                let is_said = self.problems.as_ref().is_some_and(|expected| expected.trim_end() == problems);
                let is_framed = what.starts_with("the data set ") && what.ends_with(" cannot be used:");
                if !is_framed || !(is_said || self.problems.is_none() && !self.refused.is_empty()) {
                    faults.push(format!("is refused: {text}"));
                }
            }
        }
        faults
    }
}

/// The cases of a file of `tests/loading`.
fn book(name: &str) -> Book {
    let path = root().join("tests/loading").join(name);
    toml::from_str(&fs::read_to_string(&path).unwrap()).unwrap_or_else(|error| panic!("{name}: {error}"))
}

/// The files of every case of a book that is read.
pub fn accepted(name: &str) -> Vec<BTreeMap<String, String>> {
    let book = book(name);
    let is_read = |case: &Case| case.problems.is_none() && case.refused.is_empty() && case.init.is_none();
    book.cases().into_iter().filter(is_read).map(|case| case.texts(&book)).collect()
}

/// The promise of each file of cases is kept.
#[test]
fn every_case_is_read_as_it_says() {
    let chosen = std::env::var("CAROMFIT_CASE").unwrap_or_default();
    let folder = fs::read_dir(root().join("tests/loading")).unwrap();
    let names = folder.map(|entry| entry.unwrap().file_name().into_string().unwrap());
    let names: Vec<String> = names.filter(|name| name.strip_suffix(".toml").is_some()).collect();
    assert!(names.len() > 10, "{names:?}");
    let of_file = |name: &String| -> Vec<String> {
        let book = book(name);
        let is_chosen = |case: &Case| name.contains(&chosen) || case.about.contains(&chosen);
        let numbered: Vec<(usize, Case)> =
            (1..).zip(book.cases()).filter(|(_, case)| is_chosen(case)).collect();
        let of_case = |(number, case): &(usize, Case)| {
            let faults = case.faults(&book);
            let place = format!("{name}, case {number}: {} {:?}", case.about, case.replace);
            (!faults.is_empty()).then(|| format!("{}\n{place}\n{}", book.about, faults.join("\n")))
        };
        numbered.par_iter().filter_map(of_case).collect()
    };
    let faults: Vec<String> = names.par_iter().flat_map(of_file).collect();
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}
