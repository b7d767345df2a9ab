//! Sends the raw stream: makes frames of the interrupt's periods and hands them to the port, in batches.
//!
//! It runs in the main loop and never waits. A batch is filled while the one before it is being sent, so the port is busy
//! as long as there is something to send.

use core::sync::atomic::Ordering;

use trueaxis::parameter_slots::Loaded;
use trueaxis::raw_frame::{RAW_BYTES, RawFrame, RawItems};

use super::RawPort;
use super::raw_tap::{DROPPED, RawPeriods, RawQueue, RawTap};

/// Frames of a batch: 1.4 ms on the line, far more than the main loop needs to come round.
pub const BATCH_FRAMES: usize = 8;

/// Bytes of a batch.
pub const BATCH_BYTES: usize = BATCH_FRAMES * RAW_BYTES;

/// Sends raw frames.
pub struct RawLink {
    periods: RawPeriods,
    items: RawItems,
    /// `None` if the clock is too slow for the line: then nothing is sent.
    port: Option<RawPort>,
    batch: [u8; BATCH_BYTES],
    filled: usize,
}

impl RawLink {
    /// Starts with nothing to send; with the interrupt's end of the queue.
    pub fn new(
        queue: &'static mut RawQueue,
        loaded: &Loaded,
        port: Option<RawPort>,
    ) -> (RawTap, Self) {
        let (tap, periods) = queue.split();
        let link = Self {
            periods,
            items: RawItems::new(&loaded.parameters, loaded.generation),
            port,
            batch: [0; BATCH_BYTES],
            filled: 0,
        };
        (RawTap::new(tap), link)
    }

    /// Fills the batch with the periods in the queue, and hands it to the port if that is idle; returns whether there
    /// is more to send.
    pub fn poll(&mut self) -> bool {
        self.items.dropped = DROPPED.load(Ordering::Relaxed);
        let Self {
            periods,
            items,
            batch,
            filled,
            ..
        } = self;
        while let Some(place) = batch
            .get_mut(*filled..)
            .and_then(|rest| rest.first_chunk_mut::<RAW_BYTES>())
        {
            let Some(period) = periods.dequeue() else {
                break;
            };
            let item = items.turn();
            *place = RawFrame { period, item }.to_bytes();
            *filled += RAW_BYTES;
        }
        if self.filled == 0 {
            return false;
        }
        let Some(port) = &mut self.port else {
            self.filled = 0;
            return false;
        };
        if port.send(self.batch.get(..self.filled).unwrap_or_default()) {
            self.filled = 0;
        }
        self.filled > 0
    }
}
