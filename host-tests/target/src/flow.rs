//! Finds the loops of a function from its instructions.
//!
//! From a function's instructions in address order it gives the address of each loop's head: an instruction that a path
//! from the function's entry reaches again by a jump back.
//!
//! Successors of an instruction: the next one, the target of a branch, the entries of a table of branches (TBB, TBH). A
//! conditional instruction of an IT block always has the next one as a successor (ARMv7-M reference manual, A7.3).
//! Blocks that the compiler moved to the function's end and that jump back are no loops and are not reported.
//!
//! The number of turns of a loop must be read from its source.

use std::collections::{BTreeMap, BTreeSet};

/// One instruction.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Instruction {
    /// Its address.
    pub address: u64,
    /// Its first halfword.
    pub first: u32,
    /// Its second; 0 for a narrow one.
    pub second: u32,
    /// Target of a branch that is no call.
    pub jump: Option<u64>,
    /// Target of a call.
    pub call: Option<u64>,
    /// Targets of a table of branches.
    pub table: Vec<u64>,
}

impl Instruction {
    fn bytes(&self) -> u64 {
        if self.first >> 11 >= 0b11101 { 4 } else { 2 }
    }

    /// True if the next one never follows: B, BX, POP or LDM or LDR of the program counter, UDF, TBB, TBH.
    fn ends(&self) -> bool {
        let (first, second) = (self.first, self.second);
        first & 0xF800 == 0xE000
            || first & 0xFF87 == 0x4700
            || first & 0xFF00 == 0xBD00
            || first & 0xFF00 == 0xDE00
            || first == 0xE8BD && second & 0x8000 != 0
            || first & 0xFFF0 == 0xF850 && second & 0xF000 == 0xF000
            || first & 0xFFF0 == 0xE8D0 && second & 0xFFE0 == 0xF000
            || first & 0xFFF0 == 0xF7F0 && second & 0xF000 == 0xA000
            || first & 0xF800 == 0xF000 && second & 0xD000 == 0x9000
    }

    /// Instructions that the IT block beginning here makes conditional.
    fn conditional_after(&self) -> u32 {
        if self.first & 0xFF00 == 0xBF00 && self.first & 0xF != 0 {
            4 - (self.first & 0xF).trailing_zeros()
        } else {
            0
        }
    }
}

/// Addresses that may follow each of `instructions`, by its address; those outside the function included.
pub fn successors(instructions: &[Instruction]) -> BTreeMap<u64, Vec<u64>> {
    let mut ways: BTreeMap<u64, Vec<u64>> = BTreeMap::new();
    let mut conditional = 0u32;
    for instruction in instructions {
        let mut on: Vec<u64> = instruction
            .jump
            .into_iter()
            .chain(instruction.table.iter().copied())
            .collect();
        if conditional > 0 || !instruction.ends() {
            on.push(instruction.address + instruction.bytes());
        }
        conditional = match instruction.conditional_after() {
            0 => conditional.saturating_sub(1),
            beginning => beginning,
        };
        ways.insert(instruction.address, on);
    }
    ways
}

/// Jumps from an address to one on the way from `begin` to it: origin and target.
pub fn jumps_back(begin: u64, ways: &BTreeMap<u64, Vec<u64>>) -> BTreeSet<(u64, u64)> {
    let mut back = BTreeSet::new();
    let mut done = BTreeSet::new();
    let mut on_the_way = BTreeSet::new();
    // Depth first; the untried successors of each instruction on the way.
    let mut path: Vec<(u64, Vec<u64>)> = Vec::new();
    if let Some(on) = ways.get(&begin) {
        on_the_way.insert(begin);
        path.push((begin, on.clone()));
    }
    while let Some((at, left)) = path.last_mut() {
        let Some(next) = left.pop() else {
            on_the_way.remove(at);
            done.insert(*at);
            path.pop();
            continue;
        };
        if on_the_way.contains(&next) {
            back.insert((*at, next));
        } else if !done.contains(&next)
            && let Some(on) = ways.get(&next)
        {
            on_the_way.insert(next);
            path.push((next, on.clone()));
        }
    }
    back
}

/// Heads of the loops among `instructions`, which begin with the function's first.
pub fn loop_heads(instructions: &[Instruction]) -> BTreeSet<u64> {
    let Some(first) = instructions.first() else {
        return BTreeSet::new();
    };
    let back = jumps_back(first.address, &successors(instructions));
    back.into_iter().map(|(_, head)| head).collect()
}

#[cfg(test)]
mod tests {
    use super::{Instruction, loop_heads};

    /// Instructions of two bytes from 0x100 on; each with the target of its jump, if it has one.
    fn function(instructions: &[(u32, Option<u64>)]) -> Vec<Instruction> {
        instructions
            .iter()
            .enumerate()
            .map(|(at, (first, jump))| Instruction {
                address: 0x100 + 2 * at as u64,
                first: *first,
                second: 0,
                jump: *jump,
                call: None,
                table: Vec::new(),
            })
            .collect()
    }

    const NOP: u32 = 0xBF00;
    const RETURN: u32 = 0x4770;
    const BRANCH: u32 = 0xE000;
    const BRANCH_IF_EQUAL: u32 = 0xD000;

    #[test]
    fn a_jump_back_on_the_way_is_a_loop() {
        let code = [
            (NOP, None),
            (NOP, None),
            (BRANCH_IF_EQUAL, Some(0x102)),
            (RETURN, None),
        ];
        assert_eq!(
            loop_heads(&function(&code)).into_iter().collect::<Vec<_>>(),
            [0x102]
        );
    }

    #[test]
    fn a_block_moved_to_the_end_that_jumps_back_is_none() {
        let code = [
            (BRANCH_IF_EQUAL, Some(0x106)),
            (NOP, None),
            (RETURN, None),
            (NOP, None),
            (BRANCH, Some(0x102)),
        ];
        assert!(loop_heads(&function(&code)).is_empty());
    }

    #[test]
    fn a_conditional_return_lets_the_next_instruction_follow() {
        const IF_EQUAL: u32 = 0xBF08;
        let code = [
            (NOP, None),
            (IF_EQUAL, None),
            (RETURN, None),
            (BRANCH, Some(0x100)),
        ];
        assert_eq!(loop_heads(&function(&code)).len(), 1);
        // Without the condition nothing follows a return.
        let code = [(NOP, None), (RETURN, None), (BRANCH, Some(0x100))];
        assert!(loop_heads(&function(&code)).is_empty());
    }
}
