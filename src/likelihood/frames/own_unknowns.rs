//! A shot's own unknowns where χ² is least, for given shared parameters.

use std::sync::Arc;

use nalgebra::SVector;

use super::schur_reduced::{Eliminated, Normal};
use super::sums::Off;
use super::{
    ALL_SHARED, Film, MEASURED, MORE_SHARED, OWN, Own, OwnByShared, Reduced, SHARED, Shared, UNKNOWN,
    schur_reduced,
};
use crate::likelihood::corrected::Corrected;
use crate::measurement::spin::Spin;
use crate::physics::collision::Coefficients;
use crate::trajectory::scene::{LiftPrior, Scene};
use crate::trajectory::shot_scene::ShotScene;

/// The shot's own unknowns rest when a step promises less than this of ½χ²: the Schur complement counts what it promises, which
/// leaves an error of the third order in the step.
const AT_REST: f64 = 1e-4;
const MAX_STEPS: usize = 30;
const MOST_DAMPING: f64 = 1e6;

/// A spin of this part of the natural roll's stands for none, on its side…
const KINK: f64 = 1e-9;
/// …and one that differs from the natural roll's by this part of it slides before the impact, on its side.
const ALMOST: f64 = 1e-5;
/// Where an unknown spin may be while it is looked for, as part of the natural roll's. At none χ² has a kink: topspin presses
/// the object ball into the cloth and lifts the cue ball, draw lifts the object ball. At natural roll it leaps, since the cloth
/// slows down a ball that rolls less and drives on one that spins faster.
const SIDES: [[f64; 2]; 3] =
    [[f64::NEG_INFINITY, -KINK], [KINK, 1.0 - ALMOST], [1.0 + ALMOST, f64::INFINITY]];

/// An unknown spin is looked for from all these, in parts of the natural roll's.
pub(crate) const EVERYWHERE: [f64; 9] = [-1.0, -0.7, -0.4, -0.15, 0.15, 0.4, 0.7, 0.9, 1.15];
/// Another minimum may become the least while the parameters move if its χ² is higher by no more than this,
const POSSIBLE: f64 = 16.0;
/// and is one if its spin differs by this part of the natural roll's.
const APART: f64 = 0.003;
/// No shot was seen with more.
const MOST_OTHERS: usize = 3;

/// Within so many standard errors of none, both sides are tried.
const NEAR: f64 = 5.0;

impl Film {
    /// The shot with its own unknowns where χ² is least, for what all shots share; looked for from `from`.
    /// `None` where there is no collision.
    pub(crate) fn reduced(&self, collision: &Corrected, shared: &Shared, from: &Own) -> Option<Arc<Reduced>> {
        let tried = std::iter::once(from).chain(&self.others);
        let found = tried.filter_map(|from| self.reduced_from(collision, shared, from));
        found.min_by(|a, b| a.chi2().total_cmp(&b.chi2()))
    }

    /// Where to look for the own unknowns when the shared parameters have moved by so much from where they were `found`: where
    /// they are expected, an unknown spin on the side where it was.
    pub(crate) fn start_after(&self, found: &Reduced, moved: &SVector<f64, ALL_SHARED>) -> Own {
        let side = |own: &Own| SIDES.iter().position(|[_, high]| own[OWN] <= *high);
        let mut start = found.own + found.own_by_shared * moved;
        if self.rolls_unknown() && side(&start) != side(&found.own) {
            start[OWN] = found.own[OWN];
        }
        start
    }

    /// Topspin over the natural roll's, and by how much χ² rises without any: infinite where a spin is known to be one. `None` where it is
    /// known to be none, or the axis is measured and upright.
    pub(crate) fn shown_topspin(
        &self,
        collision: &Corrected,
        shared: &Shared,
        own: &Own,
    ) -> Option<(f64, f64)> {
        match self.scene.spin {
            Spin::Stun => None,
            Spin::NaturalRoll => Some((1.0, f64::INFINITY)),
            // of what is measured, only its size is of interest here
            Spin::Measured { spin, .. } => (spin.x.hypot(spin.y) > 0.0).then_some((1.0, f64::INFINITY)),
            Spin::Unknown => {
                let with = self.reduced(collision, shared, own)?;
                let scene = ShotScene { spin: Spin::Stun, ..self.scene };
                let without = Self { scene, others: Vec::new(), ..self.clone() };
                let from = &with.own;
                let rise = without.reduced(collision, shared, from)?.chi2() - with.chi2();
                Some((with.own[OWN], rise))
            }
        }
    }

    fn reduced_from(&self, collision: &Corrected, shared: &Shared, from: &Own) -> Option<Arc<Reduced>> {
        const MEASURED_MORE: usize = MEASURED + MORE_SHARED;
        const UNKNOWN_MORE: usize = UNKNOWN + MORE_SHARED;
        const KNOWN_MORE: usize = OWN + MORE_SHARED;
        match (self.unknowns(), collision.has_others()) {
            (MEASURED, false) => self.eliminate::<{ MEASURED + SHARED }, SHARED>(collision, shared, from),
            (UNKNOWN, false) => self.eliminate::<{ UNKNOWN + SHARED }, SHARED>(collision, shared, from),
            (_, false) => self.eliminate::<{ OWN + SHARED }, SHARED>(collision, shared, from),
            (MEASURED, true) => self.eliminate::<MEASURED_MORE, MORE_SHARED>(collision, shared, from),
            (UNKNOWN, true) => self.eliminate::<UNKNOWN_MORE, MORE_SHARED>(collision, shared, from),
            (_, true) => self.eliminate::<KNOWN_MORE, MORE_SHARED>(collision, shared, from),
        }
    }

    fn eliminate<const N: usize, const S: usize>(
        &self,
        collision: &Corrected,
        shared: &Shared,
        from: &Own,
    ) -> Option<Arc<Reduced>> {
        let own = N - S;
        let mut all = SVector::<f64, N>::zeros();
        for i in 0..own {
            all[i] = from[i];
        }
        for i in 0..S {
            all[own + i] = shared[schur_reduced::place(i)];
        }
        let off: Off = std::array::from_fn(|i| shared[SHARED + i]);
        if !self.rolls_unknown() {
            let start = Point { all, normal: self.normal::<N, S>(collision, &all, &off)? };
            let point = self.settled((collision, &off), start, None);
            let log_volume = match self.one_unknown() {
                // LLᵀ = JᵀJ: the side spin is the last of the own unknowns, so that 1/p = L²
                Some((_, sd)) => 2.0 * (sd * point.normal.own_part(0.0, N)?.l_dirty()[(OWN, OWN)]).ln(),
                None => 0.0,
            };
            return point.reduce(N, (false, log_volume));
        }
        let side = SIDES.iter().position(|[_, high]| all[OWN] <= *high)?;
        all[OWN] = all[OWN].max(SIDES[side][0]);
        let start = Point { all, normal: self.normal::<N, S>(collision, &all, &off)? };
        let mut best = self.settled((collision, &off), start, Some(SIDES[side]));
        if side < 2 && best.is_near_stun()? {
            let mut beyond = best.all;
            beyond[OWN] = if side == 0 { KINK } else { -KINK };
            if let Some(normal) = self.normal::<N, S>(collision, &beyond, &off) {
                let beyond = Point { all: beyond, normal };
                let other = self.settled((collision, &off), beyond, Some(SIDES[1 - side]));
                if other.normal.square < best.normal.square {
                    best = other;
                }
            }
        }
        // at an end the spin stays where it is while the parameters move a little
        best.reduce(if is_at_end(best.all[OWN]) { OWN } else { N }, (true, 0.0))
    }

    /// The own unknowns moved to the least χ², an unknown spin within its side.
    fn settled<const N: usize, const S: usize>(
        &self,
        (collision, off): (&Corrected, &Off),
        mut point: Point<N, S>,
        side: Option<[f64; 2]>,
    ) -> Point<N, S> {
        let mut damping = 0.0;
        for _ in 0..MAX_STEPS {
            if damping > MOST_DAMPING {
                break;
            }
            let held = point.held(side);
            let Some(cholesky) = point.normal.own_part(damping, held) else {
                damping = raised(damping);
                continue;
            };
            let gradient = point.normal.own_gradient(held);
            let step = -cholesky.solve(&gradient);
            // ½χ² − ½|r + Jδ|²
            let promised = -0.5 * gradient.dot(&step);
            if promised < AT_REST {
                break;
            }
            let all = within(point.all, step, side.filter(|_| held == N));
            match self.normal::<N, S>(collision, &all, off) {
                Some(normal) if normal.square < point.normal.square => {
                    point = Point { all, normal };
                    damping *= 0.1;
                }
                _ => damping = raised(damping),
            }
        }
        point
    }

    /// The shot as it agrees best with the collision model that the scene has, looked for from where its own unknowns start and
    /// with these unknown spins in the place of that, in parts of the natural roll's. `None` where the scene has no model.
    pub(crate) fn at_model(&self, scene: &Scene, rolls: &[f64]) -> Option<Arc<Reduced>> {
        self.minima(scene, rolls).into_iter().next()
    }

    /// As where [`Film::at_model`] finds them, the least first.
    fn minima(&self, scene: &Scene, rolls: &[f64]) -> Vec<Arc<Reduced>> {
        let LiftPrior::Model(model, Coefficients { mu, mu_s, e }, _) = scene.lift else { return Vec::new() };
        let collision = Corrected { model, correction: None };
        let mut shared = [0.0; ALL_SHARED];
        let cloth = scene.cloth;
        shared[..SHARED].copy_from_slice(&[mu, mu_s, e, cloth.sliding, cloth.rolling, cloth.bounce]);
        let tried = std::iter::once(self.start[OWN]).chain(rolls.iter().copied()).filter_map(|roll| {
            let mut from = self.start;
            from[OWN] = roll;
            self.reduced_from(&collision, &shared, &from)
        });
        let mut found: Vec<Arc<Reduced>> = tried.collect();
        found.sort_by(|a, b| a.chi2().total_cmp(&b.chi2()));
        found
    }

    /// With an unknown spin looked for from everywhere, whatever the parameters, where its frames allow several.
    pub(crate) fn with_all_minima(mut self, scene: &Scene) -> Self {
        if !self.rolls_unknown() {
            return self;
        }
        let found = self.minima(scene, &EVERYWHERE);
        let Some(best) = found.first() else { return self };
        self.start = best.own;
        let least = best.chi2();
        for other in found.iter().filter(|other| other.chi2() < least + POSSIBLE) {
            let apart = |own: &Own| (own[OWN] - other.own[OWN]).abs() > APART;
            if apart(&self.start) && self.others.iter().all(apart) && self.others.len() < MOST_OTHERS {
                self.others.push(other.own);
            }
        }
        self
    }
}

/// Whether an unknown spin is at an end of its side.
pub(super) fn is_at_end(roll: f64) -> bool {
    SIDES.as_flattened().contains(&roll)
}

/// A shot's unknowns and shared parameters, and the normal equations there.
struct Point<const N: usize, const S: usize> {
    all: SVector<f64, N>,
    normal: Normal<N, S>,
}

impl<const N: usize, const S: usize> Point<N, S> {
    /// With the own unknowns from `held` on as they are; a topspin that is unknown stays on its side.
    fn reduce(&self, held: usize, (stays, log_volume): (bool, f64)) -> Option<Arc<Reduced>> {
        let Eliminated { residuals, jacobian, step, by_shared } = self.normal.reduce(held)?;
        let (mut own, mut own_by_shared) = (Own::zeros(), OwnByShared::zeros());
        for i in 0..N - S {
            own[i] = if stays { self.all[i] } else { self.all[i] + step[i] };
            own_by_shared.set_row(i, &by_shared.row(i));
        }
        Some(Arc::new(Reduced { residuals, jacobian, own, own_by_shared, log_volume }))
    }

    /// Where unknowns begin that stay: an unknown spin at an end of its side, from where the free step leads out of it.
    fn held(&self, side: Option<[f64; 2]>) -> usize {
        let roll = self.all[OWN];
        let Some([low, high]) = side.filter(|side| side.contains(&roll)) else { return N };
        let Some(cholesky) = self.normal.own_part(0.0, N) else { return N };
        let step = -cholesky.solve(&self.normal.own_gradient(N))[OWN];
        if (roll == low && step <= 0.0) || (roll == high && step >= 0.0) { OWN } else { N }
    }

    /// Whether an unknown spin may as well be none, or lie on the other side of it.
    fn is_near_stun(&self) -> Option<bool> {
        // LLᵀ = JᵀJ: the spin is the last of the own unknowns, and the others are free
        let sd = 1.0 / self.normal.own_part(0.0, N)?.l_dirty()[(OWN, OWN)];
        Some(self.all[OWN].abs() < NEAR * sd)
    }
}

/// As far along a step as an unknown spin stays within its side.
fn within<const N: usize>(
    from: SVector<f64, N>,
    step: SVector<f64, N>,
    side: Option<[f64; 2]>,
) -> SVector<f64, N> {
    let mut to = from + step;
    if let Some([low, high]) = side
        && !(low..=high).contains(&to[OWN])
    {
        let end = to[OWN].clamp(low, high);
        to = from + step * ((end - from[OWN]) / step[OWN]);
        to[OWN] = end;
    }
    to
}

fn raised(damping: f64) -> f64 {
    (10.0 * damping).max(1e-3)
}
