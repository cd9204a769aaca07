//! Numbers side by side: the same steps with inputs that differ a little, for derivatives.

use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub};

/// How many.
pub(super) const LANES: usize = 8;

/// A plain number, or several side by side.
pub(super) trait Real:
    Copy
    + From<f64>
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + Sub<f64, Output = Self>
    + Mul<f64, Output = Self>
    + AddAssign
{
    fn sqrt(self) -> Self;
    fn exp(self) -> Self;
    /// The first number.
    fn first(self) -> f64;
}

impl Real for f64 {
    #[inline(always)]
    fn sqrt(self) -> Self {
        f64::sqrt(self)
    }

    #[inline(always)]
    fn exp(self) -> Self {
        f64::exp(self)
    }

    #[inline(always)]
    fn first(self) -> f64 {
        self
    }
}

/// Numbers side by side.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lanes(pub [f64; LANES]);

impl From<f64> for Lanes {
    #[inline(always)]
    fn from(value: f64) -> Self {
        Self([value; LANES])
    }
}

impl Real for Lanes {
    #[inline(always)]
    fn sqrt(mut self) -> Self {
        for lane in &mut self.0 {
            *lane = lane.sqrt();
        }
        self
    }

    #[inline(always)]
    fn exp(mut self) -> Self {
        for lane in &mut self.0 {
            *lane = lane.exp();
        }
        self
    }

    #[inline(always)]
    fn first(self) -> f64 {
        self.0[0]
    }
}

impl Neg for Lanes {
    type Output = Self;

    #[inline(always)]
    fn neg(mut self) -> Self {
        for lane in &mut self.0 {
            *lane = -*lane;
        }
        self
    }
}

impl AddAssign for Lanes {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        for i in 0..LANES {
            self.0[i] += other.0[i];
        }
    }
}

/// Lane by lane; with a plain number, the same for all lanes.
macro_rules! operator {
    ($of:ident, $name:ident, $sign:tt) => {
        impl $of for Lanes {
            type Output = Self;

            #[inline(always)]
            fn $name(mut self, other: Self) -> Self {
                for i in 0..LANES {
                    self.0[i] $sign other.0[i];
                }
                self
            }
        }

        impl $of<f64> for Lanes {
            type Output = Self;

            #[inline(always)]
            fn $name(mut self, other: f64) -> Self {
                for lane in &mut self.0 {
                    *lane $sign other;
                }
                self
            }
        }
    };
}

operator!(Add, add, +=);
operator!(Sub, sub, -=);
operator!(Mul, mul, *=);
operator!(Div, div, /=);
