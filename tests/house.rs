//! The house of `src/lib.rs`: which module uses which. Arrows lead from a room to those before it in the list, and no file uses
//! another in a circle.

use crate::prelude::*;

/// The rooms in their order; each uses only what stands before it, and itself.
const ROOMS: [&str; 16] = [
    "name",
    "numerics",
    "physics",
    "measurement",
    "words",
    "film",
    "io",
    "problem",
    "fit",
    "compare",
    "simulate",
    "design",
    "studies",
    "report",
    "guide",
    "cli",
];

fn sources(folder: &Path, found: &mut Vec<PathBuf>) {
    let mut entries: Vec<_> = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    entries.sort();
    for path in entries {
        if path.is_dir() {
            sources(&path, found);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            found.push(path);
        }
    }
}

/// The module that a file is, as its path in the crate.
fn module(file: &Path, src: &Path) -> Vec<String> {
    let relative = file.strip_prefix(src).unwrap().with_extension("");
    let mut path: Vec<String> = relative.iter().map(|part| part.to_str().unwrap().to_string()).collect();
    if path.last().is_some_and(|last| last == "mod") {
        path.pop();
    }
    path
}

/// The code of a file without comments and without its tests, which may use everything.
fn code(text: &str) -> String {
    let until = text.find("#[cfg(test)]\nmod tests {").unwrap_or(text.len());
    let lines = text[..until].lines().filter(|line| !line.trim_start().starts_with("//"));
    lines.collect::<Vec<_>>().join("\n")
}

/// A statement in which each list in braces is a list of whole paths.
fn expanded(statement: &str) -> String {
    let mut text = statement.to_owned();
    while let Some(open) = text.rfind('{') {
        let Some(length) = text[open..].find('}') else { break };
        let start = text[..open].rfind([',', '{', ' ', '\n']).map_or(0, |at| at + 1);
        let inner = text[open + 1..open + length].split(',').map(str::trim).filter(|path| !path.is_empty());
        let paths: Vec<String> = inner.map(|path| format!("{}{path}", &text[start..open])).collect();
        text.replace_range(start..=open + length, &paths.join(", "));
    }
    text
}

/// The paths that a file uses, in its `use` lines and within its code, from the root of the crate.
fn uses(text: &str, own: &[String]) -> Vec<Vec<String>> {
    let mut found = Vec::new();
    for statement in code(text).split(';') {
        // the last of what stands between two statements is the import
        let (before, import) = statement.split_at(statement.rfind("use ").unwrap_or(statement.len()));
        let all = format!("{before}\n{}", expanded(import));
        for path in all.split(|c: char| !c.is_alphanumeric() && !"_:".contains(c)) {
            let path: Vec<String> =
                path.split("::").filter(|part| !part.is_empty()).map(str::to_owned).collect();
            let up = path.iter().take_while(|part| *part == "super").count();
            match path.first().map(String::as_str) {
                Some("crate" | "caromfit") => found.push(path[1..].to_vec()),
                Some("self") => found.push([own, &path[1..]].concat()),
                Some("super") if up <= own.len() => {
                    found.push([&own[..own.len() - up], &path[up..]].concat());
                }
                _ => (),
            }
        }
    }
    found
}

/// Each module with the modules that it uses, those inside it and around it left out.
fn arrows() -> BTreeMap<Vec<String>, BTreeSet<Vec<String>>> {
    let src = root().join("src");
    let mut files = Vec::new();
    sources(&src, &mut files);
    let modules: BTreeSet<Vec<String>> = files.iter().map(|file| module(file, &src)).collect();
    let mut arrows = BTreeMap::new();
    for file in &files {
        let own = module(file, &src);
        let text = fs::read_to_string(file).unwrap();
        let mut used = BTreeSet::new();
        for path in uses(&text, &own) {
            // the longest part of the path that is a module
            let known =
                (0..=path.len()).rev().map(|n| path[..n].to_vec()).find(|part| modules.contains(part));
            // a module and those inside it are one place
            let apart = |known: &Vec<String>| !own.starts_with(known) && !known.starts_with(&own);
            used.extend(known.filter(apart));
        }
        arrows.insert(own, used);
    }
    arrows
}

#[test]
fn every_room_uses_only_rooms_before_it() {
    let place = |room: &String| ROOMS.iter().position(|known| known == room);
    let mut wrong = Vec::new();
    for (from, used) in arrows() {
        let Some(own) = from.first().and_then(place) else { continue };
        for to in used.iter().filter(|to| place(&to[0]).is_none_or(|other| other > own)) {
            wrong.push(format!("{} uses {}", from.join("::"), to.join("::")));
        }
    }
    assert!(wrong.is_empty(), "arrows against the order of the house:\n{}", wrong.join("\n"));
}

#[test]
fn no_module_uses_another_in_a_circle() {
    let mut arrows = arrows();
    // what uses none of those left, or is used by none, is in no circle
    let mut before = 0;
    while arrows.len() != before {
        before = arrows.len();
        let left: BTreeSet<_> = arrows.keys().cloned().collect();
        let used: BTreeSet<_> = arrows.values().flatten().cloned().collect();
        arrows.retain(|module, uses| used.contains(module) && uses.iter().any(|other| left.contains(other)));
    }
    let circles: Vec<String> = arrows.keys().map(|module| module.join("::")).collect();
    assert!(circles.is_empty(), "{circles:#?}");
}

#[test]
fn every_message_of_a_file_has_words() {
    let room = root().join("src/io");
    let mut files = Vec::new();
    sources(&room, &mut files);
    let names = |text: &str, before: &str| -> BTreeSet<String> {
        text.split(before).skip(1).map(|rest| rest[..rest.find('"').unwrap()].to_string()).collect()
    };
    let code: String = files.iter().map(|file| fs::read_to_string(file).unwrap()).collect();
    let words = fs::read_to_string(room.join("messages.jinja")).unwrap();
    assert_eq!(names(&code, "message!(\""), names(&words, "message == \""));
}
