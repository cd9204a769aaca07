//! How thoroughly a minimum is looked for.

use crate::numerics::least_squares;

/// The gradient vanishes to this part of what it might be, some 1e-9 standard errors from the minimum. Further on steps follow
/// roundings, and how many there are depends on the processor.
const VELOCITIES: least_squares::Options =
    least_squares::Options { max_iterations: 1000, orthogonality: 1e-11 };

/// How thoroughly a minimum is looked for.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Effort {
    /// Rounds of weighting and minimising.
    pub rounds: usize,
    pub options: least_squares::Options,
    /// Whether a search that stalls at a kink goes on across it.
    pub crosses_kinks: bool,
}

impl Effort {
    /// To the digits that the data have.
    pub(crate) const FULL: Self = Self { rounds: usize::MAX, options: VELOCITIES, crosses_kinks: true };

    /// Near enough to tell which of several minima is the least.
    pub(crate) const SCREEN: Self = Self {
        rounds: 6,
        options: least_squares::Options { max_iterations: 50, orthogonality: 1e-6 },
        crosses_kinks: true,
    };

    /// Near enough to tell which of several regions holds the least minimum: within some hundredths of the
    /// objective's standard error.
    pub(crate) const ROUGH: Self = Self {
        rounds: 2,
        options: least_squares::Options { max_iterations: 8, orthogonality: 1e-3 },
        crosses_kinks: false,
    };
}
