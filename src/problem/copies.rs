//! Clips that are there twice.

use crate::measurement::dataset::Measured;

/// Returns each shot whose impact is that of another within the errors, as no two shots of a player
/// are, with the other: copies of a clip, whatever their first frame, origin and rounding. Of each
/// shot the same quantities are given, of which those without errors do not count.
pub(crate) fn find_copies(shots: &[Vec<Measured>]) -> Vec<[usize; 2]> {
    let square = |(a, b): (&Measured, &Measured)| {
        let variance = a.sd?.powi(2) + b.sd?.powi(2);
        (variance > 0.0).then(|| (a.value - b.value).powi(2) / variance)
    };
    let first = |i: usize| shots[i].first();
    let mut order: Vec<usize> = (0..shots.len()).filter(|i| first(*i).is_some()).collect();
    let key = |i: usize| first(i).map_or(f64::NAN, |number| number.value);
    order.sort_by(|i, j| key(*i).total_cmp(&key(*j)));
    let mut pairs = Vec::new();
    for (place, i) in order.iter().enumerate() {
        for j in &order[place + 1..] {
            let squares: Vec<f64> = shots[*i].iter().zip(&shots[*j]).filter_map(square).collect();
            // the mean of χ²
            let typical = squares.len() as f64;
            if squares.first().is_none_or(|first| *first >= typical) {
                break;
            }
            if squares.iter().sum::<f64>() < typical {
                pairs.extend([[*i, *j], [*j, *i]]);
            }
        }
    }
    pairs
}
