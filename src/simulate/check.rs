//! Checks of the values of a specification.

use super::{Played, Spec};
use crate::io::toml_file::Source;
use crate::measurement::valid::{FRACTION, Fault, INERTIA, NOT_NEGATIVE, POSITIVE};
use crate::physics::ball::Ball;
use crate::physics::collision::MASS_RATIOS;

/// Largest number of shots. More are a slip of the pen.
pub(crate) const MAX_SHOTS: usize = 1_000_000;

/// Largest number of frames of a shot before or after the impact. More are a slip of the pen, and
/// would fill the memory.
pub(crate) const MAX_FRAMES: usize = 100_000;

/// Returns what is wrong with the speeds and the cut angles of a section.
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
    /// Adds what is wrong with it to the problems of its file.
    pub(super) fn checked(self, source: &Source) -> Self {
        self.faults().iter().for_each(|fault| source.add(fault));
        self
    }

    /// Returns the first fault as an error.
    pub(super) fn check(&self) -> Result<(), Fault> {
        self.faults().into_iter().next().map_or(Ok(()), Err)
    }

    /// Returns what is wrong with it.
    #[must_use]
    pub fn faults(&self) -> Vec<Fault> {
        let Self { name, truth, shots, noise, ball, camera, cloth, .. } = self;
        let stated = self.object.unwrap_or_default();
        let other = self.balls().1.map_or(Ball::POOL, |other| other.ball);
        let mut faults = Vec::new();
        let mut expect = |is_good: bool, key: &str, value: String, expected: &str| {
            faults.extend((!is_good).then(|| Fault::new(key, value, expected)));
        };
        let is_name = !name.is_empty() && !name.contains(['/', '\\']) && !name.starts_with('.');
        expect(is_name, "name", format!("\"{name}\""), "a name that can name a folder");
        let is_count = (1..=MAX_SHOTS).contains(&shots.count);
        expect(is_count, "shots.count", shots.count.to_string(), "1 to 1 000 000");
        let spins = format!("at least one of {}", Played::ALL.map(Played::name).join(", "));
        expect(!shots.cue_spin.is_empty(), "shots.cue_spin", "[]".to_owned(), &spins);
        let both = "both of mu + mu_b·exp(−mu_c·v), or neither";
        let [b, c] = [truth.mu_b.is_some(), truth.mu_c.is_some()];
        expect(b || !c, "truth.mu_b", "missing".to_owned(), both);
        expect(c || !b, "truth.mu_c", "missing".to_owned(), both);
        // what is stated remains above 0
        for (key, sd, value) in [
            ("ball.radius_m_sd", ball.radius_m_sd, ball.radius_m),
            ("ball.mass_kg_sd", ball.mass_kg_sd, ball.mass_kg),
            ("object.radius_m_sd", stated.radius_m_sd, other.radius),
            ("object.mass_kg_sd", stated.mass_kg_sd.unwrap_or(0.0), other.mass),
        ] {
            let is_small = !(value > 0.0) || (0.0..0.1 * value).contains(&sd);
            expect(is_small, key, sd.to_string(), "0 or more, less than a tenth of what it is the error of");
        }
        // a mass that is not positive and a time that is not finite are named below
        let ratio = self.object.map_or(1.0, |_| ball.mass_kg / other.mass);
        let is_possible = !(ratio > 0.0 && ratio.is_finite()) || MASS_RATIOS.contains(&ratio);
        let masses = "0.001 to 1000 times the cue ball's mass";
        expect(is_possible, "object.mass_kg", other.mass.to_string(), masses);
        for (key, ms) in [("camera.before_ms", camera.before_ms), ("camera.after_ms", camera.after_ms)] {
            let frames = 1e-3 * ms * camera.fps;
            let value = format!("{ms}, which is {frames:.0} frames");
            let is_long = frames > MAX_FRAMES as f64 && frames.is_finite();
            expect(!is_long, key, value, "at most 100 000 frames");
        }
        expect(camera.markers <= 100, "camera.markers", camera.markers.to_string(), "at most 100");
        faults.extend(faults_of_ranges("shots", shots.speed_m_s, shots.cut_deg));
        for (key, value, range) in [
            ("noise.velocity_m_s", noise.velocity_m_s, NOT_NEGATIVE),
            ("noise.line_of_centres_deg", noise.line_of_centres_deg, NOT_NEGATIVE),
            ("noise.spin_rad_s", noise.spin_rad_s, NOT_NEGATIVE),
            ("noise.angle_deg", noise.angle_deg, NOT_NEGATIVE),
            ("ball.radius_m", ball.radius_m, POSITIVE),
            ("ball.mass_kg", ball.mass_kg, POSITIVE),
            ("ball.inertia", ball.inertia, INERTIA),
            ("object.radius_m", other.radius, POSITIVE),
            ("object.mass_kg", other.mass, POSITIVE),
            ("object.inertia", other.inertia, INERTIA),
            ("camera.fps", camera.fps, POSITIVE),
            ("camera.position_sd_m", camera.position_sd_m, NOT_NEGATIVE),
            ("camera.before_ms", camera.before_ms, NOT_NEGATIVE),
            ("camera.after_ms", camera.after_ms, NOT_NEGATIVE),
            ("camera.gaps", camera.gaps, FRACTION),
            ("camera.outliers", camera.outliers, FRACTION),
            ("cloth.mu_k", cloth.mu_k, NOT_NEGATIVE),
            ("cloth.mu_r", cloth.mu_r, NOT_NEGATIVE),
            ("cloth.bounce", cloth.bounce, FRACTION),
        ] {
            faults.extend(Fault::of_number(key, value, range));
        }
        faults
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::DatasetError;

    /// Returns the specification of a film of one shot, with more sections.
    fn film(sections: &str) -> Result<Spec, String> {
        let usual = "
            name = 'film'
            kind = 'tracks'
            seed = 1
            truth = { mu = 0.05, mu_s = 0.3, e = 0.94 }
            shots = { count = 1, speed_m_s = [1, 2], cut_deg = [0, 30], cue_spin = ['natural-roll'] }
            ";
        (usual.to_owned() + sections).parse().map_err(|error: DatasetError| error.to_string())
    }

    #[test]
    fn what_cannot_be_made_is_named() {
        assert!(film("").unwrap().faults().is_empty());
        for (sections, expected) in [
            ("ball = { radius_m = 0 }", "ball.radius_m is 0; expected more than 0"),
            ("ball = { inertia = nan }", "ball.inertia is NaN; expected more than 0"),
            ("camera = { fps = inf }", "camera.fps is inf; expected more than 0"),
            ("camera = { position_sd_m = -1 }", "camera.position_sd_m is -1; expected 0 or more"),
            ("camera = { before_ms = nan }", "camera.before_ms is NaN; expected 0 or more"),
            ("camera = { after_ms = 1e9 }", "camera.after_ms is 1000000000, which is 1000000000 frames"),
            ("camera = { gaps = 1.5 }", "camera.gaps is 1.5; expected a number from 0 to 1"),
            ("camera = { outliers = -0.5 }", "camera.outliers is -0.5; expected a number from 0 to 1"),
            ("camera = { markers = 101 }", "camera.markers is 101; expected at most 100"),
            ("cloth = { mu_k = nan }", "cloth.mu_k is NaN; expected 0 or more"),
            ("cloth = { mu_r = -0.01 }", "cloth.mu_r is -0.01; expected 0 or more"),
            ("cloth = { bounce = 1.01 }", "cloth.bounce is 1.01; expected a number from 0 to 1"),
            ("cloth = { bounce = nan }", "cloth.bounce is NaN; expected a number from 0 to 1"),
        ] {
            let error = film(sections).unwrap_err();
            assert!(error.contains(expected), "{error}\nlacks {expected}");
        }
        let mut many = film("").unwrap();
        many.shots.count = 2_000_000;
        let error = many.check().unwrap_err().to_string();
        assert_eq!(error, "shots.count is 2000000; expected 1 to 1 000 000");
    }

    #[test]
    fn a_ball_that_bounces_for_ever_can_be_filmed() {
        let films = crate::simulate::filmed(&film("cloth = { bounce = 1.0 }").unwrap()).unwrap();
        let (shot, _) = &films[0];
        assert!(shot.cue.iter().chain(&shot.object).all(|s| s.x.is_finite() && s.y.is_finite()));
    }
}
