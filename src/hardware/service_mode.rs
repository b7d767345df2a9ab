//! Serves the stopped unit: takes a parameter block over the telemetry port, until a request to start anew.
//!
//! It runs instead of sampling and before the watchdog is started, for writing flash holds the processor for up to 2 s. On the board a
//! running unit comes here by a reset: the request to stop is latched in memory that a reset keeps ([`request`]), and the next
//! boot finds it, once ([`take_request`]). The emulator, which cannot be reset, comes here from the end of sampling.
//!
//! A unit without a request for [`IDLE_LIMIT_S`] starts anew by itself: a broken line must not leave it stopped.

#[cfg(feature = "board")]
use core::sync::atomic::{AtomicU32, Ordering};

use cortex_m::peripheral::SYST;
use cortex_m::peripheral::syst::SystClkSource;
use embedded_storage::nor_flash::NorFlash;
use trueaxis::parameter_slots::ParameterSlots;
use trueaxis::service::{Reply, Service};
use trueaxis::service_frame::{Request, RequestKind, RequestReceiver};
use trueaxis::terms::TermKinds;
use trueaxis::{Chain, Term};

use super::serial::Serial;
use crate::{Core, Terms};

/// Without a request for so long the unit starts anew \[s\].
const IDLE_LIMIT_S: u32 = 300;

/// Ticks of the idle timer in a second.
const TICKS_A_SECOND: u32 = 100;

/// Polls for the transmitter to take a byte, or to finish the last one: a byte takes 10 µs, 1680 cycles at most, and a poll at
/// least 4.
const SEND_POLLS: u32 = 4_000;

/// The kinds of terms of this image.
pub const TERM_KINDS: TermKinds = <Terms as Term<Core>>::KINDS;

/// "STOP": the run before this one was asked to stop. Anything else is random content after power-on.
#[cfg(feature = "board")]
const REQUESTED: u32 = u32::from_le_bytes(*b"STOP");

/// Not cleared and not loaded at boot.
#[cfg(feature = "board")]
#[unsafe(link_section = ".uninit.STOP_REQUEST")]
static STOP_REQUEST: AtomicU32 = AtomicU32::new(0);

/// Asks the next boot not to sample.
#[cfg(feature = "board")]
pub fn request() {
    STOP_REQUEST.store(REQUESTED, Ordering::Relaxed);
    cortex_m::asm::dsb();
}

/// Returns `true` once if the run before this one was asked to stop.
#[cfg(feature = "board")]
pub fn take_request() -> bool {
    let requested = STOP_REQUEST.load(Ordering::Relaxed) == REQUESTED;
    STOP_REQUEST.store(0, Ordering::Relaxed);
    requested
}

/// Details of answers that the service of the library leaves to the image.
#[derive(Clone, Copy, Default)]
pub struct Details {
    /// Clock and supply.
    pub state: u32,
    /// Results of the built-in test.
    pub self_test: u32,
}

impl Details {
    /// The detail of the answer to a request, if it is one of these.
    pub fn of(&self, request: &Request) -> Option<u32> {
        match RequestKind::from_number(request.kind)? {
            RequestKind::State => Some(self.state),
            RequestKind::SelfTest => Some(self.self_test),
            _ => None,
        }
    }
}

/// The stopped unit of this image.
pub type ImageService<F> = Service<F, Chain<Core, Terms>>;

/// Serves requests until one asks to start anew, or none comes; gives the flash back, and true if the next start is to
/// run the built-in test. `slots`: where its two slots begin. `details`
/// of answers. `about_images` answers requests about firmware images, if there are slots of them. Not inlined: the block would lie on the stack of the whole run.
#[inline(never)]
pub fn serve<F: NorFlash>(
    flash: F,
    slots: [u32; 2],
    supply_suffices: impl Fn() -> bool,
    serial: &mut Serial,
    mut idle: IdleTimer,
    details: Details,
    mut about_images: impl FnMut(&ImageService<F>, &Request) -> Option<Reply>,
) -> (F, bool) {
    let mut wants_test = false;
    let slots = ParameterSlots::new(flash, slots).accepting::<Chain<Core, Terms>>();
    let mut service = Service::new(slots, TERM_KINDS);
    let mut requests = RequestReceiver::new();
    while !idle.is_over() {
        let Some(byte) = serial.receive() else {
            continue;
        };
        let Some(request) = requests.push(byte) else {
            continue;
        };
        let about_images = about_images(&service, &request);
        let mut reply = about_images.unwrap_or_else(|| service.answer(&request, &supply_suffices));
        if let Some(detail) = details.of(&request) {
            reply.answer.detail = detail;
        }
        send(serial, &reply.answer.to_bytes());
        idle.begin_anew();
        if reply.restart {
            wants_test = request.kind == RequestKind::RunSelfTest as u8;
            break;
        }
    }
    (service.release().release(), wants_test)
}

/// Sends bytes to the last bit, or gives up if the transmitter does not answer.
#[inline(never)]
pub fn send(serial: &mut Serial, bytes: &[u8]) {
    for byte in bytes {
        if !(0..SEND_POLLS).any(|_| serial.send(*byte)) {
            return;
        }
    }
    // A failure here has no remedy.
    let _ = (0..SEND_POLLS).any(|_| serial.release());
}

/// Measures the time without a request.
pub struct IdleTimer {
    timer: SYST,
    ticks: u32,
}

impl IdleTimer {
    /// Starts it on the core's clock.
    pub fn new(mut timer: SYST, core_hz: u32) -> Self {
        timer.set_clock_source(SystClkSource::Core);
        timer.set_reload(core_hz / TICKS_A_SECOND - 1);
        timer.clear_current();
        timer.enable_counter();
        Self { timer, ticks: 0 }
    }

    fn begin_anew(&mut self) {
        self.ticks = 0;
    }

    /// To be asked more often than the timer ticks; a tick that is missed lengthens the time.
    fn is_over(&mut self) -> bool {
        if self.timer.has_wrapped() {
            self.ticks += 1;
        }
        self.ticks >= IDLE_LIMIT_S * TICKS_A_SECOND
    }
}
