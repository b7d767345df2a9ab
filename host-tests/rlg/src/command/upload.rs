//! `rlg upload`: writes a parameter block into a unit, over its telemetry port; or a firmware image (`upload_firmware`).

use std::fs;
use std::path::{Path, PathBuf};
use std::thread;
use std::time::{Duration, Instant};

use clap::Args;
use serde_json::json;
use trueaxis::service::{DONE, FOREIGN, TERM_ABSENT, meaning};
use trueaxis::service_frame::{Answer, DATA_BYTES, Request, RequestKind};
use trueaxis::terms::TermKinds;
use trueaxis::{TermKind, UnitNumber};

use super::block;
use crate::error::InputError;
use crate::terminal::Terminal;
use crate::unit_port::UnitPort;

/// Time allowed for erasing and writing a slot: 4 s for the sector at the least supply, and reading it back.
const STORE_PATIENCE: Duration = Duration::from_secs(6);

/// Time within which a unit that was asked to stop must have restarted without sampling.
const STOP_PATIENCE: Duration = Duration::from_secs(10);

/// Write a parameter block or a firmware image into a unit over its telemetry port
///
/// The block (rlg params writes it) is checked here and, whole, in the unit, before it replaces the slot that is not in use: power that
/// is lost at any time leaves the old parameters or the new ones. The generation that the block itself says does not count, the
/// unit gives it the next one. A unit that samples refuses it; --stop stops the unit first. Afterwards the unit starts anew.
///
/// With --firmware: a unit with a boot selector takes the image that is linked for its free slot. It starts it once, and goes back
/// to the one before unless the new one confirms itself, 30 s in health. rlg waits for that.
#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  stty -F /dev/ttyUSB0 1000000 raw -echo\n  rlg upload params.bin --port /dev/ttyUSB0 --stop\n  rlg upload --firmware firmware.rlgi --port /dev/ttyUSB0 --stop"
)]
pub struct Upload {
    /// The parameter block
    #[arg(required_unless_present = "firmware", conflicts_with = "firmware")]
    block: Option<PathBuf>,
    /// Firmware file (rlg firmware) with the images of both slots, or one file for each
    #[arg(long, value_name = "FILE", num_args = 1..=2)]
    pub(super) firmware: Vec<PathBuf>,
    /// With --firmware: do not wait until the new image has confirmed itself
    #[arg(long, requires = "firmware")]
    pub(super) no_wait: bool,
    /// Serial device of the unit's telemetry port, set up by stty; or a local socket that leads to it
    #[arg(short, long)]
    pub(super) port: PathBuf,
    /// Stop a unit that is sampling; it sends nothing until it starts anew
    #[arg(long)]
    stop: bool,
}

impl Upload {
    /// Checks the block or the image, sends it to the unit and has it stored.
    pub fn run(&self, terminal: &Terminal) -> Result<(), InputError> {
        match &self.block {
            Some(path) => self.run_block(path, terminal),
            None => self.run_firmware(terminal),
        }
    }

    fn run_block(&self, path: &Path, terminal: &Terminal) -> Result<(), InputError> {
        let block = fs::read(path).map_err(|error| InputError::unreadable(path, &error))?;
        let (parameters, _) = block::parameters(path, &block)?;
        let mut port = UnitPort::open(&self.port)?;
        let state = port.ask(Request::new(0, RequestKind::State, 0), true, None)?;
        let lacking = parameters.terms.kinds();
        if let Some(kind) = lacking.first_beyond(TermKinds::from_bits(state.term_kinds)) {
            return Err(
                InputError::new(path, "asks for a term that the unit's build lacks")
                    .value(kind.name())
                    .expected("firmware that has it, or a model without that effect"),
            );
        }
        if !state.stopped {
            self.stop(&mut port)?;
            terminal.say("the unit is stopped");
        }
        let unit = parameters.identity.map(|identity| identity.unit);
        let generation = self.bring(&mut port, path, &block, unit, terminal)?;
        done(
            path,
            port.ask(Request::new(0, RequestKind::Restart, 0), false, None)?,
        )?;
        terminal.say(format!(
            "{}: {} bytes stored as generation {generation}; the unit starts anew with it",
            path.display(),
            block.len()
        ));
        terminal.result(&json!({
            "bytes": block.len(),
            "generation": generation,
            "unit": unit.map(|unit| unit.to_string()),
            "stopped_by_us": !state.stopped,
        }))
    }

    pub(super) fn stop(&self, port: &mut UnitPort) -> Result<(), InputError> {
        stop(&self.port, port, self.stop)
    }

    /// Sends the block piece by piece; returns its generation once it is stored.
    fn bring(
        &self,
        port: &mut UnitPort,
        path: &Path,
        block: &[u8],
        unit: Option<UnitNumber>,
        terminal: &Terminal,
    ) -> Result<u32, InputError> {
        let length = u16::try_from(block.len()).unwrap_or(u16::MAX);
        done(
            path,
            port.ask(Request::new(0, RequestKind::Begin, length), false, None)?,
        )?;
        let bar = terminal.bar(block.len() as u64, "sending");
        for (at, piece) in block.chunks(DATA_BYTES).enumerate() {
            let offset = (at * DATA_BYTES) as u16;
            done(
                path,
                port.ask(Request::data(0, offset, piece), false, None)?,
            )?;
            bar.inc(piece.len() as u64);
        }
        bar.finish_and_clear();
        let store = Request::new(0, RequestKind::Store, 0);
        let answer = port.ask(store, false, Some(STORE_PATIENCE))?;
        match unit {
            Some(unit) if answer.outcome == FOREIGN => {
                Err(InputError::new(path, "is refused by the unit")
                    .value(format!("a block of unit {unit}"))
                    .expected(format!(
                        "one of this unit, whose number ends in {}, or one that names no unit",
                        end_of_number(answer.detail)
                    )))
            }
            _ => Ok(done(path, answer)?.detail),
        }
    }
}

/// Stops the unit at `path`, if the caller asks for it, and waits until it reports that it has stopped.
pub(super) fn stop(path: &Path, port: &mut UnitPort, is_asked: bool) -> Result<(), InputError> {
    if !is_asked {
        return Err(InputError::new(path, "leads to a unit that is running")
            .expected("a unit that is stopped, or --stop"));
    }
    done(
        path,
        port.ask(Request::new(0, RequestKind::Stop, 0), true, None)?,
    )?;
    let until = Instant::now() + STOP_PATIENCE;
    while Instant::now() < until {
        if port
            .ask(Request::new(0, RequestKind::State, 0), true, None)?
            .stopped
        {
            return Ok(());
        }
        thread::sleep(Duration::from_millis(20));
    }
    Err(InputError::new(
        path,
        "leads to a unit that goes on sampling",
    ))
}

/// Returns the answer, or the unit's refusal as a sentence about the file.
pub(super) fn done(path: &Path, answer: Answer) -> Result<Answer, InputError> {
    if answer.outcome == DONE {
        return Ok(answer);
    }
    let refusal = InputError::new(path, format!("is refused: {}", meaning(answer.outcome)));
    let kind = u16::try_from(answer.detail)
        .ok()
        .and_then(TermKind::from_number);
    Err(match kind {
        Some(kind) if answer.outcome == TERM_ABSENT => refusal.value(kind.name()),
        _ if answer.detail != 0 => refusal.value(answer.detail),
        _ => refusal,
    })
}

/// Formats the last bytes of a unit's number, as an answer has them: text where it is printable, else hexadecimal.
fn end_of_number(word: u32) -> String {
    let bytes = word.to_be_bytes();
    let first = bytes.iter().position(|byte| *byte != 0).unwrap_or(0);
    match bytes[first..].iter().all(u8::is_ascii_graphic) {
        true => bytes[first..]
            .iter()
            .map(|byte| char::from(*byte))
            .collect(),
        false => format!("{word:08x}"),
    }
}
