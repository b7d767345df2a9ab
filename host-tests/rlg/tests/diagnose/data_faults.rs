//! Faults of the data of gyros without a dither, put into simulated rates: rows left out, reports, and no other name given
//! for them.

use std::path::Path;

use rlg::diagnose::result::Diagnosis;
use rlg::diagnose::{Settings, diagnose_under};
use rlg::model::{Gyro, Model, MotionSource};
use rlg::recording::{Channel, Clock, Quantity, Recording, Table};

use super::support::kinds;

const RATE_HZ: f64 = 200.0;
const ROWS: usize = 8000;

/// Diagnoses rates of gyros and reference that move about all axes.
fn rates(change: impl Fn(&mut [Vec<f64>; 3])) -> Diagnosis {
    let mut state = 11_u64;
    let mut noise = || {
        let mut sum = 0.0;
        for _ in 0..12 {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            sum += (state >> 11) as f64 / (1_u64 << 53) as f64;
        }
        sum - 6.0
    };
    let motion = |axis: usize, row: usize| {
        let time_s = row as f64 / RATE_HZ;
        (0..4)
            .map(|tone| {
                let hz = 0.23 * (1.0 + 0.37 * axis as f64) * (1.0 + 0.618 * f64::from(tone));
                0.4 * (std::f64::consts::TAU * hz * time_s + axis as f64).sin()
            })
            .sum::<f64>()
    };
    let mut gyros: [Vec<f64>; 3] = Default::default();
    let mut reference: [Vec<f64>; 3] = Default::default();
    for axis in 0..3 {
        for row in 0..ROWS {
            let rate = motion(axis, row);
            gyros[axis].push(rate + 1e-3 * noise());
            reference[axis].push((rate + 1e-4 * noise()) / RATE_HZ);
        }
    }
    change(&mut gyros);
    let channel = |stem: &str, axis: usize, quantity: Quantity, values: &[f64]| Channel {
        column: format!("{stem}{axis}"),
        quantity,
        axis: Some(["x", "y", "z"][axis].to_string()),
        scale: 1.0,
        offset: 0.0,
        values: values.to_vec(),
    };
    let of_gyros = (0..3).map(|axis| channel("g", axis, Quantity::GyroRate, &gyros[axis]));
    let of_reference =
        (0..3).map(|axis| channel("r", axis, Quantity::ReferenceIncrement, &reference[axis]));
    let recording = Recording {
        name: "faults".to_string(),
        tables: vec![Table {
            file: "rows.parquet".to_string(),
            clock: Clock::Uniform {
                rate_hz: RATE_HZ,
                start_s: 0.0,
            },
            rows: ROWS,
            channels: of_gyros.chain(of_reference).collect(),
        }],
        folder: Path::new("faults").to_path_buf(),
        site: None,
        segments: Vec::new(),
    };
    let model = Model {
        motion: MotionSource::Reference,
        earth_rate_in_reference: true,
        gyro: Gyro::default(),
        dither: None,
        reference: None,
        accelerometer: None,
        effects: Vec::new(),
    };
    let settings = Settings::default();
    diagnose_under(
        &settings,
        &recording,
        &model,
        Path::new("model.toml"),
        &|_| {},
    )
    .unwrap_or_else(|error| panic!("{error}"))
    .diagnosis
}

fn says(diagnosis: &Diagnosis, words: &str) {
    let summary = &diagnosis.summary;
    assert!(
        summary.iter().any(|line| line.contains(words)),
        "{summary:#?}"
    );
}

fn count(diagnosis: &Diagnosis, kind: &str) -> usize {
    kinds(diagnosis).iter().filter(|one| **one == kind).count()
}

#[test]
fn readings_that_stand_for_five_rows_are_said_once_a_channel() {
    let diagnosis = rates(|gyros| {
        for values in gyros {
            for row in 0..ROWS {
                values[row] = values[row - row % 5];
            }
        }
    });
    assert_eq!(count(&diagnosis, "held_values"), 3);
    assert_eq!(count(&diagnosis, "stuck_channel"), 0);
    says(
        &diagnosis,
        "gyro_x, gyro_y, gyro_z is held for 5 rows (mean age 2 rows, 10.0 ms)",
    );
}

#[test]
fn lost_rows_are_places_and_not_one_interval() {
    let diagnosis = rates(|gyros| {
        for row in (100..ROWS - 100).step_by(150) {
            gyros[0][row] = f64::NAN;
        }
    });
    let places = (100..ROWS - 100).step_by(150).count();
    assert_eq!(count(&diagnosis, "lost_samples"), places);
    says(
        &diagnosis,
        &format!("{places} rows of gyro_x are lost ({places} places)"),
    );
}

#[test]
fn single_readings_that_are_off_are_spikes() {
    let diagnosis = rates(|gyros| {
        for row in (150..ROWS - 100).step_by(400) {
            gyros[2][row] += 0.3;
        }
    });
    let places = (150..ROWS - 100).step_by(400).count();
    assert_eq!(count(&diagnosis, "spikes"), places);
    says(&diagnosis, &format!("{places} single readings of gyro_z"));
}

#[test]
fn a_range_that_overflows_is_saturated_and_wrapped() {
    let diagnosis = rates(|gyros| {
        for value in gyros[1].iter_mut() {
            let counts = (*value / 1e-3).round().clamp(-1024.0, 1023.0) + 5.0;
            *value = 1e-3 * ((counts + 1024.0).rem_euclid(2048.0) - 1024.0);
        }
    });
    assert!(
        count(&diagnosis, "saturation") > 3,
        "{:#?}",
        diagnosis.summary
    );
    says(&diagnosis, "rows of gyro_y");
    says(&diagnosis, "wrapped");
}

#[test]
fn a_block_of_rows_written_twice_is_left_out() {
    let diagnosis = rates(|gyros| {
        for values in gyros {
            values.copy_within(3000..3128, 3128);
        }
    });
    assert_eq!(count(&diagnosis, "repeated_rows"), 1);
    says(&diagnosis, "128 rows of gyro");
}
