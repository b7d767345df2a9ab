//! Turns stripped increments about the sensing axes into increments of the case along the body axes \[rad\], Eq. (7).
//!
//! It takes r \[rad\] about the sensing axes, the angles ε_ij0 and their change by the acceleration \[rad\]. Once per
//! output period the same matrix at rest acts on the exact angles \[fine units\].
//!
//! x: r_x + ε_xy r_z + ε_xz r_y;  y: r_y + ε_yz r_x + ε_yx r_z;  z: r_z + ε_zx r_y + ε_zy r_x.
//!
//! First order in ε, as printed: the model's M is this very matrix, so nothing of second order is missing.
//! The matrix is linear, so its constant part may act on the period's sum (`at_rest_exactly`). The tilts' effect within
//! the period is subtracted from the angles about the sensing axes before (`flexure.rs`; `tilted` for the terms): with
//! N the tilts' matrix, sensed = (M⁻¹ + N) case, and case = M (sensed − N case) has no error of second order.

use crate::chain::numbers::NumberSystem;
use crate::chain::numbers::exact::ExactCoefficient;
use crate::chain::triad::{CrossAxis, Triad};

/// Applies the matrix at rest to one sample's increments \[rad\], for use in products.
#[inline(always)]
pub fn at_rest<N: NumberSystem>(
    e: &CrossAxis<N::Coefficient>,
    r: Triad<N::Increment>,
) -> Triad<N::Increment> {
    let add = |to, c_a, r_a, c_b, r_b| N::add_product(N::add_product(to, c_a, r_a), c_b, r_b);
    Triad {
        x: add(r.x, e.xy, r.z, e.xz, r.y),
        y: add(r.y, e.yz, r.x, e.yx, r.z),
        z: add(r.z, e.zx, r.y, e.zy, r.x),
    }
}

/// Computes the correction of one sample's increments about the sensing axes for tilts with the signs of Eq. (7)
/// \[rad\]; `r` is the case's increment.
#[inline(always)]
pub fn tilted<N: NumberSystem>(
    tilts: &CrossAxis<N::Tilt>,
    r: Triad<N::Increment>,
) -> Triad<N::Tilted> {
    let t = tilts;
    Triad {
        x: N::tilted(t.xy, r.z, t.xz, r.y),
        y: N::tilted(t.yz, r.x, t.yx, r.z),
        z: N::tilted(t.zx, r.y, t.zy, r.x),
    }
}

/// Applies the matrix at rest to an output period's angles \[fine units\].
#[inline(always)]
pub fn at_rest_exactly(e: &CrossAxis<ExactCoefficient>, [x, y, z]: [i64; 3]) -> [i64; 3] {
    let add = |to: i64, a: i64, b: i64| to.wrapping_add(a).wrapping_add(b);
    [
        add(x, e.xy.times(z), e.xz.times(y)),
        add(y, e.yz.times(x), e.yx.times(z)),
        add(z, e.zx.times(y), e.zy.times(x)),
    ]
}

/// Applies the matrix at rest to the angles of a reading that covers several periods \[fine units\], which may be
/// beyond the range of an `i64`.
pub fn at_rest_wide(e: &CrossAxis<ExactCoefficient>, [x, y, z]: [i128; 3]) -> [i128; 3] {
    let add = |to: i128, a: i128, b: i128| to.wrapping_add(a).wrapping_add(b);
    [
        add(x, e.xy.times_wide(z), e.xz.times_wide(y)),
        add(y, e.yz.times_wide(x), e.yx.times_wide(z)),
        add(z, e.zx.times_wide(y), e.zy.times_wide(x)),
    ]
}
