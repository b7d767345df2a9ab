//! Moves of an experiment in closed form.
//!
//! The body rate \[rad/s\] and its derivative \[rad/s²\], body frame, are functions of a move and of the time since its
//! beginning. A three-axis table follows these rates; the gimbal angles are left to its controller.
//!
//! Spin: steady rate Ω about one axis and an oscillation of the same frequency about another: the tilt K_ij α_j of the
//! third gyro is multiplied by Ω, and a reversal of Ω reverses only that product. Cone: rates in quadrature across an
//! axis.

use std::f64::consts::TAU;

use rlg_signal::axes::Triad;
use rlg_signal::derivatives::row_means;

/// Kinds of motion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Kind {
    /// Rest.
    Still,
    /// Cone about `axis`; a negative frequency reverses its sense.
    Coning {
        /// 0, 1, 2 for x, y, z.
        axis: usize,
        /// Frequency \[Hz\].
        frequency_hz: f64,
        /// Half-angle \[rad\].
        angle_rad: f64,
    },
    /// Spin about `axis` with an oscillation about `across`.
    Spin {
        /// 0, 1, 2 for x, y, z.
        axis: usize,
        /// Rate \[rad/s\].
        rate_rad_s: f64,
        /// 0, 1, 2 for x, y, z.
        across: usize,
        /// Frequency \[Hz\].
        frequency_hz: f64,
        /// Peak angle \[rad\].
        angle_rad: f64,
        /// Phase of the rate at the beginning \[rad\].
        phase_rad: f64,
    },
}

/// One move.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Move {
    /// Motion.
    pub kind: Kind,
    /// Duration, ramps included \[s\].
    pub duration_s: f64,
    /// Length of the ramp at either end \[s\].
    pub ramp_s: f64,
}

/// Steepest slope of the smooth step 35x⁴ − 84x⁵ + 70x⁶ − 20x⁷, at its middle.
pub const STEEPEST: f64 = 2.1875;

/// Smooth step and its slope.
fn step(x: f64) -> (f64, f64) {
    if x >= 1.0 {
        return (1.0, 0.0);
    }
    let x = x.max(0.0);
    (
        x.powi(4) * (35.0 + x * (-84.0 + x * (70.0 - 20.0 * x))),
        140.0 * (x * (1.0 - x)).powi(3),
    )
}

impl Move {
    /// Rate \[rad/s\] and angular acceleration \[rad/s²\] at `time_s` after the beginning.
    pub fn at(&self, time_s: f64) -> ([f64; 3], [f64; 3]) {
        let (mut rate, mut acceleration) = ([0.0; 3], [0.0; 3]);
        let rising = 2.0 * time_s <= self.duration_s;
        let from_end_s = if rising {
            time_s
        } else {
            self.duration_s - time_s
        };
        let (taper, slope) = match self.kind {
            Kind::Still => (0.0, 0.0),
            _ => step(from_end_s / self.ramp_s),
        };
        let slope = if rising { slope } else { -slope } / self.ramp_s;
        let mut add = |axis: usize, amplitude: f64, omega: f64, phase: f64| {
            let (sin, cos) = (omega * time_s + phase).sin_cos();
            rate[axis] += taper * amplitude * cos;
            acceleration[axis] += amplitude * (slope * cos - taper * omega * sin);
        };
        match self.kind {
            Kind::Still => {}
            Kind::Coning {
                axis,
                frequency_hz,
                angle_rad,
            } => {
                let omega = TAU * frequency_hz;
                let amplitude = omega * angle_rad.sin();
                add((axis + 1) % 3, amplitude, omega, TAU / 4.0);
                add((axis + 2) % 3, amplitude, omega, 0.0);
            }
            Kind::Spin {
                axis,
                rate_rad_s,
                across,
                frequency_hz,
                angle_rad,
                phase_rad,
            } => {
                let omega = TAU * frequency_hz;
                add(axis, rate_rad_s, 0.0, 0.0);
                add(across, angle_rad * omega, omega, phase_rad);
            }
        }
        (rate, acceleration)
    }

    /// True for the first move of its kind: neither rest nor the negative sense of a spin.
    pub fn leads(&self) -> bool {
        match self.kind {
            Kind::Still => false,
            Kind::Coning { .. } => true,
            Kind::Spin { rate_rad_s, .. } => rate_rad_s > 0.0,
        }
    }

    /// Greatest rate \[rad/s\] and angular acceleration \[rad/s²\] about any axis over the move.
    pub fn greatest(&self) -> (f64, f64) {
        /// Sampling of the search \[Hz\]: fifty samples per period of the fastest oscillation that tables follow.
        const LOOKS_HZ: f64 = 2000.0;
        let looks = (self.duration_s * LOOKS_HZ) as usize;
        (0..=looks).fold((0.0, 0.0), |most: (f64, f64), look| {
            let (rate, acceleration) = self.at(look as f64 / LOOKS_HZ);
            let greatest = |values: [f64; 3]| values.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
            (
                most.0.max(greatest(rate)),
                most.1.max(greatest(acceleration)),
            )
        })
    }
}

/// Computes the case's increments by row over consecutive moves \[rad\].
pub fn increments_rad(moves: &[Move], rate_hz: f64) -> Triad {
    let mut rate_rad_s = Triad::default();
    for one in moves {
        let rows = (one.duration_s * rate_hz).round() as usize;
        for row in 0..rows {
            let (omega, _) = one.at((row as f64 + 0.5) / rate_hz);
            for (axis, omega) in omega.into_iter().enumerate() {
                rate_rad_s[axis].push(omega);
            }
        }
    }
    rate_rad_s.map(|at_middles| {
        let means = row_means(&at_middles).into_iter();
        means.map(|mean| mean / rate_hz).collect()
    })
}
