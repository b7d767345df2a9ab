//! Samples a second through the chain, both number systems: `cargo bench --package rlg --bench chain`.
//!
//! `whole`: strip that follows the pickoff, acceleration, flexure, Eq. (7), coning, a frame every 10 samples.
//! `without_dither`: the same without what watches and follows the dither.

use divan::counter::ItemsCount;
use divan::{Bencher, black_box};
use trueaxis::{Chain, ChainState, CrossAxis, F32, Fixed, NumberSystem, Parameters, Sample};

const SAMPLES: usize = 40_000;

const DITHER_HZ: [f64; 3] = [371.0, 404.0, 439.0];

const ARCSEC_RAD: f64 = std::f64::consts::PI / 648_000.0;

fn main() {
    divan::main();
}

/// Ten seconds of dither and slow coning, as counts.
fn samples() -> Vec<Sample> {
    (0..SAMPLES)
        .map(|k| {
            let t = k as f64 / 4000.0;
            let dither = DITHER_HZ.map(|f| (t * f * std::f64::consts::TAU).sin());
            let step = DITHER_HZ.map(|f| (t * f * std::f64::consts::TAU).cos());
            Sample {
                pulse_counts: step.map(|s| (118.0 * s) as i32),
                pickoff_codes: dither.map(|d| (3.1e6 * d) as i32),
                ..Sample::default()
            }
        })
        .collect()
}

#[divan::bench(types = [F32, Fixed])]
fn whole<N: NumberSystem>(bencher: Bencher) {
    run::<N>(
        bencher,
        &parameters().with(|p| {
            p.dither_frequency_hz = DITHER_HZ;
            p.dither_amplitude_rad = [150.0 * ARCSEC_RAD; 3];
            p.adaptation_time_s = 2.0;
        }),
    );
}

#[divan::bench(types = [F32, Fixed])]
fn without_dither<N: NumberSystem>(bencher: Bencher) {
    run::<N>(bencher, &parameters());
}

fn parameters() -> Parameters {
    Parameters::default().with(|p| p.flexure_s2 = CrossAxis::from_array([7e-8; 6]))
}

fn run<N: NumberSystem>(bencher: Bencher, parameters: &Parameters) {
    let chain = Chain::<N>::new(parameters).expect("parameters are in range");
    let samples = samples();
    bencher.counter(ItemsCount::new(SAMPLES)).bench_local(|| {
        let mut state = ChainState::new();
        for sample in &samples {
            black_box(chain.process(&mut state, black_box(sample)));
        }
        state.samples()
    });
}
