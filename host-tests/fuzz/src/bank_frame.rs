//! Feeds any frames, errors and check sums from the bus of the counter bank into the processor.
//!
//! Checks: no panic; a sample comes only from a frame with a valid check sum; a decoded frame encodes to the same bytes,
//! the two without a meaning apart.
#![no_main]

use std::collections::VecDeque;

use embedded_hal::spi::{ErrorKind, ErrorType, Operation, SpiDevice};
use libfuzzer_sys::fuzz_target;
use trueaxis::bank_bus::CounterBank;
use trueaxis::counter_bank::{AccelerometerInput, BankFrame, FRAME_BYTES, checksum};
use trueaxis::processor::{BootReport, Processor, Timing};
use trueaxis::sample_source::SampleSource;
use trueaxis::{Fixed, Parameters};

/// Offset of the two bytes without a meaning, which a bank of a later version may use.
const SPARE: usize = 44;

fuzz_target!(|data: &[u8]| {
    let [options, data @ ..] = data else {
        return;
    };
    let input = match options & 1 {
        0 => AccelerometerInput::Counters,
        _ => AccelerometerInput::Codes,
    };
    let parameters =
        Parameters::default().with(|p| p.samples_per_output = 1 + u16::from(options >> 1) % 40);
    let mut processor =
        Processor::<Fixed>::new(&parameters, BootReport::default()).expect("parameters in range");
    let transfers: Vec<&[u8]> = data.chunks_exact(1 + FRAME_BYTES).collect();
    let wire: VecDeque<_> = transfers.iter().map(|transfer| on_wire(transfer)).collect();
    let mut bank = CounterBank::new(Bus(wire.clone()), input);
    for (transfer, bytes) in transfers.iter().zip(wire) {
        let frame = bytes.map(|bytes| BankFrame::from_bytes(&bytes));
        if let (Some(bytes), Some(Ok(frame))) = (bytes, frame) {
            assert_eq!(frame.to_bytes()[..SPARE], bytes[..SPARE]);
            assert_eq!(BankFrame::from_bytes(&frame.to_bytes()), Ok(frame));
        }
        let timing = Timing {
            missed: u32::from(transfer[0] >> 4),
            late: transfer[0] & 8 != 0,
        };
        let reading = bank.take(timing.missed + 1);
        assert!(reading.sample.is_none() || matches!(frame, Some(Ok(_))));
        processor.period(reading, timing);
    }
});

/// Returns the transfer selected by the first byte: a bus error, the other bytes unchanged, or a whole frame of them.
fn on_wire(transfer: &[u8]) -> Option<[u8; FRAME_BYTES]> {
    let mut bytes = [0; FRAME_BYTES];
    bytes.copy_from_slice(&transfer[1..]);
    match transfer[0] & 7 {
        0 => return None,
        1 => {}
        _ => {
            let crc = checksum(&bytes).to_le_bytes();
            bytes[FRAME_BYTES - 2..].copy_from_slice(&crc);
        }
    }
    Some(bytes)
}

/// Yields one transfer after the other, or an error for a missing one.
struct Bus(VecDeque<Option<[u8; FRAME_BYTES]>>);

impl ErrorType for Bus {
    type Error = ErrorKind;
}

impl SpiDevice for Bus {
    fn transaction(&mut self, operations: &mut [Operation<'_, u8>]) -> Result<(), ErrorKind> {
        let bytes = self.0.pop_front().flatten().ok_or(ErrorKind::Other)?;
        for operation in operations {
            if let Operation::Read(wanted) = operation {
                wanted.copy_from_slice(&bytes);
            }
        }
        Ok(())
    }
}
