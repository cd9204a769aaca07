//! caromfit: from measured collisions of two billiard balls to the friction between the balls μ,
//! the friction of the cloth on the object ball μ_s, and the coefficient of restitution e.
//!
//! # One collision
//!
//! In the collision's own frame: x along the line of centres, z up.
//!
//! ```
//! use caromfit::physics::ball::{Ball, BallState};
//! use caromfit::physics::collision::{Coefficients, Fidelity, Model};
//!
//! let model = Model::new(Fidelity::Full, Ball::POOL);
//! // 2 m/s, a cut of 30°, rolling
//! let (sin, cos) = 30_f64.to_radians().sin_cos();
//! let rolling = 2.0 / Ball::POOL.radius;
//! let cue = BallState {
//!     velocity: [2.0 * cos, 2.0 * sin, 0.0].into(),
//!     spin: [-rolling * sin, rolling * cos, 0.0].into(),
//! };
//! let after = model.collide(&cue, &Coefficients { mu: 0.05, mu_s: 0.3, e: 0.94 })?;
//! let throw = after.object.velocity.y.atan2(after.object.velocity.x);
//! assert!(throw > 0.0 && throw < 5_f64.to_radians());
//! # Ok::<(), caromfit::physics::collision::NotACollision>(())
//! ```
//!
//! # Fit a folder
//!
//! ```
//! use std::path::Path;
//!
//! use caromfit::fit::{Grade, Options};
//! use caromfit::{analyse, io};
//!
//! // one entry for every kind of data: of footage the camera is found and the impacts are extracted first
//! let dataset = io::load(Path::new("data/domenech-2023"))?;
//! for fit in analyse(dataset, &Options::default(), None, &|| ()).fits? {
//!     let verdict = fit.verdict();
//!     println!("{}: {}", verdict.grade.name(), verdict.sentence);
//!     let mu = fit.mu().ok_or("no μ")?;
//!     assert!(verdict.grade == Grade::Good && mu.std_error.is_some_and(|error| error < 0.01));
//! }
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Compare two cloths
//!
//! ```
//! use caromfit::compare::{self, Quantity};
//! use caromfit::measurement::parameter::Parameter;
//! use caromfit::simulate::{self, Spec};
//!
//! // measured data come from `io::load`, or from `Dataset::new` with `Shot::impact` for each shot
//! let mut cloths = Vec::new();
//! for (name, mu_s) in [("new", 0.2), ("worn", 0.4)] {
//!     let spec: Spec = toml::from_str(&format!(
//!         r#"
//!         name = "{name}"
//!         kind = "impacts"
//!         seed = 1
//!         truth = {{ mu = 0.05, mu_s = {mu_s}, e = 0.94 }}
//!         shots = {{ count = 40, speed_m_s = [1, 4], cut_deg = [-50, 50], cue_spin = ["natural-roll"] }}
//!         noise = {{ velocity_m_s = 0.002, line_of_centres_deg = 0.05 }}
//!         "#
//!     ))?;
//!     let mut dataset = simulate::dataset(&spec)?;
//!     dataset.cloth = Some(name.to_owned());
//!     cloths.push(dataset);
//! }
//! let comparison = compare::compare(&cloths, &compare::Options::default())?;
//! println!("{}", comparison.verdict().sentence);
//! let mu_s = Quantity::Parameter(Parameter::MuS);
//! let compared = comparison.quantities.iter().find(|own| own.quantity == mu_s).ok_or("no μ_s")?;
//! assert!(compared.differences[0].is_real());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! The [`guide`] has the pages of `caromfit help`.
//!
//! The modules in the order of the house: each uses only those above it.
//!
//! | module | what it holds |
//! | --- | --- |
//! | [`physics`] | balls, discs, friction, motion on the cloth, the collision models |
//! | [`numerics`] | least squares under constraints, quadrature: knows no balls |
//! | [`measurement`] | what was measured, as values: data set, shot, track, observable, parameter |
//! | [`film`] | what a camera makes of the table, and back |
//! | [`io`] | files to measurements and back |
//! | [`trajectory`] | the motion of both balls before, through and after an impact |
//! | [`likelihood`] | of the frames, the velocities or the angles of one shot |
//! | [`extraction`] | frames to impacts |
//! | [`fit`] | data set to estimates with their uncertainties |
//! | [`compare`], [`design`], [`simulate`], [`studies`] | what is built on fits |
//! | [`report`] | results as text, HTML, JSON, CSV and plots |
//! | [`guide`] | what a user of the program reads |

pub mod compare;
pub mod design;
pub mod extraction;
pub mod film;
pub mod fit;
pub mod guide;
pub mod io;
pub mod likelihood;
pub mod measurement;
pub mod numerics;
pub mod physics;
pub mod report;
pub mod simulate;
pub mod studies;
pub mod trajectory;

pub use fit::analyse;
