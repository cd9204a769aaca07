//! The contribution of one shot to the normal equations of its problem.

use nalgebra::{DMatrix, DVector};

use super::loss::ShotLoss;
use crate::numerics::EXACT;

/// Errors of measured numbers: each keeps the part `rho` of the error of the number before it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Noise {
    /// Standard deviation, in the unit of the numbers.
    pub(crate) sd: f64,
    /// Correlation of neighbouring numbers.
    pub(crate) rho: f64,
}

/// How much an own unknown differs from shot to shot, about 0.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Spread {
    /// Standard deviation.
    pub(crate) sd: f64,
    /// Standard deviation before the data are seen.
    pub(crate) first: f64,
    /// Number of shots that it counts as.
    pub(crate) weight: f64,
    /// Smallest standard deviation that data determine.
    pub(crate) least: f64,
}

/// A number that differs from shot to shot, estimated from the data of its shot alone.
pub(crate) struct Shown {
    /// Its square; in a design the expected one.
    pub(crate) square: f64,
    /// Square of its standard error.
    pub(crate) variance: f64,
}

/// Degrees of freedom below which a noise, or a spread, stays as it is.
pub(super) const MIN_DOF: f64 = 0.5;

/// Steps to the likeliest spread s. Near it each step about halves the error of ln s or better.
const SPREAD_STEPS: usize = 20;

impl Spread {
    /// Returns what is known before the data are seen, which counts as one shot.
    pub fn first(sd: f64, least: f64) -> Self {
        Self { sd, first: sd, weight: 1.0, least }
    }

    /// Returns the estimate of a number from its data alone, y = ŝ/r with the variance v/r and
    /// r = 1 − v/s²: ŝ with the variance v is the estimate beside this spread s. `None` if the data
    /// do not determine it.
    pub fn shown(&self, value: f64, variance: f64) -> Option<Shown> {
        let part = 1.0 - variance / (self.sd * self.sd);
        (part > EXACT).then(|| Shown { square: (value / part).powi(2), variance: variance / part })
    }

    /// Returns the likeliest spread of numbers y with the variances σ², each of which counts as
    /// `each` shots, and of w shots with the spread s₀. With r = s²/(s² + σ²), restricted likelihood
    /// is greatest where Σr²(y² − σ² − s²) + w(s₀² − s²) = 0; steps are those of Fisher's scoring in
    /// ln s. It is s₀ if at that spread the degrees of freedom w + Σr are too few.
    pub fn likeliest(&self, shown: &[Shown], each: f64) -> f64 {
        let Self { first, weight, least, .. } = *self;
        let part = |number: &Shown| each * first * first / (first * first + number.variance);
        if !(weight + shown.iter().map(part).sum::<f64>() > MIN_DOF) {
            return first;
        }
        let mut sd = self.sd;
        for _ in 0..SPREAD_STEPS {
            let square = sd * sd;
            let mut excess = weight * (first * first - square);
            let mut information = weight * square.max(first * first);
            for number in shown {
                let part = each * (square / (square + number.variance)).powi(2);
                excess += part * (number.square - number.variance - square);
                information += part * square;
            }
            sd *= (0.5 * excess / information).clamp(-1.0, 1.0).exp();
        }
        sd.max(least)
    }
}

/// How much the numbers of a block vary.
#[derive(Clone)]
pub(crate) struct Variation {
    /// The noises, in the order of the sums of a contribution.
    pub(crate) noises: Vec<Noise>,
    /// Whether the noises are known, and not estimated from the residuals.
    pub(crate) is_stated: bool,
    /// Spreads of own unknowns from shot to shot.
    pub(crate) spreads: Vec<Spread>,
}

impl Variation {
    /// Returns whether noises are estimated from the residuals.
    pub(crate) fn is_estimated(&self) -> bool {
        !(self.is_stated || self.noises.is_empty())
    }
}

/// The prior of an own unknown of a shot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum OwnPrior {
    /// It keeps its value.
    Held,
    /// It is 0 with this standard deviation.
    Stated(f64),
    /// It differs from shot to shot by the spread of this index, which is estimated.
    Spread(usize),
}

/// Sums over the numbers that have one noise in common.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct NoiseSums {
    /// Weighted squares of whitened residuals.
    pub(crate) weighted: f64,
    /// Products of neighbouring residuals, and their squares.
    pub(crate) lagged: f64,
    pub(crate) square: f64,
    /// Number of independent numbers.
    pub(crate) count: f64,
    /// Logarithm of the determinant of the correlation matrix; a frame that repeats counts as in
    /// `count`.
    pub(crate) ln_determinant: f64,
}

impl NoiseSums {
    pub fn add(&mut self, other: &Self) {
        self.weighted += other.weighted;
        self.lagged += other.lagged;
        self.square += other.square;
        self.count += other.count;
        self.ln_determinant += other.ln_determinant;
    }
}

/// A number of a shot that differs from what all shots share.
#[derive(Clone)]
pub(crate) struct Scattered {
    /// Index of its spread.
    pub(crate) spread: usize,
    /// Whether its spread is estimated from it: not if it may scatter by another one instead.
    pub(crate) shows_spread: bool,
    /// The own unknown that it is, or differs from by what all shots share.
    pub(crate) place: usize,
    /// The difference.
    pub(crate) value: f64,
    /// Its derivatives by the own unknowns of the shot and the shared ones.
    pub(crate) by: DVector<f64>,
}

/// The part of a shot in a robust loss.
#[derive(Clone, Copy)]
pub(crate) struct Part {
    pub(crate) loss: ShotLoss,
    /// Distance of the shot from its prediction, in standard deviations.
    pub(crate) distance: f64,
}

/// The sums of a shot without their derivatives.
#[derive(Clone, Default)]
pub(crate) struct ShotSums {
    /// χ² with the losses of frames and shots; infinite if the unknowns describe no collision.
    pub(crate) cost: f64,
    /// Sums of each noise of the block.
    pub(crate) noises: Vec<NoiseSums>,
    pub(crate) sticks: bool,
    /// Own unknowns that are held.
    pub(crate) held: Vec<bool>,
    /// Precision to which each own unknown is known without the data.
    pub(crate) known: Vec<f64>,
    /// The numbers that scatter from shot to shot.
    pub(crate) scattered: Vec<Scattered>,
    /// `None` by least squares.
    pub(crate) part: Option<Part>,
}

impl ShotSums {
    /// Returns the weight of the shot by its loss, 1 by least squares.
    pub(crate) fn weight(&self) -> f64 {
        self.part.map_or(1.0, |part| part.loss.weight(part.distance))
    }

    /// Returns the number of own unknowns that are not held.
    pub(crate) fn count_free(&self) -> usize {
        self.held.iter().filter(|held| !**held).count()
    }
}

/// The contribution of a shot to the normal equations.
#[derive(Clone)]
pub(crate) struct Contribution {
    /// JᵀJ by own unknowns, the shared unknowns that the shot may depend on, which are the first of
    /// its sample, and the residual as the last column (upper triangle).
    pub(crate) products: DMatrix<f64>,
    pub(crate) sums: ShotSums,
}

impl Contribution {
    /// Returns empty sums, for `own` unknowns of a shot, the first `shared` ones of its sample and
    /// some noises of its block.
    pub fn empty(own: usize, shared: usize, noises: usize) -> Self {
        let size = own + shared + 1;
        let (noises, held, known) = (vec![NoiseSums::default(); noises], vec![false; own], vec![0.0; own]);
        let sums = ShotSums { noises, held, known, ..ShotSums::default() };
        Self { products: DMatrix::zeros(size, size), sums }
    }

    /// Returns the contribution of unknowns that describe no collision.
    pub(crate) fn impossible(own: usize, shared: usize, noises: usize) -> Self {
        let mut sums = Self::empty(own, shared, noises);
        sums.sums.cost = f64::INFINITY;
        sums
    }

    /// Returns the sums if all are finite, and those of no collision if not.
    pub(crate) fn or_impossible(self) -> Self {
        // what is not finite in a row is so in its square
        let is_finite = self.sums.cost.is_finite() && self.products.trace().is_finite();
        if is_finite {
            return self;
        }
        Self::impossible(self.sums.held.len(), self.shared(), self.sums.noises.len())
    }

    /// Weighs the shot by a loss of its distance, whose square is in the sums.
    pub(crate) fn weigh(&mut self, loss: ShotLoss, distance: f64) {
        self.products *= loss.weight(distance);
        self.sums.cost += loss.cost(distance) - distance * distance;
        self.sums.part = Some(Part { loss, distance });
    }

    /// Returns the number of shared unknowns that the shot may depend on.
    pub fn shared(&self) -> usize {
        self.products.ncols() - 1 - self.sums.held.len()
    }

    /// Returns half of dχ²/dx of an own unknown.
    pub fn slope(&self, place: usize) -> f64 {
        self.products[(place, self.products.ncols() - 1)]
    }

    /// Adds what is known of the own unknown at `place`.
    pub(crate) fn add_prior(&mut self, (place, prior): (usize, OwnPrior), value: f64, spreads: &[Spread]) {
        let mut by = DVector::zeros(self.products.ncols() - 1);
        by[place] = 1.0;
        match prior {
            OwnPrior::Held => self.sums.held[place] = true,
            OwnPrior::Stated(sd) => self.add_stated((place, sd), value, &by),
            OwnPrior::Spread(spread) => {
                self.add_scattered(Scattered { spread, shows_spread: true, place, value, by }, spreads);
            }
        }
    }

    /// Adds what is known of an own unknown with an error, of which a number with these derivatives
    /// is a measurement.
    pub(crate) fn add_stated(&mut self, (place, sd): (usize, f64), value: f64, by: &DVector<f64>) {
        self.sums.known[place] = sd.powi(-2);
        self.add_number(value / sd, (by / sd).as_slice());
    }

    /// Adds a number that scatters.
    pub(crate) fn add_scattered(&mut self, number: Scattered, spreads: &[Spread]) {
        self.add_stated((number.place, spreads[number.spread].sd), number.value, &number.by);
        self.sums.scattered.push(number);
    }

    /// Adds a residual with its derivatives by the first unknowns, both in standard deviations.
    pub(crate) fn add_number(&mut self, residual: f64, by: &[f64]) {
        let last = self.products.ncols() - 1;
        for (column, factor) in by.iter().enumerate().filter(|(_, factor)| **factor != 0.0) {
            for (row, other) in by[..=column].iter().enumerate() {
                self.products[(row, column)] += other * factor;
            }
            self.products[(column, last)] += factor * residual;
        }
        self.products[(last, last)] += residual * residual;
        self.sums.cost += residual * residual;
    }

    /// Copies the sums of an unknown to another one, on which all numbers depend in the same way.
    pub(crate) fn repeat(&mut self, from: usize, to: usize) {
        for place in 0..self.products.ncols() {
            let other = if place == to { from } else { place };
            let product = self.products[(from.min(other), from.max(other))];
            self.products[(to.min(place), to.max(place))] = product;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{Shown, Spread};

    /// Numbers of which none is measured leave a spread as it was, and do not make it small; two that
    /// are measured show theirs.
    #[test]
    fn a_spread_is_estimated_if_numbers_show_it() {
        let spread = Spread { sd: 0.05, first: 0.05, weight: 0.0, least: 1e-4 };
        let all = |square: f64, variance: f64| [0; 2].map(|_| Shown { square, variance });
        assert_eq!(spread.likeliest(&all(1e-6, 1.0), 1.0).to_bits(), spread.first.to_bits());
        assert!((spread.likeliest(&all(4e-4, 1e-8), 1.0) - 0.02).abs() < 1e-4);
        assert_eq!(spread.likeliest(&[], f64::NAN).to_bits(), spread.first.to_bits());
    }
}
