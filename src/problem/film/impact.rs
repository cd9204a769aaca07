//! The impact of a shot with its derivatives by the shot's own unknowns and the shared ones.

use nalgebra::{SMatrix, SVector};
use num_dual::DualNum;

use super::dual::{Dual, DualVector, constant, gradient, with_gradient};
use super::own::SCATTERED;
use crate::numerics::EXACT;
use crate::physics::ball::{Ball, BallState, Vec3};
use crate::physics::collision::{
    Coefficients, Effects, Fidelity, Input, Jacobian, MIN_FITTED_KAPPA, Model, NotACollision, Regime,
};
use crate::physics::friction_law::Law;
use crate::problem::unknowns::{Id, Mode, Shared, Unknown};

/// The collision model of a film or a table, with the effects that its unknowns have.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Contact {
    /// The model in closed form unless the contact is compliant.
    model: Model,
    /// The model whose difference from it each shot adds, if there is one.
    fine: Option<Model>,
}

/// Difference of a finer model's outcome, in the order of [`Outcome::components`], to first order
/// about the inputs at which it was computed.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Correction {
    values: SVector<f64, 12>,
    by: Jacobian,
    about: InputValues,
}

/// A ball just before or after the impact, in the collision frame.
#[derive(Clone, Copy)]
pub(crate) struct Side {
    /// m/s
    pub(crate) velocity: DualVector,
    /// Upward velocity, m/s.
    pub(crate) rise: Dual,
    /// Angular velocity times the radius, m/s.
    pub(crate) spin: [Dual; 3],
    /// Moment of inertia over MR².
    pub(crate) inertia: f64,
}

impl Side {
    /// Returns the velocity of the ball's lowest point, m/s.
    pub fn slip(&self) -> DualVector {
        DualVector::new(self.velocity.x - self.spin[1], self.velocity.y + self.spin[0])
    }

    /// Returns the state of a ball of this radius on the cloth.
    pub fn state(&self, radius: f64) -> BallState {
        let [x, y, z] = self.spin.map(|spin| spin.re / radius);
        BallState {
            velocity: Vec3::new(self.velocity.x.re, self.velocity.y.re, 0.0),
            spin: Vec3::new(x, y, z),
        }
    }
}

/// Both balls after an impact: the cue ball and the object ball.
pub(crate) struct Parting {
    pub(crate) balls: [Side; 2],
    /// Their radii, m.
    pub(crate) radii: [Dual; 2],
    /// Whether their contact sticks.
    pub(crate) sticks: bool,
}

impl Parting {
    /// Returns balls of these radii (m) and this moment of inertia after an impact that slips, with
    /// these components of its outcome, in the order of [`Outcome::components`].
    pub(crate) fn new(component: impl Fn(usize) -> Dual, radii: &[Dual; 2], inertia: f64) -> Self {
        let side = |ball: usize| Side {
            velocity: DualVector::new(component(6 * ball), component(6 * ball + 1)),
            rise: component(6 * ball + 2),
            spin: [3, 4, 5].map(|i| component(6 * ball + i) * radii[ball]),
            inertia,
        };
        Self { balls: [0, 1].map(side), radii: *radii, sticks: false }
    }
}

/// Values of the inputs of a collision.
type InputValues = SVector<f64, { Input::COUNT }>;

/// Returns the inputs of a collision with a cue ball of this radius, with their derivatives, in the
/// order of [`Input`].
fn inputs(cue: &Side, shared: &Shared, radius: f64) -> [Dual; Input::COUNT] {
    let [mu, mu_s, e] = [Id::Mu, Id::MuS, Id::E].map(|id| shared.dual(id));
    let others = [Id::FallB, Id::FallC, Id::Kappa, Id::MassRatio, Id::RadiusRatio, Id::ESlope];
    let [b, c, kappa, masses, radii, slope] = others.map(|id| shared.dual(id));
    let [x, y, z] = cue.spin.map(|spin| spin / radius);
    [mu, mu_s, e, cue.velocity.x, cue.velocity.y, x, y, z, b, c, kappa, masses, radii, slope]
}

fn coefficients(shared: &Shared) -> Coefficients {
    Coefficients { mu: shared[Id::Mu], mu_s: shared[Id::MuS], e: shared[Id::E] }
}

impl Contact {
    /// Returns a model with the effects that the unknowns have.
    pub fn new(model: &Model, unknowns: &[Unknown]) -> Self {
        let is_integrated = model.is_compliant() && model.fidelity != Fidelity::Contact;
        let base = if is_integrated { *model } else { model.closed().unwrap_or(*model) };
        Self { model: base, fine: (base != *model).then_some(*model) }.with(unknowns)
    }

    /// Returns the same model with the effects that the unknowns have.
    pub fn with(&self, unknowns: &[Unknown]) -> Self {
        let start = |id: Id| unknowns[id as usize].start;
        let takes_part = |id: Id| unknowns[id as usize].mode != Mode::Fixed || start(id) != 0.0;
        let law = if takes_part(Id::FallB) {
            Law::Exponential { b: start(Id::FallB), c: start(Id::FallC) }
        } else {
            Law::Constant
        };
        let e_slope = takes_part(Id::ESlope).then(|| start(Id::ESlope));
        let model = Model { law, e_slope, ..self.model };
        let model = if takes_part(Id::Kappa) { model.giving_way(start(Id::Kappa)) } else { model };
        Self { model, ..*self }
    }

    /// Returns the same model whose shots add the difference of the contact with gravity and the
    /// cloth, unless they add another one.
    pub(crate) fn with_weight(&self) -> Self {
        if self.is_corrected() {
            return *self;
        }
        let falling_friction = self.model.effects.falling_friction;
        let effects = Effects { compliance: self.is_compliant(), falling_friction, ..Effects::ALL };
        let tolerance = Model::TOLERANCE_OF_FITS;
        let fine = Model { fidelity: Fidelity::Contact, effects, tolerance, ..self.model };
        Self { fine: Some(fine.with_some_compliance()), ..*self }
    }

    /// Returns whether shots add the difference of a finer model.
    pub(crate) fn is_corrected(&self) -> bool {
        self.fine.is_some()
    }

    pub(crate) fn is_compliant(&self) -> bool {
        self.model.is_compliant()
    }

    /// Returns the object ball.
    pub fn object(&self) -> Ball {
        self.model.object_ball()
    }

    /// Returns a model with these values of the shared unknowns.
    fn at(&self, mut model: Model, shared: &Shared) -> Model {
        let object = self.object();
        model.object = Some(object);
        let radius = object.radius * shared[Id::RadiusRatio];
        model.ball = Ball { radius, mass: object.mass * shared[Id::MassRatio], ..object };
        model.law = self.model.law;
        if model.law != Law::Constant {
            let b = shared[Id::FallB];
            // the law at b = 0 has no derivative by b
            let b = if b.abs() < EXACT { EXACT } else { b };
            model.law = Law::Exponential { b, c: shared[Id::FallC] };
        }
        model.e_slope = self.model.e_slope.map(|_| shared[Id::ESlope]);
        if self.is_compliant() {
            model.kappa = shared[Id::Kappa].max(MIN_FITTED_KAPPA);
        }
        model
    }

    /// Returns by how much the outcome of the finer model differs for a cue ball; `None` without
    /// one, or without a collision.
    pub(crate) fn correct(&self, cue: &Side, shared: &Shared) -> Option<Correction> {
        let radius = self.radii(shared)[0].re;
        let outcome = |model: Model| {
            self.at(model, shared).collide_with_jacobian(&cue.state(radius), &coefficients(shared)).ok()
        };
        let ((coarse, by), (fine, finely_by)) = (outcome(self.model)?, outcome(self.fine?)?);
        Some(Correction {
            values: fine.components() - coarse.components(),
            by: finely_by - by,
            about: InputValues::from(inputs(cue, shared, radius).map(|input| input.re)),
        })
    }

    /// Returns the radii of both balls, m; derivatives by their ratio are those at a constant
    /// radius of the cue ball.
    fn radii(&self, shared: &Shared) -> [Dual; 2] {
        let radius = self.object().radius * shared[Id::RadiusRatio];
        [constant(radius), shared.dual(Id::RadiusRatio).recip() * radius]
    }

    /// Returns the balls after the impact; what scatters from shot to shot differs by `offsets` from
    /// what the shots share.
    pub fn collide(
        &self,
        cue: &Side,
        shared: &Shared,
        offsets: &[f64; SCATTERED.len()],
        correction: Option<&Correction>,
    ) -> Result<Parting, NotACollision> {
        let mut of_shot = shared.clone();
        for (id, offset) in SCATTERED.into_iter().zip(offsets) {
            let most = if id == Id::E { 1.0 } else { f64::INFINITY };
            of_shot[id] = (shared[id] + offset).clamp(0.0, most);
        }
        let radii = self.radii(shared);
        let radius = radii[0].re;
        let inputs = inputs(cue, &of_shot, radius);
        let model = self.at(self.model, &of_shot);
        let (outcome, mut jacobian) =
            model.collide_with_jacobian(&cue.state(radius), &coefficients(&of_shot))?;
        let mut values = outcome.components();
        if let Some(correction) = correction {
            let moved = InputValues::from(inputs.each_ref().map(|input| input.re)) - correction.about;
            values += correction.values + correction.by * moved;
            jacobian += correction.by;
        }
        let by = SMatrix::from_columns(&inputs.each_ref().map(gradient)) * jacobian.transpose();
        let component = |row: usize| with_gradient(values[row], &by.column(row).into_owned());
        let parting = Parting::new(component, &radii, self.object().inertia);
        Ok(Parting { sticks: outcome.regime == Regime::Stick, ..parting })
    }
}
