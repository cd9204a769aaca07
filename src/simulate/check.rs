//! What a specification may ask for.

use super::{BadSpec, BallSpec, Camera, ClothSpec, Noise, Shots, Spec};
use crate::physics::ball::Ball;

/// More shots are a slip of the pen.
pub(crate) const MOST_SHOTS: usize = 1_000_000;

/// Frames of a shot before or after the impact: more are a slip of the pen, and would fill the memory.
pub(crate) const MOST_FRAMES: f64 = 1e5;

/// What a ball's mass or radius may be off by, of itself: what is stated stays above 0 then.
const MOST_ERROR: f64 = 0.1;

/// A ball with more markers than these is none.
const MOST_MARKERS: usize = 100;

/// Checks a specification.
pub(super) fn check(spec: &Spec) -> Result<(), BadSpec> {
    let fail = |key, value: String, expected| Err(BadSpec::Value { key, value, expected });
    let Shots { count, speed_m_s: [slow, fast], cut_deg: [thick, thin], ref cue_spin } = spec.shots;
    if spec.name.is_empty() || spec.name.contains(['/', '\\']) || spec.name.starts_with('.') {
        return fail("name", format!("\"{}\"", spec.name), "a name that can name a folder");
    }
    if !(1..=MOST_SHOTS).contains(&count) {
        return fail("shots.count", count.to_string(), "1 to 1 000 000");
    }
    if !(slow > 0.0 && slow <= fast && fast.is_finite()) {
        return fail("shots.speed_m_s", format!("[{slow}, {fast}]"), "[slowest, fastest], above 0");
    }
    if !(-90.0 < thick && thick <= thin && thin < 90.0) {
        return fail("shots.cut_deg", format!("[{thick}, {thin}]"), "[least, most], between -90 and 90");
    }
    if cue_spin.is_empty() {
        return fail(
            "shots.cue_spin",
            "[]".into(),
            "at least one of stun, natural-roll, almost-roll, draw, side, slight-side, any",
        );
    }
    for (key, value, other) in
        [("truth.mu_c", spec.truth.mu_c, spec.truth.mu_b), ("truth.mu_b", spec.truth.mu_b, spec.truth.mu_c)]
    {
        if value.is_none() && other.is_some() {
            return fail(key, "missing".into(), "both of mu + mu_b·exp(−mu_c·v), or neither");
        }
    }
    check_numbers(spec)
}

/// Checks what has to be a number in some range.
fn check_numbers(spec: &Spec) -> Result<(), BadSpec> {
    let Noise { velocity_m_s, line_of_centres_deg, spin_rad_s, angle_deg } = spec.noise;
    let BallSpec { radius_m, mass_kg, inertia, radius_m_sd, mass_kg_sd } = spec.ball;
    let object = spec.object.unwrap_or_default();
    let (_, other) = spec.balls();
    let other = other.map_or(Ball::POOL, |other| other.ball);
    let Camera { fps, position_sd_m, before_ms, after_ms, gaps, outliers, markers } = spec.camera;
    let ClothSpec { mu_k, mu_r, bounce } = spec.cloth;
    let not_negative: (fn(f64) -> bool, _) = (|x| x >= 0.0, "0 or more");
    let positive: (fn(f64) -> bool, _) = (|x| x > 0.0, "more than 0");
    let part: (fn(f64) -> bool, _) = (|x| (0.0..=1.0).contains(&x), "a number from 0 to 1");
    for (key, value, (good, expected)) in [
        ("noise.velocity_m_s", velocity_m_s, not_negative),
        ("noise.line_of_centres_deg", line_of_centres_deg, not_negative),
        ("noise.spin_rad_s", spin_rad_s, not_negative),
        ("noise.angle_deg", angle_deg, not_negative),
        ("ball.radius_m", radius_m, positive),
        ("ball.mass_kg", mass_kg, positive),
        ("ball.inertia", inertia, positive),
        ("object.radius_m", other.radius, positive),
        ("object.mass_kg", other.mass, positive),
        ("object.inertia", other.inertia, positive),
        ("camera.fps", fps, positive),
        ("camera.position_sd_m", position_sd_m, not_negative),
        ("camera.before_ms", before_ms, not_negative),
        ("camera.after_ms", after_ms, not_negative),
        ("camera.gaps", gaps, part),
        ("camera.outliers", outliers, part),
        ("cloth.mu_k", mu_k, not_negative),
        ("cloth.mu_r", mu_r, not_negative),
        ("cloth.bounce", bounce, part),
    ] {
        if !(value.is_finite() && good(value)) {
            return Err(BadSpec::Value { key, value: value.to_string(), expected });
        }
    }
    for (key, sd, of) in [
        ("ball.radius_m_sd", radius_m_sd, radius_m),
        ("ball.mass_kg_sd", mass_kg_sd, mass_kg),
        ("object.radius_m_sd", object.radius_m_sd, other.radius),
        ("object.mass_kg_sd", object.mass_kg_sd, other.mass),
    ] {
        if !(0.0..MOST_ERROR * of).contains(&sd) {
            let expected = "0 or more, less than a tenth of what it is the error of";
            return Err(BadSpec::Value { key, value: sd.to_string(), expected });
        }
    }
    for (key, ms) in [("camera.before_ms", before_ms), ("camera.after_ms", after_ms)] {
        if 1e-3 * ms * fps > MOST_FRAMES {
            let value = format!("{ms}, which is {:.0} frames", 1e-3 * ms * fps);
            return Err(BadSpec::Value { key, value, expected: "at most 100 000 frames" });
        }
    }
    if markers > MOST_MARKERS {
        let value = markers.to_string();
        return Err(BadSpec::Value { key: "camera.markers", value, expected: "at most 100" });
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulate::{Kind, Played, Truth};

    fn spec() -> Spec {
        Spec {
            name: "film".to_string(),
            kind: Kind::Tracks,
            seed: 1,
            truth: Truth { mu: 0.05, mu_s: 0.3, e: 0.94, ..Truth::default() },
            shots: Shots {
                count: 1,
                speed_m_s: [1.0, 2.0],
                cut_deg: [0.0, 30.0],
                cue_spin: vec![Played::NaturalRoll],
            },
            noise: Noise::default(),
            ball: BallSpec::default(),
            object: None,
            camera: Camera::default(),
            cloth: ClothSpec::default(),
        }
    }

    type Spoil = fn(&mut Spec);

    #[test]
    fn what_cannot_be_made_is_named() {
        assert_eq!(check(&spec()), Ok(()));
        let wrong: [(&str, Spoil); 14] = [
            ("shots.count is 2000000; expected 1 to 1 000 000", |s| s.shots.count = 2_000_000),
            ("ball.radius_m is 0; expected more than 0", |s| s.ball.radius_m = 0.0),
            ("ball.inertia is NaN; expected more than 0", |s| s.ball.inertia = f64::NAN),
            ("camera.fps is inf; expected more than 0", |s| s.camera.fps = f64::INFINITY),
            ("camera.position_sd_m is -1; expected 0 or more", |s| s.camera.position_sd_m = -1.0),
            ("camera.before_ms is NaN; expected 0 or more", |s| s.camera.before_ms = f64::NAN),
            ("camera.after_ms is 1000000000, which is 1000000000 frames", |s| s.camera.after_ms = 1e9),
            ("camera.gaps is 1.5; expected a number from 0 to 1", |s| s.camera.gaps = 1.5),
            ("camera.outliers is -0.5; expected a number from 0 to 1", |s| s.camera.outliers = -0.5),
            ("camera.markers is 101; expected at most 100", |s| s.camera.markers = 101),
            ("cloth.mu_k is NaN; expected 0 or more", |s| s.cloth.mu_k = f64::NAN),
            ("cloth.mu_r is -0.01; expected 0 or more", |s| s.cloth.mu_r = -0.01),
            ("cloth.bounce is 1.01; expected a number from 0 to 1", |s| s.cloth.bounce = 1.01),
            ("cloth.bounce is NaN; expected a number from 0 to 1", |s| s.cloth.bounce = f64::NAN),
        ];
        for (expected, spoil) in wrong {
            let mut spec = spec();
            spoil(&mut spec);
            let error = check(&spec).expect_err(expected).to_string();
            assert!(error.contains(expected), "{error}\nis not {expected}");
        }
    }

    #[test]
    fn a_ball_that_bounces_for_ever_can_be_filmed() {
        let mut spec = spec();
        spec.cloth.bounce = 1.0;
        let films = crate::simulate::filmed(&spec).unwrap();
        let (shot, _) = &films[0];
        assert!(shot.cue.iter().chain(&shot.object).all(|s| s.x.is_finite() && s.y.is_finite()));
    }
}
