//! A film of balls as one least-squares problem.
//!
//! Each shot has unknowns of its own: instant, place, direction and velocity of the cue ball, and
//! what is uncertain of its spin. All shots share those of contact, balls, cloth and camera, each
//! with a prior of what is known of it. The frames are predicted forward into the picture: through
//! the impact, the motion on the cloth, and the camera, at each frame's own time. Own unknowns are
//! eliminated (Schur complement; Triggs et al. 2000), so that a step costs time linear in the
//! frames. Noise is autoregressive of first order and whitened exactly; its size and correlation,
//! and the spreads of spins from shot to shot, are estimated by restricted maximum likelihood.
//!
//! | file | what it holds |
//! | --- | --- |
//! | `unknowns`, `priors` | unknowns of shots and films, what is known of them |
//! | `film` | from tracks to the problem, with first guesses |
//! | `impact`, `motion`, `camera` | the forward model with its derivatives |
//! | `frames` | residuals of a shot, summed to normal equations |
//! | `spins`, `states` | what is known of the cue ball's spin, and the likeliest of its states |
//! | `problem`, `descent`, `minimise`, `noise` | normal equations, descent, starts, noise |
//! | `uncertainty`, `causes`, `outliers` | errors, suspects, frames and shots that do not fit |
//! | `findings`, `policy`, `run` | what is said, statistical choices, the fit from beginning to end |

mod camera;
mod causes;
mod descent;
mod dual;
mod film;
mod findings;
mod frames;
mod impact;
mod minimise;
mod motion;
mod noise;
mod outliers;
mod policy;
mod priors;
#[allow(clippy::module_inception)]
mod problem;
mod run;
mod spins;
mod states;
#[cfg(test)]
mod tests;
mod uncertainty;
mod unknowns;

pub use film::FilmError;
pub use findings::{Finding, Severity};
pub use frames::Noise;
pub use policy::Policy;
pub use run::{Budget, Estimate, FilmFit, Rise, fit_film};
pub use uncertainty::{Conflict, Interval, Score, Share};
pub use unknowns::{Id, Normal};
