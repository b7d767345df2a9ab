//! Reads the image's code as a call graph from the linked ELF file.
//!
//! For a Cortex-M4 image it gives [`Code`]: its functions, the targets of its calls and jumps, and its lowering of the
//! stack pointer \[bytes\].
//!
//! Every instruction is decoded, in address order: Thumb code has no other way to call than BL, B and their conditional
//! forms (ARMv7-M reference manual, A7.7.12 and A7.7.18) and calls through a register (BX, BLX), which are listed apart
//! because their target is not in the instruction. Data between instructions is identified by the mapping symbols $t
//! and $d (ELF for the Arm Architecture, 5.5.5).
//!
//! A function's frame is the *sum* of everything in it that lowers the stack pointer. That bounds its use from above
//! also where it lowers it on several paths. An instruction that lowers it by an amount not in it is refused. The
//! compiler's own account, the call frame information in `.debug_frame` (DWARF 6.4), must not be larger: this reading
//! would then be incomplete.
//!
//! Tables of branches (TBB, TBH) stay within their function; they count for its loops ([`flow`]).

use std::collections::{BTreeMap, BTreeSet};

use addr2line::gimli::{
    self, BaseAddresses, CfaRule, DebugFrame, LittleEndian, UnwindContext, UnwindSection,
};
use object::{Object, ObjectSection, ObjectSymbol};

use super::flow::{self, Instruction};

/// A function of the image.
#[derive(Debug, Clone, Default)]
pub struct Function {
    /// Demangled name, without its hash.
    pub name: String,
    /// First addresses of the functions it calls or jumps to.
    pub targets: BTreeSet<u64>,
    /// Addresses of its calls through a register.
    pub indirect: Vec<u64>,
    /// Size from its beginning to its end, constants between instructions included \[bytes\].
    pub size: u64,
    /// Addresses of its loops' heads.
    pub loops: BTreeSet<u64>,
    /// Its instructions in the order of their addresses.
    pub instructions: Vec<Instruction>,
    /// The most by which it lowers the stack pointer \[bytes\].
    pub frame_bytes: u32,
}

/// The functions by their first address, without the Thumb bit.
#[derive(Debug, Clone, Default)]
pub struct Code {
    /// Each function once; where several names share an address, one of them.
    pub functions: BTreeMap<u64, Function>,
}

/// Reason that code cannot be read.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum CodeError {
    /// Not an ELF file with code and symbols.
    NotAnImage,
    /// The stack pointer is set or lowered by an amount that is not in the instruction.
    StackPointer {
        /// Name of the function.
        function: String,
        /// Address of the instruction.
        address: u64,
    },
    /// The compiler accounts for more stack than the instructions show.
    FrameInformation {
        /// Name of the function.
        function: String,
        /// Frame by the call frame information \[bytes\].
        compiler: u32,
        /// Frame by the instructions \[bytes\].
        read: u32,
    },
}

impl std::fmt::Display for CodeError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::NotAnImage => f.write_str("holds no code with symbols"),
            Self::StackPointer { function, address } => write!(
                f,
                "moves the stack pointer by an amount that cannot be read, at {address:#x} in {function}"
            ),
            Self::FrameInformation {
                function,
                compiler,
                read,
            } => write!(
                f,
                "takes {compiler} bytes of stack in {function} by its frame information, {read} by its \
                 instructions"
            ),
        }
    }
}

impl std::error::Error for CodeError {}

impl Code {
    /// Reads the code of an ELF file.
    pub fn read(elf: &[u8]) -> Result<Self, CodeError> {
        let file = object::File::parse(elf).map_err(|_| CodeError::NotAnImage)?;
        let text = Text::of(&file).ok_or(CodeError::NotAnImage)?;
        let mut functions = BTreeMap::new();
        for (begin, (name, size)) in &text.names {
            functions.insert(*begin, text.function(*begin, name, *size)?);
        }
        let code = Self { functions };
        code.check_frames(&file)?;
        Ok(code)
    }

    /// The first function with this name.
    pub fn find(&self, name: &str) -> Option<u64> {
        self.functions
            .iter()
            .find_map(|(begin, function)| (function.name == name).then_some(*begin))
    }

    /// Beginning of the function that holds `address`.
    pub fn holder(&self, address: u64) -> u64 {
        self.functions
            .range(..=address)
            .next_back()
            .map_or(address, |(begin, _)| *begin)
    }

    /// Every function that `from` can reach by direct calls and jumps, itself included.
    pub fn reachable(&self, from: u64) -> BTreeSet<u64> {
        let mut open = vec![from];
        let mut seen = BTreeSet::new();
        while let Some(begin) = open.pop() {
            if let Some(function) = self.functions.get(&begin)
                && seen.insert(begin)
            {
                open.extend(&function.targets);
            }
        }
        seen
    }

    /// The name of the function that begins at `begin`.
    pub fn name(&self, begin: u64) -> &str {
        self.functions
            .get(&begin)
            .map_or("(no function)", |function| &function.name)
    }

    /// Compares the frames that were read with the compiler's call frame information.
    fn check_frames(&self, file: &object::File<'_>) -> Result<(), CodeError> {
        let Some(section) = file.section_by_name(".debug_frame") else {
            return Ok(());
        };
        let data = section.data().map_err(|_| CodeError::NotAnImage)?;
        let mut frames = DebugFrame::new(data, LittleEndian);
        frames.set_address_size(4);
        let bases = BaseAddresses::default();
        let mut context = UnwindContext::new();
        let mut entries = frames.entries(&bases);
        while let Ok(Some(entry)) = entries.next() {
            let gimli::CieOrFde::Fde(partial) = entry else {
                continue;
            };
            let Ok(description) = partial.parse(DebugFrame::cie_from_offset) else {
                continue;
            };
            // Code that the linker dropped keeps its description, at address 0.
            let Some(function) = self
                .functions
                .get(&(description.initial_address() & !1))
                .filter(|_| description.initial_address() != 0)
            else {
                continue;
            };
            let mut most = 0;
            if let Ok(mut table) = description.rows(&frames, &bases, &mut context) {
                while let Ok(Some(row)) = table.next_row() {
                    // Above r7, the frame pointer, the offset is no longer the depth: it was where the
                    // frame pointer was set, and the rows before show that.
                    if let CfaRule::RegisterAndOffset { offset, .. } = row.cfa() {
                        most = most.max(u32::try_from(*offset).unwrap_or(0));
                    }
                }
            }
            if most > function.frame_bytes {
                return Err(CodeError::FrameInformation {
                    function: function.name.clone(),
                    compiler: most,
                    read: function.frame_bytes,
                });
            }
        }
        Ok(())
    }
}

/// The section of code and the beginnings in it.
struct Text {
    begin: u64,
    bytes: Vec<u8>,
    /// Name and size of the symbol that begins here; size 0 if the assembler gave none.
    names: BTreeMap<u64, (String, u64)>,
    /// True for data that begins here, by address.
    is_data: BTreeMap<u64, bool>,
}

impl Text {
    fn of(file: &object::File<'_>) -> Option<Self> {
        let text = file.section_by_name(".text")?;
        let end = text.address() + text.size();
        let mut names = BTreeMap::new();
        let mut is_data = BTreeMap::new();
        for symbol in file.symbols() {
            let name = symbol.name().unwrap_or_default();
            if !(text.address()..end).contains(&symbol.address()) {
                continue;
            }
            if name.starts_with("$t") || name.starts_with("$d") {
                is_data.insert(symbol.address(), name.starts_with("$d"));
            } else if symbol.kind() == object::SymbolKind::Text && !name.is_empty() {
                // Without the hash, so that a name stands for the function and not for one build of it.
                let name = format!("{:#}", rustc_demangle::demangle(name));
                let (_, size) = names.entry(symbol.address() & !1).or_insert((name, 0));
                *size = symbol.size().max(*size);
            }
        }
        (!names.is_empty()).then_some(Self {
            begin: text.address(),
            bytes: text.data().ok()?.to_vec(),
            names,
            is_data,
        })
    }

    fn halfword(&self, address: u64) -> u32 {
        let at = (address - self.begin) as usize;
        match self.bytes.get(at..at + 2) {
            Some(&[low, high]) => u32::from(u16::from_le_bytes([low, high])),
            _ => 0,
        }
    }

    /// Beginning of the function that holds `address`.
    fn holder(&self, address: u64) -> u64 {
        self.names
            .range(..=address)
            .next_back()
            .map_or(address, |(begin, _)| *begin)
    }

    fn is_data(&self, address: u64) -> bool {
        self.is_data
            .range(..=address)
            .next_back()
            .is_some_and(|(_, data)| *data)
    }

    /// Targets of TBB or TBH (A7.7.185): the compiler puts the table behind it.
    fn branch_table(&self, at: u64, first: u32, second: u32) -> Vec<u64> {
        if first != 0xE8DF || second & 0xFFE0 != 0xF000 {
            return Vec::new();
        }
        let begin = at + 4;
        let end = self
            .is_data
            .range(begin + 1..)
            .find(|(_, data)| !**data)
            .map_or(begin, |(end, _)| *end);
        let halfwords = (begin..end).step_by(2).map(|at| self.halfword(at));
        let entries: Vec<u32> = if second & 0x10 != 0 {
            halfwords.collect()
        } else {
            halfwords.flat_map(|two| [two & 0xFF, two >> 8]).collect()
        };
        entries
            .into_iter()
            .map(|entry| begin + 2 * u64::from(entry))
            .collect()
    }

    fn function(&self, begin: u64, name: &str, size: u64) -> Result<Function, CodeError> {
        let next = self
            .names
            .range(begin + 1..)
            .next()
            .map_or(self.begin + self.bytes.len() as u64, |(next, _)| *next);
        // The linker's filling of gaps would read as instructions.
        let end = if size > 0 {
            next.min(begin + size)
        } else {
            next
        };
        let mut function = Function {
            name: name.to_owned(),
            size: end - begin,
            ..Function::default()
        };
        let mut instructions = Vec::new();
        let mut at = begin;
        while at < end {
            if self.is_data(at) {
                at += 2;
                continue;
            }
            let first = self.halfword(at);
            // The first five bits 0b11101, 0b11110 and 0b11111 begin an instruction of two halfwords.
            let wide = first >> 11 >= 0b11101;
            let second = if wide { self.halfword(at + 2) } else { 0 };
            let (target, indirect) = if wide {
                (branch_wide(at, first, second), false)
            } else {
                // BX and BLX Rm: 0100 0111 Lmmm m000; BX LR is the return.
                let indirect = first & 0xFF07 == 0x4700 && first != 0x4770;
                (branch_narrow(at, first), indirect)
            };
            if let Some(holder) = target.map(|target| self.holder(target))
                && (holder != begin || target == Some(begin))
            {
                function.targets.insert(holder);
            }
            if indirect {
                function.indirect.push(at);
            }
            function.frame_bytes += match stack_lowered(first, second) {
                Lowered::By(bytes) => bytes,
                Lowered::Unknown => {
                    return Err(CodeError::StackPointer {
                        function: function.name,
                        address: at,
                    });
                }
            };
            let is_call = first & 0xF800 == 0xF000 && second & 0xD000 == 0xD000;
            instructions.push(Instruction {
                address: at,
                first,
                second,
                jump: target.filter(|_| !is_call),
                call: target.filter(|_| is_call),
                table: self.branch_table(at, first, second),
            });
            at += if wide { 4 } else { 2 };
        }
        function.loops = flow::loop_heads(&instructions);
        function.instructions = instructions;
        Ok(function)
    }
}

/// Target of B (A7.7.12, encodings T1 and T2), CBZ and CBNZ (A7.7.21), of which the compiler makes jumps
/// within a function.
fn branch_narrow(at: u64, first: u32) -> Option<u64> {
    if first & 0xF500 == 0xB100 {
        let offset = (first >> 9 & 1) << 6 | (first >> 3 & 0x1F) << 1;
        return Some(at + 4 + u64::from(offset));
    }
    let offset = if first & 0xF000 == 0xD000 && first & 0x0F00 < 0x0E00 {
        sign_extended((first & 0xFF) << 1, 9)
    } else if first & 0xF800 == 0xE000 {
        sign_extended((first & 0x7FF) << 1, 12)
    } else {
        return None;
    };
    Some(at.wrapping_add(4).wrapping_add_signed(offset))
}

/// Target of BL, B.W (encoding T4) and B<c>.W (T3).
fn branch_wide(at: u64, first: u32, second: u32) -> Option<u64> {
    if first & 0xF800 != 0xF000 || second & 0x8000 == 0 {
        return None;
    }
    let sign = first >> 10 & 1;
    let (j1, j2) = (second >> 13 & 1, second >> 11 & 1);
    let low = (second & 0x7FF) << 1;
    let offset = if second & 0x1000 != 0 {
        let (i1, i2) = (!(j1 ^ sign) & 1, !(j2 ^ sign) & 1);
        let bits = sign << 24 | i1 << 23 | i2 << 22 | (first & 0x3FF) << 12 | low;
        sign_extended(bits, 25)
    } else if second & 0x5000 == 0 && first & 0x0380 != 0x0380 {
        let bits = sign << 20 | j2 << 19 | j1 << 18 | (first & 0x3F) << 12 | low;
        sign_extended(bits, 21)
    } else {
        // MSR, MRS, barriers, hints.
        return None;
    };
    Some(at.wrapping_add(4).wrapping_add_signed(offset))
}

/// Extends the sign of a number of `bits` bits in two's complement.
fn sign_extended(number: u32, bits: u32) -> i64 {
    let unused = 32 - bits;
    i64::from((number << unused) as i32 >> unused)
}

/// Change of the stack pointer by an instruction.
enum Lowered {
    By(u32),
    Unknown,
}

/// Lowering of the stack pointer by an instruction \[bytes\] (A7.7: PUSH, VPUSH, STR, STRD, SUB (SP minus
/// immediate), MOV, MSR). Raising it is a return and counts nothing.
fn stack_lowered(first: u32, second: u32) -> Lowered {
    const SP: u32 = 13;
    let bytes = match first {
        // PUSH T1.
        _ if first & 0xFE00 == 0xB400 => 4 * (first & 0x1FF).count_ones(),
        // SUB SP, SP, #imm7 T1.
        _ if first & 0xFF80 == 0xB080 => 4 * (first & 0x7F),
        // PUSH.W T2 (STMDB SP!).
        0xE92D => 4 * second.count_ones(),
        // STR Rt, [SP, #-imm8]!.
        0xF84D if second & 0x0F00 == 0x0D00 => second & 0xFF,
        // STRD Rt, Rt2, [SP, #-imm8]!.
        0xE96D => 4 * (second & 0xFF),
        // VPUSH of double or single registers.
        0xED2D | 0xED6D if second & 0x0E00 == 0x0A00 => 4 * (second & 0xFF),
        // SUB.W SP, SP, #const T2.
        _ if first & 0xFBEF == 0xF1AD && second >> 8 & 0xF == SP => {
            expanded(first >> 10 & 1, second >> 12 & 7, second & 0xFF)
        }
        // SUBW SP, SP, #imm12 T3.
        _ if first & 0xFBFF == 0xF2AD && second >> 8 & 0xF == SP => {
            (first >> 10 & 1) << 11 | (second >> 12 & 7) << 8 | second & 0xFF
        }
        // SUB.W or ADD.W with SP as result and a register as operand; MOV SP, Rm; ADD SP, Rm; MSR MSP or
        // PSP; loads into SP.
        _ if first & 0xFF80 == 0xEB80 && second >> 8 & 0xF == SP => return Lowered::Unknown,
        _ if first & 0xFF80 == 0xEB00 && second >> 8 & 0xF == SP => return Lowered::Unknown,
        _ if first & 0xFF87 == 0x4685 || first & 0xFF87 == 0x4485 => return Lowered::Unknown,
        _ if first & 0xFFE0 == 0xF380
            && second & 0xFF00 == 0x8800
            && matches!(second & 0xFF, 8 | 9) =>
        {
            return Lowered::Unknown;
        }
        _ => 0,
    };
    Lowered::By(bytes)
}

/// ThumbExpandImm (A5.3.2).
pub(crate) fn expanded(i: u32, imm3: u32, imm8: u32) -> u32 {
    let selector = i << 3 | imm3;
    match selector {
        0 => imm8,
        1 => imm8 << 16 | imm8,
        2 => imm8 << 24 | imm8 << 8,
        3 => imm8 << 24 | imm8 << 16 | imm8 << 8 | imm8,
        _ => {
            let rotation = selector << 1 | imm8 >> 7;
            (imm8 & 0x7F | 0x80).rotate_right(rotation)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{Lowered, branch_narrow, branch_wide, stack_lowered};

    fn lowered(first: u32, second: u32) -> Option<u32> {
        match stack_lowered(first, second) {
            Lowered::By(bytes) => Some(bytes),
            Lowered::Unknown => None,
        }
    }

    // The encodings below are the assembler's, of the text beside them.

    #[test]
    fn every_way_to_lower_the_stack_pointer_is_read() {
        assert_eq!(lowered(0xB5F0, 0), Some(20)); // push {r4, r5, r6, r7, lr}
        assert_eq!(lowered(0xB09F, 0), Some(124)); // sub sp, #124
        assert_eq!(lowered(0xE92D, 0x0F00), Some(16)); // push.w {r8, r9, r10, r11}
        assert_eq!(lowered(0xF84D, 0x8D04), Some(4)); // str r8, [sp, #-4]!
        assert_eq!(lowered(0xE96D, 0x4502), Some(8)); // strd r4, r5, [sp, #-8]!
        assert_eq!(lowered(0xED2D, 0x8B04), Some(16)); // vpush {d8, d9}
        assert_eq!(lowered(0xF5AD, 0x5D84), Some(4224)); // sub.w sp, sp, #4224
        assert_eq!(lowered(0xF6AD, 0x3D6C), Some(2924)); // subw sp, sp, #2924
    }

    #[test]
    fn what_raises_the_stack_pointer_or_leaves_it_counts_nothing() {
        assert_eq!(lowered(0xBDF0, 0), Some(0)); // pop {r4, r5, r6, r7, pc}
        assert_eq!(lowered(0xB01F, 0), Some(0)); // add sp, #124
        assert_eq!(lowered(0xF85D, 0x8B04), Some(0)); // ldr r8, [sp], #4
        assert_eq!(lowered(0x466F, 0), Some(0)); // mov r7, sp
        assert_eq!(lowered(0xF8CD, 0x8004), Some(0)); // str.w r8, [sp, #4]
    }

    #[test]
    fn an_amount_that_is_not_in_the_instruction_is_refused() {
        assert_eq!(lowered(0xEBAD, 0x0D00), None); // sub.w sp, sp, r0
        assert_eq!(lowered(0x46A5, 0), None); // mov sp, r4
        assert_eq!(lowered(0xF380, 0x8808), None); // msr msp, r0
    }

    #[test]
    fn branches_lead_where_the_assembler_says() {
        assert_eq!(branch_narrow(0x100, 0xE7FE), Some(0x100)); // b .
        assert_eq!(branch_narrow(0x100, 0xD0FE), Some(0x100)); // beq .
        assert_eq!(branch_narrow(0x100, 0xDF00), None); // svc 0
        assert_eq!(branch_narrow(0x100, 0xB108), Some(0x106)); // cbz r0, . + 6
        assert_eq!(branch_narrow(0x100, 0xBBF8), Some(0x182)); // cbnz r0, . + 130
        assert_eq!(branch_wide(0x100, 0xF7FF, 0xFFFE), Some(0x100)); // bl .
        assert_eq!(branch_wide(0x100, 0xF7FF, 0xBFFE), Some(0x100)); // b.w .
        assert_eq!(branch_wide(0x100, 0xF43F, 0xAFFE), Some(0x100)); // beq.w .
        assert_eq!(branch_wide(0x100, 0xF3BF, 0x8F5F), None); // dmb sy
        assert_eq!(branch_wide(0x100, 0xF380, 0x8810), None); // msr primask, r0
    }
}
