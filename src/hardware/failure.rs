//! Ends a run that has failed: by a panic, a fault exception or a lost clock.
//!
//! The failure is written to [`LAST_FAILURE`], where a debugger finds it by name, in memory that a reset keeps. The
//! next boot logs it and reports it in health items 43 and 44 ([`take_report`]). Then:
//!
//! | place | consequence |
//! |---|---|
//! | board, debugger attached | it stops there, with the trace ring and the stack as they were |
//! | board, alone | a reset: the IMU is back within milliseconds, with `sequence` beginning anew |
//! | emulator | it ends with [`EMULATOR_EXIT`] |
//!
//! Only the first failure since the last report is kept: it is the cause. Nothing is logged here, for the
//! failure may have come out of the logger.

use core::panic::PanicInfo;
use core::sync::atomic::{AtomicU32, Ordering};

use cortex_m_rt::{ExceptionFrame, exception};

/// Exit code of the emulator, as Rust programs have it after a panic; `rlg on-target` shows it.
#[cfg(feature = "emulator")]
const EMULATOR_EXIT: i32 = 101;

/// "FAIL": the record holds a failure; "SEEN": a boot has reported it. Anything else is random content after power-on.
const FRESH: u32 = u32::from_le_bytes(*b"FAIL");
#[cfg(feature = "board")]
const REPORTED: u32 = u32::from_le_bytes(*b"SEEN");

/// Kinds of failure. The numbers are those of health item 43.
#[derive(Clone, Copy, PartialEq, Eq, defmt::Format)]
#[repr(u32)]
pub enum FailureKind {
    /// A panic; the place is its line.
    Panic = 1,
    /// A fault exception; the place is the instruction's address.
    HardFault = 2,
    /// The crystal stopped; the clock security system has seen it.
    #[cfg(feature = "board")]
    ClockLost = 3,
}

/// One failure, as it stands in memory: words in this order.
#[repr(C)]
pub struct Failure {
    state: AtomicU32,
    kind: AtomicU32,
    /// Line of a panic, or the program counter.
    place: AtomicU32,
    /// Address and length of the source file's name in flash, of a panic.
    file: AtomicU32,
    file_bytes: AtomicU32,
}

/// The record. `.uninit` is neither cleared nor loaded at boot. Without `no_mangle` the compiler would split
/// it into words and drop those that no code reads back.
#[unsafe(no_mangle)]
#[unsafe(link_section = ".uninit.LAST_FAILURE")]
static LAST_FAILURE: Failure = Failure {
    state: AtomicU32::new(0),
    kind: AtomicU32::new(0),
    place: AtomicU32::new(0),
    file: AtomicU32::new(0),
    file_bytes: AtomicU32::new(0),
};

/// Returns the failure that ended the previous run, once.
#[cfg(feature = "board")]
pub fn take_report() -> Option<(FailureKind, u32)> {
    if LAST_FAILURE.state.load(Ordering::Relaxed) != FRESH {
        return None;
    }
    LAST_FAILURE.state.store(REPORTED, Ordering::Relaxed);
    let kind = match LAST_FAILURE.kind.load(Ordering::Relaxed) {
        1 => FailureKind::Panic,
        2 => FailureKind::HardFault,
        _ => FailureKind::ClockLost,
    };
    Some((kind, LAST_FAILURE.place.load(Ordering::Relaxed)))
}

/// Latches the failure, if it is the first, and ends the run.
fn end(kind: FailureKind, place: u32, file: &str) -> ! {
    cortex_m::interrupt::disable();
    if LAST_FAILURE.state.load(Ordering::Relaxed) != FRESH {
        let record = [
            (&LAST_FAILURE.kind, kind as u32),
            (&LAST_FAILURE.place, place),
            (&LAST_FAILURE.file, file.as_ptr().addr() as u32),
            (&LAST_FAILURE.file_bytes, file.len() as u32),
            (&LAST_FAILURE.state, FRESH),
        ];
        for (word, value) in record {
            word.store(value, Ordering::Relaxed);
        }
    }
    stop()
}

#[cfg(feature = "emulator")]
fn stop() -> ! {
    semihosting::process::exit(EMULATOR_EXIT)
}

#[cfg(feature = "board")]
fn stop() -> ! {
    if cortex_m::peripheral::DCB::is_debugger_attached() {
        cortex_m::asm::bkpt();
    }
    cortex_m::peripheral::SCB::sys_reset()
}

#[panic_handler]
fn panic(info: &PanicInfo) -> ! {
    // Every panic of the core library has a place.
    match info.location() {
        Some(place) => end(FailureKind::Panic, place.line(), place.file()),
        None => end(FailureKind::Panic, 0, ""),
    }
}

#[exception]
unsafe fn HardFault(frame: &ExceptionFrame) -> ! {
    end(FailureKind::HardFault, frame.pc(), "")
}

/// The clock security system's exception. The hardware has already gone over to the internal oscillator,
/// with dividers that no longer fit; the reset comes back in the fallback of [`super::clock`].
#[cfg(feature = "board")]
#[exception]
unsafe fn NonMaskableInt() -> ! {
    // SAFETY: the last code of this run; nothing else uses the register any more.
    let rcc = unsafe { stm32f4::stm32f405::RCC::steal() };
    rcc.cir().modify(|_, w| w.cssc().clear());
    end(FailureKind::ClockLost, 0, "")
}
