//! Isolator between base and case: rotation is transmitted by second-order modes, and linear vibration rocks a case whose
//! centre of mass is off the mounts' centre.
//!
//! From the base's motion at the nodes of one period, body frame, the case's motion at the same nodes.
//!
//! Equations, an axis at a time:
//! - transmission: H = (ω₀² + 2ζω₀ s)/(s² + 2ζω₀ s + ω₀²), for body rate and for linear acceleration alike;
//! - rocking: φ'' + 2ζω₀ φ' + ω₀² φ = −(e × a)_i/r_i² with a the case's linear acceleration, e from the mounts' centre to
//!   the centre of mass, r_i the case's radius of gyration about axis i.
//!
//! Assumes small angles between base and case: components are filtered in the base's body frame. An axis without a
//! frequency is rigid. The Earth's rotation is transmitted unchanged (H = 1 at its frequencies).

use super::attitude::Quadrature;
use super::mode::Mode;
use super::motion::{BaseMotion, BodyMotion};
use nalgebra::Vector3;

/// Frequency \[Hz\] and damping ratio of one axis; `None`: rigid.
pub type AxisMode = Option<(f64, f64)>;

/// Parameters of the isolator.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct IsolatorEntry {
    /// Rotation about x, y, z.
    pub angular: [AxisMode; 3],
    /// Translation along x, y, z.
    pub linear: [AxisMode; 3],
    /// Offset e of the centre of mass from the mounts' centre \[m\].
    pub offset_m: [f64; 3],
    /// Radii of gyration r_i \[m\]; unused if e is 0.
    pub gyration_radius_m: [f64; 3],
}

/// Isolator and its state.
#[derive(Debug, Clone)]
pub struct Isolator {
    angular: [Option<Mode>; 3],
    linear: [Option<Mode>; 3],
    /// Rocking: a separate mode with the angular one's frequency and damping.
    rocking: [Option<Mode>; 3],
    offset_m: Vector3<f64>,
    gyration_radius_m: [f64; 3],
}

impl Isolator {
    /// Isolator at rest.
    pub fn new(entry: &IsolatorEntry, quadrature: &Quadrature, period_s: f64) -> Self {
        let mode = |axis: AxisMode| {
            axis.map(|(frequency_hz, damping)| {
                Mode::new(frequency_hz, damping, quadrature, period_s)
            })
        };
        let coupled = entry.offset_m != [0.0; 3];
        Self {
            angular: entry.angular.map(mode),
            linear: entry.linear.map(mode),
            rocking: entry.angular.map(|axis| mode(axis.filter(|_| coupled))),
            offset_m: Vector3::from(entry.offset_m),
            gyration_radius_m: entry.gyration_radius_m,
        }
    }

    /// Computes the case's motion over the coming period.
    pub fn advance(&mut self, base: &[BaseMotion; 4]) -> [BaseMotion; 4] {
        let mut case = *base;
        for axis in 0..3 {
            if let Some(mode) = &mut self.angular[axis] {
                let input = base.map(|node| {
                    [
                        node.angular.rate_rad_s[axis],
                        node.angular.acceleration_rad_s2[axis],
                    ]
                });
                for (node, [rate, acceleration, jerk]) in case.iter_mut().zip(followed(mode, input))
                {
                    node.angular.rate_rad_s[axis] = rate;
                    node.angular.acceleration_rad_s2[axis] = acceleration;
                    node.angular.jerk_rad_s3[axis] = jerk;
                }
            }
            if let Some(mode) = &mut self.linear[axis] {
                let input = base.map(|node| [node.linear_m_s2[axis], node.linear_rate_m_s3[axis]]);
                for (node, [value, slope, _]) in case.iter_mut().zip(followed(mode, input)) {
                    node.linear_m_s2[axis] = value;
                    node.linear_rate_m_s3[axis] = slope;
                }
            }
        }
        for axis in 0..3 {
            let Some(mode) = &mut self.rocking[axis] else {
                continue;
            };
            let per_arm = -1.0 / self.gyration_radius_m[axis].powi(2);
            let torque = |force: &Vector3<f64>| per_arm * self.offset_m.cross(force)[axis];
            let drive = case.map(|node| torque(&node.linear_m_s2));
            let stages = mode.advance(drive);
            for (node, (drive, stage)) in case.iter_mut().zip(drive.into_iter().zip(stages)) {
                let acceleration = mode.second_derivative(drive, stage);
                let jerk = mode
                    .second_derivative(torque(&node.linear_rate_m_s3), [stage[1], acceleration]);
                add(&mut node.angular, axis, [stage[1], acceleration, jerk]);
            }
        }
        case
    }
}

/// Value, slope and second derivative of the output of H; `input` holds value and slope of its input.
fn followed(mode: &mut Mode, input: [[f64; 2]; 4]) -> [[f64; 3]; 4] {
    let (omega, damping) = (mode.omega_rad_s, mode.damping);
    let drive = input.map(|[value, slope]| omega * (omega * value + 2.0 * damping * slope));
    let stages = mode.advance(drive);
    std::array::from_fn(|node| {
        let [value, slope] = stages[node];
        [
            value,
            slope,
            mode.second_derivative(drive[node], stages[node]),
        ]
    })
}

/// Adds rate, acceleration and jerk about one axis.
pub fn add(motion: &mut BodyMotion, axis: usize, [rate, acceleration, jerk]: [f64; 3]) {
    motion.rate_rad_s[axis] += rate;
    motion.acceleration_rad_s2[axis] += acceleration;
    motion.jerk_rad_s3[axis] += jerk;
}
