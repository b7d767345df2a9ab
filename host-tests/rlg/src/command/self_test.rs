//! `rlg self-test`: reads the results of a unit's built-in test, or has it run the whole test.

use std::path::PathBuf;
use std::process::ExitCode;
use std::thread;
use std::time::{Duration, Instant};

use clap::Args;
use serde_json::json;
use trueaxis::SelfTest;
use trueaxis::service_frame::{Answer, Request, RequestKind};

use super::upload::{done, stop};
use crate::error::InputError;
use crate::terminal::Terminal;
use crate::unit_port::UnitPort;

/// Time within which a unit that was asked to test itself must answer again: some 100 ms by its own clock.
const TEST_PATIENCE: Duration = Duration::from_secs(5);

/// Read the results of a unit's built-in test, or have it run the whole test
///
/// At power-on a unit tests RAM, the image in flash and the floating-point unit; in service the image in flash, again and
/// again. With --run a stopped unit does the whole test anew, and starts sampling afterwards; a unit that samples refuses, and
/// --stop stops it first. Exit code 1 if a test has failed.
#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  stty -F /dev/ttyUSB0 1000000 raw -echo\n  rlg self-test --port /dev/ttyUSB0\n  rlg self-test --port /dev/ttyUSB0 --run --stop"
)]
pub struct SelfTestCommand {
    /// Serial device of the unit's telemetry port, set up by stty; or a local socket that leads to it
    #[arg(short, long)]
    port: PathBuf,
    /// Run the whole test
    #[arg(long)]
    run: bool,
    /// With --run: stop a unit that is sampling
    #[arg(long, requires = "run")]
    stop: bool,
}

impl SelfTestCommand {
    /// Asks the unit and prints its results.
    pub fn run(&self, terminal: &Terminal) -> Result<ExitCode, InputError> {
        let mut port = UnitPort::open(&self.port)?;
        let mut answer = self.asked(&mut port)?;
        if self.run {
            if !answer.stopped {
                stop(&self.port, &mut port, self.stop)?;
            }
            let request = Request::new(0, RequestKind::RunSelfTest, 0);
            done(&self.port, port.ask(request, false, None)?)?;
            answer = self.tested(&mut port)?;
            let restart = Request::new(0, RequestKind::Restart, 0);
            done(&self.port, port.ask(restart, false, None)?)?;
        }
        let results = SelfTest::from_word(answer.detail);
        let failed: Vec<&str> = results.failures().collect();
        for (name, is_tested) in [
            ("RAM", results.ram_tested),
            ("flash", results.flash_tested),
            ("floating-point unit", results.float_tested),
        ] {
            let since = if results.commanded {
                "on request"
            } else {
                "at the last start"
            };
            let tested = if is_tested { "tested" } else { "not tested" };
            terminal.say(format!("{name}: {tested} {since}"));
        }
        terminal.say(format!(
            "flash in service: {} passes over the image",
            results.scrub_passes
        ));
        if !failed.is_empty() {
            terminal.warn(format!("failed: {}", failed.join(", ")));
        }
        terminal.result(&json!({
            "failed": failed,
            "ram_tested": results.ram_tested,
            "flash_tested": results.flash_tested,
            "float_tested": results.float_tested,
            "commanded": results.commanded,
            "passes_in_service": results.scrub_passes,
        }))?;
        Ok(ExitCode::from(u8::from(results.has_failed())))
    }

    /// The results as the unit has them now.
    fn asked(&self, port: &mut UnitPort) -> Result<Answer, InputError> {
        let request = Request::new(0, RequestKind::SelfTest, 0);
        done(&self.port, port.ask(request, true, None)?)
    }

    /// The results once the unit has done the test.
    fn tested(&self, port: &mut UnitPort) -> Result<Answer, InputError> {
        let until = Instant::now() + TEST_PATIENCE;
        while Instant::now() < until {
            let answer = self.asked(port)?;
            if SelfTest::from_word(answer.detail).commanded {
                return Ok(answer);
            }
            thread::sleep(Duration::from_millis(50));
        }
        Err(InputError::new(
            &self.port,
            "leads to a unit that has not tested itself",
        ))
    }
}
