//! What a simulation of an impact contains: one switch for each effect.

use std::str::FromStr;

use crate::physics::name::UnknownName;

/// Effects of an impact, each on or off. [`super::Fidelity::effects`] gives those that a fidelity can simulate.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[allow(clippy::struct_excessive_bools)] // any combination of the effects is one that can be asked for
pub struct Effects {
    /// The balls lose energy in the impact: e < 1.
    pub inelasticity: bool,
    /// Friction between the balls.
    pub friction: bool,
    /// Friction between the balls ends when their slip has stopped: the contact sticks.
    pub stick: bool,
    /// The friction between the balls turns with the slip during the impact.
    pub turning: bool,
    /// Friction of the cloth on a ball that is pressed down: on the object ball, with topspin.
    pub cloth: bool,
    /// The cloth's friction follows the object ball's slip on it, and is not just along −x.
    pub cloth_turning: bool,
    /// Friction of the cloth on the cue ball, with draw.
    pub cloth_on_cue: bool,
    /// Gravity during the contact, with the balls' weight on the cloth.
    pub gravity: bool,
    /// Friction between the balls that depends on the slip follows it during the impact.
    pub falling_friction: bool,
    /// The contact gives way along the surface and springs back, by κ of [`super::Model`].
    pub compliance: bool,
}

impl Effects {
    /// Two rigid balls that exchange their velocities along the line of centres.
    pub const NONE: Self = Self {
        inelasticity: false,
        friction: false,
        stick: false,
        turning: false,
        cloth: false,
        cloth_turning: false,
        cloth_on_cue: false,
        gravity: false,
        falling_friction: false,
        compliance: false,
    };

    /// All effects.
    pub const ALL: Self = Self {
        inelasticity: true,
        friction: true,
        stick: true,
        turning: true,
        cloth: true,
        cloth_turning: true,
        cloth_on_cue: true,
        gravity: true,
        falling_friction: true,
        compliance: true,
    };

    /// The names of the effects, as on the command line and in fit.json.
    pub const NAMES: [&'static str; 10] = [
        "inelasticity",
        "friction",
        "stick",
        "turning",
        "cloth",
        "cloth-turning",
        "cloth-on-cue",
        "gravity",
        "falling-friction",
        "compliance",
    ];

    /// Each effect's name and whether it is on, in the order of [`Effects::NAMES`].
    #[must_use]
    pub fn list(&self) -> [(&'static str, bool); 10] {
        let mut copy = *self;
        Self::NAMES.map(|name| (name, copy.switch(name).is_some_and(|on| *on)))
    }

    /// The switch of a name of [`Effects::NAMES`].
    pub fn switch(&mut self, name: &str) -> Option<&mut bool> {
        Some(match name {
            "inelasticity" => &mut self.inelasticity,
            "friction" => &mut self.friction,
            "stick" => &mut self.stick,
            "turning" => &mut self.turning,
            "cloth" => &mut self.cloth,
            "cloth-turning" => &mut self.cloth_turning,
            "cloth-on-cue" => &mut self.cloth_on_cue,
            "gravity" => &mut self.gravity,
            "falling-friction" => &mut self.falling_friction,
            "compliance" => &mut self.compliance,
            _ => return None,
        })
    }

    /// The effects that are on in both.
    #[must_use]
    pub fn and(self, other: Self) -> Self {
        Self {
            inelasticity: self.inelasticity && other.inelasticity,
            friction: self.friction && other.friction,
            stick: self.stick && other.stick,
            turning: self.turning && other.turning,
            cloth: self.cloth && other.cloth,
            cloth_turning: self.cloth_turning && other.cloth_turning,
            cloth_on_cue: self.cloth_on_cue && other.cloth_on_cue,
            gravity: self.gravity && other.gravity,
            falling_friction: self.falling_friction && other.falling_friction,
            compliance: self.compliance && other.compliance,
        }
    }
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
