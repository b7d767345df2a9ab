//! Slowly sampled quantities at the chain's output periods, as the main loop of a unit would read them.
//!
//! `temperature` channels \[K\] and `magnetic_field` channels \[T\] of axes x, y, z give a row per output period, from
//! samples before the period starts: the last field, and a [`Warming`]'s temperature and derivative \[K/s\] in the middle
//! of the period.

use rlg_recording::{Axis, Clock, Quantity, Recording};
use trueaxis::SlowReadings;

use crate::warming::Warming;

/// A row of x, y, z per output period.
type Rows = Vec<[f64; 3]>;

/// Output periods.
#[derive(Debug, Clone, Copy)]
pub struct Outputs {
    /// Start of the first \[s\].
    pub start_s: f64,
    /// Length of each \[s\].
    pub period_s: f64,
    /// Number of periods.
    pub count: usize,
}

/// Slowly sampled quantities that the recording has for all three axes.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Slow {
    temperature_k: Option<Rows>,
    temperature_rate_k_s: Rows,
    magnetic_field_t: Option<Rows>,
}

impl Slow {
    /// Values known as each output period starts; before the first sample, that sample.
    pub fn at(recording: &Recording, outputs: Outputs) -> Self {
        let mut slow = Self::default();
        if let Some(channels) = measured(recording, &Quantity::Temperature) {
            let mut kelvin = vec![[0.0; 3]; outputs.count];
            let mut rate_k_s = kelvin.clone();
            for (axis, readings) in channels.iter().enumerate() {
                let mut warming = Warming::default();
                before_outputs(readings, outputs, |at, known| {
                    warming.take(known);
                    let middle_s = outputs.start_s + (at as f64 + 0.5) * outputs.period_s;
                    [kelvin[at][axis], rate_k_s[at][axis]] = warming.at(middle_s);
                });
            }
            slow.temperature_k = Some(kelvin);
            slow.temperature_rate_k_s = rate_k_s;
        }
        if let Some(channels) = measured(recording, &Quantity::MagneticField) {
            let mut field_t = vec![[0.0; 3]; outputs.count];
            for (axis, readings) in channels.iter().enumerate() {
                before_outputs(readings, outputs, |at, known| {
                    field_t[at][axis] = known.last().map_or(0.0, |(_, value)| *value);
                });
            }
            slow.magnetic_field_t = Some(field_t);
        }
        slow
    }

    /// Values of each output period; empty without any channel. A missing field is 0, a missing temperature 0 K, which the
    /// chain ignores.
    pub fn readings(&self) -> impl Iterator<Item = SlowReadings> + '_ {
        let count = |rows: &Option<Rows>| rows.as_ref().map_or(0, Vec::len);
        let most = count(&self.temperature_k).max(count(&self.magnetic_field_t));
        let single = |row: [f64; 3]| row.map(|value| value as f32);
        (0..most).map(move |at| {
            let mut readings = SlowReadings::default();
            if let Some(rows) = &self.temperature_k {
                readings.temperature_k = single(rows[at]);
                readings.temperature_rate_k_s = single(self.temperature_rate_k_s[at]);
            }
            if let Some(rows) = &self.magnetic_field_t {
                readings.magnetic_field_t = single(rows[at]);
            }
            readings
        })
    }
}

/// Instants \[s\] and values of the samples of x, y, z; `None` if an axis has none.
fn measured(recording: &Recording, quantity: &Quantity) -> Option<Vec<Vec<(f64, f64)>>> {
    let of_axis = |axis: Axis| {
        let (table, channel) = recording.channel(quantity, axis.label())?;
        let measured_s = |row: usize| match &table.clock {
            Clock::Uniform { rate_hz, start_s } => start_s + (row + 1) as f64 / rate_hz,
            Clock::Stamped { stamps_s, .. } => stamps_s[row],
        };
        let values = channel.values[..table.rows].iter().enumerate();
        let readings: Vec<_> = values
            .filter(|(_, value)| value.is_finite())
            .map(|(row, value)| (measured_s(row), *value))
            .collect();
        (!readings.is_empty()).then_some(readings)
    };
    Axis::ALL.into_iter().map(of_axis).collect()
}

/// Calls `take` for each output period with the samples known at its start, at least the first.
fn before_outputs(
    readings: &[(f64, f64)],
    outputs: Outputs,
    mut take: impl FnMut(usize, &[(f64, f64)]),
) {
    let mut known = 1;
    for at in 0..outputs.count {
        let begin_s = outputs.start_s + at as f64 * outputs.period_s;
        while readings
            .get(known)
            .is_some_and(|(time_s, _)| *time_s <= begin_s)
        {
            known += 1;
        }
        take(at, &readings[..known]);
    }
}
