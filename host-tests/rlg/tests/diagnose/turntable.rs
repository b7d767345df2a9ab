//! Gyros on a table that turns about z, against its angle in every row, in every fifth row and as attitudes.
//!
//! Truth: the angle is a sum of cosines, gyro z has its differences with a scale error, a bias, white noise and, if reversed,
//! the other sign of it all; the angle is shown 4 ms late and is otherwise exact.

use std::path::Path;

use rand::SeedableRng as _;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution as _, StandardNormal};
use rlg::diagnose::result::Diagnosis;
use rlg::diagnose::{Outcome, Settings, diagnose_under};
use rlg::model::{Gyro, Model, MotionSource};
use rlg::recording::{AXES, Channel, Clock, Quantity, Recording, Table};

use super::support::{kinds, names_nothing, number};

const RATE_HZ: f64 = 100.0;
const ROWS: usize = 4000;
const LATE_S: f64 = 0.004;
const SCALE: f64 = 0.01;
const BIAS_RAD_S: f64 = 0.3 * std::f64::consts::PI / 180.0;
const NOISE_RAD_S: f64 = 0.02 * std::f64::consts::PI / 180.0;

/// Form in which the table's angle is recorded.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Shown {
    /// Increments in the gyros' rows.
    Rows,
    /// Increments over every fifth row.
    FifthRows,
    /// Attitudes in the gyros' rows.
    Attitudes,
}

/// A recording to be made.
struct Made {
    shown: Shown,
    reversed: bool,
    seed: u64,
    /// First rows and lengths of gaps.
    gaps: &'static [(usize, usize)],
}

fn angle_rad(time_s: f64) -> f64 {
    let one = |rate_rad_s: f64, omega: f64, phase: f64| {
        rate_rad_s / omega * (phase.cos() - (omega * time_s + phase).cos())
    };
    one(0.9, 0.7, 1.0) + one(0.3, 2.1, 0.0)
}

fn channel(quantity: Quantity, axis: &str, values: Vec<f64>) -> Channel {
    Channel {
        column: format!("{quantity:?}{axis}"),
        quantity,
        axis: Some(axis.to_string()),
        scale: 1.0,
        offset: 0.0,
        values,
    }
}

fn table(file: &str, every: usize, channels: Vec<Channel>) -> Table {
    Table {
        file: file.to_string(),
        clock: Clock::Uniform {
            rate_hz: RATE_HZ / every as f64,
            start_s: 0.0,
        },
        rows: channels[0].values.len(),
        channels,
    }
}

impl Made {
    fn is_lost(&self, row: usize) -> bool {
        let mut gaps = self.gaps.iter();
        gaps.any(|(from, length)| (*from..from + length).contains(&row))
    }

    /// Value at the end of each `every`-th row; NaN in a gap and, of a difference, after one.
    fn of_rows(
        &self,
        every: usize,
        is_difference: bool,
        value: impl Fn(f64, f64) -> f64,
    ) -> Vec<f64> {
        let of = |row: usize| {
            let (from, to) = (row * every, (row + 1) * every);
            let is_spoilt =
                self.is_lost(to - 1) || is_difference && from > 0 && self.is_lost(from - 1);
            match is_spoilt {
                true => f64::NAN,
                false => value(from as f64 / RATE_HZ - LATE_S, to as f64 / RATE_HZ - LATE_S),
            }
        };
        (0..ROWS / every).map(of).collect()
    }

    fn reference(&self) -> (usize, Vec<Channel>) {
        let every = if self.shown == Shown::FifthRows { 5 } else { 1 };
        let channels = match self.shown {
            Shown::Attitudes => {
                let about_z = |axis: &str, value: &dyn Fn(f64) -> f64| {
                    let values = self.of_rows(every, false, |_, to_s| value(0.5 * angle_rad(to_s)));
                    channel(Quantity::ReferenceAttitude, axis, values)
                };
                let [w, x, y] = [("w", 1.0), ("x", 0.0), ("y", 0.0)]
                    .map(|(axis, size)| about_z(axis, &|half| size * half.cos()));
                vec![w, x, y, about_z("z", &f64::sin)]
            }
            Shown::Rows | Shown::FifthRows => AXES
                .iter()
                .map(|axis| {
                    let size = if *axis == "z" { 1.0 } else { 0.0 };
                    let turn = |from_s, to_s| size * (angle_rad(to_s) - angle_rad(from_s));
                    channel(
                        Quantity::ReferenceIncrement,
                        axis,
                        self.of_rows(every, true, turn),
                    )
                })
                .collect(),
        };
        (every, channels)
    }

    fn recording(&self) -> Recording {
        let mut random = ChaCha8Rng::seed_from_u64(self.seed);
        let sign = if self.reversed { -1.0 } else { 1.0 };
        let mut gyro = |axis: &str| {
            let of = |row: usize| {
                let [from_s, to_s] = [row, row + 1].map(|row| row as f64 / RATE_HZ);
                let mean_rad_s = (angle_rad(to_s) - angle_rad(from_s)) * RATE_HZ;
                let error_free = match axis {
                    "z" => sign * ((1.0 + SCALE) * mean_rad_s + BIAS_RAD_S),
                    _ => 0.0,
                };
                let normal: f64 = StandardNormal.sample(&mut random);
                match self.is_lost(row) {
                    true => f64::NAN,
                    false => error_free + NOISE_RAD_S * normal,
                }
            };
            channel(Quantity::GyroRate, axis, (0..ROWS).map(of).collect())
        };
        let mut channels: Vec<Channel> = AXES.iter().map(|axis| gyro(axis)).collect();
        let (every, reference) = self.reference();
        let mut tables = Vec::new();
        if every > 1 {
            tables.push(table("table.csv", every, reference));
        } else {
            channels.extend(reference);
        }
        tables.insert(0, table("gyros.csv", 1, channels));
        Recording {
            name: "turntable".to_string(),
            folder: "turntable".into(),
            site: None,
            tables,
            segments: Vec::new(),
        }
    }
}

fn diagnosed(recording: &Recording, model: &Model) -> Outcome {
    let settings = Settings {
        anyway: true,
        ..Settings::default()
    };
    let file = Path::new("model.toml");
    diagnose_under(&settings, recording, model, file, &|_| {})
        .unwrap_or_else(|error| panic!("{error}"))
}

fn ideal() -> Model {
    Model {
        motion: MotionSource::Reference,
        earth_rate_in_reference: true,
        gyro: Gyro::default(),
        dither: None,
        reference: None,
        accelerometer: None,
        effects: Vec::new(),
    }
}

fn size(diagnosis: &Diagnosis, kind: &str, name: &str) -> (f64, f64) {
    let mut effects = diagnosis.effects.iter();
    let found = effects.find(|one| one.kind == kind);
    number(
        found.unwrap_or_else(|| panic!("no {kind}: {:#?}", diagnosis.summary)),
        name,
    )
}

#[track_caller]
fn is_near((value, std): (f64, f64), truth: f64) {
    assert!(
        (value - truth).abs() < 4.0 * std && std < 0.01 * truth.abs(),
        "{value} ± {std}, not {truth}"
    );
}

/// An attitude nearly free of noise shows every error of the alignment; none of them is a fault of it.
#[test]
fn a_clean_attitude_that_is_late_has_no_faults_of_its_own() {
    for seed in 1..=4 {
        let made = Made {
            shown: Shown::Attitudes,
            reversed: false,
            seed,
            gaps: &[],
        };
        let diagnosis = diagnosed(&made.recording(), &ideal()).diagnosis;
        let mut found = kinds(&diagnosis);
        found.sort_unstable();
        let expected = ["gyro_bias", "gyro_scale", "reference_delay"];
        assert_eq!(found, expected, "seed {seed}: {:#?}", diagnosis.summary);
        is_near(size(&diagnosis, "gyro_bias", "z"), BIAS_RAD_S);
        is_near(size(&diagnosis, "gyro_scale", "z"), SCALE);
        is_near(size(&diagnosis, "reference_delay", "all"), LATE_S);
    }
}

/// Gyro z = -(1.01 ω + b) = 1.01 (-ω) - b: of the gyro as recorded, against the reference once its sign is corrected.
#[test]
fn a_reversed_gyro_has_the_same_bias_however_the_angle_is_stored() {
    for shown in [Shown::Rows, Shown::FifthRows, Shown::Attitudes] {
        let made = Made {
            shown,
            reversed: true,
            seed: 5,
            gaps: &[],
        };
        let recording = made.recording();
        let found = diagnosed(&recording, &ideal());
        let diagnosis = &found.diagnosis;
        assert_eq!(size(diagnosis, "channel_sign", "zz").0, -1.0, "{shown:?}");
        is_near(size(diagnosis, "gyro_bias", "z"), -BIAS_RAD_S);
        is_near(size(diagnosis, "gyro_scale", "z"), SCALE);
        let again = diagnosed(&recording, &found.model).diagnosis;
        names_nothing(&again, format!("{shown:?}, diagnosed again"));
    }
}

/// The increment of the angle that spans a gap is missing in one row more than the gap has.
#[test]
fn a_gap_of_the_recording_has_the_rows_that_it_lacks() {
    const GAPS: [(usize, usize); 2] = [(1000, 12), (3000, 28)];
    for shown in [Shown::Rows, Shown::Attitudes] {
        let made = Made {
            shown,
            reversed: false,
            seed: 6,
            gaps: &GAPS,
        };
        let diagnosis = diagnosed(&made.recording(), &ideal()).diagnosis;
        let effects = diagnosis.effects.iter();
        let lost: Vec<(usize, usize)> = effects
            .filter(|one| one.kind == "lost_samples")
            .map(|one| {
                let row = |name: &str| (number(one, name).0 * RATE_HZ).round() as usize;
                (row("start_s"), row("end_s") - row("start_s"))
            })
            .collect();
        assert_eq!(lost, GAPS, "{shown:?}: {:#?}", diagnosis.summary);
    }
}
