//! Sums the coning correction: the output period's rotation vector less the sum of its increments.
//!
//! It takes, every sample, the increments D \[increment units, body frame\]. Once per output period it gives the
//! coning correction β \[fine units\].
//!
//! Two speeds (Savage 1998): β = ½ Σ_k (θ_{k−1} + 2c₁ D_{k−1} + 2c₂ D_{k−2}) × D_k, θ summed since the
//! period's start, D over its bounds. The first term is the coning between samples, the others that within
//! a sample ([`CONING_COEFFICIENTS`](crate::chain::design_parameters::CONING_COEFFICIENTS)); the half is taken
//! once, at the end.
//!
//! θ here is only a factor of products, so it may be rounded.
//!
//! It leaves out the rotation vector equation's terms of third order, θ × (θ × ω)/12: nothing for a fixed
//! axis, at most Ωφ⁴/3 for coning of angle φ at Ω when a period holds half a swing. At 100 Hz, 0.1° the mean
//! is 2e-5 °/h with 10 samples a period and 1.5e-4 °/h with 20; choose short periods for hard vibration.

use crate::chain::numbers::NumberSystem;
use crate::chain::triad::Triad;

/// Sums since the period's start, and the last two increments \[rad\].
#[derive(Debug, Clone, Copy, Default)]
pub struct ConingState<N: NumberSystem> {
    angle: Triad<N::Angle>,
    cross: Triad<N::Cross>,
    previous: Triad<N::Increment>,
    before_previous: Triad<N::Increment>,
}

/// Adds one sample's increments at rest, and those with their flexure correction.
///
/// Those at rest are stored for the next samples: their difference from the others is of third order there.
#[inline(always)]
pub fn process<N: NumberSystem>(
    state: &mut ConingState<N>,
    at_rest: Triad<N::Increment>,
    d: Triad<N::Increment>,
) {
    let (one, two, angle) = (state.previous, state.before_previous, state.angle);
    let u = Triad {
        x: N::lever(angle.x, one.x, two.x),
        y: N::lever(angle.y, one.y, two.y),
        z: N::lever(angle.z, one.z, two.z),
    };
    state.angle = Triad {
        x: N::advance(angle.x, d.x),
        y: N::advance(angle.y, d.y),
        z: N::advance(angle.z, d.z),
    };
    state.cross = Triad {
        x: N::add_cross(state.cross.x, u.y, d.z, u.z, d.y),
        y: N::add_cross(state.cross.y, u.z, d.x, u.x, d.z),
        z: N::add_cross(state.cross.z, u.x, d.y, u.y, d.x),
    };
    state.before_previous = one;
    state.previous = at_rest;
}

/// Forgets the last two increments after lost samples: they are not neighbours of the next one.
pub fn resume<N: NumberSystem>(state: &mut ConingState<N>) {
    state.previous = Triad::default();
    state.before_previous = Triad::default();
}

/// Gives the period's sum \[fine units\] and starts the next one; `unit_log2` is the increment unit's exponent.
#[inline(always)]
pub fn finish<N: NumberSystem>(state: &mut ConingState<N>, unit_log2: u32) -> [i64; 3] {
    let cross = core::mem::take(&mut state.cross);
    state.angle = Triad::default();
    let half = |sum| N::fine(N::Tilted::default(), sum);
    let correction = [half(cross.x), half(cross.y), half(cross.z)];
    if unit_log2 != 0 {
        core::hint::cold_path();
        // Products of two increments are in squares of their unit.
        return correction.map(|fine| fine << (2 * unit_log2));
    }
    correction
}

impl<N: NumberSystem> ConingState<N> {
    /// D of the latest sample \[rad\].
    #[inline(always)]
    pub(crate) fn latest(&self) -> Triad<N::Increment> {
        self.previous
    }

    /// D of the sample before it \[rad\].
    #[inline(always)]
    pub(crate) fn before_latest(&self) -> Triad<N::Increment> {
        self.before_previous
    }

    /// θ since the period's start.
    #[inline(always)]
    pub(crate) fn angle(&self) -> Triad<N::Angle> {
        self.angle
    }
}
