//! `caromfit collide`: one collision, or a file of them.

use std::path::{Path, PathBuf};

use caromfit::io::cases::{self, BadCase, Case, Computed};
use caromfit::physics::ball::{Ball, BallState, Vec3};
use caromfit::physics::cloth_motion::Cloth;
use caromfit::physics::collision::effects::{self, Choice, Compared, Estimate};
use caromfit::physics::collision::{Effects, Fidelity, FidelityChoice, MIN_TOLERANCE, Model, Outcome};
use caromfit::physics::contact_frame::cue_velocity;
use caromfit::physics::friction_law::Law;
use caromfit::report::document::{self, CollideDocument};

use super::{Failure, print, unless_none};

/// Tolerance of an integration in parts of what the effects left out may change.
const INTEGRATION: f64 = 1e-3;

/// The spin of a cue ball that rolls.
const NATURAL_ROLL: &str = "natural-roll";

/// The effects, and the motion afterwards.
type Explained = ([Estimate; 10], [Estimate; 3]);

/// Collision frame: x along the line of centres from cue ball to object ball, z up; a positive cut
/// angle means that the cue ball moves towards +y. Topspin is omega_y > 0.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  caromfit collide --speed 2 --cut 30 --omega 0,69.99,0 --mu 0.05 --mu-s 0.3 --e 0.94\n  \
                  caromfit collide --cases cases.csv --json\n\n\
                  A row of --cases that cannot be integrated to the tolerance (ode, contact) has \"error\" in the place of its \
                  outcome, and its line is named on standard error; the others are computed, and the exit status is 1. Rows \
                  that are no collision are all named, with exit status 2, and then nothing is computed."
)]
pub struct Args {
    /// Cue ball's speed, m/s
    #[arg(long, value_name = "M_S", required_unless_present = "cases", allow_hyphen_values = true)]
    speed: Option<f64>,
    /// Cut angle, degrees, between −90 and 90; positive: the cue ball moves towards +y
    #[arg(long, value_name = "DEG", required_unless_present = "cases", allow_hyphen_values = true)]
    cut: Option<f64>,
    /// Cue ball's spin x,y,z, rad/s, with x along the line of centres and z up: topspin has y > 0, side spin is z
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
    fidelity: FidelityChoice,
    /// Of ode and contact: the error of each step, in parts of the closing speed [default: 1e-10]. Of auto:
    /// what the effects left out may change together, in parts of the cue ball's speed [default: 1e-3]
    #[arg(long, value_name = "PART", value_parser = super::tolerance)]
    tolerance: Option<f64>,
    #[arg(long, value_name = "NAMES", help = super::effects_help())]
    effects: Option<Effects>,
    /// Say of each effect how large it is, whether it is on, and why
    #[arg(long)]
    explain: bool,
    /// Friction between the balls that falls with their slip v, m/s, as mu + B·exp(−C·v); linear takes it at the first slip
    #[arg(long, value_name = "B,C", value_parser = super::law, allow_hyphen_values = true)]
    falling: Option<Law>,
    /// How far the contact between the balls gives way along the surface, 0 (rigid) or more: (2 − s)/(2 − 2s) with
    /// Poisson's ratio s. Of ode and contact [default: 0, or 1.258 (phenolic resin) where --effects has compliance] and of
    /// auto [default: 1.258]
    #[arg(long, value_name = "K", allow_hyphen_values = true)]
    kappa: Option<f64>,
    /// The cue ball's mass over the object ball's
    #[arg(long, value_name = "R", allow_hyphen_values = true)]
    mass_ratio: Option<f64>,
    /// Use the sign of the cloth's torque as printed in Kim (2024), for comparison with that paper
    #[arg(long)]
    as_printed: bool,
    /// A CSV with columns name,speed_m_s,cut_deg,omega_x,omega_y,omega_z,mu,mu_s,e,radius_m, and kappa, mass_ratio if
    /// need be
    #[arg(long, value_name = "CSV", conflicts_with_all = ["speed", "cut", "omega", "mu", "mu_s", "e", "radius"])]
    cases: Option<PathBuf>,
    /// Print JSON, and nothing else, on standard output
    #[arg(long)]
    json: bool,
}

fn parse_spin(text: &str) -> Result<Vec3, String> {
    let parts: Vec<&str> = text.split(',').map(str::trim).collect();
    let [x, y, z] = parts.as_slice() else {
        return Err(format!("{} numbers; expected three, x,y,z in rad/s", parts.len()));
    };
    let number = |part: &str| part.parse::<f64>().map_err(|_| format!("\"{part}\" is not a number"));
    Ok(Vec3::new(number(x)?, number(y)?, number(z)?))
}

pub fn run(args: &Args) -> Result<(), Failure> {
    super::simulates(args.fidelity, args.effects)?;
    let fidelity = match args.fidelity {
        FidelityChoice::Of(fidelity) => Some(fidelity),
        _ => args.effects.map(effects::cheapest),
    };
    let within = args.tolerance.unwrap_or(effects::NEGLIGIBLE_CHANGE);
    let given = |case: &Case| -> Result<Model, BadCase> {
        let ball = Ball { radius: case.radius, ..Ball::POOL };
        let mut model = Model::new(fidelity.unwrap_or(Fidelity::Contact), ball);
        if let Some(ratio) = case.mass_ratio.or(args.mass_ratio) {
            if !(ratio > 0.0 && ratio.is_finite()) {
                return Err(BadCase::MassRatio(ratio));
            }
            model = model.with_mass_ratio(ratio);
        }
        // integration must not add to what is left out
        let tolerance = match fidelity {
            Some(_) => args.tolerance.unwrap_or(Model::TOLERANCE),
            None => (INTEGRATION * within).max(MIN_TOLERANCE),
        };
        let law = args.falling.unwrap_or_default();
        let effects = args.effects.unwrap_or(model.effects);
        let model = Model { as_printed: args.as_printed, tolerance, law, effects, ..model };
        // auto and an effect that is named know what balls are made of
        let usual =
            || (fidelity.is_none() || args.effects.is_some_and(|on| on.compliance)).then_some(Model::KAPPA);
        let stated = case.kappa.or(args.kappa);
        let Some(kappa) = stated.or_else(usual) else { return Ok(model) };
        if stated.is_some() && kappa != 0.0 && !model.fidelity.effects().compliance {
            return Err(BadCase::Rigid(kappa, model.fidelity));
        }
        Ok(Model { kappa, effects: Effects { compliance: true, ..effects }, ..model })
    };
    let explain = |case: &Case| -> Result<Choice, BadCase> {
        let (cue, coefficients) = case.before()?;
        let model = given(case)?;
        Ok(effects::choose(&model, &cue, &coefficients, within, Compared::Everything)?)
    };
    let model = |case: &Case| -> Result<Model, BadCase> {
        let model = given(case)?;
        if fidelity.is_some() { Ok(model) } else { Ok(explain(case)?.model(&model)) }
    };
    let collided: Vec<Computed> = if let Some(path) = &args.cases {
        cases::collide_all(path, model)?
    } else {
        let number = |value: Option<f64>| value.unwrap_or(f64::NAN);
        let rolls = args.spin.as_deref() == Some(NATURAL_ROLL);
        let velocity = cue_velocity(number(args.speed), number(args.cut).to_radians());
        let case = Case {
            name: "collision".to_string(),
            speed: number(args.speed),
            cut_deg: number(args.cut),
            spin: if rolls { BallState::natural_roll(velocity, args.radius).spin } else { args.omega },
            mu: number(args.mu),
            mu_s: number(args.mu_s),
            e: number(args.e),
            radius: args.radius,
            kappa: None,
            mass_ratio: None,
        };
        let model = model(&case)?;
        let outcome = case.collide(&model)?;
        vec![Computed { case, line: 1, model, outcome: Ok(outcome) }]
    };
    let explained = |computed: &Computed| -> Result<Option<Explained>, Failure> {
        let Computed { case, model, outcome: Ok(outcome), .. } = computed else { return Ok(None) };
        if !args.explain {
            return Ok(None);
        }
        let mut effects = explain(case)?.estimates;
        let on = model.effects.and(model.fidelity.effects()).list();
        for (effect, (_, on)) in effects.iter_mut().zip(on) {
            effect.on = on;
        }
        let within = if fidelity.is_none() { within } else { effects::NEGLIGIBLE_CHANGE };
        let cloth = Cloth { sliding: model.mu_k, ..Cloth::default() };
        let (cue, _) = case.before()?;
        let motion = effects::motion(model, &cue, outcome, &cloth, effects::FOLLOWED, within);
        Ok(Some((effects, motion)))
    };
    let file = args.cases.as_deref().unwrap_or(Path::new(""));
    let failed: Vec<String> = collided
        .iter()
        .filter_map(|Computed { case, line, outcome, .. }| {
            let why = outcome.as_ref().err()?;
            Some(format!("{}:{line}: \"{}\" was not computed: {why}", file.display(), case.name))
        })
        .collect();
    if args.json {
        let mut objects = Vec::new();
        for computed in &collided {
            let explained = explained(computed)?;
            let explained = explained.as_ref().map(|(effects, motion)| (&effects[..], &motion[..]));
            objects.push(CollideDocument::new(computed, explained));
        }
        match objects.as_slice() {
            [one] if args.cases.is_none() => print(&document::exact_text(one)?)?,
            all => print(&document::exact_text(all)?)?,
        }
    } else {
        let mut tables = Vec::new();
        for computed in &collided {
            let Ok(outcome) = &computed.outcome else { continue };
            let mut text = table(&computed.case.name, computed.model.fidelity.name(), outcome);
            if let Some((effects, motion)) = explained(computed)? {
                text += &effects_table("effect", &effects);
                text += &effects_table(&format!("in {} s afterwards", effects::FOLLOWED), &motion);
            }
            tables.push(text);
        }
        print(&tables.join("\n"))?;
    }
    unless_none(&failed, Failure::work)
}

fn effects_table(of: &str, estimates: &[Estimate]) -> String {
    let mut text = format!("  {of:<20}{:>12}{:>6}  why\n", "size/speed", "");
    for Estimate { name, size, on, why } in estimates {
        let on = if *on { "on" } else { "off" };
        text += &format!("  {name:<20}{size:>12.1e}{on:>6}  {why}\n");
    }
    text
}

fn table(name: &str, fidelity: &str, outcome: &Outcome) -> String {
    // what rounds to nothing has no sign
    let number = |value: f64| {
        let text = format!("{value:.9}");
        if text.bytes().any(|digit| (b'1'..=b'9').contains(&digit)) { text } else { text.replace('-', "") }
    };
    let row = |what: &str, v: &Vec3| {
        format!("  {what:<28}{:>14}{:>14}{:>14}\n", number(v.x), number(v.y), number(v.z))
    };
    let object = outcome.object.velocity;
    format!(
        "{name} ({fidelity}): the contact {}s\n  {:<28}{:>14}{:>14}{:>14}\n{}{}{}{}  {:<28}{:>14}\n  {:<28}{:>14}\n",
        outcome.regime.name(),
        "collision frame",
        "x",
        "y",
        "z",
        row("cue ball velocity, m/s", &outcome.cue.velocity),
        row("cue ball spin, rad/s", &outcome.cue.spin),
        row("object ball velocity, m/s", &object),
        row("object ball spin, rad/s", &outcome.object.spin),
        "normal impulse/mass, m/s",
        number(outcome.impulse),
        "throw, degrees",
        number(object.y.atan2(object.x).to_degrees()),
    )
}
