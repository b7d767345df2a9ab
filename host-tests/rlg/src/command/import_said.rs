//! Report of an import of columns, in words and as JSON.

use std::path::{Path, PathBuf};

use serde_json::{Value, json};

use super::import_format::Format;
use crate::import::forming::assemble::Assembled;
use crate::import::forming::described;
use crate::import::still::WITHOUT_SITE;
use crate::model::MotionSource;
use crate::recording::{Clock, Recording, Site};
use crate::terminal::Terminal;

/// Remaining arguments of the command line.
pub(super) struct Request<'a> {
    pub(super) files: &'a [PathBuf],
    pub(super) format: Option<Format>,
    pub(super) rate_hz: Option<f64>,
    pub(super) site: Option<Site>,
    pub(super) sha256: Option<&'a str>,
    pub(super) target: &'a Path,
}

/// Formats rows and clock of a table in words.
fn clock(clock: &Clock) -> String {
    match clock {
        Clock::Uniform { rate_hz, start_s } => {
            // Without the rounding errors of a difference, and without a negative zero.
            let start_s = (start_s * 1e9).round() / 1e9 + 0.0;
            format!("at {rate_hz} Hz from {start_s} s")
        }
        Clock::Stamped { stamps_s, .. } => format!(
            "with stamps, {} to {} s",
            stamps_s.first().unwrap_or(&0.0),
            stamps_s.last().unwrap_or(&0.0)
        ),
    }
}

/// Prints what became of each column.
pub(super) fn say(
    request: &Request<'_>,
    (recording, assembled): (&Recording, &Assembled),
    left_out: &[(String, String)],
    terminal: &Terminal,
) {
    let out = request.target.display();
    for table in &recording.tables {
        terminal.say(format!(
            "{out}/{}: {} rows {}",
            table.file,
            table.rows,
            clock(&table.clock)
        ));
        for taken in assembled
            .taken
            .iter()
            .filter(|taken| taken.table == table.file)
        {
            terminal.say(format!(
                "  {:<12} {} {} <- {}",
                taken.column,
                taken.quantity,
                taken.axis.as_deref().unwrap_or("-"),
                taken.origin
            ));
        }
    }
    if !assembled.stamps.is_empty() {
        let mut stamps = assembled.stamps.clone();
        stamps.dedup();
        terminal.say(format!("  time         <- {}", stamps.join(", ")));
    }
    for (column, reason) in left_out {
        terminal.say(format!("  left out     {column}: {reason}"));
    }
    for note in &assembled.notes {
        terminal.warn(note);
    }
    if described::ideal(recording, assembled).motion == MotionSource::Static
        && request.site.is_none()
    {
        terminal.warn(WITHOUT_SITE);
    }
    terminal.say(format!(
        "To diagnose: rlg diagnose {out} --model {out}/model.toml --out DIR"
    ));
}

/// Returns the same for `--json`.
pub(super) fn result(
    request: &Request<'_>,
    (recording, assembled): (&Recording, &Assembled),
    left_out: &[(String, String)],
    sums: &[String],
) -> Value {
    let tables: Vec<Value> = recording
        .tables
        .iter()
        .map(|table| {
            let (rate_hz, start_s) = match table.clock {
                Clock::Uniform { rate_hz, start_s } => (Some(rate_hz), start_s),
                Clock::Stamped { .. } => (None, table.start_s()),
            };
            json!({"file": table.file, "rows": table.rows, "rate_hz": rate_hz, "start_s": start_s})
        })
        .collect();
    let channels: Vec<Value> = assembled
        .taken
        .iter()
        .map(|taken| {
            json!({
                "table": taken.table, "column": taken.column, "quantity": taken.quantity, "axis": taken.axis,
                "origin": taken.origin,
            })
        })
        .collect();
    let left_out: Vec<Value> = left_out
        .iter()
        .map(|(column, reason)| json!({"column": column, "reason": reason}))
        .collect();
    json!({
        "recording": request.target,
        "tables": tables,
        "channels": channels,
        "left_out": left_out,
        "stamps": assembled.stamps,
        "notes": assembled.notes,
        "sha256": sums,
    })
}
