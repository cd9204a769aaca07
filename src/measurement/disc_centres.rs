//! Which point on a disc is its centre, told by all shots of a film together: the same discs have the same points on them, and wherever
//! they hit each other their centres are as far apart.

use std::collections::BTreeMap;

use super::marker_groups::central;
use super::rigid_body::{Point, Pose, circle, frames, shape};
use super::track::Sample;
use crate::numerics::median;

/// Paths are taken for straight in so many frames before and after an impact, and in no fewer.
const REACH: usize = 16;
const LEAST_FRAMES: usize = 6;

/// A frame in which points are off the shape of their disc by so many times the median has points mistaken for each other.
const MISTAKEN: f64 = 8.0;

/// So many points on a disc have 120 orders, which are all tried.
const MOST_POINTS: usize = 5;

/// Points are on the same disc where they stand alike to this part of their distance from their mean. From shot to shot the same three
/// differ by up to 0.01, and those on two discs, put on alike by hand, by 0.04 (23 films of two pucks, Chalmers 2023).
const SAME: f64 = 0.03;

/// Two orders of the points on a disc are told from each other where they differ by so many times what shots differ by.
const ALIKE: f64 = 4.0;

/// As few shots may have discs the same distance apart by chance.
const LEAST_SHOTS: usize = 3;

/// In so many of the shots is the distance the same; others may be false.
const MOST: f64 = 0.7;

/// Discs touch at a distance that is the same to this part: 0.03 with a rubber band around one (Chalmers 2023).
const ROUND: f64 = 0.03;

/// −2 log L by which one is told from the next, and how many times as far at least the distances scatter with the next.
const SURELY: f64 = 12.0;
const CLEARLY: f64 = 2.0;

/// A distance is that of the others where it is off by so many times their scatter.
const NEAR: f64 = 4.0;

/// The centre of a disc: one of its points, or `None` where all are on a circle about it; as an error a point that may be it or not.
pub(crate) type Centre = Result<Option<usize>, usize>;

/// What a shot shows of the points on its two discs.
pub(crate) struct Seen {
    /// What the paths on either disc tell.
    alone: [Centre; 2],
    contact: Option<Contact>,
}

struct Contact {
    /// How the points of either disc stand.
    shapes: [Vec<Point>; 2],
    /// How far apart the discs are at the impact, by the point that is the centre of the first and that of the second; behind the points of
    /// each stands the centre of the circle through them, which is not a number where they are on a line.
    apart: Vec<Vec<f64>>,
}

impl Seen {
    pub(crate) fn of(discs: [&[&[Sample]]; 2]) -> Self {
        Self { alone: discs.map(central), contact: Contact::of(discs) }
    }
}

impl Contact {
    fn of(discs: [&[&[Sample]]; 2]) -> Option<Self> {
        if discs.iter().any(|points| !(3..=MOST_POINTS).contains(&points.len())) {
            return None;
        }
        let complete = |(t, points): (f64, Vec<Option<Point>>)| {
            let points: Vec<Point> = points.into_iter().collect::<Option<_>>()?;
            let (first, second) = points.split_at(discs[0].len());
            Some((t, [first.to_vec(), second.to_vec()]))
        };
        let seen: Vec<(f64, [Vec<Point>; 2])> =
            frames(&discs.concat()).into_iter().filter_map(complete).collect();
        let of_disc = |k: usize| seen.iter().map(|(_, points)| points[k].clone()).collect::<Vec<_>>();
        let shapes = [shape(&of_disc(0))?, shape(&of_disc(1))?];
        let off = |k: usize, points: &[Point]| misfit(&shapes[k], points);
        let usual = [0, 1].map(|k| median(seen.iter().map(|(_, points)| off(k, &points[k])).collect()));
        let good: Vec<_> = seen
            .iter()
            .filter(|(_, points)| [0, 1].iter().all(|k| off(*k, &points[*k]) <= MISTAKEN * usual[*k]))
            .collect();
        // the mean of the points last
        let paths = [0, 1].map(|k| {
            let shape = &shapes[k];
            let middle = [0, 1].map(|c| shape.iter().map(|p| p[c]).sum::<f64>() / shape.len() as f64);
            let places = shape.iter().copied().chain([circle(shape).unwrap_or([f64::NAN; 2]), middle]);
            let path = |place: Point| {
                good.iter().map(|(t, points)| (*t, Pose::of(shape, &points[k]).place(place))).collect()
            };
            places.map(path).collect::<Vec<Vec<(f64, Point)>>>()
        });
        let sides = around_impact([0, 1].map(|k| paths[k].last().map(Vec::as_slice).unwrap_or_default()))?;
        let lines = paths.map(|mut paths| {
            paths.pop();
            paths.iter().map(|path| sides.clone().map(|side| line(&path[side]))).collect::<Vec<_>>()
        });
        let apart = lines[0].iter().map(|a| lines[1].iter().map(|b| meeting([*a, *b]).1).collect()).collect();
        Some(Self { shapes, apart })
    }
}

/// Place at time 0 and velocity of the straight line nearest to a path.
type Line = [Point; 2];

fn line(path: &[(f64, Point)]) -> Line {
    let n = path.len() as f64;
    let middle = path.iter().map(|(t, _)| t).sum::<f64>() / n;
    let spread: f64 = path.iter().map(|(t, _)| (t - middle).powi(2)).sum();
    let velocity = [0, 1].map(|k| path.iter().map(|(t, p)| (t - middle) * p[k]).sum::<f64>() / spread);
    [[0, 1].map(|k| path.iter().map(|(_, p)| p[k]).sum::<f64>() / n - velocity[k] * middle), velocity]
}

/// When the paths of two discs before an impact are nearest to those after it, and how far apart the discs then are.
fn meeting(discs: [[Line; 2]; 2]) -> (f64, f64) {
    let (mut product, mut square) = (0.0, 0.0);
    for [before, after] in &discs {
        for k in 0..2 {
            let (gap, change) = (after[0][k] - before[0][k], after[1][k] - before[1][k]);
            (product, square) = (product + gap * change, square + change * change);
        }
    }
    let t = -product / square;
    let [one, other] = discs
        .map(|lines| [0, 1].map(|k| 0.5 * lines.iter().map(|line| line[0][k] + line[1][k] * t).sum::<f64>()));
    (t, (one[0] - other[0]).hypot(one[1] - other[1]))
}

/// The frames just before and after the impact, without those next to it: there both discs change their velocities most.
fn around_impact(paths: [&[(f64, Point)]; 2]) -> Option<[std::ops::Range<usize>; 2]> {
    let n = paths[0].len();
    let reach = REACH.min(n / 4);
    if reach < LEAST_FRAMES {
        return None;
    }
    let change = |i: usize| {
        let of = |path: &[(f64, Point)]| {
            let [a, b] = [&path[i - reach..i], &path[i..i + reach]].map(|side| line(side)[1]);
            (a[0] - b[0]).hypot(a[1] - b[1])
        };
        of(paths[0]).min(of(paths[1]))
    };
    let changes = (reach..=n - reach).map(|i| (change(i), i));
    let (_, first) = changes.max_by(|a, b| a.0.total_cmp(&b.0))?;
    let sides =
        |i: usize| [i.saturating_sub(reach + 1)..i.saturating_sub(1), (i + 1).min(n)..(i + 1 + reach).min(n)];
    let (t, _) = meeting(paths.map(|path| sides(first).map(|side| line(&path[side]))));
    let found = sides(paths[0].partition_point(|(time, _)| *time < t));
    found.iter().all(|side| side.len() >= LEAST_FRAMES).then_some(found)
}

/// By how much points are off others, turned and moved onto them, as a part of their distance from their mean.
fn misfit(own: &[Point], others: &[Point]) -> f64 {
    let pose = Pose::of(own, others);
    let n = own.len() as f64;
    let middle = [0, 1].map(|k| others.iter().map(|p| p[k]).sum::<f64>() / n);
    let square = |a: Point, b: Point| (a[0] - b[0]).powi(2) + (a[1] - b[1]).powi(2);
    let off: f64 = own.iter().zip(others).map(|(p, q)| square(pose.place(*p), *q)).sum();
    (off / others.iter().map(|p| square(*p, middle)).sum::<f64>()).sqrt()
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
            let mut all: Vec<usize> =
                same.iter().map(|(_, order)| order.get(i).copied().unwrap_or(i)).collect();
            all.sort_unstable();
            all.dedup();
            all
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
            if is_sure || alone { Ok((!on_circle).then_some(first.0[k])) } else { Err(first.0[k]) }
        })
    }
}

/// Distances that are tried as the one at which discs touch are those of so many shots.
const MOST_TRIED: usize = 50;

/// The centres of both discs in all shots of a film.
pub(crate) fn centres(shots: &[Seen]) -> Vec<[Centre; 2]> {
    let (kinds, known) = kinds(shots);
    let mut found: Vec<[Centre; 2]> = shots.iter().map(|shot| shot.alone).collect();
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
        let Some(verdict) = class.verdict() else { continue };
        for hit in &class.shots {
            let centres = class.centres(hit, &verdict);
            for k in 0..2 {
                found[hit.shot][hit.discs[k]] = centres[k];
            }
        }
    }
    found
}
