//! Many impacts side by side: what is usual is solved without a branch, so that the compiler can take several
//! at a time; the rest goes the way of a single impact.

use super::path::{Path, Slip};
use super::{cloth, free};
use crate::ball::UNIFORM_SPHERE;
use crate::collision::{Contact, Impulse, Regime, SQUARES};

/// A solution without a branch.
pub(super) struct Usual {
    /// Otherwise it is none.
    pub holds: bool,
    pub q: f64,
    pub slip: Slip,
}

/// Up to `N` impacts as a structure of arrays: all with topspin, or all without, and with one ball, e and m_s.
pub(in crate::collision) struct Lanes<const N: usize> {
    k: [f64; N],
    v_y: [f64; N],
    v_z: [f64; N],
    mu: [f64; N],
    q: [f64; N],
    j_y: [f64; N],
    j_z: [f64; N],
}

impl<const N: usize> Lanes<N> {
    pub fn new() -> Self {
        let [k, v_y, v_z, mu, q, j_y, j_z] = [[0.0; N]; 7];
        Self { k, v_y, v_z, mu, q, j_y, j_z }
    }

    /// Solves all of `contacts`.
    pub fn solve(&mut self, contacts: &[Contact]) {
        let Some(first) = contacts.first() else { return };
        for (i, contact) in contacts.iter().enumerate() {
            (self.k[i], self.v_y[i], self.v_z[i]) = (contact.k, contact.v_y, contact.v_z);
            self.mu[i] = contact.mu;
        }
        if first.v_z > 0.0 {
            self.side_by_side(first, contacts.len(), cloth::usual);
        } else if first.nu == UNIFORM_SPHERE {
            self.side_by_side(first, contacts.len(), free::usual);
        } else {
            self.q = [f64::NAN; N];
        }
    }

    /// The impulse of one of them; `None` if it has to go the way of a single impact.
    #[inline]
    pub fn impulse(&self, i: usize) -> Option<(Impulse, Regime)> {
        let impulse = Impulse { normal: self.q[i], y: self.j_y[i], z: self.j_z[i] };
        (!impulse.normal.is_nan()).then_some((impulse, Regime::Slide))
    }

    #[inline(always)]
    fn side_by_side(&mut self, all: &Contact, count: usize, usual: impl Fn(&Contact, &Path, f64) -> Usual) {
        let &Contact { m_s, e, nu, sigma, .. } = all;
        for i in 0..count.min(N) {
            let (v_y, v_z) = (self.v_y[i], self.v_z[i]);
            let contact = Contact { k: self.k[i], v_y, v_z, mu: self.mu[i], m_s, e, nu, sigma };
            let square = v_y * v_y + v_z * v_z;
            let rho = square.sqrt();
            let Usual { holds, q, slip } = usual(&contact, &Path::new(&contact, rho), rho);
            let holds = holds & SQUARES.contains(&square);
            self.q[i] = if holds { q } else { f64::NAN };
            // as End::impulse
            self.j_y[i] = -v_y / (2.0 * contact.beta_y()) * slip.y_gone();
            self.j_z[i] = -v_z / (2.0 * contact.beta_z()) * slip.gone;
        }
    }
}
