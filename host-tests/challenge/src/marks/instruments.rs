//! Instruments of all families: gyros, accelerometers and thermometers as channels of a table.

use nalgebra::UnitQuaternion;
use rand_chacha::ChaCha8Rng;
use rlg_recording::{Channel, Clock, Quantity, Recording, Site, Table};
use rlg_simulator::instrument::normal;

use super::case::{Case, START_K, Unit};
use super::effects::AXES;
use super::grade::Grade;
use super::noise::{Levels, quantised_rad};

/// White noise of a thermometer sample \[K\].
const THERMOMETER_K: f64 = 2e-3;

/// Returns the gyros' measurement of a case \[rad by row\]: the prediction of the contract's model, with `added_rad` added
/// to the case's part, noise, and pulse quantisation.
pub fn sensed_rad(
    case: &Case,
    unit: &Unit,
    added_rad: &[Vec<f64>; 3],
    (levels, pulse_rad): (&[Levels; 3], f64),
    rng: &mut ChaCha8Rng,
) -> [Vec<f64>; 3] {
    let (count, period_s) = (case.rows, case.period_s);
    let sensing_from_body = unit.sensing_from_body();
    std::array::from_fn(|axis| {
        let scale = 1.0 / (1.0 - unit.scale_error[axis]);
        let bias_rad = unit.bias_rad_s[axis] * period_s * scale;
        let noise = levels[axis].series_rad(count, period_s, rng);
        let sensed: Vec<f64> = (0..count)
            .map(|row| {
                let case_rad: f64 = (0..3)
                    .map(|body| sensing_from_body[(axis, body)] * case.increments_rad[body][row])
                    .sum();
                scale * (case_rad + bias_rad + added_rad[axis][row]) + noise[row]
            })
            .collect();
        quantised_rad(&sensed, pulse_rad, rng)
    })
}

/// Returns gyro channels: increments \[rad by row\], or rates for a given row rate \[Hz\].
pub fn gyros(read_rad: [Vec<f64>; 3], as_rate_hz: Option<f64>) -> Vec<Channel> {
    let of_gyro = |(axis, read): (usize, Vec<f64>)| match as_rate_hz {
        None => channel("g", axis, Quantity::GyroIncrement, read),
        Some(rate_hz) => {
            let rates = read.into_iter().map(|angle| angle * rate_hz).collect();
            channel("g", axis, Quantity::GyroRate, rates)
        }
    };
    read_rad.into_iter().enumerate().map(of_gyro).collect()
}

/// Returns channels of thermometers on blocks that warm up \[K since the start\].
pub fn thermometers(warming_k: &[Vec<f64>; 3], rng: &mut ChaCha8Rng) -> Vec<Channel> {
    let readings = (warming_k, START_K, THERMOMETER_K);
    noisy("t", &Quantity::Temperature, readings, rng)
}

/// Returns channels of accelerometers with white noise of `noise_m_s2` a row.
pub fn accelerometers(
    force_m_s2: &[Vec<f64>; 3],
    noise_m_s2: f64,
    rng: &mut ChaCha8Rng,
) -> Vec<Channel> {
    let readings = (force_m_s2, 0.0, noise_m_s2);
    noisy("a", &Quantity::SpecificForce, readings, rng)
}

/// Channels of three axes: values plus an offset, with white noise.
fn noisy(
    prefix: &str,
    quantity: &Quantity,
    (values, offset, noise): (&[Vec<f64>; 3], f64, f64),
    rng: &mut ChaCha8Rng,
) -> Vec<Channel> {
    let of_axis = |(axis, values): (usize, &Vec<f64>)| {
        let read = values
            .iter()
            .map(|value| offset + value + noise * normal(rng));
        channel(prefix, axis, quantity.clone(), read.collect())
    };
    values.iter().enumerate().map(of_axis).collect()
}

/// Returns the channels of a unit of a grade: gyro increments \[rad by row\], and force if there is any.
pub fn graded(
    grade: Grade,
    rate_hz: f64,
    (read_rad, force_m_s2): ([Vec<f64>; 3], Option<&[Vec<f64>; 3]>),
    rng: &mut ChaCha8Rng,
) -> Vec<Channel> {
    // Ring-laser gyros output increments, the others rates.
    let as_rate = (grade != Grade::Rlg).then_some(rate_hz);
    let mut channels = gyros(read_rad, as_rate);
    if let Some(force) = force_m_s2 {
        let noise = grade.accelerometer_m_s2_sqrt_hz() * rate_hz.sqrt();
        channels.extend(accelerometers(force, noise, rng));
    }
    channels
}

/// Returns the table of an attitude reference, by its stamps \[s\].
pub fn attitudes(stamps: &[(f64, UnitQuaternion<f64>)]) -> Table {
    let component = |(place, name): (usize, &str)| Channel {
        column: format!("q{name}"),
        quantity: Quantity::ReferenceAttitude,
        axis: Some(name.to_owned()),
        scale: 1.0,
        offset: 0.0,
        values: stamps
            .iter()
            .map(|(_, q)| [q.w, q.i, q.j, q.k][place])
            .collect(),
    };
    let components = ["w", "x", "y", "z"].into_iter().enumerate();
    Table {
        file: "attitudes.parquet".to_owned(),
        clock: Clock::Stamped {
            column: "t".to_owned(),
            stamps_s: stamps.iter().map(|(time_s, _)| *time_s).collect(),
        },
        rows: stamps.len(),
        channels: components.map(component).collect(),
    }
}

/// Returns a channel of an axis.
pub fn channel(prefix: &str, axis: usize, quantity: Quantity, values: Vec<f64>) -> Channel {
    Channel {
        column: format!("{prefix}{}", AXES[axis]),
        quantity,
        axis: Some(AXES[axis].to_owned()),
        scale: 1.0,
        offset: 0.0,
        values,
    }
}

/// Returns a table of uniform rows from time 0 on.
pub fn table(file: &str, rate_hz: f64, channels: Vec<Channel>) -> Table {
    Table {
        file: file.to_owned(),
        clock: Clock::Uniform {
            rate_hz,
            start_s: 0.0,
        },
        rows: channels.first().map_or(0, |channel| channel.values.len()),
        channels,
    }
}

/// Returns a recording without a name or folder.
pub fn recording(tables: Vec<Table>, site: Option<Site>) -> Recording {
    Recording {
        name: String::new(),
        folder: std::path::PathBuf::new(),
        site,
        tables,
        segments: Vec::new(),
    }
}
