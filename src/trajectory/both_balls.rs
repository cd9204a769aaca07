//! Where both balls should be in every frame, through the instant of impact.

use num_dual::DualSVec64;

use super::shot_scene::{Lifted, ShotScene};
use super::unknowns::Unknowns;
use super::unknowns::unknown::{
    BALL, BEFORE, COUNT, CUE, DIRECTION, GAP, LIFT, OBJECT, ROLL, ROLLING, SLIDING, TIME,
};
use crate::measurement::spin::Spin;
use crate::measurement::track::TrackedBall;
use crate::physics::ball::Ball;
use crate::physics::cloth_motion::{Cloth, Launch, Number, Path};

/// The motion with its derivatives by the first N unknowns.
pub(crate) fn with_derivatives<const N: usize>(scene: &ShotScene, z: &Unknowns) -> Motion<DualSVec64<N>> {
    let dual = |i: usize| {
        let plain = DualSVec64::from_re(z[i]);
        if i < N { plain.derivative(i) } else { plain }
    };
    Motion::new(scene, &std::array::from_fn(dual))
}

/// A ball whose measured spin slips less than this part of its speed rolls: spins are rounded.
const ROLLS_PART: f64 = 0.01;

/// The paths of both balls.
pub struct Motion<T> {
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
        scene: &ShotScene,
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
        let ShotScene { ball: own, object: other, .. } = scene;
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
    pub(crate) fn new(scene: &ShotScene, z: &[T; COUNT]) -> Self {
        let balls = [scene.ball, scene.object];
        // m_cue/m_object
        let ratio = balls[0].mass / balls[1].mass;
        let zero = T::from(0.0);
        let (sin, cos) = z[DIRECTION].sin_cos();
        let normal = [cos, sin];
        let pair = |first: usize| [z[first], z[first + 1]];
        let (before, cue, ball) = (pair(BEFORE), pair(CUE), pair(BALL));

        let spin = scene.spin(normal, before, z[ROLL]);
        // q = r(U_x − U_fx), and its part upwards, q sin δ
        let normal_impulse = (before[0] - cue[0]) * ratio;
        let tilt = (balls[1].radius - balls[0].radius) / (balls[1].radius + balls[0].radius);
        let tilted = normal_impulse * tilt;
        // the vertical impulse on the ball that is lifted, over its mass: negative with topspin
        let (lift, impulse) = if scene.spin == Spin::Unknown {
            let impulse = -z[LIFT] * scene.upward(before, spin);
            (if impulse.re() > 0.0 { Lifted::Object } else { Lifted::Cue }, impulse)
        } else {
            match scene.lift(&Unknowns::from_fn(|i, _| z[i].re())) {
                Lifted::Cue => (Lifted::Cue, -z[LIFT]),
                Lifted::Object => (Lifted::Object, z[LIFT]),
                // without spin the larger ball rises by the tilt of the line of centres
                Lifted::Neither if tilt > 0.0 => (Lifted::Object, tilted),
                Lifted::Neither if tilt < 0.0 => (Lifted::Cue, tilted / ratio),
                Lifted::Neither => (Lifted::Neither, zero),
            }
        };
        // J_z without the part of the normal impulse
        let on_object = if lift == Lifted::Cue { impulse * ratio } else { impulse };
        let j_z = on_object - tilted;
        let nu_r = balls.map(|ball| ball.inertia * ball.radius);
        // ω_f = ω_i + (0, J_z, −J_y)/(rνR)
        let cue_spin = [spin[0], spin[1] + j_z / (nu_r[0] * ratio)];
        // Ω_y = (1 − m_s)J_z/νR, where m_s J_z = V_x − q
        let cloth_impulse = if lift == Lifted::Cue { ball[0] - normal_impulse } else { zero };
        let object_spin = [zero, (j_z - cloth_impulse) / nu_r[1]];
        let up = |lifted: bool| match (lifted, lift) {
            (false, _) | (_, Lifted::Neither) => zero,
            (true, Lifted::Cue) => -impulse,
            (true, Lifted::Object) => impulse,
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
        let cue = Side::new(cue, cue_spin, up(lift == Lifted::Cue), radius);
        let object = Side::new(ball, object_spin, up(lift == Lifted::Object), other);
        Self::between(scene, &meeting, &before, [&cue, &object], &cloth)
    }

    /// The paths from the states just before and after the impact: of the cue ball, then of the object ball.
    fn between(
        scene: &ShotScene,
        meeting: &Meeting<T>,
        before: &Side<T>,
        after: [&Side<T>; 2],
        cloth: &Cloth<T>,
    ) -> Self {
        let Launches { before, cue, object } = Launches::new(scene, meeting, before, after);
        Self {
            time: meeting.time.re(),
            cue_before: Path::before(&before, cloth),
            cue_after: scene.seen(Path::after(&cue, cloth)),
            object: meeting.object,
            object_after: scene.seen(Path::after(&object, cloth)),
        }
    }

    /// The cue ball's centre at a time (s), m.
    #[must_use]
    pub fn cue(&self, time: f64) -> [T; 2] {
        let path = if time < self.time { &self.cue_before } else { &self.cue_after };
        path.position(time)
    }

    /// The object ball's centre at a time (s), m.
    #[must_use]
    pub fn object(&self, time: f64) -> [T; 2] {
        if time < self.time { self.object } else { self.object_after.position(time) }
    }

    /// How high each ball is above the cloth at a time, m.
    pub(crate) fn heights(&self, time: f64) -> [f64; 2] {
        if time < self.time {
            return [0.0; 2];
        }
        [&self.cue_after, &self.object_after].map(|path| path.height(time))
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
