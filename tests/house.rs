//! The house of `src/lib.rs`: which module uses which. Arrows lead from a room to those before it in the list, and no file uses
//! another in a circle.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// The rooms in their order; each uses only what stands before it, and itself.
const ROOMS: [&str; 15] = [
    "numerics",
    "physics",
    "measurement",
    "film",
    "io",
    "extraction",
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
    let mut entries: Vec<_> = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
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

/// Splits the list inside braces at its own commas.
fn branches(list: &str) -> Vec<&str> {
    let (mut depth, mut start, mut found) = (0, 0, Vec::new());
    for (i, c) in list.char_indices() {
        match c {
            '{' => depth += 1,
            '}' => depth -= 1,
            ',' if depth == 0 => {
                found.push(list[start..i].trim());
                start = i + 1;
            }
            _ => {}
        }
    }
    found.push(list[start..].trim());
    found.into_iter().filter(|branch| !branch.is_empty()).collect()
}

/// Every path of a tree of imports.
fn leaves(tree: &str, prefix: &[String], found: &mut Vec<Vec<String>>) {
    let (path, list) = match tree.split_once('{') {
        Some((path, list)) => (path, Some(list.rsplit_once('}').map_or(list, |(list, _)| list))),
        None => (tree, None),
    };
    let path = path.split(" as ").next().unwrap_or(path);
    let mut full = prefix.to_vec();
    full.extend(path.split("::").map(str::trim).filter(|part| !part.is_empty()).map(str::to_string));
    match list {
        Some(list) => branches(list).into_iter().for_each(|branch| leaves(branch, &full, found)),
        None => found.push(full),
    }
}

/// The paths that a file uses, in its `use` lines and within its code, from the root of the crate.
fn uses(text: &str, own: &[String]) -> Vec<Vec<String>> {
    let code = code(text);
    let mut found = Vec::new();
    for statement in code.split(';') {
        let Some(at) = statement.rfind("use ") else { continue };
        if statement[..at].chars().last().is_none_or(|before| before == '\n' || before == ' ') {
            leaves(&statement[at + 4..], &[], &mut found);
        }
    }
    for start in ["crate::", "caromfit::", "super::"] {
        for (at, _) in code.match_indices(start) {
            let path: String =
                code[at..].chars().take_while(|c| c.is_alphanumeric() || "_:".contains(*c)).collect();
            found.push(path.split("::").filter(|part| !part.is_empty()).map(str::to_string).collect());
        }
    }
    let absolute = |path: Vec<String>| match path.first().map(String::as_str) {
        Some("crate" | "caromfit") => Some(path[1..].to_vec()),
        Some("self") => Some(own.iter().cloned().chain(path[1..].iter().cloned()).collect()),
        Some("super") => {
            let up = path.iter().take_while(|part| *part == "super").count();
            let kept = own.len().checked_sub(up)?;
            Some(own[..kept].iter().cloned().chain(path[up..].iter().cloned()).collect())
        }
        _ => None,
    };
    found.into_iter().filter_map(absolute).collect()
}

/// Each module with the modules that it uses, those inside it and around it left out.
fn arrows() -> BTreeMap<Vec<String>, BTreeSet<Vec<String>>> {
    let src = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut files = Vec::new();
    sources(&src, &mut files);
    let modules: BTreeSet<Vec<String>> = files.iter().map(|file| module(file, &src)).collect();
    let mut arrows = BTreeMap::new();
    for file in &files {
        let own = module(file, &src);
        let text = std::fs::read_to_string(file).unwrap();
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

/// Every module that can be reached from one along the arrows.
fn reached(from: &[String], arrows: &BTreeMap<Vec<String>, BTreeSet<Vec<String>>>) -> BTreeSet<Vec<String>> {
    let (mut found, mut open) = (BTreeSet::new(), vec![from.to_vec()]);
    while let Some(module) = open.pop() {
        for next in arrows.get(&module).into_iter().flatten() {
            if found.insert(next.clone()) {
                open.push(next.clone());
            }
        }
    }
    found
}

#[test]
fn no_module_uses_another_in_a_circle() {
    let arrows = arrows();
    let all: BTreeMap<_, _> = arrows.keys().map(|module| (module, reached(module, &arrows))).collect();
    let mut circles: BTreeSet<String> = BTreeSet::new();
    for (module, reached) in &all {
        if reached.contains(*module) {
            let same =
                reached.iter().filter(|other| all.get(other).is_some_and(|back| back.contains(*module)));
            circles.insert(same.map(|module| module.join("::")).collect::<Vec<_>>().join(", "));
        }
    }
    let circles: Vec<String> = circles.into_iter().collect();
    assert!(circles.is_empty(), "{circles:#?}");
}
