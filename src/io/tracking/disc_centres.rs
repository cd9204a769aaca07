//! Which point on a disc is its centre, told by all shots of a film together: the same discs have the same points on them, and wherever
//! they hit each other their centres are as far apart.

use std::collections::{BTreeMap, BTreeSet};

use super::disc_contact::{Contact, misfit};
use super::marker_groups::central;
use crate::film::rigid_body::Point;
use crate::measurement::track::Sample;
use crate::numerics::median;

/// Points are on the same disc where they stand alike to this part of their distance from their mean. From shot to shot the same three
/// differ by up to 0.01, and those on two discs, put on alike by hand, by 0.04 (23 films of two pucks, Chalmers 2023).
const SAME: f64 = 0.03;

/// Two orders of the points on a disc are told from each other where they differ by so many times what shots differ by.
const ALIKE: f64 = 4.0;

/// As few shots may have discs the same distance apart by chance.
const LEAST_SHOTS: usize = 3;

/// In so many of the shots is the distance the same; others may be false.
const MOST: f64 = 0.7;

/// Distances that are tried as the one at which discs touch are those of so many shots.
const MOST_TRIED: usize = 50;

/// Discs touch at a distance that is the same to this part: 0.03 with a rubber band around one (Chalmers 2023).
const ROUND: f64 = 0.03;

/// −2 log L by which one is told from the next, and how many times as far at least the distances scatter with the next.
const SURELY: f64 = 12.0;
const CLEARLY: f64 = 2.0;

/// A distance is that of the others where it is off by so many times their scatter.
const NEAR: f64 = 4.0;

/// The centre of a disc: one of its points, or `None` where all are on a circle about it; as an error the points of which one may be it.
pub(crate) type Centre = Result<Option<usize>, Vec<usize>>;

/// What a shot shows of the points on its two discs.
pub(crate) struct Seen {
    /// What the paths on either disc tell.
    alone: [Centre; 2],
    contact: Option<Contact>,
}

impl Seen {
    pub(crate) fn of(discs: [&[&[Sample]]; 2]) -> Self {
        Self { alone: discs.map(central), contact: Contact::of(discs) }
    }

    /// The centres, where but one choice of those that may be it is as far apart as the discs touch, and none other nearly so.
    fn by_radii(&self, touching: f64) -> Option<[Centre; 2]> {
        let contact = self.contact.as_ref()?;
        let circles = contact.shapes.each_ref().map(Vec::len);
        let possible = [0, 1].map(|k| match &self.alone[k] {
            Ok(centre) => vec![centre.unwrap_or(circles[k])],
            Err(points) => points.iter().copied().chain([circles[k]]).collect(),
        });
        let pairs = possible[0].iter().flat_map(|a| possible[1].iter().map(move |b| [*a, *b]));
        let off = |[a, b]: [usize; 2]| (contact.apart[a][b] / touching - 1.0).abs();
        let near: Vec<[usize; 2]> = pairs.filter(|pair| off(*pair) <= CLEARLY * ROUND).collect();
        let [found] = near.try_into().ok().filter(|[found]: &[_; 1]| off(*found) <= ROUND)?;
        Some([0, 1].map(|k| Ok((found[k] < circles[k]).then_some(found[k]))))
    }
}

/// All orders of so many things.
fn orders(n: usize) -> Vec<Vec<usize>> {
    let Some(last) = n.checked_sub(1) else { return vec![Vec::new()] };
    let with = |shorter: Vec<usize>| {
        (0..n).map(move |at| {
            let mut order = shorter.clone();
            order.insert(at, last);
            order
        })
    };
    orders(last).into_iter().flat_map(with).collect()
}

/// The misfit of points to a shape in every order.
fn in_orders(shape: &[Point], points: &[Point]) -> Vec<(f64, Vec<usize>)> {
    let in_order = |order: &[usize]| order.iter().map(|i| points[*i]).collect::<Vec<_>>();
    orders(shape.len()).into_iter().map(|order| (misfit(shape, &in_order(&order)), order)).collect()
}

/// Discs with the same points on them.
struct Kind {
    shape: Vec<Point>,
    /// Of every point and the centre of the circle: those that cannot be told from it by how the points stand.
    alike: Vec<Vec<usize>>,
}

/// A disc of a shot: of which kind it is, and which of its points is which of the kind's.
type Known = (usize, Vec<usize>);

/// The kinds of all discs, with the kind of each.
fn kinds(shots: &[Seen]) -> (Vec<Kind>, Vec<Option<[Known; 2]>>) {
    let (mut kinds, mut misfits): (Vec<Kind>, Vec<f64>) = (Vec::new(), Vec::new());
    let mut known = |points: &Vec<Point>| -> Known {
        let of_same = kinds.iter().enumerate().filter(|(_, kind)| kind.shape.len() == points.len());
        let all = of_same.flat_map(|(i, kind)| {
            in_orders(&kind.shape, points).into_iter().map(move |(off, order)| (off, i, order))
        });
        match all.min_by(|a, b| a.0.total_cmp(&b.0)) {
            Some((off, kind, order)) if off <= SAME => {
                misfits.push(off);
                (kind, order)
            }
            _ => {
                kinds.push(Kind { shape: points.clone(), alike: Vec::new() });
                (kinds.len() - 1, (0..points.len()).collect())
            }
        }
    };
    let of_shots = shots
        .iter()
        .map(|shot| shot.contact.as_ref().map(|contact| contact.shapes.each_ref().map(&mut known)))
        .collect();
    let usual = median(misfits);
    for kind in &mut kinds {
        let mut same = in_orders(&kind.shape, &kind.shape);
        same.retain(|(off, order)| *off <= ALIKE * usual || order.is_sorted());
        let of_point = |i: usize| {
            let all: BTreeSet<usize> =
                same.iter().map(|(_, order)| order.get(i).copied().unwrap_or(i)).collect();
            all.into_iter().collect()
        };
        kind.alike = (0..=kind.shape.len()).map(of_point).collect();
    }
    (kinds, of_shots)
}

/// Shots of the same two kinds of discs.
struct Class<'a> {
    kinds: [&'a Kind; 2],
    shots: Vec<Hit<'a>>,
}

/// A shot: its discs in the order of the kinds, and what is known of them.
struct Hit<'a> {
    shot: usize,
    discs: [usize; 2],
    known: [&'a Known; 2],
    seen: &'a Seen,
    contact: &'a Contact,
}

/// Which point of either kind is the centre, how far apart the discs touch, and by how much that scatters.
struct Verdict {
    points: [usize; 2],
    apart: f64,
    scatter: f64,
}

impl Class<'_> {
    /// Which points of a shot may be the centres, if these are the centres of the kinds, and how far apart they are.
    fn possible(&self, hit: &Hit, points: [usize; 2]) -> Vec<([usize; 2], f64)> {
        let own = [0, 1].map(|k| {
            let alike = self.kinds[k].alike[points[k]].iter();
            alike.map(|i| hit.known[k].1.get(*i).copied().unwrap_or(*i)).collect::<Vec<usize>>()
        });
        let apart = |a: usize, b: usize| {
            let pair = if hit.discs[0] == 0 { [a, b] } else { [b, a] };
            ([a, b], hit.contact.apart[pair[0]][pair[1]])
        };
        own[0].iter().flat_map(|a| own[1].iter().map(move |b| apart(*a, *b))).collect()
    }

    /// Where the discs touch at the same distance in most shots, and at no other choice of centres nearly so.
    fn verdict(&self) -> Option<Verdict> {
        let counted = (MOST * self.shots.len() as f64).ceil() as usize;
        if self.shots.len() < LEAST_SHOTS {
            return None;
        }
        // of points that are alike, the first stands for all
        let of_kind = |k: usize| {
            let alike = &self.kinds[k].alike;
            (0..alike.len()).filter(move |i| alike[*i][0] == *i)
        };
        let mut all: Vec<Verdict> = Vec::new();
        for points in of_kind(0).flat_map(|a| of_kind(1).map(move |b| [a, b])) {
            let apart: Vec<Vec<f64>> = self
                .shots
                .iter()
                .map(|hit| self.possible(hit, points).into_iter().map(|(_, apart)| apart).collect())
                .collect();
            let scatter = |at: f64| {
                let off = |own: &Vec<f64>| own.iter().map(|d| (d - at).abs()).fold(f64::INFINITY, f64::min);
                let mut all: Vec<f64> = apart.iter().map(off).collect();
                all.sort_by(f64::total_cmp);
                all[counted - 1]
            };
            let each = apart.iter().take(MOST_TRIED).flatten();
            let of_each = each.map(|at| Verdict { points, apart: *at, scatter: scatter(*at) });
            all.extend(of_each.min_by(|a, b| a.scatter.total_cmp(&b.scatter)));
        }
        all.sort_by(|a, b| a.scatter.total_cmp(&b.scatter));
        let next = all.get(1)?.scatter;
        let found = all.into_iter().next()?;
        let clear = CLEARLY.max((0.5 * SURELY / (counted - 1) as f64).exp());
        (found.scatter <= ROUND * found.apart && next > clear * found.scatter).then_some(found)
    }

    /// The centres of both discs of a shot.
    fn centres(&self, hit: &Hit, found: &Verdict) -> [Centre; 2] {
        let mut possible = self.possible(hit, found.points);
        for k in 0..2 {
            // one that surely moves straight on
            if let Ok(Some(i)) = hit.seen.alone[hit.discs[k]]
                && possible.iter().any(|(points, _)| points[k] == i)
            {
                possible.retain(|(points, _)| points[k] == i);
            }
        }
        let chi2 = |apart: f64| ((apart - found.apart) / found.scatter).powi(2);
        possible.sort_by(|a, b| chi2(a.1).total_cmp(&chi2(b.1)));
        let first = possible[0];
        let is_sure = possible
            .get(1)
            .is_none_or(|next| chi2(first.1) <= NEAR * NEAR && chi2(next.1) > chi2(first.1) + SURELY);
        [0, 1].map(|k| {
            let alone = possible.iter().all(|(points, _)| points[k] == first.0[k]);
            let on_circle = first.0[k] == self.kinds[k].shape.len();
            if is_sure || alone {
                Ok((!on_circle).then_some(first.0[k]))
            } else {
                let points: BTreeSet<usize> = possible.iter().map(|(points, _)| points[k]).collect();
                Err(points.into_iter().collect())
            }
        })
    }
}

/// The centres of both discs in all shots of a film; `touching` is how far apart they touch, m, where that is known.
pub(crate) fn centres(shots: &[Seen], touching: Option<f64>) -> Vec<[Centre; 2]> {
    let (kinds, known) = kinds(shots);
    // where the same two discs do not look alike, lengths are not what they seem
    let touching = touching.filter(|_| kinds.len() <= 2);
    let mut found: Vec<[Centre; 2]> = shots.iter().map(|shot| shot.alone.clone()).collect();
    let mut classes: BTreeMap<[usize; 2], Class> = BTreeMap::new();
    for (shot, seen) in shots.iter().enumerate() {
        let (Some(known), Some(contact)) = (&known[shot], &seen.contact) else { continue };
        let discs = if known[0].0 <= known[1].0 { [0, 1] } else { [1, 0] };
        let known = discs.map(|k| &known[k]);
        let of_kinds = known.map(|known| known.0);
        let class = || Class { kinds: of_kinds.map(|kind| &kinds[kind]), shots: Vec::new() };
        classes.entry(of_kinds).or_insert_with(class).shots.push(Hit { shot, discs, known, seen, contact });
    }
    for class in classes.values() {
        let verdict = class.verdict();
        for hit in &class.shots {
            let own = &mut found[hit.shot];
            if let Some(verdict) = &verdict {
                for (k, centre) in class.centres(hit, verdict).into_iter().enumerate() {
                    own[hit.discs[k]] = centre;
                }
            } else if own.iter().any(Result::is_err)
                && let Some(centres) = touching.and_then(|touching| hit.seen.by_radii(touching))
            {
                *own = centres;
            }
        }
    }
    found
}
