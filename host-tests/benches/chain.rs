//! Samples a second through the chain, both number systems: `cargo bench --package rlg --bench chain`.

use divan::counter::ItemsCount;
use divan::{Bencher, black_box};
use trueaxis::{Chain, ChainState, CrossAxis, F32, Fixed, NumberSystem, Parameters, Sample};

const SAMPLES: usize = 40_000;

fn main() {
    divan::main();
}

/// Ten seconds of dither and slow coning, as counts.
fn samples() -> Vec<Sample> {
    (0..SAMPLES)
        .map(|k| {
            let t = k as f64 / 4000.0;
            let dither = [371.0, 404.0, 439.0].map(|f| (t * f * std::f64::consts::TAU).sin());
            let step = [371.0, 404.0, 439.0].map(|f| (t * f * std::f64::consts::TAU).cos());
            Sample {
                pulse_counts: step.map(|s| (118.0 * s) as i32),
                pickoff_codes: dither.map(|d| (3.1e6 * d) as i32),
                ..Sample::default()
            }
        })
        .collect()
}

#[divan::bench(types = [F32, Fixed])]
fn process<N: NumberSystem>(bencher: Bencher) {
    let parameters = Parameters {
        flexure_s2: CrossAxis::from_array([7e-8; 6]),
        ..Parameters::default()
    };
    let chain = Chain::<N>::new(&parameters).expect("parameters are in range");
    let samples = samples();
    bencher.counter(ItemsCount::new(SAMPLES)).bench_local(|| {
        let mut state = ChainState::new();
        for sample in &samples {
            black_box(chain.process(&mut state, black_box(sample)));
        }
        state.samples()
    });
}
