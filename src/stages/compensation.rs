//! Corrected increments → increments of the case along the true body axes, Eq. (7).
//!
//! Enters: r \[rad\] about the sensing axes, not yet rounded; ε_ij \[rad\] of this sample. Leaves: case increments \[rad\], body
//! frame, not yet
//! rounded: the stage that sums them does.
//!
//! x: r_x + ε_xy r_z + ε_xz r_y;  y: r_y + ε_yz r_x + ε_yx r_z;  z: r_z + ε_zx r_y + ε_zy r_x.
//!
//! First order in ε, as printed: the model's M is this very matrix, so nothing of second order is missing.

use crate::numbers::{NumberSystem, Unrounded};
use crate::triad::{CrossAxis, Triad};

/// Compensates one sample with this matrix.
#[inline(always)]
pub fn process<N: NumberSystem>(
    installation: &CrossAxis<N::Coefficient>,
    corrected: Triad<Unrounded<N>>,
) -> Triad<Unrounded<N>> {
    let e = installation;
    let r = corrected.map(N::rounded);
    let add = |to: Unrounded<N>, c_a, r_a, c_b, r_b| Unrounded {
        increment: to.increment,
        small: to.small + (N::product(c_a, r_a) + N::product(c_b, r_b)),
    };
    Triad {
        x: add(corrected.x, e.xy, r.z, e.xz, r.y),
        y: add(corrected.y, e.yz, r.x, e.yx, r.z),
        z: add(corrected.z, e.zx, r.y, e.zy, r.x),
    }
}
