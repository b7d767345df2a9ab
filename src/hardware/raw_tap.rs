//! Hands the chain's input to the raw stream: from the sampling interrupt to the main loop, a period each.
//!
//! It never waits. If the main loop has not made room, the whole period is dropped and counted in [`DROPPED`]. Only
//! images with the feature `raw` have it; in others it costs the interrupt nothing.

use core::hint::assert_unchecked;
use core::sync::atomic::{AtomicU32, Ordering};

use heapless::spsc::{Consumer, Producer, Queue};
use trueaxis::processor::Timing;
use trueaxis::raw_period::{RawCounters, RawPeriod};
use trueaxis::sample_source::Reading;

/// Slots of the queue, one of which stays empty: 63 periods, 16 ms at 4 kHz, for a main loop that is held up by an event
/// log. A power of two, because the queue divides by it at every step.
const QUEUE: usize = 64;

/// Queue of periods from the interrupt to the main loop.
pub type RawQueue = Queue<RawPeriod, QUEUE>;

/// The main loop's end of it.
pub type RawPeriods = Consumer<'static, RawPeriod>;

/// Periods that found no room so far.
pub static DROPPED: AtomicU32 = AtomicU32::new(0);

/// The interrupt's end of the queue.
pub struct RawTap {
    counters: RawCounters,
    queue: Producer<'static, RawPeriod>,
}

impl RawTap {
    /// Starts with nothing counted.
    pub fn new(queue: Producer<'static, RawPeriod>) -> Self {
        Self {
            counters: RawCounters::NONE,
            queue,
        }
    }

    /// Takes one period in; `number`: sampling periods since start, this one included.
    #[inline]
    pub fn record(&mut self, number: u32, reading: &Reading, timing: Timing) {
        let period = self.counters.period(number, reading, timing);
        // As in `super::sampling`: else the compiler needs a division, and the panic of one by zero.
        // SAFETY: the queue has QUEUE slots, and a queue's length never changes.
        unsafe { assert_unchecked(self.queue.capacity() == QUEUE - 1) };
        if self.queue.enqueue(period).is_err() {
            let dropped = DROPPED.load(Ordering::Relaxed);
            DROPPED.store(dropped.saturating_add(1), Ordering::Relaxed);
        }
    }
}
