//! Corrects delays and bandwidths: gyros and accelerometers whose output is late or smoothed.
//!
//! It takes increments about the sensing axes (velocity increments of the accelerometers) of every sample. It gives
//! corrected increments for products of samples and, once per output period, corrected angles \[fine units\].
//!
//! A gyro that is late by d has sensed A(t − d) where the angle is A(t); with L = d/T the missing angle at a sample's
//! end follows by Newton's backward extrapolation of A, ∇A_k = D_k (to fourth order),
//!
//! ```text
//! E_k = A(k + L) − A(k) = L D_k + L(L+1)/2 ∇D_k + L(L+1)(L+2)/6 ∇²D_k + L(L+1)(L+2)(L+3)/24 ∇³D_k
//! ```
//!
//! A path of variance v senses ω + (v/2) ω″; its excess is the angle (v/2) ω′ at a sample's end,
//! T² ω′_k = (∇D + ∇²D + 11/12 ∇³D)_k by backward differentiation of A.
//!
//! Both have the form E_k = Σ e_p D_{k−p}, and [`ends`](crate::chain::terms::ends) applies it.
//!
//! The correction of one sample's increment is held within ±[`RESPONSE_LIMIT_RAD`]: steps of an acceleration beyond the
//! chain's
//! range must not reach its products.

use crate::chain::design_parameters::{
    DELAY_LIMIT_SAMPLES, DITHER_ERROR_LIMIT_RAD, FILTER_TERMS, RESPONSE_LIMIT_RAD,
    VARIANCE_LIMIT_SAMPLES, VELOCITY_LIMIT_M_S,
};
use crate::chain::numbers::NumberSystem;
use crate::chain::numbers::exact::VELOCITY_UNIT_M_S;
use crate::chain::parameters::{ParameterError, Parameters};
use crate::chain::terms::ends::{Ends, LARGEST_AHEAD};
use crate::chain::terms::{PeriodSums, Term, TermKind, TermKinds};
use crate::chain::triad::Triad;

/// Largest growth of a velocity within its limit by scale errors and misalignments of 1/128 \[1\].
const LARGEST_OF_MISALIGNMENT: f64 = 1.03;

/// Coefficients e_p by axis.
type Coefficients = [[f64; FILTER_TERMS]; 3];

/// Backward differences of orders 0 to 3 in terms of D_k … D_{k−3}.
const DIFFERENCES: [[f64; FILTER_TERMS]; FILTER_TERMS] = [
    [1.0, 0.0, 0.0, 0.0],
    [1.0, -1.0, 0.0, 0.0],
    [1.0, -2.0, 1.0, 0.0],
    [1.0, -3.0, 3.0, -1.0],
];

/// Factors of the backward differences, as coefficients of D_k … D_{k−3}.
fn of_differences(factors: [f64; FILTER_TERMS]) -> [f64; FILTER_TERMS] {
    let mut coefficients = [0.0; FILTER_TERMS];
    for (factor, difference) in factors.iter().zip(DIFFERENCES) {
        for (coefficient, part) in coefficients.iter_mut().zip(difference) {
            *coefficient += factor * part;
        }
    }
    coefficients
}

/// e_p of a delay \[sampling periods\].
fn of_delay(l: f64) -> [f64; FILTER_TERMS] {
    let second = l * (l + 1.0) / 2.0;
    let third = second * (l + 2.0) / 3.0;
    of_differences([l, second, third, third * (l + 3.0) / 4.0])
}

/// e_p of a path's variance over T² \[1\].
fn of_variance(v: f64) -> [f64; FILTER_TERMS] {
    let half = -0.5 * v;
    of_differences([0.0, half, half, half * 11.0 / 12.0])
}

/// Configuration of three paths that are linear in their own increments.
#[derive(Debug, Clone, Copy)]
struct Response<N: NumberSystem> {
    coefficients: [[N::FilterCoefficient; FILTER_TERMS]; 3],
    limit: N::Increment,
}

/// The last increments, and E.
#[derive(Debug, Clone, Copy, Default)]
pub struct ResponseState<N: NumberSystem> {
    /// D_{k−1}, D_{k−2}, D_{k−3}.
    past: [[N::Increment; FILTER_TERMS - 1]; 3],
    ends: Ends<N>,
}

impl<N: NumberSystem> Response<N> {
    /// From coefficients, for increments of up to `largest` \[increment units\]; the error names the kind.
    fn new(
        coefficients: &Coefficients,
        largest: f64,
        kind: TermKind,
    ) -> Result<Self, ParameterError> {
        let most = |axis: &[f64; FILTER_TERMS]| axis.iter().map(|e| e.abs()).sum::<f64>();
        // E must fit the format of an increment, and each e that of a filter coefficient.
        let fits = |axis: &[f64; FILTER_TERMS]| {
            most(axis) * largest <= LARGEST_AHEAD && axis.iter().all(|e| e.abs() < 2.0)
        };
        if !coefficients.iter().all(fits) {
            return Err(ParameterError::Term(kind));
        }
        Ok(Self {
            coefficients: coefficients.map(|axis| axis.map(N::filter_coefficient)),
            limit: N::increment(RESPONSE_LIMIT_RAD),
        })
    }

    #[cold]
    #[inline(never)]
    fn begin(&self, state: &mut ResponseState<N>, increments: Triad<N::Increment>) {
        let mut ahead = [N::Increment::default(); 3];
        for (axis, now) in increments.to_array().into_iter().enumerate() {
            state.past[axis] = [now; FILTER_TERMS - 1];
            ahead[axis] = N::filtered(N::filter(&self.coefficients[axis], [now; 4]));
        }
        state.ends.begin(ahead);
    }

    #[inline(always)]
    fn increments(
        &self,
        state: &mut ResponseState<N>,
        increments: Triad<N::Increment>,
    ) -> Triad<N::Increment> {
        let mut corrected = increments.to_array();
        for (axis, corrected) in corrected.iter_mut().enumerate() {
            let now = *corrected;
            let [one, two, three] = state.past[axis];
            let ahead = N::filtered(N::filter(&self.coefficients[axis], [now, one, two, three]));
            *corrected = N::add(now, state.ends.gain(axis, ahead, self.limit));
            state.past[axis] = [now, one, two];
        }
        Triad::from_array(corrected)
    }
}

/// Each value times `per_sample`, which must lie within `limit`; the error names the kind.
fn in_samples(
    values: [f64; 3],
    per_sample: f64,
    limit: (f64, f64),
    kind: TermKind,
) -> Result<[f64; 3], ParameterError> {
    let values = values.map(|value| value * per_sample);
    // Written so that NaN fails.
    if values.iter().all(|v| (limit.0..=limit.1).contains(v)) {
        Ok(values)
    } else {
        Err(ParameterError::Term(kind))
    }
}

/// Delays of the gyros, and the variances of their paths.
#[derive(Debug, Clone, Copy)]
pub struct GyroResponse<N: NumberSystem>(Response<N>);

impl<N: NumberSystem> Term<N> for GyroResponse<N> {
    type State = ResponseState<N>;
    const KINDS: TermKinds = TermKinds::of(&[TermKind::GyroDelay, TermKind::GyroBandwidth]);

    fn new(parameters: &Parameters) -> Result<Self, ParameterError> {
        let rate = parameters.sample_rate_hz;
        let delay = in_samples(
            parameters.terms.values(TermKind::GyroDelay),
            rate,
            (-DELAY_LIMIT_SAMPLES, DELAY_LIMIT_SAMPLES),
            TermKind::GyroDelay,
        )?;
        let variance = in_samples(
            parameters.terms.values(TermKind::GyroBandwidth),
            rate * rate,
            (-VARIANCE_LIMIT_SAMPLES, VARIANCE_LIMIT_SAMPLES),
            TermKind::GyroBandwidth,
        )?;
        let coefficients = [0, 1, 2].map(|axis| {
            let (delay, variance) = (of_delay(delay[axis]), of_variance(variance[axis]));
            [0, 1, 2, 3].map(|p| delay[p] + variance[p])
        });
        // Terms before this one may have corrected the residual of the dither.
        let largest = parameters.largest_increment_rad() / parameters.increment_unit_rad()
            + DITHER_ERROR_LIMIT_RAD;
        // An E beyond its format is attributed to the variance if there is one: 0.66 T² may fill it alone.
        let kind = if variance == [0.0; 3] {
            TermKind::GyroDelay
        } else {
            TermKind::GyroBandwidth
        };
        Response::new(&coefficients, largest, kind).map(Self)
    }
    fn largest_addition(&self) -> f64 {
        RESPONSE_LIMIT_RAD
    }
    fn begin(&self, state: &mut ResponseState<N>, increments: Triad<N::Increment>) {
        self.0.begin(state, increments);
    }
    #[inline(always)]
    fn increments(
        &self,
        state: &mut ResponseState<N>,
        increments: Triad<N::Increment>,
    ) -> Triad<N::Increment> {
        self.0.increments(state, increments)
    }
    #[inline(always)]
    fn angles(
        &self,
        state: &mut ResponseState<N>,
        sums: &PeriodSums,
        angles: [i64; 3],
    ) -> [i64; 3] {
        state.ends.sum(sums.unit_log2, angles)
    }
    fn discontinue(&self, state: &mut ResponseState<N>) {
        state.ends.current = false;
    }
    fn degrade(&self, state: &mut ResponseState<N>, rates_known: bool) {
        state.ends.unknown = !rates_known;
    }
}

/// Delays of the accelerometers. Acts on the body's axes: misalignments times delays are left out.
#[derive(Debug, Clone, Copy)]
pub struct AccelerometerDelay<N: NumberSystem>(Response<N>);

impl<N: NumberSystem> Term<N> for AccelerometerDelay<N> {
    type State = ResponseState<N>;
    const KINDS: TermKinds = TermKinds::of(&[TermKind::AccelDelay]);

    fn new(parameters: &Parameters) -> Result<Self, ParameterError> {
        let delay = in_samples(
            parameters.terms.values(TermKind::AccelDelay),
            parameters.sample_rate_hz,
            (-DELAY_LIMIT_SAMPLES, DELAY_LIMIT_SAMPLES),
            TermKind::AccelDelay,
        )?;
        let largest = VELOCITY_LIMIT_M_S / VELOCITY_UNIT_M_S * LARGEST_OF_MISALIGNMENT;
        Response::new(&delay.map(of_delay), largest, TermKind::AccelDelay).map(Self)
    }
    #[inline(always)]
    fn velocities(
        &self,
        state: &mut ResponseState<N>,
        velocities: Triad<N::Increment>,
    ) -> Triad<N::Increment> {
        if !state.ends.current {
            core::hint::cold_path();
            self.0.begin(state, velocities);
        }
        self.0.increments(state, velocities)
    }
    #[inline(always)]
    fn felt(&self, state: &mut ResponseState<N>, unit_log2: u32, velocity: [i64; 3]) -> [i64; 3] {
        state.ends.sum(unit_log2, velocity)
    }
    fn discontinue(&self, state: &mut ResponseState<N>) {
        state.ends.current = false;
    }
}
