//! Sensed increments → increments of the case: each block's own motion stripped.
//!
//! Enters: sensed increments \[rad, short units\]; block angles relative to the case at the sample's end
//! \[pickoff codes\]. Leaves: D = D_sensed − g (pickoff_k − pickoff_{k−1}) \[rad, short units\], not
//! yet rounded.
//!
//! The strip comes before the acceleration: 150″ at 400 Hz is 4600 rad/s² of block motion that the other
//! gyros do not feel, and a matrix that followed it would inject it.
//!
//! The codes are differenced as integers, so that the strip telescopes. A step beyond
//! ±[`DITHER_LIMIT_RAD`] is held there and flagged. The first sample has no previous reading; it only
//! primes the state (`Chain` drops that sample's increment).
//!
//! It does not filter the pickoff, nor correct its delay or nonlinearity.

use crate::design_parameters::DITHER_LIMIT_RAD;
use crate::faults::Status;
use crate::numbers::{NumberSystem, Unrounded};
use crate::parameters::{Parameters, ShortWeight};
use crate::triad::Triad;

/// One axis: gain × code weight, and the step that reaches the limit.
#[derive(Debug, Clone, Copy, Default)]
struct Axis<N: NumberSystem> {
    gain: N::PickoffGain,
    limit_codes: i32,
}

/// Configuration.
#[derive(Debug, Clone, Copy)]
pub struct Dither<N: NumberSystem> {
    axes: Triad<Axis<N>>,
}

/// The previous sample's readings \[codes\].
#[derive(Debug, Clone, Copy, Default)]
pub struct DitherState {
    previous: [i32; 3],
}

impl<N: NumberSystem> Dither<N> {
    pub(crate) fn new(parameters: &Parameters) -> Self {
        let axis = |index: usize| {
            let left = ShortWeight::of(parameters.pulse_weight_rad[index]).left;
            let rad_per_code =
                parameters.pickoff_gain[index] * parameters.pickoff_weight_rad / left;
            Axis {
                gain: N::pickoff_gain(rad_per_code),
                // A zero gain divides to infinity, which converts to i32::MAX: only a step that `i32`
                // cannot show is beyond it (i32::MIN), and it is stripped as nothing.
                limit_codes: (DITHER_LIMIT_RAD / rad_per_code) as i32,
            }
        };
        Self {
            axes: Triad::from_array([0, 1, 2]).map(axis),
        }
    }

    /// Makes the stream's first readings the previous ones, so that the first step is zero.
    #[inline(always)]
    pub fn prime(&self, state: &mut DitherState, pickoff_codes: [i32; 3]) {
        state.previous = pickoff_codes;
    }

    /// Strips one sample; flagged where a step was held.
    #[inline(always)]
    pub fn process(
        &self,
        state: &mut DitherState,
        sensed: Triad<N::Increment>,
        pickoff_codes: [i32; 3],
    ) -> (Triad<Unrounded<N>>, Status) {
        let [x, y, z] = pickoff_codes;
        let [x_before, y_before, z_before] = state.previous;
        state.previous = pickoff_codes;
        let (x, x_held) = strip::<N>(&self.axes.x, sensed.x, x, x_before);
        let (y, y_held) = strip::<N>(&self.axes.y, sensed.y, y, y_before);
        let (z, z_held) = strip::<N>(&self.axes.z, sensed.z, z, z_before);
        let held = x_held | y_held | z_held;
        (Triad { x, y, z }, Status::PICKOFF_SATURATED.when(held))
    }
}

#[inline(always)]
fn strip<N: NumberSystem>(
    axis: &Axis<N>,
    sensed: N::Increment,
    code: i32,
    code_before: i32,
) -> (Unrounded<N>, bool) {
    let step = code.saturating_sub(code_before);
    let held = step
        .min(axis.limit_codes)
        .max(axis.limit_codes.wrapping_neg());
    (N::strip(sensed, axis.gain, held), held != step)
}
