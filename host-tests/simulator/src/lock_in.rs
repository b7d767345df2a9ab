//! Beat phase of a ring laser with lock-in.
//!
//! From the rotation of the cavity over a sub-step, in rad, the angle indicated by the beat, in rad.
//!
//! Equation: dψ/dt = SΩ − SΩ_L sin ψ, S = 2π per pulse, Ω the cavity's inertial rate (case, dither and the gyro's
//! errors), Ω_L the lock-in threshold (Adler; β of the paper's form is the phase at the start).
//!
//! Scheme: each sub-step is solved exactly for its mean rate. With z = e^{iψ} the equation is a Riccati equation, whose
//! flow is a Möbius map: with a = SΩ, b = SΩ_L, w = √(a² − b²), θ = wh/2 the phase advances by 2 arg(cos θ + (sin θ/w)(ia +
//! b e^{−iψ})), above the threshold and below it (w imaginary) alike. Neglected is the change of Ω inside a sub-step: S Ω'
//! h²/8 of phase, which [`sub_steps`] keeps below [`PHASE_BEND_RAD`]. Tests compare the scheme with Runge–Kutta steps of a
//! fiftieth of a pulse.
//!
//! Out of scope: the beat's mean shift by unequal loss (a bias), noise (the instrument adds the random walk, which rotates
//! the phase).

use std::f64::consts::TAU;

/// Largest phase error by the change of Ω inside a sub-step \[rad\]: a few per cent of one turnaround's kick, of random
/// sign, and below 1e-3 of the random walk, a sum of squares.
pub const PHASE_BEND_RAD: f64 = 0.03;

/// Largest number of sub-steps a row; more is a wrong unit.
const MOST_SUB_STEPS: usize = 4096;

/// Number of sub-steps a row for the largest angular acceleration \[rad/s²\] of the cavity.
pub fn sub_steps(acceleration_rad_s2: f64, pulse_rad: f64, period_s: f64) -> usize {
    let bend = TAU / pulse_rad * acceleration_rad_s2 * period_s.powi(2) / 8.0;
    ((bend / PHASE_BEND_RAD).sqrt().ceil() as usize).clamp(1, MOST_SUB_STEPS)
}

/// Beat phase of one gyro.
#[derive(Debug, Clone)]
pub struct BeatPhase {
    phase_per_angle: f64,
    threshold_rad_s: f64,
    /// e^{iψ}: real, imaginary. In this form no sine is needed per step.
    beat: [f64; 2],
}

impl BeatPhase {
    /// `phase_rad`: β, the phase at the start.
    pub fn new(pulse_rad: f64, threshold_rad_s: f64, phase_rad: f64) -> Self {
        let (sin, cos) = phase_rad.sin_cos();
        Self {
            phase_per_angle: TAU / pulse_rad,
            threshold_rad_s,
            beat: [cos, sin],
        }
    }

    /// Returns the indicated angle for a rotation of the cavity by `angle_rad` at a constant rate over `step_s`.
    pub fn step(&mut self, angle_rad: f64, step_s: f64) -> f64 {
        // all in units of phase over the step
        let turn = self.phase_per_angle * angle_rad;
        let hold = self.phase_per_angle * self.threshold_rad_s * step_s;
        let square = turn * turn - hold * hold;
        let [cos_phase, sin_phase] = self.beat;
        // half the phase advanced, and a vector along it
        let (half, re, im) = if square > 0.0 {
            let theta = 0.5 * square.sqrt().copysign(turn);
            let (sin, cos) = theta.sin_cos();
            // (sin θ/w) h, the same for either sign of θ
            let k = if theta.abs() > 1e-6 {
                0.5 * sin / theta
            } else {
                0.5
            };
            let re = cos + hold * k * cos_phase;
            let im = turn * k - hold * k * sin_phase;
            // relative to θ the argument stays inside ±π, however many turns θ makes
            let beside = argument(im * cos - re * sin, re * cos + im * sin);
            (theta + beside, re, im)
        } else {
            let theta = 0.5 * (-square).sqrt();
            let k = if theta > 1e-6 {
                0.5 * theta.tanh() / theta
            } else {
                0.5
            };
            // both parts over cosh θ, to avoid overflow
            let re = 1.0 + hold * k * cos_phase;
            let im = turn * k - hold * k * sin_phase;
            (argument(im, re), re, im)
        };
        self.turn(re, im);
        2.0 * half / self.phase_per_angle
    }

    /// Rotates the phase by an angle not due to the cavity's rotation: noise of the beat \[rad\].
    pub fn disturb(&mut self, angle_rad: f64) {
        let (sin, cos) = (0.5 * self.phase_per_angle * angle_rad).sin_cos();
        self.turn(cos, sin);
    }

    /// Rotates e^{iψ} by twice the argument of re + i im; division by its square keeps the length 1.
    fn turn(&mut self, re: f64, im: f64) {
        let scale = 1.0 / (re * re + im * im);
        let (cos, sin) = ((re * re - im * im) * scale, 2.0 * re * im * scale);
        let [x, y] = self.beat;
        self.beat = [x * cos - y * sin, x * sin + y * cos];
        // rounding: one Newton step towards length 1 each time prevents its accumulation
        let length = 1.5 - 0.5 * (self.beat[0].powi(2) + self.beat[1].powi(2));
        self.beat = self.beat.map(|part| part * length);
    }
}

/// atan2, faster for a small argument, the usual case except in turnarounds: the series' next term is below 0.05⁹/9 = 2e-13
/// rad of phase.
fn argument(y: f64, x: f64) -> f64 {
    if 20.0 * y.abs() < x {
        let r = y / x;
        let square = r * r;
        return r * (1.0 - square * (1.0 / 3.0 - square * (0.2 - square / 7.0)));
    }
    y.atan2(x)
}
