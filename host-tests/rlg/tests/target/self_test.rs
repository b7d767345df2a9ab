//! `rlg self-test` against a unit of the firmware's own answers behind a socket, and `rlg firmware --seal`.

use std::fs;
use std::io::{Read, Write};
use std::os::unix::net::UnixListener;
use std::path::Path;
use std::process::Output;
use std::thread;

use assert_cmd::Command;
use trueaxis::health::item;
use trueaxis::service::while_sampling;
use trueaxis::service_frame::{Answer, Request, RequestKind, RequestReceiver};
use trueaxis::terms::TermKinds;
use trueaxis::{HealthItem, OutputFrame, SelfTest, TelemetryFrame};

/// A unit with results of its tests; the commanded test gives `commanded`.
struct Unit {
    results: SelfTest,
    commanded: SelfTest,
    is_stopped: bool,
    kinds: Vec<u8>,
}

impl Unit {
    fn answer(&mut self, request: &Request) -> Answer {
        self.kinds.push(request.kind);
        let (mut answer, stop) = while_sampling(request, TermKinds::NONE);
        if self.is_stopped {
            (answer.outcome, answer.stopped) = (0, true);
        }
        match RequestKind::from_number(request.kind) {
            Some(RequestKind::SelfTest) => answer.detail = self.results.to_word(),
            Some(RequestKind::RunSelfTest) if self.is_stopped => self.results = self.commanded,
            Some(RequestKind::Restart) if self.is_stopped => self.is_stopped = false,
            _ => {}
        }
        self.is_stopped |= stop;
        answer
    }
}

/// Serves one command; the kinds of its requests.
fn serve(path: &Path, mut unit: Unit) -> thread::JoinHandle<Vec<u8>> {
    let listener = UnixListener::bind(path).expect("a socket");
    thread::spawn(move || {
        let (mut stream, _) = listener.accept().expect("a command");
        let mut receiver = RequestReceiver::new();
        let mut byte = [0];
        while let Ok(1) = stream.read(&mut byte) {
            if let Some(request) = receiver.push(byte[0]) {
                let answer = unit.answer(&request).to_bytes();
                if stream.write_all(&answer).is_err() {
                    break;
                }
            }
        }
        unit.kinds
    })
}

fn self_test(port: &Path, more: &[&str]) -> Output {
    let mut command = Command::cargo_bin("rlg").expect("the command is built");
    command.arg("self-test").arg("--port").arg(port).args(more);
    command.output().expect("it runs")
}

fn sound() -> SelfTest {
    SelfTest::default().with(|results| {
        (results.ram_tested, results.float_tested) = (true, true);
        results.scrub_passes = 33;
    })
}

fn unit(results: SelfTest, commanded: SelfTest) -> Unit {
    Unit {
        results,
        commanded,
        is_stopped: false,
        kinds: Vec::new(),
    }
}

#[test]
fn results_are_read_from_a_unit_in_service() {
    let own = tempfile::tempdir().expect("a temporary folder");
    let port = own.path().join("port");
    let thread = serve(&port, unit(sound(), sound()));
    let output = self_test(&port, &["--json"]);
    assert_eq!(output.status.code(), Some(0));
    let told: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert_eq!(told["failed"], serde_json::json!([]));
    assert_eq!(
        (&told["ram_tested"], &told["flash_tested"]),
        (&true.into(), &false.into())
    );
    assert_eq!(told["passes_in_service"], 33);
    assert_eq!(
        thread.join().expect("served"),
        [RequestKind::SelfTest as u8]
    );
}

#[test]
fn the_whole_test_is_run_once_the_unit_is_stopped() {
    let own = tempfile::tempdir().expect("a temporary folder");
    let failed = sound().with(|results| {
        (results.commanded, results.float_failed) = (true, true);
    });
    let port = own.path().join("port");
    let thread = serve(&port, unit(sound(), failed));
    let output = self_test(&port, &["--run", "--stop"]);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(1), "{said}");
    assert!(said.contains("failed: floating-point unit"), "{said}");
    use RequestKind as Kind;
    let kinds = [
        Kind::SelfTest,
        Kind::Stop,
        Kind::State,
        Kind::RunSelfTest,
        Kind::SelfTest,
        Kind::Restart,
    ];
    assert_eq!(thread.join().expect("served"), kinds.map(|kind| kind as u8));
    // Without --stop nothing is stopped.
    let port = own.path().join("other");
    let thread = serve(&port, unit(sound(), failed));
    let output = self_test(&port, &["--run"]);
    assert_eq!(output.status.code(), Some(2));
    assert_eq!(thread.join().expect("served"), [Kind::SelfTest as u8]);
}

#[test]
fn a_unit_with_bad_ram_is_named() {
    let own = tempfile::tempdir().expect("a temporary folder");
    let port = own.path().join("port");
    let bad = SelfTest::default().with(|results| results.ram_failed = true);
    let index = item::SELF_TEST;
    let value = bad.to_word();
    let frame = TelemetryFrame::new(OutputFrame::default(), HealthItem { index, value });
    let listener = UnixListener::bind(&port).expect("a socket");
    let thread = thread::spawn(move || {
        let (mut stream, _) = listener.accept().expect("a command");
        let mut byte = [0];
        while let Ok(1) = stream.read(&mut byte) {
            if stream.write_all(&frame.to_bytes()).is_err() {
                break;
            }
        }
    });
    let output = self_test(&port, &[]);
    assert_eq!(output.status.code(), Some(2));
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(said.contains("RAM failed the test"), "{said}");
    thread.join().expect("served");
    // The same frames as a capture.
    let capture = own.path().join("capture.bin");
    fs::write(&capture, frame.to_bytes().repeat(3)).expect("a file");
    let mut command = Command::cargo_bin("rlg").expect("the command is built");
    let import = command.args(["import", "--format", "frames", "--out"]);
    let import = import
        .arg(own.path().join("out"))
        .arg(&capture)
        .output()
        .expect("it runs");
    let said = String::from_utf8_lossy(&import.stderr).into_owned();
    assert_eq!(import.status.code(), Some(2), "{said}");
    assert!(said.contains("RAM failed the test"), "{said}");
}

#[test]
fn a_file_without_a_place_for_the_check_sum_is_refused() {
    let own = tempfile::tempdir().expect("a temporary folder");
    let program = assert_cmd::cargo::cargo_bin("rlg");
    for (file, words) in [
        (program.as_path(), "is not a firmware image"),
        (Path::new("/nowhere"), "/nowhere"),
    ] {
        let mut command = Command::cargo_bin("rlg").expect("the command is built");
        command.arg("firmware").arg("--seal").arg(file);
        let output = command
            .arg("--out")
            .arg(own.path().join("out"))
            .output()
            .expect("it runs");
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(2));
        assert!(said.contains(words), "{said}");
    }
}

/// The board's image, sealed: its check sum is that of the bytes in flash, computed bit by bit.
#[test]
#[ignore = "builds the board's images; cargo verify runs it"]
fn the_image_of_the_board_is_sealed() {
    use object::{Object, ObjectSegment, ObjectSymbol};
    let own = tempfile::tempdir().expect("a temporary folder");
    let workspace = Path::new(env!("CARGO_MANIFEST_DIR"))
        .ancestors()
        .nth(2)
        .expect("a workspace");
    let target = workspace.join("target").join("board");
    let build = std::process::Command::new(env!("CARGO"))
        .current_dir(workspace)
        .args(["board", "--target-dir"])
        .arg(&target)
        .status();
    assert!(build.is_ok_and(|status| status.success()));
    for name in ["firmware", "firmware-fixed"] {
        let elf = target.join("thumbv7em-none-eabihf/release").join(name);
        let out = own.path().join(name);
        let mut command = Command::cargo_bin("rlg").expect("the command is built");
        command
            .arg("firmware")
            .arg("--seal")
            .arg(&elf)
            .arg("--out")
            .arg(&out);
        assert!(command.output().expect("it runs").status.success());
        let bytes = fs::read(&out).expect("a file");
        let file = object::File::parse(&*bytes).expect("an ELF file");
        let mut flash = Vec::new();
        // Initial values of variables stand behind the code, in the order of the file.
        for segment in file.segments() {
            let data = segment.data().expect("content");
            if !data.is_empty() {
                let at = segment.address().wrapping_sub(0x0800_0000) as usize;
                let at = if at < 0x10_0000 { at } else { flash.len() };
                flash.resize(flash.len().max(at + data.len()), 0xFF);
                flash[at..at + data.len()].copy_from_slice(data);
            }
        }
        let seal = file
            .symbols()
            .find(|symbol| symbol.name() == Ok("IMAGE_SEAL"));
        let at = seal.expect("a place").address() as usize - 0x0800_0000;
        let word = |at: usize| u32::from_le_bytes(flash[at..at + 4].try_into().expect("four"));
        assert_eq!(flash[at..at + 4], *b"SEAL");
        let (end, stored) = (word(at + 4) as usize, word(at + 8));
        assert!(end.abs_diff(flash.len()) < 4, "{end} and {}", flash.len());
        flash.resize(end, 0xFF);
        let sum = !flash[..at]
            .iter()
            .chain(&flash[at + 12..])
            .fold(u32::MAX, |sum, byte| {
                (0..8).fold(sum ^ u32::from(*byte), |sum, _| {
                    sum >> 1 ^ if sum & 1 == 1 { 0xEDB8_8320 } else { 0 }
                })
            });
        assert_eq!(stored, sum, "{name}");
    }
}
