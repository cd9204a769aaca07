//! The first ten minutes: the example, a table without a dataset.toml, chosen shots, help, and what README.md shows.

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use caromfit::design::Expected;
use caromfit::fit::{Depth, Options};
use caromfit::guide::TOPICS;
use caromfit::io;
use caromfit::physics::ball::Ball;
use caromfit::physics::collision::{Fidelity, Model};
use caromfit::simulate;
use serde_json::Value;
use tempfile::TempDir;

use crate::options;

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn read(file: &str) -> String {
    fs::read_to_string(root().join(file)).unwrap()
}

fn run(folder: &Path, args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_caromfit")).args(args).current_dir(folder).output().unwrap()
}

fn done(folder: &Path, args: &[&str]) -> String {
    let output = run(folder, args);
    assert_eq!(output.status.code(), Some(0), "{args:?}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

fn refused(folder: &Path, args: &[&str]) -> String {
    let output = run(folder, args);
    assert_eq!(output.status.code(), Some(2), "{}", String::from_utf8_lossy(&output.stdout));
    String::from_utf8(output.stderr).unwrap()
}

/// The example, copied.
fn example() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    done(folder.path(), &["example", "demo"]);
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
    let balls = done(lab.path(), &["fit", "demo/balls"]);
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
    let compared = done(root(), &cloths);
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

#[test]
fn the_example_is_complete_and_overwrites_nothing() {
    /// Standard errors.
    const FAR: f64 = 4.0;
    let lab = example();
    let said = done(lab.path(), &["fit", "demo/balls", "demo/pucks", "--json"]);
    let fits: Value = serde_json::from_str(&said).unwrap();
    assert_eq!(fits[0]["verdict"]["grade"], "good");
    assert_eq!(fits[1]["verdict"]["grade"], "doubtful");
    for (name, truth) in [("mu", 0.06), ("mu_s", 0.25), ("e", 0.95)] {
        let own = &fits[0]["parameters"][name];
        let [value, error] = ["estimate", "std_error"].map(|key| own[key].as_f64().unwrap());
        assert!((value - truth).abs() < FAR * error, "{name} = {value} ± {error}");
    }
    for folder in ["balls", "pucks"] {
        assert!(done(lab.path(), &["check", &format!("demo/{folder}")]).contains("0 left out"));
    }
    assert!(refused(lab.path(), &["example", "demo"]).contains("is there already"));
}

/// Pixels of a slow camera need no shot in particular: the balls give the unit also where paths bend between frames.
#[test]
fn any_shot_of_the_example_may_be_missing() {
    /// Standard errors.
    const FAR: f64 = 4.0;
    let folder = root().join("src/example/balls");
    for missing in [&["1"][..], &["5"], &["8"], &["10"], &["9", "10"]] {
        let mut dataset = io::load(&folder).unwrap();
        dataset.keep(|name| !missing.contains(&name));
        let options = Options { depth: Depth::Estimates, ..options::of_fit() };
        let fit = caromfit::fit::fit(&dataset, &options).unwrap().remove(0);
        assert_eq!(fit.shots_used, 10 - missing.len(), "{missing:?}: {:?}", fit.shots_rejected);
        assert!(fit.camera.as_ref().unwrap().converged, "{missing:?}");
        let estimates = [(fit.mu(), 0.06), (fit.mu_s(), 0.25), (fit.e(), 0.95)];
        for (estimate, truth) in estimates.map(|(estimate, truth)| (estimate.unwrap(), truth)) {
            let off = (estimate.value - truth).abs();
            assert!(off < FAR * estimate.std_error.unwrap(), "{missing:?}: {estimate:?}");
        }
    }
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
    Expected::read(&root().join("src/cli/design-spec.toml")).unwrap();
}

#[test]
fn a_table_without_a_dataset_toml() {
    let lab = example();
    let table = "demo/balls/shots.csv";
    let missing = refused(lab.path(), &["fit", table]);
    for what in ["--fps", "--spin"] {
        assert!(missing.contains(what), "{missing}");
    }
    let told =
        ["fit", table, "--fps", "240", "--spin", "natural-roll", "--cue", "white", "--object", "yellow"];
    let said = done(lab.path(), &told);
    for assumed in
        ["Lengths are taken as pixels: the balls are the ruler", "taken as pool balls, radius 0.028575 m"]
    {
        assert!(said.contains(assumed), "{said}");
    }
    let fit = |path: &str| {
        let text = fs::read_to_string(lab.path().join("fits").join(path).join("fit.json")).unwrap();
        serde_json::from_str::<Value>(&text).unwrap()["parameters"].clone()
    };
    let from_table = fit("shots");
    done(lab.path(), &["fit", "demo/balls"]);
    // the table says nothing of the masses, which the data set states: less than one standard error (7e-4 of both)
    for parameter in ["mu", "e"] {
        let estimate = |fit: &Value| fit[parameter]["estimate"].as_f64().unwrap();
        let difference = estimate(&from_table) - estimate(&fit("balls"));
        assert!(difference.abs() < 7e-4, "{parameter}: {difference}");
    }
    // what is told of a data set that has a dataset.toml would be ignored
    assert!(refused(lab.path(), &["fit", "demo/balls", "--fps", "240"]).contains("dataset.toml states them"));
}

#[test]
fn chosen_shots_only() {
    let lab = tempfile::tempdir().unwrap();
    let data = root().join("data/synthetic-natural-roll");
    let data = data.to_str().unwrap();
    let json = |args: &[&str]| {
        let said = done(lab.path(), &[&["fit", data, "--json"], args].concat());
        let fits: Value = serde_json::from_str(&said).unwrap();
        let rejected = fits[0]["shots_rejected"].as_array().unwrap();
        let names: Vec<String> =
            rejected.iter().map(|shot| format!("{}: {}", shot["shot"], shot["reason"])).collect();
        (fits[0]["shots_used"].as_u64().unwrap(), names, fits[0]["verdict"]["sentence"].clone())
    };
    let (used, rejected, _) = json(&["--skip", "3,5"]);
    assert_eq!((used, rejected.len()), (28, 2));
    assert_eq!(rejected[0], "\"3\": \"left out on request\"");
    let (used, rejected, sentence) = json(&["--shots", "2..11", "--skip", "4"]);
    assert_eq!((used, rejected.len()), (9, 21));
    // what a user leaves out is no fault of the film
    assert!(!sentence.as_str().unwrap().contains("could be used"), "{sentence}");
    let unknown = refused(lab.path(), &["fit", data, "--skip", "eleven"]);
    assert!(unknown.contains("\"eleven\" names no shot; expected one of 1, 2, 3"), "{unknown}");
    assert!(refused(lab.path(), &["fit", data, "--skip", "1..30"]).contains("leave none of its shots"));
    for (words, expected) in [
        ("1..99", "names no shots: there is no shot 99"),
        ("98..99", "there is neither shot 98 nor shot 99"),
        ("3..1", "is the wrong way round: shot 3 comes after shot 1; expected 1..3"),
    ] {
        let unknown = refused(lab.path(), &["fit", data, "--shots", words]);
        assert!(unknown.contains(expected), "{unknown}");
    }
    // what was asked for is no warning
    let said = done(lab.path(), &["fit", data, "--skip", "3,5", "--verbose"]);
    assert!(said.contains("2 of 30 shots were left out on request."), "{said}");
    assert!(!said.contains("were not used; the first is"), "{said}");
}

/// Options that stand for a dataset.toml are named where they are wrong, and no file that is not there.
#[test]
fn wrong_options_of_a_table_are_named() {
    let lab = tempfile::tempdir().unwrap();
    let table = "shot,frame,ball,x,y\na,0,white,0,0\na,0,red,1,0\na,1,white,0.1,0\na,1,red,1,0\n";
    fs::write(lab.path().join("shot.csv"), table).unwrap();
    let with = |cue: &str, object: &str| {
        let told = ["--fps", "240", "--spin", "stun", "--cue", cue, "--object", object];
        refused(lab.path(), &[&["fit", "shot.csv"][..], &told].concat())
    };
    assert!(
        with("white", "white")
            .contains("--cue and --object are both \"white\"; expected two different tracks")
    );
    assert!(
        with("white", "blue")
            .contains("--object is \"blue\", which is no track of the table; expected one of")
    );
    for error in [with("white", "white"), with("blue", "red")] {
        assert!(!error.contains("assumed dataset.toml"), "{error}");
    }
}

/// A radius that the contact shows is suggested; pixels are told to need no ruler.
#[test]
fn a_draft_suggests_what_the_film_shows() {
    let lab = example();
    let draft = done(lab.path(), &["init", "--stdout", "demo/balls/shots.csv"]);
    assert!(draft.contains("px (the balls are then the ruler"), "{draft}");
    for (factor, radius) in
        [(1.0, "0.028575"), (0.030_75 / 0.028_575, "0.03075"), (0.026_25 / 0.028_575, "0.02625")]
    {
        let table = read("data/synthetic-natural-roll/tracks.csv");
        let scaled = table.lines().map(|line| match line.split(',').collect::<Vec<_>>()[..] {
            [shot, frame, ball, x, y] if shot != "shot" && !x.is_empty() => {
                let [x, y] = [x, y].map(|cell| factor * cell.parse::<f64>().unwrap());
                format!("{shot},{frame},{ball},{x:.6},{y:.6}\n")
            }
            _ => format!("{line}\n"),
        });
        let path = lab.path().join("film.csv");
        fs::write(&path, scaled.collect::<String>()).unwrap();
        let draft = done(lab.path(), &["init", "--stdout", path.to_str().unwrap()]);
        let line = draft.lines().find(|line| line.starts_with("radius_m")).unwrap();
        assert!(
            line.starts_with(&format!("radius_m = {radius} ")) && line.contains("come as near as"),
            "{line}"
        );
    }
    // and that is what a fit of the table uses, and says: here snooker balls
    let told = ["fit", "film.csv", "--fps", "1000", "--spin", "natural-roll", "--shots", "1..4"];
    let said = done(lab.path(), &told);
    assert!(said.contains("taken as balls of radius 0.02625 m (else: --radius)"), "{said}");
}

#[test]
fn check_and_extract_speak_json() {
    let lab = example();
    let json = |args: &[&str]| serde_json::from_str::<Value>(&done(lab.path(), args)).unwrap();
    let checked = json(&["check", "--json", "demo/balls", "demo/pucks"]);
    assert_eq!((&checked[0]["dataset"], &checked[0]["shots"]), (&Value::from("balls"), &Value::from(10)));
    let few = checked[1]["findings"].as_array().unwrap();
    assert!(few.iter().any(|found| found["sentence"].as_str().unwrap().contains("too few")), "{few:?}");
    let extracted = json(&["extract", "--json", "--no-pictures", "demo/pucks"]);
    assert_eq!(extracted[0]["shots"], 1);
    assert!(lab.path().join(extracted[0]["folder"].as_str().unwrap()).join("discs.csv").is_file());
}

#[test]
fn help_has_every_command_and_every_topic() {
    let lab = tempfile::tempdir().unwrap();
    let all = done(lab.path(), &["help"]);
    for topic in TOPICS {
        assert!(all.contains(topic.about), "{all}");
        assert_eq!(done(lab.path(), &["help", topic.name]), topic.text);
        assert!(topic.text.starts_with("# "));
    }
    assert!(done(lab.path(), &["help", "fit"]).contains("--bootstrap"));
    assert!(refused(lab.path(), &["help", "fims"]).contains("a similar value exists: 'films'"));
    // what a page names exists
    let pages: String = TOPICS.iter().map(|topic| topic.text).collect::<String>() + &read("README.md");
    for named in pages.split("caromfit help ").skip(1) {
        let name: String = named.chars().take_while(char::is_ascii_lowercase).collect();
        assert!(name.is_empty() || TOPICS.iter().any(|topic| topic.name == name), "help {name}");
    }
}
