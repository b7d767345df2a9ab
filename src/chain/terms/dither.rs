//! Corrects errors by dithered blocks that the strip leaves: a cubic block angle, and the neighbours' dither.
//!
//! It takes every sample's pickoff readings \[codes\] and increments about the sensing axes. It gives corrected
//! increments and, once per output period, corrected angles \[fine units\]. With p_i(t) the pickoff's angle, free of
//! its delay, and h_j p_j the angle of block j, gyro i reads c_i p_i³ + Σ_j c_ij h_j p_j too much: an angle, so that an
//! output period's error is the difference of the angle between its end and its start, and nothing drifts. Increments
//! are corrected too, for the strip's adaptation uses them.
//!
//! Angles are words here: p of 2⁻³³ rad, the result of 2⁻³⁷ rad.
//!
//! # Assumptions
//! Codes count from the block's rest. Readings beyond 1/32 rad, or beyond where c p² is 1/64, are held there. Gain and
//! delay are the parameters', not the tracked ones. A source that restarts leaves the angle's step at the restart in.

use crate::chain::design_parameters::{DITHER_ERROR_LIMIT_RAD, PICKOFF_REACH_RAD};
use crate::chain::numbers::NumberSystem;
use crate::chain::parameters::{ParameterError, Parameters};
use crate::chain::terms::{PeriodSums, Term, TermKind, TermKinds};
use crate::chain::triad::Triad;

/// Fractional bits of p, of p², of c, of a relative tap, of a crosstalk, of the result.
const ANGLE: u32 = 33;
const SQUARE: u32 = 40;
const CUBIC: u32 = 8;
const TAP: u32 = 28;
const SHARE: u32 = 31;
const RESULT: u32 = 37;

/// Largest c p², and largest crosstalk \[1\].
const LARGEST_SHARE: f64 = 1.0 / 64.0;

/// Largest |c| \[1/rad²\]: its word's range, with margin.
const LARGEST_CUBIC: f64 = 4e6;

/// Largest h₀ and h₁ over the pickoff's gain \[1\].
const LARGEST_TAP: f64 = 7.0;

/// One pickoff: codes × 2^shift fill their word within the limit, and the upper word with the mantissa is p.
#[derive(Debug, Clone, Copy)]
struct Pickoff {
    limit: i32,
    factor: i32,
    mantissa: i32,
    /// Factors of p_k and p_{k−1} in the angle without delay.
    taps: [i32; 2],
    /// −c (1 − s).
    cubic: i32,
}

/// Configuration.
#[derive(Debug, Clone, Copy)]
pub struct DitherErrors<N: NumberSystem> {
    pickoffs: [Pickoff; 3],
    /// −c_ij h_j, rows by gyro.
    crosstalk: [[i32; 3]; 3],
    weight: N::PulseWeight,
    acts: bool,
}

/// The excess angle, with the opposite sign \[2⁻³⁷ rad\].
#[derive(Debug, Clone, Copy, Default)]
pub struct DitherErrorsState<N: NumberSystem> {
    /// p_{k−1} \[2⁻³³ rad\].
    past: [i32; 3],
    /// At the latest sample's end, and at the output period's start.
    ahead: [i32; 3],
    start: [i32; 3],
    /// Corrections of the latest increments.
    gained: [N::Increment; 3],
    begun: bool,
    current: bool,
    unknown: bool,
}

/// Largest correction of one increment \[2⁻³⁷ rad\].
const LIMIT: i32 = (DITHER_ERROR_LIMIT_RAD * (1u64 << RESULT) as f64) as i32;

/// value × 2^bits, to nearest, held at the word's ends.
fn word(value: f64, bits: u32) -> i32 {
    libm::rint(libm::ldexp(value, bits as i32)) as i32
}

/// a × b without their `down` lowest bits; the result fits a word.
#[inline(always)]
fn product(a: i32, b: i32, down: u32) -> i32 {
    ((i64::from(a) * i64::from(b)) >> down) as i32
}

impl Pickoff {
    fn new(parameters: &Parameters, axis: usize, cubic: f64) -> Option<Self> {
        let reach = PICKOFF_REACH_RAD.min(libm::sqrt(LARGEST_SHARE / cubic.abs().max(1e-9)));
        let taps = parameters.relative_taps(axis);
        // Written so that NaN fails.
        let fits = cubic.abs() <= LARGEST_CUBIC && taps.iter().all(|t| t.abs() <= LARGEST_TAP);
        if !fits {
            return None;
        }
        // A pickoff whose largest tap is 7 has that much less room. A float's conversion holds at the ends.
        let room = reach / (taps[0].abs() + taps[1].abs()).max(1.0);
        let limit = (room / parameters.pickoff_weight_rad) as i32;
        let shift = limit.max(1).leading_zeros().saturating_sub(1).min(30);
        Some(Self {
            limit,
            factor: 1 << shift,
            mantissa: word(parameters.pickoff_weight_rad, ANGLE + 32 - shift),
            taps: taps.map(|tap| word(tap, TAP)),
            cubic: word(-cubic * (1.0 - parameters.scale_error[axis]), CUBIC),
        })
    }

    /// p \[2⁻³³ rad\].
    #[inline(always)]
    fn angle(&self, code: i32) -> i32 {
        let held = code.max(self.limit.wrapping_neg()).min(self.limit);
        product(held.wrapping_mul(self.factor), self.mantissa, 32)
    }

    /// p without its delay \[2⁻³³ rad\].
    #[inline(always)]
    fn prompt(&self, now: i32, past: i32) -> i32 {
        product(self.taps[0], now, TAP).wrapping_add(product(self.taps[1], past, TAP))
    }

    /// −c p³ \[2⁻³⁷ rad\].
    #[inline(always)]
    fn cube(&self, angle: i32) -> i32 {
        let square = product(angle, angle, 2 * ANGLE - SQUARE);
        let share = product(self.cubic, square, CUBIC + SQUARE - RESULT);
        product(share, angle, ANGLE)
    }
}

impl<N: NumberSystem> DitherErrors<N> {
    /// The excess angle, with the opposite sign \[2⁻³⁷ rad\].
    #[inline(always)]
    fn ahead(&self, now: [i32; 3], past: [i32; 3]) -> [i32; 3] {
        let mut angle = [0; 3];
        for axis in 0..3 {
            angle[axis] = self.pickoffs[axis].prompt(now[axis], past[axis]);
        }
        let [x, y, z] = angle;
        let mut ahead = [0; 3];
        for (gyro, ahead) in ahead.iter_mut().enumerate() {
            let [cx, cy, cz] = self.crosstalk[gyro];
            let across = |c: i32, angle: i32| i64::from(c) * i64::from(angle);
            let sum = across(cx, x)
                .wrapping_add(across(cy, y))
                .wrapping_add(across(cz, z));
            let across = (sum >> (SHARE + ANGLE - RESULT)) as i32;
            *ahead = self.pickoffs[gyro].cube(angle[gyro]).wrapping_add(across);
        }
        ahead
    }

    #[cold]
    #[inline(never)]
    fn begin(&self, state: &mut DitherErrorsState<N>, previous: &[i32; 3]) {
        for (axis, code) in previous.iter().enumerate() {
            state.past[axis] = self.pickoffs[axis].angle(*code);
        }
        state.ahead = self.ahead(state.past, state.past);
        state.current = true;
        if !state.begun {
            state.begun = true;
            state.start = state.ahead;
        }
    }
}

impl<N: NumberSystem> Term<N> for DitherErrors<N> {
    type State = DitherErrorsState<N>;
    const KINDS: TermKinds = TermKinds::of(&[TermKind::DitherCubic, TermKind::DitherCrosstalk]);

    fn new(parameters: &Parameters) -> Result<Self, ParameterError> {
        let cubic = parameters.terms.values::<3>(TermKind::DitherCubic);
        let refused = |kind| ParameterError::Term(kind);
        let pickoff = |axis: usize| {
            Pickoff::new(parameters, axis, cubic[axis]).ok_or(refused(TermKind::DitherCubic))
        };
        let six = parameters.terms.values::<6>(TermKind::DitherCrosstalk);
        if !six.iter().all(|c| c.abs() <= LARGEST_SHARE) {
            return Err(refused(TermKind::DitherCrosstalk));
        }
        let [xy, xz, yx, yz, zx, zy] = six;
        let rows = [[0.0, xy, xz], [yx, 0.0, yz], [zx, zy, 0.0]];
        let share = |c: f64, axis: usize| word(-c * parameters.pickoff_gain[axis], SHARE);
        Ok(Self {
            pickoffs: [pickoff(0)?, pickoff(1)?, pickoff(2)?],
            crosstalk: rows.map(|[x, y, z]| [share(x, 0), share(y, 1), share(z, 2)]),
            weight: N::pulse_weight(
                libm::ldexp(1.0 / parameters.increment_unit_rad(), -(RESULT as i32)),
                LIMIT,
            ),
            acts: cubic != [0.0; 3] || six != [0.0; 6],
        })
    }

    fn largest_addition(&self) -> f64 {
        if self.acts {
            DITHER_ERROR_LIMIT_RAD
        } else {
            0.0
        }
    }

    #[inline(always)]
    fn pickoffs(&self, state: &mut DitherErrorsState<N>, previous: &[i32; 3], codes: &[i32; 3]) {
        if !state.current {
            self.begin(state, previous);
        }
        let mut now = [0; 3];
        for axis in 0..3 {
            now[axis] = self.pickoffs[axis].angle(codes[axis]);
        }
        let ahead = self.ahead(now, state.past);
        for (axis, ahead) in ahead.iter().enumerate() {
            let step = ahead.wrapping_sub(state.ahead[axis]);
            let held = step.max(LIMIT.wrapping_neg()).min(LIMIT);
            state.gained[axis] = N::pulses(self.weight, held);
        }
        state.past = now;
        state.ahead = ahead;
    }

    #[inline(always)]
    fn increments(
        &self,
        state: &mut DitherErrorsState<N>,
        increments: Triad<N::Increment>,
    ) -> Triad<N::Increment> {
        let [x, y, z] = state.gained;
        Triad {
            x: N::add(increments.x, x),
            y: N::add(increments.y, y),
            z: N::add(increments.z, z),
        }
    }

    #[inline(always)]
    fn angles(
        &self,
        state: &mut DitherErrorsState<N>,
        _: &PeriodSums,
        mut angles: [i64; 3],
    ) -> [i64; 3] {
        if state.unknown {
            return angles;
        }
        for (axis, angle) in angles.iter_mut().enumerate() {
            let grown = state.ahead[axis].wrapping_sub(state.start[axis]);
            *angle = angle.wrapping_add(i64::from(grown) << (64 - RESULT));
            state.start[axis] = state.ahead[axis];
        }
        angles
    }

    fn discontinue(&self, state: &mut DitherErrorsState<N>) {
        state.current = false;
    }

    fn degrade(&self, state: &mut DitherErrorsState<N>, rates_known: bool) {
        state.unknown = !rates_known;
    }
}
