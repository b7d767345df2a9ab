//! Drives SPI1 as the `SpiDevice` of the counter bank: PA5 clock, PA6 in, PA7 out, PA4 chip select.
//!
//! It carries out `embedded-hal` transactions in mode 0, most significant bit first, at no more than [`SPI_LIMIT_HZ`],
//! and gives [`BusFault`] where the peripheral does not answer. The bank has latched its counters by then, on the edge
//! of [`SampleTimer`](crate::hardware::sample_timer::SampleTimer).
//!
//! It is polled: a frame of 48 bytes takes 37 µs on the wire at 10.5 MHz, which is the interrupt's own time,
//! but leaves nothing that could come late or in the wrong order, as DMA could. Every wait is bounded.

use core::convert::Infallible;

use embedded_hal::digital::{ErrorType as PinErrorType, OutputPin};
use embedded_hal::spi::{Error, ErrorKind, ErrorType, Operation, SpiDevice};
use stm32f4::stm32f405::{GPIOA, RCC, SPI1};

use crate::hardware::enable;

/// Fastest clock \[Hz\]: an eighth of 84 MHz, so that a bit lasts 95 ns and a metre of cable with its
/// buffers (some 20 ns there and back) leaves half a bit less 20 ns between edge and sample.
const SPI_LIMIT_HZ: u32 = 10_500_000;

/// Polls for one byte. A byte takes 8 bits of at most 16 core cycles each, 128 cycles, and a poll at least 4,
/// so it is there within 32; four times as much is a fault.
const BYTE_POLLS: u32 = 128;

/// Core cycles between chip select and the first clock edge: 100 ns at 168 MHz, for the bank to drive its
/// line.
const SELECT_CYCLES: u32 = 17;

/// Core cycles in a microsecond at full speed; slower clocks make a delay longer, never shorter.
const CYCLES_PER_US: u32 = 168;

/// The peripheral did not finish a byte within its bound.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BusFault;

impl Error for BusFault {
    fn kind(&self) -> ErrorKind {
        ErrorKind::Other
    }
}

/// The bus and its one device.
pub struct SpiBus {
    spi: SPI1,
    select: ChipSelect,
}

/// The chip select pin, PA4.
struct ChipSelect(GPIOA);

impl PinErrorType for ChipSelect {
    type Error = Infallible;
}

impl OutputPin for ChipSelect {
    fn set_low(&mut self) -> Result<(), Infallible> {
        self.0.bsrr().write(|w| w.br4().reset());
        Ok(())
    }

    fn set_high(&mut self) -> Result<(), Infallible> {
        self.0.bsrr().write(|w| w.bs4().set_());
        Ok(())
    }
}

impl SpiBus {
    /// Configures pins, mode and rate. Takes port A, whose other pins must be configured by then.
    pub fn new(spi: SPI1, gpioa: GPIOA, rcc: &RCC, apb2_hz: u32) -> Self {
        rcc.ahb1enr().modify(|_, w| w.gpioaen().enabled());
        rcc.apb2enr().modify(|_, w| w.spi1en().enabled());
        enable::confirm(|| rcc.ahb1enr().read().gpioaen().is_enabled());
        enable::confirm(|| rcc.apb2enr().read().spi1en().is_enabled());
        // High before it becomes an output: no false latch.
        gpioa.bsrr().write(|w| w.bs4().set_());
        gpioa.afrl().modify(|_, w| {
            w.afrl5().af5();
            w.afrl6().af5().afrl7().af5()
        });
        gpioa.ospeedr().modify(|_, w| {
            // 50 MHz into 40 pF (DS8626 revision 12, table 50); the slowest pads end at 4 MHz.
            w.ospeedr4().high_speed().ospeedr5().high_speed();
            w.ospeedr7().high_speed()
        });
        gpioa.moder().modify(|_, w| {
            w.moder4().output().moder5().alternate();
            w.moder6().alternate().moder7().alternate()
        });
        spi.cr1().write(|w| {
            w.mstr().master().ssm().enabled().ssi().slave_not_selected();
            if apb2_hz / 2 <= SPI_LIMIT_HZ {
                w.br().div2();
            } else {
                w.br().div8();
            }
            w.spe().enabled()
        });
        Self {
            spi,
            select: ChipSelect(gpioa),
        }
    }

    /// Exchanges one byte with the bank.
    #[inline]
    fn exchange(&self, byte: u8) -> Result<u8, BusFault> {
        let can_send = (0..BYTE_POLLS).any(|_| self.spi.sr().read().txe().bit());
        if !can_send {
            return Err(BusFault);
        }
        self.spi.dr().write(|w| w.dr().set(u16::from(byte)));
        let has_come = (0..BYTE_POLLS).any(|_| self.spi.sr().read().rxne().bit());
        if !has_come {
            return Err(BusFault);
        }
        Ok(self.spi.dr().read().dr().bits() as u8)
    }

    /// Waits until the last bit has ended: a byte has come half a bit before, and the bank must see that edge with its select
    /// still low (BSY, RM0090 28.3.7).
    #[inline]
    fn wait_until_idle(&self) -> Result<(), BusFault> {
        let is_idle = (0..BYTE_POLLS).any(|_| !self.spi.sr().read().bsy().bit());
        if is_idle { Ok(()) } else { Err(BusFault) }
    }

    /// Carries out one operation of a transaction.
    #[inline]
    fn operate(&self, operation: &mut Operation<'_, u8>) -> Result<(), BusFault> {
        match operation {
            Operation::Read(bytes) => {
                for byte in bytes.iter_mut() {
                    *byte = self.exchange(0)?;
                }
            }
            Operation::Write(bytes) => {
                for byte in bytes.iter() {
                    self.exchange(*byte)?;
                }
            }
            Operation::Transfer(read, write) => {
                let mut sent = write.iter();
                for byte in read.iter_mut() {
                    *byte = self.exchange(sent.next().copied().unwrap_or(0))?;
                }
                for byte in sent {
                    self.exchange(*byte)?;
                }
            }
            Operation::TransferInPlace(bytes) => {
                for byte in bytes.iter_mut() {
                    *byte = self.exchange(*byte)?;
                }
            }
            Operation::DelayNs(delay_ns) => {
                cortex_m::asm::delay(
                    (*delay_ns / 1000)
                        .saturating_add(1)
                        .saturating_mul(CYCLES_PER_US),
                );
            }
        }
        Ok(())
    }
}

impl ErrorType for SpiBus {
    type Error = BusFault;
}

impl SpiDevice for SpiBus {
    #[inline]
    fn transaction(&mut self, operations: &mut [Operation<'_, u8>]) -> Result<(), BusFault> {
        let Ok(()) = self.select.set_low();
        cortex_m::asm::delay(SELECT_CYCLES);
        // A byte left by a failed transfer would shift this one by a byte: reading data and then status clears both the
        // byte and an overrun (RM0090 28.3.10).
        let _ = self.spi.dr().read();
        let _ = self.spi.sr().read();
        let outcome = operations
            .iter_mut()
            .try_for_each(|operation| self.operate(operation))
            // A bus that has failed is not waited for a second time.
            .and_then(|()| self.wait_until_idle());
        let Ok(()) = self.select.set_high();
        outcome
    }
}
