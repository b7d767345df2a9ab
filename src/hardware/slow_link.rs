//! Takes the bank's temperatures to the terms: interrupt → mailbox → main loop → queue → interrupt.
//!
//! The main loop prepares the terms' corrections once a second, which costs as much as some samples; the interrupt takes
//! them by a copy. Neither waits for the other and nothing is masked.

use heapless::spsc::{Consumer, Producer, Queue};
use trueaxis::{Parameters, SlowFilter, SlowMailbox, SlowTerms, SlowUpdate};

use super::boot::Checked;
use crate::{Core, Terms};

/// The bank's slow channels: the interrupt puts, the main loop reads.
pub static MAILBOX: SlowMailbox = SlowMailbox::new();

/// Slots of the queue of updates, one of which stays empty.
pub const UPDATE_QUEUE: usize = 2;

/// The queue of updates.
pub type UpdateQueue = Queue<SlowUpdate<Core, Terms>, UPDATE_QUEUE>;

/// The interrupt's end of it.
pub type Updates = Consumer<'static, SlowUpdate<Core, Terms>>;

/// The main loop's part.
pub struct SlowLink {
    terms: SlowTerms<Core, Terms>,
    filter: SlowFilter,
    updates: Producer<'static, SlowUpdate<Core, Terms>>,
    periods_a_second: u32,
    prepared: u32,
}

impl SlowLink {
    /// Starts before the first temperature; with the interrupt's end of the queue.
    pub fn new(
        queue: &'static mut UpdateQueue,
        checked: &Checked,
        parameters: &Parameters,
    ) -> (Updates, Self) {
        let (updates, taken) = queue.split();
        let link = Self {
            terms: SlowTerms::new(checked.0),
            filter: SlowFilter::new(),
            updates,
            periods_a_second: parameters.sample_rate_hz as u32,
            prepared: 0,
        };
        (taken, link)
    }

    /// Prepares an update once a second, after `served` interrupts, once there are temperatures.
    pub fn poll(&mut self, served: u32) {
        if served.wrapping_sub(self.prepared) < self.periods_a_second {
            return;
        }
        self.prepared = served;
        let temperature_k = MAILBOX.temperature_k();
        if temperature_k.iter().any(|kelvin| kelvin.is_finite()) {
            let readings = self.filter.readings(temperature_k, 1.0);
            // The interrupt has long taken the one before; were it not so, the next second brings another.
            let _ = self.updates.enqueue(self.terms.prepare(&readings));
        }
    }
}
