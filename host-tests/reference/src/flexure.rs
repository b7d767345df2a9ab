//! Computes tilts of the sensing axes that are not in proportion to the acceleration: cubic and resonant flexure.
//!
//! From α̂T² \[rad per period²\] it forms δ_ij \[rad\], right-hand rotations of gyro i's sensing axis about body axis j:
//!
//! ```text
//! −Q_ij (α̂_j³ − 3σ_j² α̂_j)        and δ_ij of δ″ + 2ζΩ₀ δ′ + Ω₀² δ = −Ω₀² K_ij α_j
//! ```
//!
//! σ² is the variance of α̂ by quantisation to whole pulses, independent at every period's end and uniform, so that
//! α̂³ − 3σ²α̂ is right in the mean.
//!
//! The mode is b(z)/a(z) on α̂ per axis, a(z) with the poles e^{(−ζ ± i√(1−ζ²)) x₀} of its impulse response, x₀ = Ω₀T. The
//! product of δ and D must rectify as that of S(iΩ)α and ω does, so that b(e^{ix})/a(e^{ix}) Â(x) = S(ix) i x (x/2 / sin(x/2))²
//! with Â(x) = Σ_p c_p (1 − e^{−ipx}): demanded at x → 0 and at x = 0.1.

use nalgebra::{Complex, Matrix3, Vector3};

use crate::Six;
use crate::acceleration::coefficients;

/// A suspension's mode.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ModeCalibration {
    /// K \[s²\].
    pub flexure_s2: Six,
    /// Ω₀/2π \[Hz\]; 0: no mode.
    pub frequency_hz: f64,
    /// ζ \[1\].
    pub damping: f64,
}

/// What the tilts depend on.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct FlexureCalibration {
    /// Q \[s⁶/rad²\].
    pub cubic: Six,
    /// The mode.
    pub mode: ModeCalibration,
    /// Angle of a pulse \[rad\].
    pub pulse_rad: [f64; 3],
}

/// x at which the mode is matched \[rad per period\].
const MATCHED_AT_RAD: f64 = 0.1;

#[derive(Debug, Clone)]
struct Mode {
    numerator: [f64; 3],
    denominator: [f64; 2],
    inputs: [Vector3<f64>; 2],
    outputs: [Vector3<f64>; 2],
}

impl Mode {
    fn new(known: &ModeCalibration, period_s: f64, order: usize) -> Self {
        let turn = std::f64::consts::TAU * known.frequency_hz * period_s;
        let pole =
            (Complex::new(-known.damping, (1.0 - known.damping.powi(2)).sqrt()) * turn).exp();
        let denominator = [-2.0 * pole.re, pole.norm_sqr()];
        let x = MATCHED_AT_RAD;
        let back = |p: usize| Complex::new(0.0, -x * p as f64).exp();
        let filter: Complex<f64> = coefficients(order)
            .iter()
            .enumerate()
            .map(|(at, c)| (Complex::new(1.0, 0.0) - back(at + 1)) * *c)
            .sum();
        let rate = Complex::new(0.0, x * (0.5 * x / (0.5 * x).sin()).powi(2));
        let s = Complex::new(0.0, x);
        let response = turn.powi(2) / (s * s + s * (2.0 * known.damping * turn) + turn.powi(2));
        let wanted =
            response * rate / filter * (back(1) * denominator[0] + back(2) * denominator[1] + 1.0);
        let conditions = Matrix3::new(
            1.0,
            1.0,
            1.0, //
            1.0,
            back(1).re,
            back(2).re, //
            0.0,
            back(1).im,
            back(2).im,
        );
        let at_rest = 1.0 + denominator[0] + denominator[1];
        let solution = conditions
            .lu()
            .solve(&Vector3::new(at_rest, wanted.re, wanted.im))
            // x = 0.1 is neither 0 nor π
            .expect("three independent conditions");
        Self {
            numerator: solution.into(),
            denominator,
            inputs: [Vector3::zeros(); 2],
            outputs: [Vector3::zeros(); 2],
        }
    }

    fn add(&mut self, now: Vector3<f64>) -> Vector3<f64> {
        let ([b0, b1, b2], [a1, a2]) = (self.numerator, self.denominator);
        let out = now * b0 + self.inputs[0] * b1 + self.inputs[1] * b2
            - self.outputs[0] * a1
            - self.outputs[1] * a2;
        self.inputs = [now, self.inputs[0]];
        self.outputs = [out, self.outputs[0]];
        out
    }
}

/// Both flexures with what the mode remembers.
#[derive(Debug, Clone)]
pub struct Flexure {
    known: FlexureCalibration,
    period_s: f64,
    order: usize,
    mode: Option<Mode>,
    variance: Vector3<f64>,
}

impl Flexure {
    /// At rest.
    pub fn new(known: &FlexureCalibration, period_s: f64, order: usize) -> Self {
        let c = coefficients(order);
        // α̂T² is Σ w_q e_{k−q} of the angles' errors e, w the differences of what multiplies D_{k−p}.
        let mut of_increments: Vec<f64> = c.iter().map(|c| -c).collect();
        of_increments.insert(0, c.iter().sum());
        of_increments.push(0.0);
        let squares = of_increments[0].powi(2)
            + of_increments
                .windows(2)
                .map(|pair| (pair[1] - pair[0]).powi(2))
                .sum::<f64>();
        let mut made = Self {
            known: *known,
            period_s,
            order,
            mode: None,
            variance: Vector3::from(known.pulse_rad)
                .map(|pulse| squares * pulse.powi(2) / 12.0 / period_s.powi(4)),
        };
        made.forget();
        made
    }

    /// Takes the suspension to be at rest again.
    pub fn forget(&mut self) {
        let mode = &self.known.mode;
        self.mode = (mode.frequency_hz > 0.0).then(|| Mode::new(mode, self.period_s, self.order));
    }

    /// δ_ij with this α̂T² the latest.
    pub fn add(&mut self, turn_per_period2: Vector3<f64>) -> Six {
        let alpha = turn_per_period2 / self.period_s.powi(2);
        let cubed = alpha.map(|a| a.powi(3)) - 3.0 * self.variance.component_mul(&alpha);
        let bent = (self.mode.as_mut()).map_or(Vector3::zeros(), |mode| mode.add(alpha));
        let (q, k) = (&self.known.cubic, &self.known.mode.flexure_s2);
        let delta = |q: f64, k: f64, axis: usize| -q * cubed[axis] - k * bent[axis];
        Six {
            xy: delta(q.xy, k.xy, 1),
            xz: delta(q.xz, k.xz, 2),
            yx: delta(q.yx, k.yx, 0),
            yz: delta(q.yz, k.yz, 2),
            zx: delta(q.zx, k.zx, 0),
            zy: delta(q.zy, k.zy, 1),
        }
    }
}
