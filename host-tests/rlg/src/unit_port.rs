//! Communicates with a unit over its telemetry port: sends requests, and finds the answers among the telemetry.
//!
//! The port is a serial device set up by the caller (`stty`), or a local socket, as of serial servers and QEMU. A request
//! without an answer is sent again; the unit accepts a repeated request.

use std::fs::{self, File, OpenOptions};
use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, channel};
use std::thread;
use std::time::{Duration, Instant};

use trueaxis::health::item;
use trueaxis::service_frame::{Answer, AnswerFinder, Request};
use trueaxis::{Decoder, HealthItem, SelfTest};

use crate::error::InputError;

/// Pause after each byte to a unit that may be sampling, which polls its receiver once a period, 2 ms at its slowest rate.
const PACE: Duration = Duration::from_millis(2);

/// Time allowed for an answer: the unit's main loop runs every period, and an event log may delay it by some.
const PATIENCE: Duration = Duration::from_millis(500);

/// Largest number of times a request is sent.
const TRIES: u32 = 5;

/// Sentence about a unit that does not start for that reason.
pub const BAD_RAM: &str = "has a unit that does not start: its RAM failed the test at power-up";

/// A port to a unit.
pub struct UnitPort {
    path: PathBuf,
    out: Box<dyn Write>,
    answers: Receiver<Answer>,
    /// Frames report bad RAM: such a unit answers nothing.
    has_bad_ram: Arc<AtomicBool>,
    number: u8,
}

impl UnitPort {
    /// Opens the device or socket `path`.
    pub fn open(path: &Path) -> Result<Self, InputError> {
        let unreadable = |error: &std::io::Error| InputError::unreadable(path, error);
        if is_socket(path) {
            return Self::open_socket(path);
        }
        let file = OpenOptions::new().read(true).write(true).open(path);
        let file = file.map_err(|error| unreadable(&error))?;
        if file.metadata().is_ok_and(|about| about.is_file()) {
            return Err(InputError::new(path, "is an ordinary file")
                .expected("a serial device or a local socket with a unit behind it"));
        }
        let reader: File = file.try_clone().map_err(|error| unreadable(&error))?;
        Ok(Self::over(path, Box::new(reader), Box::new(file)))
    }

    #[cfg(unix)]
    fn open_socket(path: &Path) -> Result<Self, InputError> {
        use std::os::unix::net::UnixStream;
        let unreadable = |error: std::io::Error| InputError::unreadable(path, &error);
        let stream = UnixStream::connect(path).map_err(unreadable)?;
        let reader = stream.try_clone().map_err(unreadable)?;
        Ok(Self::over(path, Box::new(reader), Box::new(stream)))
    }

    #[cfg(not(unix))]
    fn open_socket(path: &Path) -> Result<Self, InputError> {
        Err(InputError::new(path, "is a socket").expected("a serial device"))
    }

    /// Opens it over two ends; a thread of its own reads until the other side closes.
    fn over(path: &Path, mut input: Box<dyn Read + Send>, out: Box<dyn Write>) -> Self {
        let (found, answers) = channel();
        let has_bad_ram = Arc::new(AtomicBool::new(false));
        let says_it = has_bad_ram.clone();
        thread::spawn(move || {
            let mut finder = AnswerFinder::new();
            let mut telemetry = Decoder::new();
            let mut bytes = [0; 256];
            while let Ok(length @ 1..) = input.read(&mut bytes) {
                let mut frames = bytes[..length]
                    .iter()
                    .filter_map(|byte| telemetry.push(*byte));
                if frames.any(|frame| says_bad_ram(&frame.health)) {
                    says_it.store(true, Ordering::Relaxed);
                }
                for answer in bytes[..length].iter().filter_map(|byte| finder.push(*byte)) {
                    if found.send(answer).is_err() {
                        return;
                    }
                }
            }
        });
        Self {
            path: path.to_path_buf(),
            out,
            answers,
            has_bad_ram,
            number: 0,
        }
    }

    /// Sends a request and waits for its answer, `patience` for each of some tries; `slowly`: at the pace of a unit that may
    /// be sampling.
    pub fn ask(
        &mut self,
        request: Request,
        slowly: bool,
        patience: Option<Duration>,
    ) -> Result<Answer, InputError> {
        self.number = self.number.wrapping_add(1);
        let request = Request {
            number: self.number,
            ..request
        };
        for _ in 0..TRIES {
            self.send(&request, slowly)?;
            let until = Instant::now() + patience.unwrap_or(PATIENCE);
            let left = || until.saturating_duration_since(Instant::now());
            while let Ok(answer) = self.answers.recv_timeout(left()) {
                if (answer.number, answer.kind) == (request.number, request.kind) {
                    return Ok(answer);
                }
            }
        }
        if self.has_bad_ram.load(Ordering::Relaxed) {
            return Err(InputError::new(&self.path, BAD_RAM)
                .expected("a unit whose RAM holds what is written"));
        }
        Err(InputError::new(&self.path, "has no unit that answers")
            .value(format!("{TRIES} requests"))
            .expected("a unit of this version, and the line at its baud rate: stty -F DEVICE 1000000 raw -echo"))
    }

    fn send(&mut self, request: &Request, slowly: bool) -> Result<(), InputError> {
        let bytes = request.to_bytes();
        let pieces = bytes.chunks(if slowly { 1 } else { bytes.len() });
        for piece in pieces {
            self.out
                .write_all(piece)
                .and_then(|()| self.out.flush())
                .map_err(|error| InputError::unwritable(&self.path, &error))?;
            if slowly {
                thread::sleep(PACE);
            }
        }
        Ok(())
    }
}

/// True if a health item is the result of a built-in test that found bad RAM.
pub fn says_bad_ram(health: &HealthItem) -> bool {
    health.index == item::SELF_TEST && SelfTest::from_word(health.value).ram_failed
}

#[cfg(unix)]
fn is_socket(path: &Path) -> bool {
    use std::os::unix::fs::FileTypeExt;
    fs::metadata(path).is_ok_and(|about| about.file_type().is_socket())
}

#[cfg(not(unix))]
fn is_socket(_: &Path) -> bool {
    let _ = fs::metadata;
    false
}
