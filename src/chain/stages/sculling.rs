//! Sums the sculling correction: the period's velocity by common oscillations of rotation and velocity.
//!
//! It takes, every sample, the sums of the coning stage \[rad\] and the velocity increment D_v \[units of 2⁸ m/s\],
//! both in the body frame. Once per output period it gives S = ½ ∫ (θ × f + v × ω) dt \[fine units\].
//!
//! With rotation and velocity summed since the period's start, ∫ θ × f dt = ½ θ × v + S at the period's end:
//! the first term is a steady turn's and is added there (`turning.rs`); S is the rectified part, of a rocking in step
//! with a vibration across it. With θ + e v in place of θ in the coning integral ½ ∫ θ × ω dt the factor of e is S. So
//! a coning algorithm is a sculling algorithm (Roscoe 2001, *Equivalency Between Strapdown Inertial Coning
//! and Sculling Integrals/Algorithms*; Savage 1998, part 2), with the very same coefficients:
//!
//! S = ½ Σ_k (u_θ × D_v,k + u_v × D_k),  u = sum_{k−1} + 2c₁ D_{k−1} + 2c₂ D_{k−2} of either.
//!
//! It runs after coning and keeps its own copy of the values that coning has overwritten, so the chain without
//! accelerometers spends nothing on it.
//!
//! The velocity in the lever is the sensed one, size effect included: the identity above holds for any
//! force, and the size effect is removed in `size_effect.rs`, where that is exact.
//!
//! Of the terms of second order in θ only the steady turn's are formed (`turning.rs`). For an oscillation of φ at Ω the
//! residual rectifies as φ²(ΩT_o)⁴/360 of the force, T_o the output period: 0.05 µg at 1 g for 0.1° at 100 Hz and 2.5
//! ms.

use crate::chain::numbers::NumberSystem;
use crate::chain::stages::coning::ConingState;
use crate::chain::triad::Triad;

/// Sums since the period's start, and the last two increments.
#[derive(Debug, Clone, Copy, Default)]
pub struct ScullingState<N: NumberSystem> {
    velocity: Triad<N::Angle>,
    cross: Triad<N::Cross>,
    previous: Triad<N::Increment>,
    before_previous: Triad<N::Increment>,
    /// θ_{k−1} and D_{k−2}.
    angle: Triad<N::Angle>,
    turned_before: Triad<N::Increment>,
}

/// Adds one sample's velocity increment; coning has already added the sample's rotation.
#[inline(always)]
pub fn process<N: NumberSystem>(
    state: &mut ScullingState<N>,
    coning: &ConingState<N>,
    velocity: Triad<N::Increment>,
) {
    let (d, d_one, d_two) = (coning.latest(), coning.before_latest(), state.turned_before);
    let u = Triad {
        x: N::lever(state.angle.x, d_one.x, d_two.x),
        y: N::lever(state.angle.y, d_one.y, d_two.y),
        z: N::lever(state.angle.z, d_one.z, d_two.z),
    };
    state.angle = coning.angle();
    state.turned_before = d_one;

    let (one, two, sum) = (state.previous, state.before_previous, state.velocity);
    let lever = Triad {
        x: N::lever(sum.x, one.x, two.x),
        y: N::lever(sum.y, one.y, two.y),
        z: N::lever(sum.z, one.z, two.z),
    };
    state.velocity = Triad {
        x: N::advance(sum.x, velocity.x),
        y: N::advance(sum.y, velocity.y),
        z: N::advance(sum.z, velocity.z),
    };
    let with_force = add::<N>(state.cross, u, velocity);
    state.cross = add::<N>(with_force, lever, d);
    state.before_previous = one;
    state.previous = velocity;
}

impl<N: NumberSystem> ScullingState<N> {
    /// Velocity increment of the latest sample.
    pub(crate) fn latest(&self) -> Triad<N::Increment> {
        self.previous
    }
}

/// sum + lever × increment.
#[inline(always)]
fn add<N: NumberSystem>(
    sum: Triad<N::Cross>,
    u: Triad<N::Lever>,
    d: Triad<N::Increment>,
) -> Triad<N::Cross> {
    Triad {
        x: N::add_cross(sum.x, u.y, d.z, u.z, d.y),
        y: N::add_cross(sum.y, u.z, d.x, u.x, d.z),
        z: N::add_cross(sum.z, u.x, d.y, u.y, d.x),
    }
}

/// Forgets the last two increments after lost samples: they are not neighbours of the next one.
pub fn resume<N: NumberSystem>(state: &mut ScullingState<N>) {
    state.turned_before = Triad::default();
    state.previous = Triad::default();
    state.before_previous = Triad::default();
}

/// Gives the period's sum \[fine units\] and starts the next one; `unit_log2` is the increment unit's exponent.
#[inline(always)]
pub fn finish<N: NumberSystem>(state: &mut ScullingState<N>, unit_log2: u32) -> [i64; 3] {
    let cross = core::mem::take(&mut state.cross);
    state.velocity = Triad::default();
    state.angle = Triad::default();
    let half = |sum| N::fine(N::Tilted::default(), sum) << (2 * unit_log2);
    [half(cross.x), half(cross.y), half(cross.z)]
}
