//! The impact of a shot with its derivatives by the shot's own unknowns and the shared ones.

use nalgebra::SVector;
use num_dual::DualNum;

use super::dual::{Dual, DualVector, constant, gradient, with_gradient};
use crate::physics::ball::{Ball, BallState, Vec3};
use crate::physics::collision::{Coefficients, Fidelity, Input, Model, NotACollision, Regime};
use crate::physics::friction_law::Law;
use crate::problem::unknowns::{Id, Mode, Shared, Unknown};

/// Smallest size of b at which its derivative is computed. The outcome differs from that of b = 0
/// by 1e-9 of the closing speed.
const LEAST_FALL: f64 = 1e-9;

/// Smallest κ of a compliant contact that is computed: the outcome nears that of a rigid one as √κ.
const LEAST_KAPPA: f64 = 1e-3;

/// The collision model of a film.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Contact {
    model: Model,
    object: Ball,
    falls: bool,
    e_falls: bool,
}

/// A ball just before or after the impact, in the collision frame.
#[derive(Clone, Copy)]
pub(crate) struct Side {
    /// m/s
    pub velocity: DualVector,
    /// Upward velocity, m/s.
    pub rise: Dual,
    /// Angular velocity times the radius, m/s.
    pub spin: [Dual; 3],
    /// Moment of inertia over MR².
    pub inertia: f64,
}

impl Side {
    /// Returns the velocity of the ball's lowest point, m/s.
    pub fn slip(&self) -> DualVector {
        DualVector::new(self.velocity.x - self.spin[1], self.velocity.y + self.spin[0])
    }
}

impl Contact {
    /// Returns the model of equal balls like `object`, with the effects that the unknowns have.
    pub fn new(object: Ball, unknowns: &[Unknown]) -> Self {
        let takes_part = |id: Id| {
            let unknown = &unknowns[id as usize];
            unknown.mode != Mode::Fixed || unknown.start != 0.0
        };
        let mut model = Model { object: Some(object), ..Model::new(Fidelity::Full, object) };
        if takes_part(Id::Kappa) {
            model = model.giving_way(unknowns[Id::Kappa as usize].start);
        }
        Self { model, object, falls: takes_part(Id::FallB), e_falls: takes_part(Id::ESlope) }
    }

    /// Returns the same contact with the fidelity, effects and tolerance of another model.
    pub fn computed_as(mut self, other: &Model) -> Self {
        let Model { fidelity, effects, tolerance, .. } = *other;
        self.model = Model { fidelity, effects, tolerance, ..self.model };
        self
    }

    pub fn is_compliant(&self) -> bool {
        self.model.is_compliant()
    }

    /// Returns the object ball.
    pub fn object(&self) -> Ball {
        self.object
    }

    /// Returns the balls after the impact, and whether the contact stuck.
    pub fn collide(&self, cue: &Side, shared: &Shared) -> Result<([Side; 2], bool), NotACollision> {
        let mut model = self.model;
        let radius_ratio = shared[Id::RadiusRatio];
        let radius = self.object.radius * radius_ratio;
        let mass = self.object.mass * shared[Id::MassRatio];
        model.ball = Ball { radius, mass, ..self.object };
        if self.falls {
            let b = shared[Id::FallB];
            let b = if b.abs() < LEAST_FALL { LEAST_FALL } else { b };
            model.law = Law::Exponential { b, c: shared[Id::FallC] };
        }
        model.e_slope = self.e_falls.then(|| shared[Id::ESlope]);
        if self.is_compliant() {
            model.kappa = shared[Id::Kappa].max(LEAST_KAPPA);
        }
        // derivatives by the ratio of the radii are those at a constant radius of the cue ball
        let object_radius = shared.dual(Id::RadiusRatio).recip() * radius;
        let spin = cue.spin.map(|spin| spin / radius);
        let before = BallState {
            velocity: Vec3::new(cue.velocity.x.re, cue.velocity.y.re, 0.0),
            spin: Vec3::new(spin[0].re, spin[1].re, spin[2].re),
        };
        let coefficients = Coefficients { mu: shared[Id::Mu], mu_s: shared[Id::MuS], e: shared[Id::E] };
        let (outcome, jacobian, others) = model.collide_with_all(&before, &coefficients)?;
        let input = |input: Input| match input {
            Input::Mu => shared.dual(Id::Mu),
            Input::MuS => shared.dual(Id::MuS),
            Input::E => shared.dual(Id::E),
            Input::VelocityX => cue.velocity.x,
            Input::VelocityY => cue.velocity.y,
            Input::SpinX => spin[0],
            Input::SpinY => spin[1],
            Input::SpinZ => spin[2],
            Input::B => shared.dual(Id::FallB),
            Input::C => shared.dual(Id::FallC),
            Input::Kappa => shared.dual(Id::Kappa),
            Input::MassRatio => shared.dual(Id::MassRatio),
            Input::RadiusRatio => shared.dual(Id::RadiusRatio),
            Input::ESlope => shared.dual(Id::ESlope),
        };
        let values = outcome.components();
        let mut by = [SVector::zeros(); 12];
        for which in Input::ALL {
            let slope = gradient(&input(which));
            let place = which as usize;
            for (row, by) in by.iter_mut().enumerate() {
                let derivative = match place.checked_sub(jacobian.ncols()) {
                    None => jacobian[(row, place)],
                    Some(other) => others.as_ref().map_or(0.0, |others| others[(row, other)]),
                };
                *by += slope * derivative;
            }
        }
        let component = |row: usize| with_gradient(values[row], by[row]);
        let side = |first: usize, radius: Dual| Side {
            velocity: DualVector::new(component(first), component(first + 1)),
            rise: component(first + 2),
            spin: [3, 4, 5].map(|i| component(first + i) * radius),
            inertia: self.object.inertia,
        };
        let sides = [side(0, constant(radius)), side(6, object_radius)];
        Ok((sides, outcome.regime == Regime::Stick))
    }
}
