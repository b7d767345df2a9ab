//! Imports the unit's raw stream for `rlg import`: writes the recording with a model in its folder, and prints every gap.

use std::path::Path;

use serde_json::{Value, json};

use super::import_counts::Destination;
use crate::error::InputError;
use crate::import::raw::{self, Gap, Imported};
use crate::output::OutputFolder;
use crate::terminal::Terminal;

/// Request of the caller.
pub(super) struct Request<'a> {
    pub file: &'a Path,
    pub rate_hz: Option<f64>,
    pub destination: Destination<'a>,
}

/// Reads the stream, writes recording and model into `out` and reports what was found.
pub(super) fn run(
    request: &Request<'_>,
    out: OutputFolder,
    terminal: &Terminal,
) -> Result<(), InputError> {
    let file = request.file;
    let bytes = std::fs::read(file).map_err(|error| InputError::unreadable(file, &error))?;
    let Destination { site, target, .. } = request.destination;
    let imported = raw::import(file, &bytes, request.rate_hz, site, target)?;
    let destination = &request.destination;
    destination.write(&imported.recording, imported.pulse_weight_rad, out)?;
    say(request, &imported, terminal);
    terminal.result(&result(request, &imported))
}

fn say(request: &Request<'_>, imported: &Imported, terminal: &Terminal) {
    let stream = &imported.stream;
    terminal.say(format!(
        "{}: {} frames in {} rows at {} Hz in {}, from sampling period {} of the unit; {} bytes skipped, {} bad check sums, {} bytes of \
         an unfinished frame at the end",
        request.file.display(),
        stream.frames,
        imported.recording.tables[0].rows,
        imported.rate_hz,
        request.destination.target.display(),
        imported.first_period,
        stream.bytes_skipped,
        stream.bad_checksums,
        imported.bytes_at_end,
    ));
    if let Some(dropped @ 1..) = imported.dropped {
        terminal.warn(format!(
            "the unit itself says that it dropped {dropped} frames since its start"
        ));
    }
    let destination = &request.destination;
    destination.report(&imported.gaps, words, terminal);
}

/// Formats one gap as a sentence.
fn words(gap: &Gap) -> String {
    let [x, y, z] = gap.counts;
    let rows = if gap.rows == 1 { "row" } else { "rows" };
    let mut text = format!(
        "gap: {} {rows} from row {} without counts of their own ({} frames lost, {} interrupts missed, {} readings without a sample)",
        gap.rows, gap.row, gap.frames_lost, gap.interrupts_missed, gap.without_sample,
    );
    text += &if gap.bank_restarted {
        "; the counter bank started anew, so that what it counted is lost".to_owned()
    } else {
        format!("; {x}, {y}, {z} pulses were counted over all of them")
    };
    text
}

fn result(request: &Request<'_>, imported: &Imported) -> Value {
    let stream = &imported.stream;
    let gaps: Vec<Value> = imported
        .gaps
        .iter()
        .map(|gap| {
            json!({
                "row": gap.row,
                "rows": gap.rows,
                "frames_lost": gap.frames_lost,
                "interrupts_missed": gap.interrupts_missed,
                "without_sample": gap.without_sample,
                "bank_restarted": gap.bank_restarted,
                "counts": gap.counts,
            })
        })
        .collect();
    json!({
        "recording": request.destination.target,
        "rate_hz": imported.rate_hz,
        "rows": imported.recording.tables[0].rows,
        "frames": stream.frames,
        "first_period": imported.first_period,
        "generation": imported.generation,
        "dropped_by_the_unit": imported.dropped,
        "gaps": gaps,
        "bytes_skipped": stream.bytes_skipped,
        "bad_checksums": stream.bad_checksums,
        "bytes_at_end": imported.bytes_at_end,
    })
}
