//! caromfit: from measured collisions of two billiard balls to the friction between the balls μ,
//! the friction of the cloth on the object ball μ_s, and the coefficient of restitution e.
//!
//! Load, fit, print:
//!
//! ```
//! use std::path::Path;
//!
//! use caromfit::fit::{self, Options, footage};
//! use caromfit::measurement::parameter::Parameter;
//! use caromfit::{io, report};
//!
//! let dataset = io::load(Path::new("data/domenech-2023"))?;
//! // finds the impacts of a data set of kind "tracks"; any other stays as it is
//! let (dataset, ..) = footage::with_impacts(dataset, &|| ());
//! for fit in fit::fit(&dataset, &Options::default())? {
//!     print!("{}", report::text::render(&fit));
//!     let [mu, e] = [Parameter::Mu, Parameter::E].map(|parameter| fit.estimates[parameter as usize]);
//!     assert!(mu.std_error.is_some() && (0.9..1.0).contains(&e.value));
//! }
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
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

pub mod compare;
pub mod design;
pub mod extraction;
pub mod film;
pub mod fit;
pub mod io;
pub mod likelihood;
pub mod measurement;
pub mod numerics;
pub mod physics;
pub mod report;
pub mod simulate;
pub mod studies;
pub mod trajectory;
