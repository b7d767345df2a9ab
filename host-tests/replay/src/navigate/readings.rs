//! Input of the navigator from a recording: rotation vectors \[rad\] and velocity increments \[m/s\].
//!
//! The recording has gyros and accelerometers, with its model, or its rows are rotation vectors already
//! (`compensated.parquet` of `rlg replay`). [`Readings`] are in the body frame at the start of each period.

use std::ops::Range;
use std::path::Path;

use nalgebra::Vector3;
use strapdown::Increment;
use trueaxis::{CrossAxis, ParameterError};

use crate::drift::reference_rotations_rad;
use crate::samples::{Setup, samples_from_recording};
use crate::{Core, Replay, replay};
use rlg_model::Model;
use rlg_recording::error::InputError;
use rlg_recording::{Axis, Channel, Clock, Quantity, Recording, Table};

/// Increments per output period.
#[derive(Debug, Clone, PartialEq)]
pub struct Readings {
    /// Start of the first period \[s\].
    pub start_s: f64,
    /// Length of a period \[s\].
    pub period_s: f64,
    /// Increments without the dynamic terms; `None` if the model has none.
    pub before: Option<Vec<Increment>>,
    /// Increments as output by the chain.
    pub after: Vec<Increment>,
    /// Rotation vectors of the reference \[rad\], NaN if not measured.
    pub reference_rad: Option<Vec<[f64; 3]>>,
    /// The reference contains the Earth's rotation.
    pub earth_in_reference: bool,
    /// Kinds of the model's effects for which the chain has no term.
    pub uncompensated: Vec<String>,
}

/// Tolerance of a bound against a period's \[periods\], since times are decimals.
const BOUND_TOLERANCE_PERIODS: f64 = 1e-3;

impl Readings {
    /// Periods wholly between two times, except the first of the recording: in it the chain only primes its difference of
    /// pickoff samples, and part of the rotation is missing.
    pub fn periods_in(&self, start_s: f64, end_s: f64) -> Range<usize> {
        let place = |time_s: f64| (time_s - self.start_s) / self.period_s;
        let first = (place(start_s) - BOUND_TOLERANCE_PERIODS).ceil().max(1.0);
        let end = (place(end_s) + BOUND_TOLERANCE_PERIODS).floor();
        // a cast of floats saturates: times before the recording become 0
        let end = (end as usize).min(self.after.len());
        (first as usize).min(end)..end
    }

    /// Runs the recording through the chain in `core`, with and without the dynamic terms.
    pub fn through_chain(
        recording: &Recording,
        model: &Model,
        model_file: &Path,
        core: Core,
    ) -> Result<Self, InputError> {
        let input = samples_from_recording(recording, model, model_file, Setup::STANDARD)?;
        if input.velocity_m_s.is_none() {
            let why = input.velocity_refused.clone();
            let why = why.unwrap_or_else(|| "has no accelerometer channel".to_owned());
            return Err(InputError::new(&recording.folder, why)
                .channel("velocity_increment")
                .expected(
                    "velocity_increment or specific_force for x, y and z on the gyros' rows",
                ));
        }
        let refused = |error: ParameterError| {
            InputError::new(model_file, format!("does not fit the chain: {error}"))
        };
        let period_s =
            f64::from(input.parameters.samples_per_output) / input.parameters.sample_rate_hz;
        let after = replay(&input, core, &input.parameters).map_err(refused)?;
        let mut without_dynamics = input.parameters;
        without_dynamics.flexure_s2 = CrossAxis::default();
        let before = if without_dynamics == input.parameters {
            None
        } else {
            Some(replay(&input, core, &without_dynamics).map_err(refused)?)
        };
        Ok(Self {
            start_s: input.start_s,
            period_s,
            before: before.map(|before| increments(&before, period_s)),
            after: increments(&after, period_s),
            reference_rad: reference_rotations_rad(&input),
            earth_in_reference: model.earth_rate_in_reference,
            uncompensated: input.uncompensated,
        })
    }

    /// Uses rows that are rotation vectors and velocity increments already, without the chain. Mean rates and forces times
    /// the period count as such: the motion within a row of a slow recording is unknown.
    pub fn as_recorded(recording: &Recording) -> Result<Self, InputError> {
        let gyros = [Quantity::GyroIncrement, Quantity::GyroRate];
        let accelerometers = [Quantity::VelocityIncrement, Quantity::SpecificForce];
        let (table, rotations) = Rows::find(recording, &gyros)?;
        let (beside, velocities) = Rows::find(recording, &accelerometers)?;
        let file = recording.folder.join(&table.file);
        let Clock::Uniform { rate_hz, start_s } = table.clock else {
            return Err(InputError::new(file, "has a column of times")
                .expected("rate_hz: the navigator has one period"));
        };
        if beside.clock != table.clock || beside.rows != table.rows {
            let beside = recording.folder.join(&beside.file);
            return Err(InputError::new(beside, "has other rows than the gyros")
                .channel(velocities.channels[0].column.as_str())
                .expected("increments of angle and velocity on the same rows"));
        }
        let period_s = 1.0 / rate_hz;
        let after = (0..table.rows)
            .map(|row| {
                Ok(Increment {
                    rotation_rad: rotations.over(row, period_s, &file)?,
                    velocity_m_s: velocities.over(row, period_s, &file)?,
                    period_s,
                })
            })
            .collect::<Result<_, InputError>>()?;
        Ok(Self {
            start_s,
            period_s,
            before: None,
            after,
            reference_rad: None,
            earth_in_reference: false,
            uncompensated: Vec::new(),
        })
    }
}

/// Three channels of one table, increments or their means.
struct Rows<'a> {
    channels: [&'a Channel; 3],
    mean: bool,
}

impl<'a> Rows<'a> {
    /// Prefers increments to means.
    fn find(
        recording: &'a Recording,
        [increment, mean]: &[Quantity; 2],
    ) -> Result<(&'a Table, Self), InputError> {
        for quantity in [increment, mean] {
            let mut found = Axis::ALL.map(|axis| recording.channel(quantity, axis.label()));
            if let [Some((table, x)), Some((_, y)), Some((_, z))] = &mut found
                && [*y, *z]
                    .iter()
                    .all(|channel| table.channels.iter().any(|c| std::ptr::eq(c, *channel)))
            {
                let rows = Self {
                    channels: [*x, *y, *z],
                    mean: quantity == mean,
                };
                return Ok((table, rows));
            }
        }
        let names = format!("{} or {}", increment.name(), mean.name());
        Err(InputError::new(&recording.folder, "lacks a channel")
            .channel(names)
            .expected("x, y and z in one table"))
    }

    fn over(&self, row: usize, period_s: f64, file: &Path) -> Result<Vector3<f64>, InputError> {
        let unit_s = if self.mean { period_s } else { 1.0 };
        let missing = self
            .channels
            .iter()
            .find(|channel| channel.values[row].is_nan());
        if let Some(channel) = missing {
            return Err(InputError::new(file, "was not measured")
                .channel(&channel.column)
                .row(row as u64)
                .expected("a number: navigation cannot make up for a motion that is missing"));
        }
        Ok(Vector3::from(self.channels.map(|channel| channel.values[row])) * unit_s)
    }
}

fn increments(replayed: &Replay, period_s: f64) -> Vec<Increment> {
    let pairs = replayed.rotations_rad.iter().zip(&replayed.velocities_m_s);
    pairs
        .map(|(rotation, velocity)| Increment {
            rotation_rad: Vector3::from(*rotation),
            velocity_m_s: Vector3::from(*velocity),
            period_s,
        })
        .collect()
}
