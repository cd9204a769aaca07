//! `caromfit collide`: one collision, or a file of them.

use std::path::PathBuf;

use caromfit::ball::{Ball, BallState, Vec3};
use caromfit::cases::{self, Case};
use caromfit::collision::{ClothTorque, Model, Outcome};
use serde_json::json;

use super::{Failure, FidelityArg, print};

/// Collision frame: x along the line of centres from cue ball to object ball, z up; a positive cut
/// angle means that the cue ball moves towards +y. Topspin is omega_y > 0.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  caromfit collide --speed 2 --cut 30 --omega 0,69.99,0 --mu 0.05 --mu-s 0.3 --e 0.94\n  \
                  caromfit collide --cases cases.csv --json"
)]
pub struct Args {
    /// Cue ball's speed, m/s
    #[arg(long, value_name = "M_S", required_unless_present = "cases", allow_hyphen_values = true)]
    speed: Option<f64>,
    /// Cut angle, degrees, between −90 and 90
    #[arg(long, value_name = "DEG", required_unless_present = "cases", allow_hyphen_values = true)]
    cut: Option<f64>,
    /// Cue ball's spin x,y,z, rad/s
    #[arg(long, value_name = "X,Y,Z", default_value = "0,0,0", value_parser = parse_spin, allow_hyphen_values = true)]
    omega: Vec3,
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
    #[arg(long, value_enum, default_value = "full")]
    fidelity: FidelityArg,
    /// Of ode and contact: the error of each step, in parts of the closing speed
    #[arg(long, value_name = "PART", value_parser = super::tolerance, default_value_t = Model::TOLERANCE)]
    tolerance: f64,
    /// Use the sign of the cloth's torque as printed in Kim (2024), for comparison with that paper
    #[arg(long)]
    as_printed: bool,
    /// A CSV with columns name,speed_m_s,cut_deg,omega_x,omega_y,omega_z,mu,mu_s,e,radius_m
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
    let torque = if args.as_printed { ClothTorque::AsPrinted } else { ClothTorque::Corrected };
    let model = |radius| Model {
        cloth_torque: torque,
        tolerance: args.tolerance,
        ..Model::new(args.fidelity.0, Ball { radius, ..Ball::POOL })
    };
    let collided: Vec<(String, Outcome)> = if let Some(path) = &args.cases {
        cases::collide_all(path, model).map_err(Failure::input)?
    } else {
        let given = |value: Option<f64>| value.unwrap_or(f64::NAN);
        let case = Case {
            name: "collision".to_string(),
            speed: given(args.speed),
            cut_deg: given(args.cut),
            spin: args.omega,
            mu: given(args.mu),
            mu_s: given(args.mu_s),
            e: given(args.e),
            radius: args.radius,
        };
        let outcome = case.collide(&model(args.radius)).map_err(Failure::input)?;
        vec![(case.name, outcome)]
    };
    let fidelity = args.fidelity.0.name();
    if !args.json {
        let tables: Vec<String> =
            collided.iter().map(|(name, outcome)| table(name, fidelity, outcome)).collect();
        return print(&tables.join("\n"));
    }
    let objects: Vec<_> = collided.iter().map(|(name, outcome)| object(name, fidelity, outcome)).collect();
    let document = match objects.as_slice() {
        [one] if args.cases.is_none() => serde_json::to_string_pretty(one),
        all => serde_json::to_string_pretty(all),
    };
    print(&(document.map_err(Failure::work)? + "\n"))
}

fn object(name: &str, fidelity: &str, outcome: &Outcome) -> serde_json::Value {
    let ball =
        |state: &BallState| json!({"velocity": state.velocity.as_slice(), "spin": state.spin.as_slice()});
    json!({
        "name": name,
        "fidelity": fidelity,
        "regime": outcome.regime.name(),
        "impulse": outcome.impulse,
        "cue": ball(&outcome.cue),
        "object": ball(&outcome.object),
    })
}

fn table(name: &str, fidelity: &str, outcome: &Outcome) -> String {
    let row = |what: &str, v: &Vec3| format!("  {what:<28}{:>14.9}{:>14.9}{:>14.9}\n", v.x, v.y, v.z);
    let object = outcome.object.velocity;
    format!(
        "{name} ({fidelity}): the contact {}s\n  {:<28}{:>14}{:>14}{:>14}\n{}{}{}{}  {:<28}{:>14.9}\n  {:<28}{:>14.9}\n",
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
        outcome.impulse,
        "throw, degrees",
        object.y.atan2(object.x).to_degrees(),
    )
}
