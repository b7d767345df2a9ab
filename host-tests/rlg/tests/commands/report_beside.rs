//! Content of `report.html` beyond the diagnosis: rates as recorded, their Allan deviation, noise declared by the model.

use std::path::PathBuf;

use rlg::diagnose::result::{
    LevelEntry, NoiseTermsEntry, ParameterEntry, RecordingEntry, RegistrationEntry,
};
use rlg::recording::{Channel, Clock, Quantity, Recording, Table};
use rlg::report::beside::{Beside, Declared, rates};
use rlg::report::{page, page_beside};

use super::report::explained;

/// Makes a recording of 1000 rows at 10 Hz with gyro rates `rate_rad_s` of each row.
fn recorded(rate_rad_s: impl Fn(usize) -> f64) -> Recording {
    let channels = ["x", "y", "z"].map(|axis| Channel {
        column: format!("g{axis}"),
        quantity: Quantity::GyroIncrement,
        axis: Some(axis.to_owned()),
        scale: 1.0,
        offset: 0.0,
        values: (0..1000).map(|row| 0.1 * rate_rad_s(row)).collect(),
    });
    Recording {
        name: "bench-17".to_owned(),
        folder: PathBuf::new(),
        site: None,
        tables: vec![Table {
            file: "samples.csv".to_owned(),
            clock: Clock::Uniform {
                rate_hz: 10.0,
                start_s: 0.0,
            },
            rows: 1000,
            channels: channels.into(),
        }],
        segments: Vec::new(),
    }
}

#[test]
fn the_allan_deviation_of_a_ramp_is_that_of_ieee_952_with_gaps_and_without() {
    // A rate that grows by R has σ(τ) = R τ/√2 (IEEE 952, C.1.5).
    let ramp = 2e-4;
    for missing in [None, Some(400..430)] {
        let recording = recorded(|row| match &missing {
            Some(rows) if rows.contains(&row) => f64::NAN,
            _ => ramp * 0.1 * row as f64,
        });
        for rate in rates(&recording, [0.0; 3]) {
            assert!(
                rate.allan.len() > 12,
                "{} averaging times",
                rate.allan.len()
            );
            for (tau_s, deviation) in rate.allan {
                let expected = ramp * tau_s / 2f64.sqrt();
                assert!(
                    (deviation / expected - 1.0).abs() < 1e-9,
                    "{deviation} at {tau_s} s, not {expected}"
                );
            }
        }
    }
}

#[test]
fn noise_as_measured_stands_beside_that_of_the_model() {
    // °/h in a rad/s.
    let deg_h = 180.0 * 3600.0 / std::f64::consts::PI;
    let level = |value: f64, std: f64| LevelEntry { value, std };
    let mut diagnosis = explained();
    diagnosis.noise[0].terms = Some(NoiseTermsEntry {
        angle_random_walk_rad_sqrt_s: level(0.0031 / deg_h * 60.0, 0.0002 / deg_h * 60.0),
        quantisation_rad: level(0.44 / deg_h, 0.05 / deg_h),
        bias_instability_rad_s: level(0.0123 / deg_h, 0.0011 / deg_h),
        rate_random_walk_rad_s_sqrt_s: level(0.0456 / deg_h / 60.0, 0.0078 / deg_h / 60.0),
    });
    let beside = Beside {
        declared: Declared {
            bias_instability_rad_s: Some([0.0125 / deg_h; 3]),
            ..Declared::default()
        },
        ..Beside::default()
    };
    let page = page_beside(&diagnosis, None, &beside);
    let (_, row) = page.split_once("<h2>Noise</h2>").expect("the section");
    let (_, row) = row.split_once("gyro x</td>").expect("its row");
    let (row, _) = row.split_once("</tr>").expect("its end");
    let cells: Vec<&str> = row
        .split("<td class=\"number\">")
        .skip(1)
        .map(|cell| cell.trim_end_matches("</td>"))
        .collect();
    let expected = [
        "0.440 ± 0.050",
        "0.00310 ± 0.00020",
        "0.0123 ± 0.0011",
        "0.0125",
        "0.0456 ± 0.0078",
    ];
    assert_eq!(cells, expected, "Q, N, B, the model's B, K");
}

#[test]
fn no_column_of_a_rate_hides_its_least_and_largest() {
    // One row in each direction, far from any other.
    let recording = recorded(|row| match row {
        333 => 0.5,
        777 => -0.25,
        _ => 0.0,
    });
    for rate in rates(&recording, [0.0; 3]) {
        let most = rate.most_rad_s.iter().copied().fold(0.0, f64::max);
        let least = rate.least_rad_s.iter().copied().fold(0.0, f64::min);
        assert!(
            (most - 0.5).abs() < 1e-12 && (least + 0.25).abs() < 1e-12,
            "{least} to {most}"
        );
    }
}

/// A number of an effect or of a registration.
fn rate(name: &str, value: f64, std: f64) -> ParameterEntry {
    ParameterEntry::Number {
        name: name.to_owned(),
        value,
        std,
        unit: "rad/s".to_owned(),
    }
}

#[test]
fn of_several_recordings_the_page_says_what_each_was_for_and_whose_the_plots_are() {
    let mut diagnosis = explained();
    let entry = |recording: &str, held_out_whole: bool, z: f64| RecordingEntry {
        recording: recording.to_owned(),
        held_out_whole,
        fitted_on: match held_out_whole {
            true => Vec::new(),
            false => vec![[0.0, 9.0], [11.0, 20.0]],
        },
        held_out: vec![[20.0, 24.5]],
        normalised_power: [Some(1.016), None, Some(z)],
    };
    diagnosis.fit.recordings = vec![
        entry("monday", false, 0.995),
        entry("friday", true, 772_668.0),
    ];
    let page = page(&diagnosis, None);
    let (told, _) = page.split_once("<pre>").expect("the data end the page");
    let row = |cells: [&str; 6]| {
        let [name, numbers @ ..] = cells;
        let numbers = numbers.map(|one| format!("<td class=\"number\">{one}</td>"));
        format!("<td>{name}</td>{}", numbers.concat())
    };
    for expected in [
        row(["monday", "18.0", "4.5", "1.02", "–", "0.995"]),
        row(["friday", "none", "all, 4.5", "1.02", "–", "7.73 × 10⁵"]),
        "Plots over time are of monday.".to_owned(),
        "of the power of the residual of the first recording that shows it".to_owned(),
    ] {
        assert!(told.contains(&expected), "the page lacks {expected}");
    }
    assert!(!told.contains("Fitted on "));
}

#[test]
fn a_registration_reads_each_number_in_its_own_unit_and_marks_those_beyond_three_sigma() {
    let mut diagnosis = explained();
    let scale = |name: &str, value: f64, std: f64| ParameterEntry::Number {
        name: name.to_owned(),
        value,
        std,
        unit: "1".to_owned(),
    };
    diagnosis.registration = vec![RegistrationEntry {
        kind: "gyro_scale".to_owned(),
        parameters: vec![scale("x", 0.155, 0.093), scale("z", 4.9923e-4, 5.3e-7)],
        supported: true,
    }];
    let page = page(&diagnosis, None);
    let expected = "x 15.5 ± 9.3 %, <b>z 499.23 ± 0.53 ppm</b>";
    assert!(page.contains(expected), "the page lacks {expected}");
}

#[test]
fn numbers_of_which_none_stands_out_are_not_told_as_a_size() {
    let mut diagnosis = explained();
    let effect = &mut diagnosis.effects[0];
    effect.kind = "gyro_bias".to_owned();
    effect.identifiable.clear();
    effect.parameters = vec![rate("x", -2e-6, 2e-5), rate("z", -6.6e-6, 2.1e-5)];
    let said = rlg::report::terminal::findings(&diagnosis);
    let expected = "x, z: none by itself beyond 3 σ (σ up to 4.3 °/h)";
    assert_eq!(said, [("gyro bias".to_owned(), expected.to_owned())]);
    diagnosis.effects[0].parameters[1] = rate("z", 4.848e-5, 4.848e-6);
    let said = rlg::report::terminal::findings(&diagnosis);
    assert_eq!(
        said,
        [(
            "gyro bias z".to_owned(),
            "10.0 ± 1.0 °/h; x below 3 σ".to_owned()
        )]
    );
}
