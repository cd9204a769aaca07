//! The two balls while they touch: how their three contacts slip, and the friction at each.
//!
//! [`super::ode`] integrates these equations in the impulse, [`super::contact`] in time. Velocities are
//! in units of the closing speed k; forces are per unit mass. The state is what has acted so far:
//!
//! | symbol | meaning |
//! | --- | --- |
//! | q | normal impulse between the balls |
//! | J_y, J_z | friction impulse between the balls on the object ball |
//! | C_x, C_y | friction impulse of the cloth on the cue ball |
//! | O_x, O_y | friction impulse of the cloth on the object ball |
//! | U_z, V_z | vertical velocities, 0 for a ball on the cloth |
//!
//! from which, with σ = 1 (−1: the cloth's torque on the object ball as printed),
//!
//! ```text
//! U = U₀ + (C_x − q, C_y − J_y, ·)/r + U_z   ω = ω₀ + (C_y, J_z − C_x, −J_y)/(rν_c R_c)
//! V = (q + O_x, J_y + O_y, V_z)             Ω = (σO_y, J_z − σO_x, −J_y)/νR
//! ```
//!
//! with r = m_cue/m_object, all impulses per unit of the object ball's mass. Where the radii differ the normal force has a
//! vertical part F sin δ, to first order ([`crate::physics::collision::Model::tilt`]).
//!
//! A contact that gives way along the surface has a friction of its own, which the state carries: [`super::compliant`].
//!
//! Each contact obeys Coulomb's law: it slides with the friction against its slip, or sticks with what
//! friction keeps it so, at most the coefficient times the normal force. The normal force of the cloth
//! carries a ball's weight and what the other ball presses it down with; where that would have to pull,
//! the ball flies.

use super::Impulses;
use crate::physics::collision::Contact;
use crate::physics::friction_law::Friction;

pub(in crate::physics::collision) type Pair = [f64; 2];

/// Places in the state.
pub(in crate::physics::collision) mod at {
    pub const J_Y: usize = 0;
    pub const J_Z: usize = 1;
    pub const C_X: usize = 2;
    pub const C_Y: usize = 3;
    pub const O_X: usize = 4;
    pub const O_Y: usize = 5;
    pub const U_Z: usize = 6;
    pub const V_Z: usize = 7;
    /// How many they are; what a model adds stands behind them.
    pub const COUNT: usize = 8;
}

/// How a contact grips.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::physics::collision) enum Grip {
    /// With its friction against its slip.
    Slides,
    /// Slides from rest, still so slowly that its slip follows from the forces: see [`super::starts`].
    Starts,
    /// Slides from rest while its friction is too weak to turn a slip: see [`super::starts`].
    Creeps,
    Sticks,
    /// The ball is off the cloth.
    Open,
    /// Between the balls, where the contact gives way: the spring's end holds.
    Springs,
    /// The spring's end slides.
    Yields,
}

/// The three contacts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::physics::collision) enum Site {
    Balls,
    CueOnCloth,
    ObjectOnCloth,
}

impl Site {
    pub const ALL: [Self; 3] = [Self::Balls, Self::CueOnCloth, Self::ObjectOnCloth];
}

/// The grip of each contact, in the order of [`Site::ALL`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::physics::collision) struct Grips(pub [Grip; 3]);

impl std::ops::Index<Site> for Grips {
    type Output = Grip;

    fn index(&self, site: Site) -> &Grip {
        &self.0[site as usize]
    }
}

impl std::ops::IndexMut<Site> for Grips {
    fn index_mut(&mut self, site: Site) -> &mut Grip {
        &mut self.0[site as usize]
    }
}

/// What stays as it is during an impact.
#[derive(Clone, Copy, Debug)]
pub(in crate::physics::collision) struct Dynamics {
    /// k, m/s: the unit of velocity.
    pub k: f64,
    pub friction: Friction,
    /// Cloth on the object ball.
    pub mu_s: f64,
    /// Cloth on the cue ball.
    pub mu_k: f64,
    /// Of the object ball, and of the cue ball.
    pub nu: f64,
    pub nu_c: f64,
    /// 1/r, and ν/(rν_c).
    pub per_r: f64,
    pub share: f64,
    /// 2β_y = (1 + 1/ν_c)/r + 1 + 1/ν.
    pub lever_y: f64,
    /// sin δ.
    pub tilt: f64,
    pub sigma: f64,
    pub gravity: f64,
    /// κ; 0 where the contact is rigid along the surface.
    pub kappa: f64,
    /// Whether the cloth's friction on the object ball follows its slip, and is not just along −x.
    pub cloth_turning: bool,
    /// (v_y0, v_z0).
    pub slip: Pair,
    /// (U_x − Rω_y, U_y + Rω_x) before the impact.
    pub cue_slip: Pair,
    /// Less slip than this is none, for each contact.
    pub no_slip: [f64; 3],
    /// How far ahead the slip of a contact is looked at that starts to slide: see [`super::starts`].
    pub ahead: f64,
}

/// Slips of the contacts: between the balls along y, z; on the cloth along x, y.
#[derive(Clone, Copy, Debug)]
pub(in crate::physics::collision) struct Slips(pub [Pair; 3]);

/// What a contact that gives way adds to the slips and the normal force, by which alone a rigid one acts.
#[derive(Clone, Copy, Debug, Default)]
pub(in crate::physics::collision) struct Give {
    /// The friction on the object ball while the spring's end holds; its direction while it slides.
    pub friction: Pair,
    /// dF/dt.
    pub rising: f64,
    pub is_compression: bool,
}

/// Forces on the object ball (balls), the cue ball (its cloth), the object ball (its cloth), and the
/// normal forces of the three contacts.
#[derive(Clone, Copy, Debug)]
pub(in crate::physics::collision) struct Forces {
    pub friction: [Pair; 3],
    pub normal: [f64; 3],
    /// The most friction that each contact can give.
    pub most: [f64; 3],
}

/// A force that depends on the friction f between the balls: at0 + by_y f_y + by_z f_z.
#[derive(Clone, Copy, Default)]
struct Affine {
    at0: Pair,
    by_y: Pair,
    by_z: Pair,
}

impl Affine {
    fn at(&self, f: Pair) -> Pair {
        [0, 1].map(|i| self.at0[i] + self.by_y[i] * f[0] + self.by_z[i] * f[1])
    }

    /// (g0 + g1 f_z) times a direction.
    fn along(direction: Pair, g0: f64, g1: f64) -> Self {
        Self { at0: direction.map(|d| g0 * d), by_y: [0.0; 2], by_z: direction.map(|d| g1 * d) }
    }
}

/// Friction that is just at its limit still holds, whatever the roundings: with μ_s = 1 it is, all the time.
const HOLDS: f64 = 1.0 + 1e-13;

/// From this κ on downwards an impact takes steps for the shaking of its contact…
pub(in crate::physics::collision) const STIFF: f64 = 1e-3;

/// …but not more than so many times the usual number, some seconds: with a smaller κ than 1e-6 not all impacts come to an end.
const MOST_SHAKES: f64 = 32.0;

/// The time that is looked ahead, in parts of the root of the tolerance: the error that goes as its square is then of the order
/// of the tolerance.
const AHEAD: f64 = 2.0;

pub(in crate::physics::collision) fn norm(v: Pair) -> f64 {
    (v[0] * v[0] + v[1] * v[1]).sqrt()
}

pub(in crate::physics::collision) fn unit(v: Pair) -> Pair {
    let length = norm(v);
    if length > 0.0 { v.map(|x| x / length) } else { [0.0; 2] }
}

impl Dynamics {
    /// Of a contact, with what else is on.
    pub fn new(contact: &Contact, friction: Friction, tolerance: f64) -> Self {
        let &Contact { k, v_y, v_z, nu, sigma, .. } = contact;
        let slip = [v_y / k, v_z / k];
        // a tenth of the tolerance, but more than roundings of the slip
        let least = |slip: Pair| (0.1 * tolerance).max(32.0 * f64::EPSILON * (1.0 + norm(slip)));
        Self {
            k,
            friction,
            mu_s: contact.m_s,
            mu_k: 0.0,
            nu,
            nu_c: nu,
            per_r: 1.0,
            share: 1.0,
            lever_y: 2.0 * ((1.0 + nu) / nu),
            tilt: 0.0,
            sigma,
            gravity: 0.0,
            kappa: 0.0,
            cloth_turning: false,
            slip,
            cue_slip: [0.0; 2],
            no_slip: [least(slip), least([0.0; 2]), least([0.0; 2])],
            ahead: AHEAD * tolerance.sqrt(),
        }
    }

    /// With another object ball, whose ν this has: r, ν_c of the cue ball, and sin δ.
    pub fn with_unequal(mut self, mass_ratio: f64, nu_c: f64, tilt: f64) -> Self {
        self.nu_c = nu_c;
        self.per_r = 1.0 / mass_ratio;
        self.share = self.per_r * self.nu / nu_c;
        self.lever_y = (1.0 + 1.0 / nu_c) * self.per_r + 1.0 + 1.0 / self.nu;
        self.tilt = tilt;
        self
    }

    /// With friction μ_k of the cloth on the cue ball, which slips on it with `slip`, m/s; `speed` is
    /// the cue ball's, of which a rolling ball's slip is a rounding.
    pub fn with_cloth_on_cue(mut self, mu_k: f64, slip: Pair, speed: f64) -> Self {
        self.mu_k = mu_k;
        self.cue_slip = slip.map(|s| s / self.k);
        self.no_slip[Site::CueOnCloth as usize] += 8.0 * f64::EPSILON * speed / self.k;
        self
    }

    /// How many times as often as usual a contact that gives way little shakes along its surface: as 1/√κ.
    pub fn shakes(&self) -> f64 {
        if self.kappa > 0.0 { (STIFF / self.kappa).sqrt().clamp(1.0, MOST_SHAKES) } else { 1.0 }
    }

    /// The most that friction adds to a contact's slip, per unit of it.
    pub fn lever(&self, site: Site) -> f64 {
        match site {
            Site::Balls => self.lever_y,
            Site::CueOnCloth => (1.0 + self.nu_c) / self.nu_c * self.per_r,
            Site::ObjectOnCloth => (1.0 + self.nu) / self.nu,
        }
    }

    pub fn slips(&self, q: f64, y: &[f64]) -> Slips {
        let &Self { nu, nu_c, per_r, share, sigma, slip: [v_y0, v_z0], cue_slip: [s_x0, s_y0], .. } = self;
        let (j_y, j_z) = (y[at::J_Y], y[at::J_Z]);
        let (c, o) = ([y[at::C_X], y[at::C_Y]], [y[at::O_X], y[at::O_Y]]);
        Slips([
            // (V_y − U_y − R(ω_z + Ω_z), V_z − U_z + R(ω_y + Ω_y))
            [
                v_y0 + self.lever_y * j_y + o[1] - per_r * c[1],
                v_z0 + y[at::V_Z] - y[at::U_Z] + ((1.0 + share) * j_z - share * c[0] - sigma * o[0]) / nu,
            ],
            // (U_x − Rω_y, U_y + Rω_x)
            [
                s_x0 - per_r * q + per_r * c[0] - per_r * ((j_z - c[0]) / nu_c),
                s_y0 - per_r * j_y + per_r * c[1] + per_r * (c[1] / nu_c),
            ],
            // (V_x − RΩ_y, V_y + RΩ_x)
            [q + o[0] - (j_z - sigma * o[0]) / nu, j_y + o[1] + sigma * o[1] / nu],
        ])
    }

    /// v_x + k: what the impulses have added to the velocity along the line of centres.
    pub fn separation(&self, q: f64, y: &[f64]) -> f64 {
        (1.0 + self.per_r) * q + y[at::O_X] - self.per_r * y[at::C_X]
    }

    /// Forces for a normal force between the balls.
    pub fn forces(&self, grips: &Grips, slips: &Slips, normal: f64, give: &Give) -> Forces {
        let mut along = slips.0.map(|slip| unit(slip).map(|s| -s));
        match grips[Site::Balls] {
            Grip::Springs => along[Site::Balls as usize] = give.friction,
            Grip::Yields => along[Site::Balls as usize] = unit(give.friction),
            Grip::Slides if self.kappa > 0.0 => self.lag_behind(grips, slips, normal, give, &mut along),
            _ => {}
        }
        if Site::ALL.into_iter().any(|site| self.is_starting(site, grips, slips)) {
            self.start(grips, slips, normal, &mut along);
        }
        self.forces_along(grips, slips, normal, &along)
    }

    /// Forces with the friction of sliding contacts along given directions.
    pub(in crate::physics::collision) fn forces_along(
        &self,
        grips: &Grips,
        slips: &Slips,
        normal: f64,
        along: &[Pair; 3],
    ) -> Forces {
        let most = self.friction.mu(self.k * norm(slips.0[Site::Balls as usize])) * normal;
        let cloths = [self.cue_cloth(grips, normal, along), self.object_cloth(grips, normal, along)];
        let f = match grips[Site::Balls] {
            Grip::Sticks => self.holding(grips, cloths, normal),
            Grip::Springs => along[Site::Balls as usize],
            _ => along[Site::Balls as usize].map(|d| most * d),
        };
        let [cue, object] = cloths.map(|cloth| cloth.at(f));
        let pressed = |site: Site, force: f64| if grips[site] == Grip::Open { 0.0 } else { force };
        let normals = [
            normal,
            pressed(Site::CueOnCloth, self.cue_weight() + f[1] + self.tilt * normal),
            pressed(Site::ObjectOnCloth, self.gravity - f[1] - self.tilt * normal),
        ];
        Forces {
            friction: [f, cue, object],
            normal: normals,
            most: [most, self.mu_k * normals[1], self.mu_s * normals[2]].map(|most| most * HOLDS),
        }
    }

    /// d(slip)/dt of all contacts.
    pub fn slip_rates(&self, grips: &Grips, forces: &Forces) -> [Pair; 3] {
        let mut rates = [0.0; at::COUNT];
        self.rates(grips, forces, &mut rates);
        // slips are linear in the impulses
        let at_rest = Self { slip: [0.0; 2], cue_slip: [0.0; 2], ..*self };
        at_rest.slips(forces.normal[Site::Balls as usize], &rates).0
    }

    /// The cue ball's weight, per unit of the object ball's mass.
    fn cue_weight(&self) -> f64 {
        self.gravity / self.per_r
    }

    /// Cloth on the cue ball.
    fn cue_cloth(&self, grips: &Grips, normal: f64, along: &[Pair; 3]) -> Affine {
        let lever = 1.0 + 1.0 / self.nu_c;
        let site = Site::CueOnCloth;
        match grips[site] {
            Grip::Open => Affine::default(),
            // ds_x/dt = c_x(1 + 1/ν) − F − f_z/ν = 0, ds_y/dt = c_y(1 + 1/ν) − f_y = 0
            Grip::Sticks => Affine {
                at0: [normal / lever, 0.0],
                by_y: [0.0, 1.0 / lever],
                by_z: [1.0 / (self.nu_c * lever), 0.0],
            },
            _ => Affine::along(
                along[site as usize],
                self.mu_k * (self.cue_weight() + self.tilt * normal),
                self.mu_k,
            ),
        }
    }

    /// Cloth on the object ball, likewise.
    fn object_cloth(&self, grips: &Grips, normal: f64, along: &[Pair; 3]) -> Affine {
        let lever = 1.0 + self.sigma / self.nu;
        let site = Site::ObjectOnCloth;
        // −μ_s N x
        let direction = if self.cloth_turning { along[site as usize] } else { [-1.0, 0.0] };
        match grips[site] {
            Grip::Open => Affine::default(),
            // ds_x/dt = o_x(1 + σ/ν) + F − f_z/ν = 0, ds_y/dt = o_y(1 + σ/ν) + f_y = 0
            Grip::Sticks => Affine {
                at0: [-normal / lever, 0.0],
                by_y: [0.0, -1.0 / lever],
                by_z: [1.0 / (self.nu * lever), 0.0],
            },
            _ => Affine::along(direction, self.mu_s * (self.gravity - self.tilt * normal), -self.mu_s),
        }
    }

    /// The friction between the balls that keeps them from slipping, given the cloths':
    /// dv_y/dt = 2β_y f_y + o_y − c_y = 0,
    /// dv_z/dt = dV_z/dt − dU_z/dt + (2f_z − c_x − σo_x)/ν = 0.
    fn holding(&self, grips: &Grips, [c, o]: [Affine; 2], normal: f64) -> Pair {
        let &Self { nu, per_r, share, sigma, gravity: g, tilt, .. } = self;
        let flies = |site: Site| f64::from(grips[site] == Grip::Open);
        let (cue, object) = (flies(Site::CueOnCloth), flies(Site::ObjectOnCloth));
        let a = [
            [self.lever_y + o.by_y[1] - per_r * c.by_y[1], o.by_z[1] - per_r * c.by_z[1]],
            [
                -(share * c.by_y[0] + sigma * o.by_y[0]) / nu,
                per_r * cue + object + ((1.0 + share) - share * c.by_z[0] - sigma * o.by_z[0]) / nu,
            ],
        ];
        let tilted = tilt * normal * (object + per_r * cue);
        let b = [
            per_r * c.at0[1] - o.at0[1],
            (share * c.at0[0] + sigma * o.at0[0]) / nu + g * (object - cue) - tilted,
        ];
        let det = a[0][0] * a[1][1] - a[0][1] * a[1][0];
        [(b[0] * a[1][1] - a[0][1] * b[1]) / det, (a[0][0] * b[1] - b[0] * a[1][0]) / det]
    }

    /// Writes the rates of the state.
    pub fn rates(&self, grips: &Grips, forces: &Forces, rates: &mut [f64]) {
        let [f, c, o] = forces.friction;
        let up = |site: Site, force: f64| if grips[site] == Grip::Open { force - self.gravity } else { 0.0 };
        rates[at::J_Y] = f[0];
        rates[at::J_Z] = f[1];
        rates[at::C_X] = c[0];
        rates[at::C_Y] = c[1];
        rates[at::O_X] = o[0];
        rates[at::O_Y] = o[1];
        let rising = f[1] + self.tilt * forces.normal[Site::Balls as usize];
        rates[at::U_Z] = up(Site::CueOnCloth, -self.per_r * rising);
        rates[at::V_Z] = up(Site::ObjectOnCloth, rising);
    }

    /// The impulses of the state in m/s.
    pub fn impulses(&self, q: f64, y: &[f64]) -> Impulses {
        let k = self.k;
        Impulses {
            normal: k * q,
            y: k * y[at::J_Y],
            z: k * y[at::J_Z],
            cue_cloth: [k * y[at::C_X], k * y[at::C_Y]],
            object_cloth: [k * y[at::O_X], k * y[at::O_Y]],
            cue_up: k * y[at::U_Z],
            object_up: k * y[at::V_Z],
        }
    }
}
