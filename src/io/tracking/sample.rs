//! The first rows of an unknown table, and tests of the numbers in its columns.

use std::collections::{HashMap, HashSet};

use super::boxes::{self, Boxed, Rest};
use super::heading::Heading;
use super::raw::sorted;
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

    /// Returns the numbers in a column; `None` if a cell is not a number.
    pub(super) fn numbers(&self, column: usize) -> Option<Vec<f64>> {
        let numbers: Vec<f64> = self.0.iter().map(|row| value(&row[column])).collect::<Option<_>>()?;
        (numbers.len() > 2).then_some(numbers)
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
    pub(super) fn boxes_of(&self, pairs: &[[usize; 2]]) -> Vec<Boxed> {
        let boxed = |corner: [usize; 2], other: [usize; 2]| {
            self.is_box(corner, other).then_some(Boxed { corner, rest: Rest::Corner(other) })
        };
        if let [a, b, c, d] = *pairs
            && let (Some(one), Some(other)) = (boxed(a, b), boxed(c, d))
        {
            return vec![one, other];
        }
        let each = pairs
            .iter()
            .enumerate()
            .flat_map(|(i, one)| pairs[i + 1..].iter().map(move |other| (*one, *other)));
        each.into_iter().find_map(|(one, other)| boxed(one, other)).into_iter().collect()
    }

    /// Returns whether x and y are the corner of boxes of this size instead of the middle, which
    /// moves more smoothly since each side errs independently. `None` if the paths do not decide.
    pub(super) fn is_corner(
        &self,
        [x, y]: [usize; 2],
        [width, height]: [usize; 2],
        ball: Option<usize>,
    ) -> Option<bool> {
        let mut balls: HashMap<&str, Vec<&[String]>> = HashMap::new();
        for row in &self.0 {
            balls.entry(ball.map_or("", |ball| row[ball].as_str())).or_default().push(row);
        }
        let rough = |part: f64| -> f64 {
            let bends = balls.values().flat_map(|rows| rows.windows(3)).flat_map(|three| {
                [(x, width), (y, height)].map(|(at, size)| {
                    let [a, b, c] =
                        [0, 1, 2].map(|i| Some(value(&three[i][at])? + part * value(&three[i][size])?));
                    Some((a? - 2.0 * b? + c?).abs())
                })
            });
            // without the impacts and jumps of the tracker
            let bends = sorted(bends.flatten());
            bends[..bends.len() * 9 / 10].iter().sum()
        };
        let [as_middle, as_corner] = [0.0, 0.5].map(rough);
        (as_corner.max(as_middle) > 0.0
            && as_corner.min(as_middle) < MAX_ROUGHNESS_RATIO * as_corner.max(as_middle))
        .then_some(as_corner < as_middle)
    }

    /// Replaces x and y of balls by z and x if y is the height (OptiTrack), which hardly changes.
    pub(super) fn lay_flat(&self, names: &[String], positions: &mut [[usize; 2]]) {
        let extent = |column: usize| {
            let ends = ends(self.0.iter().filter_map(|row| value(&row[column])));
            ends.map_or(0.0, |[low, high]| high - low)
        };
        let z: Option<Vec<usize>> = positions.iter().map(|[x, _]| boxes::beside(names, *x, "z")).collect();
        let Some(z) = z else { return };
        let [high, wide] = [positions.iter().map(|[_, y]| *y).collect(), z.clone()]
            .map(|columns: Vec<usize>| columns.into_iter().map(extent).sum::<f64>());
        if high < MAX_HEIGHT_RATIO * wide {
            // seen from above, z, x and the height are right-handed as x, y and z are
            positions.iter_mut().zip(z).for_each(|(position, z)| *position = [z, position[0]]);
        }
    }

    /// Returns whether most values of a column stand in two rows of their group.
    pub(super) fn are_pairs(&self, column: usize, shot: Option<usize>) -> bool {
        let mut counts: HashMap<(&str, &str), usize> = HashMap::new();
        for row in &self.0 {
            *counts.entry((shot.map_or("", |shot| row[shot].as_str()), row[column].as_str())).or_default() +=
                1;
        }
        counts.len() > 2 && 3 * counts.values().filter(|count| **count == 2).count() > 2 * counts.len()
    }

    /// Returns whether columns are corners of boxes of nearly constant width and height.
    fn is_box(&self, [x, y]: [usize; 2], [x2, y2]: [usize; 2]) -> bool {
        self.is_size(|row| Some(value(&row[x2])? - value(&row[x])?))
            && self.is_size(|row| Some(value(&row[y2])? - value(&row[y])?))
    }

    /// Returns whether a length is that of a side of such boxes.
    pub(super) fn is_size(&self, of: impl Fn(&[String]) -> Option<f64>) -> bool {
        let ends = ends(self.0.iter().filter_map(|row| of(row)));
        ends.is_some_and(|[least, most]| least > 0.0 && most < 2.0 * least)
    }

    pub(super) fn is_empty(&self, column: usize) -> bool {
        self.0.iter().all(|row| row[column].is_empty())
    }

    pub(super) fn is_whole(&self, column: usize) -> bool {
        self.numbers(column).is_some_and(|numbers| numbers.iter().all(|number| number.fract() == 0.0))
    }

    /// Returns whether a column has few values, and rows differ only with it.
    pub(super) fn distinguishes_rows(&self, column: usize, others: &[usize]) -> bool {
        let values = self.values(column);
        let key = |row: &'_ [String]| -> Vec<String> {
            others.iter().chain([&column]).map(|i| row[*i].clone()).collect()
        };
        let keys: HashSet<Vec<String>> = self.0.iter().map(|row| key(row)).collect();
        (2..=MAX_TRACKS).contains(&values) && 2 * values <= self.0.len() && keys.len() == self.0.len()
    }

    /// Returns the number of different values of a column.
    pub(super) fn values(&self, column: usize) -> usize {
        self.0.iter().map(|row| row[column].as_str()).collect::<HashSet<_>>().len()
    }
}
