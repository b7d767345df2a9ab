//! Stripped increments → corrected for scale and bias: the right-hand vector of Eq. (7).
//!
//! Enters: stripped increments \[rad, short units\] and their rounding remainder. Leaves:
//! r = (1 − s) λ D − b T \[rad\], about the sensing axes.
//!
//! λ is what the short pulse weight left (`counts.rs`); s' = 1 − (1 − s) λ is within ±1/64, so D keeps
//! its own accuracy: r = D − (s' D + b T − remainder).
//!
//! It has no temperature terms.

use crate::numbers::NumberSystem;
use crate::parameters::{Parameters, ShortWeight};
use crate::stages::dither::Stripped;
use crate::triad::Triad;

/// One axis: −s' and −b T.
#[derive(Debug, Clone, Copy, Default)]
struct Axis<N: NumberSystem> {
    minus_scale: N::Coefficient,
    minus_bias: N::Correction,
}

/// Configuration.
#[derive(Debug, Clone, Copy)]
pub struct RateCorrection<N: NumberSystem> {
    axes: Triad<Axis<N>>,
}

/// What rounding left of the last sample \[rad\].
#[derive(Debug, Clone, Copy, Default)]
pub struct RateCorrectionState<N: NumberSystem> {
    carry: Triad<N::Correction>,
}

impl<N: NumberSystem> RateCorrection<N> {
    pub(crate) fn new(parameters: &Parameters) -> Self {
        let axis = |index: usize| {
            let left = ShortWeight::of(parameters.pulse_weight_rad[index]).left;
            let scale = (1.0 - parameters.scale_error[index]) * left;
            Axis {
                minus_scale: N::coefficient(scale - 1.0),
                minus_bias: N::correction(
                    -parameters.bias_rad_s[index] / parameters.sample_rate_hz,
                ),
            }
        };
        Self {
            axes: Triad::from_array([0, 1, 2]).map(axis),
        }
    }

    /// Corrects one sample.
    #[inline(always)]
    pub fn process(
        &self,
        state: &mut RateCorrectionState<N>,
        stripped: Stripped<N>,
    ) -> Triad<N::Increment> {
        Triad {
            x: correct::<N>(&self.axes.x, stripped.x, &mut state.carry.x),
            y: correct::<N>(&self.axes.y, stripped.y, &mut state.carry.y),
            z: correct::<N>(&self.axes.z, stripped.z, &mut state.carry.z),
        }
    }
}

#[inline(always)]
fn correct<N: NumberSystem>(
    axis: &Axis<N>,
    (increment, remainder): (N::Increment, N::Correction),
    carry: &mut N::Correction,
) -> N::Increment {
    let correction = N::add_product(axis.minus_bias + remainder, axis.minus_scale, increment);
    N::correct(increment, correction, carry)
}
