//! Recorder properties in the rows of a unit at rest: the row rate, and the trace of a resampling.

use std::ops::Range;

use rand::SeedableRng as _;
use rand::seq::SliceRandom as _;
use rand_chacha::ChaCha8Rng;
use rlg_findings::entries::{by_axis, unlisted};
use rlg_findings::result::{EffectEntry, ParameterEntry};
use rlg_model::{EffectValue, Model, ModelEffect};
use rlg_signal::streams::{Streams, Triad};

use super::noise_cycle::{self, Cycle};
use super::row_rate::{self, RowRate};
use crate::settings::Settings;

/// Findings on the rows, as entries and in the model.
#[derive(Debug, Clone, Default)]
pub struct RowsFound {
    /// Row rate and cycles of the noise.
    pub effects: Vec<EffectEntry>,
    /// Number of cycles in the same rows in shuffled order.
    pub cycles_of_shuffled: usize,
    /// Number of cycles dropped because of those.
    pub dropped: usize,
}

/// Rows to fit on and rows held out.
pub(super) struct Parted {
    pub(super) fitted: Vec<Range<usize>>,
    pub(super) held_out: Vec<Range<usize>>,
}

/// Finds row rate and cycles that the model does not hold.
///
/// # Inputs
/// `left_rad`: residual of the gyros after all found effects.
pub(super) fn search(
    streams: &Streams,
    model: &Model,
    left_rad: &Triad,
    parted: &Parted,
    settings: &Settings,
) -> RowsFound {
    let Parted { fitted, held_out } = parted;
    let (plan, seed) = (&settings.plan.rest, settings.seed);
    let rate = row_rate::row_rate(streams, fitted, held_out, plan)
        .filter(|_| !has_expression(model, "row_rate("));
    let rate = rate.map(|rate| rate_entry(&rate, streams.rate_hz));
    let shuffled = shuffled(left_rad, [fitted, held_out], seed);
    let of_shuffled = noise_cycle::cycles(&shuffled, fitted, held_out, &plan.cycle);
    let is_of_shuffled = |cycle: &Cycle| {
        let same = |other: &Cycle| (other.turns, other.rows) == (cycle.turns, cycle.rows);
        of_shuffled.iter().any(same)
    };
    let (dropped, kept): (Vec<Cycle>, Vec<Cycle>) =
        noise_cycle::cycles(left_rad, fitted, held_out, &plan.cycle)
            .into_iter()
            .partition(is_of_shuffled);
    let news = kept
        .iter()
        .filter(|cycle| !has_expression(model, &expression(cycle)));
    let cycles = news.map(|cycle| cycle_entry(cycle, streams.rate_hz));
    RowsFound {
        effects: rate.into_iter().chain(cycles).collect(),
        cycles_of_shuffled: of_shuffled.len(),
        dropped: dropped.len(),
    }
}

/// Permutes fitted and held-out rows separately, the three gyros alike.
pub(super) fn shuffled(left_rad: &Triad, parted: [&[Range<usize>]; 2], seed: u64) -> Triad {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut shuffled = left_rad.clone();
    for ranges in parted {
        let rows: Vec<usize> = ranges.iter().flat_map(Range::clone).collect();
        let mut order = rows.clone();
        order.shuffle(&mut random);
        for (values, original) in shuffled.iter_mut().zip(left_rad) {
            for (to, from) in rows.iter().zip(&order) {
                values[*to] = original[*from];
            }
        }
    }
    shuffled
}

fn rate_entry(rate: &RowRate, nominal_hz: f64) -> EffectEntry {
    let (error, std) = (
        rate.rate_hz / nominal_hz - 1.0,
        rate.rate_std_hz / nominal_hz,
    );
    EffectEntry {
        parameters: vec![ParameterEntry::number("rate_error", error, std, "1")],
        covariance: vec![vec![std * std]],
        p_value: rate.p_value,
        expression: Some(format!("row_rate({:.6})", rate.rate_hz)),
        ..unlisted(
            format!("rows come at {:.5} Hz", rate.rate_hz),
            format!(
                "Row rate {:+.4} % from the nominal {nominal_hz} Hz, by the recorder's own stamps. Error on held-out rows: nominal clock {:.3e} s, this rate {:.1e} s.",
                100.0 * error,
                rate.held_out_before_s,
                rate.held_out_after_s
            ),
        )
    }
}

fn cycle_entry(cycle: &Cycle, rate_hz: f64) -> EffectEntry {
    let beat_hz = rate_hz * cycle.turns as f64 / cycle.rows as f64;
    let [x, y, z] = cycle.held_out;
    let (parameters, covariance) = by_axis(cycle.amplitude, cycle.std, "1");
    EffectEntry {
        parameters,
        covariance,
        p_value: cycle.p_value,
        expression: Some(expression(cycle)),
        ..unlisted(
            format!(
                "noise power of row k *= 1 + a cos(2 pi k {}/{} + phase)",
                cycle.turns, cycle.rows
            ),
            format!(
                "Noise power of the gyros is periodic in {} rows ({beat_hz} Hz): the rows were interpolated from a source at {} or {} Hz (or a multiple of {rate_hz} Hz more), so the noise is white neither in time nor between rows. Amplitude on held-out rows at the same phase {x:.3}, {y:.3}, {z:.3} on x, y, z; ln likelihood {:+.0}.",
                cycle.rows,
                rate_hz - beat_hz,
                rate_hz + beat_hz,
                cycle.held_out_gain
            ),
        )
    }
}

/// Expression of a cycle in a model file.
fn expression(cycle: &Cycle) -> String {
    format!("noise_cycle({}/{})", cycle.turns, cycle.rows)
}

/// True if the model has an unlisted effect whose expression begins with `stem`.
fn has_expression(model: &Model, stem: &str) -> bool {
    let text = |effect: &ModelEffect| match effect.parameters.get("expression") {
        Some(EffectValue::Text(text)) => text.starts_with(stem),
        _ => false,
    };
    model.effects.iter().any(text)
}
