//! Computes the excess rate of the gyros by tilts of the sensing axes under angular acceleration.
//!
//! From the case's increments D \[rad\] it forms, three periods late, the tilts δ_ij \[rad\], right-hand rotations of
//! gyro i's sensing axis about body axis j, and their addition to the increments about the sensing axes \[rad\]:
//!
//! ```text
//! δ_ij = −K_ij α_j  −Q_ij (α_j³ − 3σ_j² α_j)  and those of δ″ + 2ζΩ₀ δ′ + Ω₀² δ = −Ω₀² K_ij α_j
//! x: δ_xz D_y − δ_xy D_z      y: δ_yx D_z − δ_yz D_x      z: δ_zy D_x − δ_zx D_y
//! ```
//!
//! A mode has a frequency of its own, or the one that its K implies, Ω₀ = 1/√K_ij.
//!
//! σ² is the variance of α̂ by quantisation to whole pulses, independent at every period's end and uniform, so that
//! α̂³ − 3σ²α̂ is right in the mean.
//!
//! A mode is b(z)/a(z) on α̂, a(z) with the poles e^{(−ζ ± i√(1−ζ²)) x₀} of its impulse response, x₀ = Ω₀T. The
//! product of δ and D must rectify as that of S(iΩ)α and ω does, so that b(e^{ix})/a(e^{ix}) Â(x) = S(ix) x (x/2 / sin(x/2))²
//! with Â(x) = 2 Σ_p a_p sin(px): demanded at x → 0 and at x = 0.1 and 0.35. This is the mode itself, where the chain under test
//! has an approximation without memory.

use nalgebra::{Complex, DMatrix, DVector, Vector3};

use crate::Six;
use crate::acceleration::{Central, PAIRS, central_coefficients};

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

/// Calibration of the tilts.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct FlexureCalibration {
    /// K \[s²\].
    pub linear_s2: Six,
    /// ζ of the mode that each K of the linear flexure implies \[1\]; none: it follows at once.
    pub damping: Option<f64>,
    /// Q \[s⁶/rad²\].
    pub cubic: Six,
    /// A mode of its own frequency.
    pub mode: ModeCalibration,
    /// Angle of a pulse \[rad\].
    pub pulse_rad: [f64; 3],
}

/// x at which modes are matched, in addition to 0 \[rad per period\].
const MATCHED_AT_RAD: [f64; 2] = [0.1, 0.35];

/// Axis whose acceleration bends each pair xy, xz, yx, yz, zx, zy.
const AXIS_OF_PAIR: [usize; 6] = [1, 2, 0, 2, 0, 1];

/// The tilt of one pair by its mode.
#[derive(Debug, Clone)]
struct Mode {
    numerator: [f64; 5],
    denominator: [f64; 2],
    inputs: [f64; 4],
    outputs: [f64; 2],
}

impl Mode {
    /// Of Ω₀T = `turn`.
    fn new(turn: f64, damping: f64) -> Self {
        let one = Complex::new(1.0, 0.0);
        let pole = (Complex::new(-damping, (1.0 - damping.powi(2)).sqrt()) * turn).exp();
        let denominator = [-2.0 * pole.re, pole.norm_sqr()];
        let mut conditions = DMatrix::zeros(5, 5);
        let mut wanted = DVector::zeros(5);
        for tap in 0..5 {
            conditions[(0, tap)] = 1.0;
        }
        wanted[0] = 1.0 + denominator[0] + denominator[1];
        for (at, x) in MATCHED_AT_RAD.into_iter().enumerate() {
            let back = |p: usize| Complex::new(0.0, -x * p as f64).exp();
            let pairs = central_coefficients().into_iter().zip(1..);
            let formed: f64 = pairs.map(|(a, p)| 2.0 * a * (f64::from(p) * x).sin()).sum();
            let product = x * (0.5 * x / (0.5 * x).sin()).powi(2);
            let s = Complex::new(0.0, x);
            let response = turn.powi(2) / (s * s + s * (2.0 * damping * turn) + turn.powi(2));
            let all = response
                * (product / formed)
                * (one + back(1) * denominator[0] + back(2) * denominator[1]);
            for tap in 0..5 {
                conditions[(1 + 2 * at, tap)] = back(tap).re;
                conditions[(2 + 2 * at, tap)] = back(tap).im;
            }
            wanted[1 + 2 * at] = all.re;
            wanted[2 + 2 * at] = all.im;
        }
        let solution = conditions
            .lu()
            .solve(&wanted)
            // the three frequencies differ
            .expect("five independent conditions");
        Self {
            numerator: [0, 1, 2, 3, 4].map(|tap| solution[tap]),
            denominator,
            inputs: [0.0; 4],
            outputs: [0.0; 2],
        }
    }

    fn add(&mut self, now: f64) -> f64 {
        let [one, two, three, four] = self.inputs;
        let inputs = [now, one, two, three, four];
        let [a1, a2] = self.denominator;
        let forward: f64 = self.numerator.iter().zip(inputs).map(|(b, u)| b * u).sum();
        let out = forward - self.outputs[0] * a1 - self.outputs[1] * a2;
        self.inputs = [now, one, two, three];
        self.outputs = [out, self.outputs[0]];
        out
    }
}

/// All flexures with their states.
#[derive(Debug, Clone)]
pub struct Flexure {
    known: FlexureCalibration,
    period_s: f64,
    central: Central,
    /// Of the linear flexure, and those of their own frequency, by pair.
    implied: [Option<Mode>; 6],
    own: [Option<Mode>; 6],
    variance: Vector3<f64>,
}

impl Flexure {
    /// At rest.
    pub fn new(known: &FlexureCalibration, period_s: f64) -> Self {
        // α̂T² is Σ w_q e_{k−q} of the angles' errors e, w the differences of the factors of D_{k+3} … D_{k−3}.
        let a = central_coefficients();
        let of_increments: Vec<f64> = (0..=2 * PAIRS as i32 + 2)
            .map(|at| match at - 1 - PAIRS as i32 {
                p if (1..=PAIRS as i32).contains(&p) => a[p as usize - 1],
                p if (-(PAIRS as i32)..0).contains(&p) => -a[-p as usize - 1],
                _ => 0.0,
            })
            .collect();
        let squares: f64 = of_increments
            .windows(2)
            .map(|pair| (pair[1] - pair[0]).powi(2))
            .sum();
        let mut made = Self {
            known: *known,
            period_s,
            central: Central::default(),
            implied: Default::default(),
            own: Default::default(),
            variance: Vector3::from(known.pulse_rad)
                .map(|pulse| squares * pulse.powi(2) / 12.0 / period_s.powi(4)),
        };
        made.forget();
        made
    }

    /// Takes the suspension to be at rest again, and the rate before the next increment to be its own.
    pub fn forget(&mut self) {
        self.central = Central::default();
        let (known, period_s) = (&self.known, self.period_s);
        self.implied = pairs(&known.linear_s2).map(|k| match known.damping {
            Some(damping) if k > 0.0 => Some(Mode::new(period_s / k.sqrt(), damping)),
            _ => None,
        });
        let mode = &known.mode;
        let turn = std::f64::consts::TAU * mode.frequency_hz * period_s;
        let own = (mode.frequency_hz > 0.0).then(|| Mode::new(turn, mode.damping));
        self.own = std::array::from_fn(|_| own.clone());
    }

    /// Returns the gyros' excess angle in the period three before the latest \[rad\]; `increment_rad` is the case's latest.
    pub fn add(&mut self, increment_rad: Vector3<f64>) -> Vector3<f64> {
        let centred = self.central.add(increment_rad);
        let alpha = centred.turn_per_period2 / self.period_s.powi(2);
        let cubed = alpha.map(|a| a.powi(3)) - 3.0 * self.variance.component_mul(&alpha);
        let known = &self.known;
        let (linear, cubic) = (pairs(&known.linear_s2), pairs(&known.cubic));
        let resonant = pairs(&known.mode.flexure_s2);
        let tilts: [f64; 6] = std::array::from_fn(|pair| {
            let axis = AXIS_OF_PAIR[pair];
            let of = |mode: &mut Option<Mode>, or: f64| {
                mode.as_mut().map_or(or, |mode| mode.add(alpha[axis]))
            };
            let followed = of(&mut self.implied[pair], alpha[axis]);
            let rung = of(&mut self.own[pair], 0.0);
            -linear[pair] * followed - cubic[pair] * cubed[axis] - resonant[pair] * rung
        });
        let [xy, xz, yx, yz, zx, zy] = tilts;
        let d = centred.increment_rad;
        Vector3::new(
            xz * d.y - xy * d.z,
            yx * d.z - yz * d.x,
            zy * d.x - zx * d.y,
        )
    }
}

fn pairs(six: &Six) -> [f64; 6] {
    [six.xy, six.xz, six.yx, six.yz, six.zx, six.zy]
}
