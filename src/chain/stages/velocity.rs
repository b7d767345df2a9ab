//! Turns accelerometer codes into velocity increments along the body axes, and sums them exactly.
//!
//! It takes the codes of one sample \[1\]: velocity pulses, or a converter's mean force times T. It gives D_v \[units
//! of 2⁸ m/s\], body frame: as each accelerometer senses them at its place. Once per output period it gives the exact
//! sum \[fine units\].
//!
//! u_i = (1 − s_i) weight_i n_i − b_i T, and D_v = M u with the six angles of `misalignment_rad` in the pattern
//! of Eq. (7). As of the counts (`counts.rs`) the sum is taken of the codes, as integers, and multiplied once;
//! D_v is for products alone. The bias is subtracted from it, unlike from the gyros' increments: 1e-2 m/s² times a
//! rocking of the case shows as sculling.
//!
//! Codes beyond ±[`VELOCITY_LIMIT_M_S`] are held and flagged here, on the accelerometers' own path. After
//! lost samples one reading covers several periods: that many times the limit.
//!
//! It does not detect stuck readings, has no temperature terms and none of second order in the force.

use crate::chain::code_sum::CodeSum;
use crate::chain::design_parameters::{ACCELEROMETER_SUM_CODES, VELOCITY_LIMIT_M_S};
use crate::chain::faults::Status;
use crate::chain::numbers::NumberSystem;
use crate::chain::numbers::exact::{
    ExactCoefficient, ExactWeight, FINE_PER_M_S_LOG2, VELOCITY_UNIT_M_S, fine,
};
use crate::chain::parameters::{AccelerometerParameters, Parameters};
use crate::chain::stages::compensation;
use crate::chain::triad::{CrossAxis, Triad};

/// Configuration.
#[derive(Debug, Clone, Copy)]
pub struct Velocity<N: NumberSystem> {
    weights: Triad<N::PulseWeight>,
    bias: Triad<N::Increment>,
    misalignment: CrossAxis<N::Coefficient>,
    exact_weights: [ExactWeight; 3],
    /// b T \[fine units\].
    exact_bias: [i64; 3],
    exact_misalignment: CrossAxis<ExactCoefficient>,
    /// Largest codes of one sample.
    limits: [i32; 3],
}

impl<N: NumberSystem> Velocity<N> {
    pub(crate) fn new(parameters: &Parameters, accelerometers: &AccelerometerParameters) -> Self {
        let axes = [0, 1, 2];
        let weight = accelerometers.weight_m_s;
        let scaled = axes.map(|axis| weight[axis] * (1.0 - accelerometers.scale_error[axis]));
        let bias = accelerometers
            .bias_m_s2
            .map(|bias| bias / parameters.sample_rate_hz);
        let increment_unit = parameters.increment_unit_rad();
        let limit_m_s = VELOCITY_LIMIT_M_S * increment_unit;
        let share = ACCELEROMETER_SUM_CODES / i32::from(parameters.samples_per_output.max(1));
        // A float's conversion holds at the ends.
        let limits = axes.map(|axis| ((limit_m_s / weight[axis]) as i32).min(share));
        let in_units = |value_m_s: f64, limit: i32| {
            let unit = VELOCITY_UNIT_M_S * increment_unit;
            N::pulse_weight(value_m_s / unit, limit)
        };
        Self {
            weights: Triad::from_array(axes).map(|axis| in_units(scaled[axis], limits[axis])),
            // One pulse of that weight.
            bias: Triad::from_array(bias).map(|bias| N::pulses(in_units(bias, 1), 1)),
            misalignment: accelerometers.misalignment_rad.map(N::coefficient),
            exact_weights: scaled.map(|weight| ExactWeight::of(weight, FINE_PER_M_S_LOG2)),
            exact_bias: bias.map(|bias| fine(bias, FINE_PER_M_S_LOG2)),
            exact_misalignment: accelerometers.misalignment_rad.map(ExactCoefficient::of),
            limits,
        }
    }

    /// The velocity increment of one sample \[units of 2⁸ m/s\]; flagged where codes were held.
    #[inline(always)]
    pub fn process(&self, sum: &mut CodeSum, mut codes: [i32; 3]) -> (Triad<N::Increment>, Status) {
        // One comparison for both ends of each.
        let within = |axis: usize| {
            let limit = self.limits[axis];
            codes[axis].wrapping_add(limit) as u32 <= (limit as u32) << 1
        };
        let mut status = Status::default();
        if !(within(0) && within(1) && within(2)) {
            core::hint::cold_path();
            codes = held(codes, self.limits);
            status = Status::VELOCITY_SATURATED;
        }
        sum.add(codes);
        let [x, y, z] = codes;
        let sensed = Triad {
            x: N::difference(N::pulses(self.weights.x, x), self.bias.x),
            y: N::difference(N::pulses(self.weights.y, y), self.bias.y),
            z: N::difference(N::pulses(self.weights.z, z), self.bias.z),
        };
        (
            compensation::at_rest::<N>(&self.misalignment, sensed),
            status,
        )
    }

    /// M W Σn so far \[fine units\], without the bias of these few samples.
    pub fn since_start(&self, sum: &CodeSum) -> [i64; 3] {
        self.exact(sum.get(), 0)
    }

    /// Holds the codes of a reading that covers `periods` periods within their limits; flagged where they were held.
    pub fn hold(&self, codes: [i32; 3], periods: u32) -> ([i32; 3], Status) {
        let several = i32::try_from(periods).unwrap_or(i32::MAX);
        let limits = self.limits.map(|limit| limit.saturating_mul(several));
        let within = held(codes, limits);
        let mut excess = 0;
        for (within, codes) in within.iter().zip(codes) {
            excess |= within ^ codes;
        }
        (within, Status::VELOCITY_SATURATED.when(excess != 0))
    }

    /// M W n of a reading that covers several periods \[fine units\]. Their bias is in [`finish`](Self::finish), which
    /// knows how long an output period was.
    pub fn exact_wide(&self, codes: [i32; 3]) -> [i128; 3] {
        let mut sensed = [0; 3];
        for axis in 0..3 {
            sensed[axis] = self.exact_weights[axis].times_wide(codes[axis]);
        }
        compensation::at_rest_wide(&self.exact_misalignment, sensed)
    }

    /// M b t over any number of sample periods \[fine units\].
    pub fn bias_wide(&self, periods: i64) -> [i128; 3] {
        let sensed = self
            .exact_bias
            .map(|bias| i128::from(bias).wrapping_mul(i128::from(periods)));
        compensation::at_rest_wide(&self.exact_misalignment, sensed)
    }

    /// M (W Σn − b t) over `periods` sample periods \[fine units\].
    #[inline(always)]
    pub fn over(&self, sum: &CodeSum, periods: u32) -> [i64; 3] {
        self.exact(sum.get(), periods)
    }

    /// M (W Σn − b t) over `periods` sample periods \[fine units\]; starts the next sum.
    #[inline(always)]
    pub fn finish(&self, sum: &mut CodeSum, periods: u32) -> [i64; 3] {
        self.exact(sum.take(), periods)
    }

    #[inline(always)]
    fn exact(&self, codes: [i32; 3], periods: u32) -> [i64; 3] {
        let mut sensed = [0; 3];
        for axis in 0..3 {
            let bias = self.exact_bias[axis].wrapping_mul(i64::from(periods));
            sensed[axis] = self.exact_weights[axis]
                .times(codes[axis])
                .wrapping_sub(bias);
        }
        compensation::at_rest_exactly(&self.exact_misalignment, sensed)
    }
}

fn held(mut codes: [i32; 3], limits: [i32; 3]) -> [i32; 3] {
    for (code, limit) in codes.iter_mut().zip(limits) {
        *code = (*code).max(limit.wrapping_neg()).min(limit);
    }
    codes
}
