//! Pulse counts → sensed increments, and their sum over the output period.
//!
//! Enters: pulses over one sample \[1\], within their limits. Leaves: D = W n, sensed angle increments about
//! the three sensing axes after scale correction \[rad\], dither included; once per output period W Σn − b t
//! \[fine units\].
//!
//! W = (1 − s) × pulse weight. The sum is taken of the counts, as integers, and multiplied once: nothing is
//! rounded on the way. The increment is for products alone, so it leaves the bias out: a constant rate of
//! 1e-8 rad/s does not show in α, nor does it rectify with anything that oscillates.
//!
//! It does not judge lost or stuck pulses, and has no temperature terms.

use crate::chain::numbers::NumberSystem;
use crate::chain::numbers::exact::{ExactWeight, FINE_PER_RAD_LOG2, fine};
use crate::chain::stages::limits::Limits;
use crate::chain::triad::Triad;
use crate::store::parameters::Parameters;

/// Configuration.
#[derive(Debug, Clone, Copy)]
pub struct Counts<N: NumberSystem> {
    weights: Triad<N::PulseWeight>,
    exact: [ExactWeight; 3],
    /// b T \[fine units\].
    bias: [i64; 3],
}

/// Σn since the output period's start.
#[derive(Debug, Clone, Copy, Default)]
pub struct CountsState {
    sums: [i32; 3],
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

    /// Sensed increments of one sample.
    #[inline(always)]
    pub fn process(&self, state: &mut CountsState, counts: [i32; 3]) -> Triad<N::Increment> {
        state.add(counts);
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

    /// b t over any number of sample periods \[fine units\].
    pub fn bias_wide(&self, periods: i64) -> [i128; 3] {
        self.bias
            .map(|bias| i128::from(bias).wrapping_mul(i128::from(periods)))
    }

    /// W Σn since the output period's start \[fine units\].
    pub fn since_start(&self, state: &CountsState) -> [i64; 3] {
        let mut angle = [0; 3];
        for (angle, (weight, counts)) in angle.iter_mut().zip(self.exact.iter().zip(state.sums)) {
            *angle = weight.times(counts);
        }
        angle
    }

    /// W Σn − b t over `periods` sample periods \[fine units\]; starts the next sum.
    #[inline(always)]
    pub fn finish(&self, state: &mut CountsState, periods: u32) -> [i64; 3] {
        let sums = core::mem::take(&mut state.sums);
        let mut angle = [0; 3];
        // A loop and not `map`, which is a function of its own in the image.
        for axis in 0..3 {
            let bias = self.bias[axis].wrapping_mul(i64::from(periods));
            angle[axis] = self.exact[axis].times(sums[axis]).wrapping_sub(bias);
        }
        angle
    }
}

impl CountsState {
    /// Whether the sum has room for these counts, and for `reserve` more on either side.
    pub fn has_room(&self, counts: [i32; 3], reserve: [i32; 3]) -> bool {
        has_room(self.sums, counts, reserve)
    }

    /// Adds counts to the period's sum.
    #[inline(always)]
    pub fn add(&mut self, counts: [i32; 3]) {
        for (sum, counts) in self.sums.iter_mut().zip(counts) {
            *sum = sum.wrapping_add(counts);
        }
    }
}

/// Whether sum + more stays within an `i32` by `reserve`, on each axis.
pub fn has_room(sum: [i32; 3], more: [i32; 3], reserve: [i32; 3]) -> bool {
    let mut axes = sum.iter().zip(more).zip(reserve);
    axes.all(|((sum, more), reserve)| {
        let whole = i64::from(*sum).wrapping_add(i64::from(more));
        whole.abs() <= i64::from(i32::MAX.wrapping_sub(reserve))
    })
}
