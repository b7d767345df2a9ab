//! Pulse counts → sensed increments.
//!
//! Enters: pulses over one sample \[1\]. Leaves: sensed angle increments about the three sensing axes
//! \[rad\], dither included, **in units of the short pulse weight**.
//!
//! D = w n. The weight w is used as w = λ v: v of at most 11 bits multiplies the counts exactly in both
//! number systems, and λ = 1 ± 2⁻¹² is left to the rate correction, (1 − s) λ = 1 − s'.
//!
//! Counts beyond ±[`SENSED_LIMIT_RAD`] are held there and flagged.
//!
//! It does not judge lost or stuck pulses.

use crate::design_parameters::SENSED_LIMIT_RAD;
use crate::faults::Status;
use crate::numbers::NumberSystem;
use crate::parameters::{Parameters, ShortWeight};
use crate::triad::Triad;

/// One axis: v and the counts that reach the limit.
#[derive(Debug, Clone, Copy, Default)]
struct Axis<N: NumberSystem> {
    weight: N::PulseWeight,
    limit_counts: i32,
}

/// Configuration.
#[derive(Debug, Clone, Copy)]
pub struct Counts<N: NumberSystem> {
    axes: Triad<Axis<N>>,
}

impl<N: NumberSystem> Counts<N> {
    pub(crate) fn new(parameters: &Parameters) -> Self {
        let axis = |weight_rad: f64| {
            let short_rad = ShortWeight::of(weight_rad).short_rad;
            Axis {
                weight: N::pulse_weight(short_rad),
                limit_counts: (SENSED_LIMIT_RAD / short_rad) as i32,
            }
        };
        Self {
            axes: Triad::from_array(parameters.pulse_weight_rad).map(axis),
        }
    }

    /// Sensed increments of one sample, and whether a count was held.
    #[inline(always)]
    pub fn process(&self, pulse_counts: [i32; 3]) -> (Triad<N::Increment>, Status) {
        let [x, y, z] = pulse_counts;
        let (x, x_held) = pulses::<N>(&self.axes.x, x);
        let (y, y_held) = pulses::<N>(&self.axes.y, y);
        let (z, z_held) = pulses::<N>(&self.axes.z, z);
        let held = x_held | y_held | z_held;
        (Triad { x, y, z }, Status::COUNTS_SATURATED.when(held))
    }
}

#[inline(always)]
fn pulses<N: NumberSystem>(axis: &Axis<N>, counts: i32) -> (N::Increment, bool) {
    let held = counts
        .min(axis.limit_counts)
        .max(axis.limit_counts.wrapping_neg());
    (N::pulses(axis.weight, held), held != counts)
}
