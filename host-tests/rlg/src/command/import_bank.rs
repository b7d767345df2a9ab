//! Imports frames of a counter bank for `rlg import`: writes the recording with a model in its folder, and prints every gap.

use std::path::Path;

use serde_json::{Value, json};
use trueaxis::Parameters;

use super::block;
use super::import_counts::Destination;
use crate::error::InputError;
use crate::import::bank::{self, Gap, Imported};
use crate::output::OutputFolder;
use crate::recording::Quantity;
use crate::terminal::Terminal;

/// Request of the caller.
pub(super) struct Request<'a> {
    pub file: &'a Path,
    /// The unit's parameter block.
    pub params: Option<&'a Path>,
    pub destination: Destination<'a>,
}

/// Reads the frames, writes recording and model into `out` and reports what was found.
pub(super) fn run(
    request: &Request<'_>,
    out: OutputFolder,
    terminal: &Terminal,
) -> Result<(), InputError> {
    let file = request.file;
    let Some(params) = request.params else {
        return Err(
            InputError::new(file, "has neither rate nor weights of its own")
                .channel("--params")
                .expected("the unit's parameter block"),
        );
    };
    let bytes = std::fs::read(params).map_err(|error| InputError::unreadable(params, &error))?;
    let (parameters, _) = block::parameters(params, &bytes)?;
    let bytes = std::fs::read(file).map_err(|error| InputError::unreadable(file, &error))?;
    let Destination { site, target, .. } = request.destination;
    let imported = bank::import(file, &bytes, &parameters, site, target)?;
    let destination = &request.destination;
    destination.write(&imported.recording, parameters.pulse_weight_rad, out)?;
    say(request, &imported, &parameters, terminal);
    terminal.result(&result(request, &imported, &parameters))
}

fn say(request: &Request<'_>, imported: &Imported, parameters: &Parameters, terminal: &Terminal) {
    let tables = &imported.recording.tables;
    let slow = tables.iter().skip(1).map(|table| table.channels.len());
    let mut channels = tables[0].channels.iter();
    let has_stamps = channels.any(|channel| channel.quantity == Quantity::TimeSincePulse);
    terminal.say(format!(
        "{}: {} frames in {} rows at {} Hz in {}, {} slow channels, {} pulse per second; {} frames came again, {} bytes skipped",
        request.file.display(),
        imported.frames,
        tables[0].rows,
        parameters.sample_rate_hz,
        request.destination.target.display(),
        slow.sum::<usize>(),
        if has_stamps { "a" } else { "no" },
        imported.repeated,
        imported.bytes_skipped,
    ));
    let destination = &request.destination;
    destination.report(&imported.gaps, words, terminal);
}

/// Formats one gap as a sentence.
fn words(gap: &Gap) -> String {
    let [x, y, z] = gap.counts;
    let rows = if gap.rows == 1 { "row" } else { "rows" };
    format!(
        "gap: {} {rows} from row {} without a frame; {x}, {y}, {z} pulses were counted over them and the row after them",
        gap.rows, gap.row
    )
}

fn result(request: &Request<'_>, imported: &Imported, parameters: &Parameters) -> Value {
    let gaps = imported
        .gaps
        .iter()
        .map(|gap| json!({ "row": gap.row, "rows": gap.rows, "counts": gap.counts }));
    json!({
        "recording": request.destination.target,
        "rate_hz": parameters.sample_rate_hz,
        "rows": imported.recording.tables[0].rows,
        "frames": imported.frames,
        "repeated": imported.repeated,
        "bytes_skipped": imported.bytes_skipped,
        "gaps": gaps.collect::<Vec<_>>(),
    })
}
