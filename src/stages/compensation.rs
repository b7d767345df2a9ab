//! Corrected increments → increments of the case along the true body axes, Eq. (7).
//!
//! Enters: r \[rad\] about the sensing axes; ε_ij \[rad\] of this sample. Leaves: case increments \[rad\], body
//! frame.
//!
//! x: r_x + ε_xy r_z + ε_xz r_y;  y: r_y + ε_yz r_x + ε_yx r_z;  z: r_z + ε_zx r_y + ε_zy r_x.
//!
//! First order in ε, as printed: the model's M is this very matrix, so nothing of second order is missing.

use crate::numbers::NumberSystem;
use crate::triad::{CrossAxis, Triad};

/// What rounding left of the last sample \[rad\].
#[derive(Debug, Clone, Copy, Default)]
pub struct CompensationState<N: NumberSystem> {
    carry: Triad<N::Correction>,
}

/// Compensates one sample, with nothing lost to rounding over time.
#[inline(always)]
pub fn process<N: NumberSystem>(
    state: &mut CompensationState<N>,
    installation: &CrossAxis<N::Coefficient>,
    corrected: Triad<N::Increment>,
) -> Triad<N::Increment> {
    let small = misalignment::<N>(installation, corrected);
    Triad {
        x: N::correct(corrected.x, small.x, &mut state.carry.x),
        y: N::correct(corrected.y, small.y, &mut state.carry.y),
        z: N::correct(corrected.z, small.z, &mut state.carry.z),
    }
}

/// The same without memory, for the acceleration stage, whose input is not summed.
#[inline(always)]
pub fn process_once<N: NumberSystem>(
    installation: &CrossAxis<N::Coefficient>,
    corrected: Triad<N::Increment>,
) -> Triad<N::Increment> {
    let small = misalignment::<N>(installation, corrected);
    Triad {
        x: N::correct_once(corrected.x, small.x),
        y: N::correct_once(corrected.y, small.y),
        z: N::correct_once(corrected.z, small.z),
    }
}

/// The off-diagonal part of Eq. (7).
#[inline(always)]
fn misalignment<N: NumberSystem>(
    e: &CrossAxis<N::Coefficient>,
    r: Triad<N::Increment>,
) -> Triad<N::Correction> {
    let pair = |c_a, r_a, c_b, r_b| {
        N::add_product(N::add_product(N::Correction::default(), c_a, r_a), c_b, r_b)
    };
    Triad {
        x: pair(e.xy, r.z, e.xz, r.y),
        y: pair(e.yz, r.x, e.yx, r.z),
        z: pair(e.zx, r.y, e.zy, r.x),
    }
}
