//! Several recordings as one: the same gyros under one model, at different times.
//!
//! Enters: the aligned and qualified channels of each recording. Leaves: one [`Streams`] with their rows end to end
//! and, for each, a [`Piece`] that says which rows are its own and what its clock reads there.
//!
//! Nothing crosses a break: motion spectra, attitude and temperature start anew in each piece, and every
//! stretch of rows has a free jump of angle. A list of recordings is then fitted like the stretches of
//! one: the information of each adds up. Assumed: one instrument in one state, so one noise model; where the
//! recordings' noise differs, S is their mean. Stretches of a recording longer than memory are joined in the
//! same way; they keep one origin of time, attitude and temperature. Deliberately not here: recordings of different row rates, units at rest.

use std::ops::Range;

use super::axes::Triad;
use super::fault::Fault;
pub use super::piece::{Origin, Piece};
use super::streams::Streams;
use rlg_recording::error::InputError;

/// Blocks per second of a recording longer than memory \[Hz\]: an hour of the whole catalogue takes 40 MB.
pub const LONG_BLOCK_HZ: f64 = 20.0;

/// Of such a recording the blocks answer below, the rows above \[Hz\]: half of what the blocks resolve, where what is
/// folded into them is weak, and below where white noise of angle meets the random walk.
pub const LONG_SPLIT_HZ: f64 = LONG_BLOCK_HZ / 4.0;

/// Joins `all`, each with the faults found in it, whose rows move along.
pub fn join(all: Vec<(Streams, Vec<Fault>)>) -> Result<(Streams, Vec<Fault>), InputError> {
    let mut rest = all.into_iter();
    let Some((mut joined, mut faults)) = rest.next() else {
        return Err(InputError::new("RECORDING", "is missing").expected("at least one recording"));
    };
    for (streams, of_these) in rest {
        fits(&joined, &streams)?;
        let offset = joined.rows;
        faults.extend(of_these.into_iter().map(|mut fault| {
            fault.rows = fault.rows.start + offset..fault.rows.end + offset;
            fault
        }));
        append(&mut joined, streams);
    }
    Ok((joined, faults))
}

/// Asks for names that tell recordings apart.
///
/// # Errors
/// Two have the same.
pub fn distinct(all: &[Streams]) -> Result<(), InputError> {
    for (place, streams) in all.iter().enumerate() {
        let name = &streams.pieces[0].recording;
        if all[..place]
            .iter()
            .any(|one| one.pieces[0].recording == *name)
        {
            return Err(one_name(name));
        }
    }
    Ok(())
}

fn one_name(name: &str) -> InputError {
    InputError::new(name, "has the name of another recording of this list")
        .expected("names that tell the recordings apart (name in recording.toml)")
}

/// Whether a further recording is of the same kind and has a name of its own.
fn fits(joined: &Streams, further: &Streams) -> Result<(), InputError> {
    let name = &further.pieces[0].recording;
    let first = &joined.pieces[0].recording;
    let fault = |problem: String| InputError::new(name, problem);
    let stretch = further.pieces[0].origin.is_some();
    if !stretch && joined.pieces.iter().any(|piece| piece.recording == *name) {
        return Err(one_name(name));
    }
    if joined.at_rest.is_some() {
        return Err(
            fault("cannot be joined: the model's motion is static".to_string())
                .expected("one recording at a time of a unit at rest"),
        );
    }
    // Rates are stated to a dozen digits; a part in 1e9 is a row in three days.
    if (further.rate_hz / joined.rate_hz - 1.0).abs() > 1e-9 {
        return Err(fault(format!("has other gyro rows than {first}"))
            .value(format!("{} Hz", further.rate_hz))
            .expected(format!("{} Hz", joined.rate_hz)));
    }
    if further.pickoff_rad.is_some() != joined.pickoff_rad.is_some()
        || further.pulse_rad != joined.pulse_rad
    {
        return Err(
            fault(format!("has other gyro channels than {first}")).expected(
                "the same quantities in every recording: counts with pickoffs, increments or rates",
            ),
        );
    }
    Ok(())
}

/// Adds the rows of one recording. Slow channels that not every recording has are dropped.
fn append(joined: &mut Streams, mut further: Streams) {
    let offset = joined.rows;
    for axis in 0..3 {
        joined.sensed_rad[axis].extend_from_slice(&further.sensed_rad[axis]);
        joined.case_rad[axis].extend_from_slice(&further.case_rad[axis]);
    }
    let breaks = match (&mut joined.pickoff_rad, &further.pickoff_rad) {
        (Some(joined), Some(further)) => {
            for axis in 0..3 {
                joined[axis].extend_from_slice(&further[axis][1..]);
            }
            true
        }
        _ => false,
    };
    both(&mut joined.force_m_s2, further.force_m_s2.take());
    both(&mut joined.temperature_k, further.temperature_k.take());
    both(&mut joined.magnetic_t, further.magnetic_t.take());
    joined.others.retain_mut(|(name, values)| {
        let more = further.others.iter().find(|(other, _)| other == name);
        if let Some((_, more)) = more {
            values.extend_from_slice(more);
        }
        more.is_some()
    });
    joined.stamps_s = None;
    joined.usable.extend_from_slice(&further.usable);
    if breaks {
        // The angle before it belongs to another recording: this row's dither is not known.
        joined.usable[offset] = false;
    }
    joined.measured.extend_from_slice(&further.measured);
    joined.append_unmeasured(&further);
    joined
        .pieces
        .extend(further.pieces.into_iter().map(|piece| Piece {
            rows: piece.rows.start + offset..piece.rows.end + offset,
            ..piece
        }));
    joined.rows += further.rows;
}

fn both(joined: &mut Option<Triad>, further: Option<Triad>) {
    match (joined.as_mut(), further) {
        (Some(joined), Some(further)) => {
            for (joined, further) in joined.iter_mut().zip(further) {
                joined.extend(further);
            }
        }
        _ => *joined = None,
    }
}

impl Streams {
    /// The piece of a row; of the end of the rows the last.
    pub fn piece_of(&self, row: usize) -> &Piece {
        let place = self.pieces.partition_point(|piece| piece.rows.end <= row);
        &self.pieces[place.min(self.pieces.len() - 1)]
    }

    /// Name of the recording and the time on its own clock \[s\] at a time of the joined rows.
    pub fn own_time(&self, time_s: f64) -> (&str, f64) {
        let row = (time_s - self.start_s) * self.rate_hz;
        let piece = self.piece_of(row.floor().max(0.0) as usize);
        let since_s = (row - piece.rows.start as f64) / self.rate_hz;
        (&piece.recording, piece.start_s + since_s)
    }

    /// Name of the recording and times on its own clock \[s\] of some of its rows.
    pub fn own_span(&self, rows: &Range<usize>) -> (&str, [f64; 2]) {
        let piece = self.piece_of(rows.start);
        let at = |row: usize| piece.start_s + (row as f64 - piece.rows.start as f64) / self.rate_hz;
        (&piece.recording, [at(rows.start), at(rows.end)])
    }

    /// Times of the joined rows \[s\] at which the clock of `recording`, or of any without a name, reads `own_s`.
    pub fn joined_times(&self, recording: Option<&str>, own_s: f64) -> Vec<f64> {
        self.pieces
            .iter()
            .filter(|piece| recording.is_none_or(|name| name == piece.recording))
            .map(|piece| (piece, (own_s - piece.start_s) * self.rate_hz))
            .filter(|(piece, row)| (0.0..=piece.rows.len() as f64).contains(row))
            .map(|(piece, row)| self.start_s + (piece.rows.start as f64 + row) / self.rate_hz)
            .collect()
    }

    /// The same for what lasts from then on, such as a step: from a time before it a recording has it all along, and
    /// between two stretches of one it begins with the next.
    pub fn joined_times_from(&self, recording: Option<&str>, own_s: f64) -> Vec<f64> {
        let mut known: Vec<&str> = Vec::new();
        let mut times = Vec::new();
        for piece in &self.pieces {
            let named = recording.is_none_or(|name| name == piece.recording);
            let row = ((own_s - piece.start_s) * self.rate_hz).max(0.0);
            if named && row <= piece.rows.len() as f64 && !known.contains(&&*piece.recording) {
                known.push(&piece.recording);
                times.push(self.start_s + (piece.rows.start as f64 + row) / self.rate_hz);
            }
        }
        times
    }

    /// The end of the recording that a row belongs to.
    pub fn end_of_recording(&self, row: usize) -> usize {
        let name = &self.piece_of(row).recording;
        let last = self.pieces.iter().rfind(|piece| piece.recording == *name);
        last.map_or(self.rows, |piece| piece.rows.end)
    }

    /// Middle of a row on its recording's own clock, from the recording's start \[s\].
    pub fn since_start_s(&self, row: usize) -> f64 {
        let piece = self.piece_of(row);
        let before_s = piece
            .origin
            .as_ref()
            .map_or(0.0, |origin| piece.start_s - origin.start_s);
        before_s + (row - piece.rows.start) as f64 / self.rate_hz + 0.5 / self.rate_hz
    }

    /// The band in which rows count \[Hz\]: of stretches the blocks beside them have the rest.
    pub fn band_hz(&self) -> [f64; 2] {
        match &self.pieces[0].origin {
            Some(_) => [LONG_SPLIT_HZ, f64::INFINITY],
            None => [0.0, f64::INFINITY],
        }
    }

    /// Middle of a row since the first row's beginning, breaks between recordings left out \[s\].
    pub fn clock_s(&self, row: usize) -> f64 {
        match &self.pieces[0].origin {
            Some(_) => self.since_start_s(row),
            None => self.middle_s(row) - self.start_s,
        }
    }

    /// Seconds from the first row to the last, of a recording of which these are stretches all of it.
    pub fn span_s(&self) -> f64 {
        let origin = self.pieces[0].origin.as_ref();
        origin.map_or(self.rows as f64 / self.rate_hz, |origin| origin.seconds)
    }

    /// Whether the rows come from more than one recording.
    pub fn is_joined(&self) -> bool {
        let first = &self.pieces[0].recording;
        self.pieces.iter().any(|piece| piece.recording != *first)
    }
}

/// A recording's name as an expression writes it: letters, digits, `-`, `_` and `.`.
pub fn name_in_expression(recording: &str) -> String {
    let safe = |c: char| c.is_alphanumeric() || "-_.".contains(c);
    recording
        .chars()
        .map(|c| if safe(c) { c } else { '_' })
        .collect()
}
