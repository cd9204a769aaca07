//! Films with faults of the camera and of the tracker: the balls calibrate the camera. The faults are made here, by formulas written
//! apart from the crate's.

use caromfit::fit::FoundCamera;

use crate::frames::of_weighed_balls as dataset;
use crate::prelude::*;

pub(crate) const TRUTH: [f64; 3] = [0.05, 0.25, 0.94];

/// Standard errors by which a value may be off: one in 370 is by chance, and a few dozen are looked at.
pub(crate) const ERRORS: f64 = 3.5;

/// A camera with a fault costs the parameters at most this part of their errors (0.06 by the Cramér–Rao bound of all corrections).
const COST: f64 = 1.3;

fn clean(seed: u64) -> Vec<TrackShot> {
    with_truth(seed).into_iter().map(|(shot, _)| shot).collect()
}

pub(crate) fn with_truth(seed: u64) -> Vec<(TrackShot, TrueImpact)> {
    simulate::filmed(&rolls(seed)).unwrap()
}

/// 40 rolling balls of this truth.
pub(crate) fn rolls(seed: u64) -> Spec {
    let [mu, mu_s, e] = TRUTH;
    with(
        &spec("tracks", &["natural-roll"], 40, seed),
        &format!("truth = {{ mu = {mu}, mu_s = {mu_s}, e = {e} }}"),
    )
}

/// Every position as a camera shows it.
pub(crate) fn shown(mut shots: Vec<TrackShot>, show: impl Fn(f64, f64) -> [f64; 2]) -> Vec<TrackShot> {
    for sample in shots.iter_mut().flat_map(|shot| shot.cue.iter_mut().chain(&mut shot.object)) {
        [sample.x, sample.y] = show(sample.x, sample.y);
        sample.sd = None;
    }
    shots
}

/// Where a lens shows a place that draws lengths together by so much at 0.5 m from its axis.
fn stretched([x, y]: [f64; 2], axis: [f64; 2], by: f64) -> [f64; 2] {
    let (x, y) = (x - axis[0], y - axis[1]);
    let stretched = 1.0 - by * (x * x + y * y) / 0.25;
    [x * stretched, y * stretched]
}

/// What is a metre further along x and y is read `delays` seconds later: what stands in a frame is where the ball was so much later than
/// the frame says.
fn rolling_shutter(mut shots: Vec<TrackShot>, delays: [f64; 2]) -> Vec<TrackShot> {
    for sample in shots.iter_mut().flat_map(|shot| shot.cue.iter_mut().chain(&mut shot.object)) {
        sample.t -= delays[0] * sample.x + delays[1] * sample.y;
        sample.sd = None;
    }
    shots
}

/// A camera at a place so high above the table sees balls that hop farther away from its foot.
fn from_near(shots: Vec<(TrackShot, TrueImpact)>, [foot_x, foot_y, height]: [f64; 3]) -> Vec<TrackShot> {
    const BOUNCE: f64 = 0.5;
    let seen = |(mut shot, truth): (TrackShot, TrueImpact)| {
        let raised = |up: f64, samples: &mut Vec<Sample>| {
            for sample in samples {
                let (mut up, mut since) = (up, sample.t - truth.time);
                while since > 2.0 * up / 9.81 && up > 1e-3 {
                    since -= 2.0 * up / 9.81;
                    up *= BOUNCE;
                }
                let high = if since > 0.0 { (since * (up - 0.5 * 9.81 * since)).max(0.0) } else { 0.0 };
                let by = height / (height - high);
                sample.x = foot_x + by * (sample.x - foot_x);
                sample.y = foot_y + by * (sample.y - foot_y);
                sample.sd = None;
            }
        };
        raised(truth.cue_after.velocity.z, &mut shot.cue);
        raised(truth.object_after.velocity.z, &mut shot.object);
        shot
    };
    shots.into_iter().map(seen).collect()
}

/// Balls that hop are seen displaced: a camera that is stated as far above does no harm, or is not believed.
#[test]
fn the_height_of_the_camera_is_found_from_balls_that_hop() {
    let (reference, found) = fitted(dataset(clean(7105)));
    neutral(&found);
    let (fit, found) = fitted(dataset(from_near(with_truth(7105), [0.2, 1.3, 1.25])));
    is_recovered("near", &fit, &reference);
    let parallax = [0.2, 1.3].iter().zip(found.middle()).map(|(foot, middle)| (middle - foot) / 1.25);
    let which = [Correction::ParallaxX, Correction::ParallaxY, Correction::Nearness];
    for (which, truth) in which.into_iter().zip(parallax.chain([0.8])) {
        assert!(is_near(of(&found, which), truth, ERRORS), "{truth}: {:?}", of(&found, which));
    }
    // as a camera far above sees them
    let mut far = dataset(from_near(with_truth(7105), [0.2, 1.3, 1.25]));
    let stated = &mut far.tracks.as_mut().unwrap().camera;
    for which in which {
        stated[which as usize] = Some(Measured { value: 0.0, sd: None });
    }
    let (fit, _) = fitted(far);
    assert!(is_right(&fit) || fit.verdict().grade == Grade::Doubtful, "{:?}", fit.estimates());
}

pub(crate) fn fitted(dataset: Dataset) -> (Fit, FoundCamera) {
    let fit = options::fitted(&dataset, Depth::Estimates);
    assert_eq!(fit.method_name(), "joint");
    let found = fit.camera().cloned().unwrap();
    (fit, found)
}

/// Whether the parameters are those of the film.
pub(crate) fn is_right(fit: &Fit) -> bool {
    Parameter::COEFFICIENTS.into_iter().zip(TRUTH).all(|(parameter, truth)| {
        let estimate = fit.estimates()[parameter as usize];
        estimate.std_error.is_some_and(|error| (estimate.value - truth).abs() < ERRORS * error)
    })
}

/// The parameters are those of the film, and errors no larger than a camera costs.
pub(crate) fn is_recovered(name: &str, fit: &Fit, clean: &Fit) {
    for (parameter, truth) in Parameter::COEFFICIENTS.into_iter().zip(TRUTH) {
        let estimate = fit.estimates()[parameter as usize];
        let error = estimate.std_error.unwrap_or_else(|| panic!("{name}: {parameter:?} has no error"));
        assert!((estimate.value - truth).abs() < ERRORS * error, "{name}: {estimate:?}");
        let usual = clean.estimates()[parameter as usize].std_error.unwrap();
        // a decentring leaves outcomes that differ by 1.4 times their noise, which the errors include
        let cost = if name == "lens off the middle" { 1.4 * COST } else { COST };
        assert!(error < cost * usual, "{name}: {parameter:?} {error} {usual}");
    }
    assert_eq!(fit.shots_used(), 40, "{name}: {:?}", fit.shots_rejected());
}

/// A camera without faults is found to be one; the number of corrections that were free.
pub(crate) fn neutral(camera: &FoundCamera) -> usize {
    let free = Correction::ALL.into_iter().filter_map(|which| Some((which, camera.found(which)?)));
    free.inspect(|(which, found)| assert!(is_near(*found, which.neutral(), ERRORS), "{which:?} {found:?}"))
        .count()
}

fn is_near(found: Measured, truth: f64, errors: f64) -> bool {
    (found.value - truth).abs() < errors * found.sd.unwrap()
}

fn of(found: &FoundCamera, which: Correction) -> Measured {
    found.found(which).unwrap()
}

/// Moves the cue ball and the object ball of a frame as a tracker does.
type Fault<'a> = &'a dyn Fn(&mut Sample, &mut Sample);

/// Each is four times as large as its prior says, so that it is named.
#[test]
fn what_a_tracker_does_is_found_and_takes_nothing_from_the_parameters() {
    const FPS: f64 = 1000.0;
    let apart = |cue: &mut Sample, object: &mut Sample| {
        let (dx, dy) = (object.x - cue.x, object.y - cue.y);
        let distance = dx.hypot(dy);
        let by = 4e-4 * (-2.0 * (distance / (2.0 * Ball::POOL.radius) - 1.0)).exp() / distance;
        (cue.x, cue.y) = (cue.x - by * dx, cue.y - by * dy);
        (object.x, object.y) = (object.x + by * dx, object.y + by * dy);
    };
    // about the middle of where the shots are played
    let shrink = |x: f64| 0.65 + 0.996 * (x - 0.65);
    let faults: [(Correction, f64, Fault); 5] = [
        (Correction::Late, 0.2, &|_, object| object.t += 0.2 / FPS),
        (Correction::Push, 4e-4, &apart),
        (Correction::AsideX, 8e-4, &|_, object| object.x += 8e-4),
        (Correction::AsideY, -8e-4, &|_, object| object.y -= 8e-4),
        (Correction::ObjectScale, 0.996, &|_, object| {
            (object.x, object.y) = (shrink(object.x), shrink(object.y));
        }),
    ];
    for (which, truth, fault) in faults {
        let mut film = clean(7110);
        for shot in &mut film {
            for (cue, object) in shot.cue.iter_mut().zip(&mut shot.object) {
                if cue.t == object.t {
                    fault(cue, object);
                }
            }
        }
        let (fit, found) = fitted(dataset(film));
        assert!(is_near(of(&found, which), truth, ERRORS), "{which:?}: {:?}", of(&found, which));
        assert!(is_right(&fit), "{which:?}: {:?}", fit.estimates());
        assert_eq!(fit.verdict().grade, Grade::Doubtful, "{which:?}");
    }
}

#[test]
fn the_balls_calibrate_the_camera() {
    let seeds = count("CAROMFIT_SETS", 1) as u64;
    for seed in 0..seeds {
        let films = || clean(7100 + seed);
        let (reference, found) = fitted(dataset(films()));
        is_recovered("clean", &reference, &reference);
        neutral(&found);
        let faults: [(&str, Vec<TrackShot>, Correction, f64); 9] = [
            ("scale", shown(films(), |x, y| [1.02 * x, 1.02 * y]), Correction::Scale, 1.02),
            ("aspect", shown(films(), |x, y| [x, 0.98 * y]), Correction::Aspect, 0.98),
            ("shear", shown(films(), |x, y| [x + 0.03 * y, y]), Correction::Shear, 0.03),
            (
                "perspective",
                shown(films(), |x, y| [x / (1.0 + 0.05 * x), y / (1.0 + 0.05 * x)]),
                Correction::PerspectiveX,
                0.05,
            ),
            (
                "lens",
                // about the middle of where the shots are played
                shown(films(), |x, y| stretched([x, y], [0.65, 0.65], 0.02)),
                Correction::Lens,
                -0.02,
            ),
            ("shutter", rolling_shutter(films(), [0.0, 0.003]), Correction::ShutterY, 0.003),
            (
                "lens off the middle",
                shown(films(), |x, y| stretched([x, y], [0.5, 0.9], 0.03)),
                // counted in the lengths at the middle of the film, 0.29 m from the axis: 2 % shorter
                Correction::Lens,
                -0.03 / 0.98_f64.powi(3),
            ),
            ("held upright", rolling_shutter(films(), [-0.004, 0.0]), Correction::ShutterX, -0.004),
            ("turned", rolling_shutter(films(), [0.002, 0.003]), Correction::ShutterX, 0.002),
        ];
        for (name, film, which, truth) in faults {
            let (fit, found) = fitted(dataset(film));
            is_recovered(name, &fit, &reference);
            let correction = of(&found, which);
            // the middle of the film, where lens and perspective are counted from, is found to some centimetres
            let off = (correction.value - truth).abs();
            assert!(
                off < (ERRORS * correction.sd.unwrap()).max(0.05 * truth.abs()),
                "{name}: {correction:?}"
            );
        }
    }
}

/// Films of a camera that sees as the specification says, and which states no noise.
fn filmed(seed: u64, camera: &str) -> Vec<TrackShot> {
    let spec = with(&rolls(seed), camera);
    shown(simulate::filmed(&spec).unwrap().into_iter().map(|(shot, _)| shot).collect(), |x, y| [x, y])
}

/// A film whose every length is a little smaller has less noise: were that taken for a better fit, noise of 1 mm would make the scale 1 %
/// too large, ten of its errors, and e four of its own too small.
#[test]
fn rough_noise_does_not_shrink_the_film() {
    for seed in 7200..7200 + count("CAROMFIT_SETS", 2) as u64 {
        let (fit, found) = fitted(dataset(filmed(seed, "camera.position_sd_m = 1e-3")));
        is_recovered("rough", &fit, &fit);
        let scale = of(&found, Correction::Scale);
        assert!(is_near(scale, 1.0, ERRORS), "{scale:?}");
    }
}

/// Between frames 20 ms apart a ball that slides bends its path by some millimetres: straight lines would see the contacts at another
/// distance, and take that for another unit of length.
#[test]
fn paths_bend_between_slow_frames() {
    for position_sd_m in [1e-4, 5e-4] {
        let camera = format!(
            "camera = {{ fps = 50, position_sd_m = {position_sd_m}, before_ms = 100, after_ms = 400 }}"
        );
        let (fit, found) = fitted(dataset(filmed(7300, &camera)));
        is_recovered("slow", &fit, &fit);
        assert!(found.converged() && found.unit() == 1.0, "{found:?}");
        assert!(!fit.is_refuted());
    }
}

/// A phone on a tripod: 1.6 m above the table, tilted by 20°, pixels, y downwards, and no ruler.
pub(crate) fn by_phone(film: Vec<TrackShot>) -> Dataset {
    by_tilted_phone(film, 0.35)
}

fn by_tilted_phone(film: Vec<TrackShot>, tilt: f64) -> Dataset {
    let (height, focal) = (1.6, 1500.0);
    let (sin, cos) = tilt.sin_cos();
    without_ruler(shown(film, |x, y| {
        let y = y + height * tilt.tan();
        let depth = y * sin + height * cos;
        [960.0 + focal * x / depth, 540.0 + focal * (y * cos - height * sin) / depth]
    }))
}

/// A film whose unit of length nothing states.
fn without_ruler(film: Vec<TrackShot>) -> Dataset {
    let mut film = dataset(film);
    let tracks = film.tracks.as_mut().unwrap();
    (tracks.from_balls, tracks.scale_sd) = (true, None);
    film
}

/// Positions of a film as they are seen, changed.
fn seen(mut film: Dataset, change: impl Fn(&mut Sample)) -> Dataset {
    let shots = &mut film.tracks.as_mut().unwrap().shots;
    shots.iter_mut().flat_map(|shot| shot.cue.iter_mut().chain(&mut shot.object)).for_each(change);
    film
}

/// Pixels of a tilted phone, also with a shutter that reads rows of the picture and with a lens that distorts it; and positions that
/// detectors state in parts of the width and the height of the picture.
#[test]
fn the_balls_are_the_ruler_of_any_picture() {
    let (reference, _) = fitted(dataset(clean(7200)));
    let recovered = |name: &str, film: Dataset, clean: &Fit| {
        let (fit, found) = fitted(film);
        is_recovered(name, &fit, clean);
        (fit, found)
    };
    let (plain, found) = recovered("phone", by_phone(clean(7200)), &reference);
    of(&found, Correction::PerspectiveY);
    // 1500 px over the 1.7 m to the middle of the picture
    let scale = of(&found, Correction::Scale).value / found.unit();
    assert!((700.0..1000.0).contains(&scale), "{scale}");
    // about 1000 rows to the metre, of which the first are the farthest from the camera
    let by_rows = seen(by_phone(clean(7200)), |sample| sample.t += 1e-5 * sample.y);
    let (_, found) = recovered("shutter", by_rows, &plain);
    let shutter = of(&found, Correction::ShutterY);
    assert!(!is_near(shutter, 0.0, 10.0), "{shutter:?}");
    let by_lens = seen(by_phone(clean(7200)), |sample| {
        // about the middle of the picture, 540 px from its lower edge
        let (x, y) = (sample.x - 960.0, sample.y - 540.0);
        let stretched = 1.0 - 0.1 * (x * x + y * y) / (1500.0 * 1500.0);
        (sample.x, sample.y) = (960.0 + x * stretched, 540.0 + y * stretched);
    });
    let (_, found) = recovered("lens", by_lens, &plain);
    let lens = of(&found, Correction::Lens);
    assert!(lens.value < 0.0 && !is_near(lens, 0.0, 10.0), "{lens:?}");
    let parts = without_ruler(shown(clean(7200), |x, y| [x / 1.92, y / 1.08]));
    let (_, found) = recovered("parts", parts, &reference);
    let aspect = of(&found, Correction::Aspect);
    assert!(found.converged() && is_near(aspect, 1.92 / 1.08, ERRORS), "{aspect:?}");
}

/// What is usual of a camera must not hold back the start of the search where few contacts speak against it.
#[test]
fn six_shots_calibrate_a_phone() {
    for seed in 0..count("CAROMFIT_SETS", 3) as u64 {
        let six = clean(7300 + seed).split_off(34);
        for tilt in [0.35, -0.35, 0.6] {
            let (fit, found) = fitted(by_tilted_phone(six.clone(), tilt));
            assert!(found.converged() && fit.shots_used() == 6, "{seed} {tilt}: {:?}", fit.shots_rejected());
            assert!(!fit.is_refuted(), "{seed} {tilt}: {}", fit.verdict().sentence);
            assert!(is_right(&fit), "{seed} {tilt}: {:?}", fit.estimates());
        }
    }
}

/// Intervals hold the truth where the balls calibrate the camera: of films that need it and of films that do not.
#[test]
fn intervals_hold_with_the_camera_free() {
    let sets = count("CAROMFIT_SETS", 4) as u64;
    let of_clean = |seed: u64| dataset(shown(clean(seed), |x, y| [x, y]));
    let of_phone = |seed: u64| by_phone(clean(seed));
    let rough = "camera = { fps = 240, position_sd_m = 5e-4, before_ms = 120, after_ms = 120 }";
    let of_rough = |seed: u64| dataset(filmed(seed, rough));
    let kinds: [(&str, &(dyn Fn(u64) -> Dataset + Sync)); 3] =
        [("clean", &of_clean), ("by a phone", &of_phone), ("240 fps, 0.5 mm", &of_rough)];
    for (what, film) in kinds {
        let one = |seed: u64| options::fitted(&film(8000 + seed), Depth::Intervals);
        let fits: Vec<Fit> = (0..sets).into_par_iter().map(one).collect();
        for (parameter, truth) in Parameter::COEFFICIENTS.into_iter().zip(TRUTH) {
            let pulls = Pulls::of(&fits, parameter, truth);
            assert!(pulls.all.len() as f64 >= 0.99 * sets as f64, "{what}: {}", pulls.all.len());
            pulls.check(&format!("{what}: {}", parameter.name()), [0.93, 0.97]);
        }
    }
}

/// Frames that the camera dropped without a sign.
#[test]
fn dropped_frames_are_found() {
    let mut film = clean(7400);
    for (i, shot) in film.iter_mut().enumerate().filter(|(i, _)| i % 4 == 0) {
        let at = 15 + i / 4;
        for samples in [&mut shot.cue, &mut shot.object] {
            samples.remove(at);
            for sample in &mut samples[at..] {
                sample.t -= 1.0 / shot.fps;
            }
        }
    }
    let (fit, _) = fitted(dataset(film));
    assert_eq!(part(&fit, "/film/dropped_frames"), json!({"shots": 10, "drops": 10}));
    let (reference, _) = fitted(dataset(clean(7400)));
    is_recovered("drops", &fit, &reference);
}
