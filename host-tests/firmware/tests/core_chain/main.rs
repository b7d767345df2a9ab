//! The core against formulas written here, in f64, from the equations; nothing is copied from the core.
//!
//! These tests live outside the core, because a `no_std` library's own unit tests link std and would not
//! notice a float method that the target does not have.

mod equations;
mod motion;

mod acceleration;
mod accuracy;
mod bytes;
mod coning;
mod extremes;
mod monitor;
mod parameters;
mod rounding;
mod signs;

use trueaxis::{Chain, ChainState, NumberSystem, OutputFrame, Parameters, Sample};

/// 1 °/h \[rad/s\].
pub const DEG_H: f64 = std::f64::consts::PI / 180.0 / 3600.0;

/// Angle of one output code \[rad\], from the frame's definition.
pub const CODE_RAD: f64 = 1.0 / 34_359_738_368.0;

/// A stream through a new chain: all its frames and the last state.
pub fn run<N: NumberSystem>(
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

/// Mean rate that the frames show from frame `skip` on \[rad/s\].
pub fn mean_rate_rad_s(parameters: &Parameters, frames: &[OutputFrame], skip: usize) -> [f64; 3] {
    let period_s = f64::from(parameters.samples_per_output) / parameters.sample_rate_hz;
    let frames = &frames[skip..];
    let mut sum = [0i64; 3];
    for frame in frames {
        for (sum, code) in sum.iter_mut().zip(frame.dtheta_codes) {
            *sum += i64::from(code);
        }
    }
    sum.map(|sum| sum as f64 * CODE_RAD / (frames.len() as f64 * period_s))
}
