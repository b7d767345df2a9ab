//! `rlg firmware` and `rlg upload --firmware`, against a unit of the firmware's own receiver, selector and records behind a socket.

use std::fs;
use std::io::{Read, Write};
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::{Path, PathBuf};
use std::process::Output;
use std::thread;

use assert_cmd::Command;
use firmware_tests::image_unit::{Chip, ImagesView, JournalView, Unit, image};
use trueaxis::image::{ImageHeader, ImageSlot};
use trueaxis::image_state::{BootReason, ImageState};
use trueaxis::image_upload::ImageUpload;
use trueaxis::service::images::{carry_out, is_about_images};
use trueaxis::service::{while_on_trial, while_sampling};
use trueaxis::service_frame::{Answer, Request, RequestKind, RequestReceiver};
use trueaxis::terms::TermKinds;

/// Bytes of code of the images here.
const CODE: usize = 8 * 1024;

/// Requests that an image on trial answers before its 30 s are over.
const TRIAL_REQUESTS: u32 = 3;

/// A running unit, request by request.
struct Served {
    unit: Unit,
    state: ImageState,
    is_stopped: bool,
    /// An image on trial confirms itself; else it resets.
    is_healthy: bool,
    asked_on_trial: u32,
    upload: Option<ImageUpload<JournalView, ImagesView>>,
}

impl Served {
    fn new(is_healthy: bool) -> Self {
        let mut served = Self {
            unit: Unit::in_service(&image(ImageSlot::A, CODE, 1), &[]),
            state: ImageState::default(),
            is_stopped: false,
            is_healthy,
            asked_on_trial: 0,
            upload: None,
        };
        served.start();
        served
    }

    /// The selector, and the image that it starts.
    fn start(&mut self) {
        let choice = self.unit.boot().expect("an image to start");
        let slot = choice.header.slot;
        self.state = self.unit.slots().state(slot, choice.reason);
        (self.asked_on_trial, self.upload) = (0, None);
    }

    fn answer(&mut self, request: &Request) -> Answer {
        let on_trial = self.state.reason == BootReason::Trial && !self.state.is_confirmed;
        let running = self.state.running.expect("a slot");
        if self.is_stopped {
            let (slots, reason) = (self.unit.slots(), self.state.reason);
            let upload = self
                .upload
                .get_or_insert_with(|| ImageUpload::new(slots, running, reason));
            let (outcome, detail) = if is_about_images(request) {
                carry_out(upload, request, || true)
            } else {
                (0, 0)
            };
            if RequestKind::from_number(request.kind) == Some(RequestKind::Restart) {
                self.is_stopped = false;
                self.start();
            }
            return Answer {
                number: request.number,
                kind: request.kind,
                outcome,
                stopped: true,
                detail,
                term_kinds: 0,
            };
        }
        let (mut answer, stop) = if on_trial {
            (while_on_trial(request, TermKinds::NONE), false)
        } else {
            while_sampling(request, TermKinds::NONE)
        };
        if is_about_images(request) && answer.outcome == 0 {
            answer.detail = self.state.to_word();
        }
        self.is_stopped = stop;
        self.asked_on_trial += u32::from(on_trial);
        if self.asked_on_trial == TRIAL_REQUESTS {
            if self.is_healthy {
                assert!(self.unit.confirm(running));
                self.state = self.unit.slots().state(running, self.state.reason);
            } else {
                self.start();
            }
        }
        answer
    }
}

/// State of the unit behind a socket, and its chip, once every command has ended.
type End = (ImageState, Chip);

/// Serves one command after the other at a socket.
fn serve(path: &Path, is_healthy: bool, commands: usize) -> thread::JoinHandle<End> {
    let listener = UnixListener::bind(path).expect("a socket");
    thread::spawn(move || {
        let mut served = Served::new(is_healthy);
        for _ in 0..commands {
            let (mut stream, _): (UnixStream, _) = listener.accept().expect("a command");
            let mut receiver = RequestReceiver::new();
            let mut bytes = [0; 256];
            while let Ok(length @ 1..) = stream.read(&mut bytes) {
                for request in bytes[..length]
                    .iter()
                    .filter_map(|byte| receiver.push(*byte))
                {
                    let answer = served.answer(&request).to_bytes();
                    if stream.write_all(&answer).is_err() {
                        break;
                    }
                }
            }
        }
        let chip = served.unit.chip.borrow().clone();
        (served.state, chip)
    })
}

fn upload(files: &[&PathBuf], port: &Path, more: &[&str]) -> Output {
    let mut command = Command::cargo_bin("rlg").expect("the command is built");
    command.arg("upload").args(more).arg("--port").arg(port);
    command.arg("--firmware").args(files);
    command.output().expect("it runs")
}

fn refused(output: &Output, words: &str) {
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{said}");
    assert!(said.contains(words), "{said}");
}

fn file(folder: &Path, name: &str, bytes: &[u8]) -> PathBuf {
    let path = folder.join(name);
    fs::write(&path, bytes).expect("a file");
    path
}

#[test]
fn a_unit_takes_the_image_for_its_free_slot() {
    let own = tempfile::tempdir().expect("a temporary folder");
    let port = own.path().join("port");
    let (a, b) = (image(ImageSlot::A, CODE, 5), image(ImageSlot::B, CODE, 6));
    let both = file(own.path(), "both.rlgi", &[&a[..], &b].concat());
    let only_a = file(own.path(), "a.rlgi", &a);
    let only_b = file(own.path(), "b.rlgi", &b);
    let mut bytes = b.clone();
    bytes[5_000] ^= 4;
    let damaged = file(own.path(), "damaged.rlgi", &bytes);
    let thread = serve(&port, true, 4);
    // A damaged file is refused before the port is opened.
    refused(&upload(&[&damaged], &port, &["--stop"]), "CRC-32");
    refused(&upload(&[&both], &port, &[]), "a unit that is running");
    refused(
        &upload(&[&only_a], &port, &["--stop"]),
        "no image linked for the unit's free slot",
    );
    let stored = upload(&[&both], &port, &["--stop", "--json"]);
    let said = String::from_utf8_lossy(&stored.stderr);
    assert!(stored.status.success(), "{said}");
    let result: serde_json::Value = serde_json::from_slice(&stored.stdout).expect("JSON");
    assert_eq!(
        (&result["slot"], &result["confirmed"]),
        (&"B".into(), &true.into())
    );
    // The next one goes to the other slot, out of two files.
    let stored = upload(
        &[&only_b, &only_a],
        &port,
        &["--stop", "--json", "--no-wait"],
    );
    let said = String::from_utf8_lossy(&stored.stderr);
    assert!(stored.status.success(), "{said}");
    let (state, chip) = thread.join().expect("served");
    assert_eq!(state.running, Some(ImageSlot::A));
    assert_eq!(state.reason, BootReason::Trial);
    let unit = Unit::new(chip);
    let choice = unit.boot().expect("an image");
    assert_eq!(
        (choice.reason, unit.running(&choice, &[&a, &b])),
        (BootReason::RolledBack, 1)
    );
}

#[test]
fn an_image_that_the_unit_does_not_keep_is_an_error() {
    let own = tempfile::tempdir().expect("a temporary folder");
    let port = own.path().join("port");
    let new = file(own.path(), "b.rlgi", &image(ImageSlot::B, CODE, 6));
    let thread = serve(&port, false, 1);
    refused(
        &upload(&[&new], &port, &["--stop"]),
        "was not kept by the unit",
    );
    let (state, _) = thread.join().expect("served");
    assert_eq!(
        (state.running, state.reason),
        (Some(ImageSlot::A), BootReason::RolledBack)
    );
}

#[test]
fn a_unit_without_a_selector_is_not_stopped() {
    let own = tempfile::tempdir().expect("a temporary folder");
    let port = own.path().join("port");
    let new = file(own.path(), "b.rlgi", &image(ImageSlot::B, CODE, 6));
    let listener = UnixListener::bind(&port).expect("a socket");
    let thread = thread::spawn(move || {
        let (mut stream, _) = listener.accept().expect("a command");
        let mut receiver = RequestReceiver::new();
        let mut byte = [0];
        let mut kinds = Vec::new();
        while let Ok(1) = stream.read(&mut byte) {
            if let Some(request) = receiver.push(byte[0]) {
                kinds.push(request.kind);
                let (answer, _) = while_sampling(&request, TermKinds::NONE);
                let _ = stream.write_all(&answer.to_bytes());
            }
        }
        kinds
    });
    refused(
        &upload(&[&new], &port, &["--stop"]),
        "without slots for firmware",
    );
    assert_eq!(
        thread.join().expect("served"),
        [0, 9],
        "asked for more than its state"
    );
}

/// The images of `cargo slot-a` and `cargo slot-b`, from their ELF files to a unit that runs one of them.
#[test]
#[ignore = "builds the images of both slots; cargo verify runs it"]
fn real_images_become_a_file_that_a_unit_takes() {
    let own = tempfile::tempdir().expect("a temporary folder");
    let workspace = Path::new(env!("CARGO_MANIFEST_DIR"))
        .ancestors()
        .nth(2)
        .expect("a workspace");
    let elf = |alias: &str| {
        let status = std::process::Command::new(env!("CARGO"))
            .current_dir(workspace)
            .arg(alias)
            .status();
        assert!(
            status.is_ok_and(|status| status.success()),
            "{alias} does not build"
        );
        workspace
            .join("target")
            .join(alias)
            .join("thumbv7em-none-eabihf/release/firmware")
    };
    let elfs = ["slot-a", "slot-b"].map(elf);
    let out = own.path().join("firmware.rlgi");
    let mut command = Command::cargo_bin("rlg").expect("the command is built");
    let made = command
        .arg("firmware")
        .args(&elfs)
        .arg("--out")
        .arg(&out)
        .output()
        .expect("it runs");
    assert!(
        made.status.success(),
        "{}",
        String::from_utf8_lossy(&made.stderr)
    );
    let bytes = fs::read(&out).expect("a file");
    let (first, _, rest) = ImageHeader::of_file(&bytes).expect("an image");
    let (second, _, rest) = ImageHeader::of_file(rest).expect("an image");
    assert_eq!(
        (first.slot, second.slot, rest.len()),
        (ImageSlot::A, ImageSlot::B, 0)
    );
    assert_eq!(first.version.to_be_bytes()[3], 0, "f32");
    let port = own.path().join("port");
    let thread = serve(&port, true, 1);
    let stored = upload(&[&out], &port, &["--stop", "--json"]);
    assert!(
        stored.status.success(),
        "{}",
        String::from_utf8_lossy(&stored.stderr)
    );
    let (_, chip) = thread.join().expect("served");
    let unit = Unit::new(chip);
    let choice = unit.boot().expect("an image");
    assert_eq!(
        (choice.header, choice.reason),
        (second, BootReason::Confirmed)
    );
    // An ELF file that is linked elsewhere has no slot.
    let mut command = Command::cargo_bin("rlg").expect("the command is built");
    let twice = command
        .arg("firmware")
        .args([&elfs[0], &elfs[0]])
        .arg("--out")
        .arg(&out)
        .output();
    refused(&twice.expect("it runs"), "the slot of the other file");
}
