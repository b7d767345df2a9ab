//! Takes a scenario through the simulator and then through the firmware's chain: the common part of the experiments.
//!
//! From a scenario as TOML and a seed it gives a [`Run`]: rotation vectors \[rad\] per output period, body frame, by
//! the f32 chain under several [`Correction`]s, and by the other gyro beside it; mean rates \[°/h\].
//!
//! The same samples go through the chain each time, so that differences between corrections hold no noise.
//!
//! The chain knows bias, scale error and installation of the unit: Eq. (7). What it corrects of the flexure is the
//! experiment.

use std::ops::Range;
use std::path::Path;

use nalgebra::Vector3;
use trueaxis::{CrossAxis, ParameterError};

use crate::error::InputError;
use crate::recording::Segment;
use crate::replay::drift::{DEG_H_PER_RAD_S, periods_in, reference_rotations_rad};
use crate::replay::samples::{ReplayInput, Setup, samples_from_recording};
use crate::replay::{Core, Replay, replay};
use crate::simulate::scenario::Scenario;
use crate::simulate::simulate;

/// The flexure that the chain corrects.
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

/// One simulated experiment.
pub struct Run {
    /// Input of the chain.
    pub input: ReplayInput,
    /// Segments of the recording.
    pub segments: Vec<Segment>,
    /// Output period \[s\].
    pub period_s: f64,
    /// What perfect gyros would give: rotation vectors of the case itself \[rad\].
    pub truth_rad: Vec<[f64; 3]>,
}

/// Called with the progress: rows simulated since the last call.
pub type Progress<'a> = dyn Fn(usize) + Sync + 'a;

/// Simulates `text`; every output period is `samples_per_output` samples.
pub fn run(
    text: &str,
    seed: u64,
    samples_per_output: u16,
    progress: &Progress,
) -> Result<Run, InputError> {
    let place = Path::new("paper");
    let scenario = Scenario::parse(text, place)?;
    let mut told = 0;
    let simulation = simulate(&scenario, seed, |done| {
        progress(done - told);
        told = done;
    });
    let setup = Setup {
        samples_per_output,
        ..Setup::STANDARD
    };
    let mut input = samples_from_recording(&simulation.recording, &simulation.model, place, setup)?;
    let measured = input.reference_rad.replace(simulation.case_increments_rad);
    let truth_rad = reference_rotations_rad(&input).unwrap_or_default();
    input.reference_rad = measured;
    Ok(Run {
        period_s: f64::from(samples_per_output) / scenario.rate_hz,
        segments: simulation.recording.segments,
        truth_rad,
        input,
    })
}

impl Run {
    /// Takes the samples through the f32 chain.
    pub fn chain(&self, correction: Correction) -> Result<Replay, InputError> {
        let mut parameters = self.input.parameters;
        parameters.flexure_s2 = correction.flexure_s2();
        let refused = |error: ParameterError| {
            InputError::new("paper", format!("does not fit the chain: {error}"))
        };
        replay(&self.input, Core::F32, &parameters).map_err(refused)
    }

    /// The other gyro's rotation vectors \[rad\].
    pub fn fibre_optic_rad(&self) -> Result<Vec<[f64; 3]>, InputError> {
        reference_rotations_rad(&self.input)
            .ok_or_else(|| InputError::new("paper", "has no second gyro to compare with"))
    }

    /// Output periods of segment `index`, `margin_s` left out at either end.
    pub fn periods(&self, index: usize, margin_s: f64) -> Range<usize> {
        let mut segment = self.segments[index].clone();
        segment.start_s += margin_s;
        segment.end_s -= margin_s;
        let all = self.input.samples.len() / usize::from(self.input.parameters.samples_per_output);
        periods_in(&segment, &self.input, all)
    }

    /// Mean of `rotations` over `periods` \[°/h\].
    pub fn mean_deg_h(&self, rotations_rad: &[[f64; 3]], periods: Range<usize>) -> Vector3<f64> {
        let count = periods.len() as f64;
        let sum: Vector3<f64> = rotations_rad[periods]
            .iter()
            .map(|r| Vector3::from(*r))
            .sum();
        sum * (DEG_H_PER_RAD_S / (count * self.period_s))
    }

    /// Means over windows of `window_s`, of axis `axis`: middles of the windows \[s\] and rates \[°/h\].
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
