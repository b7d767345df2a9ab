//! Checks the physical plausibility of a recording before a model is fitted: plausible row rates, 1 g at small angular
//! rates, and no motion if the model is at rest.
//!
//! Inputs: the recording and its model. Output: one sentence with the likely cause, as an error that `--anyway` turns into a
//! warning. Mutual consistency of gyros and reference (axes, signs, factors) is tested in rlg-diagnosis, on aligned rows.
//!
//! A ratio not explained by a usual mistake is accepted: a rocket at 3 g passes.

use std::collections::BTreeMap;
use std::path::Path;

use rlg_signal::quantiles::median;
use strapdown::earth::ROTATION_RAD_S;

use crate::error::InputError;
use crate::model::{Model, MotionSource};
use crate::recording::{AXES, Quantity, Recording, Table};

/// Thresholds of the checks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bounds {
    /// Smallest rows a second of gyros \[Hz\]: below, stamps are in milliseconds or microseconds; the slowest logs of units
    /// at rest are means over a second.
    pub slowest_hz: f64,
    /// Largest rows a second \[Hz\]: above, stamps are in other units, because digital gyros sample at some 100 kHz at most.
    pub fastest_hz: f64,
    /// Length of the compared stretches \[s\]: dither and vibration average out.
    pub window_s: f64,
    /// Change of the mean rate from one stretch to the next below which a unit is still \[rad/s\]: a phone's gyro drifts by
    /// a tenth of it.
    pub still_rad_s: f64,
    /// Mean rate, and its change, below which a mean over a stretch gives gravity within a hundredth \[rad/s\]: half a
    /// radian of rotation.
    pub slow_rad_s: f64,
    /// Still stretches required for the check of gravity.
    pub fewest_windows: usize,
    /// Share of stretches with motion above which a unit is not at rest: a knock does not count.
    pub moving_share: f64,
    /// Tolerance of the ratio to gravity about that of a cause, relative: bias and scale errors of cheap accelerometers.
    pub near: f64,
    /// Ratio to gravity below which gravity counts as absent.
    pub none_share: f64,
    /// Tolerance of the ratio of a mean rate to the Earth's about that of a wrong unit, and largest standard deviation of
    /// it, relative: by chance a bias comes as near in two of a hundred units.
    pub near_earth: f64,
}

impl Default for Bounds {
    fn default() -> Self {
        Self {
            slowest_hz: 0.9,
            fastest_hz: 1e6,
            window_s: 1.0,
            still_rad_s: 0.01,
            slow_rad_s: 0.5,
            fewest_windows: 3,
            moving_share: 0.1,
            near: 0.05,
            none_share: 0.05,
            near_earth: 0.01,
        }
    }
}

/// Gravity without a stated site \[m/s²\].
const STANDARD_GRAVITY_M_S2: f64 = 9.806_65;

/// Means of three channels over stretches, by index of the stretch.
type Windows = BTreeMap<i64, [f64; 3]>;

/// Refuses an implausible recording; `file` is named in the sentence.
pub fn check(
    file: &Path,
    recording: &Recording,
    model: &Model,
    bounds: &Bounds,
) -> Result<(), InputError> {
    let Some((table, quantity)) = gyros(recording) else {
        return Ok(());
    };
    rows(file, table, bounds)?;
    let turning = windows(table, quantity, to_rad_s(table, quantity, model), bounds);
    motion(file, model, &turning, bounds)?;
    gravity(file, recording, &turning, bounds)
}

/// True if gyros turn to and fro without a reference, so that [`check`] would refuse the motion.
pub fn is_unreferenced_motion(recording: &Recording, model: &Model, bounds: &Bounds) -> bool {
    let Some((table, quantity)) = gyros(recording) else {
        return false;
    };
    let turning = windows(table, quantity, to_rad_s(table, quantity, model), bounds);
    motion(Path::new(""), model, &turning, bounds).is_err()
}

/// Returns a warning if the mean rate of a unit at rest is the Earth's in another unit: no refusal, because a bias may be as
/// large.
pub fn doubt(recording: &Recording, model: &Model, bounds: &Bounds) -> Option<String> {
    let is_rest = model.motion == MotionSource::Static && model.gyro.bias_rad_s == [0.0; 3];
    let (table, quantity) = gyros(recording).filter(|_| is_rest)?;
    let turning = windows(table, quantity, to_rad_s(table, quantity, model), bounds);
    let count = turning.len() as f64;
    let mean = |axis: usize| turning.values().map(|rate| rate[axis]).sum::<f64>() / count;
    let mean = [0, 1, 2].map(mean);
    let away = turning.values().map(|rate| {
        let away = [0, 1, 2].map(|axis| rate[axis] - mean[axis]);
        size(&away).powi(2)
    });
    let std_rad_s = away.sum::<f64>().sqrt() / count;
    let ratio = size(&mean) / ROTATION_RAD_S;
    let (factor, words) = IN_OTHER_UNITS
        .iter()
        .find(|(factor, _)| (ratio / factor - 1.0).abs() < bounds.near_earth)?;
    let is_known =
        count >= bounds.fewest_windows as f64 && std_rad_s < bounds.near_earth * size(&mean);
    is_known.then(|| {
        format!(
            "the mean rate at rest is {ratio:.4} times the Earth's, near {factor:.4}: {words}? A bias of {:.4} deg/s looks the same",
            size(&mean).to_degrees()
        )
    })
}

/// Error factors of gyros in a wrong unit, with their cause.
const IN_OTHER_UNITS: [(f64, &str); 6] = [
    (
        57.295_780,
        "are the gyros in degrees where radians are said",
    ),
    (
        0.017_453_293,
        "are the gyros in radians where degrees are said",
    ),
    (1000.0, "are the gyros in thousandths of the unit"),
    (0.001, "are the gyros in thousands of the unit"),
    (
        3600.0,
        "are the gyros' rates per hour, or their angles in arcseconds",
    ),
    (
        206_264.8,
        "are the gyros in arcseconds where radians are said",
    ),
];

/// Returns the factors that convert samples of the gyros to rates.
fn to_rad_s(table: &Table, quantity: &Quantity, model: &Model) -> [f64; 3] {
    let period_s = table.clock.period_s(table.rows);
    match quantity {
        Quantity::GyroRate => [1.0; 3],
        Quantity::GyroIncrement => [1.0 / period_s; 3],
        _ => model.gyro.pulse_weight_rad.map(|weight| weight / period_s),
    }
}

/// Returns the first table with gyros about all axes.
fn gyros(recording: &Recording) -> Option<(&Table, &'static Quantity)> {
    Quantity::GYROS.iter().find_map(|quantity| {
        let has_all = |table: &&Table| {
            AXES.iter()
                .all(|axis| table.channel(quantity, axis).is_some())
        };
        Some((recording.tables.iter().find(has_all)?, quantity))
    })
}

/// Refuses rows at a rate that implies stamps in other units than seconds.
fn rows(file: &Path, table: &Table, bounds: &Bounds) -> Result<(), InputError> {
    let rate_hz = 1.0 / table.clock.period_s(table.rows);
    let cause = match rate_hz {
        rate_hz if rate_hz < bounds.slowest_hz => "milliseconds or microseconds",
        rate_hz if rate_hz > bounds.fastest_hz => "minutes or hours",
        _ => return Ok(()),
    };
    Err(
        InputError::new(file, "has rows of gyros at a rate at which no unit is read")
            .channel(&table.file)
            .value(format!(
                "{rate_hz:.4} Hz, {:.4} s in all",
                table.end_s() - table.start_s()
            ))
            .expected(format!(
                "{} Hz or more (are the stamps in {cause}, or is rate_hz a period?)",
                bounds.slowest_hz
            ))
            .or_anyway("takes them as they are"),
    )
}

/// Refuses a unit that rotates to and fro under a model at rest.
fn motion(
    file: &Path,
    model: &Model,
    turning: &Windows,
    bounds: &Bounds,
) -> Result<(), InputError> {
    if model.motion != MotionSource::Static || turning.len() < bounds.fewest_windows {
        return Ok(());
    }
    let changes: Vec<(i64, f64)> = changes_rad_s(turning).collect();
    let moving = changes
        .iter()
        .filter(|(_, change)| *change > bounds.still_rad_s);
    if moving.clone().count() as f64 <= bounds.moving_share * changes.len() as f64 {
        return Ok(());
    }
    let worst = moving
        .clone()
        .max_by(|one, other| one.1.total_cmp(&other.1));
    let (window, change) = worst.copied().unwrap_or_default();
    let at_s = window as f64 * bounds.window_s;
    let degrees = change.to_degrees();
    Err(InputError::new(file, "turns, but its model has it at rest")
        .channel("motion.source")
        .value(format!(
            "\"static\", while the gyros' mean over a second changes by {degrees:.2} deg/s at {at_s} s, and so in {} of {} s",
            moving.count(),
            changes.len()
        ))
        .expected(
            "a reference of the motion (turntable, cameras, second unit), or a stretch at rest; are the gyros in degrees a \
             second?",
        )
        .or_anyway("takes it as it is"))
}

/// Refuses accelerometers whose mean differs from gravity while the unit hardly rotates, if a usual mistake explains the
/// ratio.
fn gravity(
    file: &Path,
    recording: &Recording,
    turning: &Windows,
    bounds: &Bounds,
) -> Result<(), InputError> {
    let found = Quantity::FORCES.iter().find_map(|quantity| {
        let has_all = |table: &&Table| {
            AXES.iter()
                .all(|axis| table.channel(quantity, axis).is_some())
        };
        Some((recording.tables.iter().find(has_all)?, quantity))
    });
    let Some((table, quantity)) = found else {
        return Ok(());
    };
    let period_s = table.clock.period_s(table.rows);
    let to_m_s2 = match quantity {
        Quantity::VelocityIncrement => 1.0 / period_s,
        _ => 1.0,
    };
    let forces = windows(table, quantity, [to_m_s2; 3], bounds);
    let still = changes_rad_s(turning).filter(|(window, change)| {
        let rate = turning.get(window).map_or(f64::INFINITY, size);
        *change < bounds.slow_rad_s && rate < bounds.slow_rad_s
    });
    let found: Vec<f64> = still
        .filter_map(|(window, _)| forces.get(&window).map(size))
        .collect();
    if found.len() < bounds.fewest_windows {
        return Ok(());
    }
    let found = median(found).unwrap_or(0.0);
    let gravity_m_s2 = recording
        .site
        .map_or(STANDARD_GRAVITY_M_S2, |site| site.gravity_m_s2);
    let Some(cause) = cause(found / gravity_m_s2, 1.0 / period_s, bounds) else {
        return Ok(());
    };
    Err(InputError::new(
        file,
        "shows another gravity than the Earth's while it hardly turns",
    )
    .channel(quantity.name())
    .value(format!("{found:.4} m/s^2"))
    .expected(format!("about {gravity_m_s2:.3} m/s^2 ({cause})"))
    .or_anyway("takes them as they are"))
}

/// Returns the usual mistake for which accelerometers measure `ratio` of gravity.
fn cause(ratio: f64, rate_hz: f64, bounds: &Bounds) -> Option<&'static str> {
    const G: f64 = STANDARD_GRAVITY_M_S2;
    if ratio < bounds.none_share.min((1.0 / G) * 0.5) && ratio * rate_hz < 0.5 {
        // Below any unit of the list, except the small ones.
        let small = [
            (1e-3, "is it in km/s^2, or in thousandths?"),
            (1e-3 / G, "is it in thousands of g?"),
        ];
        let near = small
            .iter()
            .find(|(one, _)| (ratio / one - 1.0).abs() < bounds.near);
        return Some(near.map_or(
            "has gravity been taken out of it, as phones do for linear acceleration?",
            |(_, words)| words,
        ));
    }
    let listed = [
        (1.0 / G, "is it in g?"),
        (G, "was it converted from g twice?"),
        (1e3 / G, "is it in mg?"),
        (1e6 / G, "is it in micro-g?"),
        (1e3, "is it in mm/s^2, or are the stamps in milliseconds?"),
        (100.0, "is it in cm/s^2 (Gal)?"),
        (1.0 / rate_hz, "are these velocity increments, not forces?"),
        (rate_hz, "are these forces, not velocity increments?"),
    ];
    let near = |(one, _): &&(f64, &'static str)| (ratio / one - 1.0).abs() < bounds.near;
    // At 1 Hz an increment is a force.
    let is_right = (ratio - 1.0).abs() < bounds.near;
    listed
        .iter()
        .find(near)
        .filter(|_| !is_right)
        .map(|(_, words)| *words)
}

fn size(of: &[f64; 3]) -> f64 {
    of.iter().map(|part| part * part).sum::<f64>().sqrt()
}

/// Computes the change of each stretch's mean rate from the one before.
fn changes_rad_s(turning: &Windows) -> impl Iterator<Item = (i64, f64)> {
    turning.iter().filter_map(|(window, rate)| {
        let before = turning.get(&(window - 1))?;
        Some((
            *window,
            size(&[0, 1, 2].map(|axis| rate[axis] - before[axis])),
        ))
    })
}

/// Computes means of a triad over stretches; those with less than half of their rows are left out.
fn windows(table: &Table, quantity: &Quantity, factor: [f64; 3], bounds: &Bounds) -> Windows {
    let channels = AXES.map(|axis| table.channel(quantity, axis));
    let period_s = table.clock.period_s(table.rows);
    let full = (bounds.window_s / period_s).max(1.0);
    let mut sums: BTreeMap<i64, ([f64; 3], usize)> = BTreeMap::new();
    for row in 0..table.rows {
        let value = |axis: usize| {
            channels[axis].map_or(f64::NAN, |channel| channel.values[row] * factor[axis])
        };
        let values = [value(0), value(1), value(2)];
        if values.iter().all(|value| value.is_finite()) {
            let begin_s = table.start_s() + (row as f64 + 0.5) * period_s;
            let (sum, count) = sums
                .entry((begin_s / bounds.window_s).floor() as i64)
                .or_default();
            for (sum, value) in sum.iter_mut().zip(values) {
                *sum += value;
            }
            *count += 1;
        }
    }
    let whole = sums
        .into_iter()
        .filter(|(_, (_, count))| *count as f64 >= 0.5 * full);
    let mean = |(window, (sum, count)): (i64, ([f64; 3], usize))| {
        (window, sum.map(|sum| sum / count as f64))
    };
    whole.map(mean).collect()
}
