//! Sends frames from the queue to the serial port, a byte at a time, and takes requests from it.
//!
//! It takes telemetry frames from the interrupt's queue and writes their bytes to USART1, in the form that the parameters ask for; an answer to a request goes
//! between two of them. It never waits, so the main loop stays free for the watchdog and the event log; a frame is encoded
//! here and not in the interrupt. At 1 Mbaud a frame of 43 bytes takes 430 µs, so the line is full at 2 300 frames a second.

use heapless::spsc::Consumer;
#[cfg(feature = "board")]
use trueaxis::SelfTest;
#[cfg(feature = "slotted")]
use trueaxis::image_state::{BootReason, ImageState};
use trueaxis::inertial_message::{InertialEncoder, MOST_BYTES};
use trueaxis::service::while_sampling;
#[cfg(feature = "slotted")]
use trueaxis::service::{images::is_about_images, while_on_trial};
use trueaxis::service_frame::{ANSWER_BYTES, RequestReceiver};
#[cfg(feature = "slotted")]
use trueaxis::service_frame::{Answer, Request};
use trueaxis::{OutputFormat, TelemetryFrame};

use super::serial::Serial;
use super::service_mode::{self, Details, TERM_KINDS};

/// Sends telemetry frames and answers to the serial port.
pub struct Link {
    frames: Consumer<'static, TelemetryFrame>,
    serial: Serial,
    requests: RequestReceiver,
    /// The answer to send next.
    answer: Option<[u8; ANSWER_BYTES]>,
    /// Messages of the frames; `None` if these go out as they are.
    messages: Option<InertialEncoder>,
    bytes: [u8; MOST_BYTES],
    /// Bytes of the present frame, and those of them that have been sent.
    length: usize,
    sent: usize,
    frames_sent: u32,
    details: Details,
    #[cfg(feature = "board")]
    self_test: SelfTest,
    /// The running image.
    #[cfg(feature = "slotted")]
    image: ImageState,
}

impl Link {
    /// Starts with nothing to send.
    pub fn new(
        frames: Consumer<'static, TelemetryFrame>,
        serial: Serial,
        output: OutputFormat,
    ) -> Self {
        Self {
            frames,
            serial,
            requests: RequestReceiver::new(),
            answer: None,
            messages: (output == OutputFormat::Inertial).then(InertialEncoder::new),
            bytes: [0; MOST_BYTES],
            length: 0,
            sent: 0,
            frames_sent: 0,
            details: Details::default(),
            #[cfg(feature = "board")]
            self_test: SelfTest::default(),
            #[cfg(feature = "slotted")]
            image: ImageState::default(),
        }
    }

    /// Sets the word that answers a request for the state.
    #[cfg(feature = "board")]
    pub fn tell(&mut self, state: u32) {
        self.details.state = state;
    }

    /// Sets the results of the built-in test, which frames show and a request is answered by.
    #[cfg(feature = "board")]
    pub fn set_self_test(&mut self, results: SelfTest) {
        self.details.self_test = results.to_word();
        self.self_test = results;
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
        if let Some(detail) = self.details.of(&request) {
            answer.detail = detail;
        }
        self.answer = Some(answer.to_bytes());
        stop
    }

    /// Sends the bytes that the transmitter takes now; returns whether there is more to send, or the line is still driven.
    pub fn poll(&mut self) -> bool {
        loop {
            let Some(byte) = self.rest().first() else {
                if !self.next() {
                    return !self.serial.release();
                }
                continue;
            };
            if !self.serial.send(*byte) {
                return true;
            }
            self.sent += 1;
        }
    }

    /// Bytes of the present frame that have not been sent.
    fn rest(&self) -> &[u8] {
        self.bytes.get(self.sent..self.length).unwrap_or_default()
    }

    /// Begins the answer, or else the next frame; `false` without either.
    fn next(&mut self) -> bool {
        if let Some(answer) = self.answer.take() {
            self.begin(&answer);
            return true;
        }
        #[cfg_attr(
            not(feature = "board"),
            expect(unused_mut, reason = "the emulator has no built-in test")
        )]
        let Some(mut frame) = self.frames.dequeue() else {
            return false;
        };
        #[cfg(feature = "board")]
        self.self_test.show_in(&mut frame);
        match &mut self.messages {
            Some(messages) => {
                let line = messages.encode(&frame);
                self.begin(line.bytes());
            }
            None => self.begin(&frame.to_bytes()),
        }
        self.frames_sent = self.frames_sent.wrapping_add(1);
        true
    }

    /// Begins to send these bytes.
    fn begin(&mut self, bytes: &[u8]) {
        for (place, byte) in self.bytes.iter_mut().zip(bytes) {
            *place = *byte;
        }
        (self.sent, self.length) = (0, bytes.len().min(MOST_BYTES));
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
            self.bytes.get(self.sent..self.length).unwrap_or_default(),
        );
        if let Some(answer) = self.answer {
            service_mode::send(&mut self.serial, &answer);
        }
        self.serial
    }
}
