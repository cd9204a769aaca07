//! `caromfit schema` against what is really written, and the page that reads it with pandas.

use crate::cli::done_in;
use crate::prelude::*;

fn schema(of: &str) -> Value {
    let [said, err] = done_in(root(), &["schema", of]);
    assert_eq!(err, "");
    serde_json::from_str(&said).unwrap()
}

fn type_of(value: &Value) -> &'static str {
    match value {
        Value::Null => "null",
        Value::Bool(_) => "boolean",
        Value::Number(_) => "number",
        Value::String(_) => "string",
        Value::Array(_) => "array",
        Value::Object(_) => "object",
    }
}

/// What a schema refers to, beside what it says itself.
fn resolved<'a>(root: &'a Value, schema: &'a Value) -> &'a Value {
    match schema.get("$ref").and_then(Value::as_str) {
        Some(place) => root.pointer(place.trim_start_matches('#')).expect("a definition"),
        None => schema,
    }
}

/// Whether a value has a type; null is none of an object's.
fn has_type(word: &Value, value: &Value) -> bool {
    word == type_of(value) || word == "integer" && (value.is_u64() || value.is_i64())
}

/// The keywords that the schemas use. A key that a schema does not describe is wrong here, though it allows it.
fn check(root: &Value, schema: &Value, value: &Value, at: &str, wrong: &mut Vec<String>) {
    let schema = resolved(root, schema);
    if let Some(any) = schema.get("anyOf").and_then(Value::as_array) {
        let faults = any.iter().map(|one| {
            let mut faults = Vec::new();
            check(root, one, value, at, &mut faults);
            faults
        });
        // of several that do not fit, that which is nearest
        return wrong.extend(faults.min_by_key(Vec::len).unwrap_or_default());
    }
    let has = |words: &Value| match words {
        Value::Array(words) => words.iter().any(|word| has_type(word, value)),
        word => has_type(word, value),
    };
    if !schema.get("type").is_none_or(has) {
        wrong.push(format!("{at}: {} is not {}", type_of(value), schema["type"]));
    }
    if let Some(known) = schema.get("enum").and_then(Value::as_array)
        && !known.contains(value)
    {
        wrong.push(format!("{at}: {value} is not of {known:?}"));
    }
    for key in schema.get("required").and_then(Value::as_array).into_iter().flatten() {
        if value.as_object().is_some_and(|object| !object.contains_key(key.as_str().unwrap())) {
            wrong.push(format!("{at}: {key} is missing"));
        }
    }
    for (key, inner) in value.as_object().into_iter().flatten() {
        let at = format!("{at}.{key}");
        let described = schema.get("properties").and_then(|own| own.get(key));
        match described.or(schema.get("additionalProperties").filter(|more| **more != false)) {
            Some(schema) => check(root, schema, inner, &at, wrong),
            None => wrong.push(format!("{at}: is not described")),
        }
    }
    for (i, inner) in value.as_array().into_iter().flatten().enumerate() {
        if let Some(items) = schema.get("items") {
            check(root, items, inner, &format!("{at}[{i}]"), wrong);
        }
    }
}

/// What is wrong with a document of a command.
fn faults(of: &str, value: &Value) -> Vec<String> {
    let (schema, mut wrong) = (schema(of), Vec::new());
    check(&schema, &schema, value, "", &mut wrong);
    wrong
}

fn stored(folder: &Path, name: &str, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            stored(&path, name, found);
        } else if path.file_name().is_some_and(|own| own == name) {
            found.push(path);
        }
    }
}

/// All stored results, of every kind of data.
#[test]
fn stored_results_are_as_the_schema_describes_them() {
    let root = root().join("fits");
    for (of, least) in [("fit", 20), ("compare", 2)] {
        let mut found = Vec::new();
        stored(&root, &format!("{of}.json"), &mut found);
        assert!(found.len() >= least, "{} of {of}", found.len());
        for path in found {
            let value: Value = serde_json::from_str(&fs::read_to_string(&path).unwrap()).unwrap();
            assert_eq!(faults(of, &value), [""; 0], "{}", path.display());
        }
    }
}

/// Every shipped dataset.toml, and one that states all that may be unknown with an error.
#[test]
fn data_sets_are_as_the_schema_describes_them() {
    let root = root().join("data");
    let mut found = Vec::new();
    stored(&root, "dataset.toml", &mut found);
    let mut texts: Vec<String> = found.iter().map(|path| fs::read_to_string(path).unwrap()).collect();
    assert!(texts.len() > 10);
    let priors = "name = \"a\"\nkind = \"tracks\"\nfiles = [\"a.csv\"]\n[video]\ncapture_fps = 240\ncapture_fps_sd = 1\n\
                  [table]\ntilt_sd = 0.001\n[cue_spin]\ntopspin_sd = 0.02\n[camera]\nlens = { mean = 0.0, sd = 0.01 }\n\
                  perspective = [0.1, 0.0]\nscale = \"none\"\nlabel = \"phone\"\n";
    texts.push(priors.to_owned());
    for text in texts {
        let value: toml::Table = text.parse().unwrap();
        assert_eq!(faults("dataset", &serde_json::to_value(value).unwrap()), [""; 0], "{text}");
    }
    let unknown = serde_json::json!({ "name": "a", "kind": "tracks", "files": [], "clothe": "b" });
    assert_eq!(faults("dataset", &unknown), [".clothe: is not described"]);
}

/// What `--json` of every other command prints, and nothing else on standard output.
#[test]
fn printed_documents_are_as_the_schema_describes_them() {
    let folder = tempfile::tempdir().unwrap();
    let root = root();
    let at = |path: &str| root.join(path).display().to_string();
    let (spec, film, pucks) =
        (at("src/example/balls-spec.toml"), at("data/domenech-2023"), at("data/pucks-opencv"));
    fs::write(
        folder.path().join("cases.csv"),
        "name,speed_m_s,cut_deg,omega_x,omega_y,omega_z,mu,mu_s,e,radius_m\none,2,30,0,70,0,0.05,0.3,0.94,0.028575\n\
         two,1,10,0,0,0,0.05,0.3,0.94,0.028575\n",
    )
    .unwrap();
    let one = "collide --speed 2 --cut 30 --mu 0.05 --mu-s 0.3 --e 0.94 --explain --json";
    let mut found = Vec::new();
    for (of, args) in [
        ("accuracy", "accuracy --shots 80 --seed 3 --out a --json".to_owned()),
        ("synth", format!("synth {spec} --out s --json")),
        ("check", format!("check {film} {pucks} --json")),
        ("extract", format!("extract {pucks} --out x --no-pictures --json")),
        ("collide", one.to_owned()),
        ("collide", "collide --cases cases.csv --json".to_owned()),
        ("design", "design --out d --json".to_owned()),
        // a combination of parameters that is determined though none of them is: an object, of which the stored results have none
        ("fit", format!("fit {} --fidelity linear --json", at("tests/cases/angles-only-a-product"))),
    ] {
        let args: Vec<&str> = args.split(' ').collect();
        let [said, _] = done_in(folder.path(), &args);
        let value: Value = serde_json::from_str(&said).unwrap_or_else(|_| panic!("{args:?}: {said}"));
        let each = value.as_array().cloned().unwrap_or_else(|| vec![value.clone()]);
        assert!(!each.is_empty());
        for value in &each {
            assert_eq!(faults(of, value), [""; 0], "{of}");
            assert_eq!(value["format_version"], 1);
        }
        found.push(value);
    }
    let [accuracy, synth, .., fits] = &found[..] else { panic!("{found:?}") };
    assert!(fits[0]["identifiability"]["worst"]["determined"].is_object());
    let full = accuracy["ways"].as_array().unwrap().iter().find(|way| way["fidelity"] == "full").unwrap();
    assert!(full["numerical_error"]["throw_deg"]["worst"].as_f64().unwrap() < 1e-9);
    let [inelastic, _, full, _, _, contact, _] = accuracy["biases"].as_array().unwrap().as_slice() else {
        panic!("{accuracy}")
    };
    let bias = |of: &Value, parameter: &str| {
        let found = &of["parameters"][parameter];
        Some(found["bias"].as_f64()?.abs() / found["std_error"].as_f64()?)
    };
    // contact finds its own truth: the Jacobian is one of differences, which the end of the fit shows
    assert!(["mu", "mu_s", "e"].iter().all(|own| bias(contact, own).unwrap() < 1e-2), "{contact}");
    // a rigid contact takes the throw of a compliant one for more friction
    assert!(bias(full, "mu").unwrap() > 1.0, "{full}");
    // and a fidelity without friction does not estimate it
    assert_eq!(bias(inelastic, "mu"), None);
    assert!(synth["parameters"]["mu"] == serde_json::json!({"truth": 0.06, "unit": "1"}));
    for file in synth["files"].as_array().unwrap() {
        assert!(folder.path().join("s").join(file.as_str().unwrap()).is_file(), "{file}");
    }
}

/// Who reads a key of a document finds what it means, in which unit.
#[test]
fn every_key_is_described() {
    fn bare(schema: &Value, at: &str, found: &mut Vec<String>) {
        for (key, inner) in schema.get("properties").and_then(Value::as_object).into_iter().flatten() {
            let at = format!("{at}.{key}");
            if inner["description"].as_str().is_none_or(|words| words.trim().is_empty()) {
                found.push(at.clone());
            }
            bare(inner, &at, found);
        }
        for word in ["items", "additionalProperties"] {
            if let Some(inner) = schema.get(word) {
                bare(inner, &format!("{at}[]"), found);
            }
        }
        for (name, inner) in schema.get("$defs").and_then(Value::as_object).into_iter().flatten() {
            bare(inner, name, found);
        }
    }
    for of in ["fit", "compare", "accuracy", "check", "collide", "design", "extract", "synth"] {
        let (schema, mut found) = (schema(of), Vec::new());
        assert!(schema["description"].is_string() && schema["title"].is_string(), "{of}");
        bare(&schema, "", &mut found);
        assert!(found.is_empty(), "{of}: {found:#?}");
    }
    assert!(schema("fit")["description"].as_str().unwrap().contains("each element of the array"));
}

/// The Python of the guide names columns that the tables have, and runs where there is pandas.
#[test]
fn the_guide_s_python_reads_the_tables() {
    let folder = tempfile::tempdir().unwrap();
    done_in(folder.path(), &["example", "demo"]);
    done_in(folder.path(), &["fit", "demo/balls"]);
    let page = caromfit::guide::TOPICS.iter().find(|topic| topic.name == "results").unwrap().text;
    let python = page.split("```python\n").nth(1).unwrap().split("```").next().unwrap();

    for table in ["residuals", "shots"] {
        let file = format!("fits/balls/{table}.csv");
        let (_, after) = python.split_once(&file).unwrap_or_else(|| panic!("{file} is not read"));
        let text = fs::read_to_string(folder.path().join(&file)).unwrap();
        let header: Vec<&str> = text.lines().next().unwrap().split(',').collect();
        // what stands in quotation marks until the next table is read, but for how it is read
        let own = after.split("read_csv").next().unwrap().split_once(')').unwrap().1;
        let unknown: Vec<&str> =
            own.split('"').skip(1).step_by(2).filter(|name| !header.contains(name)).collect();
        assert!(unknown.is_empty(), "{table}.csv has no {unknown:?}: {header:?}");
    }
    let has_pandas = Command::new("python3").args(["-c", "import pandas"]).output();
    if !has_pandas.is_ok_and(|output| output.status.success()) {
        return;
    }
    let output = Command::new("python3").args(["-c", python]).current_dir(&folder).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let said = String::from_utf8(output.stdout).unwrap();
    assert!(said.starts_with("good 0.0") && said.contains("speed_m_s") && said.contains("object"), "{said}");
}
