//! A [`Design`] → tables, design.csv, design.json and pictures.

use super::content::{self, Block, Section, Table};
use super::csv::Table as Csv;
use super::{ReportError, document, plot};
use crate::design::information::std_errors;
use crate::design::{Cell, Design, Mixture, OfKind, PlayedKind, SpinFrom};
use crate::measurement::number::plain;
use crate::measurement::parameter::Parameter;

/// Returns the files of a design: name and content.
pub fn files(design: &Design) -> Result<Vec<(String, Vec<u8>)>, ReportError> {
    let texts = [("design.csv", csv(design)), ("design.json", document::text(design)?)];
    let texts = texts.map(|(name, text)| (name.to_owned(), text.into_bytes()));
    Ok(plot::design(design).files("design")?.into_iter().chain(texts).collect())
}

/// Returns a standard error, or – for what is not determined.
fn error(value: Option<f64>) -> String {
    value.map_or("–".to_owned(), |value| plain(value, 2))
}

/// `μ ± 0.001, e ± 0.001`
fn wishes(wanted: &[Option<f64>; 3]) -> String {
    let each = Parameter::COEFFICIENTS.into_iter().zip(wanted);
    let each = each.filter_map(|(p, wanted)| Some(format!("{} ± {}", p.symbol(), plain((*wanted)?, 3))));
    each.collect::<Vec<_>>().join(", ")
}

/// `20 to 50`, `30`
fn range([from, to]: [f64; 2]) -> String {
    if from == to { plain(from, 3) } else { format!("{} to {}", plain(from, 3), plain(to, 3)) }
}

/// Returns the text that `caromfit design` prints.
#[must_use]
pub fn text(design: &Design) -> String {
    let expected = &design.expected;
    let [mu, mu_s, e] = [expected.coefficients.mu, expected.coefficients.mu_s, expected.coefficients.e];
    let camera = &expected.camera;
    let balls = match &expected.object {
        Some(_) => format!("; {}", super::two_balls(&expected.ball, expected.object.as_ref())),
        None => String::new(),
    };
    let mut text = format!(
        "Expected μ = {mu}, μ_s = {mu_s}, e = {e}{balls}; filmed at {} fps, positions ± {} mm, {} ms before and {} ms after the \
         impact.\nWanted: {} (standard errors; none of the three has a unit).\n",
        plain(camera.fps, 4),
        plain(1e3 * camera.position_sd_m, 3),
        plain(camera.before_ms, 3),
        plain(camera.after_ms, 3),
        wishes(&expected.wanted)
    );
    let mut sections = vec![kinds(design), needed(design)];
    sections.extend(Parameter::COEFFICIENTS.map(|parameter| cells(design, parameter)));
    sections.push(mixtures(design, false, "Fewest shots, of kinds spread over their speeds and cut angles"));
    sections.push(mixtures(design, true, "Fewest shots, of the best cut angles and speeds alone"));
    sections.push(Section::of_lines("In words", "", design.words.clone()));
    text += &content::sections(&sections);
    text.extend(design.notes.iter().map(|note| format!("\nNote: {note}\n")));
    text + "\nNote: these are errors of chance. A scale, a radius, a frame rate or a spin that is wrong adds its own, however many \
            the shots.\n"
}

/// Returns what the planned shots of each kind determine, and all of them together.
fn kinds(design: &Design) -> Section {
    let row = |(kind, found): (&PlayedKind, &OfKind)| {
        let spin = match kind.from {
            SpinFrom::Known => "known".to_owned(),
            SpinFrom::Motion => "from the paths".to_owned(),
            SpinFrom::Markers { sd: None } => "markers".to_owned(),
            SpinFrom::Markers { sd: Some([cue, object]) } => {
                format!("markers, ± {} and {} rad/s", plain(cue, 2), plain(object, 2))
            }
        };
        let mut row = vec![kind.name.clone(), range(kind.topspin), plain(kind.side, 3), spin];
        row.extend([range(kind.speed_m_s), range(kind.cut_deg), kind.shots.to_string()]);
        row.extend(found.std_errors.map(error));
        row
    };
    let planned = &design.planned;
    let mut together = vec![String::new(); 7];
    (together[0], together[6]) = ("together".to_owned(), planned.shots.to_string());
    together.extend(planned.std_errors.map(error));
    let rows = design.expected.kinds.iter().zip(&design.kinds).map(row).chain([together]);
    let head = ["kind", "topspin", "side", "spin", "m/s", "cut, °", "shots"].map(str::to_owned);
    let head = head.into_iter().chain(Parameter::COEFFICIENTS.map(|p| format!("± {}", p.symbol())));
    let mut lines = vec![
        "topspin, side: in parts of the natural roll's; spin: how it is known; ±: standard error; –: not determined"
            .to_owned(),
    ];
    let seen = Parameter::COEFFICIENTS.into_iter().zip(document::detectable(design));
    let seen = seen.filter_map(|(p, d)| Some(format!("{} {}", p.symbol(), plain(d?, 2))));
    let seen = seen.collect::<Vec<_>>().join(", ");
    if !seen.is_empty() {
        lines.push(format!(
            "Between two such data sets (all shots together) a difference is found in 80 % of cases, at 5 %, from: {seen}"
        ));
    }
    let title = "What so many shots of a kind tell, spread evenly over its speeds and cut angles";
    Section::new(title, "", [Table::new(head, rows).into(), Block::Lines(lines)])
}

/// Returns how many shots of each kind alone are needed.
fn needed(design: &Design) -> Section {
    let symbols = Parameter::COEFFICIENTS.map(Parameter::symbol);
    let wanted: Vec<usize> = (0..3).filter(|i| design.expected.wanted[*i].is_some()).collect();
    let mut head = vec!["kind".to_owned()];
    head.extend(wanted.iter().map(|i| format!("for {}", symbols[*i])));
    head.push("for all".to_owned());
    head.extend(symbols.map(|symbol| format!("one more: {symbol}")));
    let row = |(kind, found): (&PlayedKind, &OfKind)| {
        let counts = wanted.iter().map(|i| found.needed[*i]).chain([found.needed_all]);
        let counts = counts.map(|count| count.map_or("–".to_owned(), |count| count.to_string()));
        let gains =
            found.gain.map(|gain| gain.map_or("–".to_owned(), |gain| format!("{:.2} %", 100.0 * gain)));
        [kind.name.clone()].into_iter().chain(counts).chain(gains).collect()
    };
    let rows = design.expected.kinds.iter().zip(&design.kinds).map(row);
    let line = "one more: by how much one more such shot narrows the standard error of all together";
    let blocks = [Table::new(head, rows).into(), Block::Lines(vec![line.to_owned()])];
    Section::new("Shots of one kind alone that reach what is wanted", "", blocks)
}

/// Returns the standard errors of a parameter: rows are kinds and speeds, columns cut angles.
fn cells(design: &Design, parameter: Parameter) -> Section {
    let near = |a: f64, b: f64| (a - b).abs() < 0.05;
    let own = |cell: &Cell| cell.std_errors[parameter as usize];
    let mut cuts: Vec<f64> = design.cells.iter().map(|cell| cell.cut_deg).collect();
    cuts.sort_by(f64::total_cmp);
    cuts.dedup_by(|a, b| near(*a, *b));
    let mut rows = Vec::new();
    for (index, kind) in design.expected.kinds.iter().enumerate() {
        let cells: Vec<&Cell> = design.cells.iter().filter(|cell| cell.kind == index).collect();
        let speeds =
            if cells.iter().any(|cell| own(cell).is_some()) { design.speeds(index) } else { Vec::new() };
        for speed in speeds {
            let at = |cut: &f64| {
                let cell = cells.iter().find(|cell| cell.speed_m_s == speed && near(cell.cut_deg, *cut));
                cell.map_or(String::new(), |cell| error(own(cell)))
            };
            let row = [kind.name.clone(), plain(speed, 3), kind.shots.to_string()];
            rows.push(row.into_iter().chain(cuts.iter().map(at)).collect());
        }
    }
    let head = ["kind", "m/s", "shots"].map(str::to_owned).into_iter();
    let head = head.chain(cuts.iter().map(|cut| format!("{}°", plain(*cut, 3))));
    let title = format!(
        "Standard error of {} ({}) by cut angle, from so many shots of one cut and speed alone",
        parameter.symbol(),
        parameter.meaning()
    );
    Section::new(title, "", [Table::new(head, rows).into()])
}

/// Returns the mixtures of kinds, or of cells, that need the fewest shots.
fn mixtures(design: &Design, of_cells: bool, title: &str) -> Section {
    let name = |kind: usize| design.expected.kinds[kind].name.as_str();
    let row = |mixture: &Mixture| {
        let mut wanted = design.expected.wanted;
        for (i, wanted) in wanted.iter_mut().enumerate() {
            let is_meant = mixture.parameter.is_none_or(|p| p as usize == i);
            *wanted = wanted.filter(|_| is_meant && mixture.std_errors[i].is_some());
        }
        let each = mixture.shots.iter().map(|(index, shots)| {
            if !of_cells {
                return format!("{shots} {}", name(*index));
            }
            let Cell { kind, speed_m_s, cut_deg, .. } = design.cells[*index];
            format!("{shots} {} at {}° and {} m/s", name(kind), plain(cut_deg, 3), plain(speed_m_s, 3))
        });
        vec![wishes(&wanted), mixture.total().to_string(), each.collect::<Vec<_>>().join(", ")]
    };
    let rows = design.mixtures.iter().filter(|mixture| mixture.of_cells == of_cells).map(row);
    Section::new(title, "", [Table::new(["for", "shots", "of which"], rows).into()])
}

/// Returns design.csv: a row per kind (without a cut angle and speed of its own) and per cell.
#[must_use]
pub fn csv(design: &Design) -> String {
    let mut table = Csv::default();
    let kinds = design.kinds.iter().enumerate().map(|(kind, found)| (kind, None, &found.information));
    let cells = design.cells.iter().map(|cell| (cell.kind, Some(cell), &cell.information));
    for (kind, cell, information) in kinds.chain(cells) {
        let PlayedKind { name, topspin, side, shots, .. } = &design.expected.kinds[kind];
        table.begin();
        table.add("kind", name);
        table.add("topspin", (0.5 * (topspin[0] + topspin[1])).to_string());
        table.add("side", side.to_string());
        table.add("speed_m_s", cell.map_or(String::new(), |cell| plain(cell.speed_m_s, 6)));
        table.add("cut_deg", cell.map_or(String::new(), |cell| plain(cell.cut_deg, 6)));
        table.add("shots", shots.to_string());
        for (of, shots) in [("sd", *shots as f64), ("sd_of_one", 1.0)] {
            let errors = std_errors(&(information * shots));
            for (parameter, error) in Parameter::COEFFICIENTS.into_iter().zip(errors) {
                table.add_number(&format!("{}_{of}", parameter.name()), error.unwrap_or(f64::NAN));
            }
        }
    }
    table.text()
}
