//! The rounding residual is carried: constant input, where nothing averages out by itself.

use trueaxis::{F32, Fixed, NumberSystem, OutputFrame, Parameters, Sample};

use crate::motion::as_built;
use crate::{CODE_RAD, DEG_H, run};

/// Drift that arithmetic may add \[°/h\]: a hundredth of the best ring lasers' 0.01 °/h.
const ARITHMETIC_DRIFT_DEG_H: f64 = 1e-4;

const SAMPLES: usize = 1_000_000;

/// Eq. (7) for constant counts over all samples but the first, which only primes \[rad\].
fn expected_rad(p: &Parameters, counts: [i32; 3]) -> [f64; 3] {
    let r = [0, 1, 2].map(|i| {
        (1.0 - p.scale_error[i]) * p.pulse_weight_rad[i] * f64::from(counts[i])
            - p.bias_rad_s[i] / p.sample_rate_hz
    });
    let e = p.installation_rad;
    let case = [
        r[0] + e.xy * r[2] + e.xz * r[1],
        r[1] + e.yz * r[0] + e.yx * r[2],
        r[2] + e.zx * r[1] + e.zy * r[0],
    ];
    case.map(|d| d * (SAMPLES - 1) as f64)
}

fn total_rad(frames: &[OutputFrame]) -> [f64; 3] {
    let mut sum = [0i64; 3];
    for frame in frames {
        for (sum, code) in sum.iter_mut().zip(frame.dtheta_codes) {
            *sum += i64::from(code);
        }
    }
    sum.map(|sum| sum as f64 * CODE_RAD)
}

fn assert_no_drift<N: NumberSystem>(counts: [i32; 3]) {
    let parameters = as_built();
    let sample = Sample {
        pulse_counts: counts,
        pickoff_codes: [1234, -77, 0],
        ..Sample::default()
    };
    let (frames, _) = run::<N>(&parameters, std::iter::repeat_n(sample, SAMPLES));
    let expected = expected_rad(&parameters, counts);
    let total = total_rad(&frames);
    let duration_s = SAMPLES as f64 / parameters.sample_rate_hz;
    for i in 0..3 {
        let drift_deg_h = (total[i] - expected[i]) / duration_s / DEG_H;
        println!("{} {counts:?} axis {i}: {drift_deg_h:.1e} deg/h", N::NAME);
        assert!(
            drift_deg_h.abs() < ARITHMETIC_DRIFT_DEG_H,
            "{} {counts:?} axis {i}: {drift_deg_h} deg/h",
            N::NAME
        );
    }
}

#[test]
fn a_million_equal_samples_do_not_drift() {
    // At rest only the bias remains; one pulse; 50 °/s; 100 °/s with both signs.
    for counts in [[0, 0, 0], [1, -1, 1], [57, 56, 59], [113, -112, 1]] {
        assert_no_drift::<F32>(counts);
        assert_no_drift::<Fixed>(counts);
    }
}

#[test]
fn the_frames_sum_to_the_angle_within_one_code() {
    // Weights that are exact and no small terms: every digit must come out.
    let parameters = Parameters::default().with(|p| {
        p.pulse_weight_rad = [33.0 / (1u64 << 39) as f64; 3];
        p.samples_per_output = 7;
    });
    let sample = Sample {
        pulse_counts: [1, 5, -3],
        ..Sample::default()
    };
    let samples = 7 * 9001;
    let exact = [1.0, 5.0, -3.0].map(|n| n * 33.0 / 16.0 * f64::from(samples - 1));
    let codes = |frames: Vec<OutputFrame>| total_rad(&frames).map(|rad| rad / CODE_RAD);
    for total in [
        codes(run::<F32>(&parameters, std::iter::repeat_n(sample, samples as usize)).0),
        codes(run::<Fixed>(&parameters, std::iter::repeat_n(sample, samples as usize)).0),
    ] {
        for i in 0..3 {
            assert!((total[i] - exact[i]).abs() <= 1.0, "{total:?} {exact:?}");
        }
    }
}
