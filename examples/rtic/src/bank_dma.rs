//! Transfers frames of the counter bank by DMA: SPI1 on PA5 to PA7, chip select on PA4, DMA2 streams 0 and 3.
//!
//! A frame is 48 bytes: 48 µs on the wire at 8 MHz, during which the processor is free. [`BankDma::start`] begins a
//! transfer, the interrupt of stream 0 ends it.

use core::sync::atomic::{Ordering, compiler_fence};

use stm32f4::stm32f405::{DMA2, GPIOA, SPI1};
use trueaxis::counter_bank::{BusFault, FRAME_BYTES};

/// Stream of SPI1's receiver, channel 3 (RM0090 table 43).
const RECEIVE: usize = 0;

/// Stream of SPI1's transmitter, channel 3.
const SEND: usize = 3;

/// Polls until the bus is idle: a bit of 8 MHz is two cycles of the core.
const IDLE_POLLS: u32 = 16;

/// Byte sent by the master to clock a frame in.
static ZERO: u8 = 0;

/// The bank's bus with its two streams.
pub struct BankDma {
    spi: SPI1,
    dma: DMA2,
    gpioa: GPIOA,
    /// Owned by the hardware between [`start`](Self::start) and [`finish`](Self::finish) or [`give_up`](Self::give_up).
    buffer: &'static mut [u8; FRAME_BYTES],
    busy: bool,
}

impl BankDma {
    /// Sets up pins, bus and streams. The clocks of port A, SPI1 and DMA2 are on, and the other pins of port A set up.
    pub fn new(spi: SPI1, dma: DMA2, gpioa: GPIOA, buffer: &'static mut [u8; FRAME_BYTES]) -> Self {
        // High before it becomes an output.
        gpioa.bsrr().write(|w| w.bs4().set_());
        gpioa.afrl().modify(|_, w| {
            w.afrl5().af5();
            w.afrl6().af5().afrl7().af5()
        });
        // The slowest pads end at 4 MHz (DS8626 revision 12, table 50).
        gpioa.ospeedr().modify(|_, w| {
            w.ospeedr4().high_speed().ospeedr5().high_speed();
            w.ospeedr7().high_speed()
        });
        gpioa.moder().modify(|_, w| {
            w.moder4().output().moder5().alternate();
            w.moder6().alternate().moder7().alternate()
        });
        // Mode 0, most significant bit first, half the bus clock: 8 MHz.
        spi.cr1().write(|w| {
            w.mstr().master().ssm().enabled().ssi().slave_not_selected();
            w.br().div2().spe().enabled()
        });
        spi.cr2()
            .write(|w| w.rxdmaen().enabled().txdmaen().enabled());
        let data = spi.dr().as_ptr() as u32;
        for (stream, memory) in [
            (RECEIVE, buffer.as_mut_ptr() as u32),
            (SEND, &raw const ZERO as u32),
        ] {
            // SAFETY: addresses of the data register and of memory with static lifetime; the streams write to the buffer
            // alone, and FRAME_BYTES of it.
            dma.st(stream).par().write(|w| unsafe { w.bits(data) });
            dma.st(stream).m0ar().write(|w| unsafe { w.bits(memory) });
        }
        Self {
            spi,
            dma,
            gpioa,
            buffer,
            busy: false,
        }
    }

    /// True if a transfer is under way.
    pub fn is_busy(&self) -> bool {
        self.busy
    }

    /// Selects the bank and begins the transfer of its frame. Stream 0 requests its interrupt at the end.
    pub fn start(&mut self) {
        self.busy = true;
        self.gpioa.bsrr().write(|w| w.br4().reset());
        // Data remaining from an abandoned transfer would shift this one by a byte.
        let _ = self.spi.dr().read();
        let _ = self.spi.sr().read();
        self.clear_flags();
        for stream in [RECEIVE, SEND] {
            self.dma
                .st(stream)
                .ndtr()
                .write(|w| w.ndt().set(FRAME_BYTES as u16));
        }
        // The buffer is owned by the hardware from here.
        compiler_fence(Ordering::Release);
        self.dma.st(RECEIVE).cr().write(|w| {
            w.chsel().set(3).dir().peripheral_to_memory();
            w.minc().incremented().tcie().enabled().teie().enabled();
            w.en().enabled()
        });
        self.dma.st(SEND).cr().write(|w| {
            w.chsel().set(3).dir().memory_to_peripheral();
            w.minc().fixed().en().enabled()
        });
    }

    /// Ends a transfer after its interrupt.
    pub fn finish(&mut self) -> Result<[u8; FRAME_BYTES], BusFault> {
        let failed = self.dma.lisr().read().teif0().bit();
        let whole = self.dma.st(RECEIVE).ndtr().read().ndt().bits() == 0;
        self.give_up();
        // The hardware has finished writing.
        compiler_fence(Ordering::Acquire);
        if failed || !whole {
            return Err(BusFault);
        }
        Ok(*self.buffer)
    }

    /// Stops the streams and deselects the bank.
    pub fn give_up(&mut self) {
        for stream in [RECEIVE, SEND] {
            self.dma.st(stream).cr().write(|w| w.en().disabled());
        }
        // The last bit ends half a bit after its byte has come; a bus that stays busy is given up.
        let _ = (0..IDLE_POLLS).any(|_| !self.spi.sr().read().bsy().bit());
        self.gpioa.bsrr().write(|w| w.bs4().set_());
        self.clear_flags();
        self.busy = false;
    }

    /// Clears every flag of both streams.
    fn clear_flags(&self) {
        self.dma.lifcr().write(|w| {
            w.ctcif0().clear().chtif0().clear().cteif0().clear();
            w.cdmeif0().clear().cfeif0().clear();
            w.ctcif3().clear().chtif3().clear().cteif3().clear();
            w.cdmeif3().clear().cfeif3().clear()
        });
    }
}
