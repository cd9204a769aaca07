//! The first rows of an unknown table, and what the numbers in its columns may be.

use std::collections::{HashMap, HashSet};

use super::boxes::{self, Boxed, Rest};
use super::heading::Heading;
use super::raw::sorted;
use crate::io::number::value;
use crate::io::text::{lines, trimmed};

/// So many rows are looked at.
const ROWS: usize = 20_000;
/// More tracks than these in a file are not those of balls.
const TRACKS: usize = 20;
/// A path is smoother than another one where it is rough by less than this part of it.
const SMOOTHER: f64 = 0.85;
/// A height changes by less than this part of what a coordinate along the table does.
const FLAT: f64 = 0.1;

/// Returns the least and the largest of nearly all numbers: without a twentieth at either end.
fn ends(numbers: impl Iterator<Item = f64>) -> Option<[f64; 2]> {
    let all = sorted(numbers);
    let few = all.len() / 20;
    Some([*all.get(few)?, *all.get(all.len().checked_sub(few + 1)?)?])
}

/// The first rows of a table.
pub(super) struct Rows(Vec<Vec<String>>);

impl Rows {
    pub(super) fn of(text: &str, heading: &Heading) -> Self {
        let rows = lines(text).skip(heading.above).filter(|(_, line)| !line.trim().is_empty());
        let cells = rows.filter_map(|(_, line)| trimmed(line, heading.separator));
        Self(cells.filter(|cells| cells.len() >= heading.names.len()).take(ROWS).collect())
    }

    /// The numbers in a column; `None` if another thing stands in it.
    pub(super) fn numbers(&self, column: usize) -> Option<Vec<f64>> {
        let numbers: Vec<f64> = self.0.iter().map(|row| value(&row[column])).collect::<Option<_>>()?;
        (numbers.len() > 2).then_some(numbers)
    }

    /// The least step between neighbours of a column that grows from row to row, for each of the groups that other columns make.
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

    /// The boxes that these pairs of columns are corners of: two of them, in a row, or one that two of the pairs make.
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

    /// Whether x and y are those of a corner of boxes of this size, and not of their middle: the middle moves more smoothly, since each
    /// side of a box errs by itself. `None` where the paths do not show it.
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
            // without the impacts, and where a tracker jumps
            let bends = sorted(bends.flatten());
            bends[..bends.len() * 9 / 10].iter().sum()
        };
        let [as_middle, as_corner] = [0.0, 0.5].map(rough);
        (as_corner.max(as_middle) > 0.0 && as_corner.min(as_middle) < SMOOTHER * as_corner.max(as_middle))
            .then_some(as_corner < as_middle)
    }

    /// Takes z and x for the positions of balls where y is the height, as OptiTrack calls it: it hardly changes, and z does.
    pub(super) fn lay_flat(&self, names: &[String], positions: &mut [[usize; 2]]) {
        let extent = |column: usize| {
            let ends = ends(self.0.iter().filter_map(|row| value(&row[column])));
            ends.map_or(0.0, |[low, high]| high - low)
        };
        let z: Option<Vec<usize>> = positions.iter().map(|[x, _]| boxes::beside(names, *x, "z")).collect();
        let Some(z) = z else { return };
        let [high, wide] = [positions.iter().map(|[_, y]| *y).collect(), z.clone()]
            .map(|columns: Vec<usize>| columns.into_iter().map(extent).sum::<f64>());
        if high < FLAT * wide {
            // seen from above, z, x and the height make a system as x, y and z do
            positions.iter_mut().zip(z).for_each(|(position, z)| *position = [z, position[0]]);
        }
    }

    /// Whether most values of a column, within groups, stand in two rows.
    pub(super) fn are_pairs(&self, column: usize, shot: Option<usize>) -> bool {
        let mut counts: HashMap<(&str, &str), usize> = HashMap::new();
        for row in &self.0 {
            *counts.entry((shot.map_or("", |shot| row[shot].as_str()), row[column].as_str())).or_default() +=
                1;
        }
        counts.len() > 2 && 3 * counts.values().filter(|count| **count == 2).count() > 2 * counts.len()
    }

    /// Whether two pairs of columns are corners of a box about a ball: it is about as wide and as high in nearly all rows.
    fn is_box(&self, [x, y]: [usize; 2], [x2, y2]: [usize; 2]) -> bool {
        self.is_size(|row| Some(value(&row[x2])? - value(&row[x])?))
            && self.is_size(|row| Some(value(&row[y2])? - value(&row[y])?))
    }

    /// Whether a length is that of the side of such a box.
    pub(super) fn is_size(&self, of: impl Fn(&[String]) -> Option<f64>) -> bool {
        let ends = ends(self.0.iter().filter_map(|row| of(row)));
        ends.is_some_and(|[least, most]| least > 0.0 && most < 2.0 * least)
    }

    /// Whether no row has anything in a column.
    pub(super) fn is_empty(&self, column: usize) -> bool {
        self.0.iter().all(|row| row[column].is_empty())
    }

    pub(super) fn is_whole(&self, column: usize) -> bool {
        self.numbers(column).is_some_and(|numbers| numbers.iter().all(|number| number.fract() == 0.0))
    }

    /// Whether a column has few values, and these tell apart the rows that other columns do not.
    pub(super) fn tells_apart(&self, column: usize, others: &[usize]) -> bool {
        let values = self.values(column);
        let key = |row: &'_ [String]| -> Vec<String> {
            others.iter().chain([&column]).map(|i| row[*i].clone()).collect()
        };
        let keys: HashSet<Vec<String>> = self.0.iter().map(|row| key(row)).collect();
        (2..=TRACKS).contains(&values) && 2 * values <= self.0.len() && keys.len() == self.0.len()
    }

    /// How many values a column has.
    pub(super) fn values(&self, column: usize) -> usize {
        self.0.iter().map(|row| row[column].as_str()).collect::<HashSet<_>>().len()
    }
}
