//! Effects outside the catalogue beside attitudes: a line of one gyro, and an expression in the motion.

use std::ops::Range;

use super::attitude::{instrument, made, put_beside, slews, still, take, told, tumble};
use super::support::{WITHIN, kinds, names_nothing, number, sizes_are};
use rlg::diagnose::result::Diagnosis;
use rlg::recording::{Clock, Quantity, Recording, Table};
use rlg::simulate::Simulation;

const RATE_HZ: f64 = 400.0;

fn scenario(effect: &str) -> String {
    let motion = format!("{}{}{}", still(3.0), slews(), tumble(25.0));
    format!("{}{motion}{effect}", instrument(RATE_HZ))
}

fn unlisted(axis: &str, coefficient: f64, expression: &str) -> String {
    format!(
        "[[effect]]\nkind = \"unlisted\"\nconcealed = true\naxis = \"{axis}\"\ncoefficient = {coefficient:e}\n\
         expression = \"{expression}\"\n"
    )
}

/// Attitudes on every `every`th row.
fn dense(simulation: &Simulation, every: usize) -> Recording {
    let mut recording = simulation.recording.clone();
    take(&mut recording, &Quantity::ReferenceIncrement);
    let mut channels = take(&mut recording, &Quantity::ReferenceAttitude);
    for channel in &mut channels {
        let shown = channel.values.iter().skip(every - 1).step_by(every);
        channel.values = shown.copied().collect();
    }
    put_beside(&mut recording, channels, every, 0.0);
    recording
}

/// Attitudes on every fourth row, one row early or late by turns of seven.
fn jittered(simulation: &Simulation) -> Recording {
    const EARLY: [usize; 7] = [1, 0, 2, 2, 1, 0, 1];
    let mut recording = simulation.recording.clone();
    take(&mut recording, &Quantity::ReferenceIncrement);
    let mut channels = take(&mut recording, &Quantity::ReferenceAttitude);
    let rows = recording.tables[0].rows;
    let shown: Vec<usize> = (0..rows / 4 - 1)
        .map(|stamp| 4 * stamp + 5 - EARLY[stamp % 7])
        .collect();
    for channel in &mut channels {
        channel.values = shown.iter().map(|row| channel.values[*row]).collect();
    }
    let stamps = shown.iter().map(|row| (row + 1) as f64 / RATE_HZ);
    recording.tables.push(Table {
        file: "camera.csv".to_owned(),
        clock: Clock::Stamped {
            column: "t".to_owned(),
            stamps_s: stamps.collect(),
        },
        rows: shown.len(),
        channels,
    });
    recording
}

/// Recording of 100 Hz with jitter; of `all` those of 200 Hz and of 100 Hz, too.
fn stampings(simulation: &Simulation, all: bool) -> Vec<(Recording, &'static str)> {
    let mut stampings = vec![(jittered(simulation), "jitter")];
    if all {
        stampings.push((dense(simulation, 2), "200 Hz"));
        stampings.push((dense(simulation, 4), "100 Hz"));
    }
    stampings
}

fn diagnosed(recording: &Recording, simulation: &Simulation, which: &str) -> Diagnosis {
    let diagnosis = told(recording, simulation);
    let summary = &diagnosis.summary;
    assert_eq!(kinds(&diagnosis), ["unlisted"], "{which}: {summary:#?}");
    diagnosis
}

/// A line of 1.4 °/h at 3.7 Hz: 12 standard deviations, where a peak of the spectrum alone is found from some 20 on.
fn line_is_found(all: bool) {
    let (size, hz) = (7e-6, 3.73);
    let simulation = made(&scenario(&unlisted("y", size, "sine(3.73)")), 31);
    for (recording, which) in stampings(&simulation, all) {
        let diagnosis = diagnosed(&recording, &simulation, which);
        let line = &diagnosis.effects[0];
        assert!(
            line.expression
                .as_ref()
                .is_some_and(|text| text.starts_with("sine("))
        );
        let (found, std) = number(line, "y");
        // The mean square of an amplitude holds its variance.
        assert!(
            (found - size).abs() < WITHIN * std,
            "{which}: {found:e} ± {std:e}"
        );
        assert!(std < 0.2 * size, "{which}: {std:e}");
        let (found, std) = number(line, "frequency_hz");
        assert!(
            (found - hz).abs() < WITHIN * std,
            "{which}: {found} ± {std}"
        );
        assert!(std < 0.01, "{which}: {std}");
        assert_eq!([number(line, "x").0, number(line, "z").0], [0.0; 2]);
    }
}

fn expression_is_found(all: bool) {
    // No effect of the catalogue is a product of three rates.
    let size = 4e-4;
    let simulation = made(
        &scenario(&unlisted("z", size, "omega_x*omega_x*omega_y")),
        32,
    );
    for (recording, which) in stampings(&simulation, all) {
        let diagnosis = diagnosed(&recording, &simulation, which);
        let found = &diagnosis.effects[0];
        assert_eq!(
            found.expression.as_deref(),
            Some("omega_x*omega_x*omega_y"),
            "{which}"
        );
        sizes_are(found, &[("coefficient", size)]);
    }
}

fn nothing_is_named(seeds: Range<u64>, all: bool) {
    for seed in seeds {
        let simulation = made(&scenario(""), seed);
        for (recording, which) in stampings(&simulation, all) {
            names_nothing(
                &told(&recording, &simulation),
                format!("{which}, seed {seed}"),
            );
        }
    }
}

#[test]
fn a_line_of_one_gyro_is_found_beside_attitudes() {
    line_is_found(false);
}

#[test]
#[ignore = "minutes: --test diagnose -- --ignored in_full"]
fn a_line_of_one_gyro_is_found_beside_attitudes_in_full() {
    line_is_found(true);
}

#[test]
fn an_expression_in_the_motion_is_found_beside_attitudes() {
    expression_is_found(false);
}

#[test]
#[ignore = "minutes: --test diagnose -- --ignored in_full"]
fn an_expression_in_the_motion_is_found_beside_attitudes_in_full() {
    expression_is_found(true);
}

#[test]
fn dense_and_jittered_attitudes_without_an_effect_name_nothing() {
    nothing_is_named(33..34, false);
}

#[test]
#[ignore = "minutes: --test diagnose -- --ignored in_full"]
fn dense_and_jittered_attitudes_without_an_effect_name_nothing_in_full() {
    nothing_is_named(33..35, true);
}
