//! Plays the counter bank from a file: an `SpiDevice` whose frames come from [`BankRecord`]s.
//!
//! The main loop reads records ahead from `frames.bin`. Each puts its frame on the bus and may ask for time, a bus
//! error, or a serial link that stands still ([`LINK_HELD`]). An empty queue is a bus error too.

use core::hint::assert_unchecked;
use core::sync::atomic::{AtomicBool, Ordering};

use embedded_hal::spi::{Error, ErrorKind, ErrorType, Operation, SpiDevice};
use heapless::spsc::{Consumer, Producer, Queue};
use semihosting::fs::File;
use semihosting::io::{self, Read};
use stm32f4::stm32f405::TIM5;
use trueaxis::bank_record::{BankRecord, HOLD_PARTS};

/// Slots of the queue of records, one of which stays empty. A power of two, because the queue divides by
/// it at every step.
const RECORD_QUEUE: usize = 128;

/// Records read from the host at a time: enough that the host call is rare, few enough that the queue holds
/// two blocks, so that one can be filled while the other is used.
const BLOCK_RECORDS: usize = 60;

const _: () = assert!(RECORD_QUEUE > 2 * BLOCK_RECORDS);

/// True while the serial link is to stand still.
pub static LINK_HELD: AtomicBool = AtomicBool::new(false);

/// Queue of records from the main loop to the interrupt.
pub type Records = Queue<BankRecord, RECORD_QUEUE>;

/// The bank as the interrupt's bus sees it.
pub struct BankFile {
    records: Consumer<'static, BankRecord>,
    /// \[ticks of TIM5\]
    part_ticks: u32,
}

/// The bus error of a record that asks for one, or of a bank without records.
#[derive(Debug)]
pub struct NoFrame;

impl Error for NoFrame {
    fn kind(&self) -> ErrorKind {
        ErrorKind::Other
    }
}

impl BankFile {
    /// Plays the records from the queue `records`; a period lasts `period_ticks` of TIM5.
    pub fn new(records: Consumer<'static, BankRecord>, period_ticks: u32) -> Self {
        Self {
            records,
            part_ticks: period_ticks / HOLD_PARTS,
        }
    }
}

impl ErrorType for BankFile {
    type Error = NoFrame;
}

impl SpiDevice for BankFile {
    #[inline]
    fn transaction(&mut self, operations: &mut [Operation<'_, u8>]) -> Result<(), NoFrame> {
        let begin = ticks();
        // The queue's end knows its length only at run time; with it, the compiler needs neither a division nor the
        // panic of a division by zero. SAFETY: the queue has RECORD_QUEUE slots, and a queue's length never changes.
        unsafe { assert_unchecked(self.records.capacity() == RECORD_QUEUE - 1) };
        let record = self.records.dequeue().ok_or(NoFrame)?;
        LINK_HELD.store(record.link_held, Ordering::Relaxed);
        let hold_ticks = u32::from(record.hold).wrapping_mul(self.part_ticks);
        while ticks().wrapping_sub(begin) < hold_ticks {}
        if record.bus_error {
            return Err(NoFrame);
        }
        let mut wire: &[u8] = &record.frame;
        for operation in operations {
            match operation {
                Operation::Read(bytes)
                | Operation::TransferInPlace(bytes)
                | Operation::Transfer(bytes, _) => {
                    for (byte, on_wire) in bytes.iter_mut().zip(wire) {
                        *byte = *on_wire;
                    }
                    for byte in bytes.iter_mut().skip(wire.len()) {
                        *byte = 0;
                    }
                    wire = wire.get(bytes.len()..).unwrap_or(&[]);
                }
                Operation::Write(_) | Operation::DelayNs(_) => {}
            }
        }
        Ok(())
    }
}

/// Reading of TIM5 \[ticks\].
pub fn ticks() -> u32 {
    // SAFETY: reading the count has no effect; the sample timer, which owns the peripheral, has started it.
    unsafe { (*TIM5::ptr()).cnt().read().bits() }
}

/// Fills the queue from the file, whole blocks at a time, while there is room for one; a part of a record
/// at the file's end is left out.
// Its buffer would lie on the stack of the whole run.
#[inline(never)]
pub fn read_ahead(input: &mut File, queue: &mut Producer<'static, BankRecord>) -> io::Result<()> {
    while queue.capacity() - queue.len() >= BLOCK_RECORDS {
        let mut block = [0; BLOCK_RECORDS * BankRecord::BYTES];
        let length = read_up_to(input, &mut block)?;
        for bytes in block[..length].as_chunks().0 {
            // There is room: it was counted above, and only this end fills the queue.
            let _ = queue.enqueue(BankRecord::from_bytes(bytes));
        }
        if length < block.len() {
            break;
        }
    }
    Ok(())
}

/// Reads until `buffer` is full or the file ends; returns the number of bytes read.
fn read_up_to(input: &mut File, buffer: &mut [u8]) -> io::Result<usize> {
    let mut length = 0;
    while length < buffer.len() {
        match input.read(&mut buffer[length..])? {
            0 => break,
            more => length += more,
        }
    }
    Ok(length)
}
