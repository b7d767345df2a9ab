//! Corrects flexures not proportional to the present acceleration: cubic in it, and resonant.
//!
//! It takes the case's increments D, body frame, forms α̂ T² of three samples before ([`mod@acceleration`]), and sums
//! that sample's corrections for the tilts \[increment units\], for the output period's angles about the sensing axes:
//!
//! ```text
//! cubic      δ = −Q (α̂³ − 3σ² α̂)        resonant   δ″ + 2ζΩ₀ δ′ + Ω₀² δ = −Ω₀² K α
//! ```
//!
//! σ² is the variance of α̂ by the pulses' quantisation, e of ±½ pulse at every sample's end: ⟨α̂³ ω⟩ has 3σ² ⟨α ω⟩ more
//! than ⟨α³ ω⟩, as much as 1 % of it at 300 rad/s² with 0.4″.
//!
//! A mode of a frequency of its own, which may lie in the band of the motion, is a section of second order on −K α̂,
//! one for each pair. Its poles are the mode's own. Its zeros are such that section and acceleration together rectify
//! as S(iΩ) α × ω does, S the mode's response, exactly at rest and at `MATCHED_AT_RAD` per sample (64 Hz at 4 kHz), in
//! phase and in quadrature. The residual of a mode of 160 Hz is below 0.1 % up to 120 Hz and 1 % at 390 Hz. The mode
//! that a static K implies is in the chain itself ([`flexure`](crate::chain::stages::flexure)).
//!
//! Each tilt is held within ±[`FLEXURE_TERM_LIMIT_RAD`], and α̂ for its cube within 1950 rad/s² at 4 kHz. While increments
//! contain dither (a failed pickoff) both are off, as the linear flexure is.

use core::f64::consts::TAU;

use crate::chain::design_parameters::{
    ACCELERATION_LIMIT_RAD, CENTRAL_COEFFICIENTS, FLEXURE_TERM_LIMIT_RAD, INCREMENT_LIMIT_RAD,
    MODE_CYCLES_RANGE, MODE_DAMPING_RANGE, SCALED_FLEXURE_LIMIT,
};
use crate::chain::faults::Status;
use crate::chain::numbers::{CUBE_REACH, NumberSystem};
use crate::chain::parameters::{ParameterError, Parameters};
use crate::chain::stages::compensation;
use crate::chain::terms::acceleration::{self, Acceleration, AccelerationState, Centred};
use crate::chain::terms::records::{largest, scale};
use crate::chain::terms::{PeriodSums, Term, TermKind, TermKinds, add_tilted};
use crate::chain::triad::{CrossAxis, Triad};

/// Six factors by pair, with the sign with which a tilt −K α enters Eq. (7).
fn signed([xy, xz, yx, yz, zx, zy]: [f64; 6], factor: f64) -> [f64; 6] {
    let mut signed = [-xy, xz, yx, -yz, -zx, zy];
    scale(&mut signed, factor);
    signed
}

/// Axis whose acceleration bends each of the six pairs.
const AXIS_OF_PAIR: [usize; 6] = [1, 2, 0, 2, 0, 1];

/// Largest addition of two held tilts to an increment \[increment units\].
const LARGEST_ADDITION: f64 = 2.0 * FLEXURE_TERM_LIMIT_RAD * INCREMENT_LIMIT_RAD;

/// Angle per sample at which a section is matched \[rad\].
const MATCHED_AT_RAD: f64 = 0.1;

/// Fastest poles of a section \[cycles per sample\]: a mode beyond has these, lest its two poles meet at half the
/// sample rate. Its response below 0.1 cycles is matched by the zeros.
const FASTEST_POLES_CYCLES: f64 = 0.3;

/// Largest tilt in a section \[rad\]: half of its fixed-point format.
const LARGEST_IN_SECTION_RAD: f64 = 1.0 / 16.0;

/// The sample in the middle of the last ones, and the tilts' correction of the period's angles.
#[derive(Debug, Clone, Copy, Default)]
pub struct Bending<N: NumberSystem> {
    acceleration: AccelerationState<N>,
    tilted: [N::Tilted; 3],
    /// True if increments contain dither.
    unknown: bool,
}

impl<N: NumberSystem> Bending<N> {
    /// Takes one sample's increments; gives those of three samples before and their acceleration, unless increments contain
    /// dither.
    #[inline(always)]
    fn follow(
        &mut self,
        estimate: &Acceleration<N>,
        increments: Triad<N::Increment>,
    ) -> Option<Centred<N>> {
        let centred = estimate.process(&mut self.acceleration, increments);
        (!self.unknown).then_some(centred)
    }

    /// Sums tilts, held within ±limit, times the increments of their sample.
    #[inline(always)]
    fn add(&mut self, tilts: [N::Tilt; 6], limit: N::Tilt, increments: Triad<N::Increment>) {
        let tilts = CrossAxis::from_array(tilts).map(|tilt| N::hold_tilt(tilt, limit));
        let tilted = compensation::tilted::<N>(&tilts, increments).to_array();
        for (sum, tilted) in self.tilted.iter_mut().zip(tilted) {
            *sum = N::add_tilted(*sum, tilted);
        }
    }
}

/// The cubic flexure.
#[derive(Debug, Clone, Copy)]
pub struct CubicFlexure<N: NumberSystem> {
    acceleration: Acceleration<N>,
    cubic: [N::Flexure; 6],
    /// 3σ² in units of the largest acceleration's square, by axis.
    less: [N::FilterCoefficient; 3],
    limit: N::Tilt,
    acts: bool,
}

/// Variance of α̂ T² by quantisation of one pulse \[pulse²\].
fn variance_per_pulse() -> f64 {
    let [a1, a2, a3] = CENTRAL_COEFFICIENTS;
    // Factors of D_{k+3} … D_{k−3}; of the angles at samples' ends, their differences.
    let of_increments = [a3, a2, a1, 0.0, -a1, -a2, -a3, 0.0];
    let mut before = 0.0;
    let mut sum = 0.0;
    for factor in of_increments {
        sum += (factor - before) * (factor - before);
        before = factor;
    }
    sum / 12.0
}

impl<N: NumberSystem> Term<N> for CubicFlexure<N> {
    type State = Bending<N>;
    const KINDS: TermKinds = TermKinds::of(&[TermKind::AxisFlexureCubic]);

    fn new(parameters: &Parameters) -> Result<Self, ParameterError> {
        let rate = parameters.sample_rate_hz;
        let per_unit = rate * rate * parameters.increment_unit_rad();
        let q = parameters.terms.values::<6>(TermKind::AxisFlexureCubic);
        // Of a cube in units of the largest that is formed.
        let cubic = signed(q, per_unit * per_unit * per_unit * CUBE_REACH * CUBE_REACH);
        let per_pulse = variance_per_pulse();
        let per_reach = 1.0 / (CUBE_REACH * parameters.increment_unit_rad());
        let less = parameters.pulse_weight_rad.map(|pulse| {
            let of_reach = pulse * per_reach;
            3.0 * per_pulse * of_reach * of_reach
        });
        let acts = q != [0.0; 6];
        // Pulse noise beyond the cubed range leaves nothing to correct. Written so that NaN fails.
        let fits = largest(&cubic) < SCALED_FLEXURE_LIMIT && (!acts || largest(&less) <= 1.0);
        if !fits {
            return Err(ParameterError::Term(TermKind::AxisFlexureCubic));
        }
        Ok(Self {
            acceleration: Acceleration::new(),
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
    fn case(&self, state: &mut Bending<N>, increments: Triad<N::Increment>) -> Status {
        let Some(centred) = state.follow(&self.acceleration, increments) else {
            return Status::default();
        };
        let acceleration = centred.acceleration.to_array();
        let mut cubes = [N::Acceleration::default(); 3];
        for axis in 0..3 {
            cubes[axis] = N::cubed(acceleration[axis], self.less[axis]);
        }
        let mut more = [N::Tilt::default(); 6];
        for (at, axis) in AXIS_OF_PAIR.into_iter().enumerate() {
            more[at] = N::tilt(self.cubic[at], cubes[axis]);
        }
        state.add(more, self.limit, centred.increment);
        centred.status
    }

    #[inline(always)]
    fn angles(&self, state: &mut Bending<N>, sums: &PeriodSums, angles: [i64; 3]) -> [i64; 3] {
        add_tilted::<N>(&mut state.tilted, sums.unit_log2, angles)
    }

    fn discontinue(&self, state: &mut Bending<N>) {
        acceleration::forget(&mut state.acceleration);
    }

    fn degrade(&self, state: &mut Bending<N>, rates_known: bool) {
        state.unknown = !rates_known;
    }
}

/// A resonant flexure.
#[derive(Debug, Clone, Copy)]
pub struct ResonantFlexure<N: NumberSystem> {
    acceleration: Acceleration<N>,
    flexure: [N::Flexure; 6],
    section: [N::FilterCoefficient; 5],
    limit: N::Tilt,
    acts: bool,
}

impl<N: NumberSystem> ResonantFlexure<N> {
    /// The tilt of one pair \[rad\], and its section's next state.
    #[inline(always)]
    fn ring<const PAIR: usize>(
        &self,
        state: &mut ResonantFlexureState<N>,
        acceleration: &[N::Acceleration; 3],
    ) -> N::Tilt {
        let now = N::tilt(self.flexure[PAIR], acceleration[AXIS_OF_PAIR[PAIR]]);
        let [one, two] = state.inputs[PAIR];
        let [last, before] = state.outputs[PAIR];
        let bent = N::section(&self.section, [now, one, two], [last, before]);
        state.inputs[PAIR] = [now, one];
        state.outputs[PAIR] = [bent, last];
        bent
    }
}

/// The last two inputs and outputs of each pair's section \[rad\].
#[derive(Debug, Clone, Copy, Default)]
pub struct ResonantFlexureState<N: NumberSystem> {
    inputs: [[N::Tilt; 2]; 6],
    outputs: [[N::Tilt; 2]; 6],
    bending: Bending<N>,
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
fn section(turn: f64, damping: f64) -> ([f64; 5], f64) {
    let poles = turn.min(TAU * FASTEST_POLES_CYCLES);
    let radius = libm::exp(-damping * poles);
    let angle = poles * libm::sqrt(1.0 - damping * damping);
    let (a1, a2) = (-2.0 * radius * libm::cos(angle), radius * radius);
    let x = MATCHED_AT_RAD;
    let back = |p: f64| (libm::cos(p * x), -libm::sin(p * x));
    // α̂ over the acceleration that a product with D needs, both in quadrature.
    let mut estimated = 0.0;
    for (p, a) in CENTRAL_COEFFICIENTS.into_iter().enumerate() {
        estimated += 2.0 * a * libm::sin((p + 1) as f64 * x);
    }
    let wanted = x * x * x / (2.0 * (1.0 - libm::cos(x))) / estimated;
    let response = over(
        (turn * turn, 0.0),
        (turn * turn - x * x, 2.0 * damping * turn * x),
    );
    let (one, two) = (back(1.0), back(2.0));
    let denominator = (1.0 + a1 * one.0 + a2 * two.0, a1 * one.1 + a2 * two.1);
    let (re, im) = times(times(response, (wanted, 0.0)), denominator);
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
                acceleration: Acceleration::new(),
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
        if !within(cycles, MODE_CYCLES_RANGE) {
            return Err(ParameterError::ModeFrequency);
        }
        if !within(damping, MODE_DAMPING_RANGE) {
            return Err(ParameterError::ModeDamping);
        }
        let (section, norm) = section(TAU * cycles, damping);
        let reach = ACCELERATION_LIMIT_RAD * norm.max(1.0);
        let most = largest(&k);
        let fits = most < SCALED_FLEXURE_LIMIT && most * reach <= LARGEST_IN_SECTION_RAD;
        if !(fits && largest(&section) < 2.0) {
            return error;
        }
        Ok(Self {
            acceleration: Acceleration::new(),
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
    fn case(&self, state: &mut ResonantFlexureState<N>, increments: Triad<N::Increment>) -> Status {
        let Some(centred) = state.bending.follow(&self.acceleration, increments) else {
            return Status::default();
        };
        let acceleration = centred.acceleration.to_array();
        // Six calls and no loop: no bound on its passes has to be shown.
        let more = [
            self.ring::<0>(state, &acceleration),
            self.ring::<1>(state, &acceleration),
            self.ring::<2>(state, &acceleration),
            self.ring::<3>(state, &acceleration),
            self.ring::<4>(state, &acceleration),
            self.ring::<5>(state, &acceleration),
        ];
        (state.bending).add(more, self.limit, centred.increment);
        centred.status
    }

    #[inline(always)]
    fn angles(
        &self,
        state: &mut ResonantFlexureState<N>,
        sums: &PeriodSums,
        angles: [i64; 3],
    ) -> [i64; 3] {
        add_tilted::<N>(&mut state.bending.tilted, sums.unit_log2, angles)
    }

    /// The suspension is taken to be at rest afterwards: it decays within Q/πf₀.
    fn discontinue(&self, state: &mut ResonantFlexureState<N>) {
        state.inputs = Default::default();
        state.outputs = Default::default();
        acceleration::forget(&mut state.bending.acceleration);
    }

    fn degrade(&self, state: &mut ResonantFlexureState<N>, rates_known: bool) {
        if state.bending.unknown && rates_known {
            Term::<N>::discontinue(self, state);
        }
        state.bending.unknown = !rates_known;
    }
}
