//! The first rows of an unknown table, and tests of the numbers in its columns.

use std::collections::{HashMap, HashSet};

use super::heading::Heading;
use super::raw::sorted;
use super::words::{self, Boxed, Rest};
use crate::io::number::value;
use crate::io::text::{lines, trimmed};

/// Maximum number of rows examined.
const MAX_ROWS: usize = 20_000;
/// Maximum number of tracks of balls in a file.
const MAX_TRACKS: usize = 20;
/// Largest ratio of roughness at which a path is smoother than another one.
const MAX_ROUGHNESS_RATIO: f64 = 0.85;
/// Largest ratio of the change of a height to that of a coordinate along the table.
const MAX_HEIGHT_RATIO: f64 = 0.1;

/// Returns the 5th and the 95th percentile of numbers.
fn ends(numbers: impl Iterator<Item = f64>) -> Option<[f64; 2]> {
    let all = sorted(numbers);
    let few = all.len() / 20;
    Some([*all.get(few)?, *all.get(all.len().checked_sub(few + 1)?)?])
}

pub(super) struct Rows(Vec<Vec<String>>);

impl Rows {
    pub(super) fn of(text: &str, heading: &Heading) -> Self {
        let rows = lines(text).skip(heading.above).filter(|(_, line)| !line.trim().is_empty());
        let cells = rows.filter_map(|(_, line)| trimmed(line, heading.separator));
        Self(cells.filter(|cells| cells.len() >= heading.names.len()).take(MAX_ROWS).collect())
    }

    fn column(&self, column: usize) -> impl Iterator<Item = &str> {
        self.0.iter().map(move |row| row[column].as_str())
    }

    /// Returns the numbers in a column; `None` if a cell is not a number.
    pub(super) fn numbers(&self, column: usize) -> Option<Vec<f64>> {
        let numbers: Vec<f64> = self.column(column).map(value).collect::<Option<_>>()?;
        (numbers.len() > 2).then_some(numbers)
    }

    /// Returns the largest magnitude of the numbers in a column.
    pub(super) fn largest(&self, column: usize) -> f64 {
        self.column(column).filter_map(value).map(f64::abs).fold(0.0, f64::max)
    }

    /// Returns the least step of a column that grows within each group of equal other columns.
    pub(super) fn least_step(&self, column: usize, groups: &[usize]) -> Option<f64> {
        let mut last: HashMap<Vec<&str>, f64> = HashMap::new();
        let mut least = f64::INFINITY;
        for (row, number) in self.0.iter().zip(self.numbers(column)?) {
            let group = groups.iter().map(|i| row[*i].as_str()).collect();
            if let Some(before) = last.insert(group, number) {
                least = least.min(number - before);
            }
        }
        (least > 0.0 && least.is_finite()).then_some(least)
    }

    /// Returns the boxes with corners in these pairs of columns: two boxes from four pairs in a
    /// row, or one from any two pairs.
    pub(super) fn boxes(&self, pairs: &[[usize; 2]]) -> Vec<Boxed> {
        let boxed = |corner: [usize; 2], other: [usize; 2]| {
            let rest = Rest { columns: other, is_size: false };
            self.is_box(corner, other).then_some(Boxed { corner, rest })
        };
        if let [a, b, c, d] = *pairs
            && let (Some(one), Some(other)) = (boxed(a, b), boxed(c, d))
        {
            return vec![one, other];
        }
        let later = |i: usize| pairs[i + 1..].iter().map(move |other| (i, *other));
        let mut all = (0..pairs.len()).flat_map(later);
        all.find_map(|(i, other)| boxed(pairs[i], other)).into_iter().collect()
    }

    /// Returns whether columns are corners of boxes of nearly constant width and height.
    fn is_box(&self, corner: [usize; 2], other: [usize; 2]) -> bool {
        (0..2).all(|axis| self.is_size(|row| Some(value(&row[other[axis]])? - value(&row[corner[axis]])?)))
    }

    /// Returns whether a length is that of a side of such boxes.
    pub(super) fn is_size(&self, length: impl Fn(&[String]) -> Option<f64>) -> bool {
        let ends = ends(self.0.iter().filter_map(|row| length(row)));
        ends.is_some_and(|[least, most]| least > 0.0 && most < 2.0 * least)
    }

    /// Returns whether x and y are the corner of boxes of this size instead of the middle, which
    /// moves more smoothly since each side errs independently. `None` if the paths do not decide.
    pub(super) fn is_corner(&self, xy: [usize; 2], size: [usize; 2], ball: Option<usize>) -> Option<bool> {
        let mut balls: HashMap<&str, Vec<&[String]>> = HashMap::new();
        for row in &self.0 {
            balls.entry(ball.map_or("", |ball| row[ball].as_str())).or_default().push(row);
        }
        let [as_middle, as_corner] = [0.0, 0.5].map(|part: f64| -> f64 {
            let coordinate =
                |row: &[String], axis: usize| Some(value(&row[xy[axis]])? + part * value(&row[size[axis]])?);
            let bends = balls.values().flat_map(|rows| rows.windows(3)).flat_map(|three| {
                [0, 1].map(|axis| {
                    let [a, b, c] = [0, 1, 2].map(|i| coordinate(three[i], axis));
                    Some((a? - 2.0 * b? + c?).abs())
                })
            });
            // without the impacts and jumps of the tracker
            let bends = sorted(bends.flatten());
            bends[..bends.len() * 9 / 10].iter().sum()
        });
        let [less, more] = [as_corner.min(as_middle), as_corner.max(as_middle)];
        (more > 0.0 && less < MAX_ROUGHNESS_RATIO * more).then_some(as_corner < as_middle)
    }

    /// Replaces x and y of balls by z and x if y is the height (OptiTrack), which hardly changes.
    pub(super) fn lay_flat(&self, names: &[String], positions: &mut [[usize; 2]]) {
        let extent = |column: usize| {
            let ends = ends(self.column(column).filter_map(value));
            ends.map_or(0.0, |[low, high]| high - low)
        };
        let z: Option<Vec<usize>> = positions.iter().map(|[x, _]| words::beside(names, *x, "z")).collect();
        let Some(z) = z else { return };
        let high: f64 = positions.iter().map(|[_, y]| extent(*y)).sum();
        let wide: f64 = z.iter().map(|z| extent(*z)).sum();
        if high < MAX_HEIGHT_RATIO * wide {
            // seen from above, z, x and the height are right-handed as x, y and z are
            positions.iter_mut().zip(z).for_each(|(position, z)| *position = [z, position[0]]);
        }
    }

    /// Returns whether most values of a column stand in two rows of their group.
    pub(super) fn are_pairs(&self, column: usize, shot: Option<usize>) -> bool {
        let mut counts: HashMap<(&str, &str), usize> = HashMap::new();
        for row in &self.0 {
            let group = (shot.map_or("", |shot| row[shot].as_str()), row[column].as_str());
            *counts.entry(group).or_default() += 1;
        }
        counts.len() > 2 && 3 * counts.values().filter(|count| **count == 2).count() > 2 * counts.len()
    }

    pub(super) fn is_empty(&self, column: usize) -> bool {
        self.column(column).all(str::is_empty)
    }

    pub(super) fn is_whole(&self, column: usize) -> bool {
        self.numbers(column).is_some_and(|numbers| numbers.iter().all(|number| number.fract() == 0.0))
    }

    /// Returns whether a column has few values, and rows differ only with it.
    pub(super) fn distinguishes_rows(&self, column: usize, others: &[usize]) -> bool {
        let values = self.values(column);
        let key = |row: &Vec<String>| -> Vec<String> {
            others.iter().chain([&column]).map(|i| row[*i].clone()).collect()
        };
        let keys: HashSet<Vec<String>> = self.0.iter().map(key).collect();
        (2..=MAX_TRACKS).contains(&values) && 2 * values <= self.0.len() && keys.len() == self.0.len()
    }

    /// Returns the number of different values of a column.
    pub(super) fn values(&self, column: usize) -> usize {
        self.column(column).collect::<HashSet<_>>().len()
    }
}
