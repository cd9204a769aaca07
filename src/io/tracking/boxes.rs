//! Boxes about the balls, as detectors write them: by two corners, or by a corner and the size. A ball is in the middle of its box.

use super::words::words;

/// What stands before the names of the sides of a box.
const BEFORE: [&str; 4] = ["boundingbox", "bbox", "box", "bb"];

/// Names of the sides; with nothing before them, those of the last rows may be those of balls, or of the middle of a box.
const CORNERS: [[&str; 4]; 3] =
    [["xmin", "ymin", "xmax", "ymax"], ["left", "top", "right", "bottom"], ["x1", "y1", "x2", "y2"]];
const SIZES: [[&str; 4]; 3] =
    [["left", "top", "width", "height"], ["left", "top", "w", "h"], ["xmin", "ymin", "width", "height"]];
const SIZES_BEHIND: [[&str; 4]; 2] = [["x", "y", "width", "height"], ["x", "y", "w", "h"]];

/// The columns of a box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Boxed {
    pub corner: [usize; 2],
    /// What the others are in `[tracks.columns]`.
    pub keys: [&'static str; 2],
    pub others: [usize; 2],
}

/// The box that these names, in small letters, are certainly those of.
pub(super) fn named(names: &[String]) -> Option<Boxed> {
    let bare: Vec<(String, bool)> = names
        .iter()
        .map(|name| {
            let name = words(name).concat();
            let rest = BEFORE.iter().find_map(|before| name.strip_prefix(before)).map(str::to_string);
            (rest.clone().unwrap_or(name), rest.is_some())
        })
        .collect();
    let find = |sides: &[&str; 4], stated: bool| -> Option<[usize; 4]> {
        let at = |side: &str| bare.iter().position(|(own, before)| own == side && (*before || !stated));
        Some([at(sides[0])?, at(sides[1])?, at(sides[2])?, at(sides[3])?])
    };
    let by = |keys: [&'static str; 2], [x, y, right, bottom]: [usize; 4]| Boxed {
        corner: [x, y],
        keys,
        others: [right, bottom],
    };
    let corners = || CORNERS.iter().enumerate().find_map(|(i, sides)| find(sides, i == 2));
    let sizes = SIZES.iter().find_map(|sides| find(sides, false));
    let sizes = sizes.or_else(|| SIZES_BEHIND.iter().find_map(|sides| find(sides, true)));
    sizes.map(|at| by(SIZE, at)).or_else(|| Some(by(CORNER, corners()?)))
}

/// Keys of `[tracks.columns]` for the size of a box, and for its other corner.
pub(super) const SIZE: [&str; 2] = ["width", "height"];
pub(super) const CORNER: [&str; 2] = ["x2", "y2"];

/// What of `[tracks.columns]` may be added to x and y, as comments: columns of a size, of which nothing says whether these are a corner of
/// the box or its middle, as they are taken for.
pub(super) fn perhaps(names: &[String]) -> Option<[(&'static str, String); 2]> {
    let at = |name: &str| names.iter().find(|own| own.eq_ignore_ascii_case(name));
    let [width, height] = [SIZE, ["w", "h"]].into_iter().find_map(|[w, h]| Some([at(w)?, at(h)?]))?;
    let [width, height] = [width, height].map(|name| toml::Value::from(name.as_str()));
    let why = "of a box: take the # away, from both, where x and y are its corner, and not its middle";
    Some([("# width", format!("{width}   # {why}")), ("# height", height.to_string())])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn boxes_by_their_names() {
        let found = |names: &str| {
            let names: Vec<String> = names.split(' ').map(str::to_string).collect();
            named(&names).map(|found| (found.keys, [found.corner, found.others].concat()))
        };
        for names in ["t xmin ymin xmax ymax", "t left top right bottom", "t bbox_x1 bbox_y1 bbox_x2 bbox_y2"]
        {
            assert_eq!(found(names), Some((CORNER, vec![1, 2, 3, 4])), "{names}");
        }
        for names in
            ["x bb_left bb_top bb_width bb_height x y", "t left top w h", "t bbox_x bbox_y bbox_w bbox_h"]
        {
            assert_eq!(found(names), Some((SIZE, vec![1, 2, 3, 4])), "{names}");
        }
        for names in ["t x1 y1 x2 y2", "t x y w h", "t bbox_cx bbox_cy", "t xmin ymin"] {
            assert_eq!(found(names), None, "{names}");
        }
    }
}
