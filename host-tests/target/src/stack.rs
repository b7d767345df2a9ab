//! Computes the worst case of the stack \[bytes\] from the linked image.
//!
//! It gives a [`StackBound`]: a number that no run can exceed, and the call path that it comes from.
//!
//! worst = deepest path from reset + Σ over the vector table's handlers (108 + deepest path from the handler)
//!
//! - A path's depth is the sum of the frames on it ([`code`](super::code)), jumps at a function's end
//!   counted as calls.
//! - An exception stores up to 108 bytes: 26 words with the floating-point registers and one to align (ARMv7-M
//!   reference manual, B1.5.7). Lazy stacking sets the room aside whether or not it is filled.
//! - Every handler counts once, as if all were active on top of each other, whatever their priorities: an
//!   exception does not nest in itself. The default handler serves many but never returns, so it counts once
//!   too.
//! - A call through a register may reach any function whose address stands anywhere in the image.
//! - Recursion has no bound: it is refused, by the name of the cycle, but for the functions of
//!   `BOUNDED_RECURSION`, and for those too in a handler.
//!
//! Assumes that the stack is the main one throughout (no PSP) and the handlers are those of the table.

use std::collections::{BTreeMap, BTreeSet};

use object::{Object, ObjectSection, ObjectSymbol};
use serde::Serialize;

use super::code::{Code, CodeError};

/// Functions that call themselves, at most so many times, with the reason. Boot may use them, a handler may not.
const BOUNDED_RECURSION: [(&str, u32); 1] = [
    // libm's frexp scales a subnormal argument by 2^64 and calls itself, once: the scaled one is normal.
    ("libm::math::frexp::frexp", 1),
];

/// Size of an exception's frame, stored before its handler begins \[bytes\].
pub const EXCEPTION_FRAME_BYTES: u32 = 108;

/// Method of the bound, in words for `on_target.json`.
pub const METHOD: &str = "computed: the deepest call path from reset plus, for every exception handler, 108 \
                          bytes of exception frame and its deepest path, from the linked image's calls and \
                          its instructions that lower the stack pointer, held against .debug_frame; \
                          recursion is refused, calls through a register may reach every function whose \
                          address is in the image";

/// Words at the vector table's begin that are no handlers: the initial stack pointer and reset.
const NOT_HANDLERS: usize = 2;

/// A handler and the deepest stack from it, its exception frame included.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct HandlerBound {
    /// The handler's name as linked.
    pub name: String,
    /// Deepest use \[bytes\].
    pub bytes: u32,
    /// The functions on the deepest path.
    pub path: Vec<String>,
}

/// The worst case and its parts.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct StackBound {
    /// Stack of main loop and handlers together \[bytes\].
    pub worst_bytes: u32,
    /// Stack that `memory.x` sets aside: RAM less the static variables \[bytes\].
    pub available_bytes: u32,
    /// Stack from reset, without interrupts \[bytes\].
    pub main: HandlerBound,
    /// Handlers of the vector table.
    pub handlers: Vec<HandlerBound>,
}

/// Reason that there is no bound.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum StackError {
    /// The code cannot be read.
    Code(CodeError),
    /// The image lacks this section or symbol.
    Missing(&'static str),
    /// Functions that call each other recursively, by name.
    Recursion(Vec<String>),
}

impl std::fmt::Display for StackError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Code(error) => error.fmt(f),
            Self::Missing(what) => write!(f, "has no {what}"),
            Self::Recursion(names) => {
                write!(
                    f,
                    "has no bound of its stack: {} in a circle",
                    names.join(" > ")
                )
            }
        }
    }
}

impl std::error::Error for StackError {}

impl From<CodeError> for StackError {
    fn from(error: CodeError) -> Self {
        Self::Code(error)
    }
}

impl StackBound {
    /// Computes the bound of an image.
    pub fn of(elf: &[u8]) -> Result<Self, StackError> {
        let code = Code::read(elf)?;
        let file = object::File::parse(elf).map_err(|_| CodeError::NotAnImage)?;
        let vectors = vector_table(&file).ok_or(StackError::Missing("vector table"))?;
        let symbol = |name: &'static str| {
            file.symbol_by_name(name)
                .map(|symbol| symbol.address())
                .ok_or(StackError::Missing(name))
        };
        let available = symbol("_stack_start")?.saturating_sub(symbol("_stack_end")?);

        let mut depths = Depths {
            code: &code,
            taken: taken_addresses(&file, &code),
            known: BTreeMap::new(),
            open: Vec::new(),
            in_handler: true,
        };
        let reset = *vectors.get(1).ok_or(StackError::Missing("reset vector"))?;
        let handlers: BTreeSet<u64> = vectors.into_iter().skip(NOT_HANDLERS).collect();
        let handlers = handlers
            .into_iter()
            .filter(|begin| code.functions.contains_key(begin))
            .map(|begin| depths.bound(begin, EXCEPTION_FRAME_BYTES))
            .collect::<Result<Vec<_>, _>>()?;
        depths.in_handler = false;
        let main = depths.bound(reset, 0)?;
        Ok(Self {
            worst_bytes: main.bytes + handlers.iter().map(|handler| handler.bytes).sum::<u32>(),
            available_bytes: u32::try_from(available).unwrap_or(0),
            main,
            handlers,
        })
    }
}

/// The words of the vector table, without the Thumb bit.
pub fn vector_table(file: &object::File<'_>) -> Option<Vec<u64>> {
    let data = file.section_by_name(".vector_table")?.data().ok()?;
    Some(words(data).map(|word| u64::from(word & !1)).collect())
}

fn words(bytes: &[u8]) -> impl Iterator<Item = u32> {
    bytes
        .as_chunks::<4>()
        .0
        .iter()
        .map(|word| u32::from_le_bytes(*word))
}

/// Functions whose address stands in a constant, a variable's initial value or an instruction.
///
/// An address in instructions is the pair MOVW, MOVT; the two halves are looked for apart, since the compiler may move
/// them: this finds every pair, and some false ones.
fn taken_addresses(file: &object::File<'_>, code: &Code) -> BTreeSet<u64> {
    let mut whole = BTreeSet::new();
    let (mut low, mut high) = (BTreeSet::new(), BTreeSet::new());
    for name in [".rodata", ".data", ".text"] {
        let Some(data) = file
            .section_by_name(name)
            .and_then(|section| section.data().ok())
        else {
            continue;
        };
        whole.extend(words(data));
        // An instruction begins at any halfword.
        for pair in data.as_chunks::<2>().0.windows(2) {
            let first = u32::from(u16::from_le_bytes(pair[0]));
            let second = u32::from(u16::from_le_bytes(pair[1]));
            let immediate = (first & 0xF) << 12
                | (first >> 10 & 1) << 11
                | (second >> 12 & 7) << 8
                | second & 0xFF;
            match first & 0xFBF0 {
                0xF240 => low.insert(immediate),
                0xF2C0 => high.insert(immediate),
                _ => false,
            };
        }
    }
    code.functions
        .keys()
        .copied()
        .filter(|begin| {
            let pointer = *begin as u32 | 1;
            whole.contains(&pointer)
                || low.contains(&(pointer & 0xFFFF)) && high.contains(&(pointer >> 16))
        })
        .collect()
}

/// The deepest path from each function, computed once.
struct Depths<'a> {
    code: &'a Code,
    taken: BTreeSet<u64>,
    /// Depth \[bytes\] and the next function on the path.
    known: BTreeMap<u64, (u32, Option<u64>)>,
    open: Vec<u64>,
    in_handler: bool,
}

impl Depths<'_> {
    fn bound(&mut self, begin: u64, entry_bytes: u32) -> Result<HandlerBound, StackError> {
        let depth = self.depth(begin)?;
        let mut path = vec![self.code.name(begin).to_owned()];
        let mut at = begin;
        while let Some(next) = self.known.get(&at).and_then(|(_, next)| *next) {
            path.push(self.code.name(next).to_owned());
            at = next;
        }
        Ok(HandlerBound {
            name: self.code.name(begin).to_owned(),
            bytes: entry_bytes + depth,
            path,
        })
    }

    fn depth(&mut self, begin: u64) -> Result<u32, StackError> {
        if let Some((depth, _)) = self.known.get(&begin) {
            return Ok(*depth);
        }
        if let Some(at) = self.open.iter().position(|open| *open == begin) {
            let circle = self.open[at..].iter().chain([&begin]);
            return Err(StackError::Recursion(
                circle
                    .map(|begin| self.code.name(*begin).to_owned())
                    .collect(),
            ));
        }
        let Some(function) = self.code.functions.get(&begin) else {
            return Ok(0);
        };
        let mut targets = function.targets.clone();
        if !function.indirect.is_empty() {
            targets.extend(&self.taken);
        }
        let mut activations = 1;
        if let Some((_, times)) = BOUNDED_RECURSION
            .iter()
            .find(|(name, _)| !self.in_handler && function.name == *name)
            && targets.remove(&begin)
        {
            activations += times;
        }
        self.open.push(begin);
        let (mut most, mut deepest) = (0, None);
        for target in targets {
            let depth = self.depth(target)?;
            if depth > most || deepest.is_none() {
                (most, deepest) = (depth, Some(target));
            }
        }
        self.open.pop();
        let depth = activations * function.frame_bytes + most;
        self.known.insert(begin, (depth, deepest));
        Ok(depth)
    }
}
