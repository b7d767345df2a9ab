//! Restores rows lost from a file without time stamps as unmeasured, before the alignment.
//!
//! Gyros and reference are compared on the gyros' rows ([`rlg_signal::lost_rows`]); a detected loss shifts the later
//! rows of one side in the recording's own tables, so that every likelihood has an ordinary gap.

use rlg_plan::LostRowsPlan;
use std::borrow::Cow;

use rlg_model::Model;
use rlg_recording::error::InputError;
use rlg_recording::{Clock, Quantity, Recording, Table};
use rlg_signal::channel_map::without_dither;
use rlg_signal::lost_rows::{Loser, LostRows, find};
use rlg_signal::streams::Streams;

/// Recording with its lost rows restored.
pub(crate) struct Whole<'a> {
    pub(crate) recording: Cow<'a, Recording>,
    /// Channels of gyros and reference.
    pub(crate) streams: Streams,
    /// Sentences on the restored rows.
    pub(crate) said: Vec<String>,
}

/// Restores lost rows, one gap at a time.
///
/// # Inputs
/// `align`: aligns gyros and reference on the gyros' rows.
///
/// # Errors
/// As of `align`.
pub(crate) fn put_back<'a>(
    recording: &'a Recording,
    model: &Model,
    plan: &LostRowsPlan,
    align: impl Fn(&Recording, &Model) -> Result<Streams, InputError>,
) -> Result<Whole<'a>, InputError> {
    let mut whole = Whole {
        streams: align(recording, model)?,
        recording: Cow::Borrowed(recording),
        said: Vec::new(),
    };
    let sides = [
        even_table(recording, |quantity| Quantity::GYROS.contains(quantity)),
        even_table(recording, is_reference),
    ];
    let [Some(gyros), Some(reference)] = sides else {
        return Ok(whole);
    };
    let table = &recording.tables[reference];
    let rows_a_reading = table.clock.period_s(table.rows) * whole.streams.rate_hz;
    if whole.streams.at_rest.is_some() || rows_a_reading > plan.most_rows_a_reading {
        return Ok(whole);
    }
    for _ in 0..plan.most_gaps {
        let streams = &whole.streams;
        let gyros_rad = without_dither(streams, model);
        let both = (&gyros_rad, &streams.case_rad);
        let Some(lost) = find(both.0, both.1, &streams.usable, streams.rate_hz, plan) else {
            break;
        };
        let table = match lost.of {
            Loser::Gyros => gyros,
            Loser::Reference => reference,
        };
        whole.said.push(sentence(streams, lost));
        let changed = whole.recording.to_mut();
        let at_s = streams.begin_s(lost.before_row);
        let lasts_s = lost.rows as f64 / streams.rate_hz;
        let is_moved =
            |quantity: &Quantity| is_reference(quantity) == (lost.of == Loser::Reference);
        open(&mut changed.tables[table], at_s, lasts_s, is_moved);
        whole.streams = align(changed, model)?;
    }
    Ok(whole)
}

fn is_reference(quantity: &Quantity) -> bool {
    matches!(
        quantity,
        Quantity::ReferenceIncrement | Quantity::ReferenceAttitude
    )
}

/// First table with such a channel, if its rows have no time stamps.
fn even_table(recording: &Recording, holds: fn(&Quantity) -> bool) -> Option<usize> {
    let table = recording.tables.iter().position(|table| {
        let mut channels = table.channels.iter();
        channels.any(|channel| holds(&channel.quantity))
    })?;
    matches!(recording.tables[table].clock, Clock::Uniform { .. }).then_some(table)
}

/// Shifts rows of some channels after a time to later rows, with unmeasured rows in the gap.
fn open(table: &mut Table, at_s: f64, lasts_s: f64, is_moved: impl Fn(&Quantity) -> bool) {
    let rate_hz = 1.0 / table.clock.period_s(table.rows);
    let row = ((at_s - table.start_s()) * rate_hz).round().max(0.0) as usize;
    let rows = ((lasts_s * rate_hz).round() as usize).max(1);
    for channel in &mut table.channels {
        let row = match is_moved(&channel.quantity) {
            true => row.min(channel.values.len()),
            false => channel.values.len(),
        };
        let unmeasured = std::iter::repeat_n(f64::NAN, rows);
        channel.values.splice(row..row, unmeasured);
    }
    table.rows += rows;
}

fn sentence(streams: &Streams, lost: LostRows) -> String {
    let (who, other) = match lost.of {
        Loser::Gyros => ("the gyros", "the reference"),
        Loser::Reference => ("the reference", "the gyros"),
    };
    let lasts_s = lost.rows as f64 / streams.rate_hz;
    format!(
        "Data: {rows} rows of {rate_hz:.6} Hz ({lasts_s:.4} s) of {who} are missing before row {row} ({at_s:.4} s), without a gap in the stamps: from there on {who} lead {other} by {lasts_s:.4} s. Inserted as unmeasured.",
        rows = lost.rows,
        rate_hz = streams.rate_hz,
        row = lost.before_row,
        at_s = streams.begin_s(lost.before_row),
    )
}
