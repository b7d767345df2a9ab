//! The static worst case of the sampling interrupt, against the most that the emulator has measured.

use std::collections::{BTreeMap, BTreeSet};

use rlg_target::code::{Code, Function};
use rlg_target::lines::Lines;
use rlg_target::worst_case::{Paths, breakdown, cost, cycles};
use rlg_target::{Image, Platform, TargetCore, on_target};
use trueaxis::{AccelerometerParameters, CrossAxis, Parameters, Sample};

/// Most turns of the interrupt's loops, by the function of the source; polls of the bus apart.
const TURNS: [(&str, u64, &str); 7] = [
    ("delay", 17, "SELECT_CYCLES, two cycles a turn"),
    ("operate", 48, "the bytes of a bank frame"),
    (
        "exchange",
        0,
        "polls: they are the bus's time, told apart below",
    ),
    (
        "wait_until_idle",
        1,
        "half a bit of the bus, 8 cycles; a bus that stays busy fails, as one whose byte does not come",
    ),
    ("transaction", 0, "a hold that no record here asks for"),
    ("close", 3, "the gyros"),
    ("sys_reset", 0, "after a panic: the run has ended"),
];

/// Time of a frame on the board's bus \[cycles\]: 384 bits of 16 cycles.
const FRAME_CYCLES: u64 = 384 * 16;

/// Largest time of a byte that does not come \[cycles\]: twice 128 polls of 11.
const ABSENT_BYTE_CYCLES: u64 = 2 * 128 * 11;

/// A period of 250 µs at 168 MHz \[cycles\].
const PERIOD_CYCLES: u64 = 42_000;

/// Most that an interrupt may cost \[cycles\], every fetch from the flash's cache: 80 % of a period.
const MOST_CYCLES: u64 = PERIOD_CYCLES / 5 * 4;

/// Beginnings of the functions whose name ends so; there is at least one.
fn named(code: &Code, end: &str) -> BTreeSet<u64> {
    let all = code.functions.iter();
    let such = all.filter(|(_, function)| function.name.ends_with(end));
    let found: BTreeSet<u64> = such.map(|(begin, _)| *begin).collect();
    assert!(!found.is_empty(), "the image has no {end}");
    found
}

/// The only one of them.
fn only(code: &Code, end: &str) -> Option<u64> {
    let found = named(code, end);
    assert_eq!(found.len(), 1, "{end}");
    found.first().copied()
}

/// Paths of an interrupt, and the bus's time on them \[cycles\]. Facts that the branches do not show:
///
/// - One output period ends in an interrupt at most. `Processor::period_probed` has three places where one may: the first
///   unless the lost periods end one; the second, the lost periods, if they do; the third if neither has given a frame.
/// - A bus that fails gives no bytes, so nothing is checked (`BankDecoder::reading`), there is no sample, the period is
///   lost (`Processor::resume`), and no sample resumes.
fn paths(code: &Code) -> [(Paths, u64); 2] {
    let once = only(code, "::chain::Chain<N,T>::finish");
    let frame = Paths {
        once,
        ..Paths::default()
    };
    let mut without = named(code, "::counter_bank::checksum");
    without.extend(named(code, "chain::Chain<N,T>>::begin_or_resume"));
    let fails = Paths {
        once,
        through: only(code, "::processor::Processor<N,T>::resume"),
        without,
    };
    [
        (frame, FRAME_CYCLES),
        (fails, FRAME_CYCLES + ABSENT_BYTE_CYCLES),
    ]
}

/// Bound of the interrupt of an image \[instructions\], and \[cycles\] with every fetch from the flash's cache and with none,
/// the bus's time included on the board.
fn bounds(image: &Image, platform: Platform) -> [u64; 3] {
    let code = Code::read(&image.elf).expect("the image's code");
    let lines = Lines::of(&image.elf).expect("debug information");
    let turns = |_: &Function, head: u64| turns_of(&lines, head);
    let interrupt = code.find("TIM2").expect("the interrupt");
    // In the emulator a bus cannot fail.
    let paths = match platform {
        Platform::Board => paths(&code).to_vec(),
        Platform::Emulator => paths(&code)[..1].to_vec(),
    };
    let most = |with_bus: bool, of: &dyn Fn(&rlg_target::flow::Instruction) -> u64| {
        let bounds = paths.iter().map(|(paths, bus)| {
            let bound = cost(&code, interrupt, paths, &turns, of);
            bound.expect("every loop has a bound") + if with_bus { *bus } else { 0 }
        });
        bounds.max().unwrap_or(0)
    };
    [
        most(false, &|_| 1),
        most(true, &|one| cycles(one, 0)),
        most(true, &|one| cycles(one, 5)),
    ]
}

fn turns_of(lines: &Lines<'_>, head: u64) -> Option<u64> {
    let of_source = lines.places(head).into_iter();
    of_source
        .filter_map(|place| TURNS.iter().find(|(name, ..)| *name == place.function))
        .map(|(_, turns, _)| *turns)
        .next()
}

/// Prints the dearest functions on the dearest path of a frame that comes, each without its callees \[cycles\].
fn print_dearest(image: &Image) {
    const SHOWN: usize = 12;
    let code = Code::read(&image.elf).expect("the image's code");
    let lines = Lines::of(&image.elf).expect("debug information");
    let turns = |_: &Function, head: u64| turns_of(&lines, head);
    let interrupt = code.find("TIM2").expect("the interrupt");
    let [(frame, _), _] = paths(&code);
    let parts = breakdown(&code, interrupt, &frame, &turns, &|one| cycles(one, 0));
    let mut functions: BTreeMap<&str, u64> = BTreeMap::new();
    for (address, cost) in parts.expect("every loop has a bound") {
        *functions
            .entry(code.name(code.holder(address)))
            .or_default() += cost;
    }
    let mut functions: Vec<_> = functions.into_iter().collect();
    functions.sort_by_key(|(_, cost)| std::cmp::Reverse(*cost));
    for (name, cost) in functions.into_iter().take(SHOWN) {
        println!("    {cost:6} {name}");
    }
}

/// Accelerometers, an adapting strip, and one sample in an output period: every output path in every interrupt.
fn parameters() -> Parameters {
    Parameters::default().with(|p| {
        p.samples_per_output = 1;
        p.flexure_s2 = CrossAxis::from_array([7e-8; 6]);
        p.dither_amplitude_rad = [7e-4; 3];
        p.adaptation_time_s = 2.0;
        p.accelerometers = Some(AccelerometerParameters {
            weight_m_s: [6e-6; 3],
            bias_m_s2: [1e-3; 3],
            scale_error: [1e-4; 3],
            misalignment_rad: CrossAxis::from_array([1e-4; 6]),
            lever_arm_m: [[0.04, 0.01, -0.02]; 3],
        });
    })
}

/// Readings of any size: a linear congruential generator's (Knuth's MMIX).
fn readings() -> impl Iterator<Item = Sample> {
    let mut state = 4000u64;
    let mut word = move || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (state >> 32) as i32
    };
    (0..5_000).map(move |_| Sample {
        pulse_counts: [word(), word(), word()],
        pickoff_codes: [word(), word(), word()],
        accelerometer_codes: [word(), word(), word()],
    })
}

#[test]
#[ignore = "needs qemu-system-arm; cargo verify runs it"]
fn no_interrupt_costs_more_than_its_static_bound() {
    println!("image, bound of instructions, of cycles (all cached, nothing cached), measured most");
    for core in [TargetCore::F32, TargetCore::Fixed] {
        for with_terms in [false, true] {
            let board = if with_terms {
                Image::build_with_terms(Platform::Board, core)
            } else {
                Image::build(Platform::Board, core)
            };
            let board = board.expect("the image builds");
            let [instructions, cached, uncached] = bounds(&board, Platform::Board);
            println!(
                "{}{}: {instructions}, {cached} and {uncached} with the bus",
                Platform::Board.binary(core),
                if with_terms { " with every term" } else { "" },
            );
            print_dearest(&board);
            assert!(cached <= MOST_CYCLES, "{cached} of {MOST_CYCLES}");
        }

        let emulated = Image::build(Platform::Emulator, core).expect("the image builds");
        let [bound, ..] = bounds(&emulated, Platform::Emulator);
        let run = on_target::compare(&emulated, core, &parameters(), readings(), &mut |_| {})
            .expect("the image runs");
        let measured = run.instructions_per_interrupt.expect("interrupts").max;
        println!(
            "{}: {bound}, measured {measured}",
            Platform::Emulator.binary(core)
        );
        assert!(u64::from(measured) <= bound, "{measured} of {bound}");
        // A bound far above every run would be of no use.
        assert!(bound < 10 * u64::from(measured), "{measured} of {bound}");
    }
}

/// Readings of a unit that turns and dithers little, 20 000 of them.
fn ordinary() -> impl Iterator<Item = Sample> {
    (0..20_000_i32).map(|period| {
        let swing = [0, 120, 190, 120, 0, -120, -190, -120];
        let at = |period: i32| swing[period.rem_euclid(8) as usize];
        Sample {
            pulse_counts: [at(period) - at(period - 1) + period % 3; 3],
            pickoff_codes: [at(period) * 16_384; 3],
            accelerometer_codes: [409, period % 5, -7],
        }
    })
}

#[test]
#[ignore = "needs qemu-system-arm; prints the cost of a sample"]
fn a_sample_costs_so_much() {
    for core in [TargetCore::F32, TargetCore::Fixed] {
        let image = Image::build(Platform::Emulator, core).expect("the image builds");
        let parameters = parameters().with(|p| {
            p.samples_per_output = 10;
            p.pulse_weight_rad = [3.9e-6; 3];
        });
        let run = on_target::compare(&image, core, &parameters, ordinary(), &mut |_| {})
            .expect("the image runs");
        let processor = run.instructions_per_processor.expect("interrupts");
        let interrupt = run.instructions_per_interrupt.expect("interrupts");
        println!(
            "{}: processor {:.1} (most {}), interrupt {:.1} (most {}), bits equal: {}",
            Platform::Emulator.binary(core),
            processor.mean,
            processor.max,
            interrupt.mean,
            interrupt.max,
            run.bit_equal
        );
        assert!(run.bit_equal);
    }
}
