//! `rlg upload --firmware`: writes a firmware image into the free slot of a unit with a boot selector.

use std::fs;
use std::path::PathBuf;
use std::thread;
use std::time::{Duration, Instant};

use serde_json::json;
use trueaxis::image::{ImageHeader, ImageSlot, PIECE_BYTES};
use trueaxis::image_slots::CONFIRM_AFTER_S;
use trueaxis::image_state::{BootReason, ImageState};
use trueaxis::service::{DONE, meaning};
use trueaxis::service_frame::{Answer, Request, RequestKind};

use super::firmware::{revision, version};
use super::upload::Upload;
use crate::error::InputError;
use crate::terminal::Terminal;
use crate::unit_port::UnitPort;

/// Time allowed for erasing: two sectors of an image and one of records, 4 s each at the least supply.
const ERASE_PATIENCE: Duration = Duration::from_secs(14);

/// Time allowed for checking the image in flash.
const STORE_PATIENCE: Duration = Duration::from_secs(6);

/// Time within which a new image must have started: restart, selector, clock, a mend of the parameter slots.
const START_PATIENCE: Duration = Duration::from_secs(15);

/// Time within which it must have confirmed itself.
const CONFIRM_PATIENCE: Duration = Duration::from_secs(CONFIRM_AFTER_S as u64 + 15);

/// Time between two requests meanwhile.
const PAUSE: Duration = Duration::from_millis(500);

/// An image in one of the files.
struct Sealed {
    path: PathBuf,
    header: ImageHeader,
    code: Vec<u8>,
}

/// Reads and checks every image of the files.
fn read(paths: &[PathBuf]) -> Result<Vec<Sealed>, InputError> {
    let mut images = Vec::new();
    for path in paths {
        let file = fs::read(path).map_err(|error| InputError::unreadable(path, &error))?;
        let mut rest = &file[..];
        loop {
            let (header, code, behind) = ImageHeader::of_file(rest).map_err(|error| {
                InputError::new(path, format!("holds no image for a unit: {error}"))
                    .expected("a file of `rlg firmware`")
            })?;
            images.push(Sealed {
                path: path.clone(),
                header,
                code: code.to_vec(),
            });
            rest = behind;
            if rest.is_empty() {
                break;
            }
        }
    }
    Ok(images)
}

/// Returns the answer, or the unit's refusal as a sentence about the file.
fn done(image: &Sealed, answer: Answer) -> Result<Answer, InputError> {
    if answer.outcome == DONE {
        return Ok(answer);
    }
    let refused = format!("is refused: {}", meaning(answer.outcome));
    let refusal = InputError::new(&image.path, refused);
    Err(match answer.detail {
        0 => refusal,
        detail => refusal.value(format!("{detail:#x}")),
    })
}

impl Upload {
    /// Sends the image for the free slot, restarts the unit and waits for the image to confirm itself.
    pub(super) fn run_firmware(&self, terminal: &Terminal) -> Result<(), InputError> {
        let images = read(&self.firmware)?;
        let mut port = UnitPort::open(&self.port)?;
        let state = port.ask(Request::new(0, RequestKind::State, 0), true, None)?;
        // Before the unit is stopped for nothing.
        self.choose(&images, self.image_state(&mut port)?)?;
        if !state.stopped {
            self.stop(&mut port)?;
            terminal.say("the unit is stopped");
        }
        let free = self.image_state(&mut port)?;
        let image = self.choose(&images, free)?;
        self.send(&mut port, image, terminal)?;
        let restart = Request::new(0, RequestKind::Restart, 0);
        done(image, port.ask(restart, false, None)?)?;
        terminal.say(format!(
            "{}: {} bytes stored in slot {:?}, version {}, revision {}; the unit starts anew with it",
            image.path.display(),
            image.code.len(),
            image.header.slot,
            version(image.header.version),
            revision(image.header.revision)
        ));
        let is_confirmed = !self.no_wait && {
            self.wait(&mut port, image, terminal)?;
            true
        };
        terminal.result(&json!({
            "bytes": image.code.len(),
            "slot": format!("{:?}", image.header.slot),
            "version": version(image.header.version),
            "revision": revision(image.header.revision),
            "confirmed": is_confirmed,
            "stopped_by_us": !state.stopped,
        }))
    }

    /// State of the unit's running image.
    fn image_state(&self, port: &mut UnitPort) -> Result<ImageState, InputError> {
        let answer = port.ask(Request::new(0, RequestKind::ImageState, 0), true, None)?;
        let state = ImageState::of_word(answer.detail);
        if answer.outcome != DONE || state.running.is_none() {
            return Err(
                InputError::new(&self.port, "leads to a unit without slots for firmware").expected(
                    "a unit with a boot selector (docs/board.md); a probe flashes others",
                ),
            );
        }
        Ok(state)
    }

    /// The image linked for the free slot.
    fn choose<'a>(
        &self,
        images: &'a [Sealed],
        state: ImageState,
    ) -> Result<&'a Sealed, InputError> {
        let Some(free) = state.free else {
            return Err(
                InputError::new(&self.port, "leads to a unit whose image is on trial")
                    .expected("a unit whose image has confirmed itself, 30 s after its start"),
            );
        };
        let found = images.iter().find(|image| image.header.slot == free);
        let first = images.first().map_or(&self.port, |image| &image.path);
        found.ok_or_else(|| {
            InputError::new(first, "has no image linked for the unit's free slot")
                .value(format!("slot {free:?}"))
                .expected("a file with the images of both slots, or that one's")
        })
    }

    /// Sends header and code, and has the image checked.
    fn send(
        &self,
        port: &mut UnitPort,
        image: &Sealed,
        terminal: &Terminal,
    ) -> Result<(), InputError> {
        let header = image.header.to_bytes();
        let begin = Request::with_bytes(0, RequestKind::ImageBegin, 0, &header);
        done(image, port.ask(begin, false, Some(ERASE_PATIENCE))?)?;
        let bar = terminal.bar(image.code.len() as u64, "sending");
        for (piece, bytes) in (0..=u16::MAX).zip(image.code.chunks(PIECE_BYTES)) {
            let data = Request::with_bytes(0, RequestKind::ImageData, piece, bytes);
            done(image, port.ask(data, false, None)?)?;
            bar.inc(bytes.len() as u64);
        }
        bar.finish_and_clear();
        let store = Request::new(0, RequestKind::ImageStore, 0);
        done(image, port.ask(store, false, Some(STORE_PATIENCE))?)?;
        Ok(())
    }

    /// Waits until the image runs and has confirmed itself.
    fn wait(
        &self,
        port: &mut UnitPort,
        image: &Sealed,
        terminal: &Terminal,
    ) -> Result<(), InputError> {
        let begun = Instant::now();
        let slot = image.header.slot;
        let mut has_started = false;
        loop {
            let patience = if has_started {
                CONFIRM_PATIENCE
            } else {
                START_PATIENCE
            };
            let is_late = begun.elapsed() > patience;
            // A unit that starts gives no answer.
            match self.image_state(port) {
                Ok(state) if state.running == Some(slot) && state.is_confirmed => {
                    terminal.say(format!("slot {slot:?} has confirmed itself"));
                    return Ok(());
                }
                Ok(state) if state.running == Some(slot) && !has_started => {
                    has_started = true;
                    terminal.say(format!(
                        "slot {slot:?} runs on trial; it confirms itself after {CONFIRM_AFTER_S} s"
                    ));
                }
                Ok(state) if is_other_for_good(state, slot) => {
                    return Err(InputError::new(&image.path, "was not kept by the unit")
                        .value(state.reason.meaning())
                        .expected(
                            "an image that runs in health: see the unit's status and event log",
                        ));
                }
                Err(error) if is_late => return Err(error),
                Ok(_) if is_late => {
                    return Err(InputError::new(&image.path, "has not confirmed itself")
                        .value(format!("{} s", begun.elapsed().as_secs()))
                        .expected(
                            "an image that runs in health: see the unit's status and event log",
                        ));
                }
                _ => {}
            }
            thread::sleep(PAUSE);
        }
    }
}

/// True if the selector has decided against the image in `slot`.
fn is_other_for_good(state: ImageState, slot: ImageSlot) -> bool {
    let is_decided = matches!(
        state.reason,
        BootReason::RolledBack | BootReason::Refused | BootReason::Postponed | BootReason::Fallback
    );
    state.running == Some(slot.other()) && is_decided
}
