//! A path by what it starts with. All paths depend on the same few numbers, whatever unknowns a shot has: the sums over its
//! frames are taken with derivatives by these, and carried over to the unknowns once for each path.

use nalgebra::SMatrix;
use num_dual::DualSVec64;

use crate::physics::cloth_motion::{Cloth, Launch};

/// Instant, position (2), velocity (2), slip (2) and upward velocity at the start, table frame; μ_k, μ_r and e_t of the cloth.
pub(super) const LOCAL: usize = 11;

/// Derivatives by the instant and by the position need no dual numbers: paths are the same at any time and place.
pub(super) const FIRST: usize = 3;
const CARRIED: usize = LOCAL - FIRST;

/// A number with its derivatives by what follows the position.
pub(super) type Local = DualSVec64<CARRIED>;

/// The start of a path, and the cloth (μ_k, μ_r, e_t), as what derivatives are taken by.
pub(super) fn launch<const N: usize>(
    launch: &Launch<DualSVec64<N>>,
    cloth: [f64; 3],
) -> (Launch<Local>, Cloth<Local>) {
    let Launch { time, position, velocity, slip, up, inertia } = launch;
    let plain = |value: f64| Local::from_re(value);
    let unknown = |i: usize, value: f64| Local::from_re(value).derivative(i);
    let local = Launch {
        time: plain(time.re),
        position: [plain(position[0].re), plain(position[1].re)],
        velocity: [unknown(0, velocity[0].re), unknown(1, velocity[1].re)],
        slip: [unknown(2, slip[0].re), unknown(3, slip[1].re)],
        up: unknown(4, up.re),
        inertia: *inertia,
    };
    let [sliding, rolling, bounce] = cloth;
    (local, Cloth { sliding: unknown(5, sliding), rolling: unknown(6, rolling), bounce: unknown(7, bounce) })
}

/// The derivatives of the start of a path and of μ_k, μ_r, e_t by the unknowns of a shot and the shared parameters: a row for each
/// of these.
pub(super) fn by_unknowns<const N: usize>(
    launch: &Launch<DualSVec64<N>>,
    [sliding, rolling, bounce]: &[DualSVec64<N>; 3],
) -> SMatrix<f64, N, LOCAL> {
    let Launch { time, position: [x, y], velocity: [v_x, v_y], slip: [s_x, s_y], up, .. } = launch;
    let mut by = SMatrix::<f64, N, LOCAL>::zeros();
    let numbers = [time, x, y, v_x, v_y, s_x, s_y, up, sliding, rolling, bounce];
    for (column, number) in numbers.into_iter().enumerate() {
        if let Some(derivatives) = &number.eps.0 {
            by.set_column(column, derivatives);
        }
    }
    by
}
