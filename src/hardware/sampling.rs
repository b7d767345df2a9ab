//! The sampling interrupt: source → chain → queue, once a period.
//!
//! Enters: samples from a [`SampleSource`]. Leaves: output frames in a queue, costs and fault counts in
//! [`Counters`]. Everything it works on belongs to the interrupt alone while the interrupt is enabled, and
//! to the main loop before and after; [`SAMPLING`] is where the two hand it over.

use core::cell::UnsafeCell;
use core::hint::assert_unchecked;
use core::sync::atomic::{AtomicBool, AtomicU32, Ordering, compiler_fence};

use heapless::spsc::{Consumer, Producer};
use stm32f4::stm32f405::{NVIC, interrupt};
use trueaxis::run_report::CostRecord;
use trueaxis::sample_source::{Reading, SampleSource, SourceFault};
use trueaxis::{Chain, ChainState, OutputFrame, Sample};

use super::instruction_counter::InstructionCounter;
use super::sample_timer::SampleTimer;
use crate::Core;

/// Samples that have gone through the chain: the time base of the event log.
pub static SAMPLES_DONE: AtomicU32 = AtomicU32::new(0);

/// The chain's first fault, for the event log: its stages as [`Status`](trueaxis::Status) bits, 0 while
/// there is none; looked at whenever a frame is complete.
pub static FIRST_FAULT_STAGES: AtomicU32 = AtomicU32::new(0);

/// The sample of the first fault.
pub static FIRST_FAULT_SAMPLE: AtomicU32 = AtomicU32::new(0);

/// Set by the interrupt when the last sample of the run is through and the timer is stopped.
pub static RUN_DONE: AtomicBool = AtomicBool::new(false);

/// Slots of the queue of samples, one of which stays empty. A power of two, because the queue divides by
/// it at every step.
pub const SAMPLE_QUEUE: usize = 256;

/// Slots of the queue of frames; as above.
pub const OUTPUT_QUEUE: usize = 128;

/// Samples that the main loop has read ahead.
pub struct QueuedSamples {
    /// The reading end of the queue.
    pub queue: Consumer<'static, Sample>,
}

impl SampleSource for QueuedSamples {
    #[inline]
    fn take(&mut self) -> Reading {
        // The queue's end knows its length only at run time; told it, the compiler needs neither a
        // division nor the panic of a division by zero.
        // SAFETY: `run` splits a queue of SAMPLE_QUEUE slots, and a queue's length never changes.
        unsafe { assert_unchecked(self.queue.capacity() == SAMPLE_QUEUE - 1) };
        let sample = self.queue.dequeue();
        Reading {
            periods: u32::from(sample.is_some()),
            fault: match sample {
                Some(_) => None,
                None => Some(SourceFault::Starved),
            },
            sample,
        }
    }
}

/// What the interrupt counts.
pub struct Counters {
    /// The chain's cost for samples without an output frame.
    pub between_outputs: CostRecord,
    /// The chain's cost for samples with one.
    pub with_output: CostRecord,
    /// Cost of the whole body.
    pub interrupt: CostRecord,
    /// Periods without a sample.
    pub starved: u32,
    /// Other faults of the source.
    pub source_faults: u32,
    /// Periods that ended before the interrupt had returned.
    pub late: u32,
    /// Frames for which the queue had no room.
    pub outputs_lost: u32,
}

impl Counters {
    /// Nothing counted yet.
    pub const ZERO: Self = Self {
        between_outputs: CostRecord::EMPTY,
        with_output: CostRecord::EMPTY,
        interrupt: CostRecord::EMPTY,
        starved: 0,
        source_faults: 0,
        late: 0,
        outputs_lost: 0,
    };
}

/// Everything the interrupt works on.
pub struct Sampling<Source> {
    /// Where samples come from.
    pub source: Source,
    /// The chain's configuration, checked.
    pub chain: Chain<Core>,
    /// The chain's state.
    pub state: ChainState<Core>,
    /// Where frames go.
    pub outputs: Producer<'static, OutputFrame>,
    /// The timer that brings the interrupt.
    pub timer: SampleTimer,
    /// The counter of instructions.
    pub counter: InstructionCounter,
    /// Samples still to come in this run.
    pub remaining: u32,
    /// What happened so far.
    pub counters: Counters,
}

impl<Source: SampleSource> Sampling<Source> {
    /// One period.
    #[inline]
    fn tick(&mut self) {
        let entry = self.counter.now();
        self.timer.acknowledge();
        let reading = self.source.take();
        match reading.fault {
            None => {}
            Some(SourceFault::Starved) => {
                self.counters.starved = self.counters.starved.saturating_add(1);
            }
            Some(_) => {
                self.counters.source_faults = self.counters.source_faults.saturating_add(1);
            }
        }
        if let Some(sample) = reading.sample {
            let before = self.counter.now();
            let frame = advance(&self.chain, &mut self.state, &sample);
            let after = self.counter.now();
            let cost = self.counter.between(before, after);
            if let Some(frame) = frame {
                self.counters.with_output.record(cost);
                let first = self.state.faults().first;
                FIRST_FAULT_SAMPLE.store(first.sample, Ordering::Relaxed);
                FIRST_FAULT_STAGES.store(first.stages.bits(), Ordering::Release);
                // SAFETY: as for the samples, with OUTPUT_QUEUE.
                unsafe { assert_unchecked(self.outputs.capacity() == OUTPUT_QUEUE - 1) };
                if self.outputs.enqueue(frame).is_err() {
                    self.counters.outputs_lost = self.counters.outputs_lost.saturating_add(1);
                }
            } else {
                self.counters.between_outputs.record(cost);
            }
            SAMPLES_DONE.store(
                SAMPLES_DONE.load(Ordering::Relaxed).wrapping_add(1),
                Ordering::Relaxed,
            );
            self.remaining = self.remaining.saturating_sub(1);
        }
        let exit = self.counter.now();
        self.counters
            .interrupt
            .record(self.counter.between(entry, exit));
        if self.timer.is_pending() {
            self.counters.late = self.counters.late.saturating_add(1);
        }
        if self.remaining == 0 {
            self.timer.stop();
            RUN_DONE.store(true, Ordering::Release);
        }
    }
}

/// The chain, as one function of the image: the call is a border that the measured code cannot leave, and
/// its symbol is where a disassembly of the chain begins.
#[inline(never)]
fn advance(
    chain: &Chain<Core>,
    state: &mut ChainState<Core>,
    sample: &Sample,
) -> Option<OutputFrame> {
    chain.process(state, sample)
}

/// A place that belongs to the TIM2 interrupt while that is unmasked, and to the main loop otherwise.
pub struct Handover<T>(UnsafeCell<Option<T>>);

// SAFETY: one core; `lend` and `take_back` change the owner only while the interrupt is masked.
unsafe impl<T: Send> Sync for Handover<T> {}

impl<T> Handover<T> {
    /// Puts `value` in and unmasks the interrupt: from here it belongs to the interrupt.
    pub fn lend(&self, value: T) {
        NVIC::mask(interrupt::TIM2);
        wait_for_mask();
        // SAFETY: the interrupt, the only other user, is masked.
        unsafe { *self.0.get() = Some(value) };
        // The value must be in its place before the interrupt may come: for the compiler, which may move
        // the plain store past a register's volatile one, and for the processor.
        compiler_fence(Ordering::SeqCst);
        cortex_m::asm::dmb();
        // SAFETY: nothing holds a critical section that relies on this interrupt being masked.
        unsafe { NVIC::unmask(interrupt::TIM2) };
    }

    /// Masks the interrupt and takes the value out.
    pub fn take_back(&self) -> Option<T> {
        NVIC::mask(interrupt::TIM2);
        wait_for_mask();
        // SAFETY: the interrupt, the only other user, is masked.
        unsafe { (*self.0.get()).take() }
    }
}

/// The barriers of the architecture's reference manual (B3.5.3): no TIM2 entry after this point, and no
/// access of what follows, nor the compiler's move of one, before it.
fn wait_for_mask() {
    cortex_m::asm::dsb();
    cortex_m::asm::isb();
    compiler_fence(Ordering::SeqCst);
}

/// The interrupt's belongings.
pub static SAMPLING: Handover<Sampling<QueuedSamples>> = Handover(UnsafeCell::new(None));

/// Deadline contract: entered at the end of each sample period; must return before the next one ends,
/// 250 µs later, or the period is counted as late. It takes one sample, runs the chain once and queues at
/// most one frame. It never waits, allocates, logs or formats, calls nothing that can panic, and its cost
/// does not depend on data; the worst cost is in `report.bin`, in instructions.
#[interrupt]
fn TIM2() {
    // SAFETY: inside the interrupt the value belongs to it; it does not nest in itself.
    if let Some(sampling) = unsafe { &mut *SAMPLING.0.get() } {
        sampling.tick();
    }
}
