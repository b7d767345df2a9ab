//! Single stages of the road against what can be worked out by hand.

use rand::SeedableRng as _;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution as _, StandardNormal};
use rlg::diagnose::information::Information;
use rlg::diagnose::motion::{Reading, Spectrum, smooth_length};
use rlg::diagnose::noise::{Declared, Noise, fit};
use rlg::diagnose::portion::{Bins, Portion, inner};
use rlg::diagnose::regressor::{Regressor, regressors};
use rlg::diagnose::residual::residual_rad;
use rlg::diagnose::scene::Scene;
use rlg::diagnose::streams::Streams;
use rlg::model::Model;
use rlg::simulate::coning_demo;
use std::f64::consts::TAU;
use std::path::Path;

const RATE_HZ: f64 = 4000.0;

/// Random walk of angle and white noise of angle, as θ \[rad²\]: 0.002 °/√h and 0.14″.
const WALK: f64 = 8.6e-17;
const WHITE: f64 = 4.5e-13;

/// Increments of an angle that walks at random and is read with white noise.
fn increments(rows: usize, seed: u64) -> Vec<f64> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut draw = || -> f64 { StandardNormal.sample(&mut random) };
    let mut before = draw() * WHITE.sqrt();
    (0..rows)
        .map(|_| {
            let now = draw() * WHITE.sqrt();
            let increment = draw() * WALK.sqrt() + now - before;
            before = now;
            increment
        })
        .collect()
}

fn noise() -> Noise {
    Noise {
        theta: [WALK, WHITE, 0.0, 0.0],
        rate_hz: RATE_HZ,
    }
}

#[test]
fn a_portion_keeps_sums_of_products() {
    let rows: Vec<f64> = (0..8000).map(|row| (row as f64 * 0.37).sin()).collect();
    let portion = Portion::new(vec![0..3000, 5000..8000], RATE_HZ).expect("rows");
    let bins = portion.transform(&rows);
    let ones = vec![1.0; portion.bins()];
    let in_time: f64 = portion
        .ranges
        .iter()
        .flat_map(|range| &rows[range.clone()])
        .map(|value| value * value)
        .sum();
    // Double precision over 6000 rows.
    assert!((inner(&bins, &bins, &ones) / in_time - 1.0).abs() < 1e-12);
}

#[test]
fn the_standard_deviation_of_a_mean_rate_is_what_many_records_scatter_by() {
    // Three stretches end to end: only the free jumps at the joints make the scatter come out right.
    let trials = 400;
    let mut sum_of_squares = 0.0;
    for seed in 0..trials {
        let rows = increments(3 * 8000 + 2000, seed);
        let portion =
            Portion::new(vec![0..8000, 9000..17000, 18000..26000], RATE_HZ).expect("rows");
        let weights = noise().weights(&portion);
        let constant = portion.transform(&vec![1.0 / RATE_HZ; rows.len()]);
        let mut information = Information::empty(1);
        information.add_axis(
            &regressors(&portion.joints()),
            &[],
            &portion.transform(&rows),
            &[(0, &Regressor::new(&constant))],
            &weights,
        );
        let solution = information.solve(&[0], &|_| 1.0);
        sum_of_squares += solution.values[0].powi(2) / solution.covariance[(0, 0)];
    }
    let ratio = sum_of_squares / trials as f64;
    // A mean of 400 squares scatters by √(2/400) = 7 %; three of that.
    assert!(
        (ratio - 1.0).abs() < 0.21,
        "squared scatter over variance {ratio}"
    );
}

#[test]
fn the_noise_fit_does_not_come_out_low_under_a_library() {
    let rows = increments(160_000, 9);
    let portion = Portion::new(std::iter::once(0..160_000).collect(), RATE_HZ).expect("rows");
    let residual = portion.transform(&rows);
    // A library that eats most of the lowest bins: what is left there looks quiet.
    let mut columns: Vec<Bins> = (1..60)
        .map(|k| {
            let turn = TAU * f64::from(k) / 160_000.0;
            portion.transform(
                &(0..160_000)
                    .map(|row| (turn * f64::from(row)).sin())
                    .collect::<Vec<f64>>(),
            )
        })
        .collect();
    columns.extend(portion.joints());
    let columns = regressors(&columns);
    let columns: Vec<&Regressor> = columns.iter().collect();
    let unknown = Declared {
        random_walk: None,
        white_angle: None,
    };
    let fitted = fit(&portion, &residual, &columns, unknown, None);
    // Some 900 free bins below the corner carry the walk: 3.3 % each way, four of that with the shape's
    // correlation; the white level has 80 000 bins and is limited by nothing here.
    let walk = fitted.at(1.0, 0.01) / noise().at(1.0, 0.01);
    assert!((walk - 1.0).abs() < 0.15, "walk {walk}");
    assert!(
        (fitted.theta[1] / WHITE - 1.0).abs() < 0.02,
        "white {}",
        fitted.theta[1] / WHITE
    );
}

#[test]
fn a_declared_level_stands_until_the_data_contradict_it() {
    let rows = increments(160_000, 4);
    let portion = Portion::new(std::iter::once(0..160_000).collect(), RATE_HZ).expect("rows");
    let residual = portion.transform(&rows);
    let joints = regressors(&portion.joints());
    let columns: Vec<&Regressor> = joints.iter().collect();
    let right = Declared {
        random_walk: Some(WALK),
        white_angle: Some(WHITE),
    };
    let kept = fit(&portion, &residual, &columns, right, None);
    assert_eq!((kept.theta[0], kept.theta[1]), (WALK, WHITE));
    let wrong = Declared {
        random_walk: Some(WALK / 3.0),
        white_angle: Some(WHITE),
    };
    let replaced = fit(&portion, &residual, &columns, wrong, None);
    assert!(
        replaced.theta[0] > 2.0 * WALK / 3.0,
        "{}",
        replaced.theta[0] / WALK
    );
}

#[test]
fn derivatives_and_delays_of_the_motion_are_exact_inside_its_band() {
    let omega = TAU * 95.0;
    let rows = 20_000;
    // Increments of sin(ωt) over each row, from its integral.
    let angle = |time_s: f64| -(omega * time_s).cos() / omega;
    let increments: Vec<f64> = (0..rows)
        .map(|row| angle(f64::from(row + 1) / RATE_HZ) - angle(f64::from(row) / RATE_HZ))
        .collect();
    let spectrum = Spectrum::new(&increments, RATE_HZ, 120.0);
    let ahead_s = 1.3e-4;
    let rate = spectrum.read(Reading {
        derivative: 0,
        ahead_s,
        undo_row_mean: true,
    });
    let slope = spectrum.read(Reading {
        derivative: 1,
        ahead_s,
        undo_row_mean: true,
    });
    for row in 6000..14_000 {
        let time_s = (row as f64 + 0.5) / RATE_HZ + ahead_s;
        // What is left is the reflection at the ends, 1500 cycles away.
        assert!((rate[row] * RATE_HZ - (omega * time_s).sin()).abs() < 1e-4);
        assert!((slope[row] * RATE_HZ / omega - (omega * time_s).cos()).abs() < 1e-4);
    }
}

#[test]
fn lengths_for_the_transform_have_small_factors() {
    assert_eq!(
        [7, 97, 4097, 180_001].map(smooth_length),
        [8, 100, 4320, 182_250]
    );
}

#[test]
fn a_dither_that_the_model_does_not_speak_of_is_taken_at_its_pickoffs_word() {
    let simulation = coning_demo(5).expect("a scenario");
    let file = Path::new("model.toml");
    let residual = |model: &Model| {
        let streams = Streams::align(&simulation.recording, model).expect("channels");
        let scene = Scene::new(streams, None, model.gyro.scale_error);
        residual_rad(&scene, model, file).expect("a residual")
    };
    let mut silent = simulation.model.clone();
    let told = silent.dither.take().expect("a dithered unit");
    assert_eq!(told.pickoff_gain, [1.0; 3]);
    assert_eq!(residual(&silent), residual(&simulation.model));
    // A swing of 1e-4 rad at 400 Hz would stand out of the pulses.
    let most = residual(&silent)
        .iter()
        .flatten()
        .fold(0.0, |most: f64, value| most.max(value.abs()));
    assert!(most < 3e-5, "{most:e}");
}
