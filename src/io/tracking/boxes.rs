//! Boxes of detectors about the balls: two corners, or a corner and the size.

use super::words::words;

/// Prefixes of the names of the sides of a box.
const BEFORE: [&str; 4] = ["boundingbox", "bbox", "box", "bb"];

/// Names of the sides; without a prefix, the last rows may be names of balls or of a middle.
const CORNERS: [[&str; 4]; 3] =
    [["xmin", "ymin", "xmax", "ymax"], ["left", "top", "right", "bottom"], ["x1", "y1", "x2", "y2"]];
const SIZES: [[&str; 4]; 5] = [
    ["left", "top", "width", "height"],
    ["left", "top", "w", "h"],
    ["xmin", "ymin", "width", "height"],
    ["x", "y", "width", "height"],
    ["x", "y", "w", "h"],
];

/// Names of a size beside a column x.
const SIDES: [[&str; 2]; 2] = [["width", "height"], ["w", "h"]];

/// Columns that determine the middle of a box together with those of a corner.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Rest {
    /// The columns of the other corner.
    Corner([usize; 2]),
    /// The columns of width and height.
    Size([usize; 2]),
}

impl Rest {
    /// Returns the columns of the keys of `[tracks.columns]` that begin like this.
    pub(super) fn of(at: impl Fn(&str) -> Option<usize>, begin: &str) -> Option<Self> {
        let pair =
            |[one, other]: [&str; 2]| Some([at(&format!("{begin}{one}"))?, at(&format!("{begin}{other}"))?]);
        pair(CORNER).map(Self::Corner).or_else(|| pair(SIZE).map(Self::Size))
    }

    pub(super) fn columns(self) -> [usize; 2] {
        let (Self::Corner(columns) | Self::Size(columns)) = self;
        columns
    }

    /// Returns the middle of a box from a corner and the values of these columns.
    pub(super) fn middle(self, [x, y]: [f64; 2], [other_x, other_y]: [f64; 2]) -> [f64; 2] {
        match self {
            Self::Corner(_) => [f64::midpoint(x, other_x), f64::midpoint(y, other_y)],
            Self::Size(_) => [x + 0.5 * other_x, y + 0.5 * other_y],
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Boxed {
    pub corner: [usize; 2],
    pub rest: Rest,
}

/// Returns the box, or both boxes of a wide table, of these names in small letters, if certain.
pub(super) fn named(names: &[String]) -> Vec<Boxed> {
    let plain: Vec<String> = names.iter().map(|name| words(name).concat()).collect();
    let find = |sides: &[&str; 4], are_sure: bool, rest: fn([usize; 2]) -> Rest| -> Vec<Boxed> {
        let begin = plain.iter().filter_map(|name| name.strip_suffix(sides[0]));
        let boxed = |begin: &str| {
            let at = |side: &str| plain.iter().position(|name| name.strip_prefix(begin) == Some(side));
            let [x, y, right, bottom] = sides.map(at);
            Some(Boxed { corner: [x?, y?], rest: rest([right?, bottom?]) })
        };
        let found: Vec<(&str, Boxed)> = begin.filter_map(|begin| Some((begin, boxed(begin)?))).collect();
        let is_stated = |begin: &str| BEFORE.iter().any(|before| begin.ends_with(before));
        let are_stated = are_sure || found.iter().all(|(begin, _)| is_stated(begin));
        // x1, y1, x2, y2 of each of two balls
        let are_two = || {
            found.len() == 2
                && found
                    .iter()
                    .all(|(begin, boxed)| !begin.is_empty() && matches!(boxed.rest, Rest::Corner(_)))
        };
        if are_stated || are_two() { found.into_iter().map(|(_, boxed)| boxed).collect() } else { Vec::new() }
    };
    let sizes = SIZES.iter().enumerate().map(|(i, sides)| find(sides, i < 3, Rest::Size));
    let corners = CORNERS.iter().enumerate().map(|(i, sides)| find(sides, i < 2, Rest::Corner));
    sizes.chain(corners).find(|found| (1..=2).contains(&found.len())).unwrap_or_default()
}

/// Keys of `[tracks.columns]` for the size of a box, and for its other corner.
pub(super) const SIZE: [&str; 2] = ["width", "height"];
pub(super) const CORNER: [&str; 2] = ["x2", "y2"];

/// Returns the columns of a size that belong to this column of x.
pub(super) fn size(names: &[String], x: usize) -> Option<[usize; 2]> {
    SIDES.into_iter().find_map(|[width, height]| Some([beside(names, x, width)?, beside(names, x, height)?]))
}

/// Returns the column with the name of this column of x, the x replaced by another word.
pub(super) fn beside(names: &[String], x: usize, word: &str) -> Option<usize> {
    let name = &names[x];
    name.char_indices().filter(|(_, c)| *c == 'x').find_map(|(at, _)| {
        let other = format!("{}{word}{}", &name[..at], &name[at + 1..]);
        names.iter().position(|own| *own == other)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn boxes_by_their_names() {
        let found = |names: &str| {
            let names: Vec<String> = names.split(' ').map(str::to_string).collect();
            let boxes = named(&names);
            let is_corner = boxes.first().map(|found| matches!(found.rest, Rest::Corner(_)));
            let columns = boxes.iter().flat_map(|found| [found.corner, found.rest.columns()].concat());
            (is_corner, columns.collect::<Vec<usize>>())
        };
        let (corner, size) = (Some(true), Some(false));
        for (names, kind, columns) in [
            ("t xmin ymin xmax ymax", corner, 1..5),
            ("t left top right bottom", corner, 1..5),
            ("t bbox_x1 bbox_y1 bbox_x2 bbox_y2", corner, 1..5),
            ("x bb_left bb_top bb_width bb_height x y", size, 1..5),
            ("t left top w h", size, 1..5),
            ("t bbox_x bbox_y bbox_w bbox_h", size, 1..5),
            ("t a_x1 a_y1 a_x2 a_y2 b_x1 b_y1 b_x2 b_y2", corner, 1..9),
            ("t A_left A_top A_w A_h B_left B_top B_w B_h", size, 1..9),
            ("t x1 y1 x2 y2", None, 0..0),
            ("t x y w h", None, 0..0),
            ("t a_x a_y a_w a_h b_x b_y b_w b_h", None, 0..0),
            ("t bbox_cx bbox_cy", None, 0..0),
            ("t xmin ymin", None, 0..0),
        ] {
            assert_eq!(found(names), (kind, columns.collect()), "{names}");
        }
    }
}
