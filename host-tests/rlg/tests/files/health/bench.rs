//! A model, the command, and the firmware behind frames whose bytes follow the documented table of version 3.

use std::fs;
use std::path::PathBuf;
use std::process::Output;

use assert_cmd::Command;
use serde_json::Value;
use tempfile::TempDir;
use trueaxis::counter_bank::{AccelerometerInput, BankDecoder};
use trueaxis::{BootReport, F32, Parameters, Processor, Status, Timing};

/// A model of an ideal unit; SHA-256 by coreutils' sha256sum.
pub const MODEL: &str = "format = 1\n[gyro]\npulse_weight_rad = [3.9e-6, 3.9e-6, 3.9e-6]\n";
pub const MODEL_SHA256: &str = "d2c971058cd460783f43f618d4cc777a04115aeb472424ed99c382cd8ff2e0af";

/// Every limit, each of another value.
pub const LIMITS: &str = "format = 1\ntemperature_k = [233.0, 358]\nintensity_least = [0.7, 0.6, 0.5]\n\
    path_length_step = 0.1\ndither_drive = [0.5, 1.5]\ndither_amplitude = [0.6, 1.4]\npulse_silence_s = 1.02\n";

/// A folder with a model and the files of a test.
pub struct Bench(TempDir);

impl Bench {
    pub fn new() -> Self {
        let bench = Self(tempfile::tempdir().expect("a temporary folder"));
        bench.write("model.toml", MODEL);
        bench.write("limits.toml", LIMITS);
        bench
    }

    pub fn at(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    pub fn write(&self, name: &str, content: impl AsRef<[u8]>) {
        fs::write(self.at(name), content).expect("a file");
    }

    /// Runs the command in the folder.
    pub fn run(&self, arguments: &[&str]) -> Output {
        let mut command = Command::cargo_bin("rlg").expect("the command is built");
        let command = command.current_dir(self.0.path()).args(arguments);
        command.output().expect("it runs")
    }

    /// Runs the command with `--json`, and returns its result and its words.
    pub fn json(&self, arguments: &[&str]) -> (Value, String) {
        let output = self.run(&[arguments, &["--json"]].concat());
        let words = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(0), "{words}");
        (serde_json::from_slice(&output.stdout).expect("JSON"), words)
    }

    /// Runs the command, which must refuse in one sentence and leave nothing new.
    pub fn refused(&self, arguments: &[&str]) -> String {
        let names = || -> Vec<_> {
            let entries = fs::read_dir(self.0.path()).expect("a folder");
            let mut names: Vec<_> = entries
                .map(|entry| entry.expect("one").file_name())
                .collect();
            names.sort();
            names
        };
        let before = names();
        let output = self.run(arguments);
        let words = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(2), "{words}");
        assert!(
            words.starts_with("error: ") && words.lines().count() == 1,
            "{words}"
        );
        assert_eq!(names(), before, "something was left behind");
        words
    }

    /// Reads a block as the firmware does.
    pub fn block(&self, name: &str) -> Parameters {
        let bytes = fs::read(self.at(name)).expect("the block");
        Parameters::from_block(&bytes).expect("a block").0
    }
}

/// CRC-16/IBM-3740, bit by bit.
pub fn crc(bytes: &[u8]) -> u16 {
    bytes.iter().fold(0xFFFF, |crc, byte| {
        (0..8).fold(crc ^ u16::from(*byte) << 8, |crc: u16, _| {
            if crc & 0x8000 == 0 {
                crc << 1
            } else {
                crc << 1 ^ 0x1021
            }
        })
    })
}

/// Content of a bank's frame.
#[derive(Debug, Clone, Copy, Default)]
pub struct Frame {
    pub sequence: u16,
    pub counters: [i32; 3],
    pub pickoffs: [i32; 3],
    pub accelerometers: [i32; 3],
    pub channel: u8,
    pub value: i16,
    pub since_pulse: u32,
}

impl Frame {
    /// The 48 bytes of the documented table.
    pub fn bytes(&self) -> [u8; 48] {
        let mut bytes = self.sequence.to_le_bytes().to_vec();
        for word in self
            .counters
            .iter()
            .chain(&self.pickoffs)
            .chain(&self.accelerometers)
        {
            bytes.extend(word.to_le_bytes());
        }
        bytes.push(self.channel);
        bytes.extend(self.value.to_le_bytes());
        bytes.extend(&self.since_pulse.to_le_bytes()[..3]);
        bytes.extend([0; 2]);
        bytes.extend(crc(&bytes).to_le_bytes());
        bytes.try_into().expect("48 bytes")
    }
}

/// The firmware behind a bank whose slow channels take turns.
pub struct Firmware {
    decoder: BankDecoder,
    processor: Processor<F32>,
    frame: Frame,
    /// Codes of channels 0 to 14; `None`: it does not come.
    pub codes: [Option<i16>; 15],
    /// Time since the last pulse [1/16 µs]; it grows by a period of 4 kHz each time.
    pub since_pulse: u32,
}

impl Firmware {
    pub fn new(parameters: &Parameters) -> Self {
        let mut codes = [Some(0); 15];
        codes[0..3].fill(Some(300 * 64));
        codes[3..6].fill(Some(16384));
        codes[12..15].fill(Some(16384));
        Self {
            decoder: BankDecoder::new(AccelerometerInput::Counters),
            processor: Processor::new(parameters, BootReport::default()).expect("in range"),
            frame: Frame::default(),
            codes,
            since_pulse: 0,
        }
    }

    /// Status bits of the service channels over so many periods of 1/4000 s.
    pub fn run(&mut self, periods: u32) -> Status {
        let mut bits = 0;
        for _ in 0..periods {
            let turn = usize::from(self.frame.sequence % 16);
            let code = self.codes.get(turn).copied().flatten();
            self.frame.sequence = self.frame.sequence.wrapping_add(1);
            self.frame.channel = code.map_or(255, |_| turn as u8);
            self.frame.value = code.unwrap_or(0);
            self.since_pulse += 4000;
            self.frame.since_pulse = self.since_pulse.min(0xFF_FFFF);
            let reading = self.decoder.reading(Ok(&self.frame.bytes()), 1);
            let output = self.processor.period(reading, Timing::default());
            bits |= output.map_or(0, |frame| frame.output.status.bits());
        }
        Status::from_bits(bits & SERVICE.bits())
    }
}

/// Bits of the service channels.
const SERVICE: Status = Status::INTENSITY_LOW
    .union(Status::MODE_HOP)
    .union(Status::DITHER_DRIVE)
    .union(Status::TEMPERATURE_RANGE)
    .union(Status::TEMPERATURE_ABSENT)
    .union(Status::PULSE_LOST);
