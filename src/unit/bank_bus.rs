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

use crate::unit::counter_bank::{
    AccelerometerInput, BankDecoder, BusFault, FRAME_BYTES, FRAME_BYTES_V2, WireBytes,
};
use crate::unit::sample_source::{Reading, SampleSource};

/// The bank behind `SPI`, a blocking or an asynchronous `SpiDevice`; its frames have `BYTES` bytes.
#[derive(Debug)]
pub struct CounterBank<SPI, const BYTES: usize = FRAME_BYTES> {
    spi: SPI,
    decoder: BankDecoder,
}

impl<SPI> CounterBank<SPI> {
    /// A bank that has not been read yet.
    pub fn new(spi: SPI, accelerometers: AccelerometerInput) -> Self {
        Self::begin(spi, accelerometers)
    }
}

impl<SPI> CounterBank<SPI, FRAME_BYTES_V2> {
    /// A bank that sends frames of version 2, without slow channels and time, and has not been read yet.
    pub fn of_version_2(spi: SPI, accelerometers: AccelerometerInput) -> Self {
        Self::begin(spi, accelerometers)
    }
}

impl<SPI, const BYTES: usize> CounterBank<SPI, BYTES> {
    fn begin(spi: SPI, accelerometers: AccelerometerInput) -> Self {
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

impl<SPI: SpiDevice, const BYTES: usize> SampleSource for CounterBank<SPI, BYTES>
where
    [u8; BYTES]: WireBytes,
{
    #[inline]
    fn take(&mut self, elapsed: u32) -> Reading {
        self.decoder.elapse(elapsed);
        let mut bytes = [0; BYTES];
        let transfer = self.spi.read(&mut bytes);
        let transfer = transfer.map(|()| &bytes).map_err(|_| BusFault);
        self.decoder.reading(transfer, 0)
    }
}

#[cfg(feature = "async")]
impl<SPI: embedded_hal_async::spi::SpiDevice, const BYTES: usize> CounterBank<SPI, BYTES>
where
    [u8; BYTES]: WireBytes,
{
    /// Reads the frame of the period that just ended; elsewhere [`SampleSource::take`].
    ///
    /// A future that is dropped before it ends has counted its `elapsed` periods once it was polled: the next call
    /// passes its own alone.
    pub async fn take_async(&mut self, elapsed: u32) -> Reading {
        self.decoder.elapse(elapsed);
        let mut bytes = [0; BYTES];
        let transfer = self.spi.read(&mut bytes).await;
        let transfer = transfer.map(|()| &bytes).map_err(|_| BusFault);
        self.decoder.reading(transfer, 0)
    }
}
