//! What a simulation of an impact contains: one switch for each effect.

use std::str::FromStr;

use crate::physics::name::UnknownName;

/// The effects from one table: what each is, its switch, and its name on the command line and in fit.json.
macro_rules! effects {
    ($($(#[doc = $doc:literal])+ $switch:ident: $name:literal,)+) => {
        /// Effects of an impact, each on or off. [`super::Fidelity::effects`] gives those that a fidelity can simulate.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
        #[allow(clippy::struct_excessive_bools)] // any combination of the effects is one that can be asked for
        pub struct Effects {
            $($(#[doc = $doc])+ pub $switch: bool,)+
        }

        impl Effects {
            /// Two rigid balls that exchange their velocities along the line of centres.
            pub const NONE: Self = Self { $($switch: false),+ };

            /// All effects.
            pub const ALL: Self = Self { $($switch: true),+ };

            /// The names of the effects, as on the command line and in fit.json.
            pub const NAMES: [&'static str; 10] = [$($name),+];

            /// Each effect's name and whether it is on, in the order of [`Effects::NAMES`].
            #[must_use]
            pub fn list(&self) -> [(&'static str, bool); 10] {
                [$(($name, self.$switch)),+]
            }

            /// The switch of a name of [`Effects::NAMES`].
            pub fn switch(&mut self, name: &str) -> Option<&mut bool> {
                match name {
                    $($name => Some(&mut self.$switch),)+
                    _ => None,
                }
            }

            /// The effects that are on in both.
            #[must_use]
            pub fn and(self, other: Self) -> Self {
                Self { $($switch: self.$switch && other.$switch),+ }
            }
        }
    };
}

effects! {
    /// The balls lose energy in the impact: e < 1.
    inelasticity: "inelasticity",
    /// Friction between the balls.
    friction: "friction",
    /// Friction between the balls ends when their slip has stopped: the contact sticks.
    stick: "stick",
    /// The friction between the balls turns with the slip during the impact.
    turning: "turning",
    /// Friction of the cloth on a ball that is pressed down: on the object ball, with topspin.
    cloth: "cloth",
    /// The cloth's friction follows the object ball's slip on it, and is not just along −x.
    cloth_turning: "cloth-turning",
    /// Friction of the cloth on the cue ball, with draw.
    cloth_on_cue: "cloth-on-cue",
    /// Gravity during the contact, with the balls' weight on the cloth.
    gravity: "gravity",
    /// Friction between the balls that depends on the slip follows it during the impact.
    falling_friction: "falling-friction",
    /// The contact gives way along the surface and springs back, by κ of [`super::Model`].
    compliance: "compliance",
}

/// `all`, `none`, or names of [`Effects::NAMES`] with commas between.
impl FromStr for Effects {
    type Err = UnknownName;

    fn from_str(text: &str) -> Result<Self, UnknownName> {
        match text {
            "all" => return Ok(Self::ALL),
            "none" => return Ok(Self::NONE),
            _ => {}
        }
        let mut effects = Self::NONE;
        for name in text.split(',').map(str::trim) {
            let unknown = || UnknownName {
                kind: "effect",
                name: name.to_owned(),
                known: ["all", "none"].into_iter().chain(Self::NAMES).collect(),
            };
            *effects.switch(name).ok_or_else(unknown)? = true;
        }
        Ok(effects)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_name_has_a_switch_of_its_own() {
        for name in Effects::NAMES {
            let mut one = Effects::NONE;
            *one.switch(name).unwrap() = true;
            let on: Vec<_> = one.list().into_iter().filter(|(_, on)| *on).collect();
            assert_eq!(on, [(name, true)]);
        }
        assert!(Effects::ALL.list().iter().all(|(_, on)| *on));
        assert_eq!(Effects::ALL.and(Effects::NONE), Effects::NONE);
        assert!(Effects::ALL.clone().switch("frictoin").is_none());
    }
}
