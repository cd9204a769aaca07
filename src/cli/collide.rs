//! `caromfit collide`: one collision, or a file of them.

use std::path::{Path, PathBuf};

use crate::io::cases::{self, Case, Computed};
use crate::physics::ball::{Ball, BallState, Vec3};
use crate::physics::collision::effects::{self, Choice, Estimate};
use crate::physics::collision::{Coefficients, Effects, Fidelity, Model, NotACollision, TOLERANCES};
use crate::physics::contact_frame::cue_velocity;
use crate::physics::friction_law::Law;
use crate::report::document::{self, CollideDocument};
use crate::report::templates;

use super::{Failure, print, unless_none};

/// The spin of a cue ball that rolls.
const NATURAL_ROLL: &str = "natural-roll";

#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  caromfit collide --speed 2 --cut 30 --spin natural-roll --mu 0.05 --mu-s 0.3 --e 0.94\n  \
                  caromfit collide --cases cases.csv --json\n\n\
                  A row of --cases that cannot be integrated to the tolerance (ode, contact) has \"error\" instead of its \
                  outcome, and its line is named on standard error; the others are computed, and the exit status is 1. Rows \
                  that are no collision are all named, with exit status 2, and then nothing is computed."
)]
pub(super) struct Args {
    /// Cue ball's speed, m/s
    #[arg(long, value_name = "M_S", required_unless_present = "cases", allow_hyphen_values = true)]
    speed: Option<f64>,
    /// Cut angle, degrees, between −90 and 90; positive: the cue ball moves towards +y
    #[arg(long, value_name = "DEG", required_unless_present = "cases", allow_hyphen_values = true)]
    cut: Option<f64>,
    /// Cue ball's spin x,y,z, rad/s, with x along the line of centres and z up: topspin has y > 0,
    /// side spin is z
    #[arg(long, value_name = "X,Y,Z", default_value = "0,0,0", value_parser = parse_spin, allow_hyphen_values = true)]
    omega: Vec3,
    /// Cue ball's spin by name, instead of --omega
    #[arg(long, value_parser = [NATURAL_ROLL, "stun"], conflicts_with_all = ["omega", "cases"])]
    spin: Option<String>,
    /// Sliding friction between the balls
    #[arg(long, required_unless_present = "cases", allow_hyphen_values = true)]
    mu: Option<f64>,
    /// Friction of the cloth on the object ball
    #[arg(long, required_unless_present = "cases", allow_hyphen_values = true)]
    mu_s: Option<f64>,
    /// Coefficient of restitution, 0 to 1
    #[arg(long, required_unless_present = "cases", allow_hyphen_values = true)]
    e: Option<f64>,
    /// Radius of the balls, m
    #[arg(long, value_name = "M", default_value_t = Ball::POOL.radius, allow_hyphen_values = true)]
    radius: f64,
    /// How closely the collision is modelled
    #[arg(long, value_parser = super::fidelity(), default_value = "full")]
    fidelity: super::Chosen,
    /// Of ode and contact: the error of each step, in parts of the closing speed [default: 1e-10].
    /// Of auto: what the effects left out may change together, in parts of the cue ball's speed
    /// [default: 1e-3]
    #[arg(long, value_name = "PART", value_parser = super::tolerance)]
    tolerance: Option<f64>,
    /// Say of each effect how large it is, whether it is on, and why
    #[arg(long)]
    explain: bool,
    /// Friction between the balls that decreases with their slip v, m/s: mu + B·exp(−C·v)
    #[arg(long, value_name = "B,C", value_parser = law, allow_hyphen_values = true)]
    falling: Option<Law>,
    /// Tangential compliance of the contact between the balls, 0 (rigid) or more: (2 − s)/(2 − 2s)
    /// with Poisson's ratio s. Of ode and contact [default: 0] and of auto
    /// [default: 1.258, phenolic resin]
    #[arg(long, value_name = "K", allow_hyphen_values = true)]
    kappa: Option<f64>,
    /// The cue ball's mass over the object ball's
    #[arg(long, value_name = "R", allow_hyphen_values = true)]
    mass_ratio: Option<f64>,
    /// Use the sign of the cloth's torque as printed in Kim (2024), for comparison with that paper
    #[arg(long)]
    as_printed: bool,
    /// A CSV with columns name,speed_m_s,cut_deg,omega_x,omega_y,omega_z,mu,mu_s,e,radius_m, and
    /// kappa, mass_ratio if need be
    #[arg(long, value_name = "CSV", conflicts_with_all = ["speed", "cut", "omega", "mu", "mu_s", "e", "radius"])]
    cases: Option<PathBuf>,
    /// Print only JSON, on standard output
    #[arg(long)]
    json: bool,
}

fn law(text: &str) -> Result<Law, String> {
    super::numbers(text, "two, b,c with c in s/m").map(|[b, c]| Law::Exponential { b, c })
}

fn parse_spin(text: &str) -> Result<Vec3, String> {
    super::numbers(text, "three, x,y,z in rad/s").map(|[x, y, z]| Vec3::new(x, y, z))
}

impl Args {
    /// Returns how much left out effects may change.
    fn within(&self) -> f64 {
        self.tolerance.unwrap_or(effects::NEGLIGIBLE_CHANGE)
    }

    /// Returns the model of a case; without a fidelity one that has all effects.
    fn given(&self, case: &Case) -> Result<Model, NotACollision> {
        let refused = |name, value, expected| Err(NotACollision::OutOfRange { name, value, expected });
        let (fidelity, kappa, tolerance) = match self.fidelity.0 {
            Some(fidelity) => (fidelity, None, self.tolerance.unwrap_or(Model::TOLERANCE)),
            // the integration is a thousand times as close as what the effects left out may change
            None => (Fidelity::Contact, Some(Model::KAPPA), (1e-3 * self.within()).max(*TOLERANCES.start())),
        };
        let mut model = Model::new(fidelity, Ball { radius: case.radius, ..Ball::POOL });
        if let Some(ratio) = case.mass_ratio.or(self.mass_ratio) {
            if !(ratio > 0.0 && ratio.is_finite()) {
                return refused("mass_ratio", ratio, "more than 0");
            }
            model = model.with_mass_ratio(ratio);
        }
        (model.as_printed, model.tolerance) = (self.as_printed, tolerance);
        model.law = self.falling.unwrap_or_default();
        let Some(kappa) = case.kappa.or(self.kappa).or(kappa) else { return Ok(model) };
        if kappa != 0.0 && !fidelity.effects().compliance {
            let expected =
                "0, or the fidelity ode, contact or auto, as all others are rigid along the surface";
            return refused("kappa", kappa, expected);
        }
        Ok(Model { kappa, effects: Effects { compliance: true, ..model.effects }, ..model })
    }

    fn choose(&self, case: &Case) -> Result<Choice, NotACollision> {
        let (cue, coefficients) = case.before()?;
        effects::choose(&self.given(case)?, &cue, &coefficients, self.within())
    }

    fn model(&self, case: &Case) -> Result<Model, NotACollision> {
        let model = self.given(case)?;
        if self.fidelity.0.is_some() { Ok(model) } else { Ok(self.choose(case)?.model) }
    }

    /// Returns the collision that the options state.
    fn case(&self) -> Case {
        let [speed, cut_deg, mu, mu_s, e] =
            [self.speed, self.cut, self.mu, self.mu_s, self.e].map(|stated| stated.unwrap_or(f64::NAN));
        let velocity = cue_velocity(speed, cut_deg.to_radians());
        let is_rolling = self.spin.as_deref() == Some(NATURAL_ROLL);
        let spin = if is_rolling { BallState::natural_roll(velocity, self.radius).spin } else { self.omega };
        let (name, radius, coefficients) =
            ("collision".to_owned(), self.radius, Coefficients { mu, mu_s, e });
        Case { name, speed, cut_deg, spin, coefficients, radius, kappa: None, mass_ratio: None }
    }

    /// Returns the effects, if they are asked for.
    fn explain(&self, computed: &Computed) -> Result<Option<[Estimate; 10]>, Failure> {
        let Computed { case, model, outcome, .. } = computed;
        if !self.explain || outcome.is_err() {
            return Ok(None);
        }
        let mut effects = self.choose(case)?.estimates;
        let on = model.effects.and(model.fidelity.effects()).list();
        for (effect, (_, on)) in effects.iter_mut().zip(on) {
            effect.on = on;
        }
        Ok(Some(effects))
    }
}

pub(super) fn run(args: &Args) -> Result<(), Failure> {
    let collided: Vec<Computed> = if let Some(path) = &args.cases {
        cases::collide_all(path, |case| args.model(case))?
    } else {
        let computed = args.case().compute(1, |case| args.model(case))?;
        computed.outcome?;
        vec![computed]
    };
    let (mut documents, mut failed) = (Vec::new(), Vec::new());
    for computed in &collided {
        documents.push(CollideDocument::new(computed, args.explain(computed)?));
        if let Err(why) = &computed.outcome {
            let file = args.cases.as_deref().unwrap_or(Path::new("")).display();
            failed.push(format!(
                "{file}:{}: \"{}\" was not computed: {why}",
                computed.line, computed.case.name
            ));
        }
    }
    match documents.as_slice() {
        _ if !args.json => print(&templates::text_of(include_str!("collide.jinja"), &documents))?,
        [one] if args.cases.is_none() => print(&document::exact_text(one)?)?,
        all => print(&document::exact_text(all)?)?,
    }
    unless_none(&failed, 1)
}
