//! `caromfit design`: which shots to film.

use std::path::PathBuf;

use caromfit::design::{self, Expected};
use caromfit::measurement::parameter::Parameter;
use caromfit::report::{design as report, document, write};

use super::{Failure, print};

/// What shots of each kind would tell, before they are played: the standard errors that so many give, which cut angles,
/// speeds and spins tell most, and how many a wanted standard error needs. Writes OUT/{design.csv, design.json,
/// design.svg, design.png} and prints tables. Without SPEC.toml: pool balls, 1000 fps, 0.1 mm, 40 shots each of
/// natural roll, stun, draw and side spin either way, at 1 to 4 m/s, cut 0 to 60°.
#[derive(clap::Args)]
#[command(after_long_help = r#"A SPEC.toml, all of it optional:

    [expected]                        # what you expect, roughly
    mu = 0.05
    mu_s = 0.3
    e = 0.94

    [camera]
    fps = 1000
    position_sd_mm = 0.1              # or position_sd_px with mm_per_px
    before_ms = 40                    # filmed before and after the impact
    after_ms = 40

    [ball]
    radius_m = 0.028575
    mass_kg = 0.170
    mass_kg_sd = 0.001                # of the scale: the ratio of the masses is fitted, too, without masses as 1 ± 0.02;
                                      # likewise radius_m_sd

    [object]                          # what of the object ball differs; likewise radius_m, radius_m_sd, inertia
    mass_kg = 0.165
    mass_kg_sd = 0.001

    [cloth]
    mu_k = 0.2                        # sliding; rolling resistance is mu_r

    [want]                            # standard errors; --want overrides them
    mu = 0.001

    [[kind]]                          # one for each kind of shot that you can play
    name = "thin rolls"
    cue_spin = "natural-roll"         # stun | natural-roll | draw | slide; or topspin = 0.5, in parts of the roll's
    side = 0.0                        # in parts of the roll's; with positive cuts, below 0 is outside spin
    spin_from = "known"               # known | motion (cue_spin unknown in the fit) | markers
    spin_sd_rad_s = [0.13, 0.09]      # of markers: standard errors of the cue ball's and the object ball's spin; left out:
                                      # those of two markers on each ball, filmed by this camera
    speed_m_s = [1.0, 4.0]
    cut_deg = [30.0, 60.0]
    shots = 40

Example: caromfit design --want mu=0.001,mu_s=0.02,e=0.001"#)]
pub struct Args {
    /// What is expected, the camera, and the kinds of shots; see below
    #[arg(value_name = "SPEC.toml")]
    spec: Option<PathBuf>,
    /// Standard errors that are wanted, as in mu=0.001,e=0.001
    #[arg(long, value_name = "PARAMETER=ERROR", value_delimiter = ',', value_parser = wish)]
    want: Vec<(Parameter, f64)>,
    /// Where the results go
    #[arg(long, default_value = "fits/design", value_name = "DIR")]
    out: PathBuf,
    /// Print design.json, and nothing else, on standard output
    #[arg(long)]
    json: bool,
}

fn wish(text: &str) -> Result<(Parameter, f64), String> {
    let (name, value) = text
        .split_once('=')
        .ok_or_else(|| format!("\"{text}\"; expected PARAMETER=ERROR, as in mu=0.001"))?;
    let parameter = Parameter::COEFFICIENTS.into_iter().find(|parameter| parameter.name() == name.trim());
    let parameter = parameter.ok_or_else(|| {
        format!(
            "\"{}\" is no parameter; expected one of {}",
            name.trim(),
            Parameter::COEFFICIENTS.map(Parameter::name).join(", ")
        )
    })?;
    let error: f64 = value.trim().parse().map_err(|_| format!("\"{value}\" is not a number"))?;
    let good = error > 0.0 && error.is_finite();
    good.then_some((parameter, error)).ok_or_else(|| format!("{error}; expected more than 0"))
}

pub fn run(args: &Args) -> Result<(), Failure> {
    let mut expected = match &args.spec {
        Some(path) => Expected::read(path)?,
        None => Expected::default(),
    };
    if !args.want.is_empty() {
        expected.wanted = [None; 3];
        for (parameter, error) in &args.want {
            if expected.wanted[*parameter as usize].replace(*error).is_some() {
                return Err(Failure::input(format!("--want: {} twice; expected it once", parameter.name())));
            }
        }
    }
    let of = args.spec.as_ref().map_or("the design".to_owned(), |path| path.display().to_string());
    let design = design::design(&expected)
        .map_err(|error| Failure::input(format!("{of}: a shot of it is no collision: {error}")))?;
    write::write_files(&report::files(&design)?, &args.out)?;
    if args.json {
        print(&document::text(&design)?)
    } else {
        print(&report::text(&design))?;
        print(&format!("\nSee {}\n", args.out.join("design.png").display()))
    }
}
