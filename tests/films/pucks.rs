//! Films of pucks that meet, made by formulas written apart from the crate's.

use std::f64::consts::TAU;
use std::fmt::Write as _;

use crate::prelude::*;

pub const E: f64 = 0.8;
pub const RADII: [f64; 2] = [0.030, 0.020];
pub const MASSES: [f64; 2] = [0.050, 0.030];
pub const FPS: f64 = 500.0;
/// Standard deviation of a coordinate of a marker, m.
const NOISE: f64 = 1e-4;

pub const SETTINGS: &str = "name = \"pucks\"\nkind = \"tracks\"\nfiles = [\"pucks.csv\"]\n\
    [ball]\nshape = \"disc\"\nradius_m = 0.030\nmass_kg = 0.050\n[object]\nradius_m = 0.020\nmass_kg = 0.030\n\
    [video]\ncapture_fps = 500\n\
    [tracks]\ncue = [\"a0\", \"a1\", \"a2\"]\nobject = [\"b0\", \"b1\", \"b2\"]\n";

pub fn load(settings: &str, table: &str) -> Result<Dataset, String> {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("dataset.toml"), settings).unwrap();
    fs::write(folder.path().join("pucks.csv"), table).unwrap();
    io::load(folder.path()).map_err(|error| error.to_string())
}

/// An impact before its law is asked: slip and closing speed in m/s, and a number that chance draws between -0.2 and 0.2.
pub struct Contact {
    pub slip: f64,
    pub closing: f64,
    pub chance: f64,
}

/// e and the tangential impulse on the second disc over the normal one.
pub type Law<'a> = &'a mut dyn FnMut(&Contact) -> [f64; 2];

/// Table to film, m.
pub type Show = fn([f64; 2]) -> [f64; 2];

pub fn as_it_is(place: [f64; 2]) -> [f64; 2] {
    place
}

/// How pucks are played, what the camera does to a film, and what is followed in it.
#[derive(Clone, Copy)]
pub struct Filmed {
    pub shots: usize,
    /// Frames before and after the impact.
    pub frames: i32,
    /// Least and largest speed across the line of centres, m/s, and largest spin, rad/s.
    pub across: [f64; 2],
    pub spin: f64,
    /// How far from the middle of the table they meet, m.
    pub spread: f64,
    pub show: Show,
    /// By how much later what is a metre further along x and y is read, s/m.
    pub shutter: [f64; 2],
    /// Three points on the rim, or else the centre alone.
    pub rim: bool,
    /// What slows the discs down evenly, m/s².
    pub slowing: f64,
    /// The part of positions that are off by 2 cm.
    pub wrong: f64,
}

/// All over the table.
pub const FILMED: Filmed = Filmed {
    shots: 20,
    frames: 80,
    across: [0.0, 0.6],
    spin: 4.0,
    spread: 0.3,
    show: as_it_is,
    shutter: [0.0; 2],
    rim: true,
    slowing: 0.0,
    wrong: 0.0,
};

/// Discs that slide on each other, in the middle of the table, with a wrong frame now and then.
pub const SLIDING: Filmed =
    Filmed { frames: 40, across: [0.5, 0.8], spin: 2.0, spread: 0.0, wrong: 0.003, ..FILMED };

/// A disc in free motion: place and velocity at the impact, angle and angular velocity.
#[derive(Clone, Copy, Debug)]
pub struct Motion {
    pub place: [f64; 2],
    pub velocity: [f64; 2],
    pub angle: f64,
    pub spin: f64,
}

/// Before and after, of both discs, and the truth about them.
pub struct Collision {
    pub time: f64,
    pub sides: [[Motion; 2]; 2],
    pub normal: [f64; 2],
    /// J_t/J_n.
    pub ratio: f64,
}

/// A vector by its components along the line of centres, which has this direction, and across it.
fn turned(direction: f64, [n, t]: [f64; 2]) -> [f64; 2] {
    let (sin, cos) = direction.sin_cos();
    [n * cos - t * sin, n * sin + t * cos]
}

/// Both discs before and after an impact with this e and J_t/J_n; they close with this speed.
fn part(before: [Motion; 2], direction: f64, closing: f64, [e, ratio]: [f64; 2]) -> [[Motion; 2]; 2] {
    let normal = (1.0 + e) * closing / (1.0 / MASSES[0] + 1.0 / MASSES[1]);
    let after = [0, 1].map(|disc| {
        let motion = before[disc];
        let gained = [-normal, normal][disc] / MASSES[disc];
        let [x, y] = turned(direction, [gained, ratio * gained]);
        let velocity = [motion.velocity[0] + x, motion.velocity[1] + y];
        Motion { velocity, spin: motion.spin - ratio * normal / (0.5 * MASSES[disc] * RADII[disc]), ..motion }
    });
    [before, after]
}

/// Two discs that part as the law says.
fn collision(rng: &mut ChaCha8Rng, filmed: &Filmed, law: Law) -> Collision {
    let direction = rng.random_range(0.0..TAU);
    let chance = rng.random_range(-0.2..0.2);
    let closing = rng.random_range(0.4..0.8);
    let own = turned(direction, [rng.random_range(-0.2..0.2), rng.random_range(-0.2..0.2)]);
    let part_of: f64 = rng.random_range(-1.0..1.0);
    let [least, most] = filmed.across;
    let across = part_of.signum() * least + part_of * (most - least);
    let towards = turned(direction, [-closing, across]);
    let place: [f64; 2] = [0; 2].map(|_| filmed.spread * rng.random_range(-1.0..1.0));
    let apart = turned(direction, [RADII[0] + RADII[1], 0.0]);
    let mut disc = |place: [f64; 2], velocity: [f64; 2]| Motion {
        place,
        velocity,
        angle: rng.random_range(0.0..TAU),
        spin: filmed.spin * rng.random_range(-1.0..1.0),
    };
    let first = disc(place, own);
    let second = disc([place[0] + apart[0], place[1] + apart[1]], [own[0] + towards[0], own[1] + towards[1]]);
    let slip = across - RADII[0] * first.spin - RADII[1] * second.spin;
    let [e, ratio] = law(&Contact { slip, closing, chance });
    let sides = part([first, second], direction, closing, [e, ratio]);
    let time = (f64::from(filmed.frames) + rng.random::<f64>()) / FPS;
    Collision { time, sides, normal: turned(direction, [1.0, 0.0]), ratio }
}

/// A standard normal deviate.
fn normal(rng: &mut ChaCha8Rng) -> f64 {
    let (u, v): (f64, f64) = (rng.random_range(1e-12..1.0), rng.random());
    (-2.0 * u.ln()).sqrt() * (TAU * v).cos()
}

/// The film as a table of frames, some of which are missing, and its collisions.
pub fn film(seed: u64, filmed: &Filmed, law: Law) -> (String, Vec<Collision>) {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut table = String::from("shot,frame,ball,x,y\n");
    let mut collisions = Vec::new();
    for shot in 0..filmed.shots {
        let collision = collision(&mut rng, filmed, law);
        let shown = |disc: usize, point: i32, t: f64| {
            let late = t - collision.time;
            let motion = collision.sides[usize::from(late >= 0.0)][disc];
            let (sin, cos) = (motion.angle + 2.0 * f64::from(point) + motion.spin * late).sin_cos();
            let arm = if filmed.rim { 0.9 * RADII[disc] } else { 0.0 };
            // faster before, slower after
            let speed = motion.velocity[0].hypot(motion.velocity[1]);
            let way = late - 0.5 * filmed.slowing * late * late / speed;
            let centre = [0, 1].map(|k| motion.place[k] + motion.velocity[k] * way);
            (filmed.show)([centre[0] + arm * cos, centre[1] + arm * sin])
        };
        for frame in 0..=2 * filmed.frames {
            let t = f64::from(frame) / FPS;
            for disc in 0..2 {
                for point in 0..if filmed.rim { 3 } else { 1 } {
                    let mut place = shown(disc, point, t);
                    for _ in 0..3 {
                        let late = filmed.shutter[0] * place[0] + filmed.shutter[1] * place[1];
                        place = shown(disc, point, t + late);
                    }
                    let [x, y] = place.map(|x| x + NOISE * normal(&mut rng));
                    let is_wrong = filmed.wrong > 0.0 && rng.random_bool(filmed.wrong);
                    let x = if is_wrong { x + 0.02 } else { x };
                    if rng.random::<f64>() > 0.02 {
                        let name = ["a", "b"][disc];
                        _ = writeln!(table, "{shot},{frame},{name}{point},{x:.7},{y:.7}");
                    }
                }
            }
        }
        collisions.push(collision);
    }
    (table, collisions)
}

/// A film whose discs part with e = [`E`] and a friction of the slip and the closing speed.
pub fn film_of(seed: u64, shots: usize, friction: fn(f64, f64) -> f64) -> (String, Vec<Collision>) {
    let filmed = Filmed { shots, ..SLIDING };
    film(seed, &filmed, &mut |contact| [E, friction(contact.slip, contact.closing)])
}
