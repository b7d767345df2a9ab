//! Additional content of a page: provenance of the recording and the model, and the rates as recorded.

use rlg_recording::{AXES, Clock, Quantity, Recording};

use super::allan;

/// Number of columns of a drawn rate: one per pixel of the widest plot.
const COLUMNS: usize = 800;

/// Provenance, noise declared by the model, and the rates; unknown ones are empty.
#[derive(Debug, Clone, Default)]
pub struct Beside {
    /// Label and text of each line of provenance, in order.
    pub provenance: Vec<(&'static str, String)>,
    /// Additional information to the verdict, such as an assumed model.
    pub note: Option<String>,
    /// Noise declared by the model.
    pub declared: Declared,
    /// Rates as recorded, one a gyro.
    pub rates: Vec<Rate>,
    /// Lines of a table of what each stage took, equally spaced.
    pub timings: Vec<String>,
}

/// Noise declared by a model, x, y, z; `None`: unknown.
#[derive(Debug, Clone, Copy, Default)]
pub struct Declared {
    /// N \[rad/√s\].
    pub angle_random_walk_rad_sqrt_s: Option<[f64; 3]>,
    /// B \[rad/s\].
    pub bias_instability_rad_s: Option<[f64; 3]>,
    /// K \[rad/s/√s\].
    pub rate_random_walk_rad_s_sqrt_s: Option<[f64; 3]>,
}

/// Recorded rate of one gyro, dither included, decimated for a plot.
#[derive(Debug, Clone)]
pub struct Rate {
    /// Its axis.
    pub axis: &'static str,
    /// Middle of each column \[s\].
    pub time_s: Vec<f64>,
    /// Smallest rate in each column \[rad/s\].
    pub least_rad_s: Vec<f64>,
    /// Largest rate in each column \[rad/s\].
    pub most_rad_s: Vec<f64>,
    /// Allan deviation \[rad/s\] by averaging time \[s\]; empty if rows are not equally spaced.
    pub allan: Vec<(f64, f64)>,
}

/// Rates of the gyros of a recording; empty if a gyro is missing, or a required `pulse_weight_rad` is unknown.
pub fn rates(recording: &Recording, pulse_weight_rad: [f64; 3]) -> Vec<Rate> {
    let each = AXES.iter().zip(pulse_weight_rad);
    let rates: Option<Vec<Rate>> = each
        .map(|(axis, weight_rad)| rate(recording, axis, weight_rad))
        .collect();
    rates.unwrap_or_default()
}

fn rate(recording: &Recording, axis: &'static str, weight_rad: f64) -> Option<Rate> {
    let of = |quantity: Quantity| Some((recording.channel(&quantity, axis)?, quantity));
    let kinds = [
        Quantity::GyroCount,
        Quantity::GyroIncrement,
        Quantity::GyroRate,
    ];
    let ((table, channel), quantity) = kinds.into_iter().find_map(of)?;
    let period_s = table.clock.period_s(table.rows);
    let rad_s = match quantity {
        Quantity::GyroCount if weight_rad > 0.0 => weight_rad / period_s,
        Quantity::GyroCount => return None,
        Quantity::GyroIncrement => 1.0 / period_s,
        _ => 1.0,
    };
    let even = match &table.clock {
        Clock::Uniform { .. } => true,
        Clock::Stamped { stamps_s, .. } => allan::period_s(stamps_s).is_some(),
    };
    let time_s = |row: usize| match &table.clock {
        Clock::Uniform { rate_hz, start_s } => start_s + row as f64 / rate_hz,
        Clock::Stamped { stamps_s, .. } => stamps_s[row],
    };
    let mut rate = Rate {
        axis,
        time_s: Vec::new(),
        least_rad_s: Vec::new(),
        most_rad_s: Vec::new(),
        allan: Vec::new(),
    };
    let each = table.rows.div_ceil(COLUMNS).max(1);
    for (column, values) in channel.values.chunks(each).enumerate() {
        let finite = values.iter().filter(|value| value.is_finite());
        let ends = finite.fold((f64::NAN, f64::NAN), |(least, most), value| {
            (value.min(least), value.max(most))
        });
        rate.time_s.push(time_s(column * each + values.len() / 2));
        rate.least_rad_s.push(ends.0 * rad_s);
        rate.most_rad_s.push(ends.1 * rad_s);
    }
    if even {
        rate.allan = allan::deviation(&angles(&channel.values, rad_s * period_s), period_s);
    }
    Some(rate)
}

/// Running angle \[rad\] of samples of `rad` each, a run from gap to gap.
fn angles(values: &[f64], rad: f64) -> Vec<Vec<f64>> {
    let runs = values.split(|value| !value.is_finite());
    let summed = |run: &[f64]| {
        let mut sum = 0.0;
        let sums = run.iter().map(|value| {
            sum += value * rad;
            sum
        });
        std::iter::once(0.0).chain(sums).collect::<Vec<f64>>()
    };
    runs.filter(|run| !run.is_empty()).map(summed).collect()
}
