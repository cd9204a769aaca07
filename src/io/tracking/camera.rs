//! `[camera]`: what of the camera is found from the balls, stated, or taken as right.

use serde::Deserialize;

use crate::io::toml_file::Source;
use crate::measurement::correction::Correction;
use crate::measurement::valid::Fault;

/// The section. A key that is left out is `"auto"`.
#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct CameraSection {
    scale: Option<Stated>,
    aspect: Option<Stated>,
    shear: Option<Stated>,
    perspective: Option<Stated>,
    lens: Option<Stated>,
    shutter: Option<Stated>,
    parallax: Option<Stated>,
}

/// What is said of a correction.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(
    untagged,
    expecting = "expected \"auto\", \"none\" or a number (for perspective two, along x and along y)"
)]
enum Stated {
    Word(Word),
    One(f64),
    /// Along x and along y.
    Two([f64; 2]),
}

#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(rename_all = "lowercase")]
enum Word {
    Auto,
    None,
}

impl Stated {
    fn values(&self) -> &[f64] {
        match self {
            Self::Word(_) => &[],
            Self::One(value) => std::slice::from_ref(value),
            Self::Two(values) => values,
        }
    }
}

/// What dataset.toml says of a correction.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) enum Wanted {
    #[default]
    LeftOut,
    Auto,
    Value(f64),
}

/// What dataset.toml says of each, in the order of [`Correction::ALL`].
pub(super) type WantedCamera = [Wanted; Correction::COUNT];

/// The values that are stated; `None`: found from the balls. A motion-capture system has corrected its positions for its cameras, so
/// that what only a camera does is looked for there if dataset.toml asks for it.
pub(super) fn stated(wanted: &WantedCamera, is_motion_capture: bool) -> [Option<f64>; Correction::COUNT] {
    let of = |which: Correction| match wanted[which as usize] {
        Wanted::Value(value) => Some(value),
        Wanted::LeftOut if is_motion_capture && which.is_of_one_camera() => Some(which.neutral()),
        Wanted::LeftOut | Wanted::Auto => None,
    };
    Correction::ALL.map(of)
}

impl CameraSection {
    /// What is wanted, of keys that are right.
    pub(super) fn check(&self, source: &Source) -> WantedCamera {
        let mut wanted = WantedCamera::default();
        let mut take =
            |name: &str, given: Option<Stated>, which: &[Correction], limits: &[[f64; 2]], expected: &str| {
                let Some(stated) = given else { return };
                let values = stated.values();
                let is_good = values.len() == limits.len()
                    && values.iter().zip(limits).all(|(x, [low, high])| (*low..=*high).contains(x));
                for (i, which) in which.iter().enumerate() {
                    wanted[*which as usize] = match stated {
                        Stated::Word(Word::Auto) => Wanted::Auto,
                        Stated::Word(Word::None) => Wanted::Value(which.neutral()),
                        _ if is_good => Wanted::Value(values[i]),
                        _ => Wanted::LeftOut,
                    };
                }
                if !is_good && !matches!(stated, Stated::Word(_)) {
                    let key = format!("camera.{name}");
                    let value = source.written(&key).unwrap_or_default();
                    source.add(&Fault::new(&key, value, format!("\"auto\"{expected}")));
                }
            };
        let expected = ", \"none\" or a length of the film over the true one, from 0.1 to 10";
        take("scale", self.scale, &[Correction::Scale], &[[0.1, 10.0]], expected);
        let expected = ", \"none\" or lengths along y over lengths along x, from 0.5 to 2";
        take("aspect", self.aspect, &[Correction::Aspect], &[[0.5, 2.0]], expected);
        let expected = ", \"none\" or a number from -0.5 to 0.5";
        take("shear", self.shear, &[Correction::Shear], &[[-0.5, 0.5]], expected);
        let expected = ", \"none\" or a part of lengths at 0.5 m, from -0.3 to 0.3";
        take("lens", self.lens, &[Correction::Lens], &[[-0.3, 0.3]], expected);
        let both = [Correction::PerspectiveX, Correction::PerspectiveY];
        let expected = ", \"none\" or [x, y], each from -2 to 2 per metre";
        take("perspective", self.perspective, &both, &[[-2.0, 2.0]; 2], expected);
        let both = [Correction::ShutterX, Correction::ShutterY];
        let expected = " or \"none\": a known read-out time is [video] row_readout_s with rows";
        take("shutter", self.shutter, &both, &[], expected);
        let all = [Correction::ParallaxX, Correction::ParallaxY, Correction::Nearness];
        take("parallax", self.parallax, &all, &[], " or \"none\"");
        // a lens that is stated is about the middle of the film
        let middle = match wanted[Correction::Lens as usize] {
            Wanted::Value(_) => Wanted::Value(0.0),
            other => other,
        };
        wanted[Correction::LensX as usize] = middle;
        wanted[Correction::LensY as usize] = middle;
        wanted
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn motion_capture_is_corrected_for_its_cameras_already() {
        let mut wanted = WantedCamera::default();
        wanted[Correction::ShutterY as usize] = Wanted::Auto;
        wanted[Correction::Aspect as usize] = Wanted::Value(1.01);
        for (which, plain, captured) in [
            (Correction::PerspectiveX, None, Some(0.0)),
            (Correction::Lens, None, Some(0.0)),
            (Correction::LensY, None, Some(0.0)),
            (Correction::ShutterX, None, Some(0.0)),
            (Correction::ShutterY, None, None),
            (Correction::Scale, None, None),
            (Correction::Aspect, Some(1.01), Some(1.01)),
        ] {
            let found =
                [false, true].map(|is_motion_capture| stated(&wanted, is_motion_capture)[which as usize]);
            assert_eq!(found, [plain, captured]);
        }
    }
}
