//! The models and the image against the maker's register data, as `stm32-metapac` carries it for this chip: bases, offsets
//! and bits of every model, the clock enables, pins, interrupt and DMA request, and every register that the image uses.

use std::collections::BTreeSet;

use rlg_registers::board::{Behaviour, named};
use rlg_registers::host::{ask, block, upload};
use rlg_registers::image::Image;
use rlg_registers::machine::{Ending, Machine};
use rlg_registers::{system, ticks};
use stm32_metapac::metadata::ir::{Array, BitOffset, Block, BlockItem, BlockItemInner, Field, IR};
use stm32_metapac::metadata::{METADATA, Peripheral};
use trueaxis::service_frame::{Request, RequestKind};

fn peripheral(name: &str) -> &'static Peripheral {
    let found = METADATA.peripherals.iter().find(|one| one.name == name);
    found.unwrap_or_else(|| panic!("the maker has no {name}"))
}

/// Letters and digits alone, lower-case: the metadata writes block names in two ways.
fn plain(name: &str) -> String {
    name.chars()
        .filter(char::is_ascii_alphanumeric)
        .map(|letter| letter.to_ascii_lowercase())
        .collect()
}

/// The items of a block and of those that it extends.
fn items(ir: &'static IR, block: &str) -> Vec<&'static BlockItem> {
    let found: &Block = ir
        .blocks
        .iter()
        .find(|one| plain(one.name) == plain(block))
        .unwrap_or_else(|| panic!("no block {block}"));
    let below = found.extends.map_or_else(Vec::new, |name| items(ir, name));
    found.items.iter().chain(below).collect()
}

/// The fields of a set and of those that it extends.
fn fields(ir: &'static IR, set: &str) -> Vec<&'static Field> {
    let found = ir
        .fieldsets
        .iter()
        .find(|one| plain(one.name) == plain(set))
        .unwrap_or_else(|| panic!("no field set {set}"));
    let below = found.extends.map_or_else(Vec::new, |name| fields(ir, name));
    found.fields.iter().chain(below).collect()
}

/// Offset of element `at` of an array \[bytes or bits\].
fn element(array: Option<&Array>, at: u32) -> Option<u32> {
    match array {
        None => (at == 0).then_some(0),
        Some(Array::Regular(array)) => (at < array.len).then_some(at * array.stride),
        Some(Array::Cursed(array)) => array.offsets.get(at as usize).copied(),
    }
}

/// A name without its index, and the index.
fn indexed(name: &str) -> (&str, u32) {
    match name.trim_end_matches(']').split_once('[') {
        Some((name, at)) => (name, at.parse().expect("a number in brackets")),
        None => (name, 0),
    }
}

/// Offset and field set of a register by its path, as `ST[6].CR`.
fn register(ir: &'static IR, block: &str, path: &str) -> Option<(u32, Option<&'static str>)> {
    let (first, rest) = path.split_once('.').unwrap_or((path, ""));
    let (name, at) = indexed(first);
    let such = items(ir, block);
    let item = such.iter().find(|item| plain(item.name) == plain(name))?;
    let offset = item.byte_offset + element(item.array.as_ref(), at)?;
    match &item.inner {
        BlockItemInner::Register(register) => Some((offset, register.fieldset)),
        BlockItemInner::Block(inner) => {
            let (within, set) = register(ir, inner.block, rest)?;
            Some((offset + within, set))
        }
    }
}

/// Bits of a field's element.
fn mask(field: &Field, at: u32) -> Option<u32> {
    let BitOffset::Regular(begin) = &field.bit_offset else {
        return None;
    };
    let begin = begin.offset + element(field.array.as_ref(), at)?;
    Some((((1_u64 << field.bit_size) - 1) << begin) as u32)
}

/// Fields that other chips of the family have with one bit more; this chip's widths are those of RM0090 (3.9.2, 3.9.7, 5.4.1,
/// 10.5.5).
const FAMILY: [&str; 4] = [
    "DMA2.ST[6].CR.CHSEL",
    "FLASH.ACR.LATENCY",
    "FLASH.CR.SNB",
    "PWR.CR1.VOS",
];

#[test]
fn models_are_the_makers() {
    let (mut registers, mut bits, mut wider) = (0, 0, BTreeSet::new());
    for (name, begin, model, clock) in named() {
        let maker = peripheral(name);
        assert_eq!(maker.address, u64::from(begin), "{name}");
        let data = maker.registers.as_ref().expect("a block");
        for (path, offset, model_bits) in model {
            let found = register(data.ir, data.block, path);
            let (at, set) = found.unwrap_or_else(|| panic!("the maker's {name} has no {path}"));
            assert_eq!(at, *offset, "{name}.{path}");
            registers += 1;
            for (field, expected) in *model_bits {
                let set = fields(data.ir, set.expect("a register with fields"));
                let (field_name, at) = indexed(field);
                let field = set
                    .iter()
                    .find(|one| plain(one.name) == plain(field_name))
                    .unwrap_or_else(|| panic!("{name}.{path} has no {field}"));
                let found = mask(field, at).expect("an offset");
                // Data of a family may have a field wider than this chip does, from the same lowest bit.
                let is_part = found & expected == *expected
                    && found.trailing_zeros() == expected.trailing_zeros();
                assert!(
                    is_part,
                    "{name}.{path}.{field_name}: {found:#x}, {expected:#x}"
                );
                if found != *expected {
                    wider.insert(format!("{name}.{path}.{field_name}"));
                }
                bits += 1;
            }
        }
        check_clock(maker, clock);
    }
    println!(
        "models against the maker's data: {} bases, {registers} offsets, {bits} fields equal; of these the maker's are wider, for the family: {wider:?}",
        named().len()
    );
    let family: BTreeSet<String> = FAMILY.map(str::to_owned).into();
    assert_eq!(wider, family);
}

/// The bit of the clock enable, by register (0 AHB1, 4 APB1, 5 APB2) and number.
fn check_clock(maker: &Peripheral, clock: Option<(usize, u32)>) {
    let enable = maker.rcc.as_ref().and_then(|rcc| rcc.enable.as_ref());
    let Some((place, bit)) = clock else {
        // Clocks of flash and debug port are always on here.
        return;
    };
    let enable = enable.unwrap_or_else(|| panic!("{} has no clock enable", maker.name));
    let rcc = peripheral("RCC").registers.as_ref().expect("a block");
    let (offset, set) = register(rcc.ir, rcc.block, enable.register).expect("a register");
    assert_eq!(offset, 0x30 + 4 * place as u32, "{}", maker.name);
    let set = fields(rcc.ir, set.expect("fields"));
    let field = set
        .iter()
        .find(|field| plain(field.name) == plain(enable.field))
        .expect("the enable's field");
    assert_eq!(mask(field, 0), Some(1 << bit), "{}", maker.name);
}

#[test]
fn pins_interrupt_and_stream_are_the_makers() {
    for (name, pin, signal, function) in [
        ("SPI1", "PA5", "SCK", 5),
        ("SPI1", "PA6", "MISO", 5),
        ("SPI1", "PA7", "MOSI", 5),
        ("USART1", "PA9", "TX", 7),
        ("USART1", "PA10", "RX", 7),
        ("USART6", "PC6", "TX", 8),
        ("TIM2", "PA0", "CH1", 1),
    ] {
        let pins = peripheral(name).pins;
        let found = pins
            .iter()
            .find(|one| one.pin == pin && one.signal == signal);
        assert_eq!(found.and_then(|one| one.af), Some(function), "{name} {pin}");
    }
    let interrupt = METADATA.interrupts.iter().find(|one| one.name == "TIM2");
    assert_eq!(interrupt.expect("TIM2").number, system::TIM2);
    let requests = peripheral("USART6").dma_channels;
    let request = requests
        .iter()
        .find(|one| one.signal == "TX" && one.channel == Some("DMA2_CH6"));
    assert_eq!(request.expect("stream 6 of DMA2").request, Some(5));
}

/// Every register of a peripheral: offset, and the bits of its fields.
fn every_register(ir: &'static IR, block: &str, begin: u32, all: &mut Vec<(u32, u32)>) {
    for item in items(ir, block) {
        for at in 0..64 {
            let Some(within) = element(item.array.as_ref(), at) else {
                break;
            };
            let offset = begin + item.byte_offset + within;
            match &item.inner {
                BlockItemInner::Block(inner) => every_register(ir, inner.block, offset, all),
                BlockItemInner::Register(register) => {
                    let set = register
                        .fieldset
                        .map_or_else(Vec::new, |set| fields(ir, set));
                    let bits = set.iter().flat_map(|field| {
                        (0..32).map_while(|at| mask(field, at)).collect::<Vec<_>>()
                    });
                    let bits = bits.fold(0, |all, bits| all | bits);
                    all.push((
                        offset,
                        if register.fieldset.is_none() {
                            u32::MAX
                        } else {
                            bits
                        },
                    ));
                }
            }
        }
    }
}

#[test]
fn every_register_that_the_image_uses_is_the_makers() {
    let image = Image::build("firmware", &["raw"]);
    let mut machine = Machine::new(&image, Behaviour::SOUND, [&[], &block(2, 2)]);
    // Boot, sampling, stop, upload, start anew: every driver.
    assert_eq!(machine.run_for(ticks::of_ms(2_200)), Ending::Time);
    let stop = ask(
        &mut machine,
        &Request::new(1, RequestKind::Stop, 0),
        1_000,
        100,
    );
    assert!(stop.is_err() || stop.is_ok_and(|answer| answer.is_some()));
    if machine.run_for(ticks::of_ms(5)) == Ending::Software {
        machine.follow(&Ending::Software);
    }
    assert_eq!(machine.run_for(ticks::of_ms(15)), Ending::Time);
    let stored = upload(&mut machine, &block(3, 3)).expect("a stopped unit");
    assert_eq!(stored.outcome, 0);
    let (mut used, mut set_bits) = (0, 0);
    for (address, bits) in &machine.board().used {
        // The processor's own: PM0214, not the chip maker's part.
        if *address >= 0xE000_E000 && *address < 0xE000_F000 {
            continue;
        }
        let block = address & !0x3FF;
        let maker = METADATA
            .peripherals
            .iter()
            .filter(|one| one.address == u64::from(block))
            .find_map(|one| one.registers.as_ref().map(|data| (one.name, data)));
        let (name, data) = maker.unwrap_or_else(|| panic!("nothing at {address:#010x}"));
        let mut all = Vec::new();
        every_register(data.ir, data.block, 0, &mut all);
        let such: Vec<u32> = all
            .iter()
            .filter(|(offset, _)| *offset == address - block)
            .map(|(_, bits)| *bits)
            .collect();
        assert!(
            !such.is_empty(),
            "{name} has no register at {address:#010x}"
        );
        let known = such.iter().fold(0, |known, bits| known | bits);
        assert_eq!(
            bits & !known,
            0,
            "{name}, {address:#010x}: bits {bits:#010x}"
        );
        used += 1;
        set_bits += bits.count_ones();
    }
    assert!(used > 40, "{used} registers");
    println!(
        "registers that the image uses: {used}, with {set_bits} bits that it set, each the maker's"
    );
}
