//! Kinks of a shot's outcome as a function of its inputs, as constraints on them.
//!
//! Where topspin turns to draw, and where the contact begins to stick, the slopes of the outcome f leap, but f does not. The inputs
//! that agree best with a shot's measurements are often just there. They then move with the parameters θ along the kink:
//! with t the errors of the inputs, a its normal and t̂ a place on it, a·(t − t̂) + b·(θ − θ̂) = 0.

use nalgebra::{Cholesky, Const, SMatrix, SVector};

use super::prediction::INPUTS;
use crate::measurement::parameter::Parameter;

type Units = SVector<f64, INPUTS>;
type Parameters = SVector<f64, { Parameter::ALL.len() }>;

/// Topspin to draw, and sliding to sticking.
pub const MOST: usize = 2;

/// Kinks whose normals are nearer to each other than this are one.
const APART: f64 = 1e-4;

/// A kink that inputs are at.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Kink {
    /// Which of [`super::prediction::Contact::side`] changes.
    pub which: usize,
    /// On which side the inputs are taken.
    pub side: bool,
    /// a, of length 1, towards the other side.
    pub normal: Units,
    /// b.
    pub by_parameters: Parameters,
}

/// The kinks that inputs are at, if any.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Kinks {
    count: usize,
    list: [Kink; MOST],
}

impl Kinks {
    pub fn list(&self) -> &[Kink] {
        &self.list[..self.count]
    }

    pub fn holds(&self, which: usize) -> bool {
        self.list().iter().any(|kink| kink.which == which)
    }

    /// And one more; `None` where that is none.
    pub fn with(mut self, kink: Kink) -> Option<Self> {
        *self.list.get_mut(self.count)? = kink;
        self.count += 1;
        self.is_independent().then_some(self)
    }

    pub fn without(&self, number: usize) -> Self {
        let mut rest = Self::default();
        for (_, kink) in self.list().iter().enumerate().filter(|(i, _)| *i != number) {
            rest.list[rest.count] = *kink;
            rest.count += 1;
        }
        rest
    }

    pub fn replaced(mut self, number: usize, kink: Kink) -> Option<Self> {
        self.list[number] = kink;
        self.is_independent().then_some(self)
    }

    fn is_independent(&self) -> bool {
        self.orthonormal().len() == self.count
    }

    /// The first kink, of those that these are not, that lies between inputs on some sides and others.
    pub fn crossed(&self, from: &[bool; MOST], to: &[bool; MOST]) -> Option<usize> {
        (0..MOST).find(|which| from[*which] != to[*which] && !self.holds(*which))
    }

    /// The same constraints with normals at right angles.
    pub fn orthonormal(&self) -> Vec<(Units, Parameters)> {
        let mut rows: Vec<(Units, Parameters)> = Vec::with_capacity(self.count);
        for Kink { normal, by_parameters, .. } in self.list() {
            let (mut a, mut b) = (*normal, *by_parameters);
            for (known, by) in &rows {
                let along = a.dot(known);
                a -= along * known;
                b -= along * by;
            }
            let length = a.norm();
            if length > APART {
                rows.push((a / length, b / length));
            }
        }
        rows
    }

    /// The part of a least-squares step that the kinks leave, for normal equations H: δ − H⁻¹Aᵀ(A H⁻¹Aᵀ)⁻¹Aδ.
    pub fn along(&self, step: Units, normal: &Cholesky<f64, Const<INPUTS>>) -> Units {
        match self.orthonormal()[..] {
            [] => step,
            [(a, _)] => {
                let across = normal.solve(&a);
                step - across * (a.dot(&step) / a.dot(&across))
            }
            [(a, _), (b, ..), ..] => {
                let rows = SMatrix::<f64, INPUTS, 2>::from_columns(&[a, b]);
                let across = normal.solve(&rows);
                let inner = rows.tr_mul(&across).try_inverse();
                inner.map_or_else(Units::zeros, |inner| step - across * (inner * rows.tr_mul(&step)))
            }
        }
    }

    /// Inputs that were on the kinks, when the parameters have moved.
    pub fn followed(&self, t: &Units, moved: &Parameters) -> Units {
        self.orthonormal().iter().fold(*t, |t, (a, b)| t - a * b.dot(moved))
    }
}
