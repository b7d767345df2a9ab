//! Corrects flexures that are not in proportion to the acceleration of the moment: in its cube, and resonant.
//!
//! It takes the angular acceleration α̂ T² \[increment units per sample²\], body frame, and adds to the small angles of
//! Eq. (7) \[rad\], with the signs of [`installation`](crate::chain::stages::installation):
//!
//! ```text
//! cubic      δ = −Q (α̂³ − 3σ² α̂)        resonant   δ″ + 2ζΩ₀ δ′ + Ω₀² δ = −Ω₀² K α
//! ```
//!
//! σ² is the variance of α̂ by the pulses' quantisation, e of ±½ pulse at every sample's end: ⟨α̂³ ω⟩ has 3σ² ⟨α ω⟩ more
//! than ⟨α³ ω⟩, as much as 5 % of it at 300 rad/s² with 0.4″.
//!
//! A suspension's mode is a section of second order on −K α̂, one for each pair. Its poles are the mode's own. Its zeros
//! are such that section and acceleration filter together rectify as S(iΩ) α × ω does, S the mode's response, exactly at
//! rest and at `MATCHED_AT_RAD` per sample (64 Hz at 4 kHz), in phase and in quadrature: the filter alone errs in the
//! quadrature, which a mode turns into phase. What is left is below 0.05 % up to 120 Hz and 1 % at 390 Hz, for modes of up
//! to 0.3 cycles a sample.
//!
//! Each tilt is held within ±[`FLEXURE_TERM_LIMIT_RAD`], and α̂ for its cube within 1950 rad/s² at 4 kHz. While increments
//! contain dither (a failed pickoff) both are off, as the linear flexure is.

use core::f64::consts::TAU;

use crate::chain::design_parameters::{
    ACCELERATION_LIMIT_RAD, ACCELERATION_TERMS, FLEXURE_TERM_LIMIT_RAD, INCREMENT_LIMIT_RAD,
    MODE_CYCLES_RANGE, MODE_DAMPING_RANGE, SCALED_FLEXURE_LIMIT,
};
use crate::chain::numbers::{CUBE_REACH, NumberSystem};
use crate::chain::parameters::{ParameterError, Parameters};
use crate::chain::terms::records::{largest, scale};
use crate::chain::terms::{Term, TermKind, TermKinds};
use crate::chain::triad::{CrossAxis, Triad};

/// Six factors by pair, with the sign with which a tilt −K α enters Eq. (7).
fn signed([xy, xz, yx, yz, zx, zy]: [f64; 6], factor: f64) -> [f64; 6] {
    let mut signed = [-xy, xz, yx, -yz, -zx, zy];
    scale(&mut signed, factor);
    signed
}

/// Axis whose acceleration bends each of the six pairs.
const AXIS_OF_PAIR: [usize; 6] = [1, 2, 0, 2, 0, 1];

/// What two held tilts add to an increment at most \[increment units\].
const LARGEST_ADDITION: f64 = 2.0 * FLEXURE_TERM_LIMIT_RAD * INCREMENT_LIMIT_RAD;

/// Angle per sample at which a section is matched \[rad\].
const MATCHED_AT_RAD: f64 = 0.1;

/// Largest tilt in a section \[rad\]: half of its fixed-point format.
const LARGEST_IN_SECTION_RAD: f64 = 1.0 / 16.0;

/// Adds held tilts to the others.
#[inline(always)]
fn add<N: NumberSystem>(
    tilts: CrossAxis<N::Tilt>,
    more: [N::Tilt; 6],
    limit: N::Tilt,
) -> CrossAxis<N::Tilt> {
    let mut sum = tilts.to_array();
    for (sum, more) in sum.iter_mut().zip(more) {
        *sum = N::add_tilt(*sum, N::hold_tilt(more, limit));
    }
    CrossAxis::from_array(sum)
}

/// The cubic flexure.
#[derive(Debug, Clone, Copy)]
pub struct CubicFlexure<N: NumberSystem> {
    cubic: [N::Flexure; 6],
    /// 3σ² in units of the largest acceleration's square, by axis.
    less: [N::FilterCoefficient; 3],
    limit: N::Tilt,
    acts: bool,
}

/// Whether increments contain dither.
#[derive(Debug, Clone, Copy, Default)]
pub struct CubicFlexureState {
    unknown: bool,
}

/// Variance of α̂ T² by quantisation of one pulse \[pulse²\].
fn variance_per_pulse(parameters: &Parameters) -> f64 {
    let [c1, c2, c3, c4] = parameters.acceleration_coefficients();
    // Factors of D_k …, and of the angles at samples' ends.
    let of_increments = [c1 + c2 + c3 + c4, -c1, -c2, -c3, -c4, 0.0];
    let mut before = 0.0;
    let mut sum = 0.0;
    for factor in of_increments {
        sum += (factor - before) * (factor - before);
        before = factor;
    }
    sum / 12.0
}

impl<N: NumberSystem> Term<N> for CubicFlexure<N> {
    type State = CubicFlexureState;
    const KINDS: TermKinds = TermKinds::of(&[TermKind::AxisFlexureCubic]);

    fn new(parameters: &Parameters) -> Result<Self, ParameterError> {
        let rate = parameters.sample_rate_hz;
        let per_unit = rate * rate * parameters.increment_unit_rad();
        let q = parameters.terms.values::<6>(TermKind::AxisFlexureCubic);
        // Of a cube in units of the largest that is formed.
        let cubic = signed(q, per_unit * per_unit * per_unit * CUBE_REACH * CUBE_REACH);
        let per_pulse = variance_per_pulse(parameters);
        let per_reach = 1.0 / (CUBE_REACH * parameters.increment_unit_rad());
        let less = parameters.pulse_weight_rad.map(|pulse| {
            let of_reach = pulse * per_reach;
            3.0 * per_pulse * of_reach * of_reach
        });
        let acts = q != [0.0; 6];
        // Pulses so coarse that their noise is beyond what is cubed leave nothing to correct. Written so that NaN fails.
        let fits = largest(&cubic) < SCALED_FLEXURE_LIMIT && (!acts || largest(&less) <= 1.0);
        if !fits {
            return Err(ParameterError::Term(TermKind::AxisFlexureCubic));
        }
        Ok(Self {
            cubic: cubic.map(N::flexure),
            less: less.map(|less| N::filter_coefficient(if acts { less } else { 0.0 })),
            limit: N::tilt_limit(FLEXURE_TERM_LIMIT_RAD),
            acts,
        })
    }

    fn largest_addition(&self) -> f64 {
        if self.acts { LARGEST_ADDITION } else { 0.0 }
    }

    #[inline(always)]
    fn tilts(
        &self,
        state: &mut CubicFlexureState,
        acceleration: Triad<N::Acceleration>,
        tilts: CrossAxis<N::Tilt>,
    ) -> CrossAxis<N::Tilt> {
        if state.unknown {
            return tilts;
        }
        let acceleration = acceleration.to_array();
        let mut cubes = [N::Acceleration::default(); 3];
        for axis in 0..3 {
            cubes[axis] = N::cubed(acceleration[axis], self.less[axis]);
        }
        let mut more = [N::Tilt::default(); 6];
        for (at, axis) in AXIS_OF_PAIR.into_iter().enumerate() {
            more[at] = N::tilt(self.cubic[at], cubes[axis]);
        }
        add::<N>(tilts, more, self.limit)
    }

    fn degrade(&self, state: &mut CubicFlexureState, rates_known: bool) {
        state.unknown = !rates_known;
    }
}

/// A resonant flexure.
#[derive(Debug, Clone, Copy)]
pub struct ResonantFlexure<N: NumberSystem> {
    flexure: [N::Flexure; 6],
    section: [N::FilterCoefficient; 5],
    limit: N::Tilt,
    acts: bool,
}

/// The last two inputs and outputs of each pair's section \[rad\].
#[derive(Debug, Clone, Copy, Default)]
pub struct ResonantFlexureState<N: NumberSystem> {
    inputs: [[N::Tilt; 2]; 6],
    outputs: [[N::Tilt; 2]; 6],
    unknown: bool,
}

/// Real and imaginary part.
type Complex = (f64, f64);

fn times((a, b): Complex, (c, d): Complex) -> Complex {
    (a * c - b * d, a * d + b * c)
}

fn over(numerator: Complex, (c, d): Complex) -> Complex {
    let square = c * c + d * d;
    times(numerator, (c / square, -d / square))
}

/// The section of a mode of `turn` rad a sample, and a bound of its impulse response's ℓ¹ norm \[1\].
///
/// # Returns
/// Factors of the input, its last two values, and the last two outputs.
fn section(turn: f64, damping: f64, filter: [f64; ACCELERATION_TERMS]) -> ([f64; 5], f64) {
    let radius = libm::exp(-damping * turn);
    let angle = turn * libm::sqrt(1.0 - damping * damping);
    let (a1, a2) = (-2.0 * radius * libm::cos(angle), radius * radius);
    let x = MATCHED_AT_RAD;
    let back = |p: f64| (libm::cos(p * x), -libm::sin(p * x));
    let mut estimated = (0.0, 0.0);
    for (p, c) in filter.into_iter().enumerate() {
        let (re, im) = back((p + 1) as f64);
        estimated = (estimated.0 + c * (1.0 - re), estimated.1 - c * im);
    }
    let wanted = (0.0, x * x * x / (2.0 * (1.0 - libm::cos(x))));
    let response = over(
        (turn * turn, 0.0),
        (turn * turn - x * x, 2.0 * damping * turn * x),
    );
    let (one, two) = (back(1.0), back(2.0));
    let denominator = (1.0 + a1 * one.0 + a2 * two.0, a1 * one.1 + a2 * two.1);
    let (re, im) = times(times(response, over(wanted, estimated)), denominator);
    // b₀ + b₁ + b₂ = s, and b₀ + b₁ e^(−ix) + b₂ e^(−2ix) = re + i im.
    let s = 1.0 + a1 + a2;
    let [(u1, v1), (u2, v2)] = [(one.0 - 1.0, one.1), (two.0 - 1.0, two.1)];
    let determinant = u1 * v2 - u2 * v1;
    let b1 = ((re - s) * v2 - u2 * im) / determinant;
    let b2 = (u1 * im - (re - s) * v1) / determinant;
    let b0 = s - b1 - b2;
    // |h_n| of 1/A is r^n |sin((n+1)θ)/sin θ|, and at most r^n (n+1).
    let left = 1.0 - radius;
    let of_poles = (1.0 / (libm::sin(angle).abs() * left)).min(1.0 / (left * left));
    let norm = (b0.abs() + b1.abs() + b2.abs()) * of_poles;
    ([b0, b1, b2, -a1, -a2], norm)
}

impl<N: NumberSystem> Term<N> for ResonantFlexure<N> {
    type State = ResonantFlexureState<N>;
    const KINDS: TermKinds = TermKinds::of(&[TermKind::AxisFlexureMode]);

    fn new(parameters: &Parameters) -> Result<Self, ParameterError> {
        let values = parameters.terms.values::<8>(TermKind::AxisFlexureMode);
        let limit = N::tilt_limit(FLEXURE_TERM_LIMIT_RAD);
        if values == [0.0; 8] {
            return Ok(Self {
                flexure: [N::Flexure::default(); 6],
                section: [0.0; 5].map(N::filter_coefficient),
                limit,
                acts: false,
            });
        }
        let [xy, xz, yx, yz, zx, zy, frequency_hz, damping] = values;
        let rate = parameters.sample_rate_hz;
        let k = signed(
            [xy, xz, yx, yz, zx, zy],
            rate * rate * parameters.increment_unit_rad(),
        );
        let cycles = frequency_hz / rate;
        let within = |value: f64, (low, high): (f64, f64)| (low..=high).contains(&value);
        let error = Err(ParameterError::Term(TermKind::AxisFlexureMode));
        // Written so that NaN fails.
        if !(within(cycles, MODE_CYCLES_RANGE) && within(damping, MODE_DAMPING_RANGE)) {
            return error;
        }
        let filter = parameters.acceleration_coefficients();
        let (section, norm) = section(TAU * cycles, damping, filter);
        let reach = ACCELERATION_LIMIT_RAD * norm.max(1.0);
        let most = largest(&k);
        let fits = most < SCALED_FLEXURE_LIMIT && most * reach <= LARGEST_IN_SECTION_RAD;
        if !(fits && largest(&section) < 2.0) {
            return error;
        }
        Ok(Self {
            flexure: k.map(N::flexure),
            section: section.map(N::filter_coefficient),
            limit,
            acts: true,
        })
    }

    fn largest_addition(&self) -> f64 {
        if self.acts { LARGEST_ADDITION } else { 0.0 }
    }

    #[inline(always)]
    fn tilts(
        &self,
        state: &mut ResonantFlexureState<N>,
        acceleration: Triad<N::Acceleration>,
        tilts: CrossAxis<N::Tilt>,
    ) -> CrossAxis<N::Tilt> {
        if state.unknown {
            return tilts;
        }
        let acceleration = acceleration.to_array();
        let mut more = [N::Tilt::default(); 6];
        for (at, axis) in AXIS_OF_PAIR.into_iter().enumerate() {
            let now = N::tilt(self.flexure[at], acceleration[axis]);
            let [one, two] = state.inputs[at];
            let bent = N::section(&self.section, [now, one, two], state.outputs[at]);
            state.inputs[at] = [now, one];
            state.outputs[at] = [bent, state.outputs[at][0]];
            more[at] = bent;
        }
        add::<N>(tilts, more, self.limit)
    }

    /// The suspension is taken to be at rest afterwards: it forgets within Q/πf₀.
    fn discontinue(&self, state: &mut ResonantFlexureState<N>) {
        state.inputs = Default::default();
        state.outputs = Default::default();
    }

    fn degrade(&self, state: &mut ResonantFlexureState<N>, rates_known: bool) {
        if state.unknown && rates_known {
            Term::<N>::discontinue(self, state);
        }
        state.unknown = !rates_known;
    }
}
