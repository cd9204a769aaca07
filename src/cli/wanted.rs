//! Which shots of a data set are wanted: `--shots` and `--skip`.

use caromfit::measurement::dataset::Dataset;

use super::Failure;

/// What a user says of the shots.
#[derive(clap::Args)]
pub struct Wanted {
    /// Use only these shots: names with commas between, or A..B for all from A to B in the order of the files
    #[arg(long, value_name = "A..B", value_delimiter = ',')]
    shots: Vec<String>,
    /// Leave these shots out: names with commas between, or A..B
    #[arg(long, value_name = "SHOT", value_delimiter = ',')]
    skip: Vec<String>,
}

impl Wanted {
    /// Leaves out what is not wanted. Every name must be that of a shot of some data set.
    pub fn of(&self, datasets: &mut [Dataset]) -> Result<(), Failure> {
        for word in self.shots.iter().chain(&self.skip) {
            if !datasets.iter().any(|dataset| named(word, &dataset.names()).is_some()) {
                return Err(Failure::input(format!("\"{word}\" {}", unknown(word, datasets))));
            }
        }
        for dataset in datasets {
            let names: Vec<String> = dataset.names().into_iter().map(str::to_owned).collect();
            let names: Vec<&str> = names.iter().map(String::as_str).collect();
            let among = |words: &[String], name: &str| {
                words.iter().filter_map(|word| named(word, &names)).any(|own| own.contains(&name))
            };
            dataset
                .keep(|name| (self.shots.is_empty() || among(&self.shots, name)) && !among(&self.skip, name));
            if dataset.names().is_empty() && !names.is_empty() {
                return Err(Failure::input(format!(
                    "{}: --shots and --skip leave none of its shots: {}",
                    dataset.name,
                    listed(&names)
                )));
            }
        }
        Ok(())
    }
}

/// The shots that a word names: one, or from one to another in their order.
fn named<'a>(word: &str, names: &'a [&'a str]) -> Option<&'a [&'a str]> {
    let place = |name: &str| names.iter().position(|known| *known == name.trim());
    if let Some(one) = place(word) {
        return names.get(one..=one);
    }
    let (first, last) = word.split_once("..")?;
    names.get(place(first)?..=place(last.trim_start_matches('='))?)
}

/// Why a word names no shots: the end of a range that is none, ends the wrong way round, or no name.
fn unknown(word: &str, datasets: &[Dataset]) -> String {
    let known: Vec<&str> = datasets.iter().flat_map(|dataset| dataset.names()).collect();
    let expected = format!("expected one of {}", listed(&known));
    let Some((first, last)) = word.split_once("..") else { return format!("names no shot; {expected}") };
    let ends = [first.trim(), last.trim_start_matches('=').trim()];
    match ends.map(|end| known.contains(&end)) {
        [true, true]
            if datasets.iter().any(|dataset| ends.iter().all(|end| dataset.names().contains(end))) =>
        {
            format!(
                "is the wrong way round: shot {} comes after shot {}; expected {}..{}",
                ends[0], ends[1], ends[1], ends[0]
            )
        }
        [true, true] => format!("begins and ends in different data sets; {expected}"),
        [false, false] => {
            format!("names no shots: there is neither shot {} nor shot {}; {expected}", ends[0], ends[1])
        }
        [has_first, _] => {
            let missing = if has_first { ends[1] } else { ends[0] };
            format!("names no shots: there is no shot {missing}; {expected}")
        }
    }
}

/// The first names.
fn listed(names: &[&str]) -> String {
    const NAMED: usize = 8;
    let more = if names.len() > NAMED { format!(" and {} more", names.len() - NAMED) } else { String::new() };
    names.iter().take(NAMED).copied().collect::<Vec<_>>().join(", ") + &more
}
