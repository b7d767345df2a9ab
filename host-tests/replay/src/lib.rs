//! Replay of a recording through the chain, in one of its number systems or in f64.
//!
//! A [`samples::ReplayInput`] gives a [`Replay`]: rotation vectors \[rad\] and velocity increments \[m/s\] per output
//! period, in the body frame at its start, and the figures of the run.
//!
//! Data flow: recording and model → `samples` → the chain here → `drift` against the reference.
//!
//! Attitude, and velocity in any frame but the body's, are the navigation computer's task (`navigate`).

pub mod navigate;

pub mod accelerometers;
pub mod dither;
pub mod drift;
pub mod samples;
pub mod slope;
pub mod slow;
pub mod terms;
pub mod warming;
pub mod whole_codes;

use rlg_reference::adaptation::AdaptationCalibration;
use rlg_reference::coning::Output;
use rlg_reference::velocity::AccelerometerCalibration;
use rlg_reference::{Calibration, Reading, ReferenceChain, Six};
use samples::ReplayInput;
use sha2::{Digest, Sha256};
use std::time::Instant;
use trueaxis::terms::AllTerms;
use trueaxis::{
    Chain, ChainState, CrossAxis, F32, Faults, Fixed, NumberSystem, OUTPUT_M_S_PER_CODE,
    OUTPUT_RAD_PER_CODE, OutputFrame, ParameterError, Parameters, Term,
};

/// Implementation of the chain.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Core {
    /// The firmware's chain in single precision.
    F32,
    /// The firmware's chain in fixed point.
    Fixed,
    /// The same equations in f64, written independently.
    Reference,
}

impl Core {
    /// Its name on the command line and in results.
    pub fn name(self) -> &'static str {
        match self {
            Self::F32 => "f32",
            Self::Fixed => "fixed",
            Self::Reference => "reference",
        }
    }
}

/// Result of a replay.
#[derive(Debug, Clone, PartialEq)]
pub struct Replay {
    /// Rotation vector of each output period \[rad\].
    pub rotations_rad: Vec<[f64; 3]>,
    /// Velocity increment of each output period \[m/s\]; zeros without accelerometers.
    pub velocities_m_s: Vec<[f64; 3]>,
    /// Host time per sample \[ns\].
    pub ns_per_sample: f64,
    /// SHA-256 of the outputs as sent by the firmware; of little-endian f64 for the reference.
    pub output_sha256: String,
    /// Saturations and other faults of the core; `None` for the reference.
    pub faults: Option<Faults>,
}

/// Runs the samples through `core` with `parameters`, which may differ from the input's own.
pub fn replay(
    input: &ReplayInput,
    core: Core,
    parameters: &Parameters,
) -> Result<Replay, ParameterError> {
    match core {
        Core::F32 if needs_no_term(parameters) => through_core::<F32, ()>(input, parameters),
        Core::F32 => through_core::<F32, AllTerms<F32>>(input, parameters),
        Core::Fixed if needs_no_term(parameters) => through_core::<Fixed, ()>(input, parameters),
        Core::Fixed => through_core::<Fixed, AllTerms<Fixed>>(input, parameters),
        Core::Reference => Ok(through_reference(input, parameters)),
    }
}

fn needs_no_term(parameters: &Parameters) -> bool {
    parameters.terms.bytes().is_empty()
}

fn through_core<N: NumberSystem, T: Term<N>>(
    input: &ReplayInput,
    parameters: &Parameters,
) -> Result<Replay, ParameterError> {
    let chain = Chain::<N, T>::with_terms(parameters)?;
    let mut state = ChainState::new();
    let capacity = input.samples.len() / usize::from(parameters.samples_per_output);
    let mut frames: Vec<OutputFrame> = Vec::with_capacity(capacity);
    let begin = Instant::now();
    let mut slow = input.slow.readings();
    for (k, sample) in input.samples.iter().enumerate() {
        if k % usize::from(parameters.samples_per_output) == 0
            && let Some(readings) = slow.next()
        {
            chain.slow(&mut state, &readings);
        }
        if let Some(frame) = chain.process(&mut state, sample) {
            frames.push(frame);
        }
    }
    let elapsed = begin.elapsed();
    let mut hash = Sha256::new();
    frames
        .iter()
        .for_each(|frame| hash.update(frame.to_bytes()));
    let to_rad = |code: i32| f64::from(code) * OUTPUT_RAD_PER_CODE;
    let to_m_s = |code: i32| f64::from(code) * OUTPUT_M_S_PER_CODE;
    Ok(Replay {
        rotations_rad: frames
            .iter()
            .map(|frame| frame.dtheta_codes.map(to_rad))
            .collect(),
        velocities_m_s: frames
            .iter()
            .map(|frame| frame.dvel_codes.map(to_m_s))
            .collect(),
        ns_per_sample: elapsed.as_nanos() as f64 / input.samples.len().max(1) as f64,
        output_sha256: hexadecimal(hash),
        faults: Some(*state.faults()),
    })
}

fn through_reference(input: &ReplayInput, parameters: &Parameters) -> Replay {
    let mut chain = ReferenceChain::new(&calibration(parameters));
    let begin = Instant::now();
    let mut slow = input.slow.readings();
    let rows = 0..input.samples.len();
    let outputs: Vec<Output> = rows
        .filter_map(|row| {
            if row % usize::from(parameters.samples_per_output) == 0
                && let Some(readings) = slow.next()
            {
                if readings.temperature_k != [0.0; 3] {
                    chain.temperature(
                        readings.temperature_k.map(f64::from),
                        readings.temperature_rate_k_s.map(f64::from),
                    );
                }
                chain.magnetic_field(readings.magnetic_field_t.map(f64::from));
            }
            let velocity = input.velocity_m_s.as_ref();
            let reading = Reading {
                sensed_rad: input.sensed_rad[row],
                pickoff_rad: input.pickoff_rad[row],
                velocity_m_s: velocity.map_or([0.0; 3], |velocity| velocity[row]),
            };
            chain.process(&reading).output
        })
        .collect();
    let elapsed = begin.elapsed();
    let rotations_rad: Vec<[f64; 3]> = outputs.iter().map(|o| o.rotation_rad.into()).collect();
    let velocities_m_s: Vec<[f64; 3]> = outputs.iter().map(|o| o.velocity_m_s.into()).collect();
    let mut hash = Sha256::new();
    for (rotation, velocity) in rotations_rad.iter().zip(&velocities_m_s) {
        let numbers = rotation.iter().chain(velocity);
        numbers.for_each(|number| hash.update(number.to_le_bytes()));
    }
    Replay {
        rotations_rad,
        velocities_m_s,
        ns_per_sample: elapsed.as_nanos() as f64 / input.samples.len().max(1) as f64,
        output_sha256: hexadecimal(hash),
        faults: None,
    }
}

fn hexadecimal(hash: Sha256) -> String {
    let bytes = hash.finalize();
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// Converts the core's parameters to the reference's calibration.
pub fn calibration(parameters: &Parameters) -> Calibration {
    Calibration {
        bias_rad_s: parameters.bias_rad_s,
        scale_error: parameters.scale_error,
        installation_rad: six(&parameters.installation_rad),
        pickoff_gain: parameters.pickoff_gain,
        pickoff_delay_s: parameters.pickoff_delay_s,
        adaptation: AdaptationCalibration {
            time_s: parameters.adaptation_time_s,
            frequency_hz: parameters.dither_frequency_hz,
            amplitude_rad: parameters.dither_amplitude_rad,
        },
        accelerometers: parameters
            .accelerometers
            .map(|known| AccelerometerCalibration {
                bias_m_s2: known.bias_m_s2,
                scale_error: known.scale_error,
                misalignment_rad: six(&known.misalignment_rad),
                lever_arm_m: known.lever_arm_m,
            }),
        terms: terms::term_calibration(&parameters.terms),
        flexure: terms::flexure_calibration(parameters),
        period_s: 1.0 / parameters.sample_rate_hz,
        periods_per_output: usize::from(parameters.samples_per_output),
    }
}

fn six(terms: &CrossAxis<f64>) -> Six {
    Six {
        xy: terms.xy,
        xz: terms.xz,
        yx: terms.yx,
        yz: terms.yz,
        zx: terms.zx,
        zy: terms.zy,
    }
}
