//! Bodies that move in closed form, the readings of their sensors, and their velocity by a navigation computer.
//!
//! From attitude, rate, angular acceleration and force as functions of time it makes the samples of a chain with
//! negligible quantisation, and from frames the velocity in space. Units are rad, m and s; nothing is copied from the
//! chain.

use nalgebra::{Rotation3, Vector3};
use trueaxis::parameters::AccelerometerParameters;
use trueaxis::{OUTPUT_M_S_PER_CODE, OutputFrame, Parameters, Sample};

pub type Vector = Vector3<f64>;

/// \[Hz\]
pub const RATE_HZ: f64 = 4000.0;

/// Standard gravity \[m/s²\].
pub const G: f64 = 9.806_65;

/// 2⁻³⁴ rad: the finest pulses the chain takes.
const PULSE_RAD: f64 = 1.0 / (1u64 << 34) as f64;

/// The finest codes the chain takes \[m/s\].
pub const CODE_M_S: f64 = 1e-9;

/// Five points of Gauss and Legendre: exact to the ninth power of time within a sample.
const NODES: [(f64, f64); 5] = [
    (-0.906_179_845_938_664, 0.236_926_885_056_189),
    (-0.538_469_310_105_683, 0.478_628_670_499_366),
    (0.0, 0.568_888_888_888_889),
    (0.538_469_310_105_683, 0.478_628_670_499_366),
    (0.906_179_845_938_664, 0.236_926_885_056_189),
];

/// A body's motion; all vectors of the body frame.
pub struct Motion {
    /// Space from body.
    pub attitude: Box<dyn Fn(f64) -> Rotation3<f64>>,
    /// ω \[rad/s\].
    pub rate: Box<dyn Fn(f64) -> Vector>,
    /// α = dω/dt \[rad/s²\].
    pub acceleration: Box<dyn Fn(f64) -> Vector>,
    /// Specific force at the body's origin \[m/s²\].
    pub force: Box<dyn Fn(f64) -> Vector>,
}

/// Coning of half angle φ at Ω about x, attitude q = (cos φ/2, 0, sin φ/2 cos Ωt, sin φ/2 sin Ωt).
#[derive(Clone, Copy)]
pub struct Cone {
    /// Ω \[rad/s\].
    pub omega: f64,
    /// φ \[rad\].
    pub angle: f64,
}

impl Cone {
    pub fn attitude(self, t: f64) -> Rotation3<f64> {
        let (sin, cos) = (self.omega * t).sin_cos();
        Rotation3::new(Vector::new(0.0, cos, sin) * self.angle)
    }

    pub fn rate(self, t: f64) -> Vector {
        let (sin, cos) = (self.omega * t).sin_cos();
        let along = -2.0 * (0.5 * self.angle).sin().powi(2);
        let across = self.angle.sin();
        Vector::new(along, -across * sin, across * cos) * self.omega
    }

    pub fn acceleration(self, t: f64) -> Vector {
        let (sin, cos) = (self.omega * t).sin_cos();
        Vector::new(0.0, -cos, -sin) * self.angle.sin() * self.omega * self.omega
    }
}

/// ∫ over sample k, which ends at k T.
fn over(k: i64, rate_hz: f64, f: impl Fn(f64) -> Vector) -> Vector {
    NODES
        .iter()
        .map(|(node, weight)| f((k as f64 - 0.5 + 0.5 * node) / rate_hz) * (0.5 * weight))
        .sum::<Vector>()
        / rate_hz
}

/// Codes of running sums.
struct Codes {
    per_unit: f64,
    running: Vector,
    given: [i64; 3],
}

impl Codes {
    fn of(per_unit: f64) -> Self {
        Self {
            per_unit,
            running: Vector::zeros(),
            given: [0; 3],
        }
    }

    fn next(&mut self, increment: Vector) -> [i32; 3] {
        self.running += increment * self.per_unit;
        [0, 1, 2].map(|axis| {
            let code = self.running[axis].round() as i64 - self.given[axis];
            self.given[axis] += code;
            i32::try_from(code).expect("no more codes than a counter holds")
        })
    }
}

impl Motion {
    /// The sample that ends at 0, which only primes, and `samples` after it; accelerometer i at row i of
    /// `arms_m`.
    pub fn samples(&self, arms_m: [[f64; 3]; 3], samples: i64) -> Vec<Sample> {
        self.samples_at(RATE_HZ, arms_m, samples)
    }

    /// The same at another sample rate.
    pub fn samples_at(&self, rate_hz: f64, arms_m: [[f64; 3]; 3], samples: i64) -> Vec<Sample> {
        let felt = |t: f64| {
            let (rate, acceleration) = ((self.rate)(t), (self.acceleration)(t));
            let at_origin = (self.force)(t);
            Vector::from_fn(|axis, _| {
                let arm = Vector::from(arms_m[axis]);
                let moved = acceleration.cross(&arm) + rate.cross(&rate.cross(&arm));
                at_origin[axis] + moved[axis]
            })
        };
        let mut angle = Codes::of(1.0 / PULSE_RAD);
        let mut velocity = Codes::of(1.0 / CODE_M_S);
        (0..=samples)
            .map(|k| match k {
                0 => Sample::default(),
                _ => Sample {
                    pulse_counts: angle.next(over(k, rate_hz, &self.rate)),
                    pickoff_codes: [0; 3],
                    accelerometer_codes: velocity.next(over(k, rate_hz, felt)),
                },
            })
            .collect()
    }
}

/// Parameters of a unit with these arms and no other error.
pub fn parameters(arms_m: [[f64; 3]; 3]) -> Parameters {
    Parameters::default().with(|p| {
        p.pulse_weight_rad = [PULSE_RAD; 3];
        p.sample_rate_hz = RATE_HZ;
        p.samples_per_output = 10;
        p.accelerometers = Some(AccelerometerParameters {
            weight_m_s: [CODE_M_S; 3],
            bias_m_s2: [0.0; 3],
            scale_error: [0.0; 3],
            misalignment_rad: Default::default(),
            lever_arm_m: arms_m,
        });
    })
}

/// A navigation computer that is given the attitude (space from body, at time t), so that velocity alone is tested:
/// velocity in space at each frame's end.
pub fn navigate(attitude: impl Fn(f64) -> Rotation3<f64>, frames: &[OutputFrame]) -> Vec<Vector> {
    navigate_at(RATE_HZ, 10, attitude, frames)
}

/// The same with other rates of samples and of frames.
pub fn navigate_at(
    rate_hz: f64,
    samples_per_output: u16,
    attitude: impl Fn(f64) -> Rotation3<f64>,
    frames: &[OutputFrame],
) -> Vec<Vector> {
    let mut velocity_m_s = Vector::zeros();
    frames
        .iter()
        .map(|frame| {
            let gained = Vector::from(frame.dvel_codes.map(f64::from)) * OUTPUT_M_S_PER_CODE;
            // The first frame begins with the sample that primes, which ends at 0.
            let before = f64::from(samples_per_output) * f64::from(frame.sequence);
            let start_s = (before - 1.0).max(0.0) / rate_hz;
            velocity_m_s += attitude(start_s) * gained;
            velocity_m_s
        })
        .collect()
}
