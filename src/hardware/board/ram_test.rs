//! Tests all of RAM before anything of it is in use: at power-on, after a brown-out, and when a request has asked for it.
//!
//! `__pre_init` runs in front of the initial values of variables, and works in registers alone. March C- (van de Goor 1991)
//! over everything but what a reset keeps: write b; up: read b, write ~b; up: read ~b, write b; down: read b, write ~b; down: read
//! ~b, write b; read b; with b = 0x5555 5555. It finds cells that are stuck or do not change, addresses that reach
//! another cell or none, and words that disturb each other; of disturbances within a word only those between bits that
//! differ in b. The words that a reset keeps (`.uninit`) are complemented and restored one by one, which finds cells
//! that are stuck.
//!
//! A unit with bad RAM does not start: it sends the same frame ([`FAILED_FRAME`]) for ever, still from registers alone, on the internal
//! oscillator, and feeds the watchdog.

use core::arch::global_asm;
use core::sync::atomic::{AtomicU32, Ordering};

use crc::{CRC_16_IBM_3740, Crc};
use trueaxis::health::item;
use trueaxis::telemetry::TELEMETRY_VERSION;
use trueaxis::{SelfTest, Status, TELEMETRY_BYTES};

/// "TEST": the run before asked for the test. Anything else is random content after power-on.
const REQUESTED: u32 = u32::from_le_bytes(*b"TEST");

/// "RAM!": the test was done, and RAM is good.
const DONE: u32 = u32::from_le_bytes(*b"RAM!");

/// Not cleared and not loaded at boot.
#[unsafe(link_section = ".uninit.TEST_REQUEST")]
static TEST_REQUEST: AtomicU32 = AtomicU32::new(0);

/// [`DONE`] from `__pre_init`; random content after power-on in front of it.
#[unsafe(link_section = ".uninit.RAM_TEST_RESULT")]
static RAM_TEST_RESULT: AtomicU32 = AtomicU32::new(0);

/// Frame of a unit with bad RAM: no sample, and the result of the test.
static FAILED_FRAME: [u8; TELEMETRY_BYTES] = failed_frame();

const fn failed_frame() -> [u8; TELEMETRY_BYTES] {
    let mut bytes = [0; TELEMETRY_BYTES];
    let header = [0xEB, 0x90, TELEMETRY_VERSION, TELEMETRY_BYTES as u8];
    let status = Status::SAMPLE_LOST.union(Status::GAP).bits().to_le_bytes();
    let mut result = SelfTest::from_word(0);
    (result.ram_tested, result.ram_failed) = (true, true);
    let word = result.to_word().to_le_bytes();
    let mut at = 0;
    while at < 4 {
        bytes[at] = header[at];
        bytes[32 + at] = status[at];
        bytes[37 + at] = word[at];
        at += 1;
    }
    bytes[36] = item::SELF_TEST;
    let (covered, _) = bytes.split_at(TELEMETRY_BYTES - 2);
    let sum = Crc::<u16>::new(&CRC_16_IBM_3740).checksum(covered);
    [bytes[41], bytes[42]] = sum.to_le_bytes();
    bytes
}

/// Asks the next boot for the test.
pub fn request() {
    TEST_REQUEST.store(REQUESTED, Ordering::Relaxed);
    cortex_m::asm::dsb();
}

/// The test as this boot has done it, once.
pub struct RamTest {
    /// RAM was tested, and is good.
    pub is_done: bool,
    /// The run before has asked for it.
    pub was_commanded: bool,
}

/// Takes the result of this boot.
pub fn take() -> RamTest {
    let take = |word: &AtomicU32, mark| {
        let is_marked = word.load(Ordering::Relaxed) == mark;
        word.store(0, Ordering::Relaxed);
        is_marked
    };
    RamTest {
        is_done: take(&RAM_TEST_RESULT, DONE),
        was_commanded: take(&TEST_REQUEST, REQUESTED),
    }
}

// Registers: r0 to r1 the range, r2 expected, r3 written, r4 read, r6 every bit that was wrong, r7 and r12 return addresses; r8 to r9
// and r10 to r11 the two parts of RAM around the words that a reset keeps. RM0090: RCC_CSR 7.3.21, GPIO 8.4, USART 30.6,
// IWDG 21.4.
global_asm!(
    "
    .section .text.__pre_init, \"ax\", %progbits
    .syntax unified
    .global __pre_init
    .type __pre_init, %function
    .thumb_func
    .cfi_startproc
__pre_init:
    ldr   r0, =0x40023874       // RCC_CSR
    ldr   r1, [r0]
    tst   r1, #0x0A000000       // BORRSTF, PORRSTF
    bne   10f
    ldr   r0, ={request}
    ldr   r1, [r0]
    ldr   r2, ={requested}
    cmp   r1, r2
    it    ne
    bxne  lr
10: mov   r12, lr
    ldr   r8, =_ram_start
    ldr   r9, =__suninit
    bic   r9, r9, #15
    ldr   r10, =__euninit
    add   r10, r10, #15
    bic   r10, r10, #15
    ldr   r11, =_ram_end
    // The march: six elements, each over both parts.
    ldr   r3, =0x55555555
    bl    20f
    movs  r6, #0
    mov   r2, r3
    mvn   r3, r3
    bl    20f
    mov   r2, r3
    mvn   r3, r3
    bl    20f
    mov   r2, r3
    mvn   r3, r3
    bl    30f
    mov   r2, r3
    mvn   r3, r3
    bl    30f
    mov   r2, r3
    bl    20f
    // The words that a reset keeps.
    mov   r0, r9
11: cmp   r0, r10
    beq   12f
    ldr   r4, [r0]
    mvn   r2, r4
    str   r2, [r0]
    ldr   r3, [r0]
    eor   r3, r3, r2
    orr   r6, r6, r3
    str   r4, [r0]
    ldr   r3, [r0], #4
    eor   r3, r3, r4
    orr   r6, r6, r3
    b     11b
12: // A watchdog that an option byte starts at power-on; one that does not run takes no notice.
    ldr   r4, =0x40003000       // IWDG_KR
    movw  r5, #0xAAAA
    str   r5, [r4]
    cmp   r6, #0
    bne   40f
    ldr   r0, ={result}
    ldr   r1, ={done}
    str   r1, [r0]
    mov   lr, r12
    bx    lr

20: // Upwards over both parts.
    mov   r7, lr
    mov   r0, r8
    mov   r1, r9
    bl    21f
    mov   r0, r10
    mov   r1, r11
    bl    21f
    mov   lr, r7
    bx    lr
21: cmp   r0, r1
    it    eq
    bxeq  lr
22: .rept 4
    ldr   r4, [r0]
    eor   r4, r4, r2
    orr   r6, r6, r4
    str   r3, [r0], #4
    .endr
    cmp   r0, r1
    bne   22b
    bx    lr

30: // Downwards over both parts.
    mov   r7, lr
    mov   r0, r10
    mov   r1, r11
    bl    31f
    mov   r0, r8
    mov   r1, r9
    bl    31f
    mov   lr, r7
    bx    lr
31: cmp   r0, r1
    it    eq
    bxeq  lr
32: .rept 4
    ldr   r4, [r1, #-4]!
    eor   r4, r4, r2
    orr   r6, r6, r4
    str   r3, [r1]
    .endr
    cmp   r0, r1
    bne   32b
    bx    lr

40: // Bad: USART1 at 16 MHz / 16, from PA9; PA8 enables the line's driver.
    ldr   r0, =0x40023800       // RCC
    ldr   r1, [r0, #0x30]
    orr   r1, r1, #0x01         // AHB1ENR: GPIOA
    str   r1, [r0, #0x30]
    ldr   r1, [r0, #0x30]
    ldr   r1, [r0, #0x44]
    orr   r1, r1, #0x10         // APB2ENR: USART1
    str   r1, [r0, #0x44]
    ldr   r1, [r0, #0x44]
    dsb
    ldr   r6, =0x40020000       // GPIOA
    ldr   r1, [r6, #0x24]
    orr   r1, r1, #0x70         // AFRH: PA9 is USART1's
    str   r1, [r6, #0x24]
    ldr   r1, [r6]
    orr   r1, r1, #0x90000      // MODER: PA8 output, PA9 alternate
    str   r1, [r6]
    ldr   r0, =0x40011000       // USART1
    movs  r1, #16
    str   r1, [r0, #0x08]       // BRR
    movw  r1, #0x2008
    str   r1, [r0, #0x0C]       // CR1: UE, TE
    mov   r8, #0x100
    mov   r9, #0x1000000
41: str   r8, [r6, #0x18]       // BSRR: PA8 high, 2 us before the first bit
    movs  r3, #16
45: subs  r3, r3, #1
    bne   45b
    ldr   r1, ={frame}
    add   r2, r1, #{frame_bytes}
42: ldr   r3, [r0]
    tst   r3, #0x80             // SR: TXE
    beq   42b
    ldrb  r3, [r1], #1
    str   r3, [r0, #0x04]       // DR
    cmp   r1, r2
    bne   42b
43: ldr   r3, [r0]
    tst   r3, #0x40             // SR: TC
    beq   43b
    str   r9, [r6, #0x18]       // BSRR: PA8 low
    str   r5, [r4]
    // 10 ms: 4 cycles each.
    movw  r3, #40000
44: subs  r3, r3, #1
    bne   44b
    b     41b
    .ltorg
    .cfi_endproc
    .size __pre_init, . - __pre_init
    .text
    ",
    request = sym TEST_REQUEST,
    requested = const REQUESTED,
    result = sym RAM_TEST_RESULT,
    done = const DONE,
    frame = sym FAILED_FRAME,
    frame_bytes = const TELEMETRY_BYTES,
);
