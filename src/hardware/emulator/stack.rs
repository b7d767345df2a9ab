//! Measures how deep the stack went \[bytes\], by painting.
//!
//! cortex-m-rt paints the memory before `main`. A measurement is a lower bound of the worst case: it covers only the
//! paths of this run.

use core::ptr;

use cortex_m_rt::STACK_PAINT_VALUE;

unsafe extern "C" {
    /// Top of the stack, from the linker script: the first address above it.
    static _stack_start: u32;
    /// Lowest address that the stack may use, from the linker script.
    static _stack_end: u32;
}

/// Size of the memory set aside for the stack \[bytes\].
pub fn size_bytes() -> u32 {
    (ptr::addr_of!(_stack_start).addr() - ptr::addr_of!(_stack_end).addr()) as u32
}

/// Deepest use of the stack so far \[bytes\].
pub fn used_bytes() -> u32 {
    let top = ptr::addr_of!(_stack_start);
    let mut word = ptr::addr_of!(_stack_end);
    while word < top {
        // SAFETY: `word` lies between the linker's two symbols, in RAM, aligned to 4 bytes (link.x asserts
        // it); volatile, because the compiler knows of no object there.
        if unsafe { word.read_volatile() } != STACK_PAINT_VALUE {
            break;
        }
        word = word.wrapping_add(1);
    }
    (top.addr() - word.addr()) as u32
}
