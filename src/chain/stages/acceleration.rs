//! Estimates the case's angular acceleration, α̂ T² \[rad per sample²\], from its successive increments.
//!
//! It takes the increments D \[rad\] of the case in the body frame, stripped of the dither and compensated with the
//! *static* installation matrix. The filter is causal, so the estimate errs; but its error is in phase with D, even in
//! frequency. What rectifies to a drift, the mean ⟨α̂_i D_j⟩ of coning, has D_j in quadrature with D_i and is unbiased.
//!
//! α̂_k T² = Σ_{p=1..order} c_p (D_k − D_{k−p}); coefficients and their errors in
//! [`ACCELERATION_COEFFICIENTS`](crate::chain::design_parameters::ACCELERATION_COEFFICIENTS). It is causal and
//! uses the sample's own D, because the tilt it predicts acts on that sample. Formed from differences:
//! α̂_k T² = Σ_p b_p d_{k−p+1} with d_k = D_k − D_{k−1} and b_p = Σ_{q≥p} c_q, which is the same sum with one
//! subtraction instead of four, of numbers that are small already.
//!
//! The unit is rad per sample², so that K/T² (about 1.1 for 7e-8 s² at 4 kHz) is a plain number. Beyond
//! ±[`ACCELERATION_LIMIT_RAD`](crate::chain::design_parameters::ACCELERATION_LIMIT_RAD) α̂ T² is held and flagged.
//! The stream's first increment only serves as D_{k−1} of the next one: a start in motion gives no impulse of α̂.
//!
//! Pulse quantisation of q rad shows as about 2 q of noise in α̂ T². It telescopes, and gyros quantise
//! independently, so it does not rectify and needs no further filter.

use crate::chain::design_parameters::ACCELERATION_TERMS;
use crate::chain::faults::Status;
use crate::chain::numbers::NumberSystem;
use crate::chain::parameters::Parameters;
use crate::chain::triad::Triad;

/// Configuration: b_p, zero beyond the order, so that every order costs the same.
#[derive(Debug, Clone, Copy)]
pub struct Acceleration<N: NumberSystem> {
    coefficients: [N::FilterCoefficient; ACCELERATION_TERMS],
}

/// D_{k−1}, and the differences before it, latest first \[rad\].
#[derive(Debug, Clone, Copy, Default)]
pub struct AccelerationState<N: NumberSystem> {
    previous: Triad<N::Increment>,
    differences: [[N::Increment; 3]; ACCELERATION_TERMS - 1],
}

impl<N: NumberSystem> Acceleration<N> {
    pub(crate) fn new(parameters: &Parameters) -> Self {
        let [c1, c2, c3, c4] = parameters.acceleration_coefficients();
        let of_differences = [c1 + c2 + c3 + c4, c2 + c3 + c4, c3 + c4, c4];
        Self {
            coefficients: of_differences.map(N::filter_coefficient),
        }
    }

    /// Clears the filter; the next difference is taken from `increment` \[rad\].
    pub fn start(&self, state: &mut AccelerationState<N>, increment: Triad<N::Increment>) {
        *state = AccelerationState {
            previous: increment,
            ..AccelerationState::default()
        };
    }

    /// The acceleration of one sample; flagged where it was held.
    #[inline(always)]
    pub fn process(
        &self,
        state: &mut AccelerationState<N>,
        increment: Triad<N::Increment>,
    ) -> (Triad<N::Acceleration>, Status) {
        let now = [
            N::difference(increment.x, state.previous.x),
            N::difference(increment.y, state.previous.y),
            N::difference(increment.z, state.previous.z),
        ];
        let [one, two, three] = state.differences;
        let filter = |axis: usize| {
            let differences = [now[axis], one[axis], two[axis], three[axis]];
            N::filter(&self.coefficients, differences)
        };
        let (mut x, mut y, mut z) = (filter(0), filter(1), filter(2));
        state.previous = increment;
        state.differences = [now, one, two];

        let mut status = Status::default();
        if N::beyond(x) || N::beyond(y) || N::beyond(z) {
            core::hint::cold_path();
            status = Status::ACCELERATION_SATURATED;
            // One by one: an array would be kept in memory for every sample.
            let within = |sum| if N::beyond(sum) { N::held(sum) } else { sum };
            (x, y, z) = (within(x), within(y), within(z));
        }
        let acceleration = Triad {
            x: N::acceleration(x),
            y: N::acceleration(y),
            z: N::acceleration(z),
        };
        (acceleration, status)
    }
}

impl<N: NumberSystem> AccelerationState<N> {
    /// The latest difference D_{k−1} − D_{k−2}.
    #[inline(always)]
    pub(crate) fn difference(&self) -> &[N::Increment; 3] {
        &self.differences[0]
    }
}
