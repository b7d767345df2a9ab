//! Runs a scenario through the simulator and the firmware's chain: the common part of the experiments.
//!
//! From a scenario as TOML and a seed it gives a [`Run`]: rotation vectors \[rad\] per output period, body frame, by the f32
//! chain under several [`Correction`]s, and by the second gyro triad; mean rates \[°/h\].
//!
//! The same samples go through the chain each time, so that noise cancels in differences between corrections. Rows are
//! simulated, corrected and dropped block by block: of ten minutes at 4 kHz only the outputs are kept.
//!
//! The chain knows bias, scale error and installation of the unit: Eq. (7). The correction of the flexure varies with the
//! experiment.

use std::ops::Range;
use std::path::Path;

use nalgebra::Vector3;
use rlg_reference::coning::Coning;
use trueaxis::{
    Chain, ChainState, CrossAxis, F32, OUTPUT_M_S_PER_CODE, OUTPUT_RAD_PER_CODE, ParameterError,
    Parameters,
};

use crate::error::InputError;
use crate::recording::{Recording, Segment};
use crate::replay::drift::DEG_H_PER_RAD_S;
use crate::replay::samples::{Setup, samples_from_recording};
use crate::simulate::scenario::Scenario;
use crate::simulate::{Block, Simulator, model_of};

/// Tolerance of a segment's bounds about a sample's bounds, as a share of an output period: stamps are decimal numbers.
const BOUND_TOLERANCE_PERIODS: f64 = 1e-3;

/// Correction of the flexure in the chain.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Correction {
    /// None: Eq. (7) with the static installation.
    Static,
    /// K_ij \[s²\], with the signs of a rotation.
    Dynamic(CrossAxis<f64>),
    /// K_ij \[s²\], with Eq. (6) as it is printed: ε_ij = ε_ij0 − K_ij α_j for all six.
    Literal(CrossAxis<f64>),
}

impl Correction {
    fn flexure_s2(self) -> CrossAxis<f64> {
        match self {
            Self::Static => CrossAxis::default(),
            Self::Dynamic(k) => k,
            // the chain's own signs are + δ_xy, − δ_xz, − δ_yx, + δ_yz, + δ_zx, − δ_zy
            Self::Literal(k) => CrossAxis {
                xz: -k.xz,
                yx: -k.yx,
                zy: -k.zy,
                ..k
            },
        }
    }
}

/// Settings of the chain for an experiment.
#[derive(Debug, Clone, Copy)]
pub struct Asked<'a> {
    /// Samples in one output period.
    pub samples_per_output: u16,
    /// Output periods summed to one stored rotation vector: 1 to keep each.
    pub summed: usize,
    /// Corrections, each in a chain of its own; the first one's velocity increments are kept.
    pub corrections: &'a [Correction],
}

/// One simulated experiment.
pub struct Run {
    /// Segments of the recording.
    pub segments: Vec<Segment>,
    /// Time that a rotation vector covers \[s\].
    pub period_s: f64,
    /// Output of perfect gyros: rotation vectors of the case itself \[rad\].
    pub truth_rad: Vec<[f64; 3]>,
    /// Rotation vectors of the second gyro triad \[rad\]; empty without one.
    fibre_optic_rad: Vec<[f64; 3]>,
    /// Rotation vectors of the chains.
    rotations_rad: Vec<(Correction, Vec<[f64; 3]>)>,
    /// Velocity increments of the first chain in each output period \[m/s\].
    pub velocities_m_s: Vec<[f64; 3]>,
    /// Beginning of the first row \[s\].
    start_s: f64,
}

/// Callback with the progress: rows simulated since the last call.
pub type Progress<'a> = dyn Fn(usize) + Sync + 'a;

/// Simulates `text` and runs it through the chains.
pub fn run(
    text: &str,
    seed: u64,
    asked: Asked<'_>,
    progress: &Progress,
) -> Result<Run, InputError> {
    let place = Path::new("paper");
    let scenario = Scenario::parse(text, place)?;
    let model = model_of(&scenario);
    let setup = Setup {
        samples_per_output: asked.samples_per_output,
        ..Setup::STANDARD
    };
    let mut simulator = Simulator::new(&scenario, seed);
    let empty = simulator.recording();
    let mut passing: Option<Passing> = None;
    let mut told = 0;
    while let Some(block) = simulator.next_block() {
        let recording = filled(&empty, &block);
        let input = samples_from_recording(&recording, &model, place, setup)?;
        let passing = match &mut passing {
            Some(passing) => passing,
            None => passing.insert(Passing::new(&input.parameters, asked)?),
        };
        input
            .samples
            .iter()
            .for_each(|sample| passing.sample(sample));
        for increment in input.reference_rad.iter().flatten() {
            passing.fibre_optic.turn(*increment);
        }
        for increment in &block.case_increments_rad {
            passing.truth.turn(*increment);
        }
        progress(block.end_row - told);
        told = block.end_row;
    }
    let passing = passing.ok_or_else(|| InputError::new(place, "has no rows"))?;
    let chains = passing.chains.into_iter();
    let summed = asked.summed as f64;
    Ok(Run {
        period_s: f64::from(asked.samples_per_output) * summed / scenario.rate_hz,
        segments: empty.segments,
        truth_rad: passing.truth.sums.kept,
        fibre_optic_rad: passing.fibre_optic.sums.kept,
        rotations_rad: chains
            .map(|chain| (chain.correction, chain.sums.kept))
            .collect(),
        velocities_m_s: passing.velocities_m_s,
        start_s: scenario.start_s,
    })
}

/// Makes a recording of a block's rows.
fn filled(empty: &Recording, block: &Block) -> Recording {
    let mut recording = empty.clone();
    for (table, columns) in recording.tables.iter_mut().zip(&block.tables) {
        table.rows = columns.first().map_or(0, Vec::len);
        for (channel, column) in table.channels.iter_mut().zip(columns) {
            channel.values.clone_from(column);
        }
    }
    recording
}

/// Sums of a few output periods each.
struct Sums {
    each: usize,
    count: usize,
    sum: Vector3<f64>,
    kept: Vec<[f64; 3]>,
}

impl Sums {
    fn new(each: usize) -> Self {
        Self {
            each,
            count: 0,
            sum: Vector3::zeros(),
            kept: Vec::new(),
        }
    }

    fn add(&mut self, rotation_rad: Vector3<f64>) {
        self.sum += rotation_rad;
        self.count += 1;
        if self.count == self.each {
            self.kept.push(self.sum.into());
            (self.count, self.sum) = (0, Vector3::zeros());
        }
    }
}

/// Conversion of increments to rotation vectors of output periods, in f64.
struct Turning {
    coning: Coning,
    sums: Sums,
    is_primed: bool,
}

impl Turning {
    fn new(asked: Asked<'_>) -> Self {
        Self {
            coning: Coning::new(usize::from(asked.samples_per_output)),
            sums: Sums::new(asked.summed),
            is_primed: false,
        }
    }

    /// Takes the next increment; the first primes, as in the chain.
    fn turn(&mut self, increment_rad: [f64; 3]) {
        let counts = std::mem::replace(&mut self.is_primed, true);
        let increment = match counts {
            true => Vector3::from(increment_rad),
            false => Vector3::zeros(),
        };
        if let Some(rotation) = self.coning.turn(increment) {
            self.sums.add(rotation);
        }
    }
}

/// A running chain with its correction.
struct Corrected {
    correction: Correction,
    chain: Chain<F32>,
    state: ChainState<F32>,
    sums: Sums,
}

/// All consumers of samples.
struct Passing {
    chains: Vec<Corrected>,
    velocities_m_s: Vec<[f64; 3]>,
    truth: Turning,
    fibre_optic: Turning,
}

impl Passing {
    fn new(parameters: &Parameters, asked: Asked<'_>) -> Result<Self, InputError> {
        let chain = |correction: &Correction| {
            let mut parameters = *parameters;
            parameters.flexure_s2 = correction.flexure_s2();
            let refused = |error: ParameterError| {
                InputError::new("paper", format!("does not fit the chain: {error}"))
            };
            Ok(Corrected {
                correction: *correction,
                chain: Chain::new(&parameters).map_err(refused)?,
                state: ChainState::new(),
                sums: Sums::new(asked.summed),
            })
        };
        Ok(Self {
            chains: asked
                .corrections
                .iter()
                .map(chain)
                .collect::<Result<_, InputError>>()?,
            velocities_m_s: Vec::new(),
            truth: Turning::new(asked),
            fibre_optic: Turning::new(asked),
        })
    }

    fn sample(&mut self, sample: &trueaxis::Sample) {
        for (place, one) in self.chains.iter_mut().enumerate() {
            let Some(frame) = one.chain.process(&mut one.state, sample) else {
                continue;
            };
            let rotation = frame
                .dtheta_codes
                .map(|code| f64::from(code) * OUTPUT_RAD_PER_CODE);
            one.sums.add(Vector3::from(rotation));
            if place == 0 && one.sums.each == 1 {
                let velocity = frame
                    .dvel_codes
                    .map(|code| f64::from(code) * OUTPUT_M_S_PER_CODE);
                self.velocities_m_s.push(velocity);
            }
        }
    }
}

impl Run {
    /// Returns the rotation vectors of the chain under a requested correction \[rad\].
    ///
    /// # Errors
    /// The correction was not requested.
    pub fn chain(&self, correction: Correction) -> Result<&[[f64; 3]], InputError> {
        let mut chains = self.rotations_rad.iter();
        let found = chains.find(|(known, _)| *known == correction);
        let missing = || InputError::new("paper", "has no run under this correction");
        found.map(|(_, rotations)| &**rotations).ok_or_else(missing)
    }

    /// Returns the second gyro triad's rotation vectors \[rad\].
    pub fn fibre_optic_rad(&self) -> Result<&[[f64; 3]], InputError> {
        match self.fibre_optic_rad.is_empty() {
            true => Err(InputError::new(
                "paper",
                "has no second gyro to compare with",
            )),
            false => Ok(&self.fibre_optic_rad),
        }
    }

    /// Returns the periods of segment `index`, `margin_s` left out at either end.
    pub fn periods(&self, index: usize, margin_s: f64) -> Range<usize> {
        let segment = &self.segments[index];
        let place = |time_s: f64| (time_s - self.start_s) / self.period_s;
        let first = (place(segment.start_s + margin_s) - BOUND_TOLERANCE_PERIODS).ceil();
        let end = (place(segment.end_s - margin_s) + BOUND_TOLERANCE_PERIODS).floor();
        // a float to integer cast saturates: times before the first sample become 0
        let end = (end as usize).min(self.truth_rad.len());
        (first as usize).min(end)..end
    }

    /// Computes the mean of `rotations` over `periods` \[°/h\].
    pub fn mean_deg_h(&self, rotations_rad: &[[f64; 3]], periods: Range<usize>) -> Vector3<f64> {
        let count = periods.len() as f64;
        let sum: Vector3<f64> = rotations_rad[periods]
            .iter()
            .map(|r| Vector3::from(*r))
            .sum();
        sum * (DEG_H_PER_RAD_S / (count * self.period_s))
    }

    /// Computes means over windows of `window_s`, of axis `axis`: middles of the windows \[s\] and rates \[°/h\].
    pub fn curve(&self, rotations_rad: &[[f64; 3]], axis: usize, window_s: f64) -> Curve {
        let count = (window_s / self.period_s).round() as usize;
        rotations_rad
            .chunks_exact(count)
            .enumerate()
            .map(|(index, part)| {
                let sum: f64 = part.iter().map(|rotation| rotation[axis]).sum();
                let middle_s = (index as f64 + 0.5) * window_s;
                (middle_s, sum / window_s * DEG_H_PER_RAD_S)
            })
            .collect()
    }
}

/// Points of a curve: time \[s\], value.
pub type Curve = Vec<(f64, f64)>;
