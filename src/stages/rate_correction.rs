//! Stripped increments → corrected for scale and bias: the right-hand vector of Eq. (7).
//!
//! Enters: stripped increments \[rad, short units\]. Leaves: r = (1 − s) λ D − b T \[rad\], about the sensing
//! axes, not yet rounded.
//!
//! λ is what the short pulse weight left (`counts.rs`); s' = 1 − (1 − s) λ is within ±1/64, so D keeps
//! its own accuracy: r = D − (s' D + b T), and D's remainder with it.
//!
//! It has no temperature terms.

use crate::numbers::{NumberSystem, Unrounded};
use crate::parameters::{Parameters, ShortWeight};
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
    pub fn process(&self, stripped: Triad<Unrounded<N>>) -> Triad<Unrounded<N>> {
        Triad {
            x: correct(&self.axes.x, stripped.x),
            y: correct(&self.axes.y, stripped.y),
            z: correct(&self.axes.z, stripped.z),
        }
    }
}

#[inline(always)]
fn correct<N: NumberSystem>(axis: &Axis<N>, stripped: Unrounded<N>) -> Unrounded<N> {
    let Unrounded { increment, small } = stripped;
    let scale = N::product(axis.minus_scale, increment);
    Unrounded {
        increment,
        small: small + axis.minus_bias + scale,
    }
}
