//! Case increments → rotation vector of the output period.
//!
//! Enters: case increments D_k \[rad\], body frame, every sample, not yet rounded: here they are, once, and
//! what that leaves is summed too. Leaves: θ = Σ D_k and the coning
//! correction β \[rad\], whose sum is the rotation vector from the period's start to its end.
//!
//! Two speeds (Savage 1998): β = Σ_k (½ θ_{k−1} + c₁ D_{k−1} + c₂ D_{k−2}) × D_k, θ summed since the
//! period's start, D over its bounds. The first term is the coning between samples, the others that within
//! a sample ([`CONING_COEFFICIENTS`](crate::design_parameters::CONING_COEFFICIENTS)).
//!
//! It leaves out the rotation vector equation's terms of third order, θ × (θ × ω)/12: nothing for a fixed
//! axis, at most Ωφ⁴/3 for coning of angle φ at Ω when a period holds half a swing. At 100 Hz, 0.1° the mean
//! is 2e-5 °/h with 10 samples a period and 1.5e-4 °/h with 20; choose short periods for hard vibration.

use crate::numbers::{NumberSystem, Unrounded};
use crate::triad::Triad;

/// Sums since the period's start, and the last two increments \[rad\].
#[derive(Debug, Clone, Copy, Default)]
pub struct ConingState<N: NumberSystem> {
    angle: Triad<N::Angle>,
    coning: Triad<N::Coning>,
    previous: Triad<N::Increment>,
    before_previous: Triad<N::Increment>,
}

/// The rotation of one output period: `angle + coning` is the rotation vector \[rad\].
#[derive(Debug, Clone, Copy, Default)]
pub struct Rotation<N: NumberSystem> {
    /// Σ D.
    pub angle: Triad<N::Angle>,
    /// β.
    pub coning: Triad<N::Coning>,
}

/// Adds one sample.
#[inline(always)]
pub fn process<N: NumberSystem>(state: &mut ConingState<N>, case: Triad<Unrounded<N>>) {
    let (one, two) = (state.previous, state.before_previous);
    let u = Triad {
        x: N::lever(state.angle.x, one.x, two.x),
        y: N::lever(state.angle.y, one.y, two.y),
        z: N::lever(state.angle.z, one.z, two.z),
    };
    let (angle_x, x) = N::accumulate(state.angle.x, case.x);
    let (angle_y, y) = N::accumulate(state.angle.y, case.y);
    let (angle_z, z) = N::accumulate(state.angle.z, case.z);
    state.angle = Triad {
        x: angle_x,
        y: angle_y,
        z: angle_z,
    };
    state.coning = Triad {
        x: state.coning.x + N::cross(u.y, z, u.z, y),
        y: state.coning.y + N::cross(u.z, x, u.x, z),
        z: state.coning.z + N::cross(u.x, y, u.y, x),
    };
    state.before_previous = one;
    state.previous = Triad { x, y, z };
}

/// Takes the period's rotation and starts the next one.
#[inline(always)]
pub fn finish<N: NumberSystem>(state: &mut ConingState<N>) -> Rotation<N> {
    Rotation {
        angle: core::mem::take(&mut state.angle),
        coning: core::mem::take(&mut state.coning),
    }
}
