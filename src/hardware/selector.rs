//! The selector's image: registers around [`ImageSlots::select`].

use core::panic::PanicInfo;
use core::ptr;

use cortex_m::peripheral::SCB;
use cortex_m_rt::entry;
use stm32f4::stm32f405::{FLASH, IWDG, Peripherals};
use trueaxis::image_slots::{Choice, ImageSlots};
use trueaxis::image_state::{BootNote, BootReason};

#[path = "enable.rs"]
mod enable;

#[path = "flash.rs"]
#[expect(dead_code, reason = "parameter slots are the image's")]
mod flash;

#[path = "image_flash.rs"]
mod image_flash;

#[path = "supply.rs"]
#[expect(dead_code, reason = "an image reports the brown-out level")]
mod supply;

use image_flash::{ImageFlash, JournalFlash, note};

/// Prescaler and reload of a trial's watchdog: 4096 ticks of the low-speed oscillator over 256, 22 s at 47 kHz and 61 s at
/// 17 kHz (RM0090 21.4, DS8626 table 35). An image starts its own within 8 s, two erasures of a mend included.
const TRIAL_PRESCALER: u16 = 6;
const TRIAL_RELOAD: u16 = 0xFFF;

/// Polls until prescaler and reload are in force: at least 2.5 ms at 16 MHz; it takes five periods of the oscillator, 0.3 ms
/// at most (RM0090 21.4.2).
const UPDATE_POLLS: u32 = 10_000;

#[entry]
fn main() -> ! {
    let Some(peripherals) = Peripherals::take() else {
        wait_for_a_probe();
    };
    let (rcc, pwr) = (&peripherals.RCC, &peripherals.PWR);
    // SAFETY: this program has one thread, and its two flashes do nothing at the same time.
    let journal = JournalFlash::new(unsafe { FLASH::steal() });
    let mut slots = ImageSlots::new(journal, ImageFlash::new(peripherals.FLASH));
    let choice = slots.select(|| {
        rcc.apb1enr().modify(|_, w| w.pwren().enabled());
        enable::confirm(|| rcc.apb1enr().read().pwren().is_enabled());
        supply::suffices(pwr)
    });
    match choice {
        Some(choice) => start(&choice, &peripherals.IWDG),
        None => wait_for_a_probe(),
    }
}

/// Leaves the note and starts the image.
fn start(choice: &Choice, watchdog: &IWDG) -> ! {
    let slot = choice.header.slot;
    let reason = choice.reason;
    // SAFETY: RAM that neither this program nor any image uses otherwise.
    unsafe { ptr::write_volatile(note(), BootNote { slot, reason }.to_words()) };
    if reason == BootReason::Trial {
        watchdog.kr().write(|w| w.key().start());
        watchdog.kr().write(|w| w.key().unlock());
        // SAFETY: 6 divides by 256; the field has three bits.
        watchdog.pr().write(|w| unsafe { w.bits(TRIAL_PRESCALER) });
        watchdog.rlr().write(|w| w.rl().set(TRIAL_RELOAD));
        // Until both are in force a feed would allow the time of the settings after a reset, 0.35 s.
        let _ = (0..UPDATE_POLLS).any(|_| watchdog.sr().read().bits() == 0);
    }
    feed_watchdog();
    let table = slot.vector_table();
    // SAFETY: the table of an image that was checked; interrupts are off but for faults, and this program does not go on.
    unsafe {
        (*SCB::PTR).vtor.write(table);
        cortex_m::asm::dsb();
        cortex_m::asm::bootload(ptr::with_exposed_provenance(table as usize))
    }
}

/// Feeds a watchdog that an option byte starts at power-on; one that does not run takes no notice (RM0090 21.3).
fn feed_watchdog() {
    // SAFETY: a single store that nothing else in this program depends on.
    let watchdog = unsafe { IWDG::steal() };
    watchdog.kr().write(|w| w.key().feed());
}

/// Neither slot holds an image.
fn wait_for_a_probe() -> ! {
    loop {
        feed_watchdog();
        cortex_m::asm::nop();
    }
}

#[panic_handler]
fn panic(_: &PanicInfo<'_>) -> ! {
    SCB::sys_reset()
}
