//! Turns pulse counts into sensed increments \[rad\], and sums them exactly over the output period.
//!
//! It takes the pulses of one sample \[1\], within their limits, and gives D = W n, the angle increments about the
//! three sensing axes after scale correction \[rad\], dither included. Once per output period it gives W Σn − b t
//! \[fine units\].
//!
//! W = (1 − s) × pulse weight. The sum is taken of the counts, as integers, and multiplied once: nothing is
//! rounded on the way. The increment is for products alone, so it leaves the bias out: a constant rate of
//! 1e-8 rad/s does not show in α, nor does it rectify with anything that oscillates.
//!
//! It does not detect lost or stuck pulses, and has no temperature terms.

use crate::chain::code_sum::CodeSum;
use crate::chain::numbers::NumberSystem;
use crate::chain::numbers::exact::{ExactWeight, FINE_PER_RAD_LOG2, fine};
use crate::chain::parameters::Parameters;
use crate::chain::stages::limits::Limits;
use crate::chain::triad::Triad;

/// Configuration.
#[derive(Debug, Clone, Copy)]
pub struct Counts<N: NumberSystem> {
    weights: Triad<N::PulseWeight>,
    exact: [ExactWeight; 3],
    /// b T \[fine units\].
    bias: [i64; 3],
}

impl<N: NumberSystem> Counts<N> {
    pub(crate) fn new(parameters: &Parameters, limits: &Limits) -> Self {
        let weight =
            |axis: usize| parameters.pulse_weight_rad[axis] * (1.0 - parameters.scale_error[axis]);
        let limits = limits.counts();
        Self {
            weights: Triad::from_array([0, 1, 2]).map(|axis| {
                let in_units = weight(axis) / parameters.increment_unit_rad();
                N::pulse_weight(in_units, limits[axis])
            }),
            exact: [0, 1, 2].map(|axis| ExactWeight::of(weight(axis), FINE_PER_RAD_LOG2)),
            bias: parameters
                .bias_rad_s
                .map(|bias| fine(bias / parameters.sample_rate_hz, FINE_PER_RAD_LOG2)),
        }
    }

    /// Sensed increments of one sample \[rad\].
    #[inline(always)]
    pub fn process(&self, sum: &mut CodeSum, counts: [i32; 3]) -> Triad<N::Increment> {
        sum.add(counts);
        let [x, y, z] = counts;
        Triad {
            x: N::pulses(self.weights.x, x),
            y: N::pulses(self.weights.y, y),
            z: N::pulses(self.weights.z, z),
        }
    }

    /// W n of a reading that covers several periods \[fine units\].
    pub fn exact_wide(&self, counts: [i32; 3]) -> [i128; 3] {
        let mut angle = [0; 3];
        for (angle, (weight, counts)) in angle.iter_mut().zip(self.exact.iter().zip(counts)) {
            *angle = weight.times_wide(counts);
        }
        angle
    }

    /// b t over any number of sample periods \[fine units\], with `more` bias a period by terms.
    pub fn bias_wide(&self, periods: i64, more: [i64; 3]) -> [i128; 3] {
        core::array::from_fn(|axis| {
            let bias = self.bias[axis].wrapping_add(more[axis]);
            i128::from(bias).wrapping_mul(i128::from(periods))
        })
    }

    /// W Σn since the output period's start \[fine units\].
    pub fn since_start(&self, sum: &CodeSum) -> [i64; 3] {
        let mut angle = [0; 3];
        for (angle, (weight, counts)) in angle.iter_mut().zip(self.exact.iter().zip(sum.get())) {
            *angle = weight.times(counts);
        }
        angle
    }

    /// W Σn − b t of one gyro over `periods` sample periods \[fine units\], with `more` bias a period by terms;
    /// starts the gyro's next sum.
    #[inline(always)]
    pub fn finish(&self, sum: &mut CodeSum, axis: usize, periods: u32, more: i64) -> i64 {
        let bias = self.bias[axis].wrapping_add(more);
        let bias = bias.wrapping_mul(i64::from(periods));
        self.exact[axis]
            .times(sum.take_axis(axis))
            .wrapping_sub(bias)
    }
}
