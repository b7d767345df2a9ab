//! Columns made from a noisy reference fit nothing where nothing is left out (errors in variables).

use rlg_plan::{CataloguePlan, GatePlan, ReferenceNoisePlan};
use std::f64::consts::TAU;

use nalgebra::Matrix3;
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rlg_catalogue::signals::{CaseMotion, Inputs, Motions};
use rlg_catalogue::{Column, Sensed, Signals};
use rlg_inference::transform::Transform;
use rlg_inference::{Dct, NoiseBasis, NoiseLevels, Observations};
use rlg_signal::conditioned::{noise_expected, noise_left, weights};
use rlg_signal::reference_noise::{NoiseTerm, measure};
use rlg_signal::shrinkage::{Powers, Shrunk, shrink};

const RATE_HZ: f64 = 100.0;
const ROWS: usize = 4096;

/// Trials of a mean: a third of a standard deviation shows in each.
const SEEDS: u64 = 40;

/// The same for the figures of `docs/measured.md`.
const SEEDS_IN_FULL: u64 = 100;

/// Columns whose score is asked.
const COLUMNS: [(&str, Column); 9] = [
    ("increment", Column::Increment(0)),
    ("its derivative", Column::Delay(0)),
    ("jerk", Column::Jerk(0)),
    ("|rate|", Column::Magnitude(0)),
    ("rate squared", Column::Square(0)),
    ("acceleration times rate", Column::Flexure(0, 1)),
    ("cross rate", Column::Increment(1)),
    ("cross jerk", Column::Jerk(1)),
    ("flexure", Column::Flexure(2, 1)),
];

/// A motion: its angle at a time \[rad\], by axis.
type Motion = fn(f64, usize) -> f64;

fn still(_: f64, _: usize) -> f64 {
    0.0
}

fn sine(time_s: f64, axis: usize) -> f64 {
    0.05 * (TAU * 0.7 * time_s + axis as f64).sin()
}

fn sweep(time_s: f64, axis: usize) -> f64 {
    2e-3 * (TAU * (0.2 + 0.1 * time_s) * time_s + 2.0 * axis as f64).sin()
}

/// White noise of the reference's rate and angle per row, and of the gyros' rate \[rad\].
struct Noise {
    walk: f64,
    angle: f64,
    gyro: f64,
}

/// Scores of the columns on gyro x in one trial \[σ\].
fn scores(motion: Motion, noise: &Noise, declared_over_true: f64, seed: u64) -> Vec<f64> {
    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
    let mut normals = |size: f64, count: usize| -> Vec<f64> {
        let draw = StandardNormal.sample_iter(&mut rng);
        draw.take(count).map(|value: f64| size * value).collect()
    };
    let mut reference: [Vec<f64>; 3] = Default::default();
    let mut residual: [Vec<f64>; 3] = Default::default();
    for axis in 0..3 {
        let angles = normals(noise.angle, ROWS + 1);
        let walk = normals(noise.walk, ROWS);
        let gyro = normals(noise.gyro, ROWS);
        for row in 0..ROWS {
            let at = |row: usize| motion(row as f64 / RATE_HZ, axis);
            let error = walk[row] + angles[row + 1] - angles[row];
            reference[axis].push(at(row + 1) - at(row) + error);
            residual[axis].push(gyro[row] - error);
        }
    }
    let observations = Observations::separate(&[true; ROWS], 1);
    let basis = NoiseBasis::new(&observations);
    let dct = Dct::new(ROWS);
    let fitted: Vec<NoiseLevels> = residual
        .iter()
        .map(|residual| {
            let mut spectrum = residual.clone();
            dct.forward(&mut spectrum);
            let power =
                |bin: &std::ops::Range<usize>| spectrum[bin.clone()].iter().map(|c| c * c).sum();
            let powers: Vec<f64> = basis.bins.iter().map(power).collect();
            let start = NoiseLevels {
                white: noise.gyro.powi(2),
                angle: noise.angle.powi(2).max(1e-3 * noise.gyro.powi(2)),
                ..NoiseLevels::default()
            };
            basis.fit(&powers, start, [true, true, false, false])
        })
        .collect();
    let declared = [
        NoiseLevels {
            white: (declared_over_true * noise.walk).powi(2),
            ..NoiseLevels::default()
        },
        NoiseLevels {
            angle: (declared_over_true * noise.angle).powi(2),
            ..NoiseLevels::default()
        },
    ];
    let unknown = [(1.0, 0.0), (0.0, 1.0)].map(|(white, angle)| NoiseLevels {
        white,
        angle,
        ..NoiseLevels::default()
    });
    let terms: Vec<NoiseTerm> = declared
        .into_iter()
        .zip(unknown)
        .map(|(levels, unknown)| {
            let is_declared = levels.white + levels.angle > 0.0;
            NoiseTerm {
                shape: basis.by_coefficient(if is_declared { levels } else { unknown }),
                is_declared,
            }
        })
        .collect();
    let shrunk: [Shrunk; 3] = std::array::from_fn(|axis| {
        let of_residual = basis.by_coefficient(fitted[axis]);
        let seen = [true; ROWS];
        let gate = GatePlan::default();
        let shares = measure(
            (&reference[axis], &residual[axis]),
            &terms,
            &of_residual,
            &seen,
            RATE_HZ,
            1.0,
            (&ReferenceNoisePlan::default(), &gate.frames),
        );
        let sum = |of: &dyn Fn(usize) -> f64| -> Vec<f64> {
            (0..ROWS)
                .map(|k| {
                    let sum: f64 = (0..2).map(|term| of(term) * terms[term].shape[k]).sum();
                    sum.min(of_residual[k])
                })
                .collect()
        };
        let of_reference = sum(&|term| shares[term].share);
        let of_fit = (2.0 / ROWS as f64).sqrt();
        let uncertain = sum(&|term| shares[term].std + of_fit * shares[term].share);
        let toward = weights(&of_reference, &of_residual);
        let mut filtered = residual[axis].clone();
        dct.forward(&mut filtered);
        filtered
            .iter_mut()
            .zip(&toward)
            .for_each(|(value, weight)| *value *= weight);
        dct.inverse(&mut filtered);
        let conditioned: Vec<f64> = reference[axis]
            .iter()
            .zip(&filtered)
            .map(|(m, e)| m + e)
            .collect();
        let left = noise_left(&of_reference, &uncertain, &toward, &of_residual, &gate);
        let powers = Powers {
            left: &left,
            expected: &noise_expected(&of_reference, &toward, &of_residual, &gate),
            before: &of_reference,
            uncertain: &uncertain,
            residual: &of_residual,
        };
        shrink(&conditioned, &powers, &seen, RATE_HZ, &gate)
    });
    let [x, y, z] = shrunk;
    let motions = Motions {
        measured_rad: std::sync::Arc::new(reference),
        independent: CaseMotion::new([x.values, y.values, z.values], RATE_HZ),
        likeliest: CaseMotion::new([x.likeliest, y.likeliest, z.likeliest], RATE_HZ),
        dither_rad: None,
    };
    let signals = Signals::new(
        RATE_HZ,
        motions,
        Inputs::default(),
        rlg_catalogue::signals::Path::default(),
        [0.0; 3],
        (Matrix3::identity(), Matrix3::identity()),
        &CataloguePlan::default(),
    );
    let noise = basis.by_coefficient(fitted[0]);
    let (transform, _) = Transform::with_basis(observations, fitted[0]);
    let of_residual = transform.spectrum(&residual[0]);
    COLUMNS
        .iter()
        .map(|(_, column)| {
            let values = transform.spectrum(&Sensed::tried(*column, 0, &signals).values(&signals));
            let (mut score, mut information) = (0.0, 0.0);
            for ((value, left), noise) in values.iter().zip(&of_residual).zip(&noise) {
                score += value * left / noise;
                information += value * value / noise;
            }
            if information > 0.0 {
                score / information.sqrt()
            } else {
                0.0
            }
        })
        .collect()
}

#[test]
fn the_mean_score_of_every_column_under_the_null_is_nothing_whatever_noise_was_declared() {
    means_are_nothing(SEEDS);
}

#[test]
#[ignore = "many seeds: --test null_score -- --ignored in_full"]
fn the_mean_score_of_every_column_under_the_null_is_nothing_in_full() {
    means_are_nothing(SEEDS_IN_FULL);
}

fn means_are_nothing(seeds: u64) {
    let motions: [(&str, Motion); 3] = [("still", still), ("sine", sine), ("sweep", sweep)];
    let gyro = 1e-6;
    let noises = [
        (
            "fine encoder",
            Noise {
                walk: 0.0,
                angle: 1e-7,
                gyro,
            },
        ),
        (
            "coarse encoder",
            Noise {
                walk: 0.0,
                angle: 1e-5,
                gyro,
            },
        ),
        (
            "as noisy as the gyros",
            Noise {
                walk: gyro,
                angle: 0.0,
                gyro,
            },
        ),
        (
            "fibre-optic",
            Noise {
                walk: 4e-6,
                angle: 1e-7,
                gyro,
            },
        ),
    ];
    let mut far = Vec::new();
    for (motion_name, motion) in motions {
        for (noise_name, noise) in &noises {
            for declared_over_true in [0.0, 0.3, 1.0, 3.0] {
                let mut sums = [0.0; COLUMNS.len()];
                for seed in 0..seeds {
                    for (sum, score) in
                        sums.iter_mut()
                            .zip(scores(motion, noise, declared_over_true, seed))
                    {
                        *sum += score / seeds as f64;
                    }
                }
                for ((column, _), mean) in COLUMNS.iter().zip(sums) {
                    println!(
                        "{motion_name}, {noise_name}, declared × {:.1}, {column}: {mean:+.2} σ",
                        declared_over_true
                    );
                    // 0.2 σ, and three standard errors of the mean of so many scores.
                    if mean.abs() > 0.2 + 3.0 / (seeds as f64).sqrt() {
                        far.push(format!(
                            "{motion_name}, {noise_name}, × {:.1}, {column}: {mean:+.2} σ",
                            declared_over_true
                        ));
                    }
                }
            }
        }
    }
    assert!(far.is_empty(), "{}", far.join("\n"));
}
