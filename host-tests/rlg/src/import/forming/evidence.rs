//! Compares gyros, forces and references of assembled tables, to tell units, rates and axes that stand nowhere.
//!
//! Angles over stretches of a quarter of a second: a reference's, and the gyros' with their unit left open. The ratio of the
//! two is the unit, whatever axes and signs.

use crate::recording::{AXES, Channel, Clock, Quantity, Table};
use rlg_signal::quantiles::median;

/// Length of a stretch \[s\]: longer than the delays of loggers, shorter than the motions of hands and tables.
const STRETCH_S: f64 = 0.25;

/// Smallest number of stretches.
const FEWEST: usize = 8;

/// Smallest rotation of the reference in all stretches that is evidence \[rad\].
const TURNED_RAD: f64 = 0.5;

/// Ratio of a reference to gyros whose unit is open.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ratio {
    /// Reference over gyros.
    pub ratio: f64,
    /// Correlation of the two, 0 to 1.
    pub agreement: f64,
    /// The reference in words.
    pub by: &'static str,
}

/// The gyros' angle since the start at each row's end \[rad, or what stands for it\].
struct Turned {
    start_s: f64,
    period_s: f64,
    /// Of x, y, z; rows that are missing turn by nothing.
    angle: [Vec<f64>; 3],
    /// Missing rows up to each row.
    missing: Vec<usize>,
}

impl Turned {
    fn of(table: &Table) -> Option<Self> {
        let (_, times) = ends_s(table)?;
        let period_s = table.clock.period_s(table.rows);
        let gyro = |axis: &str| -> Option<(&Channel, f64)> {
            let rate = table.channel(&Quantity::GyroRate, axis);
            let increment = || Some((table.channel(&Quantity::GyroIncrement, axis)?, 1.0));
            rate.map(|channel| (channel, period_s)).or_else(increment)
        };
        let gyros = [gyro("x")?, gyro("y")?, gyro("z")?];
        let mut missing = Vec::with_capacity(table.rows);
        let mut lost = 0;
        for row in 0..table.rows {
            lost += usize::from(
                gyros
                    .iter()
                    .any(|(channel, _)| channel.values[row].is_nan()),
            );
            missing.push(lost);
        }
        let summed = |(channel, scale): (&Channel, f64)| {
            let mut sum = 0.0;
            let step = |value: &f64| {
                sum += if value.is_nan() { 0.0 } else { value * scale };
                sum
            };
            channel.values.iter().map(step).collect()
        };
        Some(Self {
            start_s: times.first().copied()? - period_s,
            period_s,
            angle: gyros.map(summed),
            missing,
        })
    }

    /// Returns the angle from one time to another; `None` outside or across missing rows.
    fn between(&self, from_s: f64, to_s: f64) -> Option<[f64; 3]> {
        let at = |time_s: f64| (time_s - self.start_s) / self.period_s - 1.0;
        let (from, to) = (at(from_s), at(to_s));
        let last = self.missing.len() - 1;
        if from < 0.0 || to > last as f64 {
            return None;
        }
        let (first, end) = (from.floor() as usize, to.ceil() as usize);
        if self.missing[end] > self.missing[first] {
            return None;
        }
        let angle = |axis: usize, place: f64| {
            let row = place.floor() as usize;
            let part = place - row as f64;
            let values = &self.angle[axis];
            values[row] + part * (values[(row + 1).min(last)] - values[row])
        };
        Some([0, 1, 2].map(|axis| angle(axis, to) - angle(axis, from)))
    }
}

/// Returns a table's rows a second and the times of its rows' ends \[s\].
fn ends_s(table: &Table) -> Option<(f64, Vec<f64>)> {
    let period_s = table.clock.period_s(table.rows);
    let times = match &table.clock {
        Clock::Uniform { rate_hz, start_s } => {
            let rows = 1..=table.rows;
            rows.map(|row| start_s + row as f64 / rate_hz).collect()
        }
        Clock::Stamped { stamps_s, .. } => stamps_s.clone(),
    };
    (period_s > 0.0).then_some((1.0 / period_s, times))
}

fn size(vector: [f64; 3]) -> f64 {
    vector.iter().map(|part| part * part).sum::<f64>().sqrt()
}

/// Sums of two sequences of lengths.
#[derive(Default)]
struct Sums {
    count: usize,
    gyros: f64,
    others: f64,
    both: f64,
    turned: f64,
}

impl Sums {
    fn add(&mut self, gyros: f64, other: f64) {
        self.count += 1;
        self.gyros += gyros * gyros;
        self.others += other * other;
        self.both += gyros * other;
        self.turned += other.abs();
    }

    fn ratio(&self, by: &'static str) -> Option<Ratio> {
        let is_enough = self.count >= FEWEST && self.turned > TURNED_RAD && self.gyros > 0.0;
        is_enough.then(|| Ratio {
            ratio: (self.others / self.gyros).sqrt(),
            agreement: self.both.abs() / (self.gyros * self.others).sqrt(),
            by,
        })
    }
}

/// Returns the ratio of a reference's turns to the gyros'.
pub fn of_reference(tables: &[Table]) -> Option<Ratio> {
    let gyros = tables.iter().find_map(Turned::of)?;
    let by_attitude = tables
        .iter()
        .find_map(|table| attitude_ratio(&gyros, table));
    by_attitude.or_else(|| {
        tables
            .iter()
            .find_map(|table| increment_ratio(&gyros, table))
    })
}

fn stride(rate_hz: f64) -> usize {
    ((STRETCH_S * rate_hz).round() as usize).max(1)
}

fn attitude_ratio(gyros: &Turned, table: &Table) -> Option<Ratio> {
    let mut sums = Sums::default();
    for (angle, turn) in attitude_turns(gyros, table)? {
        sums.add(size(angle), size(turn));
    }
    sums.ratio("the attitude")
}

/// Returns the gyros' and the attitude's turn over each stretch.
fn attitude_turns(gyros: &Turned, table: &Table) -> Option<Vec<([f64; 3], [f64; 3])>> {
    let part = |axis: &str| table.channel(&Quantity::ReferenceAttitude, axis);
    let parts = [part("w")?, part("x")?, part("y")?, part("z")?];
    let (rate_hz, times) = ends_s(table)?;
    let at = |row: usize| parts.map(|channel| channel.values[row]);
    let rows: Vec<usize> = (0..table.rows)
        .filter(|row| at(*row)[0].is_finite())
        .collect();
    let step = stride(rate_hz * rows.len() as f64 / table.rows as f64);
    let pairs = rows.windows(step + 1).step_by(step);
    let turns = pairs.filter_map(|rows| {
        let (from, to) = (rows[0], rows[step]);
        let angle = gyros.between(times[from], times[to])?;
        Some((angle, rotation_vector(at(from), at(to))))
    });
    Some(turns.collect())
}

/// Misfit of an attitude's turns to the gyros', in their axes, relative to the turns.
#[derive(Debug, Clone, PartialEq)]
pub struct Misfit {
    /// To the gyros as they are.
    pub as_is: f64,
    /// To the gyros, those of [`Misfit::reversed`] with the other sign.
    pub with_signs: f64,
    /// Axes whose gyro fits better with the other sign.
    pub reversed: Vec<&'static str>,
}

/// Returns the misfit of an attitude; with `is_open` that of gyros scaled to the turns' length, which no order of the
/// attitude's components changes.
pub fn attitude_misfit(tables: &[Table], is_open: bool) -> Option<Misfit> {
    let gyros = tables.iter().find_map(Turned::of)?;
    let turns = tables
        .iter()
        .find_map(|table| attitude_turns(&gyros, table))?;
    let angles: f64 = turns.iter().map(|(angle, _)| size(*angle).powi(2)).sum();
    let all: f64 = turns.iter().map(|(_, turn)| size(*turn).powi(2)).sum();
    let scale = if is_open { (all / angles).sqrt() } else { 1.0 };
    let off = |axis: usize, sign: f64| -> f64 {
        let each = turns
            .iter()
            .map(|(angle, turn)| (sign * scale * angle[axis] - turn[axis]).powi(2));
        each.sum()
    };
    let as_is = [0, 1, 2].map(|axis| off(axis, 1.0));
    let reversed = [0, 1, 2].map(|axis| off(axis, -1.0));
    let is_reversed = |axis: &usize| reversed[*axis] < as_is[*axis];
    let relative = |off2: f64| (off2 / all).sqrt();
    let turned: f64 = turns.iter().map(|(_, turn)| size(*turn)).sum();
    (turns.len() >= FEWEST && turned > TURNED_RAD).then(|| Misfit {
        as_is: relative(as_is.iter().sum()),
        with_signs: relative((0..3).map(|axis| as_is[axis].min(reversed[axis])).sum()),
        reversed: (0..3).filter(is_reversed).map(|axis| AXES[axis]).collect(),
    })
}

/// Computes the rotation from one quaternion to another in the axes of the first \[rad\].
fn rotation_vector([a, b, c, d]: [f64; 4], [e, f, g, h]: [f64; 4]) -> [f64; 3] {
    let real = a * e + b * f + c * g + d * h;
    let vector = [
        a * f - b * e - c * h + d * g,
        a * g - c * e - d * f + b * h,
        a * h - d * e - b * g + c * f,
    ];
    let sine = size(vector);
    let angle = 2.0 * sine.atan2(real.abs()) * real.signum();
    let scale = if sine > 0.0 { angle / sine } else { 0.0 };
    vector.map(|part| part * scale)
}

/// Returns a reference's angle over each stretch about each axis that it has, with the gyros'.
fn increment_turns(gyros: &Turned, table: &Table) -> Option<Vec<([f64; 3], [f64; 3])>> {
    let channel = |axis: &str| table.channel(&Quantity::ReferenceIncrement, axis);
    let channels = [channel("x"), channel("y"), channel("z")];
    let has = channels.map(|channel| {
        let channel = channel.filter(|one| one.values.iter().any(|value| value.abs() > 0.0));
        channel.is_some()
    });
    let (rate_hz, times) = has.contains(&true).then(|| ends_s(table))??;
    let step = stride(rate_hz);
    let mut turns = Vec::new();
    for end in (step..table.rows).step_by(step) {
        let sum = |axis: usize| match channels[axis].filter(|_| has[axis]) {
            Some(channel) => channel.values[end + 1 - step..=end].iter().sum(),
            None => 0.0,
        };
        let turn: [f64; 3] = [0, 1, 2].map(sum);
        if let Some(angle) = gyros.between(times[end - step], times[end])
            && turn.iter().all(|part| part.is_finite())
        {
            turns.push((angle, turn));
        }
    }
    Some(turns)
}

fn increment_ratio(gyros: &Turned, table: &Table) -> Option<Ratio> {
    let mut sums = Sums::default();
    for (angle, turn) in increment_turns(gyros, table)? {
        sums.add(size(angle), size(turn));
    }
    sums.ratio("the table")
}

/// Returns the gyro that a reference about one axis follows: its axis and the correlation with its sign.
pub fn axis_of_reference(tables: &[Table]) -> Option<(&'static str, f64)> {
    let gyros = tables.iter().find_map(Turned::of)?;
    let turns = tables
        .iter()
        .find_map(|table| increment_turns(&gyros, table))?;
    let correlation = |axis: usize| {
        let (mut both, mut gyro, mut table) = (0.0, 0.0, 0.0);
        for (angle, turn) in &turns {
            let turn: f64 = turn.iter().sum();
            both += angle[axis] * turn;
            gyro += angle[axis].powi(2);
            table += turn * turn;
        }
        both / (gyro * table).sqrt().max(f64::MIN_POSITIVE)
    };
    let found = [0, 1, 2].map(correlation);
    let best = (0..3).max_by(|a, b| found[*a].abs().total_cmp(&found[*b].abs()))?;
    (turns.len() >= FEWEST).then(|| (AXES[best], found[best]))
}

/// Returns the ratio of gravity's turns, seen by the accelerometers, to the gyros'.
pub fn of_gravity(tables: &[Table]) -> Option<Ratio> {
    let (table, gyros) = tables
        .iter()
        .find_map(|table| Some((table, Turned::of(table)?)))?;
    let force = |axis: &str| table.channel(&Quantity::SpecificForce, axis);
    let forces = [force("x")?, force("y")?, force("z")?];
    let (rate_hz, times) = ends_s(table)?;
    let step = stride(rate_hz);
    let mean = |from: usize| {
        forces.map(|channel| channel.values[from..from + step].iter().sum::<f64>() / step as f64)
    };
    let (mut changed, mut predicted, mut both, mut turned, mut count) = (0.0, 0.0, 0.0, 0.0, 0);
    for from in (0..table.rows.saturating_sub(2 * step)).step_by(step) {
        let (a, b) = (mean(from), mean(from + step));
        let middle = from + step / 2;
        let Some(angle) = gyros.between(times[middle], times[middle + step]) else {
            continue;
        };
        let between = [0, 1, 2].map(|axis| (a[axis] + b[axis]) / 2.0);
        let length = size(between);
        // A force that is fixed in space turns against the unit.
        let turns = cross(between, angle);
        for axis in 0..3 {
            let change = (b[axis] - a[axis]) / length;
            let expected = turns[axis] / length;
            if change.is_finite() {
                changed += change * change;
                predicted += expected * expected;
                both += change * expected;
            }
        }
        turned += size([0, 1, 2].map(|axis| b[axis] - a[axis])) / length;
        count += 1;
    }
    let agreement = both / (changed * predicted).sqrt();
    let is_enough = count >= FEWEST && turned > TURNED_RAD && agreement.is_finite();
    is_enough.then(|| Ratio {
        ratio: both / predicted,
        agreement: agreement.max(0.0),
        by: "gravity",
    })
}

fn cross([a, b, c]: [f64; 3], [d, e, f]: [f64; 3]) -> [f64; 3] {
    [b * f - c * e, c * d - a * f, a * e - b * d]
}

/// Returns the median length of the specific force, in its own unit.
pub fn force_length(tables: &[Table]) -> Option<f64> {
    tables.iter().find_map(|table| {
        let force = |axis: &str| table.channel(&Quantity::SpecificForce, axis);
        let forces = [force("x")?, force("y")?, force("z")?];
        let lengths = (0..table.rows).map(|row| size(forces.map(|channel| channel.values[row])));
        median(lengths.filter(|length| length.is_finite()))
    })
}
