//! Tracks the pickoffs' gain and delay by the dither left in the stripped increments, and tests the dithers' health.
//!
//! With every sample it observes *one* gyro, the next gyro with the next sample: at d = r_k − r_{k−1} \[rad\] and at
//! the pickoff step dp \[codes\]. A window of about [`ADAPTATION_WINDOW_S`] closes at an output frame. It then gives
//! new taps for the strip (`dither.rs`), the angle by the change of the taps, and a status for each gyro.
//!
//! # Tracking (block LMS)
//! If the block's increment is G ((a+α) dp + (b+β) q/sin Ω) and the strip subtracts a, b, the residual is
//! Re{G P (α + iβ) e^{iΩk}} for dp = Re{P e^{iΩk}}, and d is that times z = 1 − e^{−iΩ}. With
//! C₀ = Σ d_{k−1} dp_{k−1} and C₁ = Σ d_{k−1} dp_k over ½ n G P²,
//!
//! ```text
//! y = C₀ + i (C₁ − C₀ cos Ω)/sin Ω        α + iβ = y / z
//! ```
//!
//! P is the nominal one, so nothing is divided on the board; a smaller dither is followed more slowly. A share μ of α and
//! β is added, within [`ADAPTATION_STEP_LIMIT`] per window and [`ADAPTATION_RANGE`] in all. It begins at
//! [`FIRST_ADAPTATION_SHARE`] and falls as μ ← μ − ½ μ², which is 2/(n + 4) after n windows, to window / adaptation
//! time: it starts as an average over all windows and goes on as an exponential average with the adaptation time. A finding
//! begins it anew. An adaptation time of 0 freezes the taps at the parameters' own.
//!
//! *Convergence*: as 1/n², whatever the adaptation time: 5 % is 0.1 % after some 2 s. *Misadjustment*:
//! pulses of w rad leave in one window α of w √(6/12) √(2/n) / (G P |z|), 0.2 % for 0.8″, 150″ and n = 40, and
//! √(μ/2) of that in the taps: 0.006 % with 20 s, falling with the root of the time. *Lag*: a pickoff whose gain drifts is
//! followed one adaptation time late.
//!
//! *Motion near the dither's frequency*, e^{iδt} of the dither with 1/δ well below the adaptation time, is taken for
//! tap error. Over windows of W the taps move by μ Σ e^{iδWm} up to the window before the one they act in: −½ μ
//! sinc²(½δW) of the motion in
//! phase and ∓ μ/(δW) across. The part in phase is a scale error of that motion, and changes its rectification with
//! another axis, as flexure and as coning; it comes from taps that are a window old, and is the same for all δ well
//! below 1/W. **20 s is the choice**: 0.08 % (0.8 % with 2 s), and a pickoff that warms up by 5 % in ten minutes is
//! stripped to 0.2 %.
//!
//! *Drift*: none. Moved taps act on the block's angle since the start and not only on later motion: the step of h₀ (p −
//! p₀) + h₁ (p' − p₀) is taken out at once, p₀ the stream's first reading, so that the angle since the start is always
//! that of the present taps from the start. Its error is the taps' error times a pickoff angle: bounded.
//!
//! # Health
//! From the same window, of gyros with a nominal amplitude: X = Σ dp², E = Σ d².
//!
//! | finding | condition | consequence |
//! |---|---|---|
//! | `DITHER_OUT_OF_BAND` | amplitude beyond its limits (0.5 to 1.5 of nominal unless the parameters have others), or frequency beyond 0.8 to 1.2 of nominal | taps rest |
//! | `PICKOFF_FAILED` | amplitude below 0.1, E above ¼ of an unstripped dither's | taps rest, no flexure term |
//! | `DITHER_STOPPED` | amplitude below 0.1, E small | taps rest |
//! | `COUNTER_STUCK` | amplitude above 0.5, counts the same in all of the window | taps rest, no flexure term |
//!
//! A finding stands until a later window has none; then the taps and the flexure term go on. A fault is thus
//! seen one to two windows after it began, and over one to two windows after it ended.
//!
//! Assumes that nothing else moves at the block's own frequency and in its phase: the case's answer to the
//! dither's torque is taken for pickoff gain. It does not track the dither's frequency. Around lost or held
//! samples the taps rest for two windows; the health of the first is judged from the samples that it has. The taps
//! rest too while a pickoff is further than [`PICKOFF_REACH_RAD`] from its first reading, where no block can be.

use crate::chain::design_parameters::{
    ADAPTATION_RANGE, ADAPTATION_STEP_LIMIT, ADAPTATION_WINDOW_S, FIRST_ADAPTATION_SHARE,
    HEALTHY_FREQUENCY, LEAST_WINDOW_SAMPLES, PICKOFF_REACH_RAD, STILL_AMPLITUDE, UNSTRIPPED_ENERGY,
};
use crate::chain::faults::Status;
use crate::chain::numbers::NumberSystem;
use crate::chain::numbers::float::within;
use crate::chain::parameters::Parameters;
use crate::chain::sample::Sample;
use crate::chain::stages::dither::{Dither, DitherState, ExactTaps};
use crate::chain::stages::flexure::FlexureState;

/// Windows in which the taps are not moved after a disturbance, the disturbed one included: a disturbance in a window's
/// last sample also spoils the next window's first increment.
const DISTURBED_WINDOWS: u8 = 2;

/// No gyro's place.
const NONE_WATCHED: u32 = 3;

/// Most codes that [`PICKOFF_REACH_RAD`] may be: even with the finest codes this is three times the largest amplitude,
/// and one step more still fits an `i32`.
const LARGEST_REACH_CODES: u32 = 1 << 30;

/// One gyro's configuration; all zeros without dither.
#[derive(Debug, Clone, Copy, Default)]
struct Axis {
    dithered: bool,
    /// α and β per correlation: rows α, β; columns C₀, C₁.
    estimate: [[f32; 2]; 2],
    /// Σ dp² of the nominal dither over a window.
    step_energy: f32,
    /// Σ d² over a window of the nominal dither if it were not stripped.
    error_energy: f32,
    /// Least and largest healthy amplitude over nominal.
    amplitudes: [f32; 2],
    /// cos Ω at the lower and the upper end of the healthy frequencies.
    cosines: [f32; 2],
    /// Tap change per α and per β \[fine units per code\].
    tap_per_gain: f32,
    taps_per_quadrature: [f32; 2],
    nominal: ExactTaps,
    /// Farthest from the first reading at which the taps follow \[codes\].
    reach: u32,
}

/// Configuration.
#[derive(Debug, Clone, Copy)]
pub struct Adaptation {
    axes: [Axis; 3],
    watches: bool,
    /// The share of a window's estimate that is followed in the end; 0: frozen.
    share: f32,
    frames_per_window: u32,
}

/// One gyro's sums over the window.
#[derive(Debug, Clone, Copy, Default)]
struct Sums<N: NumberSystem> {
    /// Σ d_{k−1} dp_{k−1}, Σ d_{k−1} dp_k.
    correlations: [N::Correlation; 2],
    /// Σ dp_k², Σ dp_k dp_{k−1}.
    steps: [N::Correlation; 2],
    /// Σ d².
    error: N::Correlation,
    /// Bits that changed between successive observed counts of this gyro, and the last observed counts.
    changed: i32,
    counts: i32,
}

impl<N: NumberSystem> Sums<N> {
    /// Begins the next window's sums.
    #[inline(always)]
    fn begin(&mut self) {
        self.correlations = [N::Correlation::default(); 2];
        self.steps = [N::Correlation::default(); 2];
        self.error = N::Correlation::default();
        self.changed = 0;
    }
}

/// One gyro's tracked values.
#[derive(Debug, Clone, Copy)]
struct Tracked {
    gain: f32,
    quadrature: f32,
    /// Share of the next window's estimate that is followed.
    share: f32,
    health: Status,
}

impl Default for Tracked {
    fn default() -> Self {
        Self {
            gain: 0.0,
            quadrature: 0.0,
            share: FIRST_ADAPTATION_SHARE,
            health: Status::default(),
        }
    }
}

/// State kept from sample to sample and from window to window.
#[derive(Debug, Clone, Copy, Default)]
pub struct AdaptationState<N: NumberSystem> {
    sums: [Sums<N>; 3],
    tracked: [Tracked; 3],
    /// The gyro whose products the next sample adds; [`NONE_WATCHED`] if none is watched.
    next_gyro: u32,
    frames: u32,
    /// Windows, this one included, in which the taps rest.
    disturbed: u8,
    /// True once a window has closed without a finding.
    has_closed_clean: bool,
}

/// The result of a closed window.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct WindowResult {
    /// Health bits of all three gyros together.
    pub status: Status,
    /// The angle by which moving the taps changes the strip's sum since the start \[fine units\], to be added to the
    /// sensed angles.
    pub angle: [i64; 3],
}

impl Adaptation {
    pub(crate) fn new<N: NumberSystem>(parameters: &Parameters, dither: &Dither<N>) -> Self {
        let frames = (ADAPTATION_WINDOW_S * parameters.sample_rate_hz).max(LEAST_WINDOW_SAMPLES)
            / f64::from(parameters.samples_per_output);
        let frames = libm::ceil(frames);
        let samples = frames * f64::from(parameters.samples_per_output);
        let looks = samples / 3.0;
        let share = if parameters.adaptation_time_s > 0.0 {
            let window_s = samples / parameters.sample_rate_hz;
            (window_s / parameters.adaptation_time_s).min(f64::from(FIRST_ADAPTATION_SHARE))
        } else {
            0.0
        };
        let limits = parameters.limits.unwrap_or_default();
        let axes = [0, 1, 2].map(|axis| {
            let gain = parameters.strip_rad_per_code(axis);
            let amplitude_rad = parameters.dither_amplitude_rad[axis];
            if amplitude_rad == 0.0 || gain == 0.0 {
                return Axis::default();
            }
            let phase = parameters.dither_phase(axis);
            let (sin, cos) = (libm::sin(phase.omega), libm::cos(phase.omega));
            let square_of_z = 2.0 * (1.0 - cos);
            // Of the pickoff in codes, then in the correlations' units, and of the block in rad.
            let step_codes =
                amplitude_rad / parameters.pickoff_weight_rad * libm::sqrt(square_of_z);
            let step_rad = step_codes * gain;
            let step = step_codes / N::codes_per_factor(dither.scales()[axis]);
            let rad_per_factor = N::RAD_PER_FACTOR * parameters.increment_unit_rad();
            let correlation = looks * 0.5 * step_rad / rad_per_factor * step;
            // y and 1/z as real matrices, one after the other.
            let y = [[1.0, 0.0], [-cos / sin, 1.0 / sin]];
            let by_z = [[1.0 - cos, sin], [-sin, 1.0 - cos]];
            let estimate = [0, 1].map(|row| {
                [0, 1].map(|column| {
                    let product = by_z[row][0] * y[0][column] + by_z[row][1] * y[1][column];
                    (product / square_of_z / correlation) as f32
                })
            });
            let (slow, fast) = HEALTHY_FREQUENCY;
            let fine = libm::ldexp(gain, crate::chain::numbers::exact::FINE_PER_RAD_LOG2);
            Axis {
                dithered: true,
                estimate,
                step_energy: (looks * 0.5 * step * step) as f32,
                error_energy: {
                    let error = step_rad * libm::sqrt(square_of_z) / rad_per_factor;
                    (looks * 0.5 * error * error) as f32
                },
                amplitudes: limits.dither_amplitude.map(|amplitude| amplitude as f32),
                cosines: [fast, slow].map(|ratio| {
                    libm::cos((phase.omega * ratio).min(core::f64::consts::PI)) as f32
                }),
                tap_per_gain: fine as f32,
                taps_per_quadrature: [(fine * phase.cot()) as f32, (-fine * phase.cosec()) as f32],
                nominal: dither.nominal()[axis],
                // A float's conversion holds at the end.
                reach: ((PICKOFF_REACH_RAD / gain) as u32).min(LARGEST_REACH_CODES),
            }
        });
        let watches = axes.iter().any(|axis| axis.dithered);
        Self {
            axes,
            watches,
            share: if watches { share as f32 } else { 0.0 },
            frames_per_window: frames as u32,
        }
    }

    /// Begins with the stream.
    pub fn start<N: NumberSystem>(&self, state: &mut AdaptationState<N>) {
        state.next_gyro = if self.watches { 0 } else { NONE_WATCHED };
    }

    /// Adds one gyro's products to its window sums, before the sample goes through the strip.
    #[inline(always)]
    pub fn observe<N: NumberSystem>(
        &self,
        state: &mut AdaptationState<N>,
        dither: (&Dither<N>, &DitherState<N>),
        flexure: &FlexureState<N>,
        sample: &Sample,
    ) {
        let next = state.next_gyro;
        let gyro = next as usize;
        let (strip, strip_state) = dither;
        // All arrays have three elements: one check serves, also where no gyro is watched.
        let Some(sums) = state.sums.get_mut(gyro) else {
            return;
        };
        let code = sample.pickoff_codes[gyro];
        let codes = code.wrapping_sub(strip_state.readings()[gyro].last);
        let now = N::step_factor(N::step(strip.scales()[gyro], codes));
        let past = N::step_factor(strip_state.step()[gyro]);
        let error = N::increment_factor(flexure.difference()[gyro]);
        let [with_past, with_now] = &mut sums.correlations;
        *with_past = N::add_correlation(*with_past, error, past);
        *with_now = N::add_correlation(*with_now, error, now);
        let [square, lagged] = &mut sums.steps;
        *square = N::add_correlation(*square, now, now);
        *lagged = N::add_correlation(*lagged, now, past);
        sums.error = N::add_correlation(sums.error, error, error);
        let counts = sample.pulse_counts[gyro];
        sums.changed |= counts ^ sums.counts;
        sums.counts = counts;
        state.next_gyro = if next < 2 { next + 1 } else { 0 };
    }

    /// True if windows move the taps.
    fn tracks(&self) -> bool {
        self.share > 0.0
    }

    /// True once a window has closed without a finding, or no gyro is watched.
    pub fn has_started<N: NumberSystem>(&self, state: &AdaptationState<N>) -> bool {
        !self.watches || state.has_closed_clean
    }

    /// Counts `periods` output periods, and closes the window with its last one.
    #[inline(always)]
    pub fn finish<N: NumberSystem>(
        &self,
        state: &mut AdaptationState<N>,
        strip: &Dither<N>,
        strip_state: &mut DitherState<N>,
        periods: u32,
    ) -> Option<WindowResult> {
        if !self.watches {
            return None;
        }
        state.frames = state.frames.wrapping_add(periods);
        if state.frames < self.frames_per_window {
            return None;
        }
        Some(self.close(state, strip, strip_state))
    }

    /// Output periods of one window; 1 where no gyro is dithered.
    #[cfg(feature = "proof")]
    pub(crate) fn frames_per_window(&self) -> u32 {
        if self.watches {
            self.frames_per_window
        } else {
            1
        }
    }

    /// Returns the lowest and the highest value of each tap that the windows can reach \[fine units per code\]: a tap
    /// is monotonic in either tracked value, rounding included, so its extremes stand at their ends.
    #[cfg(feature = "proof")]
    pub(crate) fn tap_ranges(&self, nominal: &[ExactTaps; 3]) -> [[(i64, i64); 2]; 3] {
        let mut ranges = nominal.map(|taps| taps.map(|tap| (tap, tap)));
        for (axis, ranges) in self.axes.iter().zip(&mut ranges) {
            if !(self.tracks() && axis.dithered) {
                continue;
            }
            for gain in [-ADAPTATION_RANGE, ADAPTATION_RANGE] {
                for quadrature in [-ADAPTATION_RANGE, ADAPTATION_RANGE] {
                    let tracked = Tracked {
                        gain,
                        quadrature,
                        ..Tracked::default()
                    };
                    for ((low, high), tap) in ranges.iter_mut().zip(axis.taps(&tracked)) {
                        *low = tap.min(*low);
                        *high = tap.max(*high);
                    }
                }
            }
        }
        ranges
    }

    /// Tests the window's health, moves the taps and begins the next window.
    #[inline(never)]
    fn close<N: NumberSystem>(
        &self,
        state: &mut AdaptationState<N>,
        strip: &Dither<N>,
        strip_state: &mut DitherState<N>,
    ) -> WindowResult {
        let mut result = WindowResult {
            status: Status::ADAPTING.when(self.tracks()),
            angle: [0; 3],
        };
        let mut taps = *strip_state.exact_taps();
        // Three calls and no loop: no bound on its passes has to be shown.
        self.close_gyro::<N, 0>(state, strip_state, &mut taps, &mut result);
        self.close_gyro::<N, 1>(state, strip_state, &mut taps, &mut result);
        self.close_gyro::<N, 2>(state, strip_state, &mut taps, &mut result);
        let found = result.status.bits() & !Status::ADAPTING.bits();
        state.has_closed_clean |= found == 0;
        if self.tracks() {
            strip.set_taps(strip_state, &taps);
        }
        state.frames = 0;
        state.disturbed = state.disturbed.saturating_sub(1);
        result
    }

    /// Tests one gyro's health and moves its taps.
    #[inline(always)]
    fn close_gyro<N: NumberSystem, const GYRO: usize>(
        &self,
        state: &mut AdaptationState<N>,
        strip_state: &DitherState<N>,
        taps: &mut [ExactTaps; 3],
        result: &mut WindowResult,
    ) {
        let axis = &self.axes[GYRO];
        let least = (self.tracks() && state.disturbed == 0).then_some(self.share);
        let readings = strip_state.readings()[GYRO];
        let from_origin = |code: i32| code.wrapping_sub(strip_state.origin()[GYRO]);
        let codes = [from_origin(readings.last), from_origin(readings.before)];
        let tracked = &mut state.tracked[GYRO];
        let sums = &mut state.sums[GYRO];
        result.angle[GYRO] = axis.close(sums, tracked, codes, &mut taps[GYRO], least);
        result.status = result.status.union(tracked.health);
    }
}

impl Axis {
    /// Tests the gyro's health by the window's `sums` and begins the next; without a finding, moves its taps.
    ///
    /// # Inputs
    /// `codes`: the last two pickoff readings from the first. `least`: as in [`follow`](Self::follow); `None`: the taps rest.
    ///
    /// # Returns
    /// Angle by the moved taps \[fine units\].
    #[inline(never)]
    fn close<N: NumberSystem>(
        &self,
        sums: &mut Sums<N>,
        tracked: &mut Tracked,
        codes: [i32; 2],
        taps: &mut ExactTaps,
        least: Option<f32>,
    ) -> i64 {
        let before = tracked.health;
        tracked.health = self.judge(sums);
        if tracked.health != Status::default() {
            tracked.share = FIRST_ADAPTATION_SHARE;
        }
        let healthy = tracked.health.union(before) == Status::default();
        let [last, past] = codes;
        let within_reach = last.unsigned_abs() <= self.reach;
        let mut angle = 0;
        if let Some(least) = least
            && self.dithered
            && healthy
            && within_reach
        {
            self.follow(sums, tracked, least);
            let moved = self.taps(tracked);
            let now = moved[0].wrapping_sub(taps[0]);
            let before = moved[1].wrapping_sub(taps[1]);
            angle = now
                .wrapping_mul(i64::from(last))
                .wrapping_add(before.wrapping_mul(i64::from(past)))
                .wrapping_neg();
            *taps = moved;
        }
        sums.begin();
        angle
    }

    /// Returns this gyro's health by the window's sums.
    fn judge<N: NumberSystem>(&self, sums: &Sums<N>) -> Status {
        if !self.dithered {
            return Status::default();
        }
        let [square, lagged] = sums.steps.map(N::correlation);
        let share = |amplitude: f32| amplitude * amplitude * self.step_energy;
        let [smallest, largest] = self.amplitudes;
        if square < share(STILL_AMPLITUDE) {
            let unstripped = N::correlation(sums.error) > UNSTRIPPED_ENERGY * self.error_energy;
            return if unstripped {
                Status::PICKOFF_FAILED
            } else {
                Status::DITHER_STOPPED
            };
        }
        let [fast, slow] = self.cosines;
        let band = square < share(smallest)
            || square > share(largest)
            || lagged < fast * square
            || lagged > slow * square;
        let stuck = square >= share(smallest) && sums.changed == 0;
        Status::DITHER_OUT_OF_BAND
            .when(band)
            .union(Status::COUNTER_STUCK.when(stuck))
    }

    /// Moves the tracked gain and quadrature by a share of the window's estimate, within the limits of a step and of the
    /// range; `least` is the final share.
    fn follow<N: NumberSystem>(&self, sums: &Sums<N>, tracked: &mut Tracked, least: f32) {
        let [past, now] = sums.correlations.map(N::correlation);
        let share = tracked.share;
        let next = share - 0.5 * share * share;
        // `max` is a call.
        tracked.share = if next > least { next } else { least };
        let step = |row: [f32; 2]| {
            let step = share * (row[0] * past + row[1] * now);
            within(step, ADAPTATION_STEP_LIMIT)
        };
        let [gain, quadrature] = self.estimate.map(step);
        tracked.gain = within(tracked.gain + gain, ADAPTATION_RANGE);
        tracked.quadrature = within(tracked.quadrature + quadrature, ADAPTATION_RANGE);
    }

    /// The taps \[fine units per code\] for the tracked gain and quadrature.
    fn taps(&self, tracked: &Tracked) -> ExactTaps {
        let [now, past] = self.taps_per_quadrature;
        let [nominal_now, nominal_past] = self.nominal;
        [
            nominal_now
                .wrapping_add((self.tap_per_gain * tracked.gain + now * tracked.quadrature) as i64),
            nominal_past.wrapping_add((past * tracked.quadrature) as i64),
        ]
    }
}

impl<N: NumberSystem> AdaptationState<N> {
    /// Marks the window as holding lost or held samples: this window and the next may judge health but do not move the taps.
    pub fn disturb(&mut self) {
        self.disturbed = DISTURBED_WINDOWS;
    }

    /// The window's sums that are kept in the number system's words.
    #[cfg(feature = "proof")]
    pub(crate) fn sums(&self) -> impl core::fmt::Debug {
        self.sums
            .map(|sums| (sums.correlations, sums.steps, sums.error))
    }

    /// Health of each gyro by the last window.
    pub fn health(&self) -> [Status; 3] {
        self.tracked.map(|tracked| tracked.health)
    }

    /// Tracked gain and quadrature of each gyro, over and above nominal \[1\].
    pub fn tracked(&self) -> [[f32; 2]; 3] {
        self.tracked
            .map(|tracked| [tracked.gain, tracked.quadrature])
    }
}
