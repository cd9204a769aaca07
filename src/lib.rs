//! caromfit: from measured collisions of two billiard balls to the friction between the balls μ,
//! the friction of the cloth on the object ball μ_s, and the coefficient of restitution e.
//!
//! Load, fit, print:
//!
//! ```
//! use std::path::Path;
//!
//! use caromfit::fit::{self, Options};
//! use caromfit::parameters::Parameter;
//! use caromfit::{dataset, footage, report};
//!
//! let dataset = dataset::load(Path::new("data/domenech-2023"))?;
//! // finds the impacts of a data set of kind "tracks"; any other stays as it is
//! let (dataset, ..) = footage::with_impacts(dataset, &|| ());
//! for fit in fit::fit(&dataset, &Options::default())? {
//!     print!("{}", report::text::render(&fit));
//!     let [mu, e] = [Parameter::Mu, Parameter::E].map(|parameter| fit.estimates[parameter as usize]);
//!     assert!(mu.std_error.is_some() && (0.9..1.0).contains(&e.value));
//! }
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod accuracy;
pub mod ball;
pub mod baseline;
pub mod bias;
pub mod cases;
pub mod check;
pub mod cloth;
pub mod collision;
pub mod compare;
pub mod contact;
pub mod dataset;
pub mod design;
pub mod disc;
pub mod effects;
pub mod export;
pub mod fit;
pub mod footage;
pub mod friction;
pub mod impact;
pub mod init;
pub mod inputs;
mod isolate;
pub mod loss;
mod number;
pub mod observable;
pub mod optimise;
pub mod parameters;
pub mod predict;
mod quadrature;
pub mod relation;
pub mod report;
pub mod residuals;
mod rigid;
pub mod stored;
pub mod synth;
pub mod track;
pub mod values;
pub mod whitening;
