//! The accelerometers' way through the chain.

mod degraded;
mod exact;
mod gaps;
mod limits;
mod motion;
mod sculling;
mod size_effect;

use trueaxis::{Chain, ChainState, NumberSystem, OutputFrame, Parameters, Sample};

/// A stream through a new chain.
pub fn frames<N: NumberSystem>(
    parameters: &Parameters,
    samples: &[Sample],
) -> (Vec<OutputFrame>, ChainState<N>) {
    let chain = Chain::<N>::new(parameters).expect("parameters are in range");
    let mut state = ChainState::new();
    let frames = samples
        .iter()
        .filter_map(|sample| chain.process(&mut state, sample))
        .collect();
    (frames, state)
}
