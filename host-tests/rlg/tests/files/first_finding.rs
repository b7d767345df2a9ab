//! A new user's path: a logger's file in deg/s and g with stamps in milliseconds, and an encoder on one axis at half the
//! gyros' rate, becomes a recording and a finding in two commands. Nothing is written by hand. The same from MATLAB's files.

use std::f64::consts::PI;
use std::fmt::Write as _;

use rand::SeedableRng as _;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution as _, Normal};
use rlg::recording::{Clock, Quantity, Recording};

use super::import_columns::{Bench, values};
use super::import_matrices::{mat, matrix};

/// Errors of the logger's gyros and encoder.
const SCALE_Z: f64 = 800e-6;
const BIAS_Z_RAD_S: f64 = 2e-4;
const LATE_S: f64 = 0.004;

const ROWS: usize = 12_000;
const RATE_HZ: f64 = 100.0;
/// White noise of a gyro's row \[rad/s\] and of the encoder \[rad\].
const NOISE_RAD_S: f64 = 4e-5;
const NOISE_RAD: f64 = 2e-6;

const DEG: f64 = PI / 180.0;
const G_M_S2: f64 = 9.806_65;

/// Angle of the table about z \[rad\].
fn angle_rad(time_s: f64) -> f64 {
    1.5 * (1.0 - (0.7 * time_s).cos()) + 0.2 * (5.1 * time_s).sin()
}

/// Columns of the log; the encoder has a value in every second row.
struct Log {
    time_ms: Vec<f64>,
    gyro_deg_s: [Vec<f64>; 3],
    force_g: [Vec<f64>; 3],
    encoder_deg: Vec<f64>,
}

fn log() -> Log {
    let mut chance = ChaCha8Rng::seed_from_u64(5);
    let mut normal = |std: f64| {
        Normal::new(0.0, std)
            .expect("a deviation")
            .sample(&mut chance)
    };
    let mut log = Log {
        time_ms: Vec::new(),
        gyro_deg_s: Default::default(),
        force_g: Default::default(),
        encoder_deg: Vec::new(),
    };
    for row in 0..ROWS {
        let time_s = (row + 1) as f64 / RATE_HZ;
        log.time_ms.push((1000.0 * time_s).round());
        let turned_rad = angle_rad(time_s) - angle_rad(time_s - 1.0 / RATE_HZ);
        for axis in 0..3 {
            let mut rate_rad_s = normal(NOISE_RAD_S);
            let mut force_m_s2 = normal(2e-3);
            if axis == 2 {
                rate_rad_s += turned_rad * RATE_HZ * (1.0 + SCALE_Z) + BIAS_Z_RAD_S;
                force_m_s2 += G_M_S2;
            }
            log.gyro_deg_s[axis].push(rate_rad_s / DEG);
            log.force_g[axis].push(force_m_s2 / G_M_S2);
        }
        let encoder_rad = angle_rad(time_s - LATE_S) + normal(NOISE_RAD);
        log.encoder_deg.push(match row % 2 {
            0 => f64::NAN,
            _ => encoder_rad / DEG,
        });
    }
    log
}

impl Log {
    fn csv(&self) -> String {
        let mut text =
            "t (ms),gx (deg/s),gy (deg/s),gz (deg/s),ax (g),ay (g),az (g),encoder_z (deg)\n"
                .to_owned();
        for row in 0..ROWS {
            let _ = write!(text, "{:.0}", self.time_ms[row]);
            for column in self.gyro_deg_s.iter().chain(&self.force_g) {
                let _ = write!(text, ",{:.8}", column[row]);
            }
            match self.encoder_deg[row] {
                angle if angle.is_nan() => text.push_str(",\n"),
                angle => drop(writeln!(text, ",{angle:.7}")),
            }
        }
        text
    }

    /// Returns names, columns and values as a script of MATLAB would keep them: the encoder with stamps of its own.
    fn variables(&self) -> [(&'static str, usize, Vec<f64>); 5] {
        let second = |values: &[f64]| {
            values
                .iter()
                .copied()
                .skip(1)
                .step_by(2)
                .collect::<Vec<_>>()
        };
        [
            ("t_ms", 1, self.time_ms.clone()),
            ("gyro_deg_s", 3, self.gyro_deg_s.concat()),
            ("acc_g", 3, self.force_g.concat()),
            ("t_encoder_ms", 1, second(&self.time_ms)),
            ("encoder_z_deg", 1, second(&self.encoder_deg)),
        ]
    }
}

/// Returns value and standard deviation of a parameter, in effects or registration, under any name of its class.
fn found(diagnosis: &serde_json::Value, kind: &str, parameter: &str) -> (f64, f64) {
    let lists = ["effects", "registration"].map(|list| diagnosis[list].as_array());
    let entries = lists.into_iter().flatten().flatten();
    let parameters = entries
        .filter(|entry| entry["kind"] == kind)
        .flat_map(|entry| entry["parameters"].as_array().into_iter().flatten());
    let mut numbers = parameters.filter(|number| number["name"] == parameter);
    let number = numbers
        .next()
        .unwrap_or_else(|| panic!("no {kind} {parameter} in {diagnosis:#}"));
    let of = |key: &str| number[key].as_f64().expect("a number");
    (of("value"), of("std"))
}

/// Checks that everything planted is found within three standard deviations, which are small compared with it.
fn is_found(diagnosis: &serde_json::Value) {
    let planted = [
        ("gyro_scale", "z", SCALE_Z),
        ("gyro_bias", "z", BIAS_Z_RAD_S),
        ("reference_delay", "all", LATE_S),
    ];
    for (kind, parameter, truth) in planted {
        let (value, std) = found(diagnosis, kind, parameter);
        assert!(
            (value - truth).abs() < 3.0 * std && std < 0.02 * truth.abs(),
            "{kind} {parameter}: {value} ± {std}, not {truth}"
        );
        println!("{kind} {parameter}: {value:.6e} ± {std:.1e}, planted {truth:e}");
    }
    assert_eq!(diagnosis["verdict"], "explained");
}

#[test]
fn a_loggers_csv_becomes_a_finding() {
    let bench = Bench::new("log.csv", log().csv());
    let (_, recording) = bench.imported(&[]);
    let rates = recording.tables.iter().map(|table| match table.clock {
        Clock::Uniform { rate_hz, .. } => rate_hz,
        Clock::Stamped { .. } => f64::NAN,
    });
    assert_eq!(rates.collect::<Vec<_>>(), [RATE_HZ, RATE_HZ / 2.0]);
    let up = values(&recording.tables[0], &Quantity::SpecificForce, "z");
    assert!((up[0] / G_M_S2 - 1.0).abs() < 0.01);
    is_found(&bench.diagnosis());
}

#[test]
fn matlab_of_both_kinds_becomes_the_same_recording_and_finding() {
    let log = log();
    let variables = log.variables();
    let of_five: Vec<_> = variables
        .iter()
        .map(|(name, columns, values)| {
            let sides = [(values.len() / columns) as u32, *columns as u32];
            matrix(name, &sides, values)
        })
        .collect();
    let mut of_seven = hdf5_pure::FileBuilder::new();
    for (name, columns, values) in &variables {
        let dataset = of_seven.create_dataset(name).with_f64_data(values);
        dataset.with_shape(&[*columns as u64, (values.len() / columns) as u64]);
    }
    let of_seven = of_seven.finish().expect("a file");
    let benches = [mat(&of_five, true), of_seven].map(|bytes| Bench::new("log.mat", bytes));
    // The order is that of the files: 7.3 sorts its names.
    let channels = |recording: Recording| {
        let channels = recording
            .tables
            .into_iter()
            .flat_map(|table| table.channels);
        let bits = |values: &[f64]| {
            values
                .iter()
                .map(|value| value.to_bits())
                .collect::<Vec<_>>()
        };
        let mut channels: Vec<_> = channels
            .map(|channel| (channel.quantity, channel.axis, bits(&channel.values)))
            .collect();
        channels.sort();
        channels
    };
    let [one, other] = benches
        .each_ref()
        .map(|bench| channels(bench.imported(&[]).1));
    assert!(one == other, "version 5 and version 7.3 hold the same");
    is_found(&benches[0].diagnosis());
}
