//! Where both balls should be in every frame, through the instant of impact.

use nalgebra::{DMatrix, DVector, SVector};
use num_dual::{Dual64, DualSVec64};

use super::grid;
use crate::measurement::spin::Spin;
use crate::measurement::track::{Sample, TrackShot, TrackedBall};
use crate::physics::ball::{Ball, BallState, Vec3};
use crate::physics::cloth_motion::{Cloth, Launch, Number, Path};

/// The unknowns of a shot. Velocities are in the collision frame, m/s.
pub(crate) mod unknown {
    /// Instant of impact, s.
    pub const TIME: usize = 0;
    /// Where the object ball lies before it, m.
    pub const OBJECT: usize = 1;
    /// Direction of the line of centres in the table frame, rad.
    pub const DIRECTION: usize = 3;
    /// Cue ball's velocity at the impact.
    pub const BEFORE: usize = 4;
    /// And just after it.
    pub const CUE: usize = 6;
    /// Object ball's velocity just after it.
    pub const BALL: usize = 8;
    /// Vertical friction impulse |J_z|, which lifts the cue ball (topspin) or the object ball (draw). Where the spin is
    /// unknown, in parts of the vertical part of the closing speed, μ(1 + e)/2 of it, so that it turns round smoothly
    /// with the spin.
    pub const LIFT: usize = 10;
    /// μ_k of the cloth.
    pub const SLIDING: usize = 11;
    /// Distance of the centres at the impact over 2R, less 1.
    pub const GAP: usize = 12;
    /// Where the spin is unknown: topspin of the cue ball before the impact over the natural roll's. 0 for stun,
    /// negative for draw.
    pub const ROLL: usize = 13;
    /// μ_r of the cloth, which a single shot is given: all shots together tell it.
    pub const ROLLING: usize = 14;
    pub const COUNT: usize = 15;
}
use unknown::{BALL, BEFORE, COUNT, CUE, DIRECTION, GAP, LIFT, OBJECT, ROLL, ROLLING, SLIDING, TIME};

/// The unknowns of a shot whose spin is known, and of one whose is not.
const KNOWN: usize = ROLL;
const UNKNOWN: usize = ROLLING;

/// An unknown spin, over the natural roll's: no spin, give or take as much as rolling.
pub(crate) const ROLL_PRIOR: (f64, f64) = (0.0, 1.0);

/// All unknowns of a shot.
pub(crate) type Unknowns = SVector<f64, COUNT>;

/// A number with its derivatives by the unknowns.
pub(crate) type Dual = DualSVec64<COUNT>;

/// The motion with its derivatives by the first N unknowns.
pub(crate) fn with_derivatives<const N: usize>(scene: &Scene, z: &Unknowns) -> Motion<DualSVec64<N>> {
    let dual = |i: usize| {
        let plain = DualSVec64::from_re(z[i]);
        if i < N { plain.derivative(i) } else { plain }
    };
    Motion::new(scene, &std::array::from_fn(dual))
}

/// What is known of a shot besides its unknowns.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Scene {
    /// The cue ball and the object ball.
    pub ball: Ball,
    pub object: Ball,
    pub spin: Spin,
    pub bounce: f64,
    /// A cue ball that slips less than this on the cloth (m/s) rolls, for all that its measured spin says.
    pub rolls_within: f64,
    /// Standard deviation of side spin that nobody saw, of a shot that is stated as stun or natural roll: of Rω_z/U. 0 where there is
    /// none.
    pub side_sd: f64,
    /// In what the shot differs from what is stated.
    pub departure: Departure,
}

/// In what a shot may differ from what its data set states, to find out what explains its residuals.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Departure {
    /// Gravity in the film's units of length and time, over g: (stated frame rate / true one)².
    pub gravity: f64,
    /// Topspin besides that of a stun or natural-roll shot, over the natural roll's.
    pub topspin: f64,
    /// Acceleration of a body that slides without friction down the table, table frame, m/s².
    pub tilt: [f64; 2],
}

impl Departure {
    pub(crate) const NONE: Self = Self { gravity: 1.0, topspin: 0.0, tilt: [0.0; 2] };
}

/// Standard deviations of a measured spin within which a ball that rolls may seem to slip.
const ROLLS_ERRORS: f64 = 4.0;

/// And the part of its speed, for spins that were rounded.
const ROLLS_PART: f64 = 0.01;

/// Which way the friction on the object ball points vertically.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Lift {
    None,
    /// Topspin lifts the cue ball.
    Cue,
    /// Draw lifts the object ball.
    Object,
}

impl Scene {
    pub(crate) fn of(spin: Spin, scene: &super::scene::Scene) -> Self {
        let bounce = scene.cloth.bounce;
        let sd = match spin {
            Spin::Measured { sd: [x, y, _], .. } => x.unwrap_or(0.0).max(y.unwrap_or(0.0)),
            _ => 0.0,
        };
        let rolls_within = ROLLS_ERRORS * sd * scene.ball.radius;
        let side_sd = if matches!(spin, Spin::Stun | Spin::NaturalRoll) { scene.side_sd } else { 0.0 };
        let super::scene::Scene { ball, object, .. } = *scene;
        Self { ball, object, spin, bounce, rolls_within, side_sd, departure: Departure::NONE }
    }

    /// How far apart the centres of the balls are on the table where they touch: 2√(R_c R_o).
    pub(crate) fn contact_distance(&self) -> f64 {
        self.ball.contact_distance(&self.object)
    }

    /// Spin in the collision frame; `unknown` is its part of the natural roll where it is unknown, and Rω_z/U where the side
    /// spin is.
    pub(crate) fn spin<T: Number>(&self, direction: [T; 2], before: [T; 2], unknown: T) -> [T; 3] {
        let zero = T::from(0.0);
        let rolling = [-before[1] / self.ball.radius, before[0] / self.ball.radius, zero];
        let [x, y, z] = match self.spin {
            Spin::Stun => rolling.map(|spin| spin * self.departure.topspin),
            Spin::NaturalRoll => rolling.map(|spin| spin * (1.0 + self.departure.topspin)),
            Spin::Unknown => rolling.map(|spin| spin * unknown),
            Spin::Measured { spin, .. } => {
                let [cos, sin] = direction;
                [cos * spin.x + sin * spin.y, cos * spin.y - sin * spin.x, T::from(spin.z)]
            }
        };
        if self.side_sd > 0.0 {
            let speed = (before[0] * before[0] + before[1] * before[1]).sqrt();
            [x, y, z + unknown * speed / self.ball.radius]
        } else {
            [x, y, z]
        }
    }

    /// The cue ball at the impact, collision frame.
    pub(crate) fn cue(&self, z: &Unknowns) -> BallState {
        let (sin, cos) = z[DIRECTION].sin_cos();
        let before = [z[BEFORE], z[BEFORE + 1]];
        BallState {
            velocity: Vec3::new(before[0], before[1], 0.0),
            spin: self.spin([cos, sin], before, z[ROLL]).into(),
        }
    }

    /// |sin θ₀| of the friction's first direction.
    pub(crate) fn vertical(&self, z: &Unknowns) -> f64 {
        let (sin, cos) = z[DIRECTION].sin_cos();
        let spin = self.spin([cos, sin], [z[BEFORE], z[BEFORE + 1]], z[ROLL]);
        let (v_y, v_z) = (-z[BEFORE + 1] - self.ball.radius * spin[2], self.ball.radius * spin[1]);
        let slip = v_y.hypot(v_z);
        if slip > 0.0 { v_z.abs() / slip } else { 0.0 }
    }

    /// The part of the closing speed that is vertical in the slip of the contact, v_z/|v|, positive with topspin.
    fn upward<T: Number>(&self, before: [T; 2], spin: [T; 3]) -> T {
        let (v_y, v_z) = (-before[1] - spin[2] * self.ball.radius, spin[1] * self.ball.radius);
        let slip = (v_y * v_y + v_z * v_z).sqrt();
        if slip.re() > 0.0 { before[0] * v_z / slip } else { T::from(0.0) }
    }

    pub(crate) fn lift(&self, z: &Unknowns) -> Lift {
        let (sin, cos) = z[DIRECTION].sin_cos();
        let topspin = self.spin([cos, sin], [z[BEFORE], z[BEFORE + 1]], z[ROLL])[1];
        // the rounding of a measured spin is no spin
        let least = 1e-3 * z[BEFORE] / self.ball.radius;
        if topspin > least {
            Lift::Cue
        } else if topspin < -least {
            Lift::Object
        } else {
            Lift::None
        }
    }
}

/// The paths of both balls.
pub(crate) struct Motion<T> {
    time: f64,
    cue_before: Path<T>,
    cue_after: Path<T>,
    object: [T; 2],
    object_after: Path<T>,
}

/// A ball just before or after the impact, collision frame.
#[derive(Clone, Copy)]
pub(crate) struct Side<T> {
    pub velocity: [T; 2],
    /// (V_x − RΩ_y, V_y + RΩ_x)
    pub slip: [T; 2],
    /// Upward velocity.
    pub up: T,
}

impl<T: Number> Side<T> {
    pub(crate) fn new(velocity: [T; 2], spin: [T; 2], up: T, radius: f64) -> Self {
        Self { velocity, slip: [velocity[0] - spin[1] * radius, velocity[1] + spin[0] * radius], up }
    }
}

/// Where and when the balls meet, table frame.
#[derive(Clone, Copy)]
pub(crate) struct Meeting<T> {
    pub time: T,
    /// Unit vector from the cue ball to the object ball.
    pub normal: [T; 2],
    /// Where the object ball lies.
    pub object: [T; 2],
    /// Distance of the centres.
    pub distance: T,
}

/// Both balls at the impact, table frame: the cue ball just before it, and both just after it.
pub(crate) struct Launches<T> {
    pub before: Launch<T>,
    pub cue: Launch<T>,
    pub object: Launch<T>,
}

impl<T: Number> Launches<T> {
    /// From the states just before and just after the impact in the collision frame; after it of the cue ball, then of the
    /// object ball.
    pub(crate) fn new(
        scene: &Scene,
        meeting: &Meeting<T>,
        before: &Side<T>,
        [cue, ball]: [&Side<T>; 2],
    ) -> Self {
        let zero = T::from(0.0);
        let Meeting { time, normal: [cos, sin], object, distance } = *meeting;
        let to_table = |v: [T; 2]| [v[0] * cos - v[1] * sin, v[0] * sin + v[1] * cos];
        let contact = [object[0] - cos * distance, object[1] - sin * distance];
        let launch = |position, side: &Side<T>, ball: &Ball| Launch {
            time,
            position,
            velocity: to_table(side.velocity),
            slip: to_table(side.slip),
            // a flight lasts 2V_z/g; μ_k g and μ_r g are as the paths have them
            up: side.up / scene.departure.gravity,
            inertia: ball.inertia,
        };
        let Scene { ball: own, object: other, .. } = scene;
        let slips = before.slip[0].re().hypot(before.slip[1].re());
        let least = match scene.spin {
            // that it does not roll is what is assumed
            Spin::Unknown => 0.0,
            _ => scene.rolls_within + ROLLS_PART * before.velocity[0].re().hypot(before.velocity[1].re()),
        };
        let before = if slips < least { Side { slip: [zero; 2], ..*before } } else { *before };
        Self {
            before: launch(contact, &before, own),
            cue: launch(contact, cue, own),
            object: launch(object, ball, other),
        }
    }
}

impl<T: Number> Motion<T> {
    pub(crate) fn new(scene: &Scene, z: &[T; COUNT]) -> Self {
        let balls = [scene.ball, scene.object];
        // m_cue/m_object
        let ratio = balls[0].mass / balls[1].mass;
        let zero = T::from(0.0);
        let (sin, cos) = z[DIRECTION].sin_cos();
        let normal = [cos, sin];
        let pair = |first: usize| [z[first], z[first + 1]];
        let (before, cue, ball) = (pair(BEFORE), pair(CUE), pair(BALL));

        let spin = scene.spin(normal, before, z[ROLL]);
        // the vertical impulse on the ball that is lifted, over its mass: negative with topspin
        let (lift, impulse) = if scene.spin == Spin::Unknown {
            let impulse = -z[LIFT] * scene.upward(before, spin);
            (if impulse.re() > 0.0 { Lift::Object } else { Lift::Cue }, impulse)
        } else {
            match scene.lift(&Unknowns::from_fn(|i, _| z[i].re())) {
                Lift::Cue => (Lift::Cue, -z[LIFT]),
                Lift::Object => (Lift::Object, z[LIFT]),
                Lift::None => (Lift::None, zero),
            }
        };
        // q = r(U_x − U_fx), and J_z without the part q sin δ of the normal impulse
        let normal_impulse = (before[0] - cue[0]) * ratio;
        let tilt = (balls[1].radius - balls[0].radius) / (balls[1].radius + balls[0].radius);
        let on_object = if lift == Lift::Cue { impulse * ratio } else { impulse };
        let j_z = on_object - normal_impulse * tilt;
        let nu_r = balls.map(|ball| ball.inertia * ball.radius);
        // ω_f = ω_i + (0, J_z, −J_y)/(rνR)
        let cue_spin = [spin[0], spin[1] + j_z / (nu_r[0] * ratio)];
        // Ω_y = (1 − m_s)J_z/νR, where m_s J_z = V_x − q
        let cloth_impulse = if lift == Lift::Cue { ball[0] - normal_impulse } else { zero };
        let object_spin = [zero, (j_z - cloth_impulse) / nu_r[1]];
        let up = |lifted: bool| match (lifted, lift) {
            (false, _) | (_, Lift::None) => zero,
            (true, Lift::Cue) => -impulse,
            (true, Lift::Object) => impulse,
        };

        let cloth = Cloth { sliding: z[SLIDING], rolling: z[ROLLING], bounce: T::from(scene.bounce) };
        let meeting = Meeting {
            time: z[TIME],
            normal,
            object: pair(OBJECT),
            distance: (z[GAP] + 1.0) * scene.contact_distance(),
        };
        let [radius, other] = balls.map(|ball| ball.radius);
        let before = Side::new(before, [spin[0], spin[1]], zero, radius);
        let cue = Side::new(cue, cue_spin, up(lift == Lift::Cue), radius);
        let object = Side::new(ball, object_spin, up(lift == Lift::Object), other);
        Self::between(scene, &meeting, &before, [&cue, &object], &cloth)
    }

    /// The paths from the states just before and after the impact: of the cue ball, then of the object ball.
    fn between(
        scene: &Scene,
        meeting: &Meeting<T>,
        before: &Side<T>,
        after: [&Side<T>; 2],
        cloth: &Cloth<T>,
    ) -> Self {
        let Launches { before, cue, object } = Launches::new(scene, meeting, before, after);
        Self {
            time: meeting.time.re(),
            cue_before: Path::before(&before, cloth),
            cue_after: Path::after(&cue, cloth),
            object: meeting.object,
            object_after: Path::after(&object, cloth),
        }
    }

    pub(crate) fn cue(&self, time: f64) -> [T; 2] {
        let path = if time < self.time { &self.cue_before } else { &self.cue_after };
        path.position(time)
    }

    pub(crate) fn object(&self, time: f64) -> [T; 2] {
        if time < self.time { self.object } else { self.object_after.position(time) }
    }

    /// How much the horizontal spin of a ball (rad/s) at a time differs from that just before (for an
    /// earlier time) or just after the impact.
    pub(crate) fn spin_change(&self, which: TrackedBall, time: f64, ball: &Ball) -> [T; 2] {
        match (which, time < self.time) {
            (TrackedBall::Cue, true) => self.cue_before.spin_change(time, ball),
            (TrackedBall::Cue, false) => self.cue_after.spin_change(time, ball),
            (TrackedBall::Object, true) => [T::from(0.0); 2],
            (TrackedBall::Object, false) => self.object_after.spin_change(time, ball),
        }
    }
}

/// A frame of a ball.
#[derive(Clone, Copy)]
pub(crate) struct Frame<'a> {
    pub sample: &'a Sample,
    /// Standard deviations of x and y, such that frames may be taken for independent.
    pub sd: [f64; 2],
    /// In how many frames the same error stands: see [`grid::repeats`]; and noise that lasts from frame to frame.
    repeats: [f64; 2],
}

/// The frames that a fit uses.
#[derive(Clone)]
pub(crate) struct Frames<'a> {
    pub cue: Vec<Frame<'a>>,
    pub object: Vec<Frame<'a>>,
}

impl<'a> Frames<'a> {
    /// All of a shot, with a common standard deviation where the track has none; none is below the error of rounding. `noise` is
    /// what the track shows.
    pub(crate) fn of(shot: &'a TrackShot, sd: f64, noise: f64) -> Self {
        let of = |samples: &'a [Sample], step: f64| {
            let least = grid::rounding(step);
            // noise that lasts adds up over so many frames
            let alike = shot.frames_alike();
            let frame = |(sample, repeats): (&'a Sample, [f64; 2])| {
                let repeats = repeats.map(|repeats| repeats * alike);
                let sd = sample.sd.unwrap_or([sd; 2]);
                Frame { sample, sd: [0, 1].map(|i| sd[i].max(least) * repeats[i].sqrt()), repeats }
            };
            samples.iter().zip(grid::repeats(samples, noise.max(least), step)).map(frame).collect()
        };
        let [cue, object] = shot.resolution;
        Self { cue: of(&shot.cue, cue), object: of(&shot.object, object) }
    }

    /// Those between two times, without those at the instants that are wrong.
    pub(crate) fn between(&self, from: f64, to: f64, [wrong_cue, wrong_object]: [&[f64]; 2]) -> Self {
        let of = |frames: &[Frame<'a>], wrong: &[f64]| {
            let used =
                |frame: &&Frame| (from..=to).contains(&frame.sample.t) && !wrong.contains(&frame.sample.t);
            frames.iter().filter(used).copied().collect()
        };
        Self { cue: of(&self.cue, wrong_cue), object: of(&self.object, wrong_object) }
    }

    /// How many coordinates there are.
    pub(crate) fn count(&self) -> usize {
        2 * (self.cue.len() + self.object.len())
    }

    /// How many of them tell something of their own: those that repeat one error count once.
    pub(crate) fn independent(&self) -> usize {
        let frames = self.cue.iter().chain(&self.object);
        frames.flat_map(|frame| frame.repeats).map(f64::recip).sum::<f64>().round() as usize
    }

    /// As [`Frames::residuals`], without derivatives.
    pub(crate) fn residuals_only(&self, scene: &Scene, z: &Unknowns) -> DVector<f64> {
        let plain: [f64; COUNT] = (*z).into();
        let motion = Motion::new(scene, &plain);
        let off = |predicted: [f64; 2], Frame { sample, sd, .. }: &Frame| {
            [(predicted[0] - sample.x) / sd[0], (predicted[1] - sample.y) / sd[1]]
        };
        let cue = self.cue.iter().flat_map(|frame| off(motion.cue(frame.sample.t), frame));
        let object = self.object.iter().flat_map(|frame| off(motion.object(frame.sample.t), frame));
        DVector::from_iterator(self.count(), cue.chain(object))
    }

    /// (predicted − measured)/sd: x and y of the cue ball's frames, then of the object ball's; and
    /// the derivatives by the unknowns.
    pub(crate) fn residuals(&self, scene: &Scene, z: &Unknowns) -> (DVector<f64>, DMatrix<f64>) {
        match scene.spin {
            Spin::Unknown => self.with_jacobian::<UNKNOWN>(scene, z),
            _ => self.with_jacobian::<KNOWN>(scene, z),
        }
    }

    /// The derivatives of [`Frames::residuals`] by μ_r, which a single shot is given.
    pub(crate) fn by_rolling(&self, scene: &Scene, z: &Unknowns) -> DVector<f64> {
        let mut dual: [Dual64; COUNT] = std::array::from_fn(|i| Dual64::from_re(z[i]));
        dual[ROLLING] = dual[ROLLING].derivative();
        let motion = Motion::new(scene, &dual);
        let by = |predicted: [Dual64; 2], sd: &[f64; 2]| [predicted[0].eps / sd[0], predicted[1].eps / sd[1]];
        let cue = self.cue.iter().flat_map(|frame| by(motion.cue(frame.sample.t), &frame.sd));
        let object = self.object.iter().flat_map(|frame| by(motion.object(frame.sample.t), &frame.sd));
        DVector::from_iterator(self.count(), cue.chain(object))
    }

    fn with_jacobian<const N: usize>(&self, scene: &Scene, z: &Unknowns) -> (DVector<f64>, DMatrix<f64>) {
        let motion = with_derivatives::<N>(scene, z);
        let mut residuals = DVector::zeros(self.count());
        let mut jacobian = DMatrix::zeros(self.count(), COUNT);
        let mut row = 0;
        let mut add = |predicted: [DualSVec64<N>; 2], sample: &Sample, sd: &[f64; 2]| {
            for (i, measured) in [sample.x, sample.y].into_iter().enumerate() {
                residuals[row] = (predicted[i].re - measured) / sd[i];
                if let Some(gradient) = predicted[i].eps.0 {
                    for (column, derivative) in gradient.iter().enumerate() {
                        jacobian[(row, column)] = derivative / sd[i];
                    }
                }
                row += 1;
            }
        };
        for Frame { sample, sd, .. } in &self.cue {
            add(motion.cue(sample.t), sample, sd);
        }
        for Frame { sample, sd, .. } in &self.object {
            add(motion.object(sample.t), sample, sd);
        }
        (residuals, jacobian)
    }
}
