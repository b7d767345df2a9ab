//! Bounds the cost of a function of the image from above, from its linked instructions: call graph times loop bounds.
//!
//! For a function of [`Code`], a bound of the turns of each loop, and a cost of each instruction, it gives the cost of the
//! dearest path, callees included. No run can exceed it, whatever the data.
//!
//! The instructions of a function and their successors ([`flow::successors`]) are a graph. A natural loop (Aho et al.,
//! *Compilers*, section 9.6.6) whose head is left by a jump back at most n times costs at most n + 1 times the dearest
//! path from its head within it; inner loops first, each becomes one node of that cost. The remaining graph has no
//! circle, and the dearest path through it is the function's cost. Facts of a run that its branches do not show
//! ([`Paths`]) are kept as kinds of paths: the dearest of each kind, and of two paths one after the other.
//!
//! # Assumptions
//! An instruction that an IT block skips costs as if it were executed. A jump into another function costs as a call of
//! it from its beginning. Each turn of a loop in a routine of the runtime that copies or clears n bytes stores as many
//! of them as its instructions do, at least one, so that its loops do n in all; n must be a constant before the call. One for
//! operands on whole words (its name ends in 4 or 8) stores no more than n mod 4 bytes one by one.

use std::collections::{BTreeMap, BTreeSet};

use super::code::{Code, Function, expanded};
use super::flow::{self, Instruction};

/// Reason that there is no bound.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum WorstCaseError {
    /// A loop without a bound of its turns: function, and address of the head.
    Unbounded(String, u64),
    /// A circle of instructions that can be entered elsewhere than at its head.
    Irreducible(String, u64),
    /// Functions that call each other in a circle.
    Recursion(Vec<String>),
    /// A call through a register.
    Indirect(String, u64),
    /// A copy or clearing of a size that is no constant before the call.
    Size(String, u64),
    /// A loop turns with a function in it that may be called once.
    Repeated(String, u64),
    /// Every path calls a function that none may call.
    NoPath,
}

impl std::fmt::Display for WorstCaseError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Unbounded(name, at) => write!(f, "a loop without a bound in {name} at {at:#x}"),
            Self::Irreducible(name, at) => {
                write!(f, "a loop with two entries in {name} at {at:#x}")
            }
            Self::Recursion(names) => write!(f, "{} in a circle", names.join(" > ")),
            Self::Indirect(name, at) => write!(f, "a call through a register in {name} at {at:#x}"),
            Self::Size(name, at) => {
                write!(f, "bytes copied by {name} at {at:#x} are no constant")
            }
            Self::Repeated(name, at) => {
                write!(
                    f,
                    "a call that may be made once, in a loop of {name} at {at:#x}"
                )
            }
            Self::NoPath => f.write_str("no path without what none may call"),
        }
    }
}

impl std::error::Error for WorstCaseError {}

/// Most turns of the loop of a function with its head at an address; `None` if unbounded.
pub type Turns<'a> = &'a dyn Fn(&Function, u64) -> Option<u64>;

/// Cost of one instruction by itself.
pub type Cost<'a> = &'a dyn Fn(&Instruction) -> u64;

/// Cycles of one instruction of a Cortex-M4 at most (Arm, *Cortex-M4 Technical Reference Manual*, 3.3.1 and 7.2.3), from
/// flash with `wait_states` and no cache: the line of 16 bytes that it begins, in part, for each branch a new line, and
/// for each load or store one access to flash.
pub fn cycles(instruction: &Instruction, wait_states: u64) -> u64 {
    let (first, second) = (instruction.first, instruction.second);
    let is_wide = first >> 11 >= 0b11101;
    let several = |words: u32| 1 + u64::from(words) + wait_states;
    let branch = 4 + wait_states;
    // A load of the program counter branches: POP, LDM and LDR.
    let is_load = first & 0x10 != 0;
    let branch_if = |branches: bool| if branches { branch } else { 0 };
    let own = match first {
        _ if instruction.jump.is_some() || instruction.call.is_some() => branch,
        // BX, BLX; PUSH, POP; STM, LDM.
        _ if !is_wide && first & 0xFF00 == 0x4700 => branch,
        _ if !is_wide && first & 0xF600 == 0xB400 => {
            branch_if(first & 0xFF00 == 0xBD00) + several((first & 0x1FF).count_ones())
        }
        _ if !is_wide && first & 0xF000 == 0xC000 => several((first & 0xFF).count_ones()),
        // LDR from the constants behind the function; loads and stores.
        _ if !is_wide && (0x4800..0xA000).contains(&first) => several(1),
        // TBB, TBH; LDM, STM; LDRD, STRD.
        _ if first & 0xFFF0 == 0xE8D0 && second & 0xFFE0 == 0xF000 => branch + several(1),
        _ if first & 0xFE40 == 0xE800 => {
            branch_if(is_load && second >> 15 == 1) + several(second.count_ones())
        }
        _ if first & 0xFE40 == 0xE840 => several(2),
        // VLDR, VSTR, VLDM, VSTM, VPUSH, VPOP.
        _ if first & 0xFF20 == 0xED00 => several(1),
        _ if first & 0xFE00 == 0xEC00 => several(second & 0xFF),
        // LDR, STR and their like.
        _ if first & 0xFE00 == 0xF800 => branch_if(is_load && second >> 12 == 0xF) + several(1),
        // SDIV, UDIV; VDIV; VSQRT.
        _ if first & 0xFFD0 == 0xFB90 && second & 0xF0 == 0xF0 => 12,
        _ if first & 0xFFB0 == 0xEE80 && second & 0x0E50 == 0x0A00 => 14,
        _ if first & 0xFFBF == 0xEEB1 && second & 0x0ED0 == 0x0AC0 => 14,
        // VMLA and its like take 3, products 1.
        _ if first & 0xFF00 == 0xEE00 => 3,
        _ => 1,
    };
    // A line of four wide or eight narrow instructions costs its wait states once; rounded up for each.
    let of_line = wait_states.div_ceil(if is_wide { 4 } else { 8 });
    own + of_line
}

/// Computes the cost of the dearest path through the function that begins at `from`, callees included.
pub fn cost(
    code: &Code,
    from: u64,
    paths: &Paths,
    turns: Turns,
    of: Cost,
) -> Result<u64, WorstCaseError> {
    Ok(breakdown(code, from, paths, turns, of)?.values().sum())
}

/// Computes the cost of each instruction on the dearest path through the function that begins at `from`, callees
/// included, by address, times the passes of the path. The turns of a routine that copies or clears count at its
/// beginning.
pub fn breakdown(
    code: &Code,
    from: u64,
    paths: &Paths,
    turns: Turns,
    of: Cost,
) -> Result<BTreeMap<u64, u64>, WorstCaseError> {
    let mut search = Search {
        code,
        paths,
        turns,
        of,
        known: BTreeMap::new(),
        open: Vec::new(),
    };
    let must = if paths.through.is_some() {
        CALLS_THROUGH
    } else {
        0
    };
    let dearest = search.function(from, None)?.dearest(must);
    dearest.map(|path| path.parts).ok_or(WorstCaseError::NoPath)
}

/// Constraints on paths beyond the graph: facts of a run that its branches do not show.
#[derive(Debug, Clone, Default)]
pub struct Paths {
    /// Beginning of a function that no path calls more than once.
    pub once: Option<u64>,
    /// Beginning of a function that every path calls.
    pub through: Option<u64>,
    /// Beginnings of functions that no path calls.
    pub without: BTreeSet<u64>,
}

/// The cost of a path, and its parts by address.
#[derive(Debug, Clone, Default)]
struct Path {
    cost: u64,
    parts: BTreeMap<u64, u64>,
}

impl Path {
    /// One part alone.
    fn of(address: u64, cost: u64) -> Self {
        Self {
            cost,
            parts: BTreeMap::from([(address, cost)]),
        }
    }

    /// Adds `other`, passed `times`.
    fn add(&mut self, other: &Self, times: u64) {
        self.cost += other.cost * times;
        for (address, cost) in &other.parts {
            *self.parts.entry(*address).or_default() += cost * times;
        }
    }

    /// This path and then `other`.
    fn then(&self, other: &Self) -> Self {
        let mut both = self.clone();
        both.add(other, 1);
        both
    }
}

/// Kinds of paths: calls of [`Paths::once`] or not, times calls of [`Paths::through`] or not.
const KINDS: usize = 4;
const CALLS_ONCE: usize = 1;
const CALLS_THROUGH: usize = 2;

/// The kind of two paths, one after the other; `None` if together they call twice a function that may be called once.
fn kind_of_both(first: usize, second: usize) -> Option<usize> {
    (first & second & CALLS_ONCE == 0).then_some(first | second)
}

/// The dearest path of each kind; `None` without a path.
#[derive(Debug, Clone, Default)]
struct Dear([Option<Path>; KINDS]);

impl Dear {
    /// A path that calls neither.
    fn of(path: Path) -> Self {
        Self([Some(path), None, None, None])
    }

    /// This path and then `other`.
    fn then(&self, other: &Self) -> Self {
        let mut both = Self::default();
        for (first, path) in self.kinds() {
            for (second, after) in other.kinds() {
                if let Some(kind) = kind_of_both(first, second)
                    && both
                        .cost(kind)
                        .is_none_or(|cost| cost < path.cost + after.cost)
                {
                    both.0[kind] = Some(path.then(after));
                }
            }
        }
        both
    }

    /// The path's kind after a call that adds `called`.
    fn calling(self, called: usize) -> Self {
        let mut all = Self::default();
        for (kind, path) in self.0.into_iter().enumerate() {
            if let (Some(kind), Some(path)) = (kind_of_both(kind, called), path)
                && all.cost(kind).is_none_or(|cost| cost < path.cost)
            {
                all.0[kind] = Some(path);
            }
        }
        all
    }

    fn kinds(&self) -> impl Iterator<Item = (usize, &Path)> {
        let all = self.0.iter().enumerate();
        all.filter_map(|(kind, path)| Some((kind, path.as_ref()?)))
    }

    fn cost(&self, kind: usize) -> Option<u64> {
        Some(self.0[kind].as_ref()?.cost)
    }

    /// The dearest of the kinds that call all of `must`.
    fn dearest(self, must: usize) -> Option<Path> {
        let all = self.0.into_iter().enumerate();
        let such = all.filter_map(|(kind, path)| path.filter(|_| kind & must == must));
        such.max_by_key(|path| path.cost)
    }
}

struct Search<'a> {
    code: &'a Code,
    paths: &'a Paths,
    turns: Turns<'a>,
    of: Cost<'a>,
    /// Cost by function and, of a routine that copies or clears, bytes.
    known: BTreeMap<(u64, Option<u64>), Dear>,
    open: Vec<u64>,
}

impl Search<'_> {
    /// The cost of a function; of a routine that copies or clears, for `bytes` of them.
    fn function(&mut self, begin: u64, bytes: Option<u64>) -> Result<Dear, WorstCaseError> {
        if let Some(known) = self.known.get(&(begin, bytes)) {
            return Ok(known.clone());
        }
        if self.paths.without.contains(&begin) {
            return Ok(Dear::default());
        }
        let Some(function) = self.code.functions.get(&begin) else {
            return Ok(Dear::of(Path::default()));
        };
        if let Some(at) = function.indirect.first() {
            return Err(WorstCaseError::Indirect(function.name.clone(), *at));
        }
        if self.open.contains(&begin) {
            let names = self.open.iter().map(|at| self.code.name(*at).to_owned());
            return Err(WorstCaseError::Recursion(names.collect()));
        }
        self.open.push(begin);
        let mut costs = BTreeMap::new();
        for (place, instruction) in function.instructions.iter().enumerate() {
            let own = Path::of(instruction.address, (self.of)(instruction));
            let own = Dear::of(own).then(&self.callee(function, place, bytes)?);
            costs.insert(instruction.address, own);
        }
        let graph = Graph {
            ways: flow::successors(&function.instructions),
            costs,
            stored: function
                .instructions
                .iter()
                .map(|instruction| (instruction.address, stored_bytes(instruction)))
                .collect(),
            entry: begin,
        };
        let turns = |head: u64| match bytes {
            Some(_) => Some(0),
            None => (self.turns)(function, head),
        };
        let dearest = graph
            .dearest(&turns)
            .map_err(|fault| fault.of(&function.name))?;
        let mut path = dearest.path;
        if let Some(bytes) = bytes {
            let turned = turned(&dearest.turns, bytes, has_whole_words(&function.name));
            path = path.then(&Dear::of(Path::of(begin, turned)));
        }
        if self.paths.once == Some(begin) {
            path = path.calling(CALLS_ONCE);
        }
        if self.paths.through == Some(begin) {
            path = path.calling(CALLS_THROUGH);
        }
        self.open.pop();
        self.known.insert((begin, bytes), path.clone());
        Ok(path)
    }

    /// The cost of the function that the instruction calls, or jumps to outside its function.
    fn callee(
        &mut self,
        function: &Function,
        place: usize,
        bytes: Option<u64>,
    ) -> Result<Dear, WorstCaseError> {
        let instruction = &function.instructions[place];
        let inside = |target: u64| {
            let first = function.instructions[0].address;
            (first..first + function.size).contains(&target)
        };
        let Some(target) = instruction
            .call
            .or(instruction.jump.filter(|target| !inside(*target)))
        else {
            return Ok(Dear::of(Path::default()));
        };
        let target = self.code.holder(target);
        let name = self.code.name(target);
        if !copies_or_clears(name) {
            return self.function(target, None);
        }
        // Among themselves these routines pass on the remaining bytes.
        let left = bytes.map(|bytes| match has_whole_words(&function.name) {
            true => bytes % WORD,
            false => bytes,
        });
        let bytes = left.or_else(|| size_before(&function.instructions[..place], name));
        let bytes = bytes
            .ok_or_else(|| WorstCaseError::Size(function.name.clone(), instruction.address))?;
        self.function(target, Some(bytes))
    }
}

/// True if a function is one of the runtime's routines that copy or clear memory.
fn copies_or_clears(name: &str) -> bool {
    name.starts_with("__aeabi_mem") || name.contains("::mem::") || name == "memcpy"
}

/// Bytes of a word.
const WORD: u64 = 4;

/// True if such a routine is one for operands on whole words (Run-time ABI for the Arm Architecture, 4.3.4).
fn has_whole_words(name: &str) -> bool {
    name.starts_with("__aeabi_mem") && name.ends_with(['4', '8'])
}

/// Cost of all turns of such a routine's loops for `bytes` of them.
fn turned(loops: &[Turn], bytes: u64, has_whole_words: bool) -> u64 {
    let most = |bytes: u64, narrow: bool| {
        let loops = loops.iter().filter(|one| one.is_narrow == narrow);
        loops
            .map(|one| (one.cost * bytes).div_ceil(one.stored))
            .max()
            .unwrap_or(0)
    };
    match has_whole_words {
        true => most(bytes, false) + most(bytes % WORD, true),
        false => most(bytes, false).max(most(bytes, true)),
    }
}

/// The constant in the size's register before a call: r2 of a copy, r1 of a clearing (Run-time ABI for the Arm
/// Architecture, 4.3.4).
fn size_before(before: &[Instruction], name: &str) -> Option<u64> {
    const NEAR: usize = 16;
    let register = if name.contains("clr") { 1 } else { 2 };
    before.iter().rev().take(NEAR).find_map(|instruction| {
        let (first, second) = (instruction.first, instruction.second);
        if first & 0xF800 == 0x2000 && first >> 8 & 7 == register {
            // MOVS Rd, #imm8.
            Some(u64::from(first & 0xFF))
        } else if first & 0xFBF0 == 0xF240 && second >> 8 & 0xF == register {
            // MOVW Rd, #imm16.
            let high = (first & 0xF) << 12 | (first >> 10 & 1) << 11;
            Some(u64::from(high | (second >> 12 & 7) << 8 | second & 0xFF))
        } else if first & 0xFBEF == 0xF04F && second >> 8 & 0xF == register {
            // MOV.W Rd, #const.
            let size = expanded(first >> 10 & 1, second >> 12 & 7, second & 0xFF);
            Some(u64::from(size))
        } else {
            None
        }
    })
}

/// Bytes that an instruction stores (ARMv7-M reference manual, A5.2.4, A5.3.5, A5.3.6 and A5.3.10).
fn stored_bytes(instruction: &Instruction) -> u64 {
    let (first, second) = (instruction.first, instruction.second);
    let words = |registers: u32| 4 * u64::from(registers.count_ones());
    match first {
        0x5000..0x5200 | 0x6000..0x6800 | 0x9000..0x9800 => 4,
        0x5200..0x5400 | 0x8000..0x8800 => 2,
        0x5400..0x5600 | 0x7000..0x7800 => 1,
        0xC000..0xC800 => words(first & 0xFF),
        _ if first & 0xFF70 == 0xF840 => 4,
        _ if first & 0xFF70 == 0xF820 => 2,
        _ if first & 0xFF70 == 0xF800 => 1,
        _ if first & 0xFE50 == 0xE840 && first & 0x0120 != 0 => 8,
        _ if first & 0xFE50 == 0xE800 => words(second),
        _ => 0,
    }
}

/// A function's instructions by address, with the successors and the cost of each.
struct Graph {
    ways: BTreeMap<u64, Vec<u64>>,
    costs: BTreeMap<u64, Dear>,
    /// Bytes that each instruction stores.
    stored: BTreeMap<u64, u64>,
    entry: u64,
}

/// Costs of a function.
struct Dearest {
    /// Of the dearest paths through it.
    path: Dear,
    /// One turn of each of its loops.
    turns: Vec<Turn>,
}

/// One turn of a loop.
struct Turn {
    cost: u64,
    /// Bytes that it stores, at least 1.
    stored: u64,
    /// True if it stores parts of words.
    is_narrow: bool,
}

/// A loop that cannot be bounded, by its head.
enum Fault {
    Unbounded(u64),
    Repeated(u64),
    Irreducible(u64),
}

impl Fault {
    fn of(self, name: &str) -> WorstCaseError {
        match self {
            Self::Unbounded(at) => WorstCaseError::Unbounded(name.to_owned(), at),
            Self::Repeated(at) => WorstCaseError::Repeated(name.to_owned(), at),
            Self::Irreducible(at) => WorstCaseError::Irreducible(name.to_owned(), at),
        }
    }
}

impl Graph {
    /// The cost of the dearest path from the entry, with loops turned as often as they may.
    fn dearest(mut self, turns: &dyn Fn(u64) -> Option<u64>) -> Result<Dearest, Fault> {
        for ways in self.ways.values_mut() {
            ways.retain(|to| self.costs.contains_key(to));
        }
        let mut loops: Vec<(u64, BTreeSet<u64>)> = self.loops()?.into_iter().collect();
        // An inner loop is smaller than the one around it.
        loops.sort_by_key(|(_, body)| body.len());
        let mut one_turn = Vec::new();
        for (head, body) in loops {
            let most = turns(head).ok_or(Fault::Unbounded(head))?;
            let stored = self.stored_by_a_turn(&body);
            let mut stores = body.iter().filter_map(|at| self.stored.get(at));
            let is_narrow = stores.any(|bytes| (1..WORD).contains(bytes));
            one_turn.push(Turn {
                cost: self.collapse(head, &body, most)?,
                stored,
                is_narrow,
            });
        }
        let all: BTreeSet<u64> = self.ways.keys().copied().collect();
        let path = self.dearest_within(self.entry, &all)?;
        Ok(Dearest {
            path,
            turns: one_turn,
        })
    }

    /// Bytes that every turn of a loop stores, if it has one way only; else, or if it stores none, 1.
    fn stored_by_a_turn(&self, body: &BTreeSet<u64>) -> u64 {
        let inside = |at: &u64| {
            let ways = self.ways.get(at).into_iter().flatten();
            ways.filter(|to| body.contains(to)).count()
        };
        if body.iter().any(|at| inside(at) > 1) {
            return 1;
        }
        let stored = body.iter().filter_map(|at| self.stored.get(at));
        stored.sum::<u64>().max(1)
    }

    /// Natural loops: the head, and the nodes that reach a jump back to it without passing it.
    fn loops(&self) -> Result<BTreeMap<u64, BTreeSet<u64>>, Fault> {
        let mut before: BTreeMap<u64, Vec<u64>> = BTreeMap::new();
        for (from, ways) in &self.ways {
            for to in ways {
                before.entry(*to).or_default().push(*from);
            }
        }
        let mut loops: BTreeMap<u64, BTreeSet<u64>> = BTreeMap::new();
        for (from, head) in flow::jumps_back(self.entry, &self.ways) {
            let body = loops.entry(head).or_insert_with(|| BTreeSet::from([head]));
            let mut open = vec![from];
            while let Some(at) = open.pop() {
                if body.insert(at) {
                    open.extend(before.get(&at).into_iter().flatten());
                }
            }
            // The way back from the jump has found the entry: another way leads into the loop than by its head.
            if head != self.entry && body.contains(&self.entry) {
                return Err(Fault::Irreducible(head));
            }
        }
        Ok(loops)
    }

    /// Makes one node of a loop: it costs all its turns, and is followed by the loop's exits.
    ///
    /// # Returns
    /// The cost of one turn.
    fn collapse(&mut self, head: u64, body: &BTreeSet<u64>, most: u64) -> Result<u64, Fault> {
        if let Some(to_itself) = self.ways.get_mut(&head) {
            to_itself.retain(|to| *to != head);
        }
        let back: Vec<u64> = body.iter().copied().filter(|at| *at != head).collect();
        for at in &back {
            if let Some(ways) = self.ways.get_mut(at) {
                ways.retain(|to| *to != head);
            }
        }
        let once = self.dearest_within(head, body)?;
        let mut out: BTreeSet<u64> = BTreeSet::new();
        for at in body {
            out.extend(self.ways.get(at).into_iter().flatten());
        }
        for at in &back {
            self.ways.remove(at);
            self.costs.remove(at);
        }
        out.retain(|to| !body.contains(to));
        self.ways.insert(head, out.into_iter().collect());
        // In a loop that turns, the kind of a path would change with every turn.
        if most > 0 && once.kinds().any(|(kind, _)| kind != 0) {
            return Err(Fault::Repeated(head));
        }
        let one_turn = once.0[0].as_ref().map_or(0, |path| path.cost);
        let all = once.0.map(|path| {
            let mut all = Path::default();
            all.add(&path?, most + 1);
            Some(all)
        });
        self.costs.insert(head, Dear(all));
        Ok(one_turn)
    }

    /// The dearest path from `begin` within `nodes`, among which there is no circle any more.
    fn dearest_within(&self, begin: u64, nodes: &BTreeSet<u64>) -> Result<Dear, Fault> {
        // By kind: the cost from each on, and the dearest path's next step.
        let mut dearest: BTreeMap<u64, [Option<From>; KINDS]> = BTreeMap::new();
        let mut entered = BTreeSet::new();
        let mut open = vec![begin];
        while let Some(at) = open.last().copied() {
            let ways = self.ways.get(&at).into_iter().flatten();
            let ways: Vec<u64> = ways.copied().filter(|to| nodes.contains(to)).collect();
            if entered.insert(at) {
                let new = ways.iter().filter(|to| !dearest.contains_key(to));
                for to in new {
                    if entered.contains(to) {
                        return Err(Fault::Irreducible(*to));
                    }
                    open.push(*to);
                }
                continue;
            }
            open.pop();
            if dearest.contains_key(&at) {
                continue;
            }
            let from = self.from(at, &ways, &dearest);
            dearest.insert(at, from);
        }
        let path = |kind| self.path(begin, &dearest, kind);
        Ok(Dear([path(0), path(1), path(2), path(3)]))
    }

    /// The dearest way on from an instruction by the kind of path, given those of its successors.
    fn from(
        &self,
        at: u64,
        ways: &[u64],
        dearest: &BTreeMap<u64, [Option<From>; KINDS]>,
    ) -> [Option<From>; KINDS] {
        let mut best: [Option<From>; KINDS] = Default::default();
        let mut take = |kind: Option<usize>, from: From| {
            if let Some(kind) = kind
                && best[kind].as_ref().is_none_or(|best| best.cost < from.cost)
            {
                best[kind] = Some(from);
            }
        };
        for (of_this, own) in self.costs.get(&at).into_iter().flat_map(Dear::kinds) {
            if self.leaves(at, ways) {
                let cost = own.cost;
                take(
                    Some(of_this),
                    From {
                        cost,
                        of_this,
                        next: None,
                    },
                );
            }
            for to in ways {
                let after = dearest.get(to).into_iter().flatten().enumerate();
                for (kind, after) in after.filter_map(|(kind, after)| Some((kind, after.as_ref()?)))
                {
                    let cost = own.cost + after.cost;
                    let next = Some((*to, kind));
                    take(
                        kind_of_both(of_this, kind),
                        From {
                            cost,
                            of_this,
                            next,
                        },
                    );
                }
            }
        }
        best
    }

    /// True if a path may end at an instruction: nothing follows it, or something that is not `within`.
    fn leaves(&self, at: u64, within: &[u64]) -> bool {
        within.is_empty()
            || self
                .ways
                .get(&at)
                .is_none_or(|ways| ways.len() != within.len())
    }

    /// The path of a kind that `dearest` describes.
    fn path(
        &self,
        begin: u64,
        dearest: &BTreeMap<u64, [Option<From>; KINDS]>,
        kind: usize,
    ) -> Option<Path> {
        let mut path = Path::default();
        let mut next = Some((begin, kind));
        while let Some((at, kind)) = next {
            let from = dearest.get(&at)?[kind].as_ref()?;
            path.add(self.costs.get(&at)?.0[from.of_this].as_ref()?, 1);
            next = from.next;
        }
        Some(path)
    }
}

/// The dearest way on from an instruction.
struct From {
    cost: u64,
    /// Kind of the path through this instruction alone, its callees included.
    of_this: usize,
    /// The next instruction, and the kind of the path from there.
    next: Option<(u64, usize)>,
}

#[cfg(test)]
mod tests {
    use std::collections::{BTreeMap, BTreeSet};

    use super::{Code, Paths, WorstCaseError, cost, cycles, size_before};
    use crate::code::Function;
    use crate::flow::Instruction;

    const NOP: u32 = 0xBF00;
    const RETURN: u32 = 0x4770;
    const BRANCH: u32 = 0xE000;
    const BRANCH_IF_EQUAL: u32 = 0xD000;

    /// An instruction: first halfword, target of its jump, target of its call.
    type Line = (u32, Option<u64>, Option<u64>);

    /// Instructions of two bytes from `begin` on.
    fn function(name: &str, begin: u64, lines: &[Line]) -> (u64, Function) {
        let instructions = lines.iter().enumerate().map(|(at, line)| Instruction {
            address: begin + 2 * at as u64,
            first: line.0,
            second: 0,
            jump: line.1,
            call: line.2,
            table: Vec::new(),
        });
        let function = Function {
            name: name.to_owned(),
            size: 2 * lines.len() as u64,
            instructions: instructions.collect(),
            ..Function::default()
        };
        (begin, function)
    }

    fn bound<const N: usize>(
        functions: [(u64, Function); N],
        turns: impl Fn(&Function, u64) -> Option<u64>,
    ) -> Result<u64, WorstCaseError> {
        let code = Code {
            functions: BTreeMap::from(functions),
        };
        cost(&code, 0x100, &Paths::default(), &turns, &|_| 1)
    }

    #[test]
    fn the_longer_of_two_ways_counts() {
        let branching = function(
            "f",
            0x100,
            &[
                (BRANCH_IF_EQUAL, Some(0x108), None),
                (NOP, None, None),
                (NOP, None, None),
                (NOP, None, None),
                (RETURN, None, None),
            ],
        );
        assert_eq!(bound([branching], |_, _| None), Ok(5));
    }

    #[test]
    fn a_loop_counts_as_often_as_it_turns_and_once_more_and_its_callee_each_time() {
        // Inner loop 0x104..0x106, outer 0x102..0x10A, and a call in the inner.
        let lines = [
            (NOP, None, None),
            (NOP, None, None),
            (NOP, None, Some(0x200)),
            (BRANCH_IF_EQUAL, Some(0x104), None),
            (NOP, None, None),
            (BRANCH_IF_EQUAL, Some(0x102), None),
            (RETURN, None, None),
        ];
        let called = || function("called", 0x200, &[(NOP, None, None), (RETURN, None, None)]);
        let turns = |_: &Function, head: u64| Some(if head == 0x104 { 9 } else { 4 });
        // Inner: call, callee of 2, branch: 4, ten times. Outer: 1 + 40 + 2, five times.
        let whole = bound([function("f", 0x100, &lines), called()], turns);
        assert_eq!(whole, Ok(1 + 5 * 43 + 1));
        let none = |_: &Function, head: u64| (head == 0x104).then_some(9);
        assert_eq!(
            bound([function("f", 0x100, &lines), called()], none),
            Err(WorstCaseError::Unbounded("f".to_owned(), 0x102))
        );
    }

    #[test]
    fn a_loop_with_a_second_entry_and_recursion_are_refused() {
        let two_entries = [
            (BRANCH_IF_EQUAL, Some(0x104), None),
            (NOP, None, None),
            (NOP, None, None),
            (BRANCH_IF_EQUAL, Some(0x102), None),
            (RETURN, None, None),
        ];
        assert!(matches!(
            bound([function("f", 0x100, &two_entries)], |_, _| Some(1)),
            Err(WorstCaseError::Irreducible(..))
        ));
        let itself = [(NOP, None, Some(0x100)), (RETURN, None, None)];
        assert!(matches!(
            bound([function("f", 0x100, &itself)], |_, _| Some(1)),
            Err(WorstCaseError::Recursion(_))
        ));
    }

    #[test]
    fn a_jump_out_of_the_function_costs_what_it_leads_to() {
        let first = function(
            "f",
            0x100,
            &[(NOP, None, None), (BRANCH, Some(0x200), None)],
        );
        let second = function("g", 0x200, &[(NOP, None, None), (RETURN, None, None)]);
        assert_eq!(bound([first, second], |_, _| None), Ok(4));
    }

    #[test]
    fn a_copy_turns_as_often_as_it_has_bytes_and_must_say_them() {
        let copy = || {
            let lines = [
                (NOP, None, None),
                (BRANCH_IF_EQUAL, Some(0x200), None),
                (RETURN, None, None),
            ];
            function("__aeabi_memcpy", 0x200, &lines)
        };
        // MOVS r2, #12; the call; return.
        let sized = [
            (0x220C, None, None),
            (NOP, None, Some(0x200)),
            (RETURN, None, None),
        ];
        assert_eq!(
            bound([function("f", 0x100, &sized), copy()], |_, _| None),
            // Two before the copy and one behind; its path of 3, and 12 turns of 2.
            Ok(3 + 3 + 12 * 2)
        );
        // MOV.W r2, #768, whose two halfwords no narrow instruction has.
        let (_, mut wide) = function("f", 0x100, &sized);
        wide.instructions[0].first = 0xF44F;
        wide.instructions[0].second = 0x7240;
        assert_eq!(
            size_before(&wide.instructions[..1], "__aeabi_memcpy"),
            Some(768)
        );
        let unsized_copy = [(NOP, None, Some(0x200)), (RETURN, None, None)];
        assert_eq!(
            bound([function("f", 0x100, &unsized_copy), copy()], |_, _| None),
            Err(WorstCaseError::Size("f".to_owned(), 0x100))
        );
    }

    #[test]
    fn a_load_branches_only_if_it_loads_the_program_counter() {
        let of = |first: u32, second: u32| {
            let (_, mut one) = function("f", 0x100, &[(first, None, None)]);
            one.instructions[0].second = second;
            cycles(&one.instructions[0], 0)
        };
        // LDR.W r0 and pc, [r1]; STR.W r0, [r1]: 2 each, and a branch of 4.
        assert_eq!([of(0xF8D1, 0x0000), of(0xF8D1, 0xF000)], [2, 6]);
        assert_eq!(of(0xF8C1, 0x0000), 2);
        // PUSH {r4, lr}, POP {r4, r5}, POP {r4, pc}: 1 and one a register.
        assert_eq!([of(0xB510, 0), of(0xBC30, 0), of(0xBD10, 0)], [3, 3, 7]);
        // STMDB sp!, {r4-r11, lr}; LDMIA sp!, {r4-r11, pc}.
        assert_eq!([of(0xE92D, 0x4FF0), of(0xE8BD, 0x8FF0)], [10, 14]);
    }

    #[test]
    fn a_routine_for_whole_words_stores_the_last_bytes_alone_one_by_one() {
        let clearing = |name: &str| {
            let lines = [
                (NOP, None, None),
                // STR, and back; STRB, and back.
                (0x6008, None, None),
                (BRANCH_IF_EQUAL, Some(0x202), None),
                (0x7008, None, None),
                (BRANCH_IF_EQUAL, Some(0x206), None),
                (RETURN, None, None),
            ];
            function(name, 0x200, &lines)
        };
        // MOVS r1, #14; the call; return.
        let caller = [
            (0x210E, None, None),
            (NOP, None, Some(0x200)),
            (RETURN, None, None),
        ];
        let of = |name| {
            let both = [function("f", 0x100, &caller), clearing(name)];
            bound(both, |_, _| None)
        };
        // 3 of the caller, 6 of the path; 14/4 turns of 2 by words and 2 by bytes, or 14 by bytes.
        assert_eq!(of("__aeabi_memclr4"), Ok(3 + 6 + 7 + 2 * 2));
        assert_eq!(of("__aeabi_memclr"), Ok(3 + 6 + 14 * 2));
    }

    #[test]
    fn paths_call_what_they_must_and_once_what_they_may_once() {
        // Two calls of the same function, the second where a branch is not taken, and one of another instead.
        let lines = [
            (NOP, None, Some(0x200)),
            (BRANCH_IF_EQUAL, Some(0x108), None),
            (NOP, None, Some(0x200)),
            (RETURN, None, None),
            (NOP, None, Some(0x300)),
            (RETURN, None, None),
        ];
        let long = [
            (NOP, None, None),
            (NOP, None, None),
            (NOP, None, None),
            (RETURN, None, None),
        ];
        let code = Code {
            functions: BTreeMap::from([
                function("f", 0x100, &lines),
                function("long", 0x200, &long),
                function("short", 0x300, &[(RETURN, None, None)]),
            ]),
        };
        let bound = |paths: &Paths| cost(&code, 0x100, paths, &|_, _| None, &|_| 1);
        assert_eq!(bound(&Paths::default()), Ok(4 + 2 * 4));
        let once = Paths {
            once: Some(0x200),
            ..Paths::default()
        };
        // Only the way by the other function is left: four instructions, one of each callee's.
        assert_eq!(bound(&once), Ok(4 + 4 + 1));
        let through = Paths {
            through: Some(0x300),
            ..Paths::default()
        };
        assert_eq!(bound(&through), Ok(4 + 4 + 1));
        let without = |begin| Paths {
            without: BTreeSet::from([begin]),
            ..Paths::default()
        };
        assert_eq!(bound(&without(0x300)), Ok(4 + 2 * 4));
        assert_eq!(bound(&without(0x200)), Err(WorstCaseError::NoPath));
    }

    #[test]
    fn a_call_that_may_be_made_once_is_refused_in_a_loop() {
        let lines = [
            (NOP, None, Some(0x200)),
            (BRANCH_IF_EQUAL, Some(0x100), None),
            (RETURN, None, None),
        ];
        let code = Code {
            functions: BTreeMap::from([
                function("f", 0x100, &lines),
                function("g", 0x200, &[(RETURN, None, None)]),
            ]),
        };
        let once = Paths {
            once: Some(0x200),
            ..Paths::default()
        };
        assert_eq!(
            cost(&code, 0x100, &once, &|_, _| Some(2), &|_| 1),
            Err(WorstCaseError::Repeated("f".to_owned(), 0x100))
        );
    }
}
