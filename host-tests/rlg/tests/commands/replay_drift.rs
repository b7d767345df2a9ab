//! The slope of an angle and its standard deviation, on angles of known slope and noise.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use rlg::replay::slope::slope;

const PERIODS: usize = 1600;

const TRIALS: usize = 300;

/// Slope of every angle, per period.
const TRUE: f64 = 0.01;

/// Simulates increments of an angle that drifts, is measured with white noise of variance `white`, and walks by `walk` per
/// period.
fn increments(random: &mut ChaCha8Rng, white: f64, walk: f64) -> Vec<f64> {
    let mut normal = |variance: f64| -> f64 {
        let value: f64 = StandardNormal.sample(random);
        variance.sqrt() * value
    };
    let mut before = normal(white);
    let increment = |_| {
        let read = normal(white);
        let moved = read - before;
        before = read;
        TRUE + normal(walk) + moved
    };
    (0..PERIODS).map(increment).collect()
}

/// Computes the shares of trials with an error within 1 and 2 stated σ, and the rms error over the rms of the stated σ.
fn coverage(seed: u64, white: f64, walk: f64, split: impl Fn(&[f64]) -> Vec<&[f64]>) -> [f64; 3] {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let (mut within, mut errors, mut stated) = ([0.0; 2], 0.0, 0.0);
    for _ in 0..TRIALS {
        let increments = increments(&mut random, white, walk);
        let found = slope(split(&increments)).expect("increments");
        let (error, std) = ((found.value - TRUE).abs(), found.std.expect("noise"));
        for (count, limit) in within.iter_mut().zip([1.0, 2.0]) {
            *count += f64::from(error < limit * std) / TRIALS as f64;
        }
        errors += error * error;
        stated += std * std;
    }
    [within[0], within[1], (errors / stated).sqrt()]
}

/// Returns three standard deviations of a share that is `share`.
fn scatter(share: f64) -> f64 {
    3.0 * (share * (1.0 - share) / TRIALS as f64).sqrt()
}

fn whole(increments: &[f64]) -> Vec<&[f64]> {
    vec![increments]
}

/// Splits the increments into three runs, with unmeasured ones between them.
fn with_gaps(increments: &[f64]) -> Vec<&[f64]> {
    vec![
        &increments[..300],
        &increments[320..321],
        &increments[350..],
    ]
}

#[test]
fn the_slope_s_standard_deviation_holds_for_walks_in_any_white_noise() {
    let n = PERIODS as f64;
    for (seed, split) in [(1, whole as fn(&[f64]) -> Vec<&[f64]>), (2, with_gaps)] {
        for [white, walk] in [[1.0, 1e3 / (n * n)], [1.0, 1e6 / (n * n)], [0.0, 1.0]] {
            let [one, two, ratio] = coverage(seed, white, walk, split);
            println!(
                "q/R {:.1e}: 1 σ {one:.3}, 2 σ {two:.3}, rms {ratio:.3} σ",
                walk / white
            );
            assert!((one - 0.683).abs() < scatter(0.683) + 0.05, "{one}");
            assert!((two - 0.954).abs() < scatter(0.954) + 0.01, "{two}");
        }
    }
}

#[test]
fn without_a_walk_the_slope_is_that_of_the_straight_line_and_its_standard_deviation_is_wide() {
    let n = PERIODS as f64;
    for split in [whole as fn(&[f64]) -> Vec<&[f64]>, with_gaps] {
        let [one, two, ratio] = coverage(3, 1.0, 0.0, split);
        println!("white: 1 σ {one:.3}, 2 σ {two:.3}, rms {ratio:.3} σ");
        assert!(one > 0.683 && two > 0.954);
        // The recording is too short to exclude a walk: σ is widened for it, within bounds.
        assert!(ratio > 0.2, "{ratio}");
    }
    // Variance of a straight line's slope: 12/n³; of the difference of the ends: 2/n².
    let mut random = ChaCha8Rng::seed_from_u64(4);
    let (mut fitted, mut ends) = (0.0, 0.0);
    for _ in 0..TRIALS {
        let increments = increments(&mut random, 1.0, 0.0);
        fitted += (slope([&increments[..]]).expect("increments").value - TRUE).powi(2);
        ends += (increments.iter().sum::<f64>() / n - TRUE).powi(2);
    }
    let [fitted, ends] = [fitted, ends].map(|squares| (squares / TRIALS as f64).sqrt());
    println!(
        "rms error {fitted:.2e}, of the straight line {:.2e}, of the ends {ends:.2e}",
        (12.0 / n.powi(3)).sqrt()
    );
    assert!(fitted < 2.0 * (12.0 / n.powi(3)).sqrt() && fitted < 0.25 * ends);
}

#[test]
fn increments_without_noise_or_too_few_have_a_slope_and_no_standard_deviation() {
    let found = slope([&[0.25; 10][..]]).expect("increments");
    assert!((found.value - 0.25).abs() < 1e-12);
    assert!(found.std.is_none_or(|std| std < 1e-12), "{found:?}");
    let two = slope([&[1.0, 2.0][..]]).expect("increments");
    assert_eq!((two.value, two.std), (1.5, None));
    assert_eq!(slope([&[][..]]), None);
}
