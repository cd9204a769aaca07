//! What goes wrong between the table and the table of positions.

use std::fmt::Write as _;

use crate::prelude::*;

/// Paths are known at so many instants a frame, straight lines between them.
const INSTANTS: usize = 8;

/// The centroid of a blurred ball is the mean of so many instants of the exposure.
const EXPOSURE: usize = 5;

/// What is wrong with a film, each magnitude 0 where it is right.
#[derive(Debug, Default)]
pub struct Faults {
    pub scale: f64,
    pub aspect: f64,
    pub shear: f64,
    pub keystone: f64,
    pub barrel: f64,
    /// Tilt of a camera above the table, rad; positions are then pixels.
    pub tilt: f64,
    /// Calibrated by four points instead of one length.
    pub points: bool,
    /// Seconds a metre.
    pub shutter: f64,
    /// Of an exposure, frames.
    pub blur: f64,
    /// Of instants, frames.
    pub jitter: f64,
    /// Parts of the frames.
    pub dropped: f64,
    pub doubled: f64,
    pub missing: f64,
    pub wrong: f64,
    /// So many frames on end show the same.
    pub frozen: usize,
    /// Correlation of noise from frame to frame.
    pub lasting: f64,
    pub noise: f64,
    /// Steps of positions, m.
    pub grid: f64,
    /// Tracks exchange their names from this part of the film on.
    pub swapped: f64,
    /// How far a highlight walks over the object ball.
    pub shade: f64,
    /// The cue ball, or the object ball, is lost from this part of the film on, or until then.
    pub lost: (bool, bool, f64),
    /// A ball at rest is stored as two samples.
    pub sparse: bool,
    pub radius: f64,
    /// What capture_fps is wrong by, as a factor less 1.
    pub rate: f64,
    pub decimals: usize,
}

/// Draws magnitudes of faults.
struct Draw<'a> {
    random: &'a mut ChaCha8Rng,
    /// Part of the faults that a film has.
    often: f64,
}

impl Draw<'_> {
    /// Mostly none, else evenly in its logarithm.
    fn any(&mut self, low: f64, high: f64) -> f64 {
        let size = self.random.random_range(low.ln()..high.ln()).exp();
        if self.random.random_bool(self.often) { size } else { 0.0 }
    }

    /// The same, of either sign; a factor less 1, so never below −0.9.
    fn either(&mut self, low: f64, high: f64) -> f64 {
        let sign = if self.random.random_bool(0.5) { 1.0 } else { -1.0 };
        (sign * self.any(low, high)).max(-0.9)
    }

    fn coin(&mut self) -> bool {
        self.random.random_bool(0.5)
    }
}

impl Faults {
    /// Any of them, each with a magnitude from hardly visible to absurd.
    pub fn draw(random: &mut ChaCha8Rng) -> Self {
        // from none to nearly all at once, mostly few
        let often = 0.8 * random.random::<f64>().powi(3);
        let mut draw = Draw { random, often };
        Self {
            scale: draw.either(1e-3, 1.0),
            aspect: draw.either(1e-3, 0.5),
            shear: draw.either(1e-3, 0.5),
            keystone: draw.either(1e-3, 0.5),
            barrel: draw.either(1e-3, 0.5),
            tilt: draw.any(0.01, 1.2),
            points: draw.coin(),
            shutter: draw.either(1e-4, 0.03),
            blur: draw.any(0.1, 3.0),
            jitter: draw.any(0.01, 0.5),
            dropped: draw.any(0.003, 0.3),
            doubled: draw.any(0.003, 0.3),
            missing: draw.any(0.003, 0.7),
            wrong: draw.any(0.003, 0.3),
            frozen: draw.any(1.0, 40.0) as usize,
            lasting: draw.any(0.3, 0.99),
            noise: draw.any(1e-6, 1e-2),
            grid: draw.any(1e-4, 1e-2),
            swapped: draw.any(0.3, 0.9),
            shade: draw.any(1e-3, 0.1),
            lost: (draw.coin(), draw.coin(), draw.any(0.05, 0.95)),
            sparse: draw.any(1.0, 2.0) > 0.0,
            radius: draw.either(1e-3, 1.0),
            rate: draw.either(1e-3, 10.0),
            decimals: if draw.coin() { 7 } else { 4 },
        }
    }
}

/// Where a path is at a time, from many samples.
fn at(path: &[Sample], t: f64) -> [f64; 2] {
    let i = path.partition_point(|s| s.t < t).clamp(1, path.len() - 1);
    let (a, b) = (path[i - 1], path[i]);
    let part = (t - a.t) / (b.t - a.t);
    [a.x + (b.x - a.x) * part, a.y + (b.y - a.y) * part]
}

/// A camera 1.6 m above the table that looks at it from the side: pixels, y down.
fn pinhole([x, y]: [f64; 2], tilt: f64) -> [f64; 2] {
    const HEIGHT: f64 = 1.6;
    const FOCUS: f64 = 1500.0;
    let (sin, cos) = tilt.sin_cos();
    let y = y + HEIGHT * tilt.tan();
    let depth = y * sin + HEIGHT * cos;
    [960.0 + FOCUS * x / depth, 540.0 - FOCUS * (y * cos - HEIGHT * sin) / depth]
}

/// Rows of one shot as they are written down.
fn rows(shot: &TrackShot, fps: f64, faults: &Faults, random: &mut ChaCha8Rng, table: &mut String) {
    let normal = |random: &mut ChaCha8Rng| {
        let (radius, angle) = (random.random_range(f64::EPSILON..1.0_f64), random.random::<f64>());
        (-2.0 * radius.ln()).sqrt() * (std::f64::consts::TAU * angle).cos()
    };
    let frames = shot.cue.len() / INSTANTS;
    let mut late = 0.0;
    let mut times: Vec<f64> = Vec::with_capacity(frames);
    for n in 0..frames {
        if random.random_bool(faults.dropped) {
            late += 1.0;
        }
        let t = (n as f64 + late + faults.jitter * normal(random)) / fps;
        let again = random.random_bool(faults.doubled);
        times.push(times.last().copied().filter(|_| again).unwrap_or(t));
    }
    if faults.frozen > 0 {
        let from = random.random_range(0..frames);
        let (still, until) = (times[from], frames.min(from + faults.frozen));
        times[from..until].fill(still);
    }
    for (ball, path) in [&shot.cue, &shot.object].into_iter().enumerate() {
        let mut error = [0.0; 2];
        let start = at(path, 0.0);
        let mut seen: Vec<Option<[f64; 2]>> = Vec::with_capacity(frames);
        for (n, time) in times.iter().enumerate() {
            let time = time + faults.shutter * at(path, *time)[1];
            let instants = (0..EXPOSURE).map(|k| time + faults.blur * k as f64 / (EXPOSURE as f64 * fps));
            let sum = instants.map(|t| at(path, t)).fold([0.0; 2], |sum, p| [sum[0] + p[0], sum[1] + p[1]]);
            let mut p = sum.map(|sum| sum / EXPOSURE as f64 * (1.0 + faults.scale));
            p[1] *= 1.0 + faults.aspect;
            let square = p[0] * p[0] + p[1] * p[1];
            p = p.map(|x| x * (1.0 + faults.barrel * square / 0.25) / (1.0 + faults.keystone * p[1]));
            p[0] += faults.shear * p[1];
            for (i, error) in error.iter_mut().enumerate() {
                *error = faults.lasting * *error + (1.0 - faults.lasting.powi(2)).sqrt() * normal(random);
                p[i] += faults.noise * *error;
                if ball == 1 {
                    p[i] += faults.shade * (p[i] - start[i]);
                }
            }
            if random.random_bool(faults.wrong) {
                p = p.map(|x| x + random.random_range(-0.05..0.05));
            }
            let mut grid = faults.grid;
            if faults.tilt > 0.0 {
                p = pinhole(p, faults.tilt);
                grid *= 1000.0;
            }
            if grid > 0.0 {
                p = p.map(|x| (x / grid).round() * grid);
            }
            let (cue, after, part) = faults.lost;
            let is_lost = part > 0.0 && cue == (ball == 0) && after == (n as f64 > part * frames as f64);
            seen.push(Some(p).filter(|_| !is_lost && !random.random_bool(faults.missing)));
        }
        if faults.sparse {
            let moves = seen.iter().position(|p| *p != seen[0]).unwrap_or(frames);
            (1..moves.saturating_sub(1)).for_each(|n| seen[n] = None);
        }
        for (n, position) in seen.iter().enumerate() {
            let Some([x, y]) = position else { continue };
            let swapped = faults.swapped > 0.0 && n as f64 > faults.swapped * frames as f64;
            let name = if (ball == 0) == swapped { "object" } else { "cue" };
            let d = faults.decimals;
            _ = writeln!(table, "{},{n},{name},{x:.d$},{y:.d$}", shot.name);
        }
    }
}

/// dataset.toml of a film of balls with this spin, or of discs.
pub fn manifest(fps: f64, faults: &Faults, spin: Option<&str>, more: &str) -> String {
    let radius = 0.028_575 * (1.0 + faults.radius);
    let (shape, spin) = match spin {
        Some(spin) => ("", format!("[cue_spin]\nassume = \"{spin}\"\n")),
        None => ("shape = \"disc\"\n", String::new()),
    };
    let mut scale = String::from("length_unit = \"m\"\n");
    if faults.tilt > 0.0 {
        scale = String::from("length_unit = \"px\"\ny_axis = \"down\"\n");
        if faults.points {
            for [x, y] in [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]] {
                let [u, v] = pinhole([x, y], faults.tilt);
                _ = write!(scale, "[[scale.point]]\npx = [{u:?}, {v:?}]\nm = [{x:?}, {y:?}]\n");
            }
        } else {
            scale += "m_per_px = 0.001067\n";
        }
    }
    format!(
        "name = \"film\"\nkind = \"tracks\"\nfiles = [\"tracks.csv\"]\n[ball]\n{shape}radius_m = {radius}\n{spin}[video]\n\
         capture_fps = {}\n[scale]\n{scale}[tracks]\ncue = \"cue\"\nobject = \"object\"\n{more}",
        fps * (1.0 + faults.rate)
    )
}

/// The table of a film of these shots at a frame rate.
pub fn table(spec: &Spec, fps: f64, faults: &Faults, random: &mut ChaCha8Rng) -> String {
    let exact = with(spec, &format!("camera = {{ fps = {}, position_sd_m = 0 }}", fps * INSTANTS as f64));
    let mut table = String::from("shot,frame,ball,x,y\n");
    for (shot, _) in simulate::filmed(&exact).unwrap() {
        rows(&shot, fps, faults, random, &mut table);
    }
    table
}
