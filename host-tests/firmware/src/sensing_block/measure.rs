//! Measures the drift of an attitude composed of the chain's output frames from the true one.

use std::f64::consts::TAU;

use trueaxis::design_parameters::OUTPUT_RAD_PER_CODE;
use trueaxis::{Chain, ChainState, NumberSystem, Parameters};

use super::{Quaternion, Recording, Vector};

/// 1 °/h \[rad/s\].
pub const DEG_H: f64 = std::f64::consts::PI / 180.0 / 3600.0;

/// Error of an attitude composed of output frames, at the end of each frame.
pub struct AttitudeError {
    /// Time between two frames \[s\].
    pub frame_period_s: f64,
    /// Rotation vector from the true attitude to the composed one, along the body axes at time 0 \[rad\].
    pub error_rad: Vec<Vector>,
}

/// Drift of an attitude along the body axes at time 0 \[°/h\].
#[derive(Debug, Clone, Copy)]
pub struct Drift {
    /// Rate of the error, averaged with the weight 1 − cos(2πt/D) over the duration D. Oscillations do not leak into it: an
    /// oscillation of amplitude a at ω leaves 4π²a/(ω²D³), a straight line 12a/(ωD²).
    pub mean_deg_h: Vector,
    /// Standard error of `mean_deg_h` if the residual of the straight line were white noise: too large if it oscillates.
    pub sigma_deg_h: Vector,
    /// Slope of the straight line of least squares.
    pub line_deg_h: Vector,
    /// Difference of the ends over a whole number of periods.
    pub ends_deg_h: Vector,
}

/// Runs a chain over the samples of unit `unit` and compares its attitude with the true one.
///
/// The error is composed of the differences of frames, not of attitudes: rounding adds some 1e-19 rad a frame.
pub fn attitude_error<N: NumberSystem>(
    parameters: &Parameters,
    recording: &Recording,
    unit: usize,
) -> AttitudeError {
    let chain = Chain::<N>::new(parameters).expect("parameters are in range");
    let mut state = ChainState::new();
    let mut truth = Quaternion::IDENTITY;
    let mut over_frame = Quaternion::IDENTITY;
    let mut error = Quaternion::IDENTITY;
    let mut error_rad = Vec::new();
    for (sample, rotation) in recording.samples[unit].iter().zip(&recording.rotations) {
        over_frame = over_frame.times(*rotation);
        let Some(frame) = chain.process(&mut state, sample) else {
            continue;
        };
        let shown = (frame.dtheta_codes).map(|code| f64::from(code) * OUTPUT_RAD_PER_CODE);
        let shown = Quaternion::from_rotation_vector(shown);
        let difference = shown.times(over_frame.inverse()).rotation_vector();
        let turned = Quaternion::from_rotation_vector(truth.rotate(difference));
        error = error.times(turned);
        truth = truth.times(over_frame).normalised();
        over_frame = Quaternion::IDENTITY;
        error_rad.push(error.rotation_vector());
    }
    AttitudeError {
        frame_period_s: f64::from(parameters.samples_per_output) * recording.period_s,
        error_rad,
    }
}

impl AttitudeError {
    /// Drift from time `from_s` to the end \[s\]; `period_s` is that of the motion.
    pub fn drift(&self, from_s: f64, period_s: f64) -> Drift {
        let skip = (from_s / self.frame_period_s).ceil() as usize;
        let errors = &self.error_rad[skip..];
        let axis = |i: usize| {
            let error: Vec<_> = errors.iter().map(|error| error[i]).collect();
            self.axis(&error, period_s)
        };
        let axes = [axis(0), axis(1), axis(2)];
        Drift {
            mean_deg_h: axes.map(|axis| axis[0]),
            sigma_deg_h: axes.map(|axis| axis[1]),
            line_deg_h: axes.map(|axis| axis[2]),
            ends_deg_h: axes.map(|axis| axis[3]),
        }
    }

    /// Mean, standard error, line and ends of one axis \[°/h\].
    fn axis(&self, error_rad: &[f64], period_s: f64) -> [f64; 4] {
        let tau_s = self.frame_period_s;
        let steps = error_rad.len() - 1;
        let weight = |step: usize| 1.0 - (TAU * (step as f64 + 0.5) / steps as f64).cos();
        let (mut mean, mut squares) = (0.0, 0.0);
        for (step, pair) in error_rad.windows(2).enumerate() {
            let weight = weight(step) / (steps as f64 * tau_s);
            mean += weight * (pair[1] - pair[0]);
        }
        // The weight of each error is the difference of the weights of its two steps.
        for step in 1..steps {
            let difference = (weight(step - 1) - weight(step)) / (steps as f64 * tau_s);
            squares += difference * difference;
        }

        let count = error_rad.len() as f64;
        let middle = (count - 1.0) / 2.0;
        let level = error_rad.iter().sum::<f64>() / count;
        let (mut moment, mut spread) = (0.0, 0.0);
        for (k, error) in error_rad.iter().enumerate() {
            moment += (k as f64 - middle) * (error - level);
            spread += (k as f64 - middle) * (k as f64 - middle);
        }
        let slope = moment / spread;
        let mut residual = 0.0;
        for (k, error) in error_rad.iter().enumerate() {
            let left = error - level - slope * (k as f64 - middle);
            residual += left * left;
        }
        let sigma = (residual / (count - 2.0) * squares).sqrt();

        let periods = (steps as f64 * tau_s / period_s).floor().max(1.0);
        let end = ((periods * period_s / tau_s).round() as usize).min(steps);
        let ends = (error_rad[end] - error_rad[0]) / (end as f64 * tau_s);
        [mean, sigma, slope / tau_s, ends].map(|rate| rate / DEG_H)
    }
}

impl Drift {
    /// Difference from the drift of another attitude; standard errors add in squares.
    #[must_use]
    pub fn less(&self, other: &Self) -> Self {
        let minus = |a: Vector, b: Vector| [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
        let (a, b) = (self.sigma_deg_h, other.sigma_deg_h);
        Self {
            mean_deg_h: minus(self.mean_deg_h, other.mean_deg_h),
            sigma_deg_h: [0, 1, 2].map(|i| a[i].hypot(b[i])),
            line_deg_h: minus(self.line_deg_h, other.line_deg_h),
            ends_deg_h: minus(self.ends_deg_h, other.ends_deg_h),
        }
    }

    /// Largest component of the mean \[°/h\].
    pub fn largest_deg_h(&self) -> f64 {
        self.mean_deg_h.iter().fold(0.0, |l, v| l.max(v.abs()))
    }

    /// Resolution of the mean: three standard errors of the worst axis \[°/h\].
    pub fn resolution_deg_h(&self) -> f64 {
        3.0 * self.sigma_deg_h.iter().fold(0.0, |l: f64, v| l.max(*v))
    }
}
