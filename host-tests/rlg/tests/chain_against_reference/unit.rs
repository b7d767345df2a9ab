//! A dithered triad as built, its counts, and chains that process them.

use crate::motion::Motion;
use crate::{DEG_H, PERIOD_S};
use nalgebra::{Matrix3, Vector3};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rlg::reference::{Reading, ReferenceChain};
use rlg::replay::calibration;
use rlg::simulate::dither::BlockDither;
use trueaxis::{
    Chain, ChainState, CrossAxis, FlexureResponse, NumberSystem, OUTPUT_RAD_PER_CODE, OutputFrame,
    Parameters, Sample,
};

/// The paper's Table 3 \[s²\].
pub const TABLE_3_S2: CrossAxis<f64> = CrossAxis {
    xy: 6.9e-8,
    xz: 7.1e-8,
    yx: 7.5e-8,
    yz: 7.3e-8,
    zx: 6.7e-8,
    zy: 7.6e-8,
};

/// Frequencies and amplitudes of the three dithers: 145 to 155″.
pub const DITHER_HZ: [f64; 3] = [371.3, 403.9, 438.7];
pub const DITHER_RAD: [f64; 3] = [7.3e-4, 7.0e-4, 7.5e-4];

/// Relative rms deviation of the amplitude: the randomisation that prevents lock-in.
const DITHER_SPREAD: f64 = 0.1;

/// Parameters: pulses of 0.8″, bias, scale, installation, gains, a late pickoff, the paper's flexure.
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
        // As for the blocks of the simulated triad.
        p.flexure_response = FlexureResponse::Static;
        p.pickoff_gain = [1.013, 0.991, 1.004];
        p.pickoff_delay_s = [11e-6, -7e-6, 20e-6];
        p.dither_frequency_hz = DITHER_HZ;
        p.dither_amplitude_rad = DITHER_RAD;
        p.samples_per_output = 10;
    })
}

/// Triad with exactly the errors of its parameters.
pub struct Triad {
    known: Parameters,
    sensing_from_case: Matrix3<f64>,
    blocks: [BlockDither; 3],
    angle_rad: Vector3<f64>,
    pulses: [i64; 3],
}

impl Triad {
    pub fn new(known: &Parameters, seed: u64, duration_s: f64) -> Self {
        let e = known.installation_rad;
        let matrix = Matrix3::new(1.0, e.xz, e.xy, e.yz, 1.0, e.yx, e.zy, e.zx, 1.0);
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        Self {
            known: *known,
            sensing_from_case: matrix.try_inverse().unwrap(),
            blocks: [0, 1, 2].map(|i| {
                BlockDither::new(
                    known.dither_frequency_hz[i],
                    known.dither_amplitude_rad[i] * known.pickoff_gain[i],
                    DITHER_SPREAD,
                    -1.0,
                    duration_s + 2.0,
                    &mut rng,
                )
            }),
            angle_rad: Vector3::zeros(),
            pulses: [0; 3],
        }
    }

    /// Returns the blocks' angles at the end of period k \[rad\].
    pub fn block_rad(&self, k: usize) -> Vector3<f64> {
        let end_s = (k + 1) as f64 * PERIOD_S;
        Vector3::from_fn(|i, _| self.blocks[i].angle_rad(end_s))
    }

    /// Reads period k, over which ideally aligned axes would sense `case_rad`.
    pub fn read(&mut self, k: usize, case_rad: Vector3<f64>) -> Sample {
        let known = &self.known;
        let end_s = (k + 1) as f64 * PERIOD_S;
        let sensing = self.sensing_from_case * case_rad;
        let mut sample = Sample::default();
        for i in 0..3 {
            // a negative delay looks ahead, by less than a period
            self.blocks[i].reach(end_s + PERIOD_S);
            let scale = 1.0 - known.scale_error[i];
            self.angle_rad[i] += (sensing[i] + known.bias_rad_s[i] * PERIOD_S) / scale;
            let block = self.blocks[i].angle_rad(end_s);
            let total = ((self.angle_rad[i] + block) / known.pulse_weight_rad[i]).floor() as i64;
            sample.pulse_counts[i] = (total - self.pulses[i]) as i32;
            self.pulses[i] = total;
            let shown = self.blocks[i].angle_rad(end_s - known.pickoff_delay_s[i]);
            let code = shown / (known.pickoff_gain[i] * known.pickoff_weight_rad);
            sample.pickoff_codes[i] = code.round() as i32;
        }
        sample
    }
}

/// Returns the sample in the reference's form.
pub fn reading(known: &Parameters, sample: &Sample) -> Reading {
    let axes = [0, 1, 2];
    Reading {
        sensed_rad: axes.map(|i| known.pulse_weight_rad[i] * f64::from(sample.pulse_counts[i])),
        pickoff_rad: axes.map(|i| known.pickoff_weight_rad * f64::from(sample.pickoff_codes[i])),
        velocity_m_s: axes.map(|i| {
            let weights = known.accelerometers.map_or([0.0; 3], |a| a.weight_m_s);
            weights[i] * f64::from(sample.accelerometer_codes[i])
        }),
    }
}

/// One implementation over a stream, and the sum of its rotation vectors.
pub trait Runner {
    fn name(&self) -> &'static str;
    /// Returns the output period's rotation vector \[rad\] if this sample ends one.
    fn take(&mut self, sample: &Sample) -> Option<Vector3<f64>>;
    /// Does the same for one more period with a lost sample.
    fn lose(&mut self) -> Option<Vector3<f64>>;
}

pub struct Firmware<N: NumberSystem> {
    chain: Chain<N>,
    pub state: ChainState<N>,
}

impl<N: NumberSystem> Firmware<N> {
    pub fn new(parameters: &Parameters) -> Self {
        Self {
            chain: Chain::new(parameters).expect("parameters are in range"),
            state: ChainState::new(),
        }
    }
}

impl<N: NumberSystem> Runner for Firmware<N> {
    fn name(&self) -> &'static str {
        N::NAME
    }
    fn take(&mut self, sample: &Sample) -> Option<Vector3<f64>> {
        self.chain.process(&mut self.state, sample).map(rotation)
    }
    fn lose(&mut self) -> Option<Vector3<f64>> {
        self.chain.process_lost(&mut self.state, 1).map(rotation)
    }
}

fn rotation(frame: OutputFrame) -> Vector3<f64> {
    let to_rad = |code: i32| f64::from(code) * OUTPUT_RAD_PER_CODE;
    Vector3::from(frame.dtheta_codes.map(to_rad))
}

pub struct Reference {
    known: Parameters,
    pub chain: ReferenceChain,
}

impl Reference {
    pub fn new(parameters: &Parameters) -> Self {
        Self {
            known: *parameters,
            chain: ReferenceChain::new(&calibration(parameters)),
        }
    }
}

impl Runner for Reference {
    fn name(&self) -> &'static str {
        "reference"
    }
    fn take(&mut self, sample: &Sample) -> Option<Vector3<f64>> {
        let output = self.chain.process(&reading(&self.known, sample)).output?;
        Some(output.rotation_rad)
    }
    fn lose(&mut self) -> Option<Vector3<f64>> {
        self.chain.process_lost(1).map(|output| output.rotation_rad)
    }
}

/// Computes the angles of several implementations over one stream, less the first one's.
pub fn angles_apart(
    runners: &mut [&mut dyn Runner],
    triad: &mut Triad,
    motion: &mut dyn Motion,
    samples: usize,
) -> Vec<Vector3<f64>> {
    let mut apart = vec![Vector3::zeros(); runners.len()];
    for k in 0..samples {
        let sample = triad.read(k, motion.sensed(k));
        let mut rotations = runners.iter_mut().map(|runner| runner.take(&sample));
        let Some(first) = rotations.next().flatten() else {
            rotations.for_each(|none| assert!(none.is_none(), "frames at different samples"));
            continue;
        };
        for (sum, rotation) in apart[1..].iter_mut().zip(rotations) {
            *sum += rotation.expect("frames at the same samples") - first;
        }
    }
    apart
}

/// Computes the largest component as a drift over `samples` \[°/h\].
pub fn drift_deg_h(angle_rad: &Vector3<f64>, samples: usize) -> f64 {
    angle_rad.amax() / (samples as f64 * PERIOD_S) / DEG_H
}
