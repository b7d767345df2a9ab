//! Temperature and derivative as computed by a replay, compared with those of a unit that warms exponentially.

use rlg::replay::warming::Warming;

const RISE_K: f64 = 12.0;
const TIME_CONSTANT_S: f64 = 30.0;
const NOISE_K: f64 = 0.005;

/// Samples ten times a second for a minute; noise uniform, of rms `noise_k`.
fn readings(noise_k: f64) -> Vec<(f64, f64)> {
    let mut state = 1u64;
    (1..=600)
        .map(|row| {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            let uniform = (state >> 11) as f64 / (1u64 << 53) as f64 - 0.5;
            let time_s = f64::from(row) * 0.1;
            (time_s, truth(time_s)[0] + noise_k * 12f64.sqrt() * uniform)
        })
        .collect()
}

fn truth(time_s: f64) -> [f64; 2] {
    let left = (-time_s / TIME_CONSTANT_S).exp();
    [
        293.0 + RISE_K * (1.0 - left),
        RISE_K / TIME_CONSTANT_S * left,
    ]
}

/// Computes the errors of T and dT/dt 50 ms after each sample from `from_s` on.
fn errors(readings: &[(f64, f64)], from_s: f64) -> Vec<[f64; 2]> {
    let mut warming = Warming::default();
    let mut errors = Vec::new();
    for known in 1..=readings.len() {
        warming.take(&readings[..known]);
        let time_s = readings[known - 1].0 + 0.05;
        if time_s > from_s {
            let (seen, right) = (warming.at(time_s), truth(time_s));
            errors.push([seen[0] - right[0], seen[1] - right[1]]);
        }
    }
    errors
}

#[test]
fn an_exponential_is_followed_without_lag() {
    // Truncation error of a parabola over h = 10 s at its end: of dT/dt h²/(10 τ²) = 1.1 %, of T h³/(120 τ³) of the rise.
    let errors = errors(&readings(0.0), 10.0);
    for [kelvin, rate_k_s] in errors {
        assert!(
            rate_k_s.abs() < 0.012 * RISE_K / TIME_CONSTANT_S,
            "{rate_k_s}"
        );
        assert!(kelvin.abs() < 4e-4 * RISE_K, "{kelvin}");
    }
}

#[test]
fn noise_is_averaged_as_least_squares_do() {
    let with = errors(&readings(NOISE_K), 12.0);
    let without = errors(&readings(0.0), 12.0);
    let rms = |of: usize| {
        let squares = with
            .iter()
            .zip(&without)
            .map(|(a, b)| (a[of] - b[of]).powi(2));
        (squares.sum::<f64>() / with.len() as f64).sqrt()
    };
    // 3 σ/√n and √192 σ/(h √n); some five independent stretches of 10 s determine the rms within a third.
    let expected = [3.0 * NOISE_K / 10.0, 192f64.sqrt() * NOISE_K / 100.0];
    for (of, expected) in expected.into_iter().enumerate() {
        let ratio = rms(of) / expected;
        assert!((0.6..1.5).contains(&ratio), "{of}: {ratio}");
    }
}

#[test]
fn a_thermometer_that_stops_is_not_extrapolated() {
    let readings = readings(0.0);
    let mut warming = Warming::default();
    warming.take(&readings[..300]);
    let due = warming.at(30.1);
    assert_eq!(warming.at(1000.0), warming.at(31.0));
    assert!((due[0] - truth(30.1)[0]).abs() < 0.005);
    // One sample determines no derivative; two at one instant neither.
    let mut warming = Warming::default();
    assert_eq!(warming.at(1.0), [0.0; 2]);
    warming.take(&[(1.0, 300.0), (1.0, 301.0)]);
    assert_eq!(warming.at(1.0), [301.0, 0.0]);
}
