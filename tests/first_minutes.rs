//! The first ten minutes: the example, help, and what README.md and the guide show.

use caromfit::guide::TOPICS;
use tempfile::TempDir;

use crate::cli::{done_in, refused_in};
use crate::prelude::*;

fn read(file: &str) -> String {
    fs::read_to_string(root().join(file)).unwrap()
}

/// The example, copied.
fn example() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    done_in(folder.path(), &["example", "demo"]);
    folder
}

/// The fenced blocks of a language.
fn blocks(text: &str, language: &str) -> Vec<String> {
    let fence = format!("```{language}\n");
    text.split(fence.as_str()).skip(1).map(|rest| rest.split("```").next().unwrap().to_owned()).collect()
}

/// README.md is short, and what it prints is what its commands print.
#[test]
fn the_readme_shows_what_its_commands_print() {
    /// Bytes.
    const SHORT: usize = 9_000;
    let readme = read("README.md");
    assert!(readme.len() < SHORT, "{} bytes", readme.len());
    let shown = blocks(&readme, "text");
    let lab = example();
    let [balls, _] = done_in(lab.path(), &["fit", "demo/balls"]);
    // the picture is that of the report: as many points and lines; a pixel may differ between processors
    let report = fs::read_to_string(lab.path().join("fits/balls/report.html")).unwrap();
    let figure = report.split("<figure").nth(1).unwrap();
    let picture = &figure[figure.find("<svg").unwrap()..=figure.find("</svg>").unwrap()];
    let elements = |svg: &str| ["<circle", "<polyline", "<text"].map(|tag| svg.matches(tag).count());
    assert_eq!(elements(picture), elements(&read("src/example/balls.svg")));
    assert!(elements(picture).iter().all(|count| *count > 10));
    let out = lab.path().join("compare");
    let out = out.to_str().unwrap();
    let cloths = ["compare", "data/synthetic-cloth-a", "data/synthetic-cloth-b", "--out", out];
    let [compared, _] = done_in(root(), &cloths);
    assert_eq!(shown.len(), 2);
    for (shown, printed) in shown.iter().zip([balls, compared]) {
        let printed: Vec<&str> = printed.lines().map(str::trim_end).collect();
        let missing: Vec<&str> = shown.lines().filter(|line| !printed.contains(line)).collect();
        assert!(missing.is_empty(), "{missing:#?} are not among\n{}", printed.join("\n"));
    }
}

/// The numbers that README.md states of the example are those it was simulated with, and the example is what its SPEC makes.
#[test]
fn the_example_is_what_its_spec_makes() {
    let spec = root().join("src/example/balls-spec.toml");
    let files =
        simulate::generate_with(&simulate::read(&spec).unwrap(), &Model::new(Fidelity::Full, Ball::POOL))
            .unwrap();
    let (_, tracks) = files.iter().find(|(name, _)| *name == "tracks.csv").unwrap();
    let lines = tracks.lines().skip(1).map(|line| {
        let cells: Vec<&str> = line.split(',').collect();
        let [shot, frame, ball, x, y] = cells[..] else { panic!("{line}") };
        let [x, y] = [x, y].map(|metres| metres.parse::<f64>().unwrap());
        // 900 pixels to the metre, y downwards
        let ball = if ball == "cue" { "white" } else { "yellow" };
        format!("{shot},{frame},{ball},{:.1},{:.1}\n", 200.0 + 900.0 * x, 1000.0 - 900.0 * y)
    });
    let table = format!("shot,frame,ball,x,y\n{}", lines.collect::<String>());
    assert_eq!(table, read("src/example/balls/shots.csv"));
    let truth: toml::Table = read("src/example/balls-spec.toml").parse().unwrap();
    let of = |name: &str| truth["truth"][name].as_float().unwrap();
    let stated = format!("μ = {}, μ_s = {} and e = {}.", of("mu"), of("mu_s"), of("e"));
    assert!(read("README.md").contains(&stated), "{stated}");
}

/// Each complete dataset.toml of README.md and of the guide loads with files of the kind that it names, and so do the
/// specifications that the help shows.
#[test]
fn every_dataset_toml_that_is_shown_loads() {
    let pages = TOPICS.iter().map(|topic| topic.text.to_owned()).chain([read("README.md")]);
    let complete = |block: &String| block.starts_with("name = ");
    let shown: Vec<String> = pages.flat_map(|page| blocks(&page, "toml")).filter(complete).collect();
    assert!(shown.len() >= 3, "{}", shown.len());
    for manifest in shown {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        fs::create_dir(at("shots")).unwrap();
        if manifest.contains("shape = \"disc\"") {
            let table = read("data/pucks-qualisys/two-pucks.tsv");
            let names = ["New 0001", "New 0003", "New 0004", "New 0000", "New 0002", "New 0005"];
            let named = names.iter().enumerate();
            let table = named.fold(table, |table, (i, old)| table.replace(old, &format!("m{}", i + 1)));
            fs::write(at("kick.tsv"), &table).unwrap();
            fs::write(at("kick.csv"), &table).unwrap();
        } else {
            fs::copy(root().join("src/example/balls/shots.csv"), at("shots/monday.csv")).unwrap();
            fs::write(at("throw.csv"), "cut_deg,throw_deg,speed_m_s\n30,3.1,1.5\n45,3.9,1.5\n").unwrap();
        }
        fs::write(at("dataset.toml"), &manifest).unwrap();
        if let Err(error) = io::load(folder.path()) {
            panic!("{error}\n{manifest}");
        }
    }
    simulate::read(&root().join("src/cli/synth-spec.toml")).unwrap();
    caromfit::design::Expected::read(&root().join("src/cli/design-spec.toml")).unwrap();
}

#[test]
fn help_has_every_command_and_every_topic() {
    let lab = tempfile::tempdir().unwrap();
    let [all, _] = done_in(lab.path(), &["help"]);
    for topic in TOPICS {
        assert!(all.contains(topic.about), "{all}");
        assert_eq!(done_in(lab.path(), &["help", topic.name])[0], topic.text);
        assert!(topic.text.starts_with("# "));
    }
    assert!(done_in(lab.path(), &["help", "fit"])[0].contains("--bootstrap"));
    assert!(refused_in(lab.path(), 2, &["help", "fims"]).contains("a similar value exists: 'films'"));
    // what a page names exists
    let pages: String = TOPICS.iter().map(|topic| topic.text).collect::<String>() + &read("README.md");
    for named in pages.split("caromfit help ").skip(1) {
        let name: String = named.chars().take_while(char::is_ascii_lowercase).collect();
        assert!(name.is_empty() || TOPICS.iter().any(|topic| topic.name == name), "help {name}");
    }
}
