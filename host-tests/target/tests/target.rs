//! The static worst case of the sampling interrupt, beside the most that the emulator has measured.

use rlg_target::code::{Code, Function};
use rlg_target::lines::Lines;
use rlg_target::worst_case::{cost, cycles};
use rlg_target::{Image, Platform, TargetCore, on_target};
use trueaxis::{AccelerometerParameters, CrossAxis, Parameters, Sample};

/// Most turns of the interrupt's loops, by the function of the source; polls of the bus apart.
const TURNS: [(&str, u64, &str); 5] = [
    ("delay", 17, "SELECT_CYCLES, two cycles a turn"),
    ("operate", 40, "the bytes of a bank frame"),
    (
        "exchange",
        0,
        "polls: they are the bus's time, told apart below",
    ),
    ("transaction", 0, "a hold that no record here asks for"),
    ("close", 3, "the gyros"),
];

/// Time of a frame on the board's bus \[cycles\]: 320 bits of 16 cycles, and one byte that does not come, twice 128 polls
/// of 11.
const BUS_CYCLES: u64 = 320 * 16 + 2 * 128 * 11;

/// A period of 250 µs at 168 MHz \[cycles\].
const PERIOD_CYCLES: u64 = 42_000;

/// Bound of the interrupt of an image \[instructions\], and \[cycles\] with every fetch from the flash's cache and with none.
fn bounds(image: &Image) -> [u64; 3] {
    let code = Code::read(&image.elf).expect("the image's code");
    let lines = Lines::of(&image.elf).expect("debug information");
    let turns = |_: &Function, head: u64| {
        let of_source = lines.places(head).into_iter();
        of_source
            .filter_map(|place| TURNS.iter().find(|(name, ..)| *name == place.function))
            .map(|(_, turns, _)| *turns)
            .next()
    };
    let interrupt = code.find("TIM2").expect("the interrupt");
    [
        cost(&code, interrupt, &turns, &|_| 1),
        cost(&code, interrupt, &turns, &|one| cycles(one, 0)),
        cost(&code, interrupt, &turns, &|one| cycles(one, 5)),
    ]
    .map(|bound| bound.expect("every loop has a bound"))
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
        let board = Image::build(Platform::Board, core).expect("the image builds");
        let [instructions, cached, uncached] = bounds(&board);
        println!(
            "{}: {instructions}, {} and {} with the bus",
            Platform::Board.binary(core),
            cached + BUS_CYCLES,
            uncached + BUS_CYCLES
        );
        assert!(instructions < PERIOD_CYCLES);

        let emulated = Image::build(Platform::Emulator, core).expect("the image builds");
        let [bound, ..] = bounds(&emulated);
        let run = on_target::compare(&emulated, core, &parameters(), readings(), &mut |_| {})
            .expect("the image runs");
        let measured = run.instructions_per_interrupt.expect("interrupts").max;
        println!(
            "{}: {bound}, measured {measured}",
            Platform::Emulator.binary(core)
        );
        assert!(u64::from(measured) <= bound, "{measured} of {bound}");
        // A bound that is far from anything that runs would say nothing.
        assert!(bound < 10 * u64::from(measured), "{measured} of {bound}");
    }
}
