//! Computes the pulse counts of three gyros with tilting axes, and their pickoff codes.
//!
//! Gyro x senses M⁻¹ω + δ_xz ω_y − δ_xy ω_z + bias (y: δ_yx ω_z − δ_yz ω_x, z: δ_zy ω_x − δ_zx ω_y), over one less the scale
//! error, plus the motion of its own block. The pulses of a period are the change of the whole part of that angle over the
//! pulse weight.

use std::f64::consts::TAU;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use trueaxis::{CrossAxis, Sample};

use super::tilt::{Flexure, Tilt};
use super::{Substep, Vector, WEIGHTS};

/// The mechanical dither of the three blocks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BlockDither {
    /// Frequencies \[Hz\].
    pub frequency_hz: Vector,
    /// Mean amplitude of the block's angle relative to the case \[rad\].
    pub amplitude_rad: Vector,
    /// Each cycle's amplitude is uniform within this share of the mean, either side \[1\].
    pub spread: f64,
    /// Seed of the amplitudes.
    pub seed: u64,
}

impl BlockDither {
    /// 150″ at 371.3, 403.9 and 438.7 Hz, a third more or less in each cycle.
    pub fn usual(seed: u64) -> Self {
        Self {
            frequency_hz: [371.3, 403.9, 438.7],
            amplitude_rad: [7.27e-4; 3],
            spread: 1.0 / 3.0,
            seed,
        }
    }
}

/// A triad as built.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Unit {
    /// Response of its axes' tilts.
    pub flexure: Flexure,
    /// ε_ij0 of M = \[\[1, xz, xy\], \[yz, 1, yx\], \[zy, zx, 1\]\], Eq. (7) at rest \[rad\].
    pub installation_rad: CrossAxis<f64>,
    /// Bias \[rad/s\].
    pub bias_rad_s: Vector,
    /// Scale error \[1\].
    pub scale_error: Vector,
    /// Angle of one pulse \[rad\].
    pub pulse_weight_rad: Vector,
    /// Block angle over pickoff angle \[1\].
    pub pickoff_gain: Vector,
    /// Angle of one pickoff code \[rad\].
    pub pickoff_weight_rad: f64,
    /// The dither, if any.
    pub dither: Option<BlockDither>,
}

impl Unit {
    /// A perfect, stiff triad without dither and with pulses of 2⁻³⁴ rad: "without pulses".
    pub fn fine() -> Self {
        Self {
            flexure: Flexure::default(),
            installation_rad: CrossAxis::default(),
            bias_rad_s: [0.0; 3],
            scale_error: [0.0; 3],
            pulse_weight_rad: [1.0 / (1u64 << 34) as f64; 3],
            pickoff_gain: [1.0; 3],
            pickoff_weight_rad: 1.0 / (1u64 << 32) as f64,
            dither: None,
        }
    }

    /// The same triad dithered, with pulses of about 0.8″.
    pub fn dithered(seed: u64) -> Self {
        Self {
            pulse_weight_rad: [3.878e-6, 3.913e-6, 3.851e-6],
            dither: Some(BlockDither::usual(seed)),
            ..Self::fine()
        }
    }

    /// This unit after `change`.
    #[must_use]
    pub fn with(mut self, change: impl FnOnce(&mut Self)) -> Self {
        change(&mut self);
        self
    }
}

/// The unit in motion.
pub struct SensingBlock {
    unit: Unit,
    step_s: f64,
    from_body: [Vector; 3],
    /// In the order xy, xz, yx, yz, zx, zy.
    tilts: [Tilt; 6],
    blocks: [Option<Swing>; 3],
    /// Sensed angle that no pulse has counted yet \[rad\].
    rest_rad: Vector,
    periods: usize,
}

impl SensingBlock {
    /// The unit at rest, to be moved in substeps of this length \[s\].
    pub fn new(unit: &Unit, step_s: f64) -> Self {
        let e = unit.installation_rad;
        Self {
            unit: *unit,
            step_s,
            from_body: inverse([[1.0, e.xz, e.xy], [e.yz, 1.0, e.yx], [e.zy, e.zx, 1.0]]),
            tilts: [0, 1, 2, 3, 4, 5].map(|pair| Tilt::new(&unit.flexure, pair, step_s)),
            blocks: [0, 1, 2].map(|axis| unit.dither.map(|dither| Swing::new(&dither, axis))),
            rest_rad: [0.0; 3],
            periods: 0,
        }
    }

    /// The sample of the period that these substeps make up.
    pub fn sense(&mut self, substeps: &[Substep]) -> Sample {
        let (mut body, mut tilted) = ([0.0; 3], [0.0; 3]);
        for substep in substeps {
            let about = |axis: usize| substep.acceleration.map(|alpha| alpha[axis]);
            let [xy, xz, yx, yz, zx, zy] = &mut self.tilts;
            let (xy, xz) = (xy.step(about(1)), xz.step(about(2)));
            let (yx, yz) = (yx.step(about(0)), yz.step(about(2)));
            let (zx, zy) = (zx.step(about(0)), zy.step(about(1)));
            for node in 0..3 {
                let weight = WEIGHTS[node] * self.step_s;
                let [x, y, z] = substep.rate[node];
                for (sum, rate) in body.iter_mut().zip([x, y, z]) {
                    *sum += weight * rate;
                }
                tilted[0] += weight * (xz[node] * y - xy[node] * z);
                tilted[1] += weight * (yx[node] * z - yz[node] * x);
                tilted[2] += weight * (zy[node] * x - zx[node] * y);
            }
        }
        let period_s = self.step_s * substeps.len() as f64;
        self.periods += 1;
        let end_s = self.periods as f64 * period_s;
        let mut sample = Sample::default();
        for (i, tilted) in tilted.into_iter().enumerate() {
            let aligned: f64 = (0..3).map(|j| self.from_body[i][j] * body[j]).sum();
            let sensed = aligned + tilted + self.unit.bias_rad_s[i] * period_s;
            self.rest_rad[i] += sensed / (1.0 - self.unit.scale_error[i]);
            if let Some(block) = &mut self.blocks[i] {
                let before = block.angle_rad;
                block.move_to(end_s);
                self.rest_rad[i] += block.angle_rad - before;
                let code = self.unit.pickoff_gain[i] * self.unit.pickoff_weight_rad;
                sample.pickoff_codes[i] = (block.angle_rad / code).round() as i32;
            }
            let pulse = self.unit.pulse_weight_rad[i];
            let pulses = (self.rest_rad[i] / pulse).floor();
            self.rest_rad[i] -= pulses * pulse;
            sample.pulse_counts[i] = pulses as i32;
        }
        sample
    }
}

/// One block's swing relative to the case.
struct Swing {
    frequency_hz: f64,
    amplitude_rad: f64,
    spread: f64,
    random: ChaCha8Rng,
    /// Number of the cycle, and its amplitude \[rad\].
    cycle: f64,
    amplitude_now_rad: f64,
    angle_rad: f64,
}

impl Swing {
    fn new(dither: &BlockDither, axis: usize) -> Self {
        Self {
            frequency_hz: dither.frequency_hz[axis],
            amplitude_rad: dither.amplitude_rad[axis],
            spread: dither.spread,
            random: ChaCha8Rng::seed_from_u64(
                dither.seed.wrapping_mul(3).wrapping_add(axis as u64),
            ),
            cycle: -1.0,
            amplitude_now_rad: 0.0,
            angle_rad: 0.0,
        }
    }

    /// A new amplitude begins where the sine passes zero: the angle has no step.
    fn move_to(&mut self, time_s: f64) {
        let turns = self.frequency_hz * time_s;
        while self.cycle < turns.floor() {
            self.cycle += 1.0;
            let share = 2.0 * self.random.random::<f64>() - 1.0;
            self.amplitude_now_rad = self.amplitude_rad * (1.0 + self.spread * share);
        }
        self.angle_rad = self.amplitude_now_rad * (TAU * turns.fract()).sin();
    }
}

/// The inverse of a matrix close to 1, by rows: adjugate over determinant.
fn inverse(m: [Vector; 3]) -> [Vector; 3] {
    use super::attitude::cross;
    let columns = [cross(m[1], m[2]), cross(m[2], m[0]), cross(m[0], m[1])];
    let determinant: f64 = (0..3).map(|i| m[0][i] * columns[0][i]).sum();
    [0, 1, 2].map(|row| [0, 1, 2].map(|column| columns[column][row] / determinant))
}
