//! What a design says, as a player would say it.

use super::{Cell, Design};
use crate::parameters::Parameter;

pub(super) fn of(_design: &Design) -> Vec<String> {
    Vec::new()
}
