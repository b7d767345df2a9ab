//! Sends frames from the queue to the serial port, a byte at a time.
//!
//! It takes telemetry frames from the interrupt's queue and writes their bytes to USART1. It never waits, so the main
//! loop stays free for the watchdog and the event log; a frame is encoded here and not in the interrupt. At 1 Mbaud a
//! frame of 43 bytes takes 430 µs, so the line is full at 2 300 frames a second.

use heapless::spsc::Consumer;
use trueaxis::{TELEMETRY_BYTES, TelemetryFrame};

use super::serial::Serial;

/// Sends telemetry frames to the serial port.
pub struct Link {
    frames: Consumer<'static, TelemetryFrame>,
    serial: Serial,
    bytes: [u8; TELEMETRY_BYTES],
    /// Bytes of the present frame that have been sent; [`TELEMETRY_BYTES`] while there is no frame.
    sent: usize,
    frames_sent: u32,
}

impl Link {
    /// Starts with nothing to send.
    pub fn new(frames: Consumer<'static, TelemetryFrame>, serial: Serial) -> Self {
        Self {
            frames,
            serial,
            bytes: [0; TELEMETRY_BYTES],
            sent: TELEMETRY_BYTES,
            frames_sent: 0,
        }
    }

    /// Sends the bytes that the transmitter takes now; returns whether there is more to send.
    pub fn poll(&mut self) -> bool {
        loop {
            let Some(byte) = self.bytes.get(self.sent) else {
                let Some(frame) = self.frames.dequeue() else {
                    return false;
                };
                self.bytes = frame.to_bytes();
                self.sent = 0;
                self.frames_sent = self.frames_sent.wrapping_add(1);
                continue;
            };
            if !self.serial.send(*byte) {
                return true;
            }
            self.sent += 1;
        }
    }

    /// Number of frames begun so far.
    #[cfg(feature = "emulator")]
    pub fn frames_sent(&self) -> u32 {
        self.frames_sent
    }
}
