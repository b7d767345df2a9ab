//! Motion of the base relative to the ground in closed form: one file a kind.
//!
//! From a profile of a scenario and the time since its segment's start: [`BaseMotion`], the body rate with its first two
//! derivatives (rad/s, rad/s², rad/s³) and the linear acceleration with its first (m/s², m/s³), body frame.
//!
//! Slew, oscillation, spin, tumbling and vibration are given as rates; coning as an attitude (`coning`, `rotation_vector`).
//! Derivatives are analytic, never differenced.
//!
//! Assumes segments of whole sample periods, each of which begins and ends at rest (C³ tapers), so that no kink lies inside
//! a quadrature period.
//!
//! Out of scope: the Earth's rotation and gravity (`attitude.rs`), the isolator between base and
//! case (`isolator.rs`), sustained linear motion: the base vibrates at its site and does not travel.

mod coning;
pub mod jet;
mod peak;
pub mod rotation_vector;
pub mod vibration;

use jet::{Jet, smooth_step, taper};
use nalgebra::Vector3;
use rand_chacha::ChaCha8Rng;
use rotation_vector::{ConingTone, rotation_vector};
use std::f64::consts::TAU;
use vibration::{Spectrum, ToneBank, band_tones};

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

/// Motion of the base at one instant, body frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BaseMotion {
    /// Rotation relative to the ground.
    pub angular: BodyMotion,
    /// Linear acceleration without gravity \[m/s²\].
    pub linear_m_s2: Vector3<f64>,
    /// Derivative of the linear acceleration \[m/s³\].
    pub linear_rate_m_s3: Vector3<f64>,
}

impl BaseMotion {
    /// At rest.
    pub const STILL: Self = Self {
        angular: BodyMotion::STILL,
        linear_m_s2: Vector3::new(0.0, 0.0, 0.0),
        linear_rate_m_s3: Vector3::new(0.0, 0.0, 0.0),
    };
}

/// Motion of a segment. Axes are 0, 1, 2 for x, y, z.
#[derive(Debug, Clone, PartialEq)]
pub enum Profile {
    /// At rest on the Earth.
    Still,
    /// The body tilts by `angle_rad` about an axis that rotates in the plane across `axis`; at the segment's end it is back
    /// at its initial attitude.
    Coning {
        /// Cone axis.
        axis: usize,
        /// Frequency of the cone; negative for the opposite sense \[Hz\].
        frequency_hz: f64,
        /// Half-angle of the cone \[rad\].
        angle_rad: f64,
        /// Length of each taper \[s\].
        ramp_s: f64,
    },
    /// Coning with a rotation vector on ellipses, at one frequency or several.
    EllipticConing {
        /// Cone axis.
        axis: usize,
        /// The ellipses.
        tones: Vec<ConingTone>,
        /// Length of each taper \[s\].
        ramp_s: f64,
    },
    /// Rotation by `angle_rad` about one axis over the whole segment.
    Slew {
        /// Axis of the rotation.
        axis: usize,
        /// Angle of the rotation \[rad\].
        angle_rad: f64,
    },
    /// Constant rate about `axis`, plus an oscillation about `oscillation_axis`.
    Spin {
        /// Axis of the constant rate.
        axis: usize,
        /// Constant rate \[rad/s\].
        rate_rad_s: f64,
        /// Length of each taper \[s\].
        ramp_s: f64,
        /// Axis of the oscillation, fixed in the body.
        oscillation_axis: usize,
        /// Frequency of the oscillation \[Hz\].
        oscillation_frequency_hz: f64,
        /// Peak angle \[rad\]; 0 for none.
        oscillation_angle_rad: f64,
        /// Phase of the oscillation's rate at the segment's start \[rad\].
        oscillation_phase_rad: f64,
    },
    /// Large rates about all axes at once, ω_i = R_i cos(2πf_i t + φ_i).
    Tumble {
        /// R_i \[rad/s\].
        rate_rad_s: [f64; 3],
        /// f_i; 0 for a constant rate \[Hz\].
        frequency_hz: [f64; 3],
        /// φ_i \[rad\].
        phase_rad: [f64; 3],
        /// Length of each taper \[s\].
        ramp_s: f64,
    },
    /// Band-limited random angular vibration.
    Vibration {
        /// Lower edge of the band \[Hz\].
        low_hz: f64,
        /// Upper edge of the band \[Hz\].
        high_hz: f64,
        /// Rms rate of each axis \[rad/s\].
        rate_rms_rad_s: [f64; 3],
        /// `Some`: the axes share every tone, each at this phase offset from a common phase \[rad\]: elliptical motion,
        /// which rectifies. `None`: independent phases.
        axis_phase_rad: Option<[f64; 3]>,
        /// Length of each taper \[s\].
        ramp_s: f64,
    },
    /// Random vibration from tables of power spectral density; axes without one do not move.
    RandomVibration {
        /// Body rate, x y z \[Hz, (rad/s)²/Hz\].
        angular: [Spectrum; 3],
        /// Linear acceleration, x y z \[Hz, (m/s²)²/Hz\].
        linear: [Spectrum; 3],
        /// Length of each taper \[s\].
        ramp_s: f64,
    },
}

/// Motion of one segment, evaluated period by period at fixed fractions of a period.
#[derive(Debug, Clone)]
pub struct SegmentMotion {
    profile: Profile,
    period_s: f64,
    duration_s: f64,
    node_fractions: [f64; 4],
    row: usize,
    /// Rates about x, y, z, then accelerations along x, y, z; empty unless a vibration.
    banks: Vec<ToneBank>,
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
        let bank = |tones: &[_]| ToneBank::new(tones, node_fractions, period_s);
        let banks = match profile {
            Profile::Vibration {
                low_hz,
                high_hz,
                rate_rms_rad_s,
                axis_phase_rad,
                ..
            } => band_tones(*low_hz, *high_hz, *rate_rms_rad_s, *axis_phase_rad, rng)
                .iter()
                .map(|tones| bank(tones))
                .collect(),
            Profile::RandomVibration {
                angular, linear, ..
            } => angular
                .iter()
                .chain(linear)
                .map(|spectrum| bank(&spectrum.tones(rng)))
                .collect(),
            _ => Vec::new(),
        };
        Self {
            profile: profile.clone(),
            period_s,
            duration_s: rows as f64 * period_s,
            node_fractions,
            row: 0,
            banks,
        }
    }

    /// Returns the motion at the nodes of the next period.
    pub fn next_period(&mut self) -> [BaseMotion; 4] {
        let begin_s = self.row as f64 * self.period_s;
        self.row += 1;
        if let Profile::Vibration { ramp_s, .. } | Profile::RandomVibration { ramp_s, .. } =
            self.profile
        {
            return std::array::from_fn(|node| {
                let time_s = begin_s + self.node_fractions[node] * self.period_s;
                self.vibration(node, taper(time_s, self.duration_s, ramp_s))
            });
        }
        self.node_fractions.map(|fraction| BaseMotion {
            angular: self.closed_form(begin_s + fraction * self.period_s),
            ..BaseMotion::STILL
        })
    }

    fn closed_form(&self, time_s: f64) -> BodyMotion {
        let mut motion = BodyMotion::STILL;
        match &self.profile {
            Profile::Still | Profile::Vibration { .. } | Profile::RandomVibration { .. } => {}
            Profile::Coning {
                axis,
                frequency_hz,
                angle_rad,
                ramp_s,
            } => {
                let angle = taper(time_s, self.duration_s, *ramp_s).map(|w| angle_rad * w);
                coning::coning(&mut motion, *axis, TAU * frequency_hz, time_s, angle);
            }
            Profile::EllipticConing {
                axis,
                tones,
                ramp_s,
            } => {
                let w = taper(time_s, self.duration_s, *ramp_s);
                rotation_vector(&mut motion, *axis, tones, time_s, &w);
            }
            Profile::Slew { axis, angle_rad } => {
                let step = smooth_step(time_s, self.duration_s);
                motion.rate_rad_s[*axis] = angle_rad * step[1];
                motion.acceleration_rad_s2[*axis] = angle_rad * step[2];
                motion.jerk_rad_s3[*axis] = angle_rad * step[3];
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
                let w = taper(time_s, self.duration_s, *ramp_s);
                motion.rate_rad_s[*axis] += rate_rad_s * w[0];
                motion.acceleration_rad_s2[*axis] += rate_rad_s * w[1];
                motion.jerk_rad_s3[*axis] += rate_rad_s * w[2];
                let omega = TAU * oscillation_frequency_hz;
                let amplitude = oscillation_angle_rad * omega;
                let phase = omega * time_s + oscillation_phase_rad;
                add_tapered(
                    &mut motion,
                    *oscillation_axis,
                    w,
                    cosine(amplitude, omega, phase),
                );
            }
            Profile::Tumble {
                rate_rad_s,
                frequency_hz,
                phase_rad,
                ramp_s,
            } => {
                let w = taper(time_s, self.duration_s, *ramp_s);
                for axis in 0..3 {
                    let omega = TAU * frequency_hz[axis];
                    let phase = omega * time_s + phase_rad[axis];
                    add_tapered(&mut motion, axis, w, cosine(rate_rad_s[axis], omega, phase));
                }
            }
        }
        motion
    }

    fn vibration(&mut self, node: usize, w: Jet) -> BaseMotion {
        let mut motion = BaseMotion::STILL;
        for (place, bank) in self.banks.iter_mut().enumerate() {
            let signal = bank.next(node);
            if place < 3 {
                add_tapered(&mut motion.angular, place, w, signal);
            } else {
                motion.linear_m_s2[place - 3] = w[0] * signal[0];
                motion.linear_rate_m_s3[place - 3] = w[1] * signal[0] + w[0] * signal[1];
            }
        }
        motion
    }
}

/// a cos(phase) and its first two derivatives, for a phase rate `omega`.
fn cosine(amplitude: f64, omega: f64, phase: f64) -> [f64; 3] {
    let (sin, cos) = phase.sin_cos();
    [
        amplitude * cos,
        -amplitude * omega * sin,
        -amplitude * omega * omega * cos,
    ]
}

/// Adds w(t)·r(t) on one axis, by the product rule; `rate` holds r and its first two derivatives.
fn add_tapered(motion: &mut BodyMotion, axis: usize, w: Jet, rate: [f64; 3]) {
    motion.rate_rad_s[axis] += w[0] * rate[0];
    motion.acceleration_rad_s2[axis] += w[1] * rate[0] + w[0] * rate[1];
    motion.jerk_rad_s3[axis] += w[2] * rate[0] + 2.0 * w[1] * rate[1] + w[0] * rate[2];
}
