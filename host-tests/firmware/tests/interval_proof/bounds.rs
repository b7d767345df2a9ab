//! Bounds every word of the fixed-point chain for one configuration, over every stream of samples.

use std::path::Path;
use std::sync::OnceLock;

use trueaxis::numbers::Interval;
use trueaxis::numbers::interval::{Bound, take_bounds};
use trueaxis::{Chain, ChainState, Parameters, Sample, Term};

use crate::corners::{Corner, corners};

/// The bounds of every word over every stream of samples.
///
/// # Panics
/// If the chain's state does not come to a fixed point.
pub fn prove(parameters: &Parameters, sample: impl Fn(u32) -> Sample) -> Vec<Bound> {
    prove_with::<()>(parameters, sample)
}

/// [`prove`] of a chain with the terms `T`.
pub fn prove_with<T: Term<Interval>>(
    parameters: &Parameters,
    sample: impl Fn(u32) -> Sample,
) -> Vec<Bound> {
    let chain = Chain::<Interval, T>::with_terms(parameters).expect("parameters in range");
    let mut state = ChainState::new();
    // Whole windows, so that blocks end alike; thrice, because windows observe one gyro a sample; and longer than the
    // chain's memory of samples.
    let block = 3 * chain.samples_per_window();
    let block = block * 12u32.div_ceil(block);
    let mut bounds = Vec::new();
    let mut words = Vec::new();
    for k in 0..3 * block {
        chain.process(&mut state, &sample(k));
        chain.widen_taps(&mut state);
        if (k + 1) % block == 0 {
            words.push(format!("{:?}", state.words()));
            merge(&mut bounds, take_bounds());
        }
    }
    assert_eq!(words[1], words[2], "no fixed point: {parameters:?}");
    bounds
}

/// The corners that stand, each with its bounds: found once for all tests.
pub fn proofs() -> &'static [(Corner, Vec<Bound>)] {
    static PROOFS: OnceLock<Vec<(Corner, Vec<Bound>)>> = OnceLock::new();
    PROOFS.get_or_init(|| {
        let standing = corners().into_iter().filter_map(Corner::accepted);
        standing
            .map(|corner| (corner, prove(&corner.parameters(), still)))
            .collect()
    })
}

/// Widens bounds by others.
fn merge(bounds: &mut Vec<Bound>, others: Vec<Bound>) {
    for other in others {
        let same =
            |bound: &&mut Bound| (bound.operation, bound.file) == (other.operation, other.file);
        match bounds.iter_mut().find(same) {
            Some(bound) => {
                bound.span.low = bound.span.low.min(other.span.low);
                bound.span.high = bound.span.high.max(other.span.high);
            }
            None => bounds.push(other),
        }
    }
}

/// A sample of zeros: counts and steps stand for all values within their limits, independent of the sample.
pub fn still(_: u32) -> Sample {
    Sample::default()
}

/// The stage whose source file has the bounded operation.
pub fn stage(bound: &Bound) -> &'static str {
    let stem = Path::new(bound.file).file_stem().and_then(|s| s.to_str());
    // Closures of `map` are called from the core library.
    stem.filter(|_| bound.file.starts_with("src"))
        .unwrap_or("-")
}
