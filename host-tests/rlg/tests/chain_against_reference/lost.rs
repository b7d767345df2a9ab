//! Lost samples: the counters keep counting, so that no angle is lost with them.

use crate::arithmetic::{AGREEMENT_DEG_H, EARTH, adapting, bench_coning};
use crate::motion::{Both, Motion, Slew};
use crate::unit::{Firmware, Reference, Runner, Triad, as_built, drift_deg_h, reading};
use crate::{PERIOD_S, TEN_MINUTES};
use nalgebra::{UnitQuaternion, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rlg::reference::coning::Output;
use trueaxis::{F32, Fixed, Sample};

const SAMPLES: usize = 40_000;

/// Cumulative counters: counts of a lost sample are in the next one that arrives.
#[derive(Default)]
struct Counters {
    held: [i32; 3],
}

impl Counters {
    fn read(&mut self, mut sample: Sample, lost: bool) -> Option<Sample> {
        for (count, held) in sample.pulse_counts.iter_mut().zip(&mut self.held) {
            *count += *held;
            *held = if lost { *count } else { 0 };
        }
        (!lost).then_some(sample)
    }
}

/// Draws losses of 1 to 40 periods, 1 to `most_between` apart; none in the first and the last hundred.
fn losses(seed: u64, samples: usize, most_between: usize) -> Vec<bool> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut lost = vec![false; samples];
    let mut k = 100;
    while k + 200 < samples {
        let length = rng.random_range(1..=40);
        lost[k..k + length].fill(true);
        k += length + rng.random_range(1..=most_between);
    }
    lost
}

#[test]
fn the_reference_keeps_the_angle_over_lost_samples() {
    // fine pulses, so that only the errors of the gaps remain
    let known = as_built().with(|p| p.pulse_weight_rad = [2e-9; 3]);
    let mut triad = Triad::new(&known, 2, SAMPLES as f64 * PERIOD_S);
    // constant rate: the motion within a gap follows from its ends
    let rate = Vector3::new(0.3, -0.2, 0.4);
    let mut motion = Slew(rate.into());
    let samples: Vec<Sample> = (0..SAMPLES)
        .map(|k| triad.read(k, motion.sensed(k)))
        .collect();
    let lost = losses(4, SAMPLES, 200);
    let mut whole = Reference::new(&known).chain;
    let mut gapped = Reference::new(&known).chain;
    let mut attitude = [UnitQuaternion::identity(); 2];
    let turn = |attitude: &mut UnitQuaternion<f64>, output: Option<Output>| {
        if let Some(output) = output {
            *attitude *= UnitQuaternion::from_scaled_axis(output.rotation_rad);
        }
    };
    let mut counters = Counters::default();
    for (sample, lost) in samples.into_iter().zip(&lost) {
        let output = whole.process(&reading(&known, &sample)).output;
        turn(&mut attitude[0], output);
        let output = match counters.read(sample, *lost) {
            Some(sample) => gapped.process(&reading(&known, &sample)).output,
            None => gapped.process_lost(1),
        };
        turn(&mut attitude[1], output);
    }
    let gaps = lost.windows(2).filter(|pair| pair[1] && !pair[0]).count();
    assert!(gaps > 200, "{gaps}");
    let apart = attitude[0].angle_to(&attitude[1]);
    // At a gap's end the block's quarter-period motion is unknown for one period: 2πFd A, at most 4e-5 rad of angle, which
    // later cancels. It is taken as uniform over the gap, during half of which the case rotated. Gaps of 1 to 40 periods at
    // random, one sigma; three are accepted.
    let unknown_rad = 4e-5 / 2.0_f64.sqrt();
    let half_gap_s = 0.5 * 24.0 * PERIOD_S;
    let bound_rad = 3.0 * unknown_rad * rate.norm() * half_gap_s * (gaps as f64).sqrt();
    println!("{apart:.1e} rad apart after {gaps} gaps, at most {bound_rad:.1e} expected");
    assert!(apart < bound_rad, "{apart}");
}

#[test]
fn ten_minutes_with_lost_samples_agree_with_the_reference() {
    // The strip does not adapt on windows of 120 periods with a loss: if it adapts, losses leave most of them intact.
    for (name, known, most_between) in [("frozen", as_built(), 200), ("adapting", adapting(), 4000)]
    {
        // Chain and reference omit different parts of the flexure around a gap.
        let known = known.with(|p| p.flexure_s2 = Default::default());
        let samples = TEN_MINUTES;
        let mut triad = Triad::new(&as_built(), 6, samples as f64 * PERIOD_S);
        let mut motion = Both(EARTH, bench_coning());
        let lost = losses(9, samples, most_between);
        let mut reference = Reference::new(&known);
        let mut single = Firmware::<F32>::new(&known);
        let mut fixed = Firmware::<Fixed>::new(&known);
        let mut apart = [Vector3::zeros(); 2];
        let mut counters = Counters::default();
        for (k, lost) in lost.iter().enumerate() {
            let arrived = counters.read(triad.read(k, motion.sensed(k)), *lost);
            let step = |runner: &mut dyn Runner| match &arrived {
                Some(sample) => runner.take(sample),
                None => runner.lose(),
            };
            let expected = step(&mut reference);
            let got = [step(&mut single), step(&mut fixed)];
            for (sum, got) in apart.iter_mut().zip(got) {
                assert_eq!(
                    got.is_some(),
                    expected.is_some(),
                    "frames at different samples"
                );
                if let (Some(got), Some(expected)) = (got, expected) {
                    *sum += got - expected;
                }
            }
        }
        for (core, angle) in ["f32", "fixed"].into_iter().zip(apart) {
            let drift = drift_deg_h(&angle, samples);
            println!("{name}, {core}: {drift:.1e} deg/h from the reference");
            assert!(drift <= AGREEMENT_DEG_H, "{name}, {core}: {drift} deg/h");
        }
    }
}
