//! Entry into an exception and return from it, as the processor does both (ARMv7-M reference manual B1.5.6 and B1.5.8): a frame
//! of 26 words, with the floating-point registers.
//!
//! Unicorn has neither: the frame is written here, and a branch to [`RETURN`] ends its run.

use unicorn_engine::{RegisterARM, Unicorn, uc_error};

use crate::board::Board;

/// Value of the link register in a handler: return to thread mode, main stack, with a floating-point frame.
pub const RETURN: u32 = 0xFFFF_FFE9;

/// Words of a frame.
const WORDS: usize = 26;

/// Bit of the stored status for an aligned stack.
const ALIGNED: u32 = 1 << 9;

/// Thumb bit of the status.
const THUMB: u32 = 1 << 24;

/// R0 to R3, R12, LR: words 0 to 5.
const CORE: [RegisterARM; 6] = [
    RegisterARM::R0,
    RegisterARM::R1,
    RegisterARM::R2,
    RegisterARM::R3,
    RegisterARM::R12,
    RegisterARM::LR,
];

/// S0 to S15, words 8 to 23, as Unicorn's consecutive numbers.
fn single(number: usize) -> i32 {
    RegisterARM::S0 as i32 + number as i32
}

/// Enters the handler at `handler`, which returns to `pc`.
pub fn enter(cpu: &mut Unicorn<'_, Board>, pc: u32, handler: u32) -> Result<(), uc_error> {
    let sp = cpu.reg_read(RegisterARM::SP)? as u32;
    let frame = (sp - 4 * WORDS as u32) & !7;
    let aligned = if sp.is_multiple_of(8) { 0 } else { ALIGNED };
    let mut words = [0; WORDS];
    for (word, register) in words.iter_mut().zip(CORE) {
        *word = cpu.reg_read(register)? as u32;
    }
    words[6] = pc & !1;
    words[7] = cpu.reg_read(RegisterARM::XPSR)? as u32 & 0xF80F_0000 | THUMB | aligned;
    for number in 0..16 {
        words[8 + number] = cpu.reg_read(single(number))? as u32;
    }
    words[24] = cpu.reg_read(RegisterARM::FPSCR)? as u32;
    let bytes: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
    cpu.mem_write(u64::from(frame), &bytes)?;
    cpu.reg_write(RegisterARM::SP, u64::from(frame))?;
    cpu.reg_write(RegisterARM::LR, u64::from(RETURN))?;
    cpu.set_pc(u64::from(handler | 1))
}

/// Returns from a handler; gives the address to go on at.
pub fn leave(cpu: &mut Unicorn<'_, Board>) -> Result<u32, uc_error> {
    let frame = cpu.reg_read(RegisterARM::SP)?;
    let mut bytes = [0; 4 * WORDS];
    cpu.mem_read(frame, &mut bytes)?;
    let mut words = [0; WORDS];
    for (word, bytes) in words.iter_mut().zip(bytes.as_chunks::<4>().0) {
        *word = u32::from_le_bytes(*bytes);
    }
    for (word, register) in words.iter().zip(CORE) {
        cpu.reg_write(register, u64::from(*word))?;
    }
    for number in 0..16 {
        cpu.reg_write(single(number), u64::from(words[8 + number]))?;
    }
    cpu.reg_write(RegisterARM::FPSCR, u64::from(words[24]))?;
    cpu.reg_write(RegisterARM::APSR_NZCVQG, u64::from(words[7] & 0xF80F_0000))?;
    let mut sp = frame + 4 * WORDS as u64;
    if words[7] & ALIGNED != 0 {
        sp += 4;
    }
    cpu.reg_write(RegisterARM::SP, sp)?;
    Ok(words[6])
}
