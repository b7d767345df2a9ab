//! Proves by interval arithmetic that no word of the fixed-point chain wraps, for any samples.
//!
//! [`Interval`] runs the chain's own text on the intervals of all values that a word of `Fixed` can hold: counts and
//! pickoff steps stand for all within their limits, taps for all that adaptation can reach. The chain's state from
//! sample to sample grows to a fixed point, and [`bounds::prove`] shows that it has reached it: so the bounds hold for
//! a stream of any length. Held samples and lost ones only leave words at zero that are otherwise intervals around it.
//!
//! # Parameters
//! Every interval grows with the magnitude of a parameter. So the corners of the ranges bound their inside; if
//! `Parameters::check` refuses a corner, the point of its boundary on the way to the corner stands for it. Rates on
//! both sides of every change of the increment unit, all lengths of the output period and both responses of the flexure
//! are gone through.
//!
//! The exact sums (`i64` of fine units) are not behind the number system. `exact_sums.rs` derives their bounds from the
//! same limits, for output periods of ordinary samples alone and for periods with readings that cover several periods.

mod against_fixed;
mod bounds;
mod corners;
mod exact_sums;
mod terms;

use std::collections::BTreeMap;

use proptest::prelude::*;
use trueaxis::design_parameters::{BENT_LIMIT_RAD, increment_unit_log2};
use trueaxis::numbers::Interval;
use trueaxis::numbers::interval::{Bound, Operation, take_bounds};
use trueaxis::{
    AccelerometerParameters, Chain, ChainState, CrossAxis, FlexureResponse, Parameters, Sample,
};

use crate::bounds::{proofs, prove, stage, still};
use crate::corners::{Corner, WEIGHTS, farthest_arms_m};
use crate::exact_sums::{Sum, exact_sums};

#[test]
fn no_word_of_the_fixed_point_chain_wraps() {
    let mut worst: BTreeMap<(Operation, &str), (Bound, Corner)> = BTreeMap::new();
    for (corner, bounds) in proofs() {
        for bound in bounds {
            let entry = worst
                .entry((bound.operation, stage(bound)))
                .or_insert((*bound, *corner));
            if bound.headroom() < entry.0.headroom() {
                *entry = (*bound, *corner);
            }
        }
    }
    println!("{} configurations", proofs().len());
    println!("| operation | stage | word | largest | headroom | attained with |");
    println!("|---|---|---|---|---|---|");
    for ((operation, stage), (bound, corner)) in &worst {
        println!(
            "| {operation:?} | {stage} | i{} | {:.6e} | {:.3} | {corner} |",
            bound.bits,
            bound.value(),
            bound.headroom(),
        );
    }
    let wraps: Vec<_> = worst.iter().filter(|(_, (b, _))| !b.fits()).collect();
    assert!(wraps.is_empty(), "{wraps:?}");
}

/// Bounds are those of all samples: they do not depend on the sample, nor on held or lost ones.
#[test]
fn the_bounds_do_not_depend_on_the_samples() {
    let corner = Corner {
        samples_per_output: 7,
        sample_rate_hz: 4000.0,
        response: FlexureResponse::default(),
        cycles: 0.1,
        delay_s: 1e-5,
        adapts: true,
        gain: 2.0,
        signed: 1.0,
        weights: WEIGHTS[1],
    };
    let parameters = corner.parameters();
    let expected = prove(&parameters, still);
    // Any 32 bits: most of them are held.
    let bits = |k: u32| k.wrapping_mul(2_654_435_761).rotate_left(k % 32) as i32;
    let any = prove(&parameters, |k| Sample {
        pulse_counts: [bits(k), bits(k + 1), bits(k + 2) % 1000],
        pickoff_codes: [bits(k + 3), bits(k + 4) % 1_000_000, bits(k + 5)],
        accelerometer_codes: [bits(k + 6), bits(k + 7), bits(k + 8)],
    });
    assert_eq!(any, expected);

    // A lost sample in every third output period.
    let chain = Chain::<Interval>::new(&parameters).expect("parameters in range");
    let mut state = ChainState::new();
    for k in 0..10_000 {
        if k % 21 == 3 {
            chain.process_lost(&mut state, 1);
        } else {
            chain.process(&mut state, &Sample::default());
        }
        chain.widen_taps(&mut state);
    }
    for bound in take_bounds() {
        let same = |b: &&Bound| (b.operation, b.file) == (bound.operation, bound.file);
        let known = expected.iter().find(same);
        assert!(
            known.is_some_and(|known| {
                known.span.low <= bound.span.low && bound.span.high <= known.span.high
            }),
            "{bound:?}, {known:?}"
        );
    }
}

#[test]
fn no_exact_sum_wraps() {
    let mut worst: Vec<(Sum, Corner)> = Vec::new();
    for (corner, bounds) in proofs() {
        let sums = exact_sums(&corner.parameters(), bounds);
        worst.resize(worst.len().max(sums.len()), (sums[0], *corner));
        for (known, sum) in worst.iter_mut().zip(sums) {
            if known.0.name != sum.name || sum.headroom() < known.0.headroom() {
                *known = (sum, *corner);
            }
        }
    }
    println!("| sum | word | largest | headroom | attained with |");
    println!("|---|---|---|---|---|");
    for (sum, corner) in &worst {
        let (exponent, unit) = sum.unit;
        println!(
            "| {} | i{} | {:.5e} {unit} | {:.3} | {corner} |",
            sum.name,
            sum.bits,
            sum.magnitude as f64 * 2f64.powi(exponent),
            sum.headroom(),
        );
    }
    let wraps: Vec<&(Sum, Corner)> = worst.iter().filter(|(sum, _)| !sum.fits()).collect();
    assert!(wraps.is_empty(), "{wraps:?}");
}

// ---- The largest increment

/// The check's own bound of an increment is that of the words, to their rounding.
#[test]
fn the_largest_increment_is_that_of_the_check() {
    let mut largest = (0.0, String::new());
    for (corner, bounds) in proofs() {
        let parameters = corner.parameters();
        let of_words = case_increment_rad(&parameters, bounds);
        let of_check = parameters.largest_increment_rad();
        assert!(
            of_words < of_check + rounding_rad(&parameters),
            "{corner}: {of_words} {of_check}"
        );
        // From below, limits are whole counts and codes: close where those are fine. The finest codes have a limit of
        // their own.
        let fine = corner.weights == WEIGHTS[1];
        // Coarse lag factors leave the flexure out of products.
        let bent =
            BENT_LIMIT_RAD * f64::from(1u8 << increment_unit_log2(parameters.sample_rate_hz));
        assert!(
            !fine || of_words > 0.999 * of_check - bent,
            "{corner}: {of_words} {of_check}"
        );
        if of_check > largest.0 {
            largest = (of_check, corner.to_string());
        }
    }
    println!("{} rad: {}", largest.0, largest.1);
}

/// Ten LSBs of an increment \[rad\].
fn rounding_rad(parameters: &Parameters) -> f64 {
    let unit_log2 = increment_unit_log2(parameters.sample_rate_hz) as i32;
    10.0 * 2f64.powi(unit_log2 - 37)
}

fn case_increment_rad(parameters: &Parameters, bounds: &[Bound]) -> f64 {
    let is_case = |b: &&Bound| b.operation == Operation::Turn && stage(b) == "flexure";
    let in_units = bounds.iter().find(is_case).expect("a case").value();
    in_units * f64::from(1u8 << increment_unit_log2(parameters.sample_rate_hz))
}

// ---- Inside the corners

fn six(limit: f64) -> impl Strategy<Value = CrossAxis<f64>> {
    prop::array::uniform6(-limit..=limit).prop_map(CrossAxis::from_array)
}

fn response() -> impl Strategy<Value = FlexureResponse> {
    prop_oneof![
        Just(FlexureResponse::Static),
        (0.002..=0.99f64).prop_map(|damping| FlexureResponse::Mode { damping }),
    ]
}

/// Anywhere in the ranges, every axis on its own.
fn parameters() -> impl Strategy<Value = Parameters> {
    use prop::array::uniform3 as three;
    let limit = 1.0 / 128.0;
    let gyros = (
        three((-34.0..-13.4f64).prop_map(f64::exp2)),
        three(-limit..=limit),
        six(limit),
        six(8.0),
        three(prop_oneof![Just(0.0), 0.0..=2.0f64]),
        (-35.0..-13.4f64).prop_map(f64::exp2),
        three(-1e-4..=1e-4f64),
        three(0.04..0.4f64),
        three(prop_oneof![Just(0.0), 1e-5..0.01f64]),
        prop_oneof![Just(0.0), 0.1..1000.0f64],
    );
    let accelerometers = (
        three((-29.8..-6.7f64).prop_map(f64::exp2)),
        three(-1.0..=1.0f64),
        three(-limit..=limit),
        six(limit),
        three(three(-0.5..=0.5f64)),
    );
    (
        gyros,
        accelerometers,
        500.0..=8000.0f64,
        1..=40u16,
        response(),
    )
        .prop_map(
            |(gyros, accelerometers, rate, samples_per_output, response)| {
                let (pulse_weight_rad, scale_error, installation_rad, flexure, gain, code, ..) =
                    gyros;
                let (.., pickoff_delay_s, cycles, dither_amplitude_rad, adaptation_time_s) = gyros;
                let (weight_m_s, bias_m_s2, scale, misalignment_rad, lever_arm_m) = accelerometers;
                let unit = f64::from(1u8 << increment_unit_log2(rate));
                let flexure_share = (4.0 / unit).min(1.0) / (rate * rate);
                let mut parameters = Parameters::default().with(|p| {
                    p.pulse_weight_rad = pulse_weight_rad;
                    p.bias_rad_s = [0.01; 3];
                    p.scale_error = scale_error;
                    p.installation_rad = installation_rad;
                    p.flexure_s2 = flexure.map(|k| k * flexure_share);
                    p.pickoff_gain = gain;
                    p.pickoff_weight_rad = code;
                    p.sample_rate_hz = rate;
                    p.samples_per_output = samples_per_output;
                    p.flexure_response = response;
                    p.pickoff_delay_s = pickoff_delay_s;
                    p.dither_frequency_hz = cycles.map(|cycles| cycles * rate);
                    p.dither_amplitude_rad = dither_amplitude_rad;
                    p.adaptation_time_s = adaptation_time_s;
                    p.accelerometers = None;
                });
                parameters.samples_per_output =
                    samples_per_output.min(parameters.most_samples_per_output());
                let arms = farthest_arms_m(&parameters);
                parameters.accelerometers = Some(AccelerometerParameters {
                    weight_m_s,
                    bias_m_s2,
                    scale_error: scale,
                    misalignment_rad,
                    lever_arm_m: lever_arm_m.map(|arm| arm.map(|m| m * arms)),
                });
                parameters
            },
        )
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(500))]

    /// Tests that the corners bound the inside of the ranges.
    #[test]
    fn no_word_wraps_inside_the_corners(parameters in parameters()) {
        prop_assume!(parameters.check().is_ok());
        let bounds = prove(&parameters, still);
        for bound in &bounds {
            prop_assert!(bound.fits(), "{bound:?}");
        }
        let of_check = parameters.largest_increment_rad() + rounding_rad(&parameters);
        prop_assert!(case_increment_rad(&parameters, &bounds) < of_check);
        for sum in exact_sums(&parameters, &bounds) {
            prop_assert!(sum.fits(), "{sum:?}");
        }
    }
}
