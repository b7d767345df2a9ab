//! Sentences on faults of the data: one for each kind and channel, with counts.

use rlg_signal::fault::{Detail, Fault};
use rlg_signal::streams::Streams;

/// Owner of rows that all gyros lack.
const RECORDING: &str = "the recording";

/// Sentences for the summary.
pub fn lines(streams: &Streams, faults: &[Fault]) -> Vec<String> {
    let mut left: Vec<&Fault> = faults.iter().collect();
    let mut said = Vec::new();
    while let Some(first) = left.first().copied() {
        let is_alike = |fault: &&&Fault| match first.detail {
            // Channels of one recorder are held together.
            Detail::Hold { .. } => fault.detail == first.detail,
            _ => fault.kind == first.kind && fault.channel == first.channel,
        };
        let alike: Vec<&Fault> = left.iter().filter(is_alike).copied().collect();
        left.retain(|fault| !is_alike(&fault));
        said.push(sentence(streams, &alike));
    }
    said
}

/// One sentence on faults of one kind and channel.
pub fn sentence(streams: &Streams, alike: &[&Fault]) -> String {
    let first = alike[0];
    let (places, rows) = match first.detail {
        Detail::Places { places, rows } => (places, rows),
        _ => (
            alike.len(),
            alike.iter().map(|fault| fault.rows.len()).sum(),
        ),
    };
    let (from_s, to_s) = (
        streams.begin_s(first.rows.start),
        streams.begin_s(alike[alike.len() - 1].rows.end),
    );
    let channel = rows_of(streams, first).unwrap_or(&first.channel);
    let between = format!("between {from_s:.3} and {to_s:.3} s");
    match (first.kind, first.detail) {
        (_, Detail::Hold { rows_per_reading }) => held(streams, alike, rows_per_reading),
        ("lost_samples", _) if places > 1 => {
            format!(
                "Data: {rows} rows of {channel} are lost ({}) {between}.",
                at(places)
            )
        }
        ("lost_samples", _) => format!("Data: {rows} rows of {channel} are lost {between}."),
        ("saturation", _) => {
            let wrapped = alike.iter().filter(|fault| fault.detail == Detail::Wrapped);
            let wrapped: usize = wrapped.map(|fault| fault.rows.len()).sum();
            let how = match (wrapped, rows) {
                (0, _) => "saturated at the end of the range".to_string(),
                (wrapped, rows) if wrapped == rows => {
                    "wrapped: the range overflowed, with the opposite sign".to_string()
                }
                _ => format!(
                    "saturated, {wrapped} of them wrapped: the range overflowed, with the opposite sign"
                ),
            };
            format!(
                "Data: {rows} rows of {channel} ({}) {between} are {how}.",
                at(places)
            )
        }
        ("spikes", Detail::Spike { size_rad }) if places == 1 => {
            let size = (size_rad * streams.rate_hz).to_degrees();
            format!(
                "Data: one reading of {channel} at {from_s:.3} s is a spike of {size:.3} \u{b0}/s."
            )
        }
        ("spikes", _) => {
            let sizes = alike.iter().map(|fault| match fault.detail {
                Detail::Spike { size_rad } => size_rad.abs() * streams.rate_hz,
                _ => 0.0,
            });
            let largest = sizes.fold(0.0, f64::max).to_degrees();
            format!(
                "Data: {places} single readings of {channel} {between} are spikes of up to {largest:.3} \u{b0}/s."
            )
        }
        ("repeated_rows", _) => format!(
            "Data: {rows} rows of {channel} ({}) {between} repeat earlier rows exactly.",
            at(places)
        ),
        (kind, _) => {
            let what = match kind {
                "stuck_channel" => "is stuck",
                _ => "cannot be used",
            };
            format!(
                "Data: {channel} {what} in {rows} rows ({}) {between}.",
                at(places)
            )
        }
    }
}

/// Sentence on channels whose samples are held for several rows.
fn held(streams: &Streams, alike: &[&Fault], rows_per_reading: f64) -> String {
    let names: Vec<&str> = alike.iter().map(|fault| fault.channel.as_str()).collect();
    let age_rows = 0.5 * (rows_per_reading - 1.0);
    // The remaining rows are as long as a sample.
    let recorded_hz = streams.rate_hz * rows_per_reading;
    format!(
        "Data: each sample of {} is held for {} rows (mean age {} rows, {:.1} ms): only rows with a new sample were compared, {:.4} per second.",
        names.join(", "),
        rounded(rows_per_reading),
        rounded(age_rows),
        1e3 * age_rows / recorded_hz,
        streams.rate_hz
    )
}

/// Owner of lost rows in words, if it is no single channel.
pub fn rows_of(streams: &Streams, fault: &Fault) -> Option<&'static str> {
    let is_lost = fault.kind == "lost_samples" && streams.is_row_lost(fault.rows.start);
    is_lost.then_some(RECORDING)
}

/// Number of places in words.
fn at(places: usize) -> String {
    match places {
        1 => "one place".to_string(),
        _ => format!("{places} places"),
    }
}

/// Formats a number with as many decimals as it needs, two at most.
fn rounded(value: f64) -> String {
    let text = format!("{value:.2}");
    text.trim_end_matches('0').trim_end_matches('.').to_string()
}
