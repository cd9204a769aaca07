//! What a specification may ask for.

use super::{BallSpec, Camera, ClothSpec, Noise, Played, Shots, Spec};
use crate::measurement::valid::{FRACTION, Fault, INERTIA, NOT_NEGATIVE, POSITIVE};
use crate::physics::ball::Ball;
use crate::physics::collision::MASS_RATIOS;

/// More shots are a slip of the pen.
pub(crate) const MOST_SHOTS: usize = 1_000_000;

/// Frames of a shot before or after the impact: more are a slip of the pen, and would fill the memory.
pub(crate) const MOST_FRAMES: f64 = 1e5;

/// What a ball's mass or radius may be off by, of itself: what is stated stays above 0 then.
const MOST_ERROR: f64 = 0.1;

/// A ball with more markers than these is none.
const MOST_MARKERS: usize = 100;

/// What is wrong with the speeds and the cut angles of a section.
pub(crate) fn faults_of_ranges(section: &str, speed_m_s: [f64; 2], cut_deg: [f64; 2]) -> Vec<Fault> {
    let ([slow, fast], [thick, thin]) = (speed_m_s, cut_deg);
    let mut faults = Vec::new();
    if !(slow > 0.0 && slow <= fast && fast.is_finite()) {
        let (key, value) = (format!("{section}.speed_m_s"), format!("[{slow}, {fast}]"));
        faults.push(Fault::new(&key, value, "[slowest, fastest], above 0"));
    }
    if !(-90.0 < thick && thick <= thin && thin < 90.0) {
        let (key, value) = (format!("{section}.cut_deg"), format!("[{thick}, {thin}]"));
        faults.push(Fault::new(&key, value, "[least, most], between -90 and 90"));
    }
    faults
}

impl Spec {
    /// What is wrong with it.
    #[must_use]
    pub fn faults(&self) -> Vec<Fault> {
        let Shots { count, speed_m_s, cut_deg, cue_spin } = &self.shots;
        let Noise { velocity_m_s, line_of_centres_deg, spin_rad_s, angle_deg } = self.noise;
        let BallSpec { radius_m, mass_kg, inertia, radius_m_sd, mass_kg_sd } = self.ball;
        let object = self.object.unwrap_or_default();
        let other = self.balls().1.map_or(Ball::POOL, |other| other.ball);
        let Camera { fps, position_sd_m, before_ms, after_ms, gaps, outliers, markers } = self.camera;
        let ClothSpec { mu_k, mu_r, bounce } = self.cloth;
        let mut faults = Vec::new();
        let mut expect = |is_good: bool, key: &str, value: String, expected: &str| {
            if !is_good {
                faults.push(Fault::new(key, value, expected));
            }
        };
        let is_name =
            !self.name.is_empty() && !self.name.contains(['/', '\\']) && !self.name.starts_with('.');
        expect(is_name, "name", format!("\"{}\"", self.name), "a name that can name a folder");
        expect((1..=MOST_SHOTS).contains(count), "shots.count", count.to_string(), "1 to 1 000 000");
        let spins = format!("at least one of {}", Played::ALL.map(Played::name).join(", "));
        expect(!cue_spin.is_empty(), "shots.cue_spin", "[]".to_owned(), &spins);
        let both = "both of mu + mu_b·exp(−mu_c·v), or neither";
        let [b, c] = [self.truth.mu_b.is_some(), self.truth.mu_c.is_some()];
        expect(b || !c, "truth.mu_b", "missing".to_owned(), both);
        expect(c || !b, "truth.mu_c", "missing".to_owned(), both);
        for (key, sd, of) in [
            ("ball.radius_m_sd", radius_m_sd, radius_m),
            ("ball.mass_kg_sd", mass_kg_sd, mass_kg),
            ("object.radius_m_sd", object.radius_m_sd, other.radius),
            ("object.mass_kg_sd", object.mass_kg_sd.unwrap_or(0.0), other.mass),
        ] {
            let is_small = !(of > 0.0) || (0.0..MOST_ERROR * of).contains(&sd);
            expect(is_small, key, sd.to_string(), "0 or more, less than a tenth of what it is the error of");
        }
        // masses that are none are said below
        let ratio = self.object.map_or(1.0, |_| mass_kg / other.mass);
        let is_possible = !(ratio > 0.0 && ratio.is_finite()) || MASS_RATIOS.contains(&ratio);
        expect(
            is_possible,
            "object.mass_kg",
            other.mass.to_string(),
            "0.001 to 1000 times the cue ball's mass",
        );
        for (key, ms) in [("camera.before_ms", before_ms), ("camera.after_ms", after_ms)] {
            let frames = 1e-3 * ms * fps;
            let value = format!("{ms}, which is {frames:.0} frames");
            // one that is not finite is said below
            expect(!(frames > MOST_FRAMES && frames.is_finite()), key, value, "at most 100 000 frames");
        }
        expect(markers <= MOST_MARKERS, "camera.markers", markers.to_string(), "at most 100");
        faults.extend(faults_of_ranges("shots", *speed_m_s, *cut_deg));
        let numbers = [
            ("noise.velocity_m_s", velocity_m_s, NOT_NEGATIVE),
            ("noise.line_of_centres_deg", line_of_centres_deg, NOT_NEGATIVE),
            ("noise.spin_rad_s", spin_rad_s, NOT_NEGATIVE),
            ("noise.angle_deg", angle_deg, NOT_NEGATIVE),
            ("ball.radius_m", radius_m, POSITIVE),
            ("ball.mass_kg", mass_kg, POSITIVE),
            ("ball.inertia", inertia, INERTIA),
            ("object.radius_m", other.radius, POSITIVE),
            ("object.mass_kg", other.mass, POSITIVE),
            ("object.inertia", other.inertia, INERTIA),
            ("camera.fps", fps, POSITIVE),
            ("camera.position_sd_m", position_sd_m, NOT_NEGATIVE),
            ("camera.before_ms", before_ms, NOT_NEGATIVE),
            ("camera.after_ms", after_ms, NOT_NEGATIVE),
            ("camera.gaps", gaps, FRACTION),
            ("camera.outliers", outliers, FRACTION),
            ("cloth.mu_k", mu_k, NOT_NEGATIVE),
            ("cloth.mu_r", mu_r, NOT_NEGATIVE),
            ("cloth.bounce", bounce, FRACTION),
        ];
        faults.extend(
            numbers.into_iter().filter_map(|(key, value, range)| Fault::of_number(key, value, range)),
        );
        faults
    }

    /// The first thing that is wrong with it.
    pub(super) fn check(&self) -> Result<(), Fault> {
        self.faults().into_iter().next().map_or(Ok(()), Err)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulate::{Kind, Truth};

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
        assert_eq!(spec().check(), Ok(()));
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
            let said: Vec<String> = spec.faults().iter().map(ToString::to_string).collect();
            assert!(said.iter().any(|one| one.contains(expected)), "{said:?}\nlack {expected}");
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
