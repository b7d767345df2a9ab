//! The main loop: feeds the sampling interrupt from a file and writes away what it produced.
//!
//! Enters and leaves: the files of [`super`]. The interrupt must never wait for the host: samples are read
//! ahead in blocks into one queue, frames leave through another, and a period without a sample, a late
//! period or a frame without room is counted and reported. Virtual time stands still during a semihosting
//! call, so under emulation all three counts are 0.
//!
//! The loop sleeps between interrupts; a busy loop would cost the emulator 250 000 instructions a sample.

use core::sync::atomic::Ordering;

use cortex_m_rt::entry;
use defmt_semihosting as _;
use heapless::spsc::{Consumer, Producer, Queue};
use semihosting::fs::File;
use semihosting::io::{self, Read, Write};
use stm32f4::stm32f405::Peripherals;
use trueaxis::run_report::{RunOutcome, RunReport};
use trueaxis::{BlockError, Chain, ChainState, NumberSystem, OutputFrame, Parameters, Sample};
use trueaxis::{PARAMETER_BLOCK_BYTES, Status};

use super::clock::{self, Oscillator};
use super::instruction_counter::InstructionCounter;
use super::sample_timer::SampleTimer;
use super::sampling::{
    Counters, FIRST_FAULT_SAMPLE, FIRST_FAULT_STAGES, OUTPUT_QUEUE, QueuedSamples, RUN_DONE,
    SAMPLE_QUEUE, SAMPLES_DONE, SAMPLING, Sampling,
};
use super::stack;
use crate::Core;

/// Samples read from the host at a time: enough that the host call is rare, few enough that the sample
/// queue holds two blocks, so that one can be filled while the other is used, and the output queue the
/// frames of one even if every sample completes one.
const BLOCK_SAMPLES: usize = 120;

const _: () = assert!(SAMPLE_QUEUE > 2 * BLOCK_SAMPLES && OUTPUT_QUEUE > BLOCK_SAMPLES);

defmt::timestamp!("sample {=u32}", SAMPLES_DONE.load(Ordering::Relaxed));

#[entry]
fn main() -> ! {
    // `entry` makes these references that live for ever, and runs once.
    static mut SAMPLES: Queue<Sample, SAMPLE_QUEUE> = Queue::new();
    static mut OUTPUTS: Queue<OutputFrame, OUTPUT_QUEUE> = Queue::new();

    let report = match run(SAMPLES.split(), OUTPUTS.split()) {
        Ok(report) => report,
        Err(error) => {
            defmt::error!(
                "file of the run: error {=i32}",
                error.raw_os_error().unwrap_or(0)
            );
            RunReport::empty(RunOutcome::FileFault)
        }
    };
    let written = File::create(c"report.bin").and_then(|mut f| f.write_all(&report.to_bytes()));
    semihosting::process::exit(match (report.outcome, written) {
        (RunOutcome::Complete, Ok(())) => 0,
        _ => 1,
    })
}

/// The filling and the emptying end of a queue.
type Ends<T> = (Producer<'static, T>, Consumer<'static, T>);

/// The run from reset to the last frame.
fn run(
    (mut samples, sample_queue): Ends<Sample>,
    (output_queue, mut outputs): Ends<OutputFrame>,
) -> io::Result<RunReport> {
    let Some(peripherals) = Peripherals::take() else {
        return Ok(RunReport::empty(RunOutcome::FileFault));
    };
    let oscillator = clock::start(&peripherals.RCC);
    defmt::info!(
        "boot: core {=str}, external oscillator {=bool}",
        <Core as NumberSystem>::NAME,
        oscillator == Oscillator::External
    );

    let chain = match read_chain()? {
        Ok(chain) => chain,
        Err(fault) => {
            defmt::error!("parameter block refused: {}", fault);
            return Ok(RunReport::empty(RunOutcome::ParameterFault));
        }
    };

    let mut input = File::open(c"samples.bin")?;
    let mut output = File::create(c"outputs.bin")?;
    let total = (input.metadata()?.len() / Sample::BYTES as u64) as u32;

    read_ahead(&mut input, &mut samples)?;

    if total > 0 {
        let sampling = Sampling {
            source: QueuedSamples {
                queue: sample_queue,
            },
            chain,
            state: ChainState::default(),
            outputs: output_queue,
            timer: SampleTimer::new(peripherals.TIM2, &peripherals.RCC),
            counter: InstructionCounter::start(peripherals.TIM5, &peripherals.RCC),
            remaining: total,
            counters: Counters::ZERO,
        };
        sampling.timer.start();
        SAMPLING.lend(sampling);
    }
    let mut frames = 0;
    let mut first_fault_logged = false;
    while total > 0 && !RUN_DONE.load(Ordering::Acquire) {
        // Test and sleep with interrupts held: the last one, after which none comes, must not slip in
        // between. A held interrupt still ends the sleep.
        cortex_m::interrupt::free(|_| {
            if !RUN_DONE.load(Ordering::Acquire) {
                cortex_m::asm::wfi();
            }
        });
        read_ahead(&mut input, &mut samples)?;
        frames += write_away(&mut output, &mut outputs)?;
        first_fault_logged |= !first_fault_logged && log_first_fault();
    }
    frames += write_away(&mut output, &mut outputs)?;
    if !first_fault_logged {
        log_first_fault();
    }

    let mut report = RunReport::empty(RunOutcome::Complete);
    if let Some(sampling) = SAMPLING.take_back() {
        let counters = &sampling.counters;
        report.faults = *sampling.state.faults();
        report.between_outputs = counters.between_outputs;
        report.with_output = counters.with_output;
        report.interrupt = counters.interrupt;
        report.starved = counters.starved;
        report.source_faults = counters.source_faults;
        report.late = counters.late;
        report.outputs_lost = counters.outputs_lost;
        report.reading_overhead = sampling.counter.reading_overhead();
    }
    report.clock_fallback = u16::from(oscillator == Oscillator::InternalFallback);
    report.samples = SAMPLES_DONE.load(Ordering::Relaxed);
    report.frames = frames;
    report.stack_used_bytes = stack::used_bytes();
    report.stack_size_bytes = stack::size_bytes();
    defmt::info!(
        "end of stream: {=u32} samples, {=u32} frames, {=u32} starved, {=u32} late, {=u32} lost",
        report.samples,
        report.frames,
        report.starved,
        report.late,
        report.outputs_lost
    );
    Ok(report)
}

/// The chain that `parameters.bin` describes, or why the block is refused.
fn read_chain() -> io::Result<Result<Chain<Core>, BlockError>> {
    let mut block = [0; PARAMETER_BLOCK_BYTES];
    let length = read_up_to(&mut File::open(c"parameters.bin")?, &mut block)?;
    Ok(Parameters::from_block(block.get(..length).unwrap_or(&[]))
        .and_then(|(parameters, _)| Chain::new(&parameters).map_err(BlockError::Parameter)))
}

/// Fills the queue from the file, whole blocks at a time, while there is room for one.
fn read_ahead(input: &mut File, queue: &mut Producer<'static, Sample>) -> io::Result<()> {
    while queue.capacity() - queue.len() >= BLOCK_SAMPLES {
        let mut block = [0; BLOCK_SAMPLES * Sample::BYTES];
        let length = read_up_to(input, &mut block)?;
        for bytes in block[..length].as_chunks().0 {
            // There is room: it was counted above, and only this end fills the queue.
            let _ = queue.enqueue(Sample::from_bytes(bytes));
        }
        if length < block.len() {
            break;
        }
    }
    Ok(())
}

/// Writes every queued frame to the file, and says how many there were.
fn write_away(output: &mut File, queue: &mut Consumer<'static, OutputFrame>) -> io::Result<u32> {
    let mut written = 0;
    while let Some(frame) = queue.dequeue() {
        output.write_all(&frame.to_bytes())?;
        written += 1;
    }
    Ok(written)
}

/// Logs the chain's first fault if there is one by now.
fn log_first_fault() -> bool {
    let stages = Status::from_bits(FIRST_FAULT_STAGES.load(Ordering::Acquire));
    let found = stages != Status::default();
    if found {
        defmt::warn!(
            "first fault: {}, at sample {=u32}",
            stages,
            FIRST_FAULT_SAMPLE.load(Ordering::Relaxed)
        );
    }
    found
}

/// Reads until `buffer` is full or the file ends; the bytes read.
fn read_up_to(input: &mut File, buffer: &mut [u8]) -> io::Result<usize> {
    let mut length = 0;
    while length < buffer.len() {
        match input.read(&mut buffer[length..])? {
            0 => break,
            more => length += more,
        }
    }
    Ok(length)
}
