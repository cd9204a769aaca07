//! Tables as blocks: velocities and spins, or angles and speeds, before and after impacts.
//!
//! The own unknowns of a shot are the errors of its inputs, in units in which they are independent
//! and have variance 1; its outcome is predicted from the true inputs (errors in variables: Fuller,
//! Measurement Error Models, 1987, § 3.2).

pub(crate) mod block;
pub(crate) mod run;
pub(crate) mod shot;
pub(crate) mod table;
