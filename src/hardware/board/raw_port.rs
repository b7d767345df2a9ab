//! Drives USART6, sending only, by DMA: the raw stream leaves the board here, on PC6.
//!
//! Bytes leave with 8 data bits, no parity and 1 stop bit at [`BAUD`]. A batch is copied to memory of the port and sent
//! from there by stream 6 of DMA2 (channel 5, RM0090 table 43), which needs the processor for nothing in between. Nothing waits:
//! [`RawPort::send`] takes a batch if the last one is out.

use core::sync::atomic::{Ordering, compiler_fence};

use stm32f4::stm32f405::{DMA2, GPIOC, RCC, USART6};

use crate::hardware::enable;
use crate::hardware::raw_link::BATCH_BYTES;

/// Bits a second: the most that common USB adapters know, and a divisor of 84 MHz without a rest.
const BAUD: u32 = 3_000_000;

/// Least ratio of clock and baud rate with 16-fold oversampling (RM0090 30.3.4).
const LEAST_DIVISOR: u32 = 16;

/// Stream of DMA2 that serves the transmitter.
const STREAM: usize = 6;

/// Channel of that stream.
const CHANNEL: u8 = 5;

/// Memory that the hardware sends from.
pub type RawBuffer = [u8; BATCH_BYTES];

/// The transmitter of USART6 with its stream.
pub struct RawPort {
    dma: DMA2,
    /// The hardware's while the stream is enabled.
    buffer: &'static mut RawBuffer,
}

impl RawPort {
    /// Configures pin, rate and stream; `None` if the clock is too slow for the rate, as the internal oscillator alone is.
    pub fn new(
        usart: &USART6,
        dma: DMA2,
        gpioc: &GPIOC,
        rcc: &RCC,
        apb2_hz: u32,
        buffer: &'static mut RawBuffer,
    ) -> Option<Self> {
        let divisor = (apb2_hz + BAUD / 2) / BAUD;
        if divisor < LEAST_DIVISOR {
            return None;
        }
        rcc.ahb1enr()
            .modify(|_, w| w.gpiocen().enabled().dma2en().enabled());
        rcc.apb2enr().modify(|_, w| w.usart6en().enabled());
        enable::confirm(|| {
            let enables = rcc.ahb1enr().read();
            enables.gpiocen().is_enabled() && enables.dma2en().is_enabled()
        });
        enable::confirm(|| rcc.apb2enr().read().usart6en().is_enabled());
        gpioc.afrl().modify(|_, w| w.afrl6().af8());
        gpioc.ospeedr().modify(|_, w| w.ospeedr6().high_speed());
        gpioc.moder().modify(|_, w| w.moder6().alternate());
        // SAFETY: the register holds the clock over the baud rate in sixteenths (RM0090 30.3.4): 28 or 24, within its 16 bits.
        usart.brr().write(|w| unsafe { w.bits(divisor as u16) });
        usart.cr3().write(|w| w.dmat().enabled());
        usart.cr1().write(|w| w.ue().enabled().te().enabled());
        let data = usart.dr().as_ptr() as u32;
        let memory = buffer.as_ptr() as u32;
        // SAFETY: addresses of the data register and of memory that lives for ever; the stream reads that memory alone, and
        // no more than it holds.
        unsafe {
            dma.st(STREAM).par().write(|w| w.bits(data));
            dma.st(STREAM).m0ar().write(|w| w.bits(memory));
        }
        Some(Self { dma, buffer })
    }

    /// Begins to send `batch`, of at most [`BATCH_BYTES`], if the last one is out; returns whether it did. A transfer
    /// error ends a batch, and the rest of it is lost: the frames' numbers show it.
    pub fn send(&mut self, batch: &[u8]) -> bool {
        // The hardware clears the bit at the end of a transfer and after an error of the bus (RM0090 10.3.18).
        if self.dma.st(STREAM).cr().read().en().is_enabled() {
            return false;
        }
        // It no longer reads.
        compiler_fence(Ordering::Acquire);
        for (place, byte) in self.buffer.iter_mut().zip(batch) {
            *place = *byte;
        }
        let length = batch.len().min(BATCH_BYTES) as u16;
        self.dma.hifcr().write(|w| {
            w.ctcif6().clear().chtif6().clear().cteif6().clear();
            w.cdmeif6().clear().cfeif6().clear()
        });
        self.dma.st(STREAM).ndtr().write(|w| w.ndt().set(length));
        // The buffer is the hardware's from here: written, for the compiler and for the bus.
        compiler_fence(Ordering::Release);
        cortex_m::asm::dmb();
        self.dma.st(STREAM).cr().write(|w| {
            w.chsel().set(CHANNEL).dir().memory_to_peripheral();
            w.minc().incremented().en().enabled()
        });
        true
    }
}
