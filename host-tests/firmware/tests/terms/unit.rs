//! Plays a unit whose gyros and accelerometers have one error, and the same unit without it.

use trueaxis::terms::AllTerms;
use trueaxis::{
    AccelerometerParameters, Chain, ChainState, CrossAxis, NumberSystem, OUTPUT_M_S_PER_CODE,
    OUTPUT_RAD_PER_CODE, OutputFrame, Parameters, Sample, SlowReadings, TermKind, TermRecords,
};

pub const RATE_HZ: f64 = 4000.0;
const PULSE_RAD: f64 = 1.0 / (1u64 << 34) as f64;
const PICKOFF_RAD: f64 = 1.0 / (1u64 << 35) as f64;
const CODE_M_S: f64 = 1.0 / (1u64 << 29) as f64;

/// Motion of the unit at an instant: rates and their second derivatives, forces, temperatures.
#[derive(Clone, Copy)]
pub struct Motion {
    pub rate_rad_s: [f64; 3],
    pub rate_second: [f64; 3],
    pub force_m_s2: [f64; 3],
    pub force_rate_m_s3: [f64; 3],
    pub temperature_k: [f64; 3],
    pub temperature_rate_k_s: [f64; 3],
}

/// Amplitude \[rad/s\], frequency \[Hz\] and phase \[rad\] of the rocking about each axis.
const ROCKING: [[(f64, f64, f64); 2]; 3] = [
    [(0.9, 15.0, 0.0), (0.2, 61.0, 0.4)],
    [(0.8, 15.0, 1.1), (0.3, 43.0, 0.2)],
    [(1.1, 7.0, 0.3), (0.25, 61.0, 2.0)],
];

/// The angular acceleration \[rad/s²\] through a mode, or as it is.
pub fn acceleration(t: f64, mode: Option<(f64, f64)>) -> [f64; 3] {
    ROCKING.map(|tones| {
        let of_tone = |(amplitude, frequency_hz, phase): (f64, f64, f64)| {
            let w = std::f64::consts::TAU * frequency_hz;
            let (gain, turned) = match mode {
                None => (1.0, 0.0),
                Some((mode_hz, damping)) => {
                    let u = frequency_hz / mode_hz;
                    let (re, im) = (1.0 - u * u, 2.0 * damping * u);
                    (1.0 / re.hypot(im), -im.atan2(re))
                }
            };
            amplitude * w * gain * (w * t + phase + turned).cos()
        };
        tones.map(of_tone).iter().sum()
    })
}

/// Rocking of 1 to 3° at 7 to 60 Hz about all axes on a slow turn, under gravity and a vibration along all axes, while
/// the unit warms up.
pub fn motion(t: f64) -> Motion {
    let tones = |list: &[(f64, f64, f64)]| {
        let (mut value, mut second) = (0.0, 0.0);
        for (amplitude, frequency_hz, phase) in list {
            let w = std::f64::consts::TAU * frequency_hz;
            let sine = amplitude * (w * t + phase).sin();
            value += sine;
            second -= w * w * sine;
        }
        (value, second)
    };
    let shaken = |amplitude: f64, frequency_hz: f64, phase: f64| {
        let w = std::f64::consts::TAU * frequency_hz;
        let (sine, cosine) = (w * t + phase).sin_cos();
        (amplitude * sine, amplitude * w * cosine)
    };
    let [(x, x2), (y, y2), (z, z2)] = ROCKING.map(|list| tones(&list));
    let (fx, fx1) = shaken(3.0, 15.0, 0.7);
    let (fy, fy1) = shaken(2.0, 43.0, 0.1);
    let (fz, fz1) = shaken(1.0, 61.0, 0.9);
    Motion {
        rate_rad_s: [x + 0.4, y - 0.3, z + 0.9],
        rate_second: [x2, y2, z2],
        force_m_s2: [fx + 1.5, fy - 2.5, fz + 9.3],
        force_rate_m_s3: [fx1, fy1, fz1],
        temperature_k: [293.0 + 3.0 * t, 294.0 + 2.5 * t, 295.0 + 2.0 * t],
        temperature_rate_k_s: [3.0, 2.5, 2.0],
    }
}

/// One error: records that describe it, and the outputs of gyros and accelerometers.
pub struct Error {
    pub name: &'static str,
    pub records: Vec<(TermKind, Vec<f64>)>,
    /// Rates that the gyros show at an instant, given the time.
    pub gyros: fn(f64) -> [f64; 3],
    /// Forces that the accelerometers show.
    pub accelerometers: fn(f64) -> [f64; 3],
    /// Angles that the gyros show of their blocks, given the pickoffs' angles.
    pub blocks: fn([f64; 3]) -> [f64; 3],
}

/// Angles of the blocks relative to the case \[rad\]: 150″ at three frequencies.
pub fn pickoffs(t: f64) -> [f64; 3] {
    [392.6, 430.1, 474.8].map(|hz: f64| 7.3e-4 * (std::f64::consts::TAU * hz * t).sin())
}

pub fn true_rates(t: f64) -> [f64; 3] {
    motion(t).rate_rad_s
}

pub fn true_forces(t: f64) -> [f64; 3] {
    motion(t).force_m_s2
}

/// The unit's parameters: no error.
pub fn parameters(records: &[(TermKind, Vec<f64>)]) -> Parameters {
    let mut terms = TermRecords::NONE;
    for (kind, values) in records {
        terms.push(*kind, values).expect("a record");
    }
    Parameters::default().with(|p| {
        p.pulse_weight_rad = [PULSE_RAD; 3];
        p.pickoff_weight_rad = PICKOFF_RAD;
        p.sample_rate_hz = RATE_HZ;
        p.samples_per_output = 10;
        p.accelerometers = Some(AccelerometerParameters {
            weight_m_s: [CODE_M_S; 3],
            bias_m_s2: [0.0; 3],
            scale_error: [0.0; 3],
            misalignment_rad: CrossAxis::default(),
            lever_arm_m: [[0.0; 3]; 3],
        });
        p.terms = terms;
    })
}

/// Samples of the sensors, in whole codes of the running integrals.
pub struct Stream {
    gyros: fn(f64) -> [f64; 3],
    accelerometers: fn(f64) -> [f64; 3],
    blocks: fn([f64; 3]) -> [f64; 3],
    k: usize,
    angle_rad: [f64; 3],
    velocity_m_s: [f64; 3],
    counted: [[i64; 3]; 2],
}

impl Stream {
    /// Without an error.
    pub fn true_one() -> Self {
        Self::new(true_rates, true_forces, |pickoff| pickoff)
    }

    pub fn of(error: &Error) -> Self {
        Self::new(error.gyros, error.accelerometers, error.blocks)
    }

    fn new(
        gyros: fn(f64) -> [f64; 3],
        accelerometers: fn(f64) -> [f64; 3],
        blocks: fn([f64; 3]) -> [f64; 3],
    ) -> Self {
        Self {
            gyros,
            accelerometers,
            blocks,
            k: 0,
            angle_rad: [0.0; 3],
            velocity_m_s: [0.0; 3],
            counted: [[0; 3]; 2],
        }
    }

    /// The time at the end of the last sample \[s\].
    pub fn time_s(&self) -> f64 {
        self.k as f64 / RATE_HZ
    }

    pub fn next(&mut self) -> Sample {
        let begin = self.time_s();
        self.k += 1;
        let rate = integral(self.gyros, begin);
        let force = integral(self.accelerometers, begin);
        let pickoff = pickoffs(self.time_s()).map(|angle| (angle / PICKOFF_RAD).round());
        let block = (self.blocks)(pickoff.map(|codes| codes * PICKOFF_RAD));
        let mut sample = Sample {
            pickoff_codes: pickoff.map(|codes| codes as i32),
            ..Sample::default()
        };
        for axis in 0..3 {
            self.angle_rad[axis] += rate[axis];
            self.velocity_m_s[axis] += force[axis];
            let whole = [
                ((self.angle_rad[axis] + block[axis]) / PULSE_RAD).floor() as i64,
                (self.velocity_m_s[axis] / CODE_M_S).floor() as i64,
            ];
            let step = |at: usize| (whole[at] - self.counted[at][axis]) as i32;
            sample.pulse_counts[axis] = step(0);
            sample.accelerometer_codes[axis] = step(1);
            self.counted[0][axis] = whole[0];
            self.counted[1][axis] = whole[1];
        }
        sample
    }
}

/// ∫ over one period from `begin`: Simpson's rule on eight intervals.
fn integral(of: fn(f64) -> [f64; 3], begin: f64) -> [f64; 3] {
    let step = 1.0 / RATE_HZ / 8.0;
    let mut sum = [0.0; 3];
    for at in 0..=8 {
        let weight = match at {
            0 | 8 => 1.0,
            at if at % 2 == 1 => 4.0,
            _ => 2.0,
        };
        let values = of(begin + at as f64 * step);
        for (sum, value) in sum.iter_mut().zip(values) {
            *sum += weight * value * step / 3.0;
        }
    }
    sum
}

/// The field of a magnet that comes near \[T\].
pub fn field_t(t: f64) -> [f64; 3] {
    [2e-5 + 1e-4 * t, -1e-5, 4e-5 - 5e-5 * t]
}

/// The slow readings at a time, given twice an output period.
pub fn slow(t: f64) -> SlowReadings {
    let now = motion(t);
    SlowReadings {
        temperature_k: now.temperature_k.map(|value| value as f32),
        temperature_rate_k_s: now.temperature_rate_k_s.map(|value| value as f32),
        magnetic_field_t: field_t(t).map(|value| value as f32),
    }
}

/// Rotation vectors and velocity increments of every output period \[rad, m/s\].
pub fn frames<N: NumberSystem>(
    parameters: &Parameters,
    mut stream: Stream,
    samples: usize,
) -> Vec<[f64; 6]> {
    let chain = Chain::<N, AllTerms<N>>::with_terms(parameters).expect("parameters in range");
    let mut state = ChainState::new();
    let mut frames = Vec::new();
    for k in 0..samples {
        if k % 5 == 0 {
            chain.slow(&mut state, &slow(stream.time_s()));
        }
        let sample = stream.next();
        frames.extend(chain.process(&mut state, &sample).map(values));
    }
    frames
}

fn values(frame: OutputFrame) -> [f64; 6] {
    let mut values = [0.0; 6];
    for axis in 0..3 {
        values[axis] = f64::from(frame.dtheta_codes[axis]) * OUTPUT_RAD_PER_CODE;
        values[3 + axis] = f64::from(frame.dvel_codes[axis]) * OUTPUT_M_S_PER_CODE;
    }
    values
}
