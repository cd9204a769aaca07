//! `caromfit synth`: a synthetic data set.

use std::path::PathBuf;

use caromfit::physics::ball::Ball;
use caromfit::physics::collision::{FidelityChoice, Model};
use caromfit::physics::friction_law::Law;
use caromfit::report::document::{self, SynthDocument};
use caromfit::report::write;
use caromfit::simulate;

use super::{Failure, print};

/// Makes dataset.toml, shots.csv (tracks.csv for footage) and truth.json in DIR, the same for the same SPEC.
#[derive(clap::Args)]
#[command(after_long_help = r#"A SPEC.toml:

    name = "two-cloths-a"
    kind = "impacts"                  # impacts | angles | tracks
    seed = 1

    [truth]
    mu = 0.05
    mu_s = 0.3
    e = 0.94
    # kappa = 1.258                   # the contact gives way along its surface; left out: rigid
    # mu_b = 0.1                      # with mu_c: friction that falls with the slip v, mu + mu_b·exp(-mu_c·v)
    # mu_c = 1.1
    # e_slope = 0.02                  # e - e_slope·v, v the closing speed

    [shots]
    count = 40
    speed_m_s = [1.0, 4.0]
    cut_deg = [-50.0, 50.0]
    cue_spin = ["natural-roll"]       # any of stun, natural-roll, almost-roll, draw, side, slight-side, any; played in turn

    [noise]                           # standard deviations; left out means exact
    velocity_m_s = 0.005              # every velocity and speed after the impact, and before (impacts)
    line_of_centres_deg = 0.1         # impacts
    spin_rad_s = 1.0                  # impacts, where spins are given
    angle_deg = 0.3                   # angles

    [camera]                          # tracks; optional
    fps = 1000
    position_sd_m = 1e-4              # of every coordinate
    before_ms = 40                    # filmed before and after the impact
    after_ms = 40
    gaps = 0.0                        # part of the positions that are missing
    outliers = 0.0                    # part of the positions that are wrong by up to 20 mm
    markers = 0                       # marker points on each ball, which show its spin

    [cloth]                           # tracks; optional
    mu_k = 0.2                        # sliding friction
    mu_r = 0.01                       # rolling resistance
    bounce = 0.5                      # restitution of a ball that falls on the bed

    [ball]                            # optional: the balls as they are
    radius_m = 0.028575
    mass_kg = 0.170
    # mass_kg_sd = 0.001              # of the scale: dataset.toml states a mass that is off by as much; likewise radius_m_sd

    # [object]                        # what of the object ball differs; likewise radius_m, radius_m_sd, inertia
    # mass_kg = 0.165
    # mass_kg_sd = 0.001

Example: caromfit synth spec.toml --out data/two-cloths-a"#)]
pub struct Args {
    /// What to make; see below
    #[arg(value_name = "SPEC.toml")]
    spec: PathBuf,
    /// A new folder, or one that synth made: no other data set is replaced
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Collision model; full, or ode if the contact gives way, unless given
    #[arg(long, value_parser = super::fidelity())]
    fidelity: Option<FidelityChoice>,
    /// Error of each step of ode and contact, in parts of the closing speed
    #[arg(long, value_name = "PART", value_parser = super::tolerance, default_value_t = Model::TOLERANCE)]
    tolerance: f64,
    /// Friction between the balls that falls with their slip v, m/s, as mu + B·exp(−C·v), instead of mu_b and mu_c under [truth];
    /// linear takes it at the first slip
    #[arg(long, value_name = "B,C", value_parser = super::law, allow_hyphen_values = true)]
    falling: Option<Law>,
    /// Print what was made as JSON, and nothing else, on standard output
    #[arg(long)]
    json: bool,
}

/// How a dataset.toml begins that was made here.
const SYNTHETIC: &str = "# Synthetic:";

pub fn run(args: &Args) -> Result<(), Failure> {
    let mut spec = simulate::read(&args.spec)?;
    if let Some(Law::Exponential { b, c }) = args.falling {
        if spec.truth.mu_b.or(spec.truth.mu_c).is_some() {
            let message = "--falling, and mu_b or mu_c under [truth]; expected one of them";
            return Err(Failure::input(format!("{}: {message}", args.spec.display())));
        }
        (spec.truth.mu_b, spec.truth.mu_c) = (Some(b), Some(c));
    }
    let model = match args.fidelity {
        Some(FidelityChoice::Of(fidelity)) => Model::new(fidelity, Ball::POOL),
        Some(_) => return Err(Failure::input("--fidelity auto: expected one for all shots")),
        None => spec.usual_model(),
    };
    let model = Model { tolerance: args.tolerance, ..model };
    let fidelity = model.fidelity;
    let files = simulate::generate_with(&spec, &model)
        .map_err(|error| Failure::input(format!("{}: {error}", args.spec.display())))?;
    // another's data set is not replaced
    let there = args.out.join("dataset.toml");
    if std::fs::read_to_string(&there).is_ok_and(|text| !text.starts_with(SYNTHETIC)) {
        let message = "is no synthetic data set, and is not replaced; expected another --out";
        return Err(Failure::input(format!("{}: {message}", there.display())));
    }
    let files: Vec<_> = files.into_iter().map(|(name, text)| (name, text.into_bytes())).collect();
    write::write_files(&files, &args.out)?;
    if args.json {
        let names = files.iter().map(|(name, _)| (*name).to_owned()).collect();
        return print(&document::text(&SynthDocument::new(&spec, fidelity, &args.out, names))?);
    }
    print(&format!("{} shots in {}\n", spec.shots.count, args.out.display()))
}
