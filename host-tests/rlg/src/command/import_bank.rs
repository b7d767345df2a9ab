//! Imports frames of a counter bank for `rlg import`: writes the recording with a model in its folder, and prints every gap.

use std::path::Path;

use serde_json::{Value, json};
use trueaxis::Parameters;

use crate::error::InputError;
use crate::import::bank::{self, Imported};
use crate::import::still::{self, WITHOUT_SITE};
use crate::output::OutputFolder;
use crate::recording::{Quantity, Site};
use crate::terminal::Terminal;

/// Largest number of gaps printed one by one; the result holds all.
const GAPS_SAID: usize = 10;

/// Request of the caller.
pub(super) struct Request<'a> {
    pub file: &'a Path,
    /// The unit's parameter block.
    pub params: Option<&'a Path>,
    pub site: Option<Site>,
    /// Folder of the recording.
    pub target: &'a Path,
    /// Name of the model's file in it.
    pub model: &'a str,
}

/// Reads the frames, writes recording and model into `out` and reports what was found.
pub(super) fn run(
    request: &Request<'_>,
    mut out: OutputFolder,
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
    let block = std::fs::read(params).map_err(|error| InputError::unreadable(params, &error))?;
    let (parameters, _) = Parameters::from_block(&block).map_err(|error| {
        InputError::new(params, format!("is no block for the firmware: {error}"))
    })?;
    let bytes = std::fs::read(file).map_err(|error| InputError::unreadable(file, &error))?;
    let imported = bank::import(file, &bytes, &parameters, request.site, request.target)?;
    imported.recording.write_into(&mut out)?;
    let model = still::ideal(parameters.pulse_weight_rad, &[Quantity::GyroCount]);
    model.check(&request.target.join(request.model))?;
    out.write(request.model, model.to_toml().as_bytes())?;
    out.commit()?;
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
        request.target.display(),
        slow.sum::<usize>(),
        if has_stamps { "a" } else { "no" },
        imported.repeated,
        imported.bytes_skipped,
    ));
    for gap in imported.gaps.iter().take(GAPS_SAID) {
        let [x, y, z] = gap.counts;
        let rows = if gap.rows == 1 { "row" } else { "rows" };
        terminal.warn(format!(
            "gap: {} {rows} from row {} without a frame; {x}, {y}, {z} pulses were counted over them and the row after them",
            gap.rows, gap.row
        ));
    }
    let more = imported.gaps.len().saturating_sub(GAPS_SAID);
    if more > 0 {
        terminal.warn(format!("{more} more gaps; --json lists them"));
    }
    if request.site.is_none() {
        terminal.warn(WITHOUT_SITE);
    }
    terminal.say(format!(
        "To diagnose: rlg diagnose {0} --model {0}/{1} --out DIR",
        request.target.display(),
        request.model
    ));
}

fn result(request: &Request<'_>, imported: &Imported, parameters: &Parameters) -> Value {
    let gaps = imported
        .gaps
        .iter()
        .map(|gap| json!({ "row": gap.row, "rows": gap.rows, "counts": gap.counts }));
    json!({
        "recording": request.target,
        "rate_hz": parameters.sample_rate_hz,
        "rows": imported.recording.tables[0].rows,
        "frames": imported.frames,
        "repeated": imported.repeated,
        "bytes_skipped": imported.bytes_skipped,
        "gaps": gaps.collect::<Vec<_>>(),
    })
}
