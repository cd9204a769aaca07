//! Several data sets in one fit: which quantities differ between cloths or balls, by how much, how surely.
//!
//! Each data set, or each label of its `[fit] by`, is first fitted alone: cleaned, with its causes and
//! spins. All of them are then samples of one problem ([`crate::problem`]) whose shared unknowns have a
//! column each: quantities that are compared one for each label, the others one for all; ratios of masses
//! and radii one for each set of balls, the camera one for each film or one for all, the cloth one for
//! each cloth. Priors count once per column.
//!
//! "Same" is the fit of the problem in which a quantity has a column for each label with the columns made
//! equal, at the noise of the larger model, so that its rise of χ² is a likelihood ratio.

mod alone;
mod analysis;
mod columns;
mod compared;
mod effect;
mod error;
mod findings;
mod joint;
mod likelihood_ratio;
mod options;
mod quantity;
mod result;
mod verdict;

pub use analysis::{Analysis, STAGES, analyse, analyse_watched, compare};
pub use effect::Effect;
pub use error::CompareError;
pub use findings::{Finding, Reason};
pub use options::Options;
pub use quantity::Quantity;
pub use result::{
    Compared, Comparison, Difference, LabelResidual, LikelihoodRatio, Robust, SampleSummary, TestKind, Value,
};
