//! Compares the slow channels of a recording with the limits of a unit's health.
//!
//! Temperatures and the quantities of [`Quantity::HEALTH`]: rate, missing share, range, and the stretches beyond a limit with
//! their times \[s\]. The limits act as in the firmware ([`trueaxis::slow_channels`]), on the recorded values; but a
//! dither amplitude is not judged, since a recording does not hold its nominal value.

use trueaxis::HealthLimits;
use trueaxis::slow_channels::SILENCE_S;

use crate::recording::{Channel, Clock, Quantity, Recording, Table};

/// One slow channel.
#[derive(Debug, Clone, PartialEq)]
pub struct SlowChannel {
    /// Its quantity.
    pub quantity: Quantity,
    /// Its axis, if it has one.
    pub axis: Option<String>,
    /// Rows a second \[Hz\].
    pub rate_hz: f64,
    /// Share of the rows without a value.
    pub missing: f64,
    /// Smallest and largest value; `None` if nothing was measured.
    pub range: Option<[f64; 2]>,
    /// Stretches beyond a limit, in time.
    pub crossings: Vec<Crossing>,
}

/// Stretch of rows beyond one limit.
#[derive(Debug, Clone, PartialEq)]
pub struct Crossing {
    /// Key of the limit.
    pub limit: &'static str,
    /// Relation of the values to it.
    pub relation: Relation,
    /// Value of the limit; for [`Relation::Absent`] the longest stretch without a reading \[s\].
    pub bound: f64,
    /// First and last row of the stretch \[s\].
    pub times_s: [f64; 2],
    /// Value farthest beyond; `None` where there is none.
    pub worst: Option<f64>,
}

/// Relation of values to a limit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Relation {
    /// Below a least value.
    Below,
    /// Above a largest one.
    Above,
    /// Stepped by more than the limit; the worst value is the largest step.
    Stepped,
    /// The control was reset; the worst value is the number of resets.
    Reset,
    /// Not measured.
    Absent,
}

impl Relation {
    /// Word for it.
    pub fn word(self) -> &'static str {
        match self {
            Self::Below => "below",
            Self::Above => "above",
            Self::Stepped => "stepped",
            Self::Reset => "reset",
            Self::Absent => "absent",
        }
    }
}

/// Lists the slow channels of a recording; without limits nothing is beyond one.
pub fn slow_channels(recording: &Recording, limits: Option<&HealthLimits>) -> Vec<SlowChannel> {
    let is_slow = |channel: &&Channel| {
        channel.quantity == Quantity::Temperature || Quantity::HEALTH.contains(&channel.quantity)
    };
    let of_table = |table: &'_ Table| -> Vec<SlowChannel> {
        let channels = table.channels.iter().filter(is_slow);
        channels
            .map(|channel| slow_channel(table, channel, limits))
            .collect()
    };
    recording.tables.iter().flat_map(of_table).collect()
}

fn slow_channel(table: &Table, channel: &Channel, limits: Option<&HealthLimits>) -> SlowChannel {
    let values = &channel.values;
    let measured = || values.iter().copied().filter(|value| !value.is_nan());
    let range = measured().fold(None, |range, value| {
        let [least, largest] = range.unwrap_or([value; 2]);
        Some([f64::min(least, value), f64::max(largest, value)])
    });
    SlowChannel {
        quantity: channel.quantity.clone(),
        axis: channel.axis.clone(),
        rate_hz: 1.0 / table.clock.period_s(table.rows),
        missing: 1.0 - measured().count() as f64 / values.len().max(1) as f64,
        range,
        crossings: limits.map_or_else(Vec::new, |limits| crossings(table, channel, limits)),
    }
}

/// Stretches of a channel beyond its limits, in time.
fn crossings(table: &Table, channel: &Channel, limits: &HealthLimits) -> Vec<Crossing> {
    let rows = Rows::of(table, &channel.values);
    let axis = ["x", "y", "z"].into_iter();
    let axis = axis
        .zip(0..)
        .find(|(axis, _)| channel.axis.as_deref() == Some(axis));
    let mut found = match channel.quantity {
        Quantity::Temperature => limits
            .temperature_k
            .map(|range| rows.outside("temperature_k", range)),
        Quantity::LaserIntensity => limits.intensity_least.zip(axis).map(|(least, (_, axis))| {
            let least: f64 = least[axis];
            rows.outside("intensity_least", [least, f64::INFINITY])
        }),
        Quantity::PathLengthDrive => limits.path_length_step.map(|step| rows.steps(step)),
        Quantity::PathLengthResets => limits.path_length_step.map(|_| rows.resets()),
        Quantity::DitherDrive => limits
            .dither_drive
            .map(|range| rows.outside("dither_drive", range)),
        Quantity::TimeSincePulse => limits
            .pulse_silence_s
            .map(|silence_s| rows.outside("pulse_silence_s", [0.0, silence_s])),
        _ => None,
    }
    .unwrap_or_default();
    found.sort_by(|one, other| one.times_s[0].total_cmp(&other.times_s[0]));
    found
}

/// Rows of a channel: time \[s\] and value, NaN where not measured.
struct Rows(Vec<(f64, f64)>);

impl Rows {
    fn of(table: &Table, values: &[f64]) -> Self {
        let time_s = |row: usize| match &table.clock {
            Clock::Uniform { rate_hz, start_s } => start_s + (row + 1) as f64 / rate_hz,
            Clock::Stamped { stamps_s, .. } => stamps_s[row],
        };
        Self(
            values
                .iter()
                .enumerate()
                .map(|(row, value)| (time_s(row), *value))
                .collect(),
        )
    }

    /// Stretches below or above a range, and those without a reading.
    fn outside(&self, limit: &'static str, [least, largest]: [f64; 2]) -> Vec<Crossing> {
        let mut found = self.stretches(limit, Relation::Below, least, |value| least - value);
        found.extend(self.stretches(limit, Relation::Above, largest, |value| value - largest));
        found.extend(self.absent(limit));
        found
    }

    /// Stretches in which `excess` is positive; the worst value is that with the largest.
    fn stretches(
        &self,
        limit: &'static str,
        relation: Relation,
        bound: f64,
        excess: impl Fn(f64) -> f64,
    ) -> Vec<Crossing> {
        let mut found: Vec<Crossing> = Vec::new();
        let mut goes_on = false;
        for &(time_s, value) in &self.0 {
            let is_beyond = excess(value) > 0.0;
            match found.last_mut().filter(|_| goes_on && is_beyond) {
                Some(crossing) => {
                    crossing.times_s[1] = time_s;
                    crossing.worst = crossing
                        .worst
                        .filter(|worst| excess(*worst) >= excess(value))
                        .or(Some(value));
                }
                None if is_beyond => found.push(Crossing {
                    limit,
                    relation,
                    bound,
                    times_s: [time_s; 2],
                    worst: Some(value),
                }),
                None => {}
            }
            goes_on = is_beyond;
        }
        found
    }

    /// Stretches without a reading for longer than the firmware allows.
    fn absent(&self, limit: &'static str) -> Vec<Crossing> {
        let is_absent = |value: f64| if value.is_nan() { 1.0 } else { 0.0 };
        let mut found = self.stretches(limit, Relation::Absent, SILENCE_S, is_absent);
        // From the last reading before to the first after, as far as the rows know.
        let period_s = match &self.0[..] {
            [(first, _), .., (last, _)] => (last - first) / (self.0.len() - 1) as f64,
            _ => SILENCE_S,
        };
        found.retain(|crossing| {
            let [first, last] = crossing.times_s;
            last - first + 2.0 * period_s > SILENCE_S
        });
        found.iter_mut().for_each(|crossing| crossing.worst = None);
        found
    }

    /// Measured rows, each with the one before it.
    fn pairs(&self) -> impl Iterator<Item = [(f64, f64); 2]> {
        let measured: Vec<_> = self.0.iter().filter(|(_, value)| !value.is_nan()).collect();
        let pairs: Vec<_> = measured
            .windows(2)
            .map(|pair| [*pair[0], *pair[1]])
            .collect();
        pairs.into_iter()
    }

    /// Steps of a drive above the limit.
    fn steps(&self, step: f64) -> Vec<Crossing> {
        let limit = "path_length_step";
        let stepped = self.pairs().map(|[(_, before), (time_s, value)]| Crossing {
            limit,
            relation: Relation::Stepped,
            bound: step,
            times_s: [time_s; 2],
            worst: Some(value - before),
        });
        let mut found: Vec<_> = stepped
            .filter(|crossing| crossing.worst.is_some_and(|worst| worst.abs() > step))
            .collect();
        found.extend(self.absent(limit));
        found
    }

    /// Changes of a count of resets.
    fn resets(&self) -> Vec<Crossing> {
        let limit = "path_length_step";
        let changes = self
            .pairs()
            .filter(|[(_, before), (_, count)]| before != count);
        let mut found: Vec<_> = changes
            .map(|[(_, before), (time_s, count)]| Crossing {
                limit,
                relation: Relation::Reset,
                bound: 0.0,
                times_s: [time_s; 2],
                worst: Some(count - before),
            })
            .collect();
        found.extend(self.absent(limit));
        found
    }
}
