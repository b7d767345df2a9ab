//! The dither strip that follows its pickoff, and its status of the dither's health.

mod health;
mod start;
mod tracking;
mod triad;

use trueaxis::{Chain, ChainState, NumberSystem, OutputFrame, Parameters, Sample};

/// A stream through a new chain.
pub fn frames<N: NumberSystem>(
    parameters: &Parameters,
    samples: impl IntoIterator<Item = Sample>,
) -> (Vec<OutputFrame>, ChainState<N>) {
    let chain = Chain::<N>::new(parameters).expect("parameters are in range");
    let mut state = ChainState::new();
    let frames = samples
        .into_iter()
        .filter_map(|sample| chain.process(&mut state, &sample))
        .collect();
    (frames, state)
}
