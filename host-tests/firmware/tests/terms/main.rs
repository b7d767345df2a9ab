//! Optional terms of the chain: their residual errors, their records, their ranges.

mod errors;
mod ranges;
mod records;
mod unit;

use proptest::prelude::*;
use trueaxis::terms::AllTerms;
use trueaxis::{Chain, ChainState, F32, Fixed, NumberSystem, Parameters, Sample, SlowReadings};

use crate::errors::errors;
use crate::unit::{Stream, frames, parameters};

/// Four seconds.
const SAMPLES: usize = 16_000;

/// The largest angle and velocity by which two runs are apart at the end of any output period \[rad, m/s\].
fn apart(one: &[[f64; 6]], other: &[[f64; 6]]) -> [f64; 2] {
    let (mut sum, mut most) = ([0.0; 6], [0.0f64; 2]);
    // The first period begins with a sample that only primes.
    for (one, other) in one.iter().zip(other).skip(1) {
        for at in 0..6 {
            sum[at] += one[at] - other[at];
            most[at / 3] = most[at / 3].max(sum[at].abs());
        }
    }
    most
}

fn what_is_left<N: NumberSystem>() {
    let clean = frames::<N>(&parameters(&[]), Stream::true_one(), SAMPLES);
    for error in errors() {
        let run = |parameters: &Parameters| {
            apart(
                &frames::<N>(parameters, Stream::of(&error), SAMPLES),
                &clean,
            )
        };
        let before = run(&parameters(&[]));
        let after = run(&parameters(&error.records));
        // Of the quantity that the error is of.
        let at = usize::from(before[0] == 0.0);
        println!(
            "{} | {} | {:.3e} | {:.3e} | {:.3} %",
            error.name,
            N::NAME,
            before[at],
            after[at],
            100.0 * after[at] / before[at]
        );
        assert!(after[at] <= 0.02 * before[at], "{}", error.name);
        assert!(after[0] <= 0.02 * before[0] + 1e-9, "{}", error.name);
    }
}

#[test]
fn each_term_leaves_at_most_two_per_cent_of_its_error() {
    println!("error | core | before | after, rad or m/s | left");
    what_is_left::<F32>();
    what_is_left::<Fixed>();
}

/// All terms without a record, and no term at all.
#[test]
fn terms_without_records_change_no_bit() {
    fn same<N: NumberSystem>() {
        let known = parameters(&[]);
        let none = Chain::<N>::new(&known).expect("in range");
        let all = Chain::<N, AllTerms<N>>::with_terms(&known).expect("in range");
        let (mut of_none, mut of_all) = (ChainState::new(), ChainState::new());
        let mut stream = Stream::true_one();
        for k in 0..SAMPLES {
            let sample = stream.next();
            if k % 701 == 350 {
                assert_eq!(
                    none.process_lost(&mut of_none, 2),
                    all.process_lost(&mut of_all, 2)
                );
            }
            assert_eq!(
                none.process(&mut of_none, &sample),
                all.process(&mut of_all, &sample)
            );
        }
    }
    same::<F32>();
    same::<Fixed>();
}

fn any_sample() -> impl Strategy<Value = Sample> {
    let word = || prop_oneof![-3000..3000i32, any::<i32>()];
    let three = move || [word(), word(), word()];
    (three(), three(), three()).prop_map(|(pulse_counts, pickoff_codes, accelerometer_codes)| {
        Sample {
            pulse_counts,
            pickoff_codes,
            accelerometer_codes,
        }
    })
}

fn any_slow() -> impl Strategy<Value = SlowReadings> {
    let word = || prop_oneof![200.0..400.0f32, any::<u32>().prop_map(f32::from_bits)];
    let three = move || [word(), word(), word()];
    (three(), three(), three()).prop_map(|(temperature_k, temperature_rate_k_s, field)| {
        SlowReadings {
            temperature_k,
            temperature_rate_k_s,
            magnetic_field_t: field.map(|value| value * 1e-4),
        }
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// Any samples, slow readings, losses and restarts.
    #[test]
    fn no_input_panics(
        steps in prop::collection::vec((any_sample(), any_slow(), 0..40u8), 1..400),
    ) {
        fn run<N: NumberSystem>(steps: &[(Sample, SlowReadings, u8)]) {
            let records: Vec<_> = errors().into_iter().flat_map(|error| error.records).collect();
            let known = parameters(&records);
            let chain = Chain::<N, AllTerms<N>>::with_terms(&known).expect("in range");
            let mut state = ChainState::new();
            for (sample, slow, what) in steps {
                match what {
                    0 => chain.slow(&mut state, slow),
                    1 => chain.restart(&mut state),
                    2 => {
                        chain.process_lost(&mut state, sample.pulse_counts[0].unsigned_abs());
                    }
                    _ => {}
                }
                chain.process(&mut state, sample);
            }
        }
        run::<F32>(&steps);
        run::<Fixed>(&steps);
    }
}
