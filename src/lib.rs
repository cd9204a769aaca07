//! caromfit: from measured collisions of two billiard balls to the friction between the balls μ,
//! the friction of the cloth on the object ball μ_s, and the coefficient of restitution e.
pub mod ball;
pub mod cases;
pub mod cloth;
pub mod collision;
pub mod contact;
pub mod dataset;
pub mod disc;
pub mod effects;
pub mod fit;
pub mod footage;
pub mod friction;
pub mod impact;
pub mod loss;
pub mod observable;
pub mod optimise;
pub mod parameters;
pub mod predict;
mod quadrature;
pub mod relation;
pub mod report;
pub mod residuals;
mod rigid;
pub mod synth;
pub mod track;
