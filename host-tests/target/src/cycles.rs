//! Estimates the cycles of one sample statically, by LLVM's model of the Cortex-M4.
//!
//! `llvm-mca` takes the instructions of one sample, in the order in which they were executed, through its model of the
//! pipeline: one instruction a cycle in order, each result after its latency.
//!
//! It is an estimate and no measurement. It ignores flash wait states (five at 168 MHz, mostly hidden by the
//! STM32F405's accelerator while code runs straight on), the refill of the pipeline after a taken branch
//! (1 to 3 cycles), contention of the bus with DMA, and the cost of entering the interrupt (12 cycles and the
//! stored registers). The model is LLVM's, not Arm's.
//!
//! Needs `llvm-objdump` and `llvm-mca` (Debian: `apt-get install llvm`).

use std::collections::HashMap;
use std::fmt::Write as _;
use std::path::Path;
use std::process::Command;

use rlg_recording::error::InputError;
use rlg_recording::output::ScratchFolder;

const DISASSEMBLER: &str = "llvm-objdump";
const ANALYSER: &str = "llvm-mca";

/// Meaning of the estimate, to be printed with it.
pub const MEANING: &str = "static estimate by llvm-mca's Cortex-M4 model over one executed sample: no flash \
                           wait states, no pipeline refill after branches";

/// Estimates the cycles of the instructions at `addresses`, executed one after the other.
pub fn estimate(image: &Path, addresses: &[u64]) -> Result<u32, InputError> {
    let words = output(
        Command::new(DISASSEMBLER)
            .args(["--disassemble", "--no-show-raw-insn"])
            .args(["--triple=thumbv7em-none-eabihf", "--mcpu=cortex-m4"])
            .arg(image),
        DISASSEMBLER,
    )?;
    let instructions: HashMap<u64, &str> = words.lines().filter_map(instruction).collect();
    let mut assembly = String::from(".syntax unified\n.thumb\n");
    for address in addresses {
        let text = instructions.get(address).ok_or_else(|| {
            InputError::new(
                image,
                format!("has an instruction at {address:#x} that {DISASSEMBLER} does not show"),
            )
        })?;
        // A line in a String cannot fail.
        let _ = writeln!(assembly, "{}", without_targets(text));
    }

    let folder = ScratchFolder::new()?;
    let file = folder.path().join("sample.s");
    std::fs::write(&file, assembly)
        .map_err(|error| InputError::new(&file, format!("cannot be written ({error})")))?;
    let words = output(
        Command::new(ANALYSER)
            .args(["-mtriple=thumbv7em-none-eabihf", "-mcpu=cortex-m4"])
            .args(["-iterations=1", "-instruction-info=false"])
            .args(["-resource-pressure=false"])
            .arg(&file),
        ANALYSER,
    )?;
    words
        .lines()
        .find_map(|line| line.strip_prefix("Total Cycles:")?.trim().parse().ok())
        .ok_or_else(|| InputError::new(ANALYSER, "printed no total of cycles"))
}

/// Address and text in a line such as ` 8000214:      \tsub\tsp, #8`.
fn instruction(line: &str) -> Option<(u64, &str)> {
    let (address, text) = line.split_once(':')?;
    let address = u64::from_str_radix(address.trim(), 16).ok()?;
    Some((address, text.trim()))
}

/// Rewrites the instruction for an assembler that does not have the rest of the image: a branch gets some target, and
/// the disassembler's remarks are removed.
fn without_targets(text: &str) -> String {
    let text = text.split(['@', ';']).next().unwrap_or_default().trim();
    let (mnemonic, operands) = text.split_once(char::is_whitespace).unwrap_or((text, ""));
    let operands = operands.trim();
    if mnemonic.starts_with("cbz") || mnemonic.starts_with("cbnz") {
        // They reach only forward, to a label that the line would need; a conditional branch costs the same.
        return "beq elsewhere".to_owned();
    }
    let is_branch = mnemonic.starts_with('b')
        && !["bic", "bfi", "bfc", "bx", "bkpt"]
            .iter()
            .any(|other| mnemonic.starts_with(other));
    if is_branch {
        return format!("{mnemonic} elsewhere");
    }
    format!("{mnemonic} {operands}")
}

fn output(command: &mut Command, program: &str) -> Result<String, InputError> {
    let output = command.output().map_err(|error| {
        InputError::new(program, format!("cannot be started ({error})")).expected(
            "LLVM's tools to be installed: apt-get install llvm (Debian and its relatives)",
        )
    })?;
    if output.status.success() {
        return Ok(String::from_utf8_lossy(&output.stdout).into_owned());
    }
    let words = String::from_utf8_lossy(&output.stderr);
    let first = words.lines().next().unwrap_or("it gave no reason");
    Err(InputError::new(program, format!("failed: {first}")))
}

#[cfg(test)]
mod tests {
    use super::{instruction, without_targets};

    #[test]
    fn instructions_are_read_and_headings_are_not() {
        assert_eq!(
            instruction(" 8000214:      \tsub\tsp, #8"),
            Some((0x800_0214, "sub\tsp, #8"))
        );
        assert_eq!(instruction("08000210 <advance>:"), None);
    }

    #[test]
    fn branches_lose_their_target_and_nothing_else_its_operands() {
        assert_eq!(
            without_targets("bl\t0x80042f6 <f+0x2> @ imm = #-64"),
            "bl elsewhere"
        );
        assert_eq!(without_targets("bhs.w\t0x80042aa <f>"), "bhs.w elsewhere");
        assert_eq!(without_targets("cbz\tr0, 0x8004492 <f>"), "beq elsewhere");
        assert_eq!(without_targets("bic\tr0, r1, #3"), "bic r0, r1, #3");
        assert_eq!(without_targets("bx\tlr"), "bx lr");
        assert_eq!(
            without_targets("vmla.f32\ts0, s1, s2"),
            "vmla.f32 s0, s1, s2"
        );
    }
}
