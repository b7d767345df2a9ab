//! The proof for chains with optional terms: their own words, and the chain's with their additions.

use std::collections::BTreeMap;

use proptest::prelude::*;
use trueaxis::numbers::Interval;
use trueaxis::numbers::interval::{Bound, Operation, Span};
use trueaxis::terms::{
    AccelerometerDelay, AccelerometerQuadratic, AllTerms, CubicFlexure, DitherErrors, ElasticRate,
    ForceProducts, GyroResponse, ResonantFlexure, ScaleByRate,
};
use trueaxis::{
    Chain, Fixed, FlexureResponse, NumberSystem, Parameters, Term, TermKind, TermRecords,
};

use crate::bounds::{prove_with, stage, still};
use crate::corners::{Corner, corners};

/// Every term at `share` of the end of its range, with these signs.
fn records(corner: &Corner, share: f64, signs: [f64; 3]) -> TermRecords {
    let period_s = 1.0 / corner.sample_rate_hz;
    let three = |largest: f64| signs.map(|sign| sign * share * largest).to_vec();
    // Half of 1/128 each, at twice the sensed limit of 5/2048 increment units.
    let largest = 2.0 * 5.0 / 2048.0;
    let unit = trueaxis::design_parameters::increment_unit_log2(corner.sample_rate_hz);
    let slope_s = 1.0 / 256.0 / largest * period_s / f64::from(1u8 << unit);
    // 1/1024 rad and 2^-14 at the largest velocity increment, 1.04 of 2^-10 with 2^-11 for a delay; as forces.
    let velocity = 1.04 / 1024.0 + 1.0 / 2048.0;
    let per_force = 256.0 * f64::from(1u8 << unit) / period_s;
    let tilt = 1.0 / 1024.0 / velocity / per_force;
    let square = 1.0 / 16384.0 / velocity / velocity / per_force / 256.0;
    // Three of them make half of 0.0155 of the largest force at a sample's end, 16/3 of the largest increment.
    let elastic = 0.0155 / 6.0 / (16.0 / 3.0 * velocity) * period_s / 256.0;
    let per_square = period_s.powi(2) / f64::from(1u8 << unit);
    let cubic = 32.0 * per_square.powi(3) * 8192.0 * 8192.0;
    let mut records = TermRecords::NONE;
    for (kind, values) in [
        (TermKind::GyroDelay, three(0.4 * period_s)),
        (TermKind::GyroBandwidth, three(period_s * period_s)),
        (TermKind::AccelDelay, three(0.4 * period_s)),
        (TermKind::GyroScaleQuadratic, three(slope_s)),
        (
            TermKind::GyroScaleCubic,
            three(63.0 * (period_s / f64::from(1u8 << unit)).powi(2)),
        ),
        (TermKind::GyroScaleAsymmetry, three(1.0 / 256.0)),
        (TermKind::GyroGBias, [0, 1, 2].map(|_| three(5e-5)).concat()),
        (
            TermKind::AxisTiltByForce,
            [three(tilt), three(tilt)].concat(),
        ),
        (TermKind::GyroG2Bias, three(square)),
        (
            TermKind::ElasticRateByForce,
            [0, 1, 2].map(|_| three(elastic)).concat(),
        ),
        (
            TermKind::ElasticRateByJerk,
            [0, 1, 2]
                .map(|_| three(7.0 / 3.0 * period_s.powi(2)))
                .concat(),
        ),
        (
            TermKind::AxisFlexureCubic,
            [three(cubic), three(cubic)].concat(),
        ),
        (
            TermKind::AxisFlexureMode,
            // A tilt of 1/16 by the largest acceleration: the bound of this mode's norm is 34.
            [
                three(1.8 * per_square),
                three(1.8 * per_square),
                vec![0.1 / period_s, 0.04],
            ]
            .concat(),
        ),
        (TermKind::DitherCubic, three(4e6)),
        (
            TermKind::DitherCrosstalk,
            [three(1.0 / 64.0), three(1.0 / 64.0)].concat(),
        ),
        (TermKind::AccelQuadratic, three(1024.0 / 128.0 / per_force)),
    ] {
        records.push(kind, &values).expect("room");
    }
    records
}

/// The corner with the largest share of the terms that it has room for, and no more samples an output than fit.
fn with_terms(corner: &Corner, signs: [f64; 3]) -> Option<Parameters> {
    let at = |share: f64| {
        let terms = records(corner, share, signs);
        corner.parameters().with(|p| p.terms = terms)
    };
    let fits = |share: f64| Chain::<Interval, AllTerms<Interval>>::check(&at(share)).is_ok();
    let shares = (0..=20).map(|step| 0.999 * 0.7f64.powi(step));
    shares.into_iter().find(|share| fits(*share)).map(at)
}

#[test]
fn no_word_wraps_with_every_term() {
    let mut worst: BTreeMap<(Operation, &str), (Bound, Corner)> = BTreeMap::new();
    let mut proofs = 0;
    let standing = corners().into_iter().filter_map(Corner::accepted);
    // Every eleventh: the corners repeat in steps that eleven does not divide.
    for (turn, corner) in standing.step_by(11).enumerate() {
        let signs = [[1.0, 1.0, 1.0], [-1.0, 1.0, -1.0]][turn % 2];
        let Some(parameters) = with_terms(&corner, signs) else {
            continue;
        };
        proofs += 1;
        for bound in prove_with::<AllTerms<Interval>>(&parameters, still) {
            let entry = worst
                .entry((bound.operation, stage(&bound)))
                .or_insert((bound, corner));
            if bound.headroom() < entry.0.headroom() {
                *entry = (bound, corner);
            }
        }
    }
    println!("{proofs} configurations");
    for ((operation, stage), (bound, corner)) in &worst {
        println!(
            "| {operation:?} | {stage} | i{} | {:.6e} | {:.3} | {corner} |",
            bound.bits,
            bound.value(),
            bound.headroom(),
        );
    }
    assert!(proofs > 100, "{proofs} configurations");
    let wraps: Vec<_> = worst.iter().filter(|(_, (b, _))| !b.fits()).collect();
    assert!(wraps.is_empty(), "{wraps:?}");
}

/// Every term alone, at an ordinary configuration.
#[test]
fn no_word_wraps_with_each_term_alone() {
    fn alone<T: Term<Interval>>(kinds: &[TermKind], corner: &Corner) {
        let all = records(corner, 0.25, [1.0, -1.0, 1.0]);
        let mut own = TermRecords::NONE;
        for kind in kinds {
            let values = all.values::<9>(*kind);
            own.push(*kind, &values[..kind.values()]).expect("room");
        }
        let parameters = corner.parameters().with(|p| p.terms = own);
        for bound in prove_with::<T>(&parameters, still) {
            assert!(bound.fits(), "{kinds:?} {bound:?}");
        }
    }
    let corner = Corner {
        samples_per_output: 10,
        sample_rate_hz: 4000.0,
        response: FlexureResponse::default(),
        cycles: 0.1,
        delay_s: 1e-5,
        adapts: false,
        gain: 1.0,
        signed: 0.1,
        weights: crate::corners::WEIGHTS[1],
    };
    alone::<(GyroResponse<Interval>,)>(&[TermKind::GyroDelay, TermKind::GyroBandwidth], &corner);
    alone::<(AccelerometerDelay<Interval>,)>(&[TermKind::AccelDelay], &corner);
    alone::<(ForceProducts<Interval>,)>(
        &[TermKind::AxisTiltByForce, TermKind::GyroG2Bias],
        &corner,
    );
    alone::<(ElasticRate<Interval>,)>(
        &[TermKind::ElasticRateByForce, TermKind::ElasticRateByJerk],
        &corner,
    );
    alone::<(DitherErrors<Interval>,)>(
        &[TermKind::DitherCubic, TermKind::DitherCrosstalk],
        &corner,
    );
    alone::<(CubicFlexure<Interval>,)>(&[TermKind::AxisFlexureCubic], &corner);
    alone::<(ResonantFlexure<Interval>,)>(&[TermKind::AxisFlexureMode], &corner);
    alone::<(AccelerometerQuadratic<Interval>,)>(&[TermKind::AccelQuadratic], &corner);
    alone::<(ScaleByRate<Interval>,)>(
        &[
            TermKind::GyroScaleQuadratic,
            TermKind::GyroScaleCubic,
            TermKind::GyroScaleAsymmetry,
        ],
        &corner,
    );
}

/// Sections of second order, from lightly damped ones to none.
fn section() -> impl Strategy<Value = [i32; 5]> {
    (0.06..1.9f64, 0.002..0.99f64, 0.1..0.9f64).prop_map(|(turn, damping, share)| {
        let radius = (-damping * turn).exp();
        let (a1, a2) = (
            -2.0 * radius * (turn * (1.0 - damping * damping).sqrt()).cos(),
            radius * radius,
        );
        let gain = 1.0 + a1 + a2;
        let [b0, b1] = [share * gain, (0.95 - share) * gain];
        [b0, b1, 0.05 * gain, -a1, -a2].map(Fixed::filter_coefficient)
    })
}

/// The impulse response in 64 bits, as long as it lasts.
fn response(factors: [i32; 5]) -> Vec<f64> {
    let [b0, b1, b2, c1, c2] = factors.map(|factor| f64::from(factor) / (1u32 << 30) as f64);
    let (mut inputs, mut outputs) = ([1.0, 0.0, 0.0], [0.0, 0.0]);
    (0..20_000)
        .map(|_| {
            let [now, one, two] = inputs;
            let [last, before] = outputs;
            let out = b0 * now + b1 * one + b2 * two + c1 * last + c2 * before;
            inputs = [0.0, now, one];
            outputs = [out, last];
            out
        })
        .collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(60))]

    /// No stream leaves the interval, and the worst one comes near its end: the inputs' signs are those of the impulse
    /// response, run backwards.
    #[test]
    fn no_stream_leaves_the_interval_of_a_section(
        factors in section(),
        noise in prop::collection::vec(-1.0..1.0f64, 500),
    ) {
        let response = response(factors);
        let norm: f64 = response.iter().map(|h| h.abs()).sum();
        // The output's word holds 1/8; an input of at least 2^16 LSB, so that rounding is small against it.
        let largest = ((1u64 << 30) as f64 / norm) as i32;
        prop_assume!(largest > 1 << 16);
        let input = Span::within(largest);
        let at_rest = [Span::default(); 2];
        let bound = Interval::section(&factors.map(Span::point), [input; 3], at_rest);
        let worst = response.iter().rev().map(|h| if *h < 0.0 { -largest } else { largest });
        let drawn = noise.iter().map(|share| (share * f64::from(largest)) as i32);
        let loud = noise.iter().map(|share| if *share < 0.0 { -largest } else { largest });
        let (mut inputs, mut outputs) = ([0; 2], [0; 2]);
        let mut most = 0;
        for now in drawn.chain(loud).chain(worst) {
            let out = Fixed::section(&factors, [now, inputs[0], inputs[1]], outputs);
            prop_assert!(bound.contains(out), "{out} {bound:?}");
            inputs = [now, inputs[0]];
            outputs = [out, outputs[0]];
            most = most.max(out.abs());
        }
        prop_assert!(i128::from(most) * 100 > bound.high * 98, "{most} {bound:?}");
    }
}
