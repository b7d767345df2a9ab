//! Gravity in a rotating body: its velocity increments at any instant, from the closed form of the motion.
//!
//! The attitude is integrated in parts of a row with Savage's two-sample coning term (Savage 1998, eq. 46), the force by
//! Simpson's rule over two parts; both are accurate to the fourth order of a part, of which a row has eight.

use nalgebra::{UnitQuaternion, Vector3};
use rlg_simulator::attitude::EARTH_RATE_RAD_S;

use crate::marks::motion::{Derivative, Motion};

/// Parts of a row; even.
const PARTS: usize = 8;

/// Time before and after the recording that is computed, for channels with a delay or a lead \[s\].
const BEFORE_S: f64 = 0.1;

/// Site of the unit and its attitude at the start.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Level {
    /// Upwards at the start, body axes, unit length.
    pub up: Vector3<f64>,
    /// North at the start, body axes, unit length.
    pub north: Vector3<f64>,
    /// Latitude \[rad\].
    pub latitude_rad: f64,
    /// Gravity \[m/s²\].
    pub gravity_m_s2: f64,
}

impl Level {
    /// Returns the specific force in the inertial axes of the start, at a time \[m/s²\].
    fn force_m_s2(&self, time_s: f64) -> Vector3<f64> {
        let (sin, cos) = self.latitude_rad.sin_cos();
        let earth_rad = EARTH_RATE_RAD_S * time_s * (sin * self.up + cos * self.north);
        UnitQuaternion::from_scaled_axis(earth_rad) * (self.gravity_m_s2 * self.up)
    }
}

/// Specific force of a body, on a grid of parts of rows.
#[derive(Debug, Clone)]
pub struct Felt {
    start_s: f64,
    step_s: f64,
    /// Force at the grid's points \[m/s²\], x y z.
    force_m_s2: [Vec<f64>; 3],
    /// Integral from the grid's first point on \[m/s\], x y z.
    velocity_m_s: [Vec<f64>; 3],
}

impl Felt {
    /// Computes gravity in the body through a motion over `rows` rows of `period_s`.
    pub fn new(motion: &Motion, level: &Level, (rows, period_s): (usize, f64)) -> Self {
        let step_s = period_s / PARTS as f64;
        let before = (BEFORE_S / period_s).ceil() as usize * PARTS;
        let start_s = -(before as f64) * step_s;
        // Rows beyond the end, for channels with a lead.
        let early = (BEFORE_S / period_s).ceil() as usize;
        let parts = before + (rows + early) * PARTS;
        let increments: [Vec<f64>; 3] =
            [0, 1, 2].map(|axis| motion.increments_rad(axis, start_s, step_s, parts));
        let turned = |part: usize| Vector3::from_fn(|axis, _| increments[axis][part]);
        // Attitude at the recording's start.
        let mut attitudes = Vec::with_capacity(parts + 1);
        let mut attitude = UnitQuaternion::identity();
        attitudes.push(attitude);
        for part in 0..parts {
            let now = turned(part);
            let last = turned(part.saturating_sub(1));
            attitude *= UnitQuaternion::from_scaled_axis(now + last.cross(&now) / 12.0);
            attitudes.push(attitude);
        }
        let at_start = attitudes[before].inverse();
        let mut felt = Self {
            start_s,
            step_s,
            force_m_s2: std::array::from_fn(|_| Vec::with_capacity(parts + 1)),
            velocity_m_s: std::array::from_fn(|_| Vec::with_capacity(parts + 1)),
        };
        for (part, attitude) in attitudes.iter().enumerate() {
            let time_s = start_s + part as f64 * step_s;
            let force = (at_start * attitude).inverse() * level.force_m_s2(time_s);
            for axis in 0..3 {
                felt.force_m_s2[axis].push(force[axis]);
            }
        }
        for axis in 0..3 {
            felt.velocity_m_s[axis] = integral(&felt.force_m_s2[axis], step_s);
        }
        felt
    }

    /// Returns the velocity increments of a channel with the delay `delay_s` over each row \[m/s\].
    pub fn increments_m_s(
        &self,
        axis: usize,
        delay_s: f64,
        (rows, period_s): (usize, f64),
    ) -> Vec<f64> {
        let at = |row: usize| self.velocity_at(axis, row as f64 * period_s - delay_s);
        let velocities: Vec<f64> = (0..=rows).map(at).collect();
        velocities
            .windows(2)
            .map(|pair| pair[1] - pair[0])
            .collect()
    }

    /// Returns the integral over each row of a function of the force along an axis.
    pub fn of_force(
        &self,
        axis: usize,
        (rows, period_s): (usize, f64),
        function: impl Fn(f64) -> f64,
    ) -> Vec<f64> {
        let first = (-self.start_s / self.step_s).round() as usize;
        let parts = (period_s / self.step_s).round() as usize;
        let values: Vec<f64> = self.force_m_s2[axis].iter().map(|f| function(*f)).collect();
        let running = integral(&values, self.step_s);
        (0..rows)
            .map(|row| running[first + (row + 1) * parts] - running[first + row * parts])
            .collect()
    }

    /// Cubic Hermite interpolation of the velocity from velocities and forces at both ends of a part.
    fn velocity_at(&self, axis: usize, time_s: f64) -> f64 {
        let place = (time_s - self.start_s) / self.step_s;
        let last = self.velocity_m_s[axis].len() - 2;
        let part = (place.floor().max(0.0) as usize).min(last);
        let u = place - part as f64;
        let (v, f) = (&self.velocity_m_s[axis], &self.force_m_s2[axis]);
        let (rise, h) = (v[part + 1] - v[part], self.step_s);
        let (begin, end) = (h * f[part], h * f[part + 1]);
        v[part]
            + u * (begin + u * (3.0 * rise - 2.0 * begin - end + u * (begin + end - 2.0 * rise)))
    }
}

/// Running integral of values at equal steps, by the parabola through three points: to the fourth order.
fn integral(values: &[f64], step: f64) -> Vec<f64> {
    let last = values.len() - 1;
    let mut running = vec![0.0; values.len()];
    for part in 0..last {
        // Both parts of a pair use the parabola through its three points.
        let first = (part - part % 2).min(last - 2);
        let [a, b, c] = [0, 1, 2].map(|point| values[first + point]);
        let area = match part == first {
            true => (5.0 * a + 8.0 * b - c) / 12.0,
            false => (-a + 8.0 * b + 5.0 * c) / 12.0,
        };
        running[part + 1] = running[part] + step * area;
    }
    running
}

/// Returns the lever-arm effect of the rotation on an accelerometer at `arm_m` over each row along `axis` \[m/s\]: α × r +
/// ω × (ω × r).
pub fn at_arm_m_s(
    motion: &Motion,
    axis: usize,
    arm_m: &Vector3<f64>,
    (rows, period_s): (usize, f64),
) -> Vec<f64> {
    let step_s = period_s / PARTS as f64;
    let count = rows * PARTS + 1;
    let series = |about: usize| motion.series(Derivative::Rate, about, 0.0, step_s, count);
    let rates = [0, 1, 2].map(series);
    let rate = |point: usize| Vector3::from_fn(|about, _| rates[about][point]);
    let towards: Vec<f64> = (0..count)
        .map(|point| {
            let omega = rate(point);
            omega.cross(&omega.cross(arm_m))[axis]
        })
        .collect();
    let running = integral(&towards, step_s);
    (0..rows)
        .map(|row| {
            let (from, to) = (row * PARTS, (row + 1) * PARTS);
            (rate(to) - rate(from)).cross(arm_m)[axis] + running[to] - running[from]
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::marks::motion::Term;

    fn level(up: Vector3<f64>) -> Level {
        Level {
            up,
            north: up.cross(&Vector3::x()).normalize(),
            latitude_rad: 0.0,
            gravity_m_s2: 10.0,
        }
    }

    /// About y, up = (sin, 0, cos) of the angle against the start, which rotates at −ω t.
    #[test]
    fn a_spin_about_a_level_axis_turns_gravity_in_closed_form() {
        let (rate, delay_s, span) = (1.3, 0.02, (500, 0.02));
        let mut motion = Motion::default();
        motion.terms[1].push(Term::Spin { rate_rad_s: rate });
        let mut level = level(Vector3::z());
        // The Earth rotates about north at the equator, here the axis of the spin: against the ground the body rotates more
        // slowly.
        level.north = Vector3::y();
        let against_ground = rate - EARTH_RATE_RAD_S;
        let felt = Felt::new(&motion, &level, span);
        let read = felt.increments_m_s(0, delay_s, span);
        let squared = felt.of_force(2, span, |f| f * f);
        for row in 0..span.0 {
            let [from, to] = [row, row + 1].map(|row| row as f64 * span.1 - delay_s);
            let swept = |t: f64| 10.0 / against_ground * (against_ground * t).cos();
            assert!(
                (read[row] - (swept(to) - swept(from))).abs() < 1e-10,
                "{row}"
            );
            let [from, to] = [row, row + 1].map(|row| row as f64 * span.1);
            let square =
                |t: f64| 50.0 * (t + (2.0 * against_ground * t).sin() / (2.0 * against_ground));
            assert!((squared[row] - (square(to) - square(from))).abs() < 1e-7);
        }
    }

    #[test]
    fn an_arm_feels_the_centripetal_and_the_tangential_acceleration() {
        let (amplitude, turning, span) = (0.2, 9.0, (300, 0.01));
        let mut motion = Motion::default();
        motion.terms[2].push(Term::Sine {
            amplitude_rad: amplitude,
            angular_frequency_rad_s: turning,
            phase_rad: 0.4,
        });
        let arm = Vector3::new(0.3, 0.0, 0.0);
        let tangential = at_arm_m_s(&motion, 1, &arm, span);
        let centripetal = at_arm_m_s(&motion, 0, &arm, span);
        for row in 0..span.0 {
            let [from, to] = [row, row + 1].map(|row| row as f64 * span.1 * turning + 0.4);
            let rate = |phase: f64| amplitude * turning * phase.cos();
            assert!((tangential[row] - 0.3 * (rate(to) - rate(from))).abs() < 1e-12);
            // ∫ cos² = φ/2 + sin 2φ/4
            let square = |phase: f64| {
                amplitude * amplitude * turning * (0.5 * phase + 0.25 * (2.0 * phase).sin())
            };
            let expected = -0.3 * (square(to) - square(from));
            assert!((centripetal[row] - expected).abs() < 1e-8, "{row}");
        }
    }
}
