//! Discs: impacts of pucks made with known masses, friction and restitution, through the library; what cannot be used; and the real data
//! sets that ship.

use caromfit::fit::{DiscImpact, ExtractedDiscs};

use crate::films::pucks::{Collision, E, FPS, MASSES, RADII, SETTINGS, film_of, load};
use crate::prelude::*;

const MU: f64 = 0.08;

/// Coulomb's law, of discs that slide on each other throughout.
fn sliding(slip: f64, closing: f64) -> f64 {
    // the slip changes by (1 + 1/ν)(1/m₁ + 1/m₂) J_t
    assert!(slip.abs() > 3.0 * MU * (1.0 + E) * closing, "it must not stick");
    -MU * slip.signum()
}

/// A camera that needs no correction, as is known.
const CAMERA: &str = "[camera]\nscale = \"none\"\naspect = \"none\"\nshear = \"none\"\nperspective = \"none\"\n\
    lens = \"none\"\nshutter = \"none\"\n";

/// The data set with its notes, and its shots with what was measured of them.
pub fn with_discs(dataset: Dataset) -> (Dataset, Vec<(TrackShot, DiscImpact)>) {
    let ExtractedDiscs { dataset, shots, .. } = fit::extract_discs(dataset);
    (dataset, shots)
}

/// What every quantity of a collision truly is.
fn truths(truth: &Collision) -> Vec<(&str, f64)> {
    let [before, after] = truth.sides;
    let g = [before[1].velocity[0] - before[0].velocity[0], before[1].velocity[1] - before[0].velocity[1]];
    let [cos, sin] = truth.normal;
    let slip = g[1] * cos - g[0] * sin - RADII[0] * before[0].spin - RADII[1] * before[1].spin;
    vec![
        ("e", E),
        ("impulse_ratio", truth.ratio),
        ("impulse_ratio_by_cue_spin", truth.ratio),
        ("impulse_ratio_by_obj_spin", truth.ratio),
        ("momentum_along", 0.0),
        ("momentum_across", 0.0),
        ("slip", slip),
        ("cue_vx", before[0].velocity[0]),
        ("obj_vy", before[1].velocity[1]),
        ("cue_vy_after", after[0].velocity[1]),
        ("obj_vx_after", after[1].velocity[0]),
        ("cue_wz", before[0].spin),
        ("obj_wz_after", after[1].spin),
        ("impact_time_s", truth.time),
    ]
}

fn of_shot(extracted: &[(TrackShot, DiscImpact)]) -> impl Iterator<Item = (usize, &DiscImpact)> {
    extracted.iter().map(|(track, impact)| (track.name.parse().unwrap(), impact))
}

/// Errors over stated standard deviations have mean 0 and standard deviation 1. The camera is stated: what
/// it may be off is an error that all shots have in common.
#[test]
fn errors_of_discs_are_what_they_are_stated_to_be() {
    const SHOTS: usize = 250;
    /// Four standard errors of a mean over the shots, and what the estimated noise and correlation add.
    const MEAN: f64 = 0.25;
    const SPREAD: f64 = 0.2;
    let (table, made) = film_of(5, SHOTS, sliding);
    let (dataset, extracted) = with_discs(load(&format!("{SETTINGS}{CAMERA}"), &table).unwrap());
    assert!(dataset.left_out.is_empty(), "{:?}", dataset.left_out);
    // nothing is held against good shots
    for (track, impact) in &extracted {
        assert!(impact.doubts().is_empty(), "{}: {:?}", track.name, impact.doubts());
    }
    let mut directions = Vec::new();
    let mut pulls: Vec<(&str, Vec<f64>)> = truths(&made[0]).iter().map(|(q, _)| (*q, Vec::new())).collect();
    for (shot, impact) in of_shot(&extracted) {
        for ((quantity, truth), (_, pulls)) in truths(&made[shot]).into_iter().zip(&mut pulls) {
            let measured = impact.get(quantity).unwrap();
            pulls.push((measured.value - truth) / measured.sd.unwrap());
        }
        // the same discs touch in all shots, so that these have one error of it in common
        let distance = impact.get("contact_distance_mm").unwrap();
        assert!(
            (distance.value - 1e3 * (RADII[0] + RADII[1])).abs() < 4.0 * distance.sd.unwrap(),
            "{distance:?}"
        );
        // a component near ±1 hardly moves with the angle: the angle itself is normal
        let [x, y] = ["nx", "ny"].map(|quantity| impact.get(quantity).unwrap());
        let [cos, sin] = made[shot].normal;
        directions.push((y.value * cos - x.value * sin) / x.sd.unwrap().hypot(y.sd.unwrap()));
    }
    pulls.push(("nx", directions));
    for (quantity, pulls) in pulls {
        let n = pulls.len() as f64;
        let mean = pulls.iter().sum::<f64>() / n;
        let spread = (pulls.iter().map(|p| (p - mean).powi(2)).sum::<f64>() / (n - 1.0)).sqrt();
        assert!(mean.abs() < MEAN && (spread - 1.0).abs() < SPREAD, "{quantity:?}: {mean} ± {spread}");
    }
}

#[test]
fn masses_radii_and_frame_rate_need_not_be_known() {
    let (table, made) = film_of(6, 20, sliding);
    let bare = SETTINGS
        .replace("radius_m = 0.030\nmass_kg = 0.050\n[object]\nradius_m = 0.020\nmass_kg = 0.030\n", "")
        .replace("capture_fps = 500", "capture_fps = \"unknown\"");
    let (_, known) = with_discs(load(SETTINGS, &table).unwrap());
    let dataset = fit::extract(load(&bare, &table).unwrap());
    assert!(dataset.tracks.unwrap().notes.iter().any(|note| note.contains("frame rate is unknown")));
    let (_, extracted) = with_discs(load(&bare, &table).unwrap());
    for ((shot, impact), (_, known)) in of_shot(&extracted).zip(of_shot(&known)) {
        let pull = |quantity: &str, truth: f64| {
            let measured = impact.get(quantity).unwrap();
            (measured.value - truth).abs() / measured.sd.unwrap()
        };
        // a normal deviate beyond 5 comes once in two million
        assert!(pull("mass_ratio", MASSES[1] / MASSES[0]) < 5.0);
        assert!(pull("contact_distance_mm", 1e3 * (RADII[0] + RADII[1])) < 5.0);
        assert!(pull("impact_time_s", made[shot].time * FPS) < 5.0);
        assert!(impact.get("momentum_along").is_none());
        // the radii's prior moves them by little
        for quantity in ["e", "impulse_ratio"] {
            let (a, b) = (impact.get(quantity).unwrap(), known.get(quantity).unwrap());
            assert!((a.value - b.value).abs() < 0.2 * b.sd.unwrap(), "{quantity:?}: {a:?}, {b:?}");
        }
    }
}

/// A film of one dimension in units of its own, in which marks anywhere on the discs are followed: e is found, for any distance of the marks.
#[test]
fn marks_in_one_dimension_show_the_restitution() {
    const APART: [f64; 4] = [361.5, 378.0, 408.4, 437.1];
    let mut table = "shot,frame,ball,x,y\n".to_owned();
    for (shot, apart) in APART.into_iter().enumerate() {
        let speed = 4.0 + shot as f64;
        for frame in 0..60 {
            let since = f64::from(frame) - 30.3;
            let after = |part: f64| 0.5 * part * speed * since.max(0.0);
            let noise = |ball: f64| 0.3 * (f64::from(frame * frame) * (1.3 + ball) + shot as f64).sin();
            let cue = speed * since.min(0.0) + after(1.0 - E) + noise(0.0);
            let object = apart + after(1.0 + E) + noise(0.4);
            table += &format!("{shot},{frame},a,{cue},100\n{shot},{frame},b,{object},100\n");
        }
    }
    let settings = "name = \"line\"\nkind = \"tracks\"\nfiles = [\"pucks.csv\"]\nball.shape = \"disc\"\nvideo.capture_fps = \"unknown\"\n\
                    tracks = { cue = \"a\", object = \"b\" }";
    let (dataset, extracted) = with_discs(load(settings, &table).unwrap());
    assert_eq!(extracted.len(), APART.len(), "{:?}", dataset.left_out);
    for (track, impact) in &extracted {
        let e = impact.get("e").unwrap();
        assert!((e.value - E).abs() < 4.0 * e.sd.unwrap() && e.sd.unwrap() < 0.02, "{}: {e:?}", track.name);
    }
}

/// A point of each disc is hidden in every third frame, and one is mistaken for a moment: the others show where the centre is.
#[test]
fn points_that_are_hidden_at_times_show_the_centres() {
    let (table, _) = film_of(10, 4, sliding);
    let hidden = table.lines().filter_map(|row| {
        let [shot, frame, point, x, y] = row.split(',').collect::<Vec<_>>()[..] else { panic!("{row}") };
        let Ok(number) = frame.parse::<i64>() else { return Some(row.to_owned()) };
        let hides = number % 9 == 3 * point[1..].parse::<i64>().unwrap();
        let mistaken = if number % 40 == 7 && point == "b1" { 0.02 } else { 0.0 };
        (!hides).then(|| format!("{shot},{frame},{point},{x},{}", y.parse::<f64>().unwrap() + mistaken))
    });
    let [hidden, whole] = [hidden.collect::<Vec<_>>().join("\n"), table.clone()]
        .map(|table| with_discs(load(SETTINGS, &table).unwrap()).1);
    assert_eq!(hidden.len(), 4);
    for ((track, impact), (all, _)) in hidden.iter().zip(&whole) {
        // the film hides points, too: less than a tenth of the frames has a single one, or a mistaken one of two
        let lost = [all.cue.len() - track.cue.len(), all.object.len() - track.object.len()];
        assert!(lost.iter().all(|lost| 10 * lost < all.cue.len()), "{}: {lost:?}", track.name);
        let e = impact.get("e").unwrap();
        assert!((e.value - E).abs() < 4.0 * e.sd.unwrap(), "{}: {e:?}", track.name);
    }
}

#[test]
fn a_fit_of_discs_finds_friction_and_restitution() {
    let (table, _) = film_of(7, 40, sliding);
    let dataset = load(SETTINGS, &table).unwrap();
    let fit = options::fitted(&dataset, Depth::Intervals);
    for (parameter, truth) in [(Parameter::Mu, MU), (Parameter::E, E)] {
        let estimate = fit.get(parameter).unwrap();
        let pull = (estimate.value - truth) / estimate.std_error.unwrap();
        assert!(pull.abs() < 4.0 && estimate.std_error.unwrap() < 0.005, "{parameter:?}: {pull}");
    }
    assert!(!fit.is_refuted());
    assert!(fit.chi2() / (fit.dof() as f64) < 1.5, "{}", fit.chi2() / fit.dof() as f64);
}

#[test]
fn shots_of_discs_that_cannot_be_used_say_why() {
    let (table, made) = film_of(9, 1, sliding);
    let reason = |settings: &str, table: &str| {
        let (dataset, extracted) = with_discs(load(settings, table).unwrap());
        assert!(extracted.is_empty());
        dataset.left_out[0].1.clone()
    };
    let frames = |keep: &dyn Fn(i64, &str) -> bool| {
        let (head, rows) = table.split_once('\n').unwrap();
        let kept = rows.lines().filter(|row| {
            let cells: Vec<&str> = row.split(',').collect();
            keep(cells[1].parse().unwrap(), cells[2])
        });
        format!("{head}\n{}\n", kept.collect::<Vec<_>>().join("\n"))
    };
    let impact = (made[0].time * FPS) as i64;
    let short = reason(SETTINGS, &frames(&|frame, _| (0..5).contains(&frame)));
    assert!(short.contains("too short: 5 frames"), "{short}");
    let early = reason(SETTINGS, &frames(&|frame, _| frame < impact - 8));
    assert!(early.contains("too few frames of the first disc after the impact"), "{early}");
    let late = reason(SETTINGS, &frames(&|frame, ball| frame > impact - 3 || ball.starts_with('a')));
    assert!(late.contains("too few frames of the second disc before the impact: "), "{late}");
    let away = reason(SETTINGS, &frames(&|frame, _| frame > impact + 5));
    assert!(away.contains("before the impact") || away.contains("no collision"), "{away}");
    let larger = reason(&SETTINGS.replace("radius_m = 0.020", "radius_m = 0.025"), &table);
    assert!(larger.contains("mm apart at the impact, not 55.00 mm"), "{larger}");
    let wandering = |row: &str| {
        let [shot, frame, point, x, y] = row.split(',').collect::<Vec<_>>()[..] else { panic!("{row}") };
        let by =
            if point.starts_with('b') { 5e-3 * frame.parse::<f64>().unwrap_or_default().sin() } else { 0.0 };
        let x = x.parse::<f64>().map_or(x.to_owned(), |x| (x + by).to_string());
        format!("{shot},{frame},{point},{x},{y}")
    };
    let wanders = reason(SETTINGS, &table.lines().map(wandering).collect::<Vec<_>>().join("\n"));
    assert!(wanders.contains("its motion fits no single collision"), "{wanders}");
}

fn of_shipped(name: &str) -> (Dataset, DiscImpact) {
    let (dataset, mut extracted) = with_discs(shipped(name));
    assert_eq!((extracted.len(), dataset.left_out.len()), (1, 0));
    (dataset, extracted.remove(0).1)
}

/// Against an independent calculation (centres by superposition of the markers, lines by least squares with
/// another program, windows of 8 to 16 frames either side): what differs comes of the window.
#[test]
fn the_qualisys_pucks() {
    let (_, impact) = of_shipped("pucks-qualisys");
    let value = |quantity: &str| impact.get(quantity).unwrap().value;
    for (quantity, expected, window) in [
        ("e", 0.718, 0.006),
        ("impulse_ratio", -0.192, 0.003),
        ("contact_distance_mm", 49.97, 0.02),
        ("impact_time_s", 719.47 / 500.0, 0.1 / 500.0),
        // one standard error of this estimate
        ("cue_wz_after", 10.36, 0.08),
        // 0.1 by hand and 0.05 of ours: two standard errors of the difference
        ("obj_wz_after", 10.45, 0.22),
    ] {
        let off = (value(quantity) - expected).abs();
        assert!(off < window, "{quantity:?}: {} is {off} off {expected}", value(quantity));
    }
    // friction along the band is against the slip, and throws it back
    assert!(value("slip") > 0.5 && value("slip_after") < -0.2);
    // the masses are known, but not which puck is which
    let ratio = value("mass_ratio");
    assert!((0.97..1.03).contains(&ratio), "{ratio}");
    // all of the tangential impulse is in the spins
    let spins = value("impulse_ratio_by_cue_spin") + value("impulse_ratio_by_obj_spin");
    assert!((0.5 * spins - value("impulse_ratio")).abs() < 0.005);
}

#[test]
fn the_opencv_disks() {
    let (dataset, impact) = of_shipped("pucks-opencv");
    let value = |quantity: &str| impact.get(quantity).unwrap().value;
    // the same independent calculation; errors of 0.01 each, and windows that differ
    assert!((value("e") - 0.931).abs() < 0.02, "{}", value("e"));
    assert!(value("impulse_ratio").abs() < 0.05, "{}", value("impulse_ratio"));
    assert!((value("impact_time_s") - 145.43).abs() < 0.1 && impact.outliers() >= 1);
    assert!(dataset.tracks.unwrap().discs.unwrap().masses.is_none());
}

/// 23 shots whose markers are numbered anew in every file, against an independent calculation (numpy): e and J_t/J_n by parabolas through 24
/// frames either side, extrapolated to where they cross. Straight lines through 8 and 16 frames give an e lower by 0.01 and 0.02 on average, since
/// the pucks slow down.
#[test]
fn the_pucks_of_chalmers_2023() {
    /// Root mean square by which parabolas through 16 and 32 frames differ in e, and 0.6 of the J_t/J_n that they leave open.
    const SCATTER: [f64; 2] = [0.015, 0.01];
    /// Standard deviations of which one of 46 numbers is further off once in eight times, were the scatter that large.
    const FAR: f64 = 3.0;
    let (dataset, extracted) = with_discs(shipped("pucks-chalmers-2023"));
    assert_eq!((extracted.len(), dataset.left_out.len()), (23, 0));
    let mut squares = [0.0; 2];
    for row in include_str!("reference/pucks-chalmers-2023.csv").lines().skip(1) {
        let [shot, e, ratio] = row.split(',').collect::<Vec<_>>()[..] else { panic!("{row}") };
        let [e, ratio] = [e, ratio].map(|number| number.parse::<f64>().unwrap());
        let name = format!("Measurement{shot}");
        let (_, impact) = extracted.iter().find(|(track, _)| track.name == name).unwrap();
        let value = |quantity: &str| impact.get(quantity).unwrap().value;
        let off = [("e", e), ("impulse_ratio", ratio)]
            .map(|(quantity, expected)| (value(quantity) - expected).abs());
        for i in 0..2 {
            assert!(off[i] < FAR * SCATTER[i], "{shot}: {off:?}");
            squares[i] += off[i] * off[i] / 23.0;
        }
        // the second puck is at rest, the first is pushed
        assert!(value("slip").is_finite() && value("contact_distance_mm") > 49.5, "{shot}");
    }
    assert!((0..2).all(|i| squares[i].sqrt() < SCATTER[i]), "{squares:?}");
}
