//! The case's motion relative to the ground, in closed form.
//!
//! Enters: a profile of a scenario and the time since its segment began. Leaves: the body rate and its
//! first two derivatives, body frame, rad/s, rad/s², rad/s³: [`BodyMotion`].
//!
//! Equations: a coning attitude is the rotation φ(t) about u(t) = (0, cos ψ, sin ψ), ψ = Ωt, so that
//! ω = φ' u + sin φ u' − (1 − cos φ) u × u' exactly, tapered ends included. Slew, oscillation, spin and
//! vibration are given as rates. Derivatives are written out, never differenced.
//!
//! Assumes segments of whole sample periods, each of which begins and ends at rest (C³ tapers), so that
//! quadrature inside a period never meets a kink.
//!
//! Deliberately not here: the Earth's rotation and gravity (`attitude.rs`), linear motion of the case.

use nalgebra::Vector3;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use std::f64::consts::TAU;

/// Rate and derivatives of the body at one instant, body frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BodyMotion {
    /// ω \[rad/s\].
    pub rate_rad_s: Vector3<f64>,
    /// dω/dt \[rad/s²\].
    pub acceleration_rad_s2: Vector3<f64>,
    /// d²ω/dt² \[rad/s³\].
    pub jerk_rad_s3: Vector3<f64>,
}

impl BodyMotion {
    /// At rest relative to the ground.
    pub const STILL: Self = Self {
        rate_rad_s: Vector3::new(0.0, 0.0, 0.0),
        acceleration_rad_s2: Vector3::new(0.0, 0.0, 0.0),
        jerk_rad_s3: Vector3::new(0.0, 0.0, 0.0),
    };
}

/// Value and first three derivatives of a scalar of time.
type Jet = [f64; 4];

/// 35x⁴ − 84x⁵ + 70x⁶ − 20x⁷ from 0 to 1 over `duration_s`: the lowest-order step with three continuous
/// derivatives, which jerk (the second derivative of a rate that is already a first one) needs.
fn smooth_step(time_s: f64, duration_s: f64) -> Jet {
    if time_s <= 0.0 {
        return [0.0; 4];
    }
    if time_s >= duration_s {
        return [1.0, 0.0, 0.0, 0.0];
    }
    let x = time_s / duration_s;
    let y = 1.0 - x;
    let per_s = 1.0 / duration_s;
    [
        x.powi(4) * (35.0 + x * (-84.0 + x * (70.0 - 20.0 * x))),
        140.0 * (x * y).powi(3) * per_s,
        420.0 * (x * y).powi(2) * (1.0 - 2.0 * x) * per_s.powi(2),
        840.0 * x * y * (1.0 - 5.0 * x * y) * per_s.powi(3),
    ]
}

/// Up over `ramp_s`, 1, down over `ramp_s` at the end of `duration_s`.
fn taper(time_s: f64, duration_s: f64, ramp_s: f64) -> Jet {
    if 2.0 * time_s <= duration_s {
        smooth_step(time_s, ramp_s)
    } else {
        let [value, first, second, third] = smooth_step(duration_s - time_s, ramp_s);
        [value, -first, second, -third]
    }
}

/// How a segment moves. Axes are 0, 1, 2 for x, y, z.
#[derive(Debug, Clone, PartialEq)]
pub enum Profile {
    /// At rest on the Earth.
    Still,
    /// The body tilts by `angle_rad` about an axis that runs round in the plane across `axis`; at the
    /// segment's end it is back where it began.
    Coning {
        /// Cone axis.
        axis: usize,
        /// Turns per second; negative runs the other way round \[Hz\].
        frequency_hz: f64,
        /// Half-angle of the cone \[rad\].
        angle_rad: f64,
        /// Length of each taper \[s\].
        ramp_s: f64,
    },
    /// A turn by `angle_rad` about one axis over the whole segment.
    Slew {
        /// Axis turned about.
        axis: usize,
        /// Angle turned \[rad\].
        angle_rad: f64,
    },
    /// A constant rate about `axis`, with an oscillation about `oscillation_axis` beside it.
    Spin {
        /// Axis of the constant rate.
        axis: usize,
        /// The constant rate \[rad/s\].
        rate_rad_s: f64,
        /// Length of each taper \[s\].
        ramp_s: f64,
        /// Axis of the oscillation, fixed in the body.
        oscillation_axis: usize,
        /// \[Hz\].
        oscillation_frequency_hz: f64,
        /// Peak angle \[rad\]; 0 for none.
        oscillation_angle_rad: f64,
        /// Phase of the oscillation's rate at the segment's begin \[rad\].
        oscillation_phase_rad: f64,
    },
    /// Band-limited random angular vibration.
    Vibration {
        /// Lower edge of the band \[Hz\].
        low_hz: f64,
        /// Upper edge of the band \[Hz\].
        high_hz: f64,
        /// Rate, rms, of each axis \[rad/s\].
        rate_rms_rad_s: [f64; 3],
        /// `Some`: the axes share every tone, each behind a common phase by this much \[rad\]: elliptical
        /// motion, which rectifies. `None`: independent phases.
        axis_phase_rad: Option<[f64; 3]>,
        /// Length of each taper \[s\].
        ramp_s: f64,
    },
}

/// Tones that stand in for a continuous band: enough that the sum is Gaussian to 1 % in its fourth moment
/// (excess kurtosis −3/(2·64)), few enough that a minute costs well under a second.
const VIBRATION_TONES: usize = 64;

/// One axis of a vibration at one quadrature node: phasors that step by one period.
#[derive(Debug, Clone)]
struct ToneBank {
    real: Vec<f64>,
    imaginary: Vec<f64>,
}

/// The motion of one segment, evaluated period by period at fixed fractions of a period.
#[derive(Debug, Clone)]
pub struct SegmentMotion {
    profile: Profile,
    period_s: f64,
    duration_s: f64,
    node_fractions: [f64; 4],
    row: usize,
    /// Indexed \[node\]\[axis\]; empty unless a vibration.
    banks: Vec<[ToneBank; 3]>,
    rotation: Vec<(f64, f64)>,
    omega_rad_s: Vec<f64>,
}

impl SegmentMotion {
    /// Prepares `rows` periods of `period_s`; `rng` draws a vibration's tones.
    pub fn new(
        profile: &Profile,
        rows: usize,
        period_s: f64,
        node_fractions: [f64; 4],
        rng: &mut ChaCha8Rng,
    ) -> Self {
        let mut motion = Self {
            profile: profile.clone(),
            period_s,
            duration_s: rows as f64 * period_s,
            node_fractions,
            row: 0,
            banks: Vec::new(),
            rotation: Vec::new(),
            omega_rad_s: Vec::new(),
        };
        motion.draw_tones(rng);
        motion
    }

    fn draw_tones(&mut self, rng: &mut ChaCha8Rng) {
        let Profile::Vibration {
            low_hz,
            high_hz,
            rate_rms_rad_s,
            axis_phase_rad,
            ..
        } = self.profile
        else {
            return;
        };
        let width_hz = (high_hz - low_hz) / VIBRATION_TONES as f64;
        let mut phases = Vec::with_capacity(VIBRATION_TONES);
        for tone in 0..VIBRATION_TONES {
            // one tone in each cell of the band: the spectrum is filled evenly, the tones stay irregular
            let frequency_hz = low_hz + width_hz * (tone as f64 + rng.random::<f64>());
            self.omega_rad_s.push(TAU * frequency_hz);
            let common: f64 = rng.random::<f64>() * TAU;
            let free: [f64; 3] = [rng.random(), rng.random(), rng.random()];
            phases.push(match axis_phase_rad {
                Some(offset) => offset.map(|phase| common + phase),
                None => free.map(|turns| turns * TAU),
            });
        }
        self.rotation = self
            .omega_rad_s
            .iter()
            .map(|omega| (omega * self.period_s).sin_cos())
            .map(|(sin, cos)| (cos, sin))
            .collect();
        self.banks = self
            .node_fractions
            .iter()
            .map(|fraction| {
                std::array::from_fn(|axis| {
                    let amplitude = rate_rms_rad_s[axis] * (2.0 / VIBRATION_TONES as f64).sqrt();
                    let angles = phases.iter().zip(&self.omega_rad_s).map(|(phase, omega)| {
                        (phase[axis] + omega * fraction * self.period_s).sin_cos()
                    });
                    let (imaginary, real) = angles
                        .map(|(sin, cos)| (amplitude * sin, amplitude * cos))
                        .unzip();
                    ToneBank { real, imaginary }
                })
            })
            .collect();
    }

    /// The motion at the nodes of the next period.
    pub fn next_period(&mut self) -> [BodyMotion; 4] {
        let begin_s = self.row as f64 * self.period_s;
        self.row += 1;
        if let Profile::Vibration { ramp_s, .. } = self.profile {
            return std::array::from_fn(|node| {
                let time_s = begin_s + self.node_fractions[node] * self.period_s;
                self.vibration(node, taper(time_s, self.duration_s, ramp_s))
            });
        }
        self.node_fractions
            .map(|fraction| self.closed_form(begin_s + fraction * self.period_s))
    }

    fn closed_form(&self, time_s: f64) -> BodyMotion {
        let mut motion = BodyMotion::STILL;
        match self.profile {
            Profile::Still | Profile::Vibration { .. } => {}
            Profile::Coning {
                axis,
                frequency_hz,
                angle_rad,
                ramp_s,
            } => {
                let angle = taper(time_s, self.duration_s, ramp_s).map(|w| angle_rad * w);
                coning(&mut motion, axis, TAU * frequency_hz, time_s, angle);
            }
            Profile::Slew { axis, angle_rad } => {
                let step = smooth_step(time_s, self.duration_s);
                motion.rate_rad_s[axis] = angle_rad * step[1];
                motion.acceleration_rad_s2[axis] = angle_rad * step[2];
                motion.jerk_rad_s3[axis] = angle_rad * step[3];
            }
            Profile::Spin {
                axis,
                rate_rad_s,
                ramp_s,
                oscillation_axis,
                oscillation_frequency_hz,
                oscillation_angle_rad,
                oscillation_phase_rad,
            } => {
                let w = taper(time_s, self.duration_s, ramp_s);
                motion.rate_rad_s[axis] += rate_rad_s * w[0];
                motion.acceleration_rad_s2[axis] += rate_rad_s * w[1];
                motion.jerk_rad_s3[axis] += rate_rad_s * w[2];
                let omega = TAU * oscillation_frequency_hz;
                let (sin, cos) = (omega * time_s + oscillation_phase_rad).sin_cos();
                let amplitude = oscillation_angle_rad * omega;
                add_tapered(
                    &mut motion,
                    oscillation_axis,
                    w,
                    [
                        amplitude * cos,
                        -amplitude * omega * sin,
                        -amplitude * omega * omega * cos,
                    ],
                );
            }
        }
        motion
    }

    fn vibration(&mut self, node: usize, w: Jet) -> BodyMotion {
        let mut motion = BodyMotion::STILL;
        for axis in 0..3 {
            let bank = &mut self.banks[node][axis];
            let mut sums = [0.0; 3];
            for (((real, imaginary), (cos, sin)), omega) in bank
                .real
                .iter_mut()
                .zip(bank.imaginary.iter_mut())
                .zip(&self.rotation)
                .zip(&self.omega_rad_s)
            {
                sums[0] += *real;
                sums[1] -= omega * *imaginary;
                sums[2] -= omega * omega * *real;
                (*real, *imaginary) = (
                    *real * cos - *imaginary * sin,
                    *real * sin + *imaginary * cos,
                );
            }
            add_tapered(&mut motion, axis, w, sums);
        }
        motion
    }
}

/// Adds w(t)·r(t) on one axis, by the product rule; `rate` holds r and its first two derivatives.
fn add_tapered(motion: &mut BodyMotion, axis: usize, w: Jet, rate: [f64; 3]) {
    motion.rate_rad_s[axis] += w[0] * rate[0];
    motion.acceleration_rad_s2[axis] += w[1] * rate[0] + w[0] * rate[1];
    motion.jerk_rad_s3[axis] += w[2] * rate[0] + 2.0 * w[1] * rate[1] + w[0] * rate[2];
}

/// The exact body rate of coning. In the plane across the axis the rate is (P + iQ) e^{iψ} with P = φ' and
/// Q = Ω sin φ; each derivative adds iΩ times the bracket to the bracket's own.
fn coning(motion: &mut BodyMotion, axis: usize, omega_rad_s: f64, time_s: f64, angle: Jet) {
    let (sin_phase, cos_phase) = (omega_rad_s * time_s).sin_cos();
    let (sin, cos) = angle[0].sin_cos();
    let p = [angle[1], angle[2], angle[3]];
    let q = [
        omega_rad_s * sin,
        omega_rad_s * cos * angle[1],
        omega_rad_s * (cos * angle[2] - sin * angle[1].powi(2)),
    ];
    let along = [
        -omega_rad_s * (2.0 * (0.5 * angle[0]).sin().powi(2)),
        -omega_rad_s * sin * angle[1],
        -omega_rad_s * (cos * angle[1].powi(2) + sin * angle[2]),
    ];
    let across = [
        (p[0], q[0]),
        (p[1] - omega_rad_s * q[0], q[1] + omega_rad_s * p[0]),
        (
            p[2] - 2.0 * omega_rad_s * q[1] - omega_rad_s.powi(2) * p[0],
            q[2] + 2.0 * omega_rad_s * p[1] - omega_rad_s.powi(2) * q[0],
        ),
    ];
    let (first, second) = ((axis + 1) % 3, (axis + 2) % 3);
    for (vector, (along, (re, im))) in [
        &mut motion.rate_rad_s,
        &mut motion.acceleration_rad_s2,
        &mut motion.jerk_rad_s3,
    ]
    .into_iter()
    .zip(along.into_iter().zip(across))
    {
        vector[axis] = along;
        vector[first] = re * cos_phase - im * sin_phase;
        vector[second] = re * sin_phase + im * cos_phase;
    }
}
