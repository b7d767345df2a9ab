//! Code reachable from the sampling interrupt, in the linked image: no panic, no logging, no host call, no loop without a
//! bound; and the largest stack depth of all code.

use rlg::target::budgets::Budgets;
use rlg::target::code::Code;
use rlg::target::lines::Lines;
use rlg::target::stack::{StackBound, StackError};
use rlg::target::{Image, Platform, TargetCore};

/// Returns every image by its name: the board's and the emulator's.
fn images() -> impl Iterator<Item = (&'static str, Image)> {
    [Platform::Board, Platform::Emulator]
        .into_iter()
        .flat_map(|platform| [TargetCore::F32, TargetCore::Fixed].map(|core| (platform, core)))
        .map(|(platform, core)| {
            let image = Image::build(platform, core).expect("the image builds");
            (platform.binary(core), image)
        })
}

/// Returns the names of everything reached from `from`; none of it may call through a register, which would hide the target.
fn reached(code: &Code, from: &str, forbid_indirect: bool) -> Vec<String> {
    let begin = code.find(from).expect("it is in the image");
    code.reachable(begin)
        .into_iter()
        .map(|begin| {
            let function = &code.functions[&begin];
            assert!(
                !forbid_indirect || function.indirect.is_empty(),
                "a call through a register in {} at {:#x?}",
                function.name,
                function.indirect
            );
            function.name.clone()
        })
        .collect()
}

#[test]
#[ignore = "needs the image's target; cargo verify runs it"]
fn the_interrupt_reaches_no_panic_no_logging_and_no_host_call() {
    for (name, image) in images() {
        let code = Code::read(&image.elf).expect("the image's code");
        let from_interrupt = reached(&code, "TIM2", true);
        assert!(
            from_interrupt.iter().any(|name| name.contains("advance")),
            "the walk misses the chain: {from_interrupt:?}"
        );
        for forbidden in ["panic", "defmt", "semihosting", "fmt"] {
            assert!(
                !from_interrupt.iter().any(|name| name.contains(forbidden)),
                "{name} reaches {forbidden}: {from_interrupt:?}"
            );
        }
        // The same walk from reset does reach them: it can detect the calls forbidden above.
        let from_reset = reached(&code, "main", false);
        for expected in ["panic", "defmt"] {
            assert!(
                from_reset.iter().any(|name| name.contains(expected)),
                "the walk from main misses {expected}: {from_reset:?}"
            );
        }
    }
}

/// Loops allowed in the interrupt: function of the source, or of the image if it has no source of ours; their largest
/// number; the bound of each.
const BOUNDED: [(&str, usize, &str); 5] = [
    ("delay", 1, "SELECT_CYCLES, a constant"),
    ("operate", 1, "the bytes of one operation: a bank frame's"),
    (
        "exchange",
        2,
        "BYTE_POLLS of the status register, once to send and once to receive",
    ),
    (
        "transaction",
        1,
        "emulator: a record's hold, at most 255/32 of a period",
    ),
    (
        "memclr",
        4,
        "the size of a value, known where it is cleared",
    ),
];

/// Returns the entry of [`BOUNDED`] for a loop: the innermost function that has one.
fn bounded(lines: &Lines, symbol: &str, head: u64) -> Option<usize> {
    let of_source = lines.places(head).into_iter().map(|place| place.function);
    of_source
        .filter_map(|name| BOUNDED.iter().position(|(known, ..)| *known == name))
        .next()
        .or_else(|| {
            let memory = symbol.contains("::mem::") || symbol.starts_with("__aeabi_mem");
            BOUNDED
                .iter()
                .position(|(known, ..)| memory && symbol.contains(known))
        })
}

/// Returns the loops of the interrupt that are not in [`BOUNDED`] or exceed its number; and the number found for each entry.
fn loops(elf: &[u8]) -> (Vec<String>, [usize; BOUNDED.len()]) {
    let code = Code::read(elf).expect("the image's code");
    let lines = Lines::of(elf).expect("debug information");
    let mut unknown = Vec::new();
    let mut found = [0; BOUNDED.len()];
    for begin in code.reachable(code.find("TIM2").expect("the interrupt")) {
        let function = &code.functions[&begin];
        for head in &function.loops {
            match bounded(&lines, &function.name, *head) {
                Some(known) => found[known] += 1,
                None => unknown.push(format!("{} at {head:#x}", function.name)),
            }
        }
    }
    for (found, (name, most, _)) in found.iter().zip(BOUNDED) {
        if *found > most {
            unknown.push(format!("{found} loops in {name}"));
        }
    }
    (unknown, found)
}

#[test]
#[ignore = "needs the image's target; cargo verify runs it"]
fn every_loop_of_the_interrupt_is_known_with_its_bound() {
    let mut ever = [0; BOUNDED.len()];
    for (name, image) in images() {
        let (unknown, found) = loops(&image.elf);
        println!("{name}: {found:?}");
        assert!(unknown.is_empty(), "{name}: {unknown:?}");
        for (ever, found) in ever.iter_mut().zip(found) {
            *ever += found;
        }
    }
    for (found, (name, ..)) in ever.iter().zip(BOUNDED) {
        assert!(*found > 0, "no image has a loop in {name} any more");
    }
}

#[test]
#[ignore = "needs the image's target; cargo verify runs it"]
fn a_loop_without_a_stated_bound_is_found() {
    for (name, image) in images() {
        // The chain, modified to loop for ever: its first instruction becomes a jump to itself.
        let code = Code::read(&image.elf).expect("the image's code");
        let mut functions = code.functions.iter();
        let chain = functions.find(|(_, function)| function.name.ends_with("sampling::advance"));
        let chain = *chain.expect("the chain").0;
        let mut elf = image.elf.clone();
        let at = file_offset(&elf, chain);
        elf[at..at + 4].copy_from_slice(&branch(chain, chain));
        let (unknown, _) = loops(&elf);
        let due = format!("{} at {chain:#x}", code.functions[&chain].name);
        assert_eq!(unknown, [due], "{name}");
    }
}

#[test]
#[ignore = "needs the image's target; cargo verify runs it"]
fn every_image_keeps_its_memory_budgets_and_the_stack_fits() {
    let budgets = Budgets::of_workspace().expect("the budgets");
    for (name, image) in images() {
        let stack = StackBound::of(&image.elf).expect("the stack has a bound");
        println!(
            "{}: flash {}, RAM {}, stack {} of {} bytes; main {} by {:?}",
            name,
            image.flash_bytes,
            image.ram_bytes,
            stack.worst_bytes,
            stack.available_bytes,
            stack.main.bytes,
            stack.main.path,
        );
        for handler in &stack.handlers {
            println!("  {} {} by {:?}", handler.name, handler.bytes, handler.path);
        }
        let exceeded = budgets.exceeded_by_image(&image).expect("the stack");
        assert!(exceeded.is_empty(), "{name}: {exceeded:?}");
        // A budget of nothing must be exceeded: the comparison can fail.
        let mut nothing = budgets.clone();
        nothing.stack_bytes.at_most = 1.0;
        assert_eq!(nothing.exceeded_by_image(&image).expect("it").len(), 1);
    }
}

#[test]
#[ignore = "needs the image's target; cargo verify runs it"]
fn what_a_debugger_looks_for_is_in_every_image_by_its_name_and_whole() {
    use object::{Object, ObjectSymbol};
    /// A trace of 256 entries of 52 bytes behind 20; five words of the last failure.
    const RECORDS: [(&str, u64); 2] = [("TRACE", 20 + 256 * 52), ("LAST_FAILURE", 20)];
    for (image_name, image) in images() {
        let file = object::File::parse(image.elf.as_slice()).expect("an ELF file");
        for (name, bytes) in RECORDS {
            let symbol = file.symbols().find(|symbol| symbol.name() == Ok(name));
            let size = symbol.map(|symbol| symbol.size());
            assert_eq!(size, Some(bytes), "{name} in {image_name}");
        }
    }
}

#[test]
#[ignore = "needs the image's target; cargo verify runs it"]
fn recursion_in_the_interrupt_has_no_bound_and_is_refused() {
    let (_, image) = images().next().expect("an image");
    // The interrupt's chain, modified to call the interrupt: its first instruction becomes a jump back.
    let code = Code::read(&image.elf).expect("the image's code");
    let interrupt = code.find("TIM2").expect("the interrupt");
    let callee = *code.functions[&interrupt]
        .targets
        .first()
        .expect("the interrupt calls something");
    let mut elf = image.elf.clone();
    let at = file_offset(&elf, callee);
    elf[at..at + 4].copy_from_slice(&branch(callee, interrupt));
    match StackBound::of(&elf) {
        Err(StackError::Recursion(names)) => {
            assert!(names.contains(&"TIM2".to_owned()), "{names:?}");
        }
        other => panic!("{other:?}"),
    }
}

/// Returns the offset in the file of the code at `address`.
fn file_offset(elf: &[u8], address: u64) -> usize {
    use object::{Object, ObjectSection};
    let file = object::File::parse(elf).expect("an ELF file");
    let text = file.section_by_name(".text").expect("code");
    let (begin, _) = text.file_range().expect("content");
    (begin + address - text.address()) as usize
}

/// Encodes B.W from one address to another (A7.7.12, encoding T4).
fn branch(from: u64, to: u64) -> [u8; 4] {
    let offset = to.wrapping_sub(from + 4) as u32;
    let sign = offset >> 24 & 1;
    let j1 = !(offset >> 23) & 1 ^ sign;
    let j2 = !(offset >> 22) & 1 ^ sign;
    let first = 0xF000 | sign << 10 | offset >> 12 & 0x3FF;
    let second = 0x9000 | j1 << 13 | j2 << 11 | offset >> 1 & 0x7FF;
    let [a, b] = (first as u16).to_le_bytes();
    let [c, d] = (second as u16).to_le_bytes();
    [a, b, c, d]
}
