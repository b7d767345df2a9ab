//! Samples and parameters of the chain, from a recording and its model.
//!
//! [`ReplayInput`] holds the core's [`Sample`]s and [`Parameters`], the same samples in f64 for the reference chain, the
//! case's increments from the recording's reference if it has one, and velocity increments if there are accelerometers.
//! Body frame, rad, m/s.
//!
//! Requantisation, and its errors:
//! - `gyro_count` passes unchanged.
//! - `dither_angle` passes unchanged if its values are whole numbers of its own scale, as pickoff codes are. Else it
//!   becomes codes of 2⁻³² rad: an error of 2⁻³²/√12 = 6.7e-11 rad, white in *angle*, so that it is bounded and causes no
//!   drift (a pickoff's own noise is a thousand times larger).
//! - `gyro_increment` and `gyro_rate` become counts of 2⁻³⁴ rad of the *running* angle: the remainder of one count carries
//!   over to the next, so that the sum stays within 6e-11 rad at all times.
//! - `velocity_increment` passes unchanged if in whole numbers of its own scale; else, like `specific_force`, it becomes
//!   codes of 2⁻²⁹ m/s of the running velocity (`accelerometers`).
//!
//! Missing values: rows at the start and at the end that lack a gyro or a pickoff are left out; but the pickoffs of the row
//! before the first complete one are used, since the chain's first sample only primes the strip, whatever its counts.
//! Within the recording such a row is an error, because a missing angle cannot be replaced. A row that lacks the reference
//! is kept; the comparison leaves out the affected periods.
//!
//! Out of scope: resampling. Gyros and pickoffs must share one clock.

use crate::accelerometers::{self, velocity_rows, velocity_weight_m_s};
use crate::dither;
use crate::slow::{Outputs, Slow};
use crate::whole_codes::own_scale;
use rlg_model::Model;
use rlg_parameters::{
    DitherMotion, SAMPLES_PER_OUTPUT, Unit, reference_is_no_truth, unchecked_parameters,
};
use rlg_recording::error::InputError;
use rlg_recording::{Axis, Channel, Clock, Quantity, Recording, Table};
use std::path::Path;
use trueaxis::design_parameters::PICKOFF_WEIGHT_RANGE_RAD;
use trueaxis::{CrossAxis, ParameterError, Parameters, Sample};

/// Angle of one pickoff code for angles that were not recorded in codes \[rad\]: an `i32` holds ±0.5 rad, hundreds of times
/// the amplitude of any dither.
pub const PICKOFF_WEIGHT_RAD: f64 = 1.0 / (1u64 << 32) as f64;

/// Angle of one count of a gyro that was not recorded in pulses \[rad\]: the finest that the chain accepts, 1.2e-5″; an
/// `i32` holds ±0.125 rad a period.
pub const INCREMENT_WEIGHT_RAD: f64 = 1.0 / (1u64 << 34) as f64;

/// Tolerance of stamps against a uniform clock \[periods\]: K/T² enters the compensation squared, so that a hundredth of a
/// period appears as at most 2 % of a small term.
const STAMP_TOLERANCE_PERIODS: f64 = 0.01;

/// Settings of the chain beyond the model.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Setup {
    /// Samples in one output period.
    pub samples_per_output: u16,
    /// Time constant of the strip's adaptation to the pickoff's gain and delay \[s\]; 0: frozen.
    pub adaptation_time_s: f64,
    /// The recording's accelerometers pass through the chain.
    pub accelerometers: bool,
}

impl Setup {
    /// The commands' defaults.
    pub const STANDARD: Self = Self {
        samples_per_output: SAMPLES_PER_OUTPUT,
        adaptation_time_s: 0.0,
        accelerometers: true,
    };
}

/// Input of a replay.
#[derive(Debug, Clone, PartialEq)]
pub struct ReplayInput {
    /// Samples for the core, one a period.
    pub samples: Vec<Sample>,
    /// Parameters of the core, with the weights of `samples`.
    pub parameters: Parameters,
    /// Kinds of the model's effects for which the chain has no term.
    pub uncompensated: Vec<String>,
    /// Sensed increments as recorded \[rad\].
    pub sensed_rad: Vec<[f64; 3]>,
    /// Pickoff angles as recorded \[rad\]; zeros without dither.
    pub pickoff_rad: Vec<[f64; 3]>,
    /// Velocity increments as recorded \[m/s\], if there are usable accelerometers.
    pub velocity_m_s: Option<Vec<[f64; 3]>>,
    /// Slowly sampled quantities, a row per output period.
    pub slow: Slow,
    /// Reason why existing accelerometers are not usable.
    pub velocity_refused: Option<String>,
    /// Increments of the case by the recording's reference \[rad\], NaN if not measured.
    pub reference_rad: Option<Vec<[f64; 3]>>,
    /// Start of the first sample's period \[s\].
    pub start_s: f64,
    /// Number of rows left out at the start and at the end.
    pub rows_left_out: [usize; 2],
    /// Reason why an existing reference is not comparable.
    pub reference_refused: Option<String>,
}

/// Samples of a recording with a model, or the obstacle; `model_file` is for messages.
pub fn samples_from_recording(
    recording: &Recording,
    model: &Model,
    model_file: &Path,
    setup: Setup,
) -> Result<ReplayInput, InputError> {
    let gyros = Gyros::find(recording)?;
    let rate_hz = uniform_rate_hz(recording, gyros.table)?;
    let pickoffs = gyros.pickoffs(recording, model)?;

    let Kept { rows: kept, primes } = kept_rows(recording, &gyros, &pickoffs)?;
    let rows_left_out = [kept.start, gyros.table.rows - kept.end];
    let start_s = gyros.table.start_s() + kept.start as f64 / rate_hz;

    let pickoff_rad: Vec<[f64; 3]> = kept
        .clone()
        .map(|row| pickoffs.map_or([0.0; 3], |found| found.map(|channel| channel.values[row])))
        .collect();
    let same_clock = |other: &Table| gyros.shares_clock(other, rate_hz);
    let (velocity_m_s, velocity_refused) = if setup.accelerometers {
        match velocity_rows(recording, kept.clone(), primes, rate_hz, &same_clock) {
            Ok(velocity) => (velocity, None),
            Err(why) => (None, Some(why)),
        }
    } else {
        (None, None)
    };
    let noise_rad = model.pickoff_noise_rad();
    let unit = Unit {
        sample_rate_hz: rate_hz,
        samples_per_output: setup.samples_per_output,
        adaptation_time_s: setup.adaptation_time_s,
        dither: pickoffs.map(|_| dither::measure(&pickoff_rad, noise_rad, rate_hz)),
        accelerometer_weight_m_s: velocity_m_s
            .as_ref()
            .map(|_| velocity_weight_m_s(recording, kept.clone())),
    };
    let (mut parameters, uncompensated) = unchecked_parameters(model, &unit).map_err(|error| {
        InputError::new(model_file, format!("does not fit the chain: {error}"))
            .channel("installation_rad")
            .value(format!("{:?}", model.gyro.installation_rad.to_array()))
    })?;
    parameters.pickoff_weight_rad = pickoff_weight_rad(&pickoffs, kept.clone());
    if pickoffs.is_none() {
        parameters.pickoff_gain = [0.0; 3];
    }
    let mut unit_rad = [1.0; 3];
    match gyros.quantity {
        Quantity::GyroCount => unit_rad = parameters.pulse_weight_rad,
        Quantity::GyroRate => {
            unit_rad = [1.0 / rate_hz; 3];
            parameters.pulse_weight_rad = [INCREMENT_WEIGHT_RAD; 3];
        }
        _ => parameters.pulse_weight_rad = [INCREMENT_WEIGHT_RAD; 3],
    }
    let table_file = recording.folder.join(&gyros.table.file);
    parameters
        .check()
        .map_err(|error| unfit(error, &parameters, model_file, &table_file))?;
    let fewest = usize::from(setup.samples_per_output);
    if kept.len() < fewest {
        return Err(
            InputError::new(table_file, "is shorter than one output period")
                .value(format!("{} measured rows", kept.len()))
                .expected(format!("at least {fewest}")),
        );
    }

    let mut input = ReplayInput {
        samples: vec![Sample::default(); kept.len()],
        sensed_rad: vec![[0.0; 3]; kept.len()],
        pickoff_rad,
        slow: Slow::at(
            recording,
            Outputs {
                start_s,
                period_s: f64::from(setup.samples_per_output) / rate_hz,
                count: kept.len() / fewest,
            },
        ),
        velocity_m_s,
        velocity_refused,
        reference_rad: None,
        parameters,
        uncompensated,
        start_s,
        rows_left_out,
        reference_refused: None,
    };
    for axis in Axis::ALL.map(Axis::index) {
        let channel = gyros.channels[axis];
        let mut values = channel.values[kept.clone()].to_vec();
        if primes {
            // Not measured; the chain ignores the angle of the priming sample.
            values[0] = 0.0;
        }
        for (sensed, value) in input.sensed_rad.iter_mut().zip(&values) {
            sensed[axis] = value * unit_rad[axis];
        }
        let codes = if gyros.quantity == Quantity::GyroCount {
            codes(values.iter().copied())
        } else {
            codes(counts_of_running_angle(&values, unit_rad[axis]))
        };
        let codes = codes.map_err(|row| beyond(recording, &gyros, channel, kept.start + row))?;
        for (sample, code) in input.samples.iter_mut().zip(codes) {
            sample.pulse_counts[axis] = code;
        }
        if let Some(pickoffs) = &pickoffs {
            let channel = pickoffs[axis];
            let values = &channel.values[kept.clone()];
            let codes = codes_of_angle(values, input.parameters.pickoff_weight_rad)
                .map_err(|row| beyond(recording, &gyros, channel, kept.start + row))?;
            for (row, code) in codes.into_iter().enumerate() {
                input.samples[row].pickoff_codes[axis] = code;
            }
        }
    }
    if let (Some(velocity), Some(known)) = (&input.velocity_m_s, &input.parameters.accelerometers) {
        let codes = accelerometers::codes(velocity, known.weight_m_s);
        for (sample, codes) in input.samples.iter_mut().zip(codes) {
            sample.accelerometer_codes = codes;
        }
    }
    match (
        reference_is_no_truth(model),
        reference_rows(recording, &gyros, rate_hz, kept),
    ) {
        (_, Ok(None)) => {}
        (Some(why), _) | (None, Err(why)) => input.reference_refused = Some(why),
        (None, Ok(reference)) => input.reference_rad = reference,
    }
    Ok(input)
}

/// Dither measured by the pickoffs of a recording.
pub fn dither_of_recording(
    recording: &Recording,
    model: &Model,
) -> Result<DitherMotion, InputError> {
    let gyros = Gyros::find(recording)?;
    let rate_hz = uniform_rate_hz(recording, gyros.table)?;
    let Some(pickoffs) = gyros.pickoffs(recording, model)? else {
        return Err(
            InputError::new(&recording.folder, "shows no dither to measure")
                .channel("dither_angle")
                .expected("gyro_count and dither_angle for x, y and z"),
        );
    };
    let kept = kept_rows(recording, &gyros, &Some(pickoffs))?;
    let angles: Vec<[f64; 3]> = kept
        .rows
        .map(|row| pickoffs.map(|channel| channel.values[row]))
        .collect();
    Ok(dither::measure(&angles, model.pickoff_noise_rad(), rate_hz))
}

/// Error for the input outside the chain's limits, with its value (effects of the model included).
fn unfit(
    error: ParameterError,
    parameters: &Parameters,
    model_file: &Path,
    table_file: &Path,
) -> InputError {
    let triad = |values: [f64; 3]| format!("{values:?}");
    let six = |values: &CrossAxis<f64>| format!("{:?}", values.to_array());
    let (file, key, value) = match error {
        ParameterError::PulseWeight => (
            model_file,
            "pulse_weight_rad",
            triad(parameters.pulse_weight_rad),
        ),
        ParameterError::Bias => (model_file, "bias_rad_s", triad(parameters.bias_rad_s)),
        ParameterError::ScaleError => (model_file, "scale_error", triad(parameters.scale_error)),
        ParameterError::Installation => (
            model_file,
            "installation_rad",
            six(&parameters.installation_rad),
        ),
        ParameterError::Flexure => (model_file, "axis_flexure", six(&parameters.flexure_s2)),
        ParameterError::PickoffGain => (model_file, "pickoff_gain", triad(parameters.pickoff_gain)),
        ParameterError::PickoffWeight => (
            table_file,
            "dither_angle",
            parameters.pickoff_weight_rad.to_string(),
        ),
        ParameterError::SampleRate => {
            (table_file, "rate_hz", parameters.sample_rate_hz.to_string())
        }
        ParameterError::SamplesPerOutput => (
            Path::new("--output-every"),
            "samples_per_output",
            parameters.samples_per_output.to_string(),
        ),
        ParameterError::OutputPeriod => (
            Path::new("--output-every"),
            "samples_per_output",
            format!(
                "{}, at most {} at {} Hz",
                parameters.samples_per_output,
                parameters.most_samples_per_output(),
                parameters.sample_rate_hz
            ),
        ),
        ParameterError::FlexureDamping => (
            model_file,
            "damping of axis_flexure",
            format!("{:?}", parameters.flexure_response),
        ),
        ParameterError::PickoffDelay => (
            model_file,
            "pickoff_delay_s",
            triad(parameters.pickoff_delay_s),
        ),
        ParameterError::DitherFrequency => (
            model_file,
            "dither_frequency_hz",
            triad(parameters.dither_frequency_hz),
        ),
        ParameterError::DitherAmplitude => (
            model_file,
            "dither_amplitude_rad",
            triad(parameters.dither_amplitude_rad),
        ),
        ParameterError::AdaptationTime => (
            Path::new("--adapt-s"),
            "adaptation_time_s",
            parameters.adaptation_time_s.to_string(),
        ),
        ParameterError::AccelerometerWeight
        | ParameterError::AccelerometerBias
        | ParameterError::AccelerometerScale
        | ParameterError::AccelerometerMisalignment
        | ParameterError::LeverArm
        | ParameterError::TermNeedsAccelerometers(_) => (
            model_file,
            "accelerometer",
            format!("{:?}", parameters.accelerometers),
        ),
        ParameterError::Term(kind) | ParameterError::TermAbsent(kind) => (
            model_file,
            kind.name(),
            format!("{:?}", parameters.terms.kinds()),
        ),
        ParameterError::TermsTooLarge | ParameterError::Records(_) => (
            model_file,
            "effect",
            format!("{:?}", parameters.terms.kinds()),
        ),
        _ => (model_file, "parameters", format!("{parameters:?}")),
    };
    InputError::new(file, format!("does not fit the chain: {error}"))
        .channel(key)
        .value(value)
}

/// The three gyro channels, of one quantity and in one table.
struct Gyros<'a> {
    quantity: Quantity,
    table: &'a Table,
    channels: [&'a Channel; 3],
}

impl<'a> Gyros<'a> {
    /// Prefers counts to increments to rates: the least processed channel.
    fn find(recording: &'a Recording) -> Result<Self, InputError> {
        for quantity in Quantity::GYROS {
            let Some((table, _)) = Axis::ALL
                .iter()
                .find_map(|axis| recording.channel(&quantity, axis.label()))
            else {
                continue;
            };
            let channels = triad(recording, table, &quantity)?;
            return Ok(Self {
                quantity,
                table,
                channels,
            });
        }
        Err(InputError::new(&recording.folder, "has no gyro channel")
            .expected("gyro_count, gyro_increment or gyro_rate for x, y and z"))
    }

    /// True if a table's rows are the gyros' rows: within a hundredth of a period at both ends, nanoradians of the fastest
    /// motion.
    fn shares_clock(&self, other: &Table, rate_hz: f64) -> bool {
        let tolerance_s = STAMP_TOLERANCE_PERIODS / rate_hz;
        other.rows == self.table.rows
            && (other.start_s() - self.table.start_s()).abs() < tolerance_s
            && (other.end_s() - self.table.end_s()).abs() < tolerance_s
    }

    /// Pickoffs of dithered gyros; an error if the model has a dither to strip and the recording none.
    fn pickoffs(
        &self,
        recording: &'a Recording,
        model: &Model,
    ) -> Result<Option<[&'a Channel; 3]>, InputError> {
        if self.quantity != Quantity::GyroCount {
            // by the contract these contain no dither
            return Ok(None);
        }
        let found = Axis::ALL.iter().any(|axis| {
            recording
                .channel(&Quantity::DitherAngle, axis.label())
                .is_some()
        });
        match (found, &model.dither) {
            (false, None) => Ok(None),
            // Without a [dither] the pickoff values are used unchanged.
            (true, _) => triad(recording, self.table, &Quantity::DitherAngle).map(Some),
            (false, Some(_)) => Err(InputError::new(
                &recording.folder,
                "has no pickoff channel, but the model has a [dither] to strip",
            )
            .channel("dither_angle")
            .expected("dither_angle for x, y and z")),
        }
    }
}

fn triad<'a>(
    recording: &Recording,
    table: &'a Table,
    quantity: &Quantity,
) -> Result<[&'a Channel; 3], InputError> {
    let find = |axis: Axis| {
        table.channel(quantity, axis.label()).ok_or_else(|| {
            InputError::new(recording.folder.join(&table.file), "lacks a channel")
                .channel(format!("{} {}", quantity.name(), axis.label()))
                .expected("x, y and z in one table")
        })
    };
    Ok([find(Axis::X)?, find(Axis::Y)?, find(Axis::Z)?])
}

fn uniform_rate_hz(recording: &Recording, table: &Table) -> Result<f64, InputError> {
    let period_s = table.clock.period_s(table.rows);
    if let Clock::Stamped { column, stamps_s } = &table.clock {
        let stray = stamps_s.windows(2).position(|pair| {
            (pair[1] - pair[0] - period_s).abs() > STAMP_TOLERANCE_PERIODS * period_s
        });
        if let Some(row) = stray {
            return Err(InputError::new(
                recording.folder.join(&table.file),
                "is not evenly sampled",
            )
            .channel(column)
            .row(row as u64 + 1)
            .value(stamps_s[row + 1] - stamps_s[row])
            .expected(format!(
                "{period_s} s between rows: the chain has one period"
            )));
        }
    }
    Ok(1.0 / period_s)
}

/// Rows that are replayed.
struct Kept {
    rows: std::ops::Range<usize>,
    /// Only the pickoffs of the first row were measured: it primes the strip.
    primes: bool,
}

/// Angle of one pickoff code \[rad\]: the recorded one if all three pickoffs were recorded in the same codes.
fn pickoff_weight_rad(pickoffs: &Option<[&Channel; 3]>, rows: std::ops::Range<usize>) -> f64 {
    let own = |channel: &Channel| own_scale(channel, rows.clone(), PICKOFF_WEIGHT_RANGE_RAD);
    match pickoffs.map(|found| found.map(own)) {
        Some([Some(x), Some(y), Some(z)]) if x == y && y == z => x,
        _ => PICKOFF_WEIGHT_RAD,
    }
}

/// Rows from the first to the last complete one, and the one before them if its pickoffs were measured; a gap in between is
/// an error.
fn kept_rows(
    recording: &Recording,
    gyros: &Gyros,
    pickoffs: &Option<[&Channel; 3]>,
) -> Result<Kept, InputError> {
    let channels: Vec<&Channel> = gyros
        .channels
        .iter()
        .chain(pickoffs.iter().flatten())
        .copied()
        .collect();
    let missing = |row: &usize| channels.iter().find(|c| c.values[*row].is_nan());
    let measured = |row: &usize| missing(row).is_none();
    let file = recording.folder.join(&gyros.table.file);
    let rows = 0..gyros.table.rows;
    let (Some(first), Some(last)) = (rows.clone().find(measured), rows.rev().find(measured)) else {
        return Err(InputError::new(
            file,
            "has no row in which every gyro was measured",
        ));
    };
    for row in first..=last {
        if let Some(channel) = missing(&row) {
            return Err(InputError::new(
                file,
                "was not measured, with measured rows before and after",
            )
            .channel(&channel.column)
            .row(row as u64)
            .expected("a number: a replay cannot make up for an angle that is missing"));
        }
    }
    let primes = first > 0
        && pickoffs.is_some_and(|found| found.iter().all(|c| c.values[first - 1].is_finite()));
    Ok(Kept {
        rows: first - usize::from(primes)..last + 1,
        primes,
    })
}

/// Whole numbers as `i32`; the index of the first out of range.
fn codes(values: impl Iterator<Item = f64>) -> Result<Vec<i32>, usize> {
    values
        .enumerate()
        .map(|(row, value)| {
            let fits = value >= f64::from(i32::MIN) && value <= f64::from(i32::MAX);
            if fits { Ok(value as i32) } else { Err(row) }
        })
        .collect()
}

fn codes_of_angle(values: &[f64], weight_rad: f64) -> Result<Vec<i32>, usize> {
    codes(values.iter().map(|angle| (angle / weight_rad).round()))
}

/// Counts of [`INCREMENT_WEIGHT_RAD`] of the running angle; the remainder carries over.
fn counts_of_running_angle(values: &[f64], unit_rad: f64) -> impl Iterator<Item = f64> {
    let mut remainder = 0.0;
    values.iter().map(move |value| {
        let angle = value * unit_rad / INCREMENT_WEIGHT_RAD + remainder;
        let count = angle.round();
        remainder = angle - count;
        count
    })
}

fn beyond(recording: &Recording, gyros: &Gyros, channel: &Channel, row: usize) -> InputError {
    InputError::new(
        recording.folder.join(&gyros.table.file),
        "is larger than the chain's input can be",
    )
    .channel(&channel.column)
    .row(row as u64)
    .value(channel.values[row])
    .expected("an angle or count of a ring-laser gyro within one period")
}

/// Reference on the gyros' rows, `None` without a reference, or the reason why the two cannot be paired.
fn reference_rows(
    recording: &Recording,
    gyros: &Gyros,
    rate_hz: f64,
    kept: std::ops::Range<usize>,
) -> Result<Option<Vec<[f64; 3]>>, String> {
    let found =
        Axis::ALL.map(|axis| recording.channel(&Quantity::ReferenceIncrement, axis.label()));
    let [Some((table, x)), Some((table_y, y)), Some((table_z, z))] = found else {
        if found.iter().any(Option::is_some) {
            return Err("the reference lacks an axis".to_owned());
        }
        return Ok(None);
    };
    let mut tables = [table, table_y, table_z].into_iter();
    if !tables.all(|table| gyros.shares_clock(table, rate_hz)) {
        return Err("the reference runs on another clock than the gyros".to_owned());
    }
    Ok(Some(
        kept.map(|row| [x.values[row], y.values[row], z.values[row]])
            .collect(),
    ))
}
