//! The interrupt's path: bus → counter bank → chain → frame → queue.

use core::hint::assert_unchecked;
use core::panic::PanicInfo;

use embedded_hal::spi::{ErrorKind, ErrorType, Operation, SpiDevice};
use heapless::spsc::Producer;
use trueaxis::counter_bank::CounterBank;
use trueaxis::sample_source::SampleSource;
use trueaxis::{Chain, ChainState, F32, Fixed, NumberSystem, OutputFrame};

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

/// What the interrupt of one number system works on.
pub struct Sampling<N: NumberSystem> {
    bank: CounterBank<Bus>,
    chain: Chain<N>,
    state: ChainState<N>,
    outputs: Producer<'static, OutputFrame>,
    lost: u32,
}

impl<N: NumberSystem> Sampling<N> {
    fn tick(&mut self) {
        let reading = self.bank.take();
        let Some(sample) = reading.sample else {
            return;
        };
        inserted_panic(&sample);
        if let Some(frame) = self.chain.process(&mut self.state, &sample) {
            // SAFETY: never run; the image tells the compiler the same of its queue.
            unsafe { assert_unchecked(self.outputs.capacity() == OUTPUT_QUEUE - 1) };
            if self.outputs.enqueue(frame).is_err() {
                self.lost = self.lost.saturating_add(1);
            }
        }
    }
}

/// What the features put in to see the check fail.
#[inline(always)]
fn inserted_panic(sample: &trueaxis::Sample) {
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

/// The linker's entry: reaches the path in both number systems, with arguments that nobody knows.
#[unsafe(no_mangle)]
pub extern "C" fn interrupt_path(f32: &mut Sampling<F32>, fixed: &mut Sampling<Fixed>) {
    f32.tick();
    fixed.tick();
}
