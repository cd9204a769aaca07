//! caromfit: from measured collisions of two billiard balls to the friction between the balls μ,
//! the friction of the cloth on the object ball μ_s, and the coefficient of restitution e.
//!
//! # One collision
//!
//! In the frame of a simulator's table, x and y along it and z up. `default-features = false` leaves the collision models and the motion
//! on the cloth, with few dependencies (nalgebra, num-dual, thiserror).
//!
//! ```
//! use caromfit::physics::ball::{Ball, BallState};
//! use caromfit::physics::collision::{Coefficients, Fidelity, Model};
//!
//! // rolling along x with 2 m/s; the object ball lies 30° to its left
//! let cue = BallState::natural_roll([2.0, 0.0, 0.0].into(), Ball::POOL.radius);
//! let line_of_centres = [30_f64.to_radians().cos(), 30_f64.to_radians().sin()];
//!
//! let model = Model::new(Fidelity::Full, Ball::POOL);
//! let coefficients = Coefficients { mu: 0.05, mu_s: 0.3, e: 0.94 };
//! let after = model.collide_on_table(line_of_centres, &cue, &coefficients)?;
//!
//! // friction throws the object ball off the line of centres, to the side to which the cue ball went
//! let direction = after.object.velocity.y.atan2(after.object.velocity.x).to_degrees();
//! assert!(direction < 30.0 && direction > 25.0);
//! # Ok::<(), caromfit::physics::collision::NotACollision>(())
//! ```
//!
//! The same in the frame of the collision, with the exact derivatives by the coefficients and by the motion of the cue ball:
//!
//! ```
//! use caromfit::physics::ball::{Ball, BallState};
//! use caromfit::physics::collision::{Coefficients, Fidelity, Input, Model};
//!
//! let cue = BallState::natural_roll([1.7, 1.0, 0.0].into(), Ball::POOL.radius);
//! let coefficients = Coefficients { mu: 0.05, mu_s: 0.3, e: 0.94 };
//! let (after, by) = Model::new(Fidelity::Full, Ball::POOL).collide_with_jacobian(&cue, &coefficients)?;
//!
//! // row 7 is V_y of the object ball: 0.01 more friction throws it further to the side
//! assert!(after.object.velocity.y + 0.01 * by[(7, Input::Mu as usize)] > after.object.velocity.y);
//! # Ok::<(), caromfit::physics::collision::NotACollision>(())
//! ```
//!
//! | | convention |
//! | --- | --- |
//! | units | SI: m, m/s, kg, rad/s; coefficients are dimensionless |
//! | frame | right-handed, z up; [`Model::collide_on_table`](physics::collision::Model::collide_on_table): that of the table; [`Model::collide`](physics::collision::Model::collide): x along the line of centres from cue ball to object ball, y = z × x ([`physics::contact_frame`]) |
//! | signs | a positive cut angle: the cue ball moves towards +y; ω_y > 0 is topspin, ω_y < 0 draw, ω_z > 0 side spin counterclockwise from above; natural roll is ω = z × V/R |
//! | equations | Kim 2024 (arXiv:2402.13258), Eqs. 10–16 with 1 − μ_s in Eq. 10, restitution by Eq. 37, outcome by Eqs. 42–49; `linear` is Eqs. 50–54; beyond the paper: stick, balls that differ, friction that falls with the slip, compliance, gravity |
//! | errors | `full`: 1e-14 of the speed, its derivatives 1e-10; `ode` and `contact`: their tolerance |
//! | refusals | [`NotACollision`](physics::collision::NotACollision) names the number, its value and what was expected; nothing panics |
//!
//! After the impact, [`cloth_motion::Path`](physics::cloth_motion::Path) follows each ball: flight, bounces, sliding, rolling.
#![cfg_attr(
    feature = "report",
    doc = r#"
# Fit a folder

```
use std::path::Path;

use caromfit::fit::{self, Grade, Options};
use caromfit::io;

// one entry for every kind of data: films of balls, films of discs, tables
let dataset = io::load(Path::new("data/domenech-2023"))?;
for fit in fit::fit(&dataset, &Options::default())? {
    let verdict = fit.verdict();
    println!("{}: {}", verdict.grade.name(), verdict.sentence);
    let mu = fit.mu().ok_or("no μ")?;
    assert!(verdict.grade == Grade::Good && mu.std_error.is_some_and(|error| error < 0.01));
}
# Ok::<(), Box<dyn std::error::Error>>(())
```

The defaults of [`fit::Options`] and [`compare::Options`] are what the program does. [`fit::fit_watched`] is for those who show how far
it is. A film of a program's own is made by [`TrackShot::new`](measurement::track::TrackShot::new) and
[`Dataset::filmed`](measurement::dataset::Dataset::filmed), measured impacts by
[`Shot::impact`](measurement::dataset::Shot::impact) and [`Dataset::new`](measurement::dataset::Dataset::new). With the feature
`report`, [`Fit`](fit::Fit) is `serde::Serialize`: `serde_json::to_string(&fit)` is fit.json; so are comparisons and designs. What is simulated
or designed is a text: `text.parse::<simulate::Spec>()?.with("truth.mu_s = 0.2")?`.
"#
)]
//!
//! The [`guide`] has the pages of `caromfit help`.
//!
//! A Cargo feature that a program does not need can be left out: `cli`, the program itself, builds on `report`, that on `io`, that on
//! `fit`, and all are there by default. Without any, [`physics`] is left.

// the library answers with values, never with a panic or a line on the terminal
#![cfg_attr(
    not(test),
    warn(
        clippy::unwrap_used,
        clippy::expect_used,
        clippy::panic,
        clippy::print_stdout,
        clippy::print_stderr
    )
)]
// the program uses all of the library
#![cfg_attr(not(feature = "cli"), allow(dead_code))]
// the front page names all modules, also those that were left out
#![cfg_attr(not(feature = "report"), allow(rustdoc::broken_intra_doc_links))]

#[cfg(feature = "cli")]
#[doc(hidden)]
pub mod cli;
#[cfg(feature = "fit")]
pub mod compare;
#[cfg(feature = "io")]
pub mod design;
#[cfg(feature = "fit")]
mod extraction;
#[cfg(feature = "fit")]
mod film;
#[cfg(feature = "fit")]
pub mod fit;
#[cfg(feature = "report")]
pub mod guide;
#[cfg(feature = "io")]
pub mod io;
#[cfg(feature = "fit")]
pub mod measurement;
#[cfg(feature = "fit")]
pub mod numerics;
pub mod physics;
#[cfg(feature = "fit")]
mod problem;
#[cfg(feature = "report")]
pub mod report;
#[cfg(feature = "io")]
pub mod simulate;
#[cfg(feature = "io")]
mod studies;
