//! What the sampling interrupt can reach, read off the linked image: no panic, no logging, no host call.
//!
//! Walks the direct calls and jumps (BL, B.W; ARMv7-M reference manual A7.7.12 and A7.7.18) from the symbol
//! `TIM2`. A call through a register would hide its target, so there must be none. Data between
//! instructions is told apart by the mapping symbols $t and $d (ELF for the Arm Architecture, 5.5.5).

use std::collections::{BTreeMap, BTreeSet};

use object::{Object, ObjectSection, ObjectSymbol};
use rlg::target::{Image, TargetCore};

/// Code of the image and where things begin in it.
struct Code {
    begin: u64,
    bytes: Vec<u8>,
    /// Functions by address, without the Thumb bit.
    functions: BTreeMap<u64, String>,
    /// Whether what begins here is data, by address.
    is_data: BTreeMap<u64, bool>,
}

impl Code {
    fn of(elf: &[u8]) -> Self {
        let file = object::File::parse(elf).expect("an ELF file");
        let text = file.section_by_name(".text").expect("code");
        let mut functions = BTreeMap::new();
        let mut is_data = BTreeMap::new();
        for symbol in file.symbols() {
            let name = symbol.name().unwrap_or_default();
            if name.starts_with("$t") || name.starts_with("$d") {
                is_data.insert(symbol.address(), name.starts_with("$d"));
            } else if symbol.kind() == object::SymbolKind::Text && !name.is_empty() {
                functions.insert(symbol.address() & !1, name.to_owned());
            }
        }
        Self {
            begin: text.address(),
            bytes: text.data().expect("the code's bytes").to_vec(),
            functions,
            is_data,
        }
    }

    fn halfword(&self, address: u64) -> u32 {
        let at = (address - self.begin) as usize;
        u32::from(u16::from_le_bytes([self.bytes[at], self.bytes[at + 1]]))
    }

    /// The function that holds `address`.
    fn function(&self, address: u64) -> (u64, &str) {
        let (begin, name) = self
            .functions
            .range(..=address)
            .next_back()
            .expect("a function");
        (*begin, name)
    }

    /// Where the function at `begin` calls or jumps to; panics on a call through a register.
    fn targets(&self, begin: u64) -> Vec<u64> {
        let end = self
            .functions
            .range(begin + 1..)
            .next()
            .map_or(self.begin + self.bytes.len() as u64, |(next, _)| *next);
        let mut targets = Vec::new();
        let mut at = begin;
        while at < end {
            if self
                .is_data
                .range(..=at)
                .next_back()
                .is_some_and(|(_, data)| *data)
            {
                at += 2;
                continue;
            }
            let first = self.halfword(at);
            // BX and BLX Rm: 0100 0111 Lmmm m000; BX LR is the return.
            assert!(
                first & 0xFF07 != 0x4700 || first == 0x4770,
                "a call through a register at {at:#x} in {}",
                self.function(at).1
            );
            // The first five bits 0b11101, 0b11110 and 0b11111 begin an instruction of two halfwords.
            if first >> 11 < 0b11101 {
                at += 2;
                continue;
            }
            let second = self.halfword(at + 2);
            if first & 0xF800 == 0xF000 && second & 0x9000 == 0x9000 {
                targets.push(branch_target(at, first, second));
            }
            at += 4;
        }
        targets
    }

    /// Every function that `from` can reach.
    fn reachable(&self, from: &str) -> BTreeSet<String> {
        let (start, _) = self
            .functions
            .iter()
            .find(|(_, name)| *name == from)
            .expect("the interrupt is in the image");
        let mut open = vec![*start];
        let mut seen = BTreeSet::new();
        while let Some(begin) = open.pop() {
            if seen.insert(begin) {
                open.extend(
                    self.targets(begin)
                        .into_iter()
                        .map(|target| self.function(target).0),
                );
            }
        }
        seen.into_iter()
            .map(|begin| self.functions[&begin].clone())
            .collect()
    }
}

/// Target of a BL or B.W (encoding T4): a signed offset of 25 bits from 4 beyond the instruction.
fn branch_target(at: u64, first: u32, second: u32) -> u64 {
    let sign = first >> 10 & 1;
    let i1 = !(second >> 13 & 1 ^ sign) & 1;
    let i2 = !(second >> 11 & 1 ^ sign) & 1;
    let offset = sign << 24 | i1 << 23 | i2 << 22 | (first & 0x3FF) << 12 | (second & 0x7FF) << 1;
    let offset = (offset << 7) as i32 >> 7;
    at.wrapping_add(4).wrapping_add_signed(i64::from(offset))
}

#[test]
#[ignore = "needs the image's target; cargo verify runs it"]
fn the_interrupt_reaches_no_panic_no_logging_and_no_host_call() {
    for core in [TargetCore::F32, TargetCore::Fixed] {
        let code = Code::of(&Image::build(core).expect("the image builds").elf);
        let reached = code.reachable("TIM2");
        assert!(
            reached.iter().any(|name| name.contains("advance")),
            "the walk misses the chain: {reached:?}"
        );
        for forbidden in ["panic", "defmt", "semihosting", "fmt"] {
            assert!(
                !reached.iter().any(|name| name.contains(forbidden)),
                "{} reaches {forbidden}: {reached:?}",
                core.name()
            );
        }
        // The same walk from reset does find them: it can see what it must not find above.
        let from_reset = code.reachable("main");
        for expected in ["panic", "defmt", "semihosting"] {
            assert!(
                from_reset.iter().any(|name| name.contains(expected)),
                "the walk from main misses {expected}: {from_reset:?}"
            );
        }
    }
}
