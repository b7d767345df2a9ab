//! Estimates the case's angular acceleration three samples late, α̂ T² \[rad per sample²\], for terms that need it.
//!
//! It takes the increments D \[increment units\] of the case in the body frame, and gives α̂ of the sample three
//! before, with that sample's D:
//!
//! ```text
//! α̂_k T² = Σ_p a_p (D_{k+p} − D_{k−p})
//! ```
//!
//! Coefficients and their errors: [`CENTRAL_COEFFICIENTS`]. The estimate is antisymmetric in time, so that its product
//! with another axis' D rectifies as α × ω does, and not at all where the two move in phase. The sample's own angle is
//! not delayed: only the small correction that a term forms with α̂ is late by three samples.
//!
//! The unit is rad per sample², so that K/T² (about 1.1 for 7e-8 s² at 4 kHz) is a plain number. Beyond
//! ±[`ACCELERATION_LIMIT_RAD`](crate::chain::design_parameters::ACCELERATION_LIMIT_RAD) α̂ T² is held and flagged.
//! Before the stream's first increment, and within a gap, the rate is taken as constant; the last three samples before a
//! gap go without a correction.
//!
//! Pulse quantisation of q rad shows as 0.6 q of noise in α̂ T². It telescopes, and gyros quantise independently, so it
//! does not rectify.

use crate::chain::design_parameters::{CENTRAL_COEFFICIENTS, CENTRAL_PAIRS, FILTER_TERMS};
use crate::chain::faults::Status;
use crate::chain::numbers::NumberSystem;
use crate::chain::triad::Triad;

/// Configuration.
#[derive(Debug, Clone, Copy)]
pub struct Acceleration<N: NumberSystem> {
    coefficients: [N::FilterCoefficient; FILTER_TERMS],
}

/// The last increments, latest first \[increment units\]; none after a start or gap.
#[derive(Debug, Clone, Copy, Default)]
pub struct AccelerationState<N: NumberSystem> {
    past: [[N::Increment; 3]; 2 * CENTRAL_PAIRS],
    begun: bool,
}

/// One sample's acceleration and increments, both of three samples before the latest.
#[derive(Debug, Clone, Copy)]
pub struct Centred<N: NumberSystem> {
    /// α̂ T².
    pub acceleration: Triad<N::Acceleration>,
    /// D.
    pub increment: Triad<N::Increment>,
    /// Status bits of held values.
    pub status: Status,
}

impl<N: NumberSystem> Acceleration<N> {
    pub(crate) fn new() -> Self {
        let [a1, a2, a3] = CENTRAL_COEFFICIENTS;
        Self {
            coefficients: [a1, a2, a3, 0.0].map(N::filter_coefficient),
        }
    }

    /// Takes one sample's increments. The rate before the first one is taken to be its own.
    #[inline(always)]
    pub fn process(
        &self,
        state: &mut AccelerationState<N>,
        increment: Triad<N::Increment>,
    ) -> Centred<N> {
        let now = increment.to_array();
        if !state.begun {
            core::hint::cold_path();
            state.begun = true;
            state.past = [now; 2 * CENTRAL_PAIRS];
        }
        let [two, one, centre, before_one, before_two, before_three] = state.past;
        let filter = |axis: usize| {
            let differences = [
                N::difference(one[axis], before_one[axis]),
                N::difference(two[axis], before_two[axis]),
                N::difference(now[axis], before_three[axis]),
                N::Increment::default(),
            ];
            N::filter(&self.coefficients, differences)
        };
        let (mut x, mut y, mut z) = (filter(0), filter(1), filter(2));
        state.past = [now, two, one, centre, before_one, before_two];

        let mut status = Status::default();
        if N::beyond(x) || N::beyond(y) || N::beyond(z) {
            core::hint::cold_path();
            status = Status::ACCELERATION_SATURATED;
            // One by one: an array would be kept in memory for every sample.
            let within = |sum| if N::beyond(sum) { N::held(sum) } else { sum };
            (x, y, z) = (within(x), within(y), within(z));
        }
        Centred {
            acceleration: Triad {
                x: N::acceleration(x),
                y: N::acceleration(y),
                z: N::acceleration(z),
            },
            increment: Triad::from_array(centre),
            status,
        }
    }
}

/// Records that the next increments do not follow the last ones.
pub fn forget<N: NumberSystem>(state: &mut AccelerationState<N>) {
    state.begun = false;
}
