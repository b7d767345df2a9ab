//! The strip's gain and delay, followed by least mean squares in blocks.
//!
//! Enters, per period: stripped increments of the gyros' own axes \[rad\], pickoff angles \[rad\]. Leaves, at the
//! end of a window: the phasor (a, b) of [`super::strip`] to go on with, and the window's centre.
//!
//! A strip whose phasor is wrong by (Δa, Δb) leaves g (Δa p + Δb u) of the block's angle in its gyro. Seen in
//! second differences of angle, where the motion is small beside the dither: e_k = r_k − r_{k−1} against
//! x_k = p_k − 2 p_{k−1} + p_{k−2} and the same a quarter turn ahead,
//!
//! ```text
//! c₀ = Σ e_k x_k = g Δa X      c_q = (cos Ω Σ e_k x_k − Σ e_k x_{k−1}) / sin Ω = g Δb X
//! X = n ½ A² (2 sin Ω/2)⁴      the nominal Σ x², of n products at the dither's nominal amplitude A
//! a += μ c₀ / (g X)            b += μ c_q / (g X)            μ = window / adaptation time
//! ```
//!
//! The products of period k are taken of gyro k mod 3 only. A window is a whole number of output intervals,
//! the nearest to 30 ms and at least one. Steps and the way from the nominal phasor are bounded.
//!
//! A window that lost a period is thrown away, and so is one whose gyro saw no dither
//! (X below a quarter of its nominal value): nothing could be learnt from it.

use super::strip::Phasor;
use nalgebra::Vector3;

/// Length of a window \[s\]: some ten cycles of a 350–500 Hz dither.
const WINDOW_S: f64 = 0.03;

/// How the strip is to be followed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AdaptationCalibration {
    /// Time in which a wrong phasor is followed \[s\]; 0: never.
    pub time_s: f64,
    /// F \[Hz\].
    pub frequency_hz: [f64; 3],
    /// A, of the pickoff \[rad\]; 0: no dither to follow.
    pub amplitude_rad: [f64; 3],
}

/// Largest step of a or b in one window \[1\]: a hundredth of the block's angle. At 0.5 s and 30 ms a window
/// moves by 6 % of the error, so that only errors beyond 17 % are slowed down.
const STEP_LIMIT: f64 = 0.01;

/// Farthest that a and b may go from their nominal values \[1\]: a pickoff that is a fifth wrong is broken.
const RANGE_LIMIT: f64 = 0.2;

/// Least share of the nominal Σ x² that is a dither.
const LEAST_DITHER: f64 = 0.25;

/// The products of one gyro in one window.
#[derive(Debug, Clone, Copy, Default)]
struct Products {
    with_reference: f64,
    with_reference_before: f64,
    reference_square: f64,
    number: f64,
}

/// The window under way.
#[derive(Debug, Clone)]
pub struct Adaptation {
    calibration: AdaptationCalibration,
    nominal: Phasor,
    period_s: f64,
    outputs_per_window: usize,
    outputs: usize,
    spoiled: bool,
    products: [Products; 3],
    pickoff_sum_rad: Vector3<f64>,
    periods: f64,
    next_axis: usize,
    increment_before_rad: Option<Vector3<f64>>,
    /// The latest pickoff readings, newest first \[rad\].
    readings_rad: Vec<Vector3<f64>>,
}

/// What a window's end says.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WindowEnd {
    /// a and b to go on with.
    pub phasor: Phasor,
    /// Mean pickoff angle of the window \[rad\].
    pub centre_rad: Vector3<f64>,
}

impl Adaptation {
    /// Round the phasor `nominal`.
    pub fn new(
        calibration: &AdaptationCalibration,
        nominal: Phasor,
        period_s: f64,
        periods_per_output: usize,
    ) -> Self {
        let output_s = period_s * periods_per_output as f64;
        Self {
            calibration: *calibration,
            nominal,
            period_s,
            outputs_per_window: (WINDOW_S / output_s).round().max(1.0) as usize,
            outputs: 0,
            spoiled: false,
            products: Default::default(),
            pickoff_sum_rad: Vector3::zeros(),
            periods: 0.0,
            next_axis: 0,
            increment_before_rad: None,
            readings_rad: Vec::new(),
        }
    }

    /// One period: what each gyro sensed with its block's turn taken off, and the pickoffs at its end.
    pub fn add(&mut self, stripped_rad: Vector3<f64>, pickoff_rad: Vector3<f64>) {
        self.readings_rad.insert(0, pickoff_rad);
        self.readings_rad.truncate(4);
        self.pickoff_sum_rad += pickoff_rad;
        self.periods += 1.0;
        let axis = self.next_axis;
        self.next_axis = (axis + 1) % 3;
        let before = self.increment_before_rad.replace(stripped_rad);
        let (Some(before), [p0, p1, p2, p3]) = (before, self.readings_rad.as_slice()) else {
            return;
        };
        let error = stripped_rad[axis] - before[axis];
        let reference = p0[axis] - 2.0 * p1[axis] + p2[axis];
        let reference_before = p1[axis] - 2.0 * p2[axis] + p3[axis];
        let products = &mut self.products[axis];
        products.with_reference += error * reference;
        products.with_reference_before += error * reference_before;
        products.reference_square += reference * reference;
        products.number += 1.0;
    }

    /// Periods were lost: what this window holds is not to be learnt from.
    pub fn spoil(&mut self) {
        self.spoiled = true;
        self.increment_before_rad = None;
        self.readings_rad.clear();
    }

    /// An output interval ends; the phasor to go on with where a window ends with it.
    pub fn end_output(&mut self, gain: &Vector3<f64>, phasor: Phasor) -> Option<WindowEnd> {
        self.outputs += 1;
        if self.outputs < self.outputs_per_window {
            return None;
        }
        let end = WindowEnd {
            phasor: if self.spoiled {
                phasor
            } else {
                self.step(gain, phasor)
            },
            centre_rad: self.pickoff_sum_rad / self.periods.max(1.0),
        };
        self.outputs = 0;
        self.spoiled = false;
        self.products = Default::default();
        self.pickoff_sum_rad = Vector3::zeros();
        self.periods = 0.0;
        Some(end)
    }

    fn step(&self, gain: &Vector3<f64>, mut phasor: Phasor) -> Phasor {
        let calibration = &self.calibration;
        if calibration.time_s == 0.0 {
            return phasor;
        }
        let share = self.periods * self.period_s / calibration.time_s;
        for axis in 0..3 {
            let sums = &self.products[axis];
            let turn = std::f64::consts::TAU * calibration.frequency_hz[axis] * self.period_s;
            let amplitude = calibration.amplitude_rad[axis];
            let nominal =
                sums.number * 0.5 * amplitude.powi(2) * (2.0 * (0.5 * turn).sin()).powi(4);
            if nominal == 0.0 || gain[axis] == 0.0 || sums.reference_square < LEAST_DITHER * nominal
            {
                continue;
            }
            let (sin, cos) = turn.sin_cos();
            let ahead = (cos * sums.with_reference - sums.with_reference_before) / sin;
            let follow = |value: f64, correlation: f64, from: f64| {
                let step = share * correlation / (gain[axis] * nominal);
                let step = step.clamp(-STEP_LIMIT, STEP_LIMIT);
                (value + step).clamp(from - RANGE_LIMIT, from + RANGE_LIMIT)
            };
            phasor.in_phase[axis] = follow(
                phasor.in_phase[axis],
                sums.with_reference,
                self.nominal.in_phase[axis],
            );
            phasor.ahead[axis] = follow(phasor.ahead[axis], ahead, self.nominal.ahead[axis]);
        }
        phasor
    }
}
