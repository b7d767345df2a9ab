//! Stands in for the board's `RawPort`: the emulator has USART6 but no DMA, so the processor writes the bytes itself.
//!
//! Interrupt and main loop are the board's own; only the moving of a batch from memory to the data register is not.

use stm32f4::stm32f405::USART6;

/// The transmitter of USART6.
pub struct RawPort {
    usart: USART6,
}

impl RawPort {
    /// Enables the transmitter.
    pub fn new(usart: USART6) -> Self {
        usart.cr1().write(|w| w.ue().enabled().te().enabled());
        Self { usart }
    }

    /// Sends `batch` and returns `true`. The emulated transmitter takes a byte at once; one that it does not take is lost.
    pub fn send(&mut self, batch: &[u8]) -> bool {
        for byte in batch {
            if self.usart.sr().read().txe().bit() {
                self.usart.dr().write(|w| w.dr().set(u16::from(*byte)));
            }
        }
        true
    }
}
