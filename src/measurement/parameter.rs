//! The parameters of a fit: their names, bounds, starting values and priors.

use super::fault::{FINITE, Fault, POSITIVE};
use crate::name::{by_name, worded};
use crate::physics::collision::{Coefficients, MAX_KAPPA, Model};

worded! {
    /// A parameter that a fit can estimate, in the order of every vector and matrix of a fit.
    #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
    #[non_exhaustive]
    pub enum Parameter {
        /// μ, sliding friction between the balls; the a of μ(v) = a + b exp(−c v).
        Mu = "mu" | "μ" | "sliding friction between the balls",
        /// μ_s, friction of the cloth on the object ball during the impact.
        MuS = "mu_s" | "μ_s" | "friction of the cloth on the object ball during the impact",
        /// e, energetic coefficient of restitution; the e₀ of e(v) = e₀ − e₁v.
        E = "e" | "e" | "coefficient of restitution between the balls",
        /// b, the excess of μ at the end of the slip over μ at high speed.
        B =
            "mu_b" | "b" |
            "friction between the balls decreases with their slip v as μ + b·exp(−c·v): how far, no unit",
        /// c, how fast μ decreases with the slip, s/m.
        C = "mu_c" | "c" | "how fast it decreases with v, in s/m",
        /// κ, the compliance of the contact along its surface ([`Model::kappa`]).
        Kappa = "kappa" | "κ" | "tangential compliance of the contact between the balls",
        /// e₁, how fast e decreases with the closing speed, s/m ([`Model::e_slope`]).
        ESlope =
            "e_slope" | "e₁" | "restitution decreases with the closing speed v as e − e₁·v: how fast, in s/m",
        /// m_cue/m_object, of balls whose masses are not exact.
        MassRatio = "mass_ratio" | "m_cue/m_object" | "mass of the cue ball over that of the object ball",
        /// R_cue/R_object, of radii that are stated with their errors.
        RadiusRatio =
            "radius_ratio" | "R_cue/R_object" | "radius of the cue ball over that of the object ball",
    }
    /// The name in dataset.toml and fit.json.
    pub fn name;
    /// The symbol in tables and plots.
    pub fn symbol;
    /// The meaning, in one line.
    pub fn meaning;
}

impl Parameter {
    /// The parameters that every fit has: the first of [`Parameter::ALL`].
    pub const COEFFICIENTS: [Self; 3] = [Self::Mu, Self::MuS, Self::E];

    /// Returns whether it is a ratio of the balls, with the stated balls as its prior.
    pub fn is_of_balls(self) -> bool {
        matches!(self, Self::MassRatio | Self::RadiusRatio)
    }

    /// `s/m` for c and e₁; empty for the others, which are ratios.
    pub fn unit(self) -> &'static str {
        if matches!(self, Self::C | Self::ESlope) { "s/m" } else { "" }
    }

    /// Returns the setting that is used if dataset.toml does not state it: the middle of the
    /// published ranges 0.03 ≤ μ ≤ 0.08, 0.2 < μ_s < 0.4, 0.92 ≤ e ≤ 0.98 (Kim 2024, Eqs. 1 and 2
    /// and below 6), and bounds with room for chalked and waxed balls. c is held at the 1.088 s/m
    /// of D. Alciatore (TP A-14), κ at that of phenolic resin, as few data determine them.
    pub fn default_setting(self) -> Setting {
        let (initial, lower, upper) = match self {
            Self::Mu => (0.05, 0.0, 0.5),
            Self::MuS => (0.3, 0.0, 1.0),
            Self::E => (0.94, 0.0, 1.0),
            Self::B => (0.05, 0.0, 1.0),
            Self::C => (1.088, 0.1, 20.0),
            Self::Kappa => (Model::KAPPA, 0.0, 20.0),
            Self::ESlope => (0.02, 0.0, 1.0),
            Self::MassRatio => (1.0, 0.01, 100.0),
            Self::RadiusRatio => (1.0, 0.2, 5.0),
        };
        let fixed = matches!(self, Self::C | Self::Kappa | Self::MassRatio | Self::RadiusRatio);
        Setting { initial, lower, upper, fixed, prior: None }
    }
}

// By its name or its symbol.
by_name!(Parameter, "parameter", ALL, name, symbol);

/// How one parameter enters a fit. A fit refuses what [`Setting::faults`] finds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Setting {
    /// The value of a parameter that is `fixed`, or that the data do not identify.
    pub initial: f64,
    /// The lower bound.
    pub lower: f64,
    /// The upper bound.
    pub upper: f64,
    /// Whether the parameter is held at `initial`.
    pub fixed: bool,
    /// The prior of the parameter.
    pub prior: Option<Prior>,
}

impl Setting {
    /// Returns the setting of a parameter that is held at `value`.
    pub fn held(value: f64) -> Self {
        Self { initial: value, lower: value, upper: value, fixed: true, prior: None }
    }

    /// Returns what keeps a fit from using it: numbers out of range, bounds that leave no value, an
    /// initial value outside them.
    pub fn faults(&self, parameter: Parameter) -> Vec<Fault> {
        let Self { initial, lower, upper, fixed, prior } = *self;
        let name = parameter.name();
        let fault = |key: &str, value: f64, expected: String| {
            Fault::new(&format!("{name}.{key}"), format!("{value:?}"), expected)
        };
        let value_key = if fixed { "fixed" } else { "initial" };
        let (range, allowed) = match parameter {
            Parameter::E => (0.0..=1.0, "0 to 1"),
            Parameter::Kappa => (0.0..=MAX_KAPPA, "0 (rigid along the surface) to 100"),
            Parameter::ESlope => (-1.0..=1.0, "-1 to 1 s/m"),
            _ => (0.0..=f64::MAX, "0 or more"),
        };
        let mut faults = Vec::new();
        for (key, value) in [("lower", lower), ("upper", upper), (value_key, initial)] {
            if !range.contains(&value) {
                faults.push(fault(key, value, allowed.to_owned()));
            }
        }
        if faults.is_empty() && lower > upper {
            faults.push(fault("lower", lower, format!("at most {name}.upper, {upper:?}")));
        } else if faults.is_empty() && !(lower..=upper).contains(&initial) {
            faults.push(fault(value_key, initial, format!("{lower:?} to {upper:?}, its bounds")));
        }
        if let Some(Prior { mean, sd }) = prior {
            faults.extend(Fault::of_number(&format!("{name}.prior_mean"), mean, FINITE));
            faults.extend(Fault::of_number(&format!("{name}.prior_sd"), sd, POSITIVE));
        }
        faults
    }
}

/// A Gaussian prior: one more observation of the parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Prior {
    /// The mean, in the parameter's unit.
    pub mean: f64,
    /// The standard deviation, in the parameter's unit.
    pub sd: f64,
}

/// The settings of all parameters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// The setting of each parameter, in the order of [`Parameter::ALL`].
    pub each: [Setting; Parameter::ALL.len()],
    /// Whether friction decreases with the slip; if not, b and c have no part in a fit.
    pub falls: bool,
    /// Whether the contact is compliant; if it is stated, κ has a part in a fit.
    pub compliance: Compliance,
    /// Whether e decreases with the closing speed; if not, e₁ has no part in a fit.
    pub e_falls: bool,
}

/// Whether the contact between the balls is compliant along its surface.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Compliance {
    /// The data decide whether it does, with the κ that its setting holds.
    #[default]
    Auto,
    /// The contact is rigid along its surface.
    Rigid,
    /// The contact is compliant, with the κ that its setting states or leaves free.
    Stated,
}

impl Settings {
    /// Returns whether a fit has a parameter.
    pub fn has(&self, parameter: Parameter) -> bool {
        match parameter {
            Parameter::Mu | Parameter::MuS | Parameter::E => true,
            Parameter::B | Parameter::C => self.falls,
            Parameter::Kappa => self.compliance == Compliance::Stated,
            Parameter::ESlope => self.e_falls,
            Parameter::MassRatio | Parameter::RadiusRatio => self[parameter].prior.is_some(),
        }
    }

    /// Returns the initial values of μ, μ_s and e.
    pub fn coefficients(&self) -> Coefficients {
        let [mu, mu_s, e] = Parameter::COEFFICIENTS.map(|parameter| self[parameter].initial);
        Coefficients { mu, mu_s, e }
    }

    /// Returns the parameters that a fit has, in the order of [`Parameter::ALL`].
    pub fn parameters(&self) -> Vec<Parameter> {
        Parameter::ALL.into_iter().filter(|parameter| self.has(*parameter)).collect()
    }
}

impl Default for Settings {
    fn default() -> Self {
        let each = Parameter::ALL.map(Parameter::default_setting);
        Self { each, falls: false, compliance: Compliance::Auto, e_falls: false }
    }
}

impl std::ops::Index<Parameter> for Settings {
    type Output = Setting;

    fn index(&self, parameter: Parameter) -> &Setting {
        &self.each[parameter as usize]
    }
}

impl std::ops::IndexMut<Parameter> for Settings {
    fn index_mut(&mut self, parameter: Parameter) -> &mut Setting {
        &mut self.each[parameter as usize]
    }
}
