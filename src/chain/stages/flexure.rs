//! Sums the flexure's part of the gyros' angles while the case accelerates, which the output period subtracts.
//!
//! It takes the case's increments D \[increment units\], body frame, every sample. Once per output period it gives the
//! correction of the angles about the sensing axes \[fine units\]. It lacks the acceleration of before a start or gap.
//!
//! A tilt δ_ij = −K_ij α_j turns gyro i's sensing axis about body axis j, and gyro x then senses
//! δ_xz ω_y − δ_xy ω_z more (y: δ_yx ω_z − δ_yz ω_x, z: δ_zy ω_x − δ_zx ω_y). With i, j, k the axes in cyclic order the
//! correction of gyro i is
//!
//! ```text
//! Σ_n −K_ij α̂_j D_k + K_ik α̂_k D_j        α̂_n T² = Σ_p a_p (D_{n+p} − D_{n−p})
//! ```
//!
//! Eq. (6) as printed has ε_ij = ε_ij0 − K_ij α_j for all six. Read literally, coning of 0.367° at 15 Hz with
//! the paper's Table 3 would drift by 0.007 °/h; the paper measured 0.5 °/h, and these signs give 0.495
//! (`host-tests/firmware/tests/core_chain/signs.rs` shows both).
//!
//! # Summation by parts
//! Central differences need increments that are still to come. Their products do not: in the sum over n the terms with
//! D_{n+p} D_n are the terms with D_n D_{n−p} of p samples later. So with d_n = D_n − D_{n−1}
//!
//! ```text
//! correction = Σ_n (D_k P_ij − D_j P_ik) − [½ (K_ij − K_ik) ω_j ω_k]      P_ij = −Σ_q B_q d_{j,n−q+1}
//! B_q = Σ_{p≥q} A_p      A_p = a_p (K_ij + K_ik)/T²
//! ```
//!
//! The bracket is taken at the period's end less its start; it is the sum of the products that straddle both. It stays
//! within 1e-8 rad, and drifts only where the case spins in step with its oscillation. All other terms depend on the
//! *sums* K_ij + K_ik alone, and vanishes identically where two axes move in phase: nothing can rectify there.
//!
//! # The mode that K implies
//! K = J/k = 1/Ω₀², so a block of 7e-8 s² rings at 602 Hz, and its tilt is S(iΩ) = 1/(1 − u² + 2iζu), u = Ω/Ω₀, times the
//! static one: 2.8 % more at 100 Hz, 12 % at 200 Hz. Factors carry it: a_p follows Re S, and e_p of
//! D_{n+p} + D_{n−p} − 2 D_n follows Im S, for each pair with its own Ω₀; then A_p = a_ij + a_ik ∓ (e_ij − e_ik), minus in
//! P_ij, plus in P_ik. They are exact at rest and at [`MODE_MATCHED_AT`]; the residual of the drift of a block at 593
//! Hz is below 3e-4 up to 215 Hz, 1e-2 at 300 Hz and 9e-2 at 400 Hz. A filter with the mode's own poles would leave
//! less beyond 300 Hz; it costs 70 instructions more a sample, and rings for 0.1 s after each gap.
//!
//! # Assumptions
//! Products are formed of D, first order in tilts. In coning's and sculling's products the correction is rounded to
//! 2⁻³² rad in fixed point.
//! Pairs that straddle a gap are left out: the correction of the three samples before it and of the gap is incomplete.

use crate::chain::design_parameters::{CENTRAL_COEFFICIENTS, CENTRAL_PAIRS, MODE_MATCHED_AT};
use crate::chain::numbers::NumberSystem;
use crate::chain::numbers::exact::ExactLever;
use crate::chain::parameters::{FlexureResponse, Parameters};
use crate::chain::stages::turning::words;
use crate::chain::triad::Triad;

/// Differences that the sums remember.
const PAST: usize = CENTRAL_PAIRS - 1;

/// Factors of the latest differences.
type Factors<N> = [<N as NumberSystem>::LagFactor; CENTRAL_PAIRS];

/// Configuration.
#[derive(Debug, Clone, Copy)]
pub struct Flexure<N: NumberSystem> {
    /// −B of P_ij, P_ik of gyros x, y, z.
    factors: [[Factors<N>; 2]; 3],
    scale: N::LagScale,
    /// −½ (K_ij − K_ik)/T² of gyros x, y, z.
    ends: [ExactLever; 3],
    has_ends: bool,
    /// True if the factors of P_ij and P_ik differ: only where two modes of a gyro do. Else one set serves, which saves
    /// a sample nine loads.
    differ: bool,
}

/// Sums over the period, and the latest differences of increments.
#[derive(Debug, Clone, Copy, Default)]
pub struct FlexureState<N: NumberSystem> {
    /// D_k − D_{k−1}, and the one before.
    differences: [[N::Increment; 3]; PAST],
    sum: [N::Rectified; 3],
    /// The bracket at the last period's end \[fine units\].
    end: [i64; 3],
    begun: bool,
    /// True if the latest increment is that of the last period.
    current: bool,
}

/// Factors a of D_{n+p} − D_{n−p} and e of D_{n+p} + D_{n−p} − 2 D_n that form S(iΩ) K α over one sample \[1\].
#[derive(Debug, Clone, Copy, Default)]
struct Response {
    odd: [f64; CENTRAL_PAIRS],
    even: [f64; CENTRAL_PAIRS],
}

impl Response {
    /// Of a flexure K/T² = `flexure`.
    fn of(flexure: f64, response: FlexureResponse) -> Self {
        match response {
            // Only a positive K is a spring's: others are estimation noise about zero.
            FlexureResponse::Mode { damping } if flexure > 0.0 => Self::of_mode(flexure, damping),
            _ => Self {
                odd: CENTRAL_COEFFICIENTS.map(|a| a * flexure),
                even: [0.0; CENTRAL_PAIRS],
            },
        }
    }

    /// With the response of the mode at Ω₀ = 1/√K. 2 Σ a_p sin px over sin x and 2 Σ e_p (cos px − 1) over cos x − 1 are
    /// polynomials of second order in cos x: those through the wanted values at rest and at two frequencies.
    fn of_mode(flexure: f64, damping: f64) -> Self {
        let turn = 1.0 / libm::sqrt(flexure);
        let [x2, x3] = MODE_MATCHED_AT
            .map(|(of_mode, cycles)| (of_mode * turn).min(cycles * core::f64::consts::TAU));
        let wanted = |x: f64, c: f64| {
            let u = x / turn;
            let (direct, across) = (1.0 - u * u, 2.0 * damping * u);
            let square = direct * direct + across * across;
            // x/sinc²(x/2) over sin x and over 1 − cos x, both halved.
            let product = 0.25 * x * x * x / (1.0 - c);
            let sine = libm::sqrt(1.0 - c * c);
            [
                product / sine * direct / square,
                -product / (1.0 - c) * across / square,
            ]
        };
        let (c2, c3) = (libm::cos(x2), libm::cos(x3));
        let at_rest = [0.5, -2.0 * damping / turn];
        let (second, third) = (wanted(x2, c2), wanted(x3, c3));
        // Newton's divided differences, as coefficients of powers of cos x.
        let polynomial = |at: usize| {
            let one = (second[at] - at_rest[at]) / (c2 - 1.0);
            let two = ((third[at] - second[at]) / (c3 - c2) - one) / (c3 - 1.0);
            [at_rest[at] - one + two * c2, one - two * (1.0 + c2), two]
        };
        let scaled = |factors: [f64; CENTRAL_PAIRS]| factors.map(|factor| factor * flexure);
        let [m0, m1, m2] = polynomial(0);
        let a3 = m2 / 4.0;
        let odd = [m0 + a3, m1 / 2.0, a3];
        let [m0, m1, m2] = polynomial(1);
        let (e3, e2) = (m2 / 4.0, (m1 - m2) / 2.0);
        let even = [m0 - 2.0 * e2 - e3, e2, e3];
        Self {
            odd: scaled(odd),
            even: scaled(even),
        }
    }
}

/// D_k P_ij − D_j P_ik of gyro i, from the latest differences and the increments.
#[inline(always)]
fn rectify<N: NumberSystem>(
    i: usize,
    [of_j, of_k]: [&Factors<N>; 2],
    [now, one, two]: &[[N::Increment; 3]; CENTRAL_PAIRS],
    d: &[N::LagIncrement; 3],
) -> N::Rectified {
    let (j, k) = ((i + 1) % 3, (i + 2) % 3);
    let p_j = N::lagged(of_j, [now[j], one[j], two[j]]);
    let p_k = N::lagged(of_k, [now[k], one[k], two[k]]);
    N::rectify((p_j, d[k]), (p_k, d[j]))
}

impl<N: NumberSystem> Flexure<N> {
    pub(crate) fn new(parameters: &Parameters) -> Self {
        let rate = parameters.sample_rate_hz;
        let unit = parameters.increment_unit_rad();
        let k = &parameters.flexure_s2;
        // K_ij, K_ik with i, j, k in cyclic order.
        let pairs = [[k.xy, k.xz], [k.yz, k.yx], [k.zx, k.zy]];
        let mut of_differences = [[[0.0; CENTRAL_PAIRS]; 2]; 3];
        for (factors, pair) in of_differences.iter_mut().zip(pairs) {
            let [ij, ik] = pair.map(|k| Response::of(k * rate * rate, parameters.flexure_response));
            for (sign, factors) in [-1.0, 1.0].into_iter().zip(factors) {
                let mut sum = 0.0;
                for p in (0..CENTRAL_PAIRS).rev() {
                    let even = ij.even[p] - ik.even[p];
                    sum += ij.odd[p] + ik.odd[p] + sign * even;
                    // Products of two increments count in increment units.
                    factors[p] = -sum * unit;
                }
            }
        }
        let (factors, scale) = N::lag_factors(&of_differences);
        let half = pairs.map(|[ij, ik]| -0.5 * (ij - ik) * rate * rate);
        Self {
            factors,
            scale,
            ends: half.map(ExactLever::of_factor),
            has_ends: half != [0.0; 3],
            differ: of_differences.iter().any(|[of_j, of_k]| of_j != of_k),
        }
    }

    /// Starts from this increment, at the stream's start or after lost samples.
    #[cold]
    #[inline(never)]
    pub fn start(&self, state: &mut FlexureState<N>, increment: Triad<N::Increment>, unit: u32) {
        state.differences = Default::default();
        state.current = true;
        if !state.begun {
            state.begun = true;
            state.end = self.bracket(state, increment, unit);
        }
    }

    /// Adds one sample's increments, of which the last sample's were `previous`.
    ///
    /// # Returns
    /// The increments with their correction, for use in products.
    #[expect(
        clippy::needless_range_loop,
        reason = "iterators keep in memory what registers hold: 20 instructions a sample"
    )]
    #[inline(always)]
    pub fn process(
        &self,
        state: &mut FlexureState<N>,
        previous: Triad<N::Increment>,
        increment: Triad<N::Increment>,
    ) -> Triad<N::Increment> {
        let now = [
            N::difference(increment.x, previous.x),
            N::difference(increment.y, previous.y),
            N::difference(increment.z, previous.z),
        ];
        let [one, two] = state.differences;
        let d = [
            N::lag_increment(increment.x),
            N::lag_increment(increment.y),
            N::lag_increment(increment.z),
        ];
        let past = [now, one, two];
        let mut bent = increment.to_array();
        if N::LOADS_FACTORS {
            let mut rectified = [N::Rectified::default(); 3];
            for i in 0..3 {
                let [of_both, _] = &self.factors[i];
                rectified[i] = rectify::<N>(i, [of_both, of_both], &past, &d);
            }
            if self.differ {
                core::hint::cold_path();
                for i in 0..3 {
                    rectified[i] = rectify::<N>(i, self.factors[i].each_ref(), &past, &d);
                }
            }
            for i in 0..3 {
                state.sum[i] = N::add_rectified(state.sum[i], rectified[i]);
                bent[i] = N::bend(bent[i], rectified[i], self.scale);
            }
        } else {
            for i in 0..3 {
                let rectified = rectify::<N>(i, self.factors[i].each_ref(), &past, &d);
                state.sum[i] = N::add_rectified(state.sum[i], rectified);
                bent[i] = N::bend(bent[i], rectified, self.scale);
            }
        }
        state.differences = [now, one];
        Triad::from_array(bent)
    }

    /// Gives the period's correction \[fine units\] and starts the next period's sum; `latest` is the latest increment.
    ///
    /// # Inputs
    /// `known`: the increments are the case's own, free of dither.
    ///
    /// # Returns
    /// The correction, and whether it was held at its limit.
    #[inline(always)]
    pub fn finish(
        &self,
        state: &mut FlexureState<N>,
        latest: Triad<N::Increment>,
        unit_log2: u32,
        known: bool,
    ) -> ([i64; 3], bool) {
        let mut held = false;
        let mut correction = [0; 3];
        for (correction, sum) in correction.iter_mut().zip(&mut state.sum) {
            let mut sum = core::mem::take(sum);
            if N::rectified_beyond(sum, self.scale) {
                core::hint::cold_path();
                held = true;
                sum = N::rectified_held(sum, self.scale);
            }
            *correction = N::rectified(sum, self.scale);
        }
        if !known {
            core::hint::cold_path();
            return ([0; 3], false);
        }
        if unit_log2 != 0 {
            core::hint::cold_path();
            correction = correction.map(|fine| fine << unit_log2);
        }
        if self.has_ends && state.current {
            let end = self.bracket(state, latest, unit_log2);
            for axis in 0..3 {
                let gained = end[axis].wrapping_sub(state.end[axis]);
                correction[axis] = correction[axis].wrapping_add(gained);
            }
            state.end = end;
        }
        (correction, held)
    }

    /// −½ (K_ij − K_ik) ω_j ω_k at the latest sample's end \[fine units\], ω T = D + ½ d.
    #[inline(never)]
    fn bracket(
        &self,
        state: &FlexureState<N>,
        latest: Triad<N::Increment>,
        unit_log2: u32,
    ) -> [i64; 3] {
        let (latest, d) = (latest.to_array(), state.differences[0]);
        let mut rate = [0; 3];
        for axis in 0..3 {
            rate[axis] = N::ahead(latest[axis], d[axis]) << unit_log2;
        }
        let rate = words(rate);
        let mut bracket = [0; 3];
        for i in 0..3 {
            let product = i64::from(rate[(i + 1) % 3]) * i64::from(rate[(i + 2) % 3]);
            bracket[i] = self.ends[i].times(product);
        }
        bracket
    }
}

impl<N: NumberSystem> FlexureState<N> {
    /// The latest difference D_{k−1} − D_{k−2}.
    #[inline(always)]
    pub(crate) fn difference(&self) -> &[N::Increment; 3] {
        &self.differences[0]
    }
}

/// Records lost samples: the latest increments no longer give the present rate.
pub fn discontinue<N: NumberSystem>(state: &mut FlexureState<N>) {
    state.current = false;
}
