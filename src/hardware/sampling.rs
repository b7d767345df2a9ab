//! Serves the sampling interrupt: bank → processor → queue, once a period.
//!
//! It reads the counter bank's frames from an `SpiDevice` and the time from the [`SampleTimer`]. It puts telemetry
//! frames into a queue, one entry a period into the trace ring [`TRACE`], and the main loop's values into [`Watch`].
//! Everything it works on belongs to the interrupt alone once [`SAMPLING`] has been lent to it.
//!
//! The same code serves the board and the emulator; only the `SpiDevice` differs.

use core::cell::UnsafeCell;
use core::hint::assert_unchecked;
use core::sync::atomic::{AtomicI32, AtomicU32, Ordering};

use embedded_hal::spi::SpiDevice;
use heapless::spsc::Producer;
use stm32f4::stm32f405::interrupt;
use trueaxis::bank_bus::CounterBank;
use trueaxis::processor::{CostProbe, Processor, SampleClass, Timing};
use trueaxis::run_report::CostRecord;
use trueaxis::sample_source::{Reading, SampleSource};
use trueaxis::trace::{TraceEntry, TraceRing};
use trueaxis::{Status, TelemetryFrame};

use super::Spi;
use super::handover::Handover;
#[cfg(feature = "raw")]
use super::raw_tap::RawTap;
use super::sample_timer::SampleTimer;
#[cfg(feature = "terms")]
use super::slow_link::{MAILBOX, UPDATE_QUEUE, Updates};
use crate::{Core, Terms};

/// Slots of the queue of frames, one of which stays empty: 15 frames, 37 ms at 400 Hz, for a main loop that
/// is held up by an event log. A power of two, because the queue divides by it at every step.
pub const FRAME_QUEUE: usize = 16;

/// Entries of the trace ring: 32 ms before the first fault and 32 ms after it, in 13 KiB.
const TRACE_ENTRIES: usize = 256;

/// The last samples before and after the first fault; see [`trueaxis::trace`] for how a debugger reads it.
/// The name stands in the image as it is.
#[unsafe(no_mangle)]
static TRACE: Trace = Trace(UnsafeCell::new(TraceRing::blank()));

/// The trace ring in a static; the interrupt alone writes it.
#[repr(transparent)]
struct Trace(UnsafeCell<TraceRing<TRACE_ENTRIES>>);

// SAFETY: only the interrupt touches it, and that does not nest; before it, `Sampling::new` with interrupts held.
unsafe impl Sync for Trace {}

/// Values of the interrupt that the main loop watches. Each field is a single word and thus always whole, but fields
/// may be a
/// period apart.
pub struct Watch {
    /// Interrupts served so far, wrapping.
    pub served: AtomicU32,
    /// Pickoff codes of the last sample.
    pub pickoff_codes: [AtomicI32; 3],
    /// The first fault in service: status bits, 0 without one.
    pub first_fault: AtomicU32,
    /// Sampling period of the first fault.
    pub first_fault_period: AtomicU32,
    /// Longest interrupt so far \[ticks of TIM5\].
    pub longest: AtomicU32,
}

/// Values that the main loop watches. The interrupt writes them here; the main loop reads them in [`super::background`].
pub static WATCH: Watch = Watch {
    served: AtomicU32::new(0),
    pickoff_codes: [const { AtomicI32::new(0) }; 3],
    first_fault: AtomicU32::new(0),
    first_fault_period: AtomicU32::new(0),
    longest: AtomicU32::new(0),
};

/// All data of the interrupt. In memory in the order of declaration (`repr(C)`), so that the processor lies within
/// reach of one base address, as [`Chain`](trueaxis::Chain) needs it.
#[repr(C)]
pub struct Sampling<Spi> {
    /// The chain with its health.
    pub processor: Processor<Core, Terms>,
    /// The counter bank that samples come from.
    pub bank: CounterBank<Spi>,
    /// The queue that frames go to.
    pub frames: Producer<'static, TelemetryFrame>,
    /// The timer that brings the interrupt.
    pub timer: SampleTimer,
    /// Cost of each part so far.
    pub costs: Costs,
    /// Corrections by temperature, prepared by the main loop.
    #[cfg(feature = "terms")]
    pub updates: Updates,
    /// The interrupt's end of the raw stream.
    #[cfg(feature = "raw")]
    pub raw: RawTap,
}

/// Costs so far \[ticks of TIM5\]: 84 MHz on the board, instructions in the emulator.
pub struct Costs {
    /// The chain alone, for samples that complete no output.
    pub chain_between_outputs: CostRecord,
    /// The chain alone, for samples that complete one.
    pub chain_with_output: CostRecord,
    /// The chain alone, for samples that complete none and follow a start or a gap.
    pub chain_beginning: CostRecord,
    /// The processor: the chain, the health around it, the frame; and the measuring of the chain.
    pub processor: CostRecord,
    /// The whole interrupt: bus, processor, queue, trace.
    pub interrupt: CostRecord,
}

impl Costs {
    /// Nothing measured yet.
    const NONE: Self = Self {
        chain_between_outputs: CostRecord::EMPTY,
        chain_with_output: CostRecord::EMPTY,
        chain_beginning: CostRecord::EMPTY,
        processor: CostRecord::EMPTY,
        interrupt: CostRecord::EMPTY,
    };
}

/// Measures the chain within the processor.
struct Stopwatch<'a> {
    timer: &'a SampleTimer,
    costs: &'a mut Costs,
    begun: u32,
}

impl CostProbe for Stopwatch<'_> {
    #[inline(always)]
    fn begin(&mut self) {
        self.begun = self.timer.now();
    }

    #[inline(always)]
    fn end(&mut self, class: SampleClass) {
        let cost = self.timer.between(self.begun, self.timer.now());
        match class {
            SampleClass::BetweenOutputs => self.costs.chain_between_outputs.record(cost),
            SampleClass::WithOutput => self.costs.chain_with_output.record(cost),
            SampleClass::Beginning => self.costs.chain_beginning.record(cost),
        }
    }
}

impl<Spi: SpiDevice> Sampling<Spi> {
    /// Starts with nothing measured and an empty trace.
    pub fn new(
        bank: CounterBank<Spi>,
        processor: Processor<Core, Terms>,
        frames: Producer<'static, TelemetryFrame>,
        timer: SampleTimer,
        #[cfg(feature = "terms")] updates: Updates,
        #[cfg(feature = "raw")] raw: RawTap,
    ) -> Self {
        cortex_m::interrupt::free(|_| {
            // SAFETY: the interrupt, the only other user, does not come meanwhile.
            unsafe { &mut *TRACE.0.get() }.start();
        });
        Self {
            bank,
            processor,
            frames,
            timer,
            costs: Costs::NONE,
            #[cfg(feature = "terms")]
            updates,
            #[cfg(feature = "raw")]
            raw,
        }
    }

    /// Serves one sampling period.
    #[inline]
    fn serve_period(&mut self, trace: &mut TraceRing<TRACE_ENTRIES>) {
        let entry = self.timer.now();
        let timing = self.timer.enter();
        let reading = self.bank.take(timing.missed.saturating_add(1));

        let before = self.timer.now();
        let mut probe = Stopwatch {
            timer: &self.timer,
            costs: &mut self.costs,
            begun: before,
        };
        let frame = advance(&mut self.processor, reading, timing, &mut probe);
        let cost = self.timer.between(before, self.timer.now());
        self.costs.processor.record(cost);

        if let Some(frame) = frame {
            // The queue's end knows its length only at run time; with it, the compiler needs neither a division nor the
            // panic of a division by zero. SAFETY: the queue has FRAME_QUEUE slots, and a queue's length never changes.
            unsafe { assert_unchecked(self.frames.capacity() == FRAME_QUEUE - 1) };
            if self.frames.enqueue(frame).is_err() {
                self.processor.output_overrun();
            }
        }
        self.publish(trace, reading, cost);
        #[cfg(feature = "terms")]
        self.exchange_slow(&reading);
        #[cfg(feature = "raw")]
        self.raw.record(self.processor.periods(), &reading, timing);

        let exit = self.timer.now();
        let interrupt = &mut self.costs.interrupt;
        interrupt.record(self.timer.between(entry, exit));
        WATCH.longest.store(interrupt.maximum, Ordering::Relaxed);
    }

    /// Puts the slow channel into the mailbox, and takes corrections that are ready.
    #[cfg(feature = "terms")]
    #[inline]
    fn exchange_slow(&mut self, reading: &Reading) {
        MAILBOX.put(reading.service);
        // SAFETY: the queue has UPDATE_QUEUE slots, and a queue's length never changes; as of the frames.
        unsafe { assert_unchecked(self.updates.capacity() == UPDATE_QUEUE - 1) };
        // Read in its place: an update is hundreds of bytes, which the interrupt's stack need not hold.
        if let Some(update) = self.updates.peek() {
            self.processor.take_slow(update);
            let _ = self.updates.dequeue();
        }
    }

    /// Records this period for the debugger and the main loop.
    #[inline]
    fn publish(&self, trace: &mut TraceRing<TRACE_ENTRIES>, reading: Reading, cost: u32) {
        let served = WATCH.served.load(Ordering::Relaxed);
        let status: Status = self.processor.period_status();
        let entry = TraceEntry::new(served, status, cost, reading.sample);
        trace.record(entry, self.processor.has_latched_fault());
        if let Some(sample) = reading.sample {
            for (shown, code) in WATCH.pickoff_codes.iter().zip(sample.pickoff_codes) {
                shown.store(code, Ordering::Relaxed);
            }
        }
        let first = self.processor.health().first;
        WATCH
            .first_fault_period
            .store(first.sample, Ordering::Relaxed);
        WATCH
            .first_fault
            .store(first.stages.bits(), Ordering::Release);
        WATCH
            .served
            .store(served.wrapping_add(1), Ordering::Release);
    }
}

/// Runs the processor for one period. It is one function of the image: measured code cannot be moved out of the call,
/// and a disassembly of the chain begins at its symbol.
#[inline(never)]
fn advance(
    processor: &mut Processor<Core, Terms>,
    reading: Reading,
    timing: Timing,
    probe: &mut Stopwatch<'_>,
) -> Option<TelemetryFrame> {
    processor.period_probed(reading, timing, probe)
}

/// The value of the sampling interrupt: lent to it while it is unmasked.
pub static SAMPLING: Handover<Sampling<Spi>> = Handover::empty();

/// Deadline contract: requested at the end of each sample period, at the highest priority; must return before the next
/// one ends, 250 µs later, or the next is counted as late, or as missed. It reads one frame of the bank over a bus
/// whose every wait is bounded, runs the chain once and queues at most one frame. It allocates nothing, logs nothing,
/// calls nothing that can panic, and its cost does not depend on data while no fault occurs. Its cost is in [`WATCH`]
/// and in the trace, in ticks of TIM5: 84 MHz on the board, instructions in the emulator.
#[interrupt]
fn TIM2() {
    // SAFETY: this is the interrupt, it does not nest in itself, and both references end with it.
    let (sampling, trace) = unsafe { (&mut *SAMPLING.place(), &mut *TRACE.0.get()) };
    if let Some(sampling) = sampling {
        sampling.serve_period(trace);
    }
}
