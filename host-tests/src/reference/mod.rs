//! The chain in f64, written from the paper's equations: what the firmware's number systems are held to.
//!
//! Enters, per period T: sensed increment of each gyro \[rad\] and pickoff angle at the period's end \[rad\].
//! Leaves: the case's increment \[rad\], body frame, and every N periods its rotation vector \[rad\].
//!
//! Equations, D the sensed increment less gain · (pickoff difference), all per period:
//! 1. v = (1 − s) D − b T, the bracket of Eq. (7);
//! 2. α̂T² from M₀v, M₀ the matrix of Eq. (7) with ε_ij0 (`acceleration`);
//! 3. δ_ij = −K_ij α̂_j; ε_xy = ε_xy0 + δ_xy, ε_xz = ε_xz0 − δ_xz, and so on round the axes: Eq. (6) with
//!    the tilt of gyro i about axis j as a right-hand rotation;
//! 4. case increment = M(ε) v, Eq. (7);
//! 5. rotation vector over N periods by two-speed coning (`coning`).
//!
//! The first period has no pickoff reading before it: it primes the strip and contributes no rotation. The
//! second has no increment before it: its α̂ is zero.
//!
//! Independent of the firmware core and of the simulator: it imports neither.
//!
//! Deliberately not here: any rounding. Numbers are f64 from end to end.

pub mod acceleration;
pub mod coning;

use acceleration::Acceleration;
use coning::Coning;
use nalgebra::{Matrix3, Vector3};

/// Six numbers ij, gyro i and axis j.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[allow(missing_docs)]
pub struct Six {
    pub xy: f64,
    pub xz: f64,
    pub yx: f64,
    pub yz: f64,
    pub zx: f64,
    pub zy: f64,
}

/// What the chain is told about the triad.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Calibration {
    /// b \[rad/s\].
    pub bias_rad_s: [f64; 3],
    /// s of Eq. (7) \[1\].
    pub scale_error: [f64; 3],
    /// ε_ij0 \[rad\].
    pub installation_rad: Six,
    /// K_ij \[s²\].
    pub flexure_s2: Six,
    /// Block angle over pickoff angle \[1\].
    pub pickoff_gain: [f64; 3],
    /// T \[s\].
    pub period_s: f64,
    /// N \[periods\].
    pub periods_per_output: usize,
    /// Terms of the acceleration filter, 1 to 4.
    pub acceleration_order: usize,
}

/// What one period gives.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Step {
    /// Case increment \[rad\], body frame.
    pub case_rad: Vector3<f64>,
    /// Rotation vector over the last N periods \[rad\], body frame at their start; at every N-th period.
    pub rotation_rad: Option<Vector3<f64>>,
}

/// The chain and what it remembers.
#[derive(Debug, Clone)]
pub struct ReferenceChain {
    calibration: Calibration,
    pickoff_before_rad: Option<Vector3<f64>>,
    acceleration: Acceleration,
    coning: Coning,
}

impl ReferenceChain {
    /// Before the first period.
    pub fn new(calibration: &Calibration) -> Self {
        Self {
            calibration: *calibration,
            pickoff_before_rad: None,
            acceleration: Acceleration::new(calibration.acceleration_order),
            coning: Coning::new(calibration.periods_per_output),
        }
    }

    /// One period.
    pub fn process(&mut self, sensed_rad: [f64; 3], pickoff_rad: [f64; 3]) -> Step {
        let pickoff = Vector3::from(pickoff_rad);
        let case_rad = match self.pickoff_before_rad.replace(pickoff) {
            None => Vector3::zeros(),
            Some(before) => self.case_increment(sensed_rad.into(), pickoff - before),
        };
        Step {
            case_rad,
            rotation_rad: self.coning.add(case_rad),
        }
    }

    fn case_increment(
        &mut self,
        sensed_rad: Vector3<f64>,
        pickoff_step_rad: Vector3<f64>,
    ) -> Vector3<f64> {
        let known = &self.calibration;
        let stripped =
            sensed_rad - Vector3::from(known.pickoff_gain).component_mul(&pickoff_step_rad);
        let v = stripped
            - Vector3::from(known.scale_error).component_mul(&stripped)
            - Vector3::from(known.bias_rad_s) * known.period_s;

        let at_rest = known.installation_rad;
        let turn_per_period2 = self.acceleration.add(equation_7(&at_rest) * v);
        let alpha_rad_s2 = turn_per_period2 / known.period_s.powi(2);
        equation_7(&equation_6(&at_rest, &known.flexure_s2, &alpha_rad_s2)) * v
    }
}

/// ε_ij of Eq. (6) with δ_ij = −K_ij α_j in the tilt convention.
fn equation_6(at_rest: &Six, flexure_s2: &Six, alpha_rad_s2: &Vector3<f64>) -> Six {
    let (ax, ay, az) = (alpha_rad_s2.x, alpha_rad_s2.y, alpha_rad_s2.z);
    Six {
        xy: at_rest.xy - flexure_s2.xy * ay,
        xz: at_rest.xz + flexure_s2.xz * az,
        yz: at_rest.yz - flexure_s2.yz * az,
        yx: at_rest.yx + flexure_s2.yx * ax,
        zx: at_rest.zx - flexure_s2.zx * ax,
        zy: at_rest.zy + flexure_s2.zy * ay,
    }
}

/// The matrix of Eq. (7): case from sensed.
fn equation_7(eps: &Six) -> Matrix3<f64> {
    Matrix3::new(
        1.0, eps.xz, eps.xy, //
        eps.yz, 1.0, eps.yx, //
        eps.zy, eps.zx, 1.0,
    )
}
