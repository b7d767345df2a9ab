//! Compares the image's telemetry with the host's, and reports the image's cost.
//!
//! It takes an image, its parameter slots and the records that its bank plays, and gives [`OnTarget`], which serialises
//! to `on_target.json`. Equal means equal bytes of every telemetry frame, the same number of frames, and equal health
//! items at the end.

use std::collections::BTreeMap;

use serde::Serialize;
use trueaxis::bank_record::BankRecord;
use trueaxis::health::{HEALTH_ITEMS, item};
use trueaxis::run_report::CostRecord;
use trueaxis::{Parameters, Sample, TELEMETRY_BYTES, TelemetryFrame};

use super::records::records_of;
use super::stack::{self, StackBound};
use super::{Image, SlotImages, TargetCore, emulator, events, host_run};
use rlg_recording::error::InputError;

/// Meaning of the instruction counts.
const COST_MEANING: &str = "instructions executed between entry and exit of the chain, counted by the \
                            emulator; not cycles: it knows no flash wait states, pipeline or cache";

/// Health items that are status bits' counters ([`trueaxis::health`]).
const MISSED: u8 = 16;
const LATE: u8 = 17;
const OVERRUNS: u8 = 22;

/// Least, mean and most \[instructions\].
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Instructions {
    /// Least.
    pub min: u32,
    /// Mean.
    pub mean: f64,
    /// Most.
    pub max: u32,
}

impl Instructions {
    /// Over one record; `None` where it is empty.
    fn over(records: &[&CostRecord]) -> Option<Self> {
        let count: u64 = records.iter().map(|record| u64::from(record.count)).sum();
        let sum: u64 = records.iter().map(|record| record.sum).sum();
        (count > 0).then(|| Self {
            min: records
                .iter()
                .map(|record| record.minimum)
                .min()
                .unwrap_or(0),
            mean: sum as f64 / count as f64,
            max: records
                .iter()
                .map(|record| record.maximum)
                .max()
                .unwrap_or(0),
        })
    }
}

/// The first output that differs.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Difference {
    /// Number of the frame, from 0.
    pub frame: usize,
    /// The frame on the host; absent where it has fewer.
    pub host: Option<String>,
    /// The frame of the image; absent where it has fewer.
    pub image: Option<String>,
}

/// The result of one run, as `on_target.json` holds it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct OnTarget {
    /// Number system.
    pub core: &'static str,
    /// Samples that went through the image's chain.
    pub samples: u32,
    /// Output frames of the image.
    pub frames: u32,
    /// True if the image's chain has accelerometers, by its own health item.
    pub accelerometers: bool,
    /// Output frames of the image whose velocity is not zero.
    pub frames_with_velocity: u32,
    /// Every output and fault counter of the image equals the host's.
    pub bit_equal: bool,
    /// The first difference.
    pub first_difference: Option<Difference>,
    /// The chain's cost over all samples.
    pub instructions_per_sample: Option<Instructions>,
    /// Over samples that complete no output and follow no start or gap.
    pub instructions_between_outputs: Option<Instructions>,
    /// Over samples that complete no output and follow a start or a gap: two for each.
    pub instructions_beginning: Option<Instructions>,
    /// Over samples that complete one.
    pub instructions_with_output: Option<Instructions>,
    /// The processor: the chain, the health around it, the telemetry frame.
    pub instructions_per_processor: Option<Instructions>,
    /// The whole interrupt: bus driver, processor, queue, trace and the measurement itself.
    pub instructions_per_interrupt: Option<Instructions>,
    /// Meaning of an instruction count.
    pub instructions_meaning: &'static str,
    /// Code, constants, initial values.
    pub flash_bytes: u64,
    /// Static variables.
    pub ram_bytes: u64,
    /// The stack's worst case.
    pub stack_bytes: u32,
    /// Method of that bound.
    pub stack_method: &'static str,
    /// Deepest use in this run, found by painting the stack before it: a lower bound, for comparison.
    pub stack_painted_bytes: u32,
    /// Stack that `memory.x` leaves.
    pub stack_available_bytes: u32,
    /// Periods whose interrupt never came.
    pub missed: u32,
    /// Interrupts that came late.
    pub late: u32,
    /// Output frames that found the queue full.
    pub outputs_lost: u32,
    /// Every health item at the end, by its index.
    pub health: BTreeMap<u8, u32>,
    /// Name and version of the emulator.
    pub emulator: String,
    /// Events logged by the image.
    pub events: Vec<String>,
    /// The raw stream of an image that has it.
    #[serde(skip)]
    pub raw: Vec<u8>,
}

/// Runs `image` over `samples` and compares it with the host. `progress` gets the samples done so far.
pub fn compare(
    image: &Image,
    core: TargetCore,
    parameters: &Parameters,
    samples: impl IntoIterator<Item = Sample>,
    progress: &mut dyn FnMut(u64),
) -> Result<OnTarget, InputError> {
    if let Some(kind) = parameters.terms.kinds().first_beyond(image.term_kinds) {
        return Err(
            InputError::new(&image.path, "lacks a term that the parameters ask for")
                .value(kind.name())
                .expected("an image with it: cargo emulator --features terms"),
        );
    }
    let records = records_of(samples);
    compare_records(
        image,
        core,
        &SlotImages::both(parameters),
        &records,
        progress,
    )
}

/// As [`compare`], with the flash and the bank as they are given.
pub fn compare_records(
    image: &Image,
    core: TargetCore,
    slots: &SlotImages,
    records: &[BankRecord],
    progress: &mut dyn FnMut(u64),
) -> Result<OnTarget, InputError> {
    let host = host_run::run(core, slots, records, image.term_kinds).map_err(|error| {
        InputError::new(
            &image.path,
            format!("does not accept these parameters ({error:?})"),
        )
    })?;
    let stack = StackBound::of(&image.elf)
        .map_err(|error| InputError::new(&image.path, error.to_string()))?;
    let samples_per_output = u64::from(slots.load(image.term_kinds).parameters.samples_per_output);
    let emulation = emulator::run(&image.path, slots, records, &mut |frames| {
        progress(frames * samples_per_output)
    })?;
    let events = events::decode(&image.path, &image.elf, &emulation.events)?;
    let report = &emulation.report;
    let first_difference = first_difference(&host.telemetry, &emulation.telemetry);
    let health = |index| report.health_item(index).unwrap_or(u32::MAX);
    Ok(OnTarget {
        core: core.name(),
        samples: report.periods,
        frames: report.frames,
        accelerometers: report
            .health_item(item::CONFIGURATION)
            .is_some_and(|bits| bits & item::WITH_ACCELEROMETERS != 0),
        frames_with_velocity: frames_with_velocity(&emulation.telemetry),
        bit_equal: first_difference.is_none()
            && report.health == host.health
            && report.periods as usize == records.len(),
        first_difference,
        instructions_per_sample: Instructions::over(&[
            &report.between_outputs,
            &report.with_output,
            &report.beginning,
        ]),
        instructions_between_outputs: Instructions::over(&[&report.between_outputs]),
        instructions_beginning: Instructions::over(&[&report.beginning]),
        instructions_with_output: Instructions::over(&[&report.with_output]),
        instructions_per_processor: Instructions::over(&[&report.processor]),
        instructions_per_interrupt: Instructions::over(&[&report.interrupt]),
        instructions_meaning: COST_MEANING,
        flash_bytes: image.flash_bytes,
        ram_bytes: image.ram_bytes,
        stack_bytes: stack.worst_bytes,
        stack_method: stack::METHOD,
        stack_painted_bytes: report.stack_used_bytes,
        stack_available_bytes: stack.available_bytes,
        missed: health(MISSED),
        late: health(LATE),
        outputs_lost: health(OVERRUNS),
        health: HEALTH_ITEMS.into_iter().zip(report.health).collect(),
        emulator: format!(
            "{}, machine netduinoplus2 (STM32F405), -icount shift=0",
            emulator::version()?
        ),
        events,
        raw: emulation.raw,
    })
}

/// The first frame in which two streams differ.
fn first_difference(host: &[u8], image: &[u8]) -> Option<Difference> {
    let frames = host.len().max(image.len()).div_ceil(TELEMETRY_BYTES);
    (0..frames).find_map(|frame| {
        let at = |stream: &[u8]| {
            let begin = (frame * TELEMETRY_BYTES).min(stream.len());
            let end = (begin + TELEMETRY_BYTES).min(stream.len());
            stream[begin..end].to_vec()
        };
        let (host, image) = (at(host), at(image));
        (host != image).then(|| Difference {
            frame,
            host: words(&host),
            image: words(&image),
        })
    })
}

/// Counts the whole frames in `telemetry` that carry a velocity.
fn frames_with_velocity(telemetry: &[u8]) -> u32 {
    let (frames, _) = telemetry.as_chunks::<TELEMETRY_BYTES>();
    frames
        .iter()
        .filter_map(|bytes| TelemetryFrame::from_bytes(bytes).ok())
        .map(|frame| u32::from(frame.output.dvel_codes != [0; 3]))
        .sum()
}

/// A frame in words.
fn words(bytes: &[u8]) -> Option<String> {
    let bytes: &[u8; TELEMETRY_BYTES] = bytes.try_into().ok()?;
    Some(format!("{:?}", TelemetryFrame::from_bytes(bytes)))
}
