//! Reads the .dat files.
use std::path::Path;

/// One certified problem.
pub struct Problem {
    pub name: &'static str,
    pub starts: [Vec<f64>; 2],
    pub parameters: Vec<f64>,
    pub standard_deviations: Vec<f64>,
    pub residual_sum: f64,
    pub y: Vec<f64>,
    /// One row of predictors per observation.
    pub x: Vec<Vec<f64>>,
}

/// Where the files are.
pub fn directory() -> &'static Path {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/reference/nist"))
}

/// Reads `name`.dat. Panics on a file that is not as NIST wrote it.
pub fn read(name: &'static str) -> Problem {
    let text = std::fs::read_to_string(directory().join(format!("{name}.dat"))).unwrap();
    let numbers =
        |line: &str| -> Vec<f64> { line.split_whitespace().filter_map(|word| word.parse().ok()).collect() };
    let header = text.lines().take(60);
    // "  b1 =   500         250           2.3894212918E+02  2.7070075241E+00"
    let table: Vec<Vec<f64>> = header
        .clone()
        .filter(|line| line.trim_start().starts_with('b'))
        .filter_map(|line| line.split_once(" = ").map(|(_, rest)| numbers(rest)))
        .filter(|row| row.len() == 4)
        .collect();
    let column = |k: usize| table.iter().map(|row| row[k]).collect::<Vec<f64>>();
    let residual_sum = header
        .clone()
        .find_map(|line| line.strip_prefix("Residual Sum of Squares:"))
        .map(|rest| rest.trim().parse().unwrap())
        .unwrap();
    let observations: usize = header
        .clone()
        .find_map(|line| line.strip_prefix("Number of Observations:"))
        .map(|rest| rest.trim().parse().unwrap())
        .unwrap();
    let data: Vec<Vec<f64>> = text.lines().skip(60).map(numbers).filter(|row| !row.is_empty()).collect();
    assert_eq!(data.len(), observations, "{name}");
    Problem {
        name,
        starts: [column(0), column(1)],
        parameters: column(2),
        standard_deviations: column(3),
        residual_sum,
        y: data.iter().map(|row| row[0]).collect(),
        x: data.iter().map(|row| row[1..].to_vec()).collect(),
    }
}
