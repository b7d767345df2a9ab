//! The interrupt's path: bus → counter bank → processor (chain, health) → trace and queue; and the frame's
//! bytes, which the serial port's interrupt may ask for.

use core::hint::assert_unchecked;
use core::panic::PanicInfo;

use embedded_hal::spi::{ErrorKind, ErrorType, Operation, SpiDevice};
use heapless::spsc::Producer;
use trueaxis::bank_bus::CounterBank;
use trueaxis::processor::{Processor, Timing};
use trueaxis::sample_source::SampleSource;
use trueaxis::telemetry::TELEMETRY_BYTES;
use trueaxis::telemetry_frame::TelemetryFrame;
use trueaxis::trace::{TraceEntry, TraceRing};
use trueaxis::{F32, Fixed, NumberSystem};

unsafe extern "C" {
    /// Defined nowhere: its name is the linker's message.
    fn the_interrupt_can_panic() -> !;
}

#[panic_handler]
fn panic(_: &PanicInfo<'_>) -> ! {
    // SAFETY: never linked, so never called.
    unsafe { the_interrupt_can_panic() }
}

/// A bus of which the compiler knows nothing: any byte, or an error, may come from it.
pub struct Bus {
    data: *const u8,
    failed: *const bool,
}

impl ErrorType for Bus {
    type Error = ErrorKind;
}

impl SpiDevice for Bus {
    fn transaction(&mut self, operations: &mut [Operation<'_, u8>]) -> Result<(), ErrorKind> {
        for operation in operations {
            if let Operation::Read(bytes) | Operation::Transfer(bytes, _) = operation {
                for byte in bytes.iter_mut() {
                    // SAFETY: never run; volatile, so that the compiler assumes nothing of the value.
                    *byte = unsafe { self.data.read_volatile() };
                }
            }
        }
        // SAFETY: as above.
        if unsafe { self.failed.read_volatile() } {
            return Err(ErrorKind::Other);
        }
        Ok(())
    }
}

/// Slots of the queue, as in the image.
const OUTPUT_QUEUE: usize = 128;

/// Data of the interrupt of one number system.
pub struct Sampling<N: NumberSystem> {
    bank: CounterBank<Bus>,
    processor: Processor<N>,
    trace: TraceRing<256>,
    outputs: Producer<'static, TelemetryFrame>,
    bytes: [u8; TELEMETRY_BYTES],
}

impl<N: NumberSystem> Sampling<N> {
    fn tick(&mut self, timing: Timing) {
        let reading = self.bank.take(timing.missed.saturating_add(1));
        inserted_panic(reading.sample.unwrap_or_default());
        let frame = self.processor.period(reading, timing);
        let entry = TraceEntry::new(
            self.processor.periods(),
            self.processor.period_status(),
            0,
            reading.sample,
        );
        self.trace.record(entry, self.processor.has_latched_fault());
        let Some(frame) = frame else {
            return;
        };
        self.bytes = frame.to_bytes();
        // SAFETY: never run; the image makes the same assumption of its queue.
        unsafe { assert_unchecked(self.outputs.capacity() == OUTPUT_QUEUE - 1) };
        if self.outputs.enqueue(frame).is_err() {
            self.processor.output_overrun();
        }
    }
}

/// Panics inserted by the features, to see the check fail.
#[inline(always)]
fn inserted_panic(sample: trueaxis::Sample) {
    let [x, y, _] = sample.pulse_counts;
    if cfg!(feature = "panic-by-index") {
        core::hint::black_box(sample.pickoff_codes[x as usize]);
    }
    if cfg!(feature = "panic-by-division") {
        core::hint::black_box(x / y);
    }
    if cfg!(feature = "panic-by-unwrap") {
        core::hint::black_box(x.checked_add(y).unwrap());
    }
}

/// The linker's entry: reaches the path in both number systems, with arguments that the compiler does not know.
#[unsafe(no_mangle)]
pub extern "C" fn interrupt_path(
    f32: &mut Sampling<F32>,
    fixed: &mut Sampling<Fixed>,
    missed: u32,
    late: bool,
) {
    f32.tick(Timing { missed, late });
    fixed.tick(Timing { missed, late });
}
