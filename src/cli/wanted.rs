//! Which shots of a data set are wanted: `--shots` and `--skip`.

use crate::measurement::dataset::Dataset;

use super::Failure;

/// The shots that are asked for.
#[derive(clap::Args)]
pub(super) struct Wanted {
    /// Use only these shots: names with commas between, or A..B for all from A to B in the order of the files
    #[arg(long, value_name = "A..B", value_delimiter = ',')]
    shots: Vec<String>,
    /// Leave these shots out: names with commas between, or A..B
    #[arg(long, value_name = "SHOT", value_delimiter = ',')]
    skip: Vec<String>,
}

impl Wanted {
    /// Leaves out shots that are not wanted. Every name must be that of a shot of some data set.
    pub(super) fn of(&self, datasets: &mut [Dataset]) -> Result<(), Failure> {
        for word in self.shots.iter().chain(&self.skip) {
            if !datasets.iter().any(|dataset| named(word, &dataset.names()).is_some()) {
                refuse!("\"{word}\" {}", unknown(word, datasets));
            }
        }
        for dataset in datasets {
            let names: Vec<String> = dataset.names().into_iter().map(str::to_owned).collect();
            let names: Vec<&str> = names.iter().map(String::as_str).collect();
            let is_among = |words: &[String], name: &str| {
                words.iter().filter_map(|word| named(word, &names)).any(|own| own.contains(&name))
            };
            let is_asked_for = |name: &str| self.shots.is_empty() || is_among(&self.shots, name);
            dataset.keep(|name| is_asked_for(name) && !is_among(&self.skip, name));
            if dataset.names().is_empty() && !names.is_empty() {
                refuse!("{}: --shots and --skip leave none of its shots: {}", dataset.name, listed(&names));
            }
        }
        Ok(())
    }
}

/// Returns the ends of a range A..B or A..=B.
fn ends(word: &str) -> Option<[&str; 2]> {
    let (first, last) = word.split_once("..")?;
    Some([first.trim(), last.trim_start_matches('=').trim()])
}

/// Returns the shots that a word names: one, or from one to another in their order.
fn named<'a>(word: &str, names: &'a [&'a str]) -> Option<&'a [&'a str]> {
    let place = |name: &str| names.iter().position(|known| *known == name.trim());
    if let Some(one) = place(word) {
        return names.get(one..=one);
    }
    let [first, last] = ends(word)?;
    names.get(place(first)?..=place(last)?)
}

fn unknown(word: &str, datasets: &[Dataset]) -> String {
    let known: Vec<&str> = datasets.iter().flat_map(|dataset| dataset.names()).collect();
    let missing = ends(word).unwrap_or([word; 2]).into_iter().find(|end| !known.contains(end));
    let why = match missing {
        Some(shot) if shot != word => format!(": there is no shot {shot}"),
        Some(_) => String::new(),
        None => ": it is the wrong way round".to_owned(),
    };
    format!("names no shots{why}; expected one of {}", listed(&known))
}

fn listed(names: &[&str]) -> String {
    const NAMED: usize = 8;
    let more = if names.len() > NAMED { format!(" and {} more", names.len() - NAMED) } else { String::new() };
    names.iter().take(NAMED).copied().collect::<Vec<_>>().join(", ") + &more
}
