//! Brings what a recording measures slowly to the chain's output periods, as the main loop of a unit would read it.
//!
//! From `temperature` channels \[K\] and `magnetic_field` channels \[T\] of axes x, y, z it gives a row per output period;
//! of temperatures also the derivative \[K/s\] over `RATE_SPAN_S`.

use rlg_recording::{Axis, Clock, Quantity, Recording};
use trueaxis::SlowReadings;

/// Time over which the derivative is taken \[s\]: a unit's temperature changes within minutes.
const RATE_SPAN_S: f64 = 10.0;

/// Rows of x, y, z at the beginnings of output periods.
type Rows = Vec<[f64; 3]>;

/// Output periods.
#[derive(Debug, Clone, Copy)]
pub struct Outputs {
    /// Beginning of the first \[s\].
    pub start_s: f64,
    /// Length of each \[s\].
    pub period_s: f64,
    /// How many.
    pub count: usize,
}

/// What is measured slowly, where the recording has it for all three axes.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Slow {
    temperature_k: Option<Rows>,
    magnetic_field_t: Option<Rows>,
}

impl Slow {
    /// The last that was measured before each output period begins.
    pub fn at(recording: &Recording, outputs: Outputs) -> Self {
        Self {
            temperature_k: at_outputs(recording, &Quantity::Temperature, outputs),
            magnetic_field_t: at_outputs(recording, &Quantity::MagneticField, outputs),
        }
    }

    /// The readings of each output period of `period_s`; none where nothing is measured. A field that is not measured is
    /// 0, a temperature 0 K, which the chain does not take for one.
    pub fn readings(&self, period_s: f64) -> impl Iterator<Item = SlowReadings> + '_ {
        let span = (RATE_SPAN_S / period_s).round().max(1.0) as usize;
        let count = |rows: &Option<Rows>| rows.as_ref().map_or(0, Vec::len);
        let most = count(&self.temperature_k).max(count(&self.magnetic_field_t));
        (0..most).map(move |at| {
            let mut readings = SlowReadings::default();
            if let Some(rows) = &self.temperature_k {
                let (now, before) = (rows[at], at.saturating_sub(span));
                let elapsed_s = (at - before).max(1) as f64 * period_s;
                readings.temperature_k = now.map(|value| value as f32);
                readings.temperature_rate_k_s =
                    [0, 1, 2].map(|axis| ((now[axis] - rows[before][axis]) / elapsed_s) as f32);
            }
            if let Some(rows) = &self.magnetic_field_t {
                readings.magnetic_field_t = rows[at].map(|value| value as f32);
            }
            readings
        })
    }
}

/// The last that was measured before each output period begins; `None` where an axis has nothing.
fn at_outputs(recording: &Recording, quantity: &Quantity, outputs: Outputs) -> Option<Rows> {
    let mut rows = vec![[0.0; 3]; outputs.count];
    for axis in Axis::ALL {
        let (table, channel) = recording.channel(quantity, axis.label())?;
        let measured_s = |row: usize| match &table.clock {
            Clock::Uniform { rate_hz, start_s } => start_s + (row + 1) as f64 / rate_hz,
            Clock::Stamped { stamps_s, .. } => stamps_s[row],
        };
        let mut measured = (0..table.rows).filter(|row| channel.values[*row].is_finite());
        let mut row = measured.next()?;
        let mut next = measured.next();
        for (at, values) in rows.iter_mut().enumerate() {
            let time_s = outputs.start_s + at as f64 * outputs.period_s;
            while let Some(later) = next
                && measured_s(later) <= time_s
            {
                row = later;
                next = measured.next();
            }
            values[axis.index()] = channel.values[row];
        }
    }
    Some(rows)
}
