//! Reads the counter bank over a bus and hands the bytes to the [`BankDecoder`].
//!
//! | bus | caller of the decoder |
//! |---|---|
//! | blocking, `embedded-hal` | [`CounterBank::take`](SampleSource::take), in the interrupt |
//! | asynchronous, `embedded-hal-async` (feature `async`) | `CounterBank::take_async` |
//! | DMA | the interrupt of the finished transfer: `decoder.reading(Ok(&buffer), elapsed)`, no adapter needed; `examples/rtic` does it |
//!
//! The bus driver owns chip select, mode and clock, and bounds its waits.

use embedded_hal::spi::SpiDevice;

use crate::unit::counter_bank::{AccelerometerInput, BankDecoder, BusFault, FRAME_BYTES};
use crate::unit::sample_source::{Reading, SampleSource};

/// The bank behind `SPI`, a blocking or an asynchronous `SpiDevice`.
#[derive(Debug)]
pub struct CounterBank<SPI> {
    spi: SPI,
    decoder: BankDecoder,
}

impl<SPI> CounterBank<SPI> {
    /// A bank that has not been read yet.
    pub fn new(spi: SPI, accelerometers: AccelerometerInput) -> Self {
        Self {
            spi,
            decoder: BankDecoder::new(accelerometers),
        }
    }

    /// Gives the bus back.
    pub fn release(self) -> SPI {
        self.spi
    }
}

impl<SPI: SpiDevice> SampleSource for CounterBank<SPI> {
    #[inline]
    fn take(&mut self, elapsed: u32) -> Reading {
        self.decoder.elapse(elapsed);
        let mut bytes = [0; FRAME_BYTES];
        let transfer = self.spi.read(&mut bytes);
        let transfer = transfer.map(|()| &bytes).map_err(|_| BusFault);
        self.decoder.reading(transfer, 0)
    }
}

#[cfg(feature = "async")]
impl<SPI: embedded_hal_async::spi::SpiDevice> CounterBank<SPI> {
    /// Reads the frame of the period that just ended; elsewhere [`SampleSource::take`].
    ///
    /// A future that is dropped before it ends has counted its `elapsed` periods once it was polled: the next call
    /// passes its own alone.
    pub async fn take_async(&mut self, elapsed: u32) -> Reading {
        self.decoder.elapse(elapsed);
        let mut bytes = [0; FRAME_BYTES];
        let transfer = self.spi.read(&mut bytes).await;
        let transfer = transfer.map(|()| &bytes).map_err(|_| BusFault);
        self.decoder.reading(transfer, 0)
    }
}
