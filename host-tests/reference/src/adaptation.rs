//! Follows the strip's gain and delay by least mean squares in blocks.
//!
//! It takes, per period, the stripped increments r_k about the gyros' own axes \[rad\] and the pickoff angles p_k
//! \[rad\]. At the end of a window it gives the phasor (a, b) of [`super::strip`] to use next.
//!
//! A strip whose phasor is wrong by Δ = Δa + iΔb leaves Re{g P Δ e^{iΩk}} in its gyro, where the pickoff
//! steps by dp_k = Re{P e^{iΩk}}; the difference d_k = r_k − r_{k−1}, in which the motion is small, holds
//! z = 1 − e^{−iΩ} times that. So, over the n products of a window,
//!
//! ```text
//! C₀ = Σ d_{k−1} dp_{k−1}     C₁ = Σ d_{k−1} dp_k     both over ½ n g P²,  P = 2 A sin Ω/2
//! y = C₀ + i (C₁ − C₀ cos Ω)/sin Ω        Δ = y / z        a + ib += μ Δ
//! μ = ½ in the first window; then μ ← max(μ − ½ μ², window / adaptation time)
//! ```
//!
//! with A the nominal amplitude. A period adds the product of one gyro only: the stream's second one at x, the next at y,
//! and so on round; periods that primed, were lost or came after lost ones add none. A window is the least
//! whole number of output intervals that lasts 30 ms and has 72 periods. Steps and the way from the nominal
//! phasor are bounded.
//!
//! A window with a reading that came after lost ones moves nothing, nor the next (the reading may have been the
//! window's last), nor one whose dither is not within half and one and a half of its nominal amplitude: its estimate is
//! not usable. After the latter μ begins anew.
//!
//! Out of scope: health and its consequences; the dither's frequency is taken as known.
//!
//! # Cost of following
//! Motion that leaks through a window is written on the taps and comes back through them at its own
//! frequency, as a scale error of that motion alone that falls with the time (tests/chain_against_reference/strip.rs
//! and flexure.rs).

use super::strip::Phasor;
use nalgebra::{Complex, Vector3};

/// Least length of a window \[s\]: some ten cycles of a 350–500 Hz dither.
const WINDOW_S: f64 = 0.03;

/// Least periods of a window: 24 products a gyro, for two unknowns.
const WINDOW_PERIODS: f64 = 72.0;

/// Share of the first window's estimate that is followed \[1\].
const FIRST_SHARE: f64 = 0.5;

/// Largest step of a or b in one window \[1\]: a hundredth of the block's angle. With 1 s a window moves
/// by 3 % of the error, so that only errors beyond a third are slowed down.
const STEP_LIMIT: f64 = 0.01;

/// Largest departure of a and b from their nominal values \[1\]: a pickoff that is a fifth wrong is broken.
const RANGE_LIMIT: f64 = 0.2;

/// Amplitudes over the nominal one from which the phasor's error can be estimated.
const HEALTHY_AMPLITUDE: std::ops::Range<f64> = 0.5..1.5;

/// Settings of the strip's adaptation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AdaptationCalibration {
    /// Time in which a wrong phasor is followed \[s\]; 0: never.
    pub time_s: f64,
    /// F \[Hz\].
    pub frequency_hz: [f64; 3],
    /// A, of the pickoff \[rad\]; 0: no dither to follow.
    pub amplitude_rad: [f64; 3],
}

/// The products of one gyro, summed over a window.
#[derive(Debug, Clone, Copy, Default)]
struct WindowSums {
    /// Σ d_{k−1} dp_{k−1}, Σ d_{k−1} dp_k.
    products: [f64; 2],
    step_square: f64,
    number: f64,
}

/// The present window.
#[derive(Debug, Clone)]
pub struct Adaptation {
    calibration: AdaptationCalibration,
    nominal: Phasor,
    period_s: f64,
    periods_per_window: f64,
    outputs_per_window: usize,
    outputs: usize,
    /// Windows that do not move the phasor, this one included.
    disturbed: usize,
    /// μ of the next window, by gyro.
    share: [f64; 3],
    sums: [WindowSums; 3],
    next_axis: usize,
    /// r_{k−1}, r_{k−2}, … and p_k, p_{k−1}, …, newest first \[rad\].
    increments_rad: Vec<Vector3<f64>>,
    readings_rad: Vec<Vector3<f64>>,
}

impl Adaptation {
    /// Starts at the phasor `nominal`, within `RANGE_LIMIT` of which a and b stay.
    pub fn new(
        calibration: &AdaptationCalibration,
        nominal: Phasor,
        period_s: f64,
        periods_per_output: usize,
    ) -> Self {
        let least_periods = (WINDOW_S / period_s).max(WINDOW_PERIODS);
        let outputs_per_window = (least_periods / periods_per_output as f64).ceil() as usize;
        Self {
            calibration: *calibration,
            nominal,
            period_s,
            periods_per_window: (outputs_per_window * periods_per_output) as f64,
            outputs_per_window,
            outputs: 0,
            disturbed: 0,
            share: [FIRST_SHARE; 3],
            sums: Default::default(),
            next_axis: 0,
            increments_rad: Vec::new(),
            readings_rad: Vec::new(),
        }
    }

    /// Takes the pickoffs at the end of a period without increment: the first, or the first after lost ones.
    pub fn prime(&mut self, pickoff_rad: Vector3<f64>) {
        self.readings_rad.insert(0, pickoff_rad);
    }

    /// Adds one period: each gyro's sensed angle without its block's rotation, and the pickoffs at its end.
    pub fn add(&mut self, stripped_rad: Vector3<f64>, pickoff_rad: Vector3<f64>) {
        self.readings_rad.insert(0, pickoff_rad);
        self.readings_rad.truncate(3);
        let axis = self.next_axis;
        self.next_axis = (axis + 1) % 3;
        self.add_to_window(axis);
        self.increments_rad.insert(0, stripped_rad);
        self.increments_rad.truncate(2);
    }

    fn add_to_window(&mut self, axis: usize) {
        let sums = &mut self.sums[axis];
        sums.number += 1.0;
        let (&[last, before], &[p0, p1, p2]) =
            (self.increments_rad.as_slice(), self.readings_rad.as_slice())
        else {
            return;
        };
        let difference = last[axis] - before[axis];
        let step = p0[axis] - p1[axis];
        sums.products[0] += difference * (p1[axis] - p2[axis]);
        sums.products[1] += difference * step;
        sums.step_square += step * step;
    }

    /// Records that periods were lost before this one: its window and the next do not move the phasor, and differences
    /// start anew.
    pub fn disturb(&mut self) {
        self.disturbed = 2;
        self.increments_rad.clear();
        self.readings_rad.clear();
    }

    /// Ends an output interval; gives the phasor to use next if a window ends with it.
    pub fn end_output(&mut self, gain: &Vector3<f64>, mut phasor: Phasor) -> Option<Phasor> {
        self.outputs += 1;
        if self.outputs < self.outputs_per_window {
            return None;
        }
        self.outputs = 0;
        let sums = std::mem::take(&mut self.sums);
        let disturbed = self.disturbed > 0;
        self.disturbed = self.disturbed.saturating_sub(1);
        if disturbed || self.calibration.time_s == 0.0 {
            return None;
        }
        let settled = self.periods_per_window * self.period_s / self.calibration.time_s;
        for axis in 0..3 {
            let Some(error) = self.error(axis, &sums[axis], gain[axis]) else {
                self.share[axis] = FIRST_SHARE;
                continue;
            };
            let share = self.share[axis];
            self.share[axis] = (share - 0.5 * share * share).max(settled.min(FIRST_SHARE));
            let follow = |value: &mut f64, error: f64, nominal: f64| {
                let step = (share * error).clamp(-STEP_LIMIT, STEP_LIMIT);
                *value = (*value + step).clamp(nominal - RANGE_LIMIT, nominal + RANGE_LIMIT);
            };
            let nominal = &self.nominal;
            follow(&mut phasor.in_phase[axis], error.re, nominal.in_phase[axis]);
            follow(&mut phasor.ahead[axis], error.im, nominal.ahead[axis]);
        }
        Some(phasor)
    }

    /// Estimates Δ of one gyro from this window; `None` where it shows no usable dither.
    fn error(&self, axis: usize, sums: &WindowSums, gain: f64) -> Option<Complex<f64>> {
        let turn = std::f64::consts::TAU * self.calibration.frequency_hz[axis] * self.period_s;
        let (sin, cos) = turn.sin_cos();
        let step_rad = 2.0 * self.calibration.amplitude_rad[axis] * (0.5 * turn).sin();
        let mean_square = sums.step_square / sums.number.max(1.0);
        // NaN, of an amplitude of 0, is outside; a gain of 0 is a gyro without dither
        if gain == 0.0 || !HEALTHY_AMPLITUDE.contains(&((2.0 * mean_square).sqrt() / step_rad)) {
            return None;
        }
        let nominal = 0.5 * self.periods_per_window / 3.0 * gain * step_rad.powi(2);
        let [zero, one] = sums.products.map(|product| product / nominal);
        let seen = Complex::new(zero, (one - zero * cos) / sin);
        Some(seen / (1.0 - Complex::new(cos, -sin)))
    }
}
