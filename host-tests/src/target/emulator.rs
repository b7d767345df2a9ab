//! One run of an image in QEMU.
//!
//! Enters: the image, the parameter block and the samples as bytes. Leaves: [`Emulation`]: the bytes the
//! image wrote, its report, and its raw event log. The emulated machine is an STM32F405 (`netduinoplus2`);
//! `-icount shift=0` makes one instruction one nanosecond of its virtual time, so counts repeat exactly.
//!
//! The image reads and writes plain files by semihosting, in a temporary folder that is gone afterwards.

use std::fs;
use std::path::Path;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use trueaxis::run_report::{RunOutcome, RunReport};
use trueaxis::{OutputFrame, Sample};

use crate::error::InputError;

/// The emulator's program.
pub const EMULATOR: &str = "qemu-system-arm";

/// The machine and its clock. `sleep=off`: virtual time does not wait for the wall clock while the
/// processor sleeps.
const MACHINE: [&str; 12] = [
    "-M",
    "netduinoplus2",
    "-icount",
    "shift=0,sleep=off",
    "-display",
    "none",
    "-monitor",
    "none",
    "-serial",
    "none",
    "-nodefaults",
    "-no-reboot",
];

/// An image that has written nothing for this long hangs: it needs under 1 ms of wall time for an output.
const PATIENCE: Duration = Duration::from_secs(60);

/// How often progress is looked at. Short beside a person's patience, long beside a file look-up.
const POLL: Duration = Duration::from_millis(50);

/// What a run left behind.
#[derive(Debug, Clone)]
pub struct Emulation {
    /// Output frames in their byte layout, one after the other.
    pub outputs: Vec<u8>,
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

/// Runs `image` over `samples`. `progress` is called with the number of output frames so far.
pub fn run(
    image: &Path,
    parameter_block: &[u8],
    samples: &[Sample],
    progress: &mut dyn FnMut(u64),
) -> Result<Emulation, InputError> {
    // The emulator works in another folder.
    let image = fs::canonicalize(image)
        .map_err(|error| InputError::new(image, format!("cannot be found ({error})")))?;
    let folder = tempfile::tempdir().map_err(|error| {
        InputError::new(std::env::temp_dir(), format!("cannot hold files ({error})"))
    })?;
    let at = |name: &str| folder.path().join(name);
    let stream: Vec<u8> = samples.iter().flat_map(Sample::to_bytes).collect();
    for (name, content) in [
        ("parameters.bin", parameter_block),
        ("samples.bin", stream.as_slice()),
    ] {
        fs::write(at(name), content)
            .map_err(|error| InputError::new(at(name), format!("cannot be written ({error})")))?;
    }

    let log = fs::File::create(at("events.bin")).map_err(|error| {
        InputError::new(at("events.bin"), format!("cannot be written ({error})"))
    })?;
    let child = Command::new(EMULATOR)
        .current_dir(folder.path())
        .args(MACHINE)
        .args(["-semihosting-config", "enable=on,target=native"])
        .arg("-kernel")
        .arg(&image)
        .stdin(Stdio::null())
        // The image's semihosting console is the emulator's standard output: the event log. What the
        // emulator itself says goes to ours.
        .stdout(log)
        .stderr(Stdio::inherit())
        .spawn()
        .map_err(|error| missing(&error))?;
    let status = wait(Running(child), &at("outputs.bin"), &image, progress)?;

    let report = fs::read(at("report.bin"))
        .ok()
        .and_then(|bytes| RunReport::from_bytes(&bytes))
        .ok_or_else(|| {
            InputError::new(&image, format!("ended without a report ({status})"))
                .expected("an image of this workspace's version that does not panic")
        })?;
    match report.outcome {
        RunOutcome::FileFault => {
            return Err(InputError::new(
                &image,
                "could not use the files of its run",
            ));
        }
        RunOutcome::ParameterFault | RunOutcome::Complete => {}
    }
    Ok(Emulation {
        outputs: fs::read(at("outputs.bin")).unwrap_or_default(),
        report,
        events: fs::read(at("events.bin")).unwrap_or_default(),
    })
}

/// A child that does not outlive this process's interest in it.
struct Running(Child);

impl Drop for Running {
    fn drop(&mut self) {
        // Both fail only where it has already ended.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// Waits for the end, watching `outputs` grow.
fn wait(
    mut running: Running,
    outputs: &Path,
    image: &Path,
    progress: &mut dyn FnMut(u64),
) -> Result<ExitStatus, InputError> {
    let mut length = 0;
    let mut grown = Instant::now();
    loop {
        if let Some(status) = running
            .0
            .try_wait()
            .map_err(|error| InputError::new(EMULATOR, format!("was lost ({error})")))?
        {
            return Ok(status);
        }
        let now = fs::metadata(outputs).map_or(0, |file| file.len());
        if now != length {
            length = now;
            grown = Instant::now();
            progress(length / OutputFrame::BYTES as u64);
        } else if grown.elapsed() > PATIENCE {
            return Err(InputError::new(
                image,
                format!(
                    "has written no output for {} s on the emulator",
                    PATIENCE.as_secs()
                ),
            )
            .expected("an image that runs to the end of its samples"));
        }
        thread::sleep(POLL);
    }
}

/// The emulator cannot be started.
fn missing(error: &std::io::Error) -> InputError {
    InputError::new(EMULATOR, format!("cannot be started ({error})")).expected(
        "QEMU for Arm to be installed: apt-get install qemu-system-arm (Debian and its relatives)",
    )
}
