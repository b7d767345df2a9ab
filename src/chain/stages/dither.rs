//! Strips each block's own motion from the sensed increments, which leaves increments of the case \[rad\].
//!
//! It takes the sensed increments \[rad\] and the block angles relative to the case at the sample's end \[pickoff
//! codes\]. It gives r = D − h₀ (p_k − p_{k−1}) − h₁ (p_{k−1} − p_{k−2}) \[rad\], and once per output period the
//! strip's angle over it \[fine units\].
//!
//! The strip comes before the acceleration: 150″ at 400 Hz is 4600 rad/s² of block motion that the other
//! gyros do not feel, and a matrix that followed it would inject it.
//!
//! A pickoff that shows the block d late shows, at the dither frequency, cos Ωd of the block and its
//! quadrature. With Ω the dither's phase over one sample, q_k = cos Ω dp_k − dp_{k−1} is −sin Ω times that
//! quadrature, exactly, so the block's increment is G (a dp_k + b q_k / sin Ω), a = cos Ωd/T, b = sin Ωd/T, or
//!
//! ```text
//! h₀ = G (a + b cot Ω)        h₁ = −G b / sin Ω        G = gain × code weight × (1 − s)
//! ```
//!
//! Both taps act on differences of codes, so the strip telescopes: over a period it is h₀ and h₁ times the
//! difference of two readings, independent of those between, and adds no drift. `adaptation.rs` moves the taps.
//!
//! It does not filter the pickoff, nor correct its nonlinearity.

use crate::chain::numbers::NumberSystem;
use crate::chain::numbers::exact::{FINE_PER_RAD_LOG2, fine};
use crate::chain::parameters::Parameters;
use crate::chain::stages::limits::Limits;
use crate::chain::triad::Triad;

/// The strip's taps h₀ and h₁ of one gyro \[fine units per code\].
pub type ExactTaps = [i64; 2];

/// Configuration.
#[derive(Debug, Clone, Copy)]
pub struct Dither<N: NumberSystem> {
    scales: [N::StepScale; 3],
    nominal: [ExactTaps; 3],
    /// Exponent of the increment unit.
    unit_log2: u32,
}

/// The last two readings of one pickoff \[codes\]. They stand side by side: one instruction stores both.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Readings {
    /// p_{k−1}.
    pub last: i32,
    /// p_{k−2}.
    pub before: i32,
}

impl Readings {
    /// A pickoff that has not moved.
    fn still(code: i32) -> Self {
        Self {
            last: code,
            before: code,
        }
    }
}

/// Readings of the last samples, and the taps in use.
#[derive(Debug, Clone, Copy, Default)]
pub struct DitherState<N: NumberSystem> {
    readings: [Readings; 3],
    /// p_{k−1} − p_{k−2}.
    step: [N::Step; 3],
    taps: [[N::Tap; 2]; 3],
    exact_taps: [ExactTaps; 3],
    /// The last readings before the output period.
    start: [Readings; 3],
    /// p₀, the first reading of the stream, or of a source that restarted.
    origin: [i32; 3],
}

impl<N: NumberSystem> Dither<N> {
    pub(crate) fn new(parameters: &Parameters, limits: &Limits) -> Self {
        Self {
            unit_log2: parameters.increment_unit_log2(),
            scales: limits.codes().map(N::step_scale),
            nominal: [0, 1, 2].map(|axis| {
                let gain = parameters.strip_rad_per_code(axis);
                parameters
                    .relative_taps(axis)
                    .map(|tap| fine(gain * tap, FINE_PER_RAD_LOG2))
            }),
        }
    }

    /// The taps that follow from the parameters \[fine units per code\], before any adaptation.
    pub(crate) fn nominal(&self) -> &[ExactTaps; 3] {
        &self.nominal
    }

    /// The scale of pickoff steps in the number system, by gyro.
    pub(crate) fn scales(&self) -> &[N::StepScale; 3] {
        &self.scales
    }

    /// Starts the stream at these readings \[codes\]. The readings before them are not known, so the first step is
    /// zero.
    pub fn start(&self, state: &mut DitherState<N>, codes: [i32; 3]) {
        *state = DitherState {
            readings: codes.map(Readings::still),
            start: codes.map(Readings::still),
            origin: codes,
            ..DitherState::default()
        };
        self.set_taps(state, &self.nominal);
    }

    /// Continues from these readings \[codes\] after lost ones: the next sample's step is taken from them alone.
    pub fn resume(&self, state: &mut DitherState<N>, codes: [i32; 3]) {
        state.readings = codes.map(Readings::still);
        state.step = Default::default();
    }

    /// Leaves the steps from the last readings to these \[codes\] out of the output period's angle:
    /// [`exact`](Self::exact) has returned their angle, and the caller accounts for it elsewhere or drops it.
    pub fn leave_out(&self, state: &mut DitherState<N>, codes: [i32; 3]) {
        let pairs = state.start.iter_mut().zip(state.readings);
        for ((start, readings), code) in pairs.zip(codes) {
            start.last = start.last.wrapping_add(code.wrapping_sub(readings.last));
            start.before = start
                .before
                .wrapping_add(code.wrapping_sub(readings.before));
        }
    }

    /// Starts anew at these readings \[codes\] within a stream. The steps to them are not known; taps that adaptation
    /// moves later act only on the motion from here on.
    pub fn restart(&self, state: &mut DitherState<N>, codes: [i32; 3]) {
        self.leave_out(state, codes);
        self.resume(state, codes);
        state.origin = codes;
    }

    /// Uses these taps from the next sample on.
    pub(crate) fn set_taps(&self, state: &mut DitherState<N>, taps: &[ExactTaps; 3]) {
        state.exact_taps = *taps;
        let mut in_units = *taps;
        if self.unit_log2 != 0 {
            core::hint::cold_path();
            in_units = taps.map(|taps| taps.map(|tap| tap >> self.unit_log2));
        }
        let taps = &in_units;
        for (axis, taps) in taps.iter().enumerate() {
            state.taps[axis] = taps.map(|tap| N::tap(tap, self.scales[axis]));
        }
    }

    /// Strips one sample.
    #[inline(always)]
    pub fn process(
        &self,
        state: &mut DitherState<N>,
        sensed: Triad<N::Increment>,
        codes: [i32; 3],
    ) -> Triad<N::Increment> {
        let sensed = sensed.to_array();
        let mut stripped = sensed;
        for axis in 0..3 {
            let previous = state.readings[axis].last;
            let step = N::step(self.scales[axis], codes[axis].wrapping_sub(previous));
            let [now, past] = state.taps[axis];
            stripped[axis] = N::strip(N::strip(sensed[axis], now, step), past, state.step[axis]);
            state.step[axis] = step;
            state.readings[axis] = Readings {
                last: codes[axis],
                before: previous,
            };
        }
        Triad::from_array(stripped)
    }

    /// The strip's angle \[fine units\] from the last reading to these codes, which come after lost ones. Both taps act
    /// on the whole step, in agreement with [`resume`](Self::resume).
    pub fn exact(&self, state: &DitherState<N>, codes: [i32; 3]) -> [i64; 3] {
        let mut angle = [0; 3];
        for axis in 0..3 {
            let [now, past] = state.exact_taps[axis];
            let step = |from: i32| i64::from(codes[axis].wrapping_sub(from));
            angle[axis] = now
                .wrapping_mul(step(state.readings[axis].last))
                .wrapping_add(past.wrapping_mul(step(state.readings[axis].before)));
        }
        angle
    }

    /// One gyro's strip over the output period \[fine units\]; starts the gyro's next one.
    #[inline(always)]
    pub fn finish(&self, state: &mut DitherState<N>, axis: usize) -> i64 {
        let angle = Self::since(state, axis);
        state.start[axis] = state.readings[axis];
        angle
    }

    /// The strip's angle since the output period's start \[fine units\].
    pub fn since_start(&self, state: &DitherState<N>) -> [i64; 3] {
        let mut angle = [0; 3];
        // A loop and not `map`, which is a function of its own and checks the index.
        for (axis, angle) in angle.iter_mut().enumerate() {
            *angle = Self::since(state, axis);
        }
        angle
    }

    #[inline(always)]
    fn since(state: &DitherState<N>, axis: usize) -> i64 {
        let (end, start) = (state.readings[axis], state.start[axis]);
        let [now, past] = state.exact_taps[axis];
        let difference = |end: i32, start: i32| i64::from(end.wrapping_sub(start));
        now.wrapping_mul(difference(end.last, start.last))
            .wrapping_add(past.wrapping_mul(difference(end.before, start.before)))
    }
}

#[cfg(feature = "proof")]
impl Dither<crate::chain::numbers::Interval> {
    /// Uses intervals of taps, from the lowest to the highest of each \[fine units per code\].
    pub(crate) fn widen_taps(
        &self,
        state: &mut DitherState<crate::chain::numbers::Interval>,
        ranges: &[[(i64, i64); 2]; 3],
    ) {
        use crate::chain::numbers::Interval;
        for (axis, [now, past]) in ranges.iter().enumerate() {
            let taps = |(low, high): (i64, i64)| {
                let (low, high) = (low >> self.unit_log2, high >> self.unit_log2);
                Interval::taps_between(low, high, self.scales[axis])
            };
            state.taps[axis] = [taps(*now), taps(*past)];
        }
    }
}

impl<N: NumberSystem> DitherState<N> {
    /// p_{k−1} of all three \[codes\].
    #[inline(always)]
    pub fn previous(&self) -> [i32; 3] {
        let [x, y, z] = &self.readings;
        [x.last, y.last, z.last]
    }

    /// p_{k−1} and p_{k−2}.
    #[inline(always)]
    pub(crate) fn readings(&self) -> &[Readings; 3] {
        &self.readings
    }

    /// p_{k−1} − p_{k−2}.
    #[inline(always)]
    pub(crate) fn step(&self) -> &[N::Step; 3] {
        &self.step
    }

    /// The stream's first reading \[codes\].
    pub(crate) fn origin(&self) -> &[i32; 3] {
        &self.origin
    }

    /// The taps in use, in the number system's words.
    #[cfg(feature = "proof")]
    pub(crate) fn taps(&self) -> &[[N::Tap; 2]; 3] {
        &self.taps
    }

    /// The taps in use \[fine units per code\].
    pub(crate) fn exact_taps(&self) -> &[ExactTaps; 3] {
        &self.exact_taps
    }

    /// Adds `by` \[codes\] to every reading that is remembered: the pickoffs' origin has moved.
    pub fn shift(&mut self, by: [i32; 3]) {
        for (axis, by) in by.into_iter().enumerate() {
            let Readings { last, before } = &mut self.readings[axis];
            let start = &mut self.start[axis];
            let origin = &mut self.origin[axis];
            for code in [last, before, &mut start.last, &mut start.before, origin] {
                *code = code.wrapping_add(by);
            }
        }
    }
}
