//! Sends frames from the queue to the serial port, a byte at a time, and takes requests from it.
//!
//! It takes telemetry frames from the interrupt's queue and writes their bytes to USART1; an answer to a request goes
//! between two of them. It never waits, so the main loop stays free for the watchdog and the event log; a frame is encoded
//! here and not in the interrupt. At 1 Mbaud a frame of 43 bytes takes 430 µs, so the line is full at 2 300 frames a second.

use heapless::spsc::Consumer;
#[cfg(feature = "slotted")]
use trueaxis::image_state::{BootReason, ImageState};
use trueaxis::service::while_sampling;
#[cfg(feature = "slotted")]
use trueaxis::service::{images::is_about_images, while_on_trial};
use trueaxis::service_frame::{ANSWER_BYTES, RequestReceiver};
#[cfg(feature = "slotted")]
use trueaxis::service_frame::{Answer, Request};
use trueaxis::{TELEMETRY_BYTES, TelemetryFrame};

use super::serial::Serial;
use super::service_mode::{self, TERM_KINDS};

/// Sends telemetry frames and answers to the serial port.
pub struct Link {
    frames: Consumer<'static, TelemetryFrame>,
    serial: Serial,
    requests: RequestReceiver,
    /// The answer to send next.
    answer: Option<[u8; ANSWER_BYTES]>,
    bytes: [u8; TELEMETRY_BYTES],
    /// Bytes of the present frame that have been sent; [`TELEMETRY_BYTES`] while there is no frame.
    sent: usize,
    frames_sent: u32,
    /// The detail of the answer to `state`.
    state: u32,
    /// The running image.
    #[cfg(feature = "slotted")]
    image: ImageState,
}

impl Link {
    /// Starts with nothing to send.
    pub fn new(frames: Consumer<'static, TelemetryFrame>, serial: Serial) -> Self {
        Self {
            frames,
            serial,
            requests: RequestReceiver::new(),
            answer: None,
            bytes: [0; TELEMETRY_BYTES],
            sent: TELEMETRY_BYTES,
            frames_sent: 0,
            state: 0,
            #[cfg(feature = "slotted")]
            image: ImageState::default(),
        }
    }

    /// Sets the word that answers a request for the state.
    #[cfg(feature = "board")]
    pub fn tell(&mut self, state: u32) {
        self.state = state;
    }

    /// Sets the state of the running image, which answers `image_state`; one on trial refuses to stop.
    #[cfg(feature = "slotted")]
    pub fn set_image(&mut self, image: ImageState) {
        self.image = image;
    }

    /// Answers a request as the running image has to.
    #[cfg(feature = "slotted")]
    fn answer_of_image(&self, request: &Request) -> (Answer, bool) {
        let on_trial = self.image.reason == BootReason::Trial && !self.image.is_confirmed;
        let (mut answer, stop) = if on_trial {
            (while_on_trial(request, TERM_KINDS), false)
        } else {
            while_sampling(request, TERM_KINDS)
        };
        if is_about_images(request) && answer.outcome == trueaxis::service::DONE {
            answer.detail = self.image.to_word();
        }
        (answer, stop)
    }

    /// Takes the byte that was received, if any, and answers the request of which it was the last, after the present frame;
    /// returns whether the unit is to stop. A second byte waits for the next call: they come no faster than periods pass.
    pub fn serve(&mut self) -> bool {
        let byte = self.serial.receive();
        let Some(request) = byte.and_then(|byte| self.requests.push(byte)) else {
            return false;
        };
        #[cfg(feature = "slotted")]
        let (mut answer, stop) = self.answer_of_image(&request);
        #[cfg(not(feature = "slotted"))]
        let (mut answer, stop) = while_sampling(&request, TERM_KINDS);
        if service_mode::asks_for_state(&request) {
            answer.detail = self.state;
        }
        self.answer = Some(answer.to_bytes());
        stop
    }

    /// Sends the bytes that the transmitter takes now; returns whether there is more to send.
    pub fn poll(&mut self) -> bool {
        loop {
            let Some(byte) = self.bytes.get(self.sent) else {
                if !self.next() {
                    return false;
                }
                continue;
            };
            if !self.serial.send(*byte) {
                return true;
            }
            self.sent += 1;
        }
    }

    /// Begins the answer, or else the next frame; `false` without either.
    fn next(&mut self) -> bool {
        if let Some(answer) = self.answer.take() {
            // At the buffer's end, so that its end is the frame's.
            self.sent = TELEMETRY_BYTES - ANSWER_BYTES;
            let place = self.bytes.iter_mut().skip(self.sent);
            for (place, byte) in place.zip(answer) {
                *place = byte;
            }
            return true;
        }
        let Some(frame) = self.frames.dequeue() else {
            return false;
        };
        self.bytes = frame.to_bytes();
        self.sent = 0;
        self.frames_sent = self.frames_sent.wrapping_add(1);
        true
    }

    /// Number of frames begun so far.
    #[cfg(feature = "emulator")]
    pub fn frames_sent(&self) -> u32 {
        self.frames_sent
    }

    /// Sends the rest of the present frame, then the answer, and gives the port back: the unit stops.
    pub fn stop(mut self) -> Serial {
        service_mode::send(
            &mut self.serial,
            self.bytes.get(self.sent..).unwrap_or_default(),
        );
        if let Some(answer) = self.answer {
            service_mode::send(&mut self.serial, &answer);
        }
        self.serial
    }
}
