//! Case increments → angular acceleration.
//!
//! Enters: increments D \[rad\] in the body frame: stripped, corrected, and compensated with the *static*
//! matrix. Leaves: α̂ T² \[rad per sample²\] of the case, at the middle of the sample in the sense that its
//! product with D has the right mean.
//!
//! α̂_k T² = Σ_{p=1..order} c_p (D_k − D_{k−p}); coefficients and their errors in
//! [`ACCELERATION_COEFFICIENTS`](crate::design_parameters::ACCELERATION_COEFFICIENTS). It is causal and
//! uses the sample's own D, because the tilt it predicts acts on that sample.
//!
//! The unit is rad per sample², so that K/T² (about 1.1 for 7e-8 s² at 4 kHz) is a plain number. Beyond
//! ±[`ACCELERATION_LIMIT_RAD`](crate::design_parameters::ACCELERATION_LIMIT_RAD) α̂ T² is held and flagged.
//! The history starts at the first increment it is given, so that a start in motion is no impulse.
//!
//! Pulse quantisation of q rad shows as about 2 q of noise in α̂ T². It telescopes, and gyros quantise
//! independently, so it does not rectify; no further filter is spent on it.

use crate::design_parameters::ACCELERATION_TERMS;
use crate::faults::Status;
use crate::numbers::NumberSystem;
use crate::parameters::Parameters;
use crate::triad::Triad;

/// Configuration: c_p, zero beyond the order, so that every order costs the same.
#[derive(Debug, Clone, Copy)]
pub struct Acceleration<N: NumberSystem> {
    coefficients: [N::FilterCoefficient; ACCELERATION_TERMS],
}

/// D_{k−1}, D_{k−2}, ... \[rad\].
#[derive(Debug, Clone, Copy, Default)]
pub struct AccelerationState<N: NumberSystem> {
    history: [Triad<N::Increment>; ACCELERATION_TERMS],
}

impl<N: NumberSystem> Acceleration<N> {
    pub(crate) fn new(parameters: &Parameters) -> Self {
        Self {
            coefficients: parameters
                .acceleration_coefficients()
                .map(N::filter_coefficient),
        }
    }

    /// Fills the history with the stream's first increment.
    #[inline(always)]
    pub fn start(&self, state: &mut AccelerationState<N>, increment: Triad<N::Increment>) {
        state.history = [increment; ACCELERATION_TERMS];
    }

    /// The acceleration of one sample; flagged where it was held.
    #[inline(always)]
    pub fn process(
        &self,
        state: &mut AccelerationState<N>,
        increment: Triad<N::Increment>,
    ) -> (Triad<N::Acceleration>, Status) {
        let [one, two, three, four] = state.history;
        let filter = |now, past: [N::Increment; ACCELERATION_TERMS]| {
            let [c1, c2, c3, c4] = self.coefficients;
            let [p1, p2, p3, p4] = past;
            N::difference(c1, now, p1)
                + N::difference(c2, now, p2)
                + N::difference(c3, now, p3)
                + N::difference(c4, now, p4)
        };
        let sum = Triad {
            x: filter(increment.x, [one.x, two.x, three.x, four.x]),
            y: filter(increment.y, [one.y, two.y, three.y, four.y]),
            z: filter(increment.z, [one.z, two.z, three.z, four.z]),
        };
        state.history = [increment, one, two, three];

        let (x, x_held) = N::acceleration(sum.x);
        let (y, y_held) = N::acceleration(sum.y);
        let (z, z_held) = N::acceleration(sum.z);
        let held = x_held | y_held | z_held;
        (Triad { x, y, z }, Status::ACCELERATION_SATURATED.when(held))
    }
}
