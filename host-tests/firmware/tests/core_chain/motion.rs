//! Motions known in closed form, and the counts of a dithered triad under them.

use trueaxis::{CrossAxis, FlexureResponse, Parameters, Sample};

/// Body rate and its derivative \[rad/s, rad/s²\] at t \[s\].
pub trait Motion {
    fn rate(&self, t: f64) -> [f64; 3];
    fn acceleration(&self, t: f64) -> [f64; 3];
}

/// Rotation vector φ (0, cos Ωt, sin Ωt): coning about x, with the rate that follows exactly.
pub struct Coning {
    pub frequency_hz: f64,
    pub angle_rad: f64,
}

impl Coning {
    pub fn omega(&self) -> f64 {
        std::f64::consts::TAU * self.frequency_hz
    }

    /// Attitude at t as a unit quaternion w, x, y, z.
    pub fn attitude(&self, t: f64) -> [f64; 4] {
        let (sin, cos) = (self.omega() * t).sin_cos();
        let (half_sin, half_cos) = (self.angle_rad / 2.0).sin_cos();
        [half_cos, 0.0, half_sin * cos, half_sin * sin]
    }
}

impl Motion for Coning {
    fn rate(&self, t: f64) -> [f64; 3] {
        let omega = self.omega();
        let (sin, cos) = (omega * t).sin_cos();
        let side = omega * self.angle_rad.sin();
        let along = -omega * (1.0 - self.angle_rad.cos());
        [along, -side * sin, side * cos]
    }
    fn acceleration(&self, t: f64) -> [f64; 3] {
        let omega = self.omega();
        let (sin, cos) = (omega * t).sin_cos();
        let side = omega * omega * self.angle_rad.sin();
        [0.0, -side * cos, -side * sin]
    }
}

/// A constant rate \[rad/s\].
pub struct Slew(pub [f64; 3]);

impl Motion for Slew {
    fn rate(&self, _: f64) -> [f64; 3] {
        self.0
    }
    fn acceleration(&self, _: f64) -> [f64; 3] {
        [0.0; 3]
    }
}

/// A rate about y and z whose direction turns about x, either way: coning without the small drift.
pub struct Turning {
    pub frequency_hz: f64,
    pub rate_rad_s: f64,
}

impl Motion for Turning {
    fn rate(&self, t: f64) -> [f64; 3] {
        let (sin, cos) = (std::f64::consts::TAU * self.frequency_hz * t).sin_cos();
        [0.0, self.rate_rad_s * cos, self.rate_rad_s * sin]
    }
    fn acceleration(&self, t: f64) -> [f64; 3] {
        let omega = std::f64::consts::TAU * self.frequency_hz;
        let (sin, cos) = (omega * t).sin_cos();
        [
            0.0,
            -omega * self.rate_rad_s * sin,
            omega * self.rate_rad_s * cos,
        ]
    }
}

/// Two motions at once: for the gyros their rates add.
pub struct Both<A, B>(pub A, pub B);

impl<A: Motion, B: Motion> Motion for Both<A, B> {
    fn rate(&self, t: f64) -> [f64; 3] {
        let (a, b) = (self.0.rate(t), self.1.rate(t));
        [0, 1, 2].map(|i| a[i] + b[i])
    }
    fn acceleration(&self, t: f64) -> [f64; 3] {
        let (a, b) = (self.0.acceleration(t), self.1.acceleration(t));
        [0, 1, 2].map(|i| a[i] + b[i])
    }
}

/// The paper's Table 3 \[s²\].
pub const TABLE_3_S2: CrossAxis<f64> = CrossAxis {
    xy: 6.9e-8,
    xz: 7.1e-8,
    yx: 7.5e-8,
    yz: 7.3e-8,
    zx: 6.7e-8,
    zy: 7.6e-8,
};

/// Pulses of 2⁻³⁴ rad, no dither: counts that hold the motion to 6e-11 rad, for tests of the algorithm. Blocks follow
/// the acceleration at once, as those of [`stream`] do.
pub fn fine() -> Parameters {
    Parameters::default().with(|p| {
        p.pulse_weight_rad = [1.0 / (1u64 << 34) as f64; 3];
        p.flexure_response = FlexureResponse::Static;
    })
}

/// An instrument as built: pulses of 0.8″, bias, scale, installation, gains, the paper's flexure.
pub fn as_built() -> Parameters {
    Parameters::default().with(|p| {
        p.pulse_weight_rad = [3.878e-6, 3.913e-6, 3.851e-6];
        p.bias_rad_s = [2.1e-8, -3.3e-8, 4.7e-8];
        p.scale_error = [7e-6, -4e-6, 11e-6];
        p.installation_rad = CrossAxis {
            xy: 4.1e-4,
            xz: -2.3e-4,
            yx: 1.7e-4,
            yz: -5.9e-4,
            zx: 3.2e-4,
            zy: 8.8e-4,
        };
        p.flexure_s2 = TABLE_3_S2;
        p.flexure_response = FlexureResponse::Static;
        p.pickoff_gain = [1.013, 0.991, 1.004];
    })
}

/// The block's angle relative to the case \[rad\]: three frequencies, amplitudes of 100–200″ that wander.
fn block_angle(axis: usize, t: f64) -> f64 {
    const FREQUENCY_HZ: [f64; 3] = [371.3, 403.9, 438.7];
    const WANDER_HZ: [f64; 3] = [17.1, 23.7, 29.3];
    const ARCSEC: f64 = 4.848_136_811e-6;
    let tau = std::f64::consts::TAU;
    let wander = (tau * WANDER_HZ[axis] * t).sin() + (tau * 7.31 * WANDER_HZ[axis] * t).sin();
    (150.0 + 25.0 * wander) * ARCSEC * (tau * FREQUENCY_HZ[axis] * t).sin()
}

/// The stream of a triad whose errors are exactly those of `parameters`; with `dithered`, blocks swing.
///
/// Sensed rate: M⁻¹ (case) with M of Eq. (7) at ε0, plus the tilts of `flexure_s2` as physics gives them:
/// gyro x senses δ_xz ω_y − δ_xy ω_z more, δ_ij = −K_ij α_j.
pub fn stream(
    parameters: &Parameters,
    motion: &impl Motion,
    dithered: bool,
    count: usize,
) -> Vec<Sample> {
    let p = parameters;
    let period_s = 1.0 / p.sample_rate_hz;
    let e = p.installation_rad;
    let mut angle = [0.0; 3];
    let mut pulses = [0i64; 3];
    let mut samples = Vec::with_capacity(count);
    for k in 0..count {
        let start = k as f64 * period_s;
        let end = (k + 1) as f64 * period_s;
        let mut case_sensed = [0.0; 3];
        // Five-point Gauss–Legendre: exact to the tenth power of ΩT, 1e-9 of an increment at 400 Hz.
        for (x, w) in GAUSS_5 {
            let t = start + period_s * x;
            let rate = flexed(&p.flexure_s2, motion.rate(t), motion.acceleration(t));
            for i in 0..3 {
                case_sensed[i] += w * rate[i] * period_s;
            }
        }
        let m = [[1.0, e.xz, e.xy], [e.yz, 1.0, e.yx], [e.zy, e.zx, 1.0]];
        let sensing = solve(m, case_sensed);
        let mut sample = Sample::default();
        for i in 0..3 {
            let scale = 1.0 - p.scale_error[i];
            angle[i] += (sensing[i] + p.bias_rad_s[i] * period_s) / scale;
            let block = if dithered { block_angle(i, end) } else { 0.0 };
            let total = ((angle[i] + block) / p.pulse_weight_rad[i]).floor() as i64;
            sample.pulse_counts[i] = (total - pulses[i]) as i32;
            pulses[i] = total;
            let code = block / (p.pickoff_gain[i] * p.pickoff_weight_rad);
            sample.pickoff_codes[i] = code.round() as i32;
        }
        samples.push(sample);
    }
    samples
}

/// Sensed rates of the gyros at rate ω under acceleration α.
fn flexed(k: &CrossAxis<f64>, w: [f64; 3], a: [f64; 3]) -> [f64; 3] {
    let (xy, xz) = (-k.xy * a[1], -k.xz * a[2]);
    let (yx, yz) = (-k.yx * a[0], -k.yz * a[2]);
    let (zx, zy) = (-k.zx * a[0], -k.zy * a[1]);
    [
        w[0] + xz * w[1] - xy * w[2],
        w[1] + yx * w[2] - yz * w[0],
        w[2] + zy * w[0] - zx * w[1],
    ]
}

/// Nodes on 0..1 and weights.
const GAUSS_5: [(f64, f64); 5] = [
    (0.046_910_077_030_668, 0.118_463_442_528_094_5),
    (0.230_765_344_947_158_45, 0.239_314_335_249_683_25),
    (0.5, 0.284_444_444_444_444_45),
    (0.769_234_655_052_841_5, 0.239_314_335_249_683_25),
    (0.953_089_922_969_332, 0.118_463_442_528_094_5),
];

/// m⁻¹ v by Cramer's rule.
fn solve(m: [[f64; 3]; 3], v: [f64; 3]) -> [f64; 3] {
    let det = |m: [[f64; 3]; 3]| {
        let c = super::equations::cross(m[1], m[2]);
        m[0][0] * c[0] + m[0][1] * c[1] + m[0][2] * c[2]
    };
    let whole = det(m);
    [0, 1, 2].map(|column| {
        let mut replaced = m;
        for row in 0..3 {
            replaced[row][column] = v[row];
        }
        det(replaced) / whole
    })
}
