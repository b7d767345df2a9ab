//! What happens when the impossible does.
//!
//! Enters: a panic. (A fault exception ends in cortex-m-rt's endless loop; the host ends the emulator when
//! no output comes.) Leaves: the place, latched in [`FIRST_PANIC`] where a debugger finds it by name, and an exit
//! of the emulator with [`PANIC_EXIT`].
//!
//! It does not log: the panic may have come out of the logger.

use core::panic::PanicInfo;
use core::sync::atomic::{AtomicPtr, AtomicU32, Ordering};

/// Exit code of the emulator after a panic, as Rust programs have it; `rlg on-target` shows it.
const PANIC_EXIT: i32 = 101;

/// Where the first panic of this run was: file name (start and length) and line.
struct LatchedPanic {
    file: AtomicPtr<u8>,
    file_bytes: AtomicU32,
    line: AtomicU32,
}

static FIRST_PANIC: LatchedPanic = LatchedPanic {
    file: AtomicPtr::new(core::ptr::null_mut()),
    file_bytes: AtomicU32::new(0),
    line: AtomicU32::new(0),
};

#[panic_handler]
fn panic(info: &PanicInfo) -> ! {
    cortex_m::interrupt::disable();
    if let Some(place) = info.location()
        && FIRST_PANIC.line.load(Ordering::Relaxed) == 0
    {
        let file = place.file();
        FIRST_PANIC
            .file
            .store(file.as_ptr().cast_mut(), Ordering::Relaxed);
        FIRST_PANIC
            .file_bytes
            .store(file.len() as u32, Ordering::Relaxed);
        FIRST_PANIC.line.store(place.line(), Ordering::Relaxed);
    }
    semihosting::process::exit(PANIC_EXIT)
}
