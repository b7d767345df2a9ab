//! Effects of a model on the gyros: path from the reference, columns and events.

use nalgebra::Vector3;
use rlg_catalogue::candidates::is_delay;
use rlg_catalogue::entries::{
    self, BANDWIDTH, HARMONIC, HIGH_PASS, LATE_PICKOFF, LOCK_IN, MODE, MOUNT, SLIP, STEP, UNLISTED,
};
use rlg_catalogue::high_pass::{self, HighPass};
use rlg_catalogue::lock_in::Threshold;
use rlg_catalogue::low_pass::LowPass;
use rlg_catalogue::resonance::Resonance;
use rlg_catalogue::signals::{Path, Signals};
use rlg_catalogue::turned::TURNED;
use rlg_catalogue::{Candidate, Column, Expression, Pool, Sensed};
use rlg_model::kinds::{FAULT_KINDS, NOISE_KINDS};
use rlg_model::{Model, ModelEffect};
use rlg_recording::error::InputError;
use rlg_signal::streams::{AXES, Streams};

/// True if an effect acts in this recording: of several, a model may name the one that has it.
pub(crate) fn is_in(effect: &ModelEffect, streams: &Streams) -> bool {
    let name = effect.text("recording");
    name.is_none_or(|name| name == streams.piece.recording)
}

/// Value of a kind by axis in a model: the sum over all its effects in this recording.
pub(crate) fn known_by_axis(kind: &str, model: &Model, streams: &Streams) -> [f64; 3] {
    let effects = model.effects.iter().filter(|one| is_in(one, streams));
    let of_kind = effects.filter(|one| one.kind == kind);
    of_kind.fold([0.0; 3], |sum, one| {
        std::array::from_fn(|axis| sum[axis] + one.number(AXES[axis]))
    })
}

/// Delays, low passes and mounts of a model.
pub(crate) fn known_path(model: &Model, streams: &Streams) -> Path {
    let mut path = Path::default();
    for effect in model.effects.iter().filter(|one| is_in(one, streams)) {
        for axis in 0..3 {
            path.delay_s[axis] += delay_of(effect, axis);
            path.mount[axis] = path.mount[axis].or_else(|| mount_of(effect, axis));
            path.low_pass[axis] = path.low_pass[axis].or_else(|| low_pass_of(effect, axis));
        }
    }
    path
}

/// Checks that every effect of a model can be predicted from a reference on the gyros' rows, or from the Earth's rate.
///
/// # Errors
/// The first effect that cannot be predicted.
pub fn is_predictable(model: &Model, file: &std::path::Path) -> Result<(), InputError> {
    let is_known = |effect: &ModelEffect| {
        let kind = effect.kind.as_str();
        is_silent(kind) || is_of_recorder(effect) || entries::card(kind).is_some()
    };
    match model.effects.iter().find(|effect| !is_known(effect)) {
        None => Ok(()),
        Some(effect) => Err(InputError::new(
            file,
            "this version cannot predict the effect for such a recording",
        )
        .channel(effect.kind.clone())
        .expected("effects of gyros, of a reference on their rows, of noise or of accelerometers")),
    }
}

/// True of effects of the recorder: row rate and interpolation change no increment.
fn is_of_recorder(effect: &ModelEffect) -> bool {
    effect
        .text("expression")
        .is_some_and(|text| text.starts_with("row_rate(") || text.starts_with("noise_cycle("))
}

/// True of effects of the noise, effects of the accelerometers and faults of the data: they add nothing to a gyro's
/// increments.
fn is_silent(kind: &str) -> bool {
    NOISE_KINDS.contains(&kind)
        || FAULT_KINDS.contains(&kind)
        || kind.starts_with("accel_")
        || kind == "size_effect"
}

fn delay_of(effect: &ModelEffect, axis: usize) -> f64 {
    match effect.kind.as_str() {
        "gyro_delay" => effect.number(AXES[axis]),
        "reference_delay" => -effect.number("all"),
        _ => 0.0,
    }
}

fn mount_of(effect: &ModelEffect, axis: usize) -> Option<Resonance> {
    let hz = effect.number(&format!("{}_frequency_hz", AXES[axis]));
    (effect.kind == MOUNT && hz > 0.0).then(|| Resonance {
        hz,
        damping: effect.number(&format!("{}_damping", AXES[axis])),
    })
}

fn low_pass_of(effect: &ModelEffect, axis: usize) -> Option<LowPass> {
    let time_s = effect.number(&format!("{}_pole_s", AXES[axis]));
    (effect.kind == BANDWIDTH && time_s > 0.0).then_some(LowPass { time_s })
}

/// Row of an event: a step begins with it, a slip lies within it.
pub fn event_row(effect: &ModelEffect, start_s: f64, rate_hz: f64, rows: usize) -> usize {
    let at = (effect.number("time_s") - start_s) * rate_hz;
    let row = if effect.kind == STEP {
        at.round()
    } else {
        at.floor()
    };
    (row.max(0.0) as usize).min(rows - 1)
}

fn axis_of(effect: &ModelEffect) -> Option<usize> {
    let name = effect.text("axis")?;
    AXES.iter().position(|axis| *axis == name)
}

/// Columns of an effect with gyro and size; `None` for effects that are none of the search's columns.
///
/// # Inputs
/// `turned_rad`: rotation of the reference in the model.
pub(crate) fn known(
    effect: &ModelEffect,
    turned_rad: Vector3<f64>,
    signals: &Signals,
    streams: &Streams,
) -> Option<Vec<(usize, Sensed, f64)>> {
    let kind = effect.kind.as_str();
    // A dither turns lock-in into noise; delays and mounts are on the path; rotations are combined into one.
    if is_silent(kind)
        || is_delay(kind)
        || kind == MOUNT
        || kind == TURNED
        || (kind == LOCK_IN && streams.pickoff_rad.is_some())
    {
        return None;
    }
    let sensed = |axis: usize| 1.0 / (1.0 - signals.scale_error[axis]);
    let mut pool = Pool::default();
    let parts = match kind {
        STEP | SLIP => {
            let row = event_row(effect, streams.start_s, streams.rate_hz, streams.rows);
            let event = if kind == STEP { STEP } else { SLIP };
            let one = pool.event(event, axis_of(effect)?, row, 1.0, signals);
            of_sizes(&pool, &one, &[effect.number("size")])
        }
        HARMONIC => {
            let order = effect.number("order").round().max(0.0) as u32;
            let one = pool.harmonic(axis_of(effect)?, order, 1.0, signals);
            of_sizes(&pool, &one, &["cos", "sin"].map(|name| effect.number(name)))
        }
        UNLISTED => {
            let expression = Expression::parse(effect.text("expression")?, signals)?;
            let one = pool.expression(axis_of(effect)?, expression, 1.0, signals);
            of_sizes(&pool, &one, &[effect.number("coefficient")])
        }
        MODE => {
            let resonance = Resonance {
                hz: effect.number("frequency_hz"),
                damping: effect.number("damping"),
            };
            let one = pool.suspension(resonance, [0.0; 6], 1.0, signals);
            let values: Vec<f64> = one.names.iter().map(|name| effect.number(name)).collect();
            of_sizes(&pool, &one, &values)
        }
        HIGH_PASS => {
            let times_s = AXES.iter().map(|name| effect.number(name)).enumerate();
            let high_passes = times_s.filter(|(_, time_s)| *time_s > 0.0);
            let of_axis = |(axis, time_s)| {
                let part = high_pass::Part::Response;
                let column = Column::HighPass(axis, HighPass { time_s }, part);
                (axis, Sensed::known(column), sensed(axis))
            };
            high_passes.map(of_axis).collect()
        }
        LOCK_IN => {
            let thresholds = AXES.map(|axis| {
                let rad_s = effect.number(axis);
                (rad_s > 0.0).then_some(Threshold { rad_s })
            });
            let one = pool.lock_in(thresholds, 1.0, signals);
            let fixed = one.hypothesis.fixed.iter();
            fixed
                .map(|one| (one.record, pool.columns[one.column], one.size))
                .collect()
        }
        LATE_PICKOFF => of_late_pickoffs(effect, signals),
        _ => of_entry(effect, turned_rad, signals)?,
    };
    Some(parts)
}

/// Columns of delayed pickoffs: the linear term of each, and the rest of its effect.
fn of_late_pickoffs(effect: &ModelEffect, signals: &Signals) -> Vec<(usize, Sensed, f64)> {
    let mut parts = Vec::new();
    for (axis, name) in AXES.iter().enumerate() {
        let late_s = effect.number(name);
        let sensed = 1.0 / (1.0 - signals.scale_error[axis]);
        let slope = Sensed::known(Column::DitherDelay(axis, late_s));
        let beyond = Sensed::known(Column::DitherBeyond(axis, 0.0, late_s));
        if late_s != 0.0 && slope.column.is_available(signals) {
            parts.extend([(axis, slope, late_s * sensed), (axis, beyond, sensed)]);
        }
    }
    parts
}

/// Columns of a candidate at the values of its parameters.
fn of_sizes(pool: &Pool, one: &Candidate, values: &[f64]) -> Vec<(usize, Sensed, f64)> {
    let terms = one.hypothesis.terms.iter();
    terms
        .map(|term| {
            let size = values[term.parameter] * term.coefficient;
            let column = pool.columns[term.column].column;
            (term.record, Sensed::known(column), size)
        })
        .collect()
}

/// Columns of an entry of the catalogue. All axes count as moving: the effect is in the model.
fn of_entry(
    effect: &ModelEffect,
    turned_rad: Vector3<f64>,
    signals: &Signals,
) -> Option<Vec<(usize, Sensed, f64)>> {
    let kind = effect.kind.as_str();
    let mut parts = Vec::new();
    let mut pool = Pool::default();
    for (name, terms) in pool.whole(entries::find(kind)?, signals) {
        let value = effect.number(&name);
        if value != 0.0 {
            let terms = pool.carried((kind, terms), turned_rad, signals);
            parts.extend(terms.iter().map(|term| {
                let column = Sensed::known(pool.columns[term.column].column);
                let size = entries::coefficient_of(kind, value) * term.coefficient;
                (term.record, column, size)
            }));
        }
    }
    Some(parts)
}
