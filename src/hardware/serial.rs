//! Drives USART1: telemetry frames leave the board here, on PA9, and requests come in on PA10.
//!
//! PA8 enables the driver of an RS-422 or RS-485 line: high from [`ENABLE_CYCLES`] before a byte's start bit until the last stop bit
//! has left the shift register. A reset leaves the pin open, so the line's board pulls it down.
//!
//! Bytes leave with 8 data bits, no parity and 1 stop bit at [`BAUD`]. Nothing waits: [`Serial::send`] takes a byte if
//! there is room and returns `true` if so; the main loop tries again.

use stm32f4::stm32f405::{GPIOA, RCC, USART1};

use super::enable;

/// Bits a second. Not 921 600: a million divides 84 MHz and the fallbacks' 72 and 16 MHz without a rest, and the usual USB
/// adapters know it.
pub const BAUD: u32 = 1_000_000;

/// Least ratio of clock and baud rate with 16-fold oversampling (RM0090 30.3.4).
const LEAST_DIVISOR: u32 = 16;

/// Ratio of clock and baud rate as the register takes it, and true for 8-fold oversampling: a ratio below 16 needs it, in
/// eighths with the fraction in the lowest three bits (RM0090 30.3.4).
const fn divisor(apb2_hz: u32) -> (u16, bool) {
    let ratio = (apb2_hz + BAUD / 2) / BAUD;
    if ratio < LEAST_DIVISOR {
        ((((ratio / 8) << 4) | (ratio % 8)) as u16, true)
    } else {
        (ratio as u16, false)
    }
}

/// Time from the driver's enable to the first start bit \[cycles\]: 1 µs at 168 MHz, more at less; drivers for this rate take
/// 0.1 µs.
const ENABLE_CYCLES: u32 = 168;

/// The driver's enable pin in the set half of a port's BSRR; 16 bits higher it clears (RM0090 8.4.7).
const ENABLE: u32 = 1 << 8;

/// Transmitter and receiver of USART1.
pub struct Serial {
    usart: USART1,
    is_driving: bool,
}

impl Serial {
    /// Configures pins and rate.
    pub fn new(usart: USART1, gpioa: &GPIOA, rcc: &RCC, apb2_hz: u32) -> Self {
        rcc.ahb1enr().modify(|_, w| w.gpioaen().enabled());
        rcc.apb2enr().modify(|_, w| w.usart1en().enabled());
        enable::confirm(|| rcc.ahb1enr().read().gpioaen().is_enabled());
        enable::confirm(|| rcc.apb2enr().read().usart1en().is_enabled());
        gpioa.afrh().modify(|_, w| w.afrh9().af7().afrh10().af7());
        // An open line reads as idle.
        gpioa.pupdr().modify(|_, w| w.pupdr10().pull_up());
        gpioa.moder().modify(|_, w| {
            w.moder8().output();
            w.moder9().alternate().moder10().alternate()
        });
        let (divisor, by_eight) = divisor(apb2_hz);
        // SAFETY: the register holds the clock over the baud rate (RM0090 30.3.4): 14 to 84, within its 16 bits.
        usart.brr().write(|w| unsafe { w.bits(divisor) });
        usart.cr1().write(|w| {
            w.over8().bit(by_eight);
            w.ue().enabled().te().enabled().re().enabled()
        });
        Self {
            usart,
            is_driving: false,
        }
    }

    /// Sends `byte` if the transmitter has room; returns whether it did.
    pub fn send(&mut self, byte: u8) -> bool {
        let has_room = self.usart.sr().read().txe().bit();
        if has_room {
            if !self.is_driving {
                self.drive(true);
                cortex_m::asm::delay(ENABLE_CYCLES);
            }
            self.usart.dr().write(|w| w.dr().set(u16::from(byte)));
        }
        has_room
    }

    /// Turns the line's driver off once the last stop bit has left; returns true if nothing is driven any more. To be called
    /// when there is nothing more to send.
    pub fn release(&mut self) -> bool {
        if self.is_driving && self.usart.sr().read().tc().bit() {
            self.drive(false);
        }
        !self.is_driving
    }

    fn drive(&mut self, is_on: bool) {
        let bits = if is_on { ENABLE } else { ENABLE << 16 };
        // SAFETY: the register takes single bits without a reading, so it disturbs no other pin of the port.
        unsafe { GPIOA::steal() }
            .bsrr()
            .write(|w| unsafe { w.bits(bits) });
        self.is_driving = is_on;
    }

    /// The byte that was received, if there is one. Reading it also clears an overrun (RM0090 30.6.1), which a sender that
    /// keeps to the pace does not cause; the request that it damages fails its check sum.
    pub fn receive(&mut self) -> Option<u8> {
        let has_come = self.usart.sr().read().rxne().bit();
        has_come.then(|| self.usart.dr().read().dr().bits() as u8)
    }
}
