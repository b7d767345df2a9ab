//! Dither faults: status, terms switched off, and end of both.

use trueaxis::{CrossAxis, F32, Faults, Fixed, NumberSystem, Parameters, Sample, Status};

use crate::frames;
use crate::triad::Triad;

/// Samples 4000 to 7999 are faulty in this way, given the sample and one from the fault's beginning.
type Fault = fn(&mut Sample, &Sample);

/// Two windows of 120 samples and an output period: latest report of a fault \[frames\].
const LATEST: usize = 25;

fn parameters() -> Parameters {
    Triad::default().parameters().with(|p| {
        p.flexure_s2 = CrossAxis::from_array([7e-8; 6]);
        p.adaptation_time_s = 1.0;
    })
}

fn assert_seen<N: NumberSystem>(
    fault: Fault,
    bits: Status,
    counter: fn(&Faults) -> u32,
    off: bool,
) {
    let mut samples: Vec<_> = Triad::default().stream().take(12_000).collect();
    let first = samples[4000];
    samples[4000..8000]
        .iter_mut()
        .for_each(|sample| fault(sample, &first));
    let (frames, state) = frames::<N>(&parameters(), samples.iter().copied());
    let shown = |frame: usize| frames[frame].status;
    let any = |range: std::ops::Range<usize>, bits: Status| {
        range
            .clone()
            .any(|frame| shown(frame).bits() & bits.bits() != 0)
    };
    let all = |range: std::ops::Range<usize>, bits: Status| {
        range.clone().all(|frame| shown(frame).contains(bits))
    };
    let findings = Status::PICKOFF_FAILED
        .union(Status::DITHER_STOPPED)
        .union(Status::DITHER_OUT_OF_BAND)
        .union(Status::COUNTER_STUCK)
        .union(Status::DYNAMIC_TERM_OFF);
    assert!(!any(0..400, findings), "{}: before", N::NAME);
    assert!(
        all(400 + LATEST..800, bits),
        "{}: {:?}",
        N::NAME,
        shown(500)
    );
    assert_eq!(
        all(400 + LATEST..800, Status::DYNAMIC_TERM_OFF),
        off,
        "{}",
        N::NAME
    );
    assert!(!any(800 + LATEST..1200, findings), "{}: after", N::NAME);
    assert!(counter(state.faults()) >= 400 - LATEST as u32);
    // The switch itself may be a step beyond the acceleration limit: that is then the first fault seen.
    let first = state.faults().first;
    assert!(
        (4000..4000 + 10 * LATEST as u32).contains(&first.sample),
        "{first:?}"
    );
    assert_eq!(state.health(), [Status::default(); 3]);
}

fn assert_seen_by_both(fault: Fault, bits: Status, counter: fn(&Faults) -> u32, off: bool) {
    assert_seen::<F32>(fault, bits, counter, off);
    assert_seen::<Fixed>(fault, bits, counter, off);
}

#[test]
fn a_pickoff_that_stands_still_has_failed_and_the_flexure_term_is_off() {
    assert_seen_by_both(
        |sample, first| sample.pickoff_codes[1] = first.pickoff_codes[1],
        Status::PICKOFF_FAILED,
        |faults| faults.pickoff_failed,
        true,
    );
}

#[test]
fn a_block_that_stands_still_has_stopped() {
    assert_seen_by_both(
        |sample, first| {
            sample.pickoff_codes[2] = first.pickoff_codes[2];
            // Counts of the slow motion alone.
            sample.pulse_counts[2] = i32::from(sample.pulse_counts[0] > 0);
        },
        Status::DITHER_STOPPED,
        |faults| faults.dither_stopped,
        false,
    );
}

#[test]
fn a_third_of_the_amplitude_is_out_of_band() {
    assert_seen_by_both(
        |sample, _| {
            sample.pickoff_codes[0] /= 3;
            sample.pulse_counts[0] /= 3;
        },
        Status::DITHER_OUT_OF_BAND,
        |faults| faults.dither_out_of_band,
        false,
    );
}

#[test]
fn a_counter_that_gives_the_same_number_is_stuck_and_the_flexure_term_is_off() {
    assert_seen_by_both(
        |sample, _| sample.pulse_counts[1] = 0,
        Status::COUNTER_STUCK,
        |faults| faults.counter_stuck,
        true,
    );
    assert_seen_by_both(
        |sample, first| sample.pulse_counts[0] = first.pulse_counts[0],
        Status::COUNTER_STUCK,
        |faults| faults.counter_stuck,
        true,
    );
}

/// Half to one and a half of nominal is healthy, below a tenth the block stands still. The drive randomises by 7 % rms.
#[test]
fn bands_of_the_amplitude_end_where_they_are_documented_to() {
    let said = |ratio: f64| {
        let nominal = Triad::default();
        let triad = Triad {
            amplitude_rad: nominal.amplitude_rad.map(|rad| ratio * rad),
            ..nominal
        };
        let found = |frames: &[trueaxis::OutputFrame]| {
            let all = frames[LATEST..]
                .iter()
                .fold(Status::default(), |all, f| all.union(f.status));
            let of = |bits: Status| all.contains(bits);
            [
                of(Status::DITHER_OUT_OF_BAND),
                of(Status::DITHER_STOPPED),
                of(Status::PICKOFF_FAILED),
            ]
        };
        let (f32_frames, _) = frames::<F32>(&parameters(), triad.stream().take(4000));
        let (fixed_frames, _) = frames::<Fixed>(&parameters(), triad.stream().take(4000));
        assert_eq!(found(&f32_frames), found(&fixed_frames), "{ratio}");
        found(&f32_frames)
    };
    for (ratio, expected) in [
        (1.0, [false, false, false]),
        (0.7, [false, false, false]),
        (0.45, [true, false, false]),
        (1.25, [false, false, false]),
        (1.6, [true, false, false]),
        (0.15, [true, false, false]),
        (0.07, [false, true, false]),
    ] {
        assert_eq!(said(ratio), expected, "{ratio} of the nominal amplitude");
    }
}

#[test]
fn a_dither_at_another_frequency_is_out_of_band() {
    let said = |frequency_hz: f64| {
        let triad = Triad {
            frequency_hz: [frequency_hz, 403.9, 438.7],
            ..Triad::default()
        };
        let parameters = parameters();
        let (f32_frames, _) = frames::<F32>(&parameters, triad.stream().take(8000));
        let (fixed_frames, _) = frames::<Fixed>(&parameters, triad.stream().take(8000));
        let count = |frames: &[trueaxis::OutputFrame]| {
            let out =
                |frame: &&trueaxis::OutputFrame| frame.status.contains(Status::DITHER_OUT_OF_BAND);
            frames.iter().filter(out).count()
        };
        (count(&f32_frames), count(&fixed_frames))
    };
    // Nominal is 371.3 Hz, the band 20 %.
    assert_eq!(said(371.3), (0, 0));
    assert_eq!(said(371.3 * 0.9), (0, 0));
    assert_eq!(said(371.3 * 1.1), (0, 0));
    for ratio in [0.7, 1.3] {
        let (single, fixed) = said(371.3 * ratio);
        assert!(single > 700 && fixed > 700, "{ratio}: {single} {fixed}");
    }
}

/// While a pickoff is gone its gyro's increments hold the dither; the flexure term would multiply it into
/// the other axes.
#[test]
fn a_failed_pickoff_injects_no_drift_through_the_flexure() {
    let still = Triad {
        coning: (15.0, 0.0),
        ..Triad::default()
    };
    let mut samples: Vec<_> = still.stream().take(40_000).collect();
    let first = samples[4000];
    for sample in &mut samples[4000..] {
        sample.pickoff_codes[1] = first.pickoff_codes[1];
    }
    let with = parameters();
    let without = with.with(|p| p.flexure_s2 = CrossAxis::default());
    let codes = |parameters: &Parameters| {
        let (frames, _) = frames::<Fixed>(parameters, samples.iter().copied());
        frames[400 + LATEST..]
            .iter()
            .map(|frame| frame.dtheta_codes)
            .collect::<Vec<_>>()
    };
    let apart = codes(&with).iter().zip(codes(&without)).any(|(a, b)| {
        // A carried part of a code may differ from before the fault.
        (0..3).any(|axis| (a[axis] - b[axis]).abs() > 1)
    });
    assert!(!apart);
}
