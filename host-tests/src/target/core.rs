//! Which of the two number systems: its image, and the same chain on the host.
//!
//! Enters: parameters and samples. Leaves: output frames in their byte layout, and the fault counters.

use trueaxis::{
    Chain, ChainState, F32, Faults, Fixed, NumberSystem, ParameterError, Parameters, Sample,
};

/// A number system that has an image.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum TargetCore {
    /// Single precision.
    F32,
    /// Fixed point.
    Fixed,
}

impl TargetCore {
    /// Its name on the command line and in results.
    pub fn name(self) -> &'static str {
        match self {
            Self::F32 => "f32",
            Self::Fixed => "fixed",
        }
    }

    /// The name of its firmware binary.
    pub fn binary(self) -> &'static str {
        match self {
            Self::F32 => "firmware",
            Self::Fixed => "firmware-fixed",
        }
    }

    /// What the chain makes of `samples` on this machine: the frames' bytes one after the other.
    pub fn outputs_on_host(
        self,
        parameters: &Parameters,
        samples: &[Sample],
    ) -> Result<(Vec<u8>, Faults), ParameterError> {
        match self {
            Self::F32 => outputs::<F32>(parameters, samples),
            Self::Fixed => outputs::<Fixed>(parameters, samples),
        }
    }
}

fn outputs<N: NumberSystem>(
    parameters: &Parameters,
    samples: &[Sample],
) -> Result<(Vec<u8>, Faults), ParameterError> {
    let chain = Chain::<N>::new(parameters)?;
    let mut state = ChainState::<N>::default();
    let mut bytes = Vec::new();
    for sample in samples {
        if let Some(frame) = chain.process(&mut state, sample) {
            bytes.extend_from_slice(&frame.to_bytes());
        }
    }
    Ok((bytes, *state.faults()))
}
