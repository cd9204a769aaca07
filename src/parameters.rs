//! The parameters of a fit: μ, μ_s and e, their names, bounds and starting values.

/// What is fitted.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Parameter {
    /// μ, sliding friction between the balls.
    Mu,
    /// μ_s, friction of the cloth on the object ball during the impact.
    MuS,
    /// e, energetic coefficient of restitution.
    E,
}

impl Parameter {
    /// In the order of every vector and matrix of a fit.
    pub const ALL: [Self; 3] = [Self::Mu, Self::MuS, Self::E];

    /// The name in dataset.toml and fit.json.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Mu => "mu",
            Self::MuS => "mu_s",
            Self::E => "e",
        }
    }

    /// What a table or plot calls it.
    #[must_use]
    pub fn symbol(self) -> &'static str {
        match self {
            Self::Mu => "μ",
            Self::MuS => "μ_s",
            Self::E => "e",
        }
    }

    /// What it means, in one line.
    #[must_use]
    pub fn meaning(self) -> &'static str {
        match self {
            Self::Mu => "sliding friction between the balls",
            Self::MuS => "friction of the cloth on the object ball during the impact",
            Self::E => "coefficient of restitution between the balls",
        }
    }

    /// The setting used where dataset.toml has none: the middle of the published ranges
    /// 0.03 ≤ μ ≤ 0.08, 0.2 < μ_s < 0.4, 0.92 ≤ e ≤ 0.98 (Kim 2024, Eqs. 1 and 2 and below 6) to
    /// start from, and bounds that leave room for chalked and waxed balls.
    #[must_use]
    pub fn default_setting(self) -> Setting {
        let (initial, upper) = match self {
            Self::Mu => (0.05, 0.5),
            Self::MuS => (0.3, 1.0),
            Self::E => (0.94, 1.0),
        };
        Setting { initial, lower: 0.0, upper, fixed: false, prior: None }
    }
}

/// How one parameter enters a fit. Always consistent: lower ≤ initial ≤ upper, all finite.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Setting {
    /// Where the fit starts; the value itself when `fixed`.
    pub initial: f64,
    pub lower: f64,
    pub upper: f64,
    /// Held at `initial`.
    pub fixed: bool,
    pub prior: Option<Prior>,
}

/// A Gaussian prior: one more observation of the parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Prior {
    pub mean: f64,
    pub sd: f64,
}

/// The settings of all parameters, in the order of [`Parameter::ALL`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings(pub [Setting; 3]);

impl Default for Settings {
    fn default() -> Self {
        Self(Parameter::ALL.map(Parameter::default_setting))
    }
}

impl std::ops::Index<Parameter> for Settings {
    type Output = Setting;

    fn index(&self, parameter: Parameter) -> &Setting {
        &self.0[parameter as usize]
    }
}

impl std::ops::IndexMut<Parameter> for Settings {
    fn index_mut(&mut self, parameter: Parameter) -> &mut Setting {
        &mut self.0[parameter as usize]
    }
}
