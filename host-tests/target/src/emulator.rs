//! Runs an image in QEMU once.
//!
//! It takes the image, the content of its parameter slots and the records that its counter bank plays, and gives an
//! [`Emulation`]: the bytes of the serial port, the image's report, and its raw event log. The emulated machine is an
//! STM32F405 (`netduinoplus2`). With `-icount shift=0` one instruction is one nanosecond of its virtual time, so the
//! counts of chain and processor repeat exactly. The moment when the sleeping processor wakes can differ by a few
//! instructions, which shows in the counts of whole interrupts. [`first_telemetry`] runs the board's own image, whose
//! bank is absent, until it has sent something.
//!
//! Files go through a temporary folder, which is removed afterwards.

use std::fs;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use trueaxis::TELEMETRY_BYTES;
use trueaxis::bank_record::BankRecord;
use trueaxis::run_report::{RunOutcome, RunReport};

use super::slots::{SLOT_ADDRESSES, SlotImages};
use rlg_recording::error::InputError;
use rlg_recording::output::ScratchFolder;

/// The emulator's program.
pub const EMULATOR: &str = "qemu-system-arm";

/// The machine and its clock. `sleep=off`: virtual time does not wait for the wall clock while the
/// processor sleeps.
const MACHINE: [&str; 10] = [
    "-M",
    "netduinoplus2",
    "-icount",
    "shift=0,sleep=off",
    "-display",
    "none",
    "-monitor",
    "none",
    "-nodefaults",
    "-no-reboot",
];

/// An image that has sent nothing for this long hangs: it needs under 1 ms of wall time for a frame.
const TIMEOUT: Duration = Duration::from_secs(60);

/// Interval between two checks of a run's progress: long against a file look-up, short for a person.
const POLL_INTERVAL: Duration = Duration::from_millis(50);

/// Output of a run.
#[derive(Debug, Clone)]
pub struct Emulation {
    /// Bytes of the first serial port.
    pub telemetry: Vec<u8>,
    /// Bytes of the second one: the raw stream of an image that has it.
    pub raw: Vec<u8>,
    /// The image's account of the run.
    pub report: RunReport,
    /// The event log as the image sent it.
    pub events: Vec<u8>,
}

/// The emulator's own name and version, first line.
pub fn version() -> Result<String, InputError> {
    let output = Command::new(EMULATOR)
        .arg("--version")
        .output()
        .map_err(|error| missing(&error))?;
    let words = String::from_utf8_lossy(&output.stdout);
    Ok(words.lines().next().unwrap_or(EMULATOR).to_owned())
}

/// The files of a run, in its folder.
const TELEMETRY: &str = "telemetry.bin";
const RAW: &str = "raw.bin";
const EVENTS: &str = "events.bin";
const REPORT: &str = "report.bin";
const TRACE: &str = "trace.log";
const PORT: &str = "port.sock";
const STORED: &str = "slots.bin";
const SLOTS: [&str; 2] = ["slot-0.bin", "slot-1.bin"];

/// Runs the emulator's `image` over `records`. `progress` is called with the number of frames so far.
pub fn run(
    image: &Path,
    slots: &SlotImages,
    records: &[BankRecord],
    progress: &mut dyn FnMut(u64),
) -> Result<Emulation, InputError> {
    run_in(&Folder::new()?, image, slots, records, &[], progress)
}

/// As [`run`]; also the address of every instruction that was executed within `code`, in order. One
/// instruction a step and a line in a file for each: for some thousand samples, not for millions.
pub fn run_traced(
    image: &Path,
    slots: &SlotImages,
    records: &[BankRecord],
    code: &[Range<u64>],
) -> Result<(Emulation, Vec<u64>), InputError> {
    let folder = Folder::new()?;
    let ranges: Vec<String> = code
        .iter()
        // The emulator includes the end.
        .map(|range| format!("{:#x}..{:#x}", range.start, range.end.saturating_sub(1)))
        .collect();
    let options = [
        "-singlestep",
        "-d",
        "exec,nochain",
        "-D",
        TRACE,
        "-dfilter",
        &ranges.join(","),
    ];
    let emulation = run_in(&folder, image, slots, records, &options, &mut |_| {})?;
    let trace = String::from_utf8_lossy(&folder.read(TRACE))
        .lines()
        .filter_map(executed)
        .collect();
    Ok((emulation, trace))
}

/// The address in a line such as `Trace 0: 0x7f2c [00000000/08000abc/00000120/ff020201] advance`.
fn executed(line: &str) -> Option<u64> {
    let (_, address) = line.strip_prefix("Trace ")?.split_once('/')?;
    u64::from_str_radix(address.split('/').next()?, 16).ok()
}

fn run_in(
    folder: &Folder,
    image: &Path,
    slots: &SlotImages,
    records: &[BankRecord],
    options: &[&str],
    progress: &mut dyn FnMut(u64),
) -> Result<Emulation, InputError> {
    let stream: Vec<u8> = records.iter().flat_map(BankRecord::to_bytes).collect();
    folder.write("frames.bin", &stream)?;
    let semihosting = ["-semihosting-config", "enable=on,target=native"];
    let serial = format!("file:{TELEMETRY}");
    let options = [&semihosting, options].concat();
    let mut running = folder.start(image, slots, &serial, &options)?;
    let status = wait(
        &mut running,
        &folder.at(TELEMETRY),
        image,
        u64::MAX,
        progress,
    )?;

    let report = fs::read(folder.at(REPORT))
        .ok()
        .and_then(|bytes| RunReport::from_bytes(&bytes))
        .ok_or_else(|| {
            let status = status.map_or_else(String::new, |status| format!(" ({status})"));
            InputError::new(image, format!("ended without a report{status}"))
                .expected("an image of this workspace's version that does not panic")
        })?;
    match report.outcome {
        RunOutcome::FileFault => Err(InputError::new(image, "could not use the files of its run")),
        RunOutcome::Complete => Ok(Emulation {
            telemetry: folder.read(TELEMETRY),
            raw: folder.read(RAW),
            report,
            events: folder.read(EVENTS),
        }),
    }
}

/// Runs the board's `image` until it has sent `frames` frames' worth of bytes, and ends it.
pub fn first_telemetry(
    image: &Path,
    slots: &SlotImages,
    frames: u64,
) -> Result<Vec<u8>, InputError> {
    let folder = Folder::new()?;
    let mut running = folder.start(image, slots, &format!("file:{TELEMETRY}"), &[])?;
    wait(
        &mut running,
        &folder.at(TELEMETRY),
        image,
        frames,
        &mut |_| {},
    )?;
    drop(running);
    Ok(folder.read(TELEMETRY))
}

/// Runs the emulator's `image` over `records` with its telemetry port at a local socket, to which `talk` is given the
/// path. The image waits until somebody connects, and the run ends with the request to start anew.
///
/// # Returns
/// The result of `talk`, and the slots as the unit left them.
pub fn run_with_port<T>(
    image: &Path,
    slots: &SlotImages,
    records: &[BankRecord],
    talk: impl FnOnce(&Path) -> T,
) -> Result<(T, SlotImages), InputError> {
    let folder = Folder::new()?;
    let stream: Vec<u8> = records.iter().flat_map(BankRecord::to_bytes).collect();
    folder.write("frames.bin", &stream)?;
    let chardev = format!("socket,id=port,path={PORT},server=on,wait=on");
    let options = [
        "-semihosting-config",
        "enable=on,target=native",
        "-chardev",
        &chardev,
    ];
    let mut running = folder.start(image, slots, "chardev:port", &options)?;
    let begun = Instant::now();
    while !folder.at(PORT).exists() && begun.elapsed() < TIMEOUT {
        thread::sleep(POLL_INTERVAL);
    }
    let said = talk(&folder.at(PORT));
    wait(
        &mut running,
        &folder.at(TELEMETRY),
        image,
        u64::MAX,
        &mut |_| {},
    )?;
    let stored = SlotImages::stored(&folder.read(STORED))
        .ok_or_else(|| InputError::new(image, "ended without having been stopped by a request"))?;
    Ok((said, stored))
}

/// The temporary folder of a run.
struct Folder(ScratchFolder);

impl Folder {
    fn new() -> Result<Self, InputError> {
        ScratchFolder::new().map(Self)
    }

    fn at(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn write(&self, name: &str, content: &[u8]) -> Result<(), InputError> {
        fs::write(self.at(name), content)
            .map_err(|error| InputError::new(self.at(name), format!("cannot be written ({error})")))
    }

    /// Content of the file that the run wrote; empty if it wrote none.
    fn read(&self, name: &str) -> Vec<u8> {
        fs::read(self.at(name)).unwrap_or_default()
    }

    /// Starts the emulator in this folder.
    fn start(
        &self,
        image: &Path,
        slots: &SlotImages,
        serial: &str,
        options: &[&str],
    ) -> Result<Running, InputError> {
        // The emulator works in another folder.
        let image = fs::canonicalize(image)
            .map_err(|error| InputError::new(image, format!("cannot be found ({error})")))?;
        let log = fs::File::create(self.at(EVENTS)).map_err(|error| {
            InputError::new(self.at(EVENTS), format!("cannot be written ({error})"))
        })?;
        let mut command = Command::new(EMULATOR);
        command
            .current_dir(self.0.path())
            .args(MACHINE)
            // The machine's USARTs in their order, of which the image uses 1 and 6.
            .args(["-serial", serial])
            .args(["-serial", "null"].repeat(4))
            .args(["-serial", &format!("file:{RAW}")])
            .arg("-kernel")
            .arg(&image);
        for ((name, content), address) in SLOTS.iter().zip(&slots.0).zip(SLOT_ADDRESSES) {
            self.write(name, content)?;
            command.args([
                "-device",
                &format!("loader,file={name},addr={address:#x},force-raw=on"),
            ]);
        }
        command
            .args(options)
            .stdin(Stdio::null())
            // The image's semihosting console is the emulator's standard output: the event log. The emulator's own
            // messages go to ours.
            .stdout(log)
            .stderr(Stdio::inherit())
            .spawn()
            .map(Running)
            .map_err(|error| missing(&error))
    }
}

/// A child process that is killed when this value is dropped.
struct Running(Child);

impl Drop for Running {
    fn drop(&mut self) {
        // Both fail only if it has already ended.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// Waits for the end, or for `enough` frames in `telemetry`, watching it grow; the exit status at the end.
fn wait(
    running: &mut Running,
    telemetry: &Path,
    image: &Path,
    enough: u64,
    progress: &mut dyn FnMut(u64),
) -> Result<Option<ExitStatus>, InputError> {
    let mut length = 0;
    let mut grown = Instant::now();
    loop {
        if let Some(status) = running
            .0
            .try_wait()
            .map_err(|error| InputError::new(EMULATOR, format!("stopped answering ({error})")))?
        {
            return Ok(Some(status));
        }
        let now = fs::metadata(telemetry).map_or(0, |file| file.len());
        if now != length {
            length = now;
            grown = Instant::now();
            let frames = length / TELEMETRY_BYTES as u64;
            progress(frames);
            if frames >= enough {
                return Ok(None);
            }
        } else if grown.elapsed() > TIMEOUT {
            return Err(InputError::new(
                image,
                format!(
                    "has sent nothing for {} s on the emulator",
                    TIMEOUT.as_secs()
                ),
            )
            .expected("an image that runs to the end of its samples"));
        }
        thread::sleep(POLL_INTERVAL);
    }
}

/// The emulator cannot be started.
fn missing(error: &std::io::Error) -> InputError {
    InputError::new(EMULATOR, format!("cannot be started ({error})")).expected(
        "QEMU for Arm to be installed: apt-get install qemu-system-arm (Debian and its relatives)",
    )
}

#[cfg(test)]
mod tests {
    use super::executed;

    #[test]
    fn the_address_of_an_executed_instruction_is_read() {
        let line = "Trace 0: 0x7f2c5c000100 [00000000/08000abc/00000120/ff020201] advance";
        assert_eq!(executed(line), Some(0x0800_0abc));
        assert_eq!(executed("Stopped execution of TB chain before 0x1"), None);
    }
}
