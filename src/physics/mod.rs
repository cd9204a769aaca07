//! Balls, discs, their contact and their motion on the cloth.
pub mod ball;
pub mod cloth_motion;
pub mod collision;
pub mod contact_frame;
pub mod disc;
pub mod friction_law;

use num_dual::DualNum;

/// A plain number, or one that carries derivatives.
pub trait Number: DualNum<Primitive = f64> + Copy {}

impl<T: DualNum<Primitive = f64> + Copy> Number for T {}
