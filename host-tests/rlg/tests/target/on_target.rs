//! The real image in the emulator. Needs `qemu-system-arm` and the image's target, so these tests are
//! ignored by a plain `cargo test`; `cargo verify` installs both and runs them.

use std::fs;
use std::path::Path;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rlg::target::budgets::Budgets;
use rlg::target::records::records_of;
use rlg::target::{
    Image, OnTarget, Platform, SlotImages, TargetCore, emulator, host_run, on_target,
};
use trueaxis::bank_record::BankRecord;
use trueaxis::health::{HEALTH_ITEMS, item};
use trueaxis::terms::TermKinds;
use trueaxis::{
    AccelerometerParameters, CrossAxis, Decoder, Parameters, Sample, Status, TELEMETRY_BYTES,
};

/// Returns parameters none of which has a value that hides its effect.
fn parameters() -> Parameters {
    Parameters::default().with(|p| {
        p.pulse_weight_rad = [2.1e-6, 1.9e-6, 2.05e-6];
        p.bias_rad_s = [2.7e-6, -6.0e-6, 1.2e-5];
        p.scale_error = [1.5e-5, -5.4e-6, 1.9e-5];
        p.installation_rad = cross_axis([-1.7e-4, 1.8e-4, 1.1e-4, -1.7e-5, -2.8e-4, 2.4e-4]);
        p.flexure_s2 = cross_axis([6.9e-8, 7.1e-8, 7.5e-8, 7.3e-8, 6.7e-8, 7.6e-8]);
        p.pickoff_gain = [1.001, 0.999, 1.002];
    })
}

/// Velocity of one pulse of the accelerometers \[m/s\]: 1 g is 400 pulses a period at 4 kHz, and their limit
/// 40 000.
pub const PULSE_M_S: [f64; 3] = [6.1e-6, 5.9e-6, 6.3e-6];

/// Returns [`parameters`] with accelerometers, none of whose parameters is zero either.
pub fn parameters_with_accelerometers(weight_m_s: [f64; 3]) -> Parameters {
    parameters().with(|p| {
        p.accelerometers = Some(AccelerometerParameters {
            weight_m_s,
            bias_m_s2: [3.1e-3, -4.7e-3, 2.2e-3],
            scale_error: [2.1e-4, -3.4e-4, 1.6e-4],
            misalignment_rad: cross_axis([2.1e-4, -1.4e-4, -3.0e-4, 1.7e-4, 2.6e-4, -1.9e-4]),
            lever_arm_m: [
                [0.045, 0.012, -0.018],
                [-0.011, 0.050, 0.016],
                [-0.021, 0.014, 0.038],
            ],
        })
    })
}

fn cross_axis([xy, xz, yx, yz, zx, zy]: [f64; 6]) -> CrossAxis<f64> {
    CrossAxis {
        xy,
        xz,
        yx,
        yz,
        zx,
        zy,
    }
}

/// Makes white noise: counts and pickoff codes within ± the given bounds. 220 pulses are 100 °/s at 2 µrad.
fn noisy_samples(count: usize, counts: i32, codes: i32) -> Vec<Sample> {
    let mut random = ChaCha8Rng::seed_from_u64(4000);
    (0..count)
        .map(|_| Sample {
            pulse_counts: std::array::from_fn(|_| random.random_range(-counts..=counts)),
            pickoff_codes: std::array::from_fn(|_| random.random_range(-codes..=codes)),
            ..Sample::default()
        })
        .collect()
}

/// As [`noisy_samples`], with accelerometer codes within ± `forces`.
pub fn noisy_samples_with_forces(
    count: usize,
    counts: i32,
    codes: i32,
    forces: i32,
) -> Vec<Sample> {
    let mut random = ChaCha8Rng::seed_from_u64(4001);
    noisy_samples(count, counts, codes)
        .into_iter()
        .map(|sample| Sample {
            accelerometer_codes: std::array::from_fn(|_| random.random_range(-forces..=forces)),
            ..sample
        })
        .collect()
}

fn image(core: TargetCore) -> Image {
    Image::build(Platform::Emulator, core).expect("the image builds")
}

fn run(core: TargetCore, samples: &[Sample]) -> OnTarget {
    let samples = samples.iter().copied();
    on_target::compare(&image(core), core, &parameters(), samples, &mut |_| {})
        .expect("the image runs")
}

/// As [`run`], with the given flash and bank.
fn play(core: TargetCore, slots: &SlotImages, records: &[BankRecord]) -> OnTarget {
    on_target::compare_records(&image(core), core, slots, records, &mut |_| {})
        .expect("the image runs")
}

/// Samples of each size of noise: no multiple of an output's.
const SAMPLES: usize = 5_003;

/// The same in full.
const SAMPLES_IN_FULL: usize = 20_003;

/// Samples within every range, at the acceleration stage's limit, and far beyond all.
fn holds_bit_for_bit(core: TargetCore, samples: usize) {
    for (counts, codes) in [(20, 50_000), (220, 2_000_000), (i32::MAX, i32::MAX)] {
        let samples = noisy_samples(samples, counts, codes);
        let result = run(core, &samples);
        assert!(result.bit_equal, "{:?}", result.first_difference);
        assert_eq!(result.samples as usize, samples.len());
        assert_eq!(
            (result.missed, result.late, result.outputs_lost),
            (0, 0, 0),
            "the interrupt lost something"
        );
    }
}

#[test]
#[ignore = "needs qemu-system-arm; cargo verify runs it"]
fn the_f32_image_gives_the_hosts_bits_whatever_enters() {
    holds_bit_for_bit(TargetCore::F32, SAMPLES);
}

#[test]
#[ignore = "needs qemu-system-arm; cargo verify runs it"]
fn the_fixed_image_gives_the_hosts_bits_whatever_enters() {
    holds_bit_for_bit(TargetCore::Fixed, SAMPLES);
}

#[test]
#[ignore = "needs qemu-system-arm, and minutes: --test target -- --ignored in_full"]
fn the_images_give_the_hosts_bits_whatever_enters_in_full() {
    for core in [TargetCore::F32, TargetCore::Fixed] {
        holds_bit_for_bit(core, SAMPLES_IN_FULL);
        holds_bit_for_bit_with_accelerometers(core, SAMPLES_IN_FULL);
    }
}

/// Accelerometer codes within their range, around their limit and far beyond it; pulses, and the finer codes of a replayed
/// recording, limited by the integer sum. The gyros likewise.
fn holds_bit_for_bit_with_accelerometers(core: TargetCore, samples: usize) {
    const REPLAYED_M_S: [f64; 3] = [1.0 / (1u64 << 29) as f64; 3];
    for (weight_m_s, counts, codes, forces) in [
        (PULSE_M_S, 20, 50_000, 2_000),
        (PULSE_M_S, 220, 2_000_000, 80_000),
        (REPLAYED_M_S, 220, 2_000_000, 100_000_000),
        (PULSE_M_S, 20, 50_000, i32::MAX),
        (REPLAYED_M_S, i32::MAX, i32::MAX, i32::MAX),
    ] {
        let samples = noisy_samples_with_forces(samples, counts, codes, forces);
        let parameters = parameters_with_accelerometers(weight_m_s);
        let slots = SlotImages::both(&parameters);
        let result = play(core, &slots, &records_of(samples.iter().copied()));
        assert!(
            result.bit_equal,
            "forces {forces}: {:?}",
            result.first_difference
        );
        assert_eq!(result.samples as usize, samples.len());
        assert!(result.accelerometers);
        assert_eq!(result.frames_with_velocity, result.frames);
        assert_eq!(
            (result.missed, result.late, result.outputs_lost),
            (0, 0, 0),
            "the interrupt lost something"
        );
        let held = result.health[&VELOCITY_HELD];
        assert_eq!(held > 0, forces > 2_000, "forces {forces}: {held} held");
    }
}

#[test]
#[ignore = "needs qemu-system-arm; cargo verify runs it"]
fn the_f32_image_gives_the_hosts_bits_whatever_accelerometers_send() {
    holds_bit_for_bit_with_accelerometers(TargetCore::F32, SAMPLES);
}

#[test]
#[ignore = "needs qemu-system-arm; cargo verify runs it"]
fn the_fixed_image_gives_the_hosts_bits_whatever_accelerometers_send() {
    holds_bit_for_bit_with_accelerometers(TargetCore::Fixed, SAMPLES);
}

#[test]
#[ignore = "needs qemu-system-arm; cargo verify runs it"]
fn one_bit_of_one_accelerometer_code_is_seen_in_the_images_frames() {
    const SAMPLES: usize = 400;
    const AT: usize = 205;
    let parameters = parameters_with_accelerometers(PULSE_M_S);
    let slots = SlotImages::both(&parameters);
    let samples = noisy_samples_with_forces(SAMPLES, 20, 50_000, 2_000);
    let due = AT / usize::from(parameters.samples_per_output);
    for core in [TargetCore::F32, TargetCore::Fixed] {
        let image = image(core);
        let host = |samples: &[Sample]| {
            let records = records_of(samples.iter().copied());
            let run = host_run::run(core, &slots, &records, TermKinds::NONE)
                .expect("parameters in range");
            run.telemetry
        };
        let whole = host(&samples);
        for axis in 0..3 {
            for bit in 0..i32::BITS {
                let mut flipped = samples.clone();
                flipped[AT].accelerometer_codes[axis] ^= 1 << bit;
                let telemetry = host(&flipped);
                assert_eq!(first_that_differs(&whole, &telemetry), Some(due));
                // The emulator plays the weakest bit and the sign.
                if bit == 0 || bit == i32::BITS - 1 {
                    let records = records_of(flipped);
                    let emulation = emulator::run(&image.path, &slots, &records, &mut |_| {})
                        .expect("the image runs");
                    assert_eq!(first_that_differs(&telemetry, &emulation.telemetry), None);
                    assert_eq!(first_that_differs(&whole, &emulation.telemetry), Some(due));
                }
            }
        }
    }
}

/// Returns the number of the first frame in which two streams differ.
fn first_that_differs(one: &[u8], other: &[u8]) -> Option<usize> {
    let (mut left, mut right) = (one.chunks(TELEMETRY_BYTES), other.chunks(TELEMETRY_BYTES));
    (0..)
        .map_while(|frame| match (left.next(), right.next()) {
            (None, None) => None,
            (one, other) => Some((frame, one != other)),
        })
        .find_map(|(frame, differs)| differs.then_some(frame))
}

#[test]
#[ignore = "needs qemu-system-arm; cargo verify runs it"]
fn accelerometers_come_through_lost_samples_as_on_the_host() {
    for core in [TargetCore::F32, TargetCore::Fixed] {
        let mut records = records_of(noisy_samples_with_forces(4_000, 20, 50_000, 2_000));
        for at in [700, 1_500, 1_501, 1_502] {
            records[at].bus_error = true;
        }
        records[900].frame[30] ^= 0x40;
        records[1_100] = records[1_099];
        // More than a whole output period.
        for record in &mut records[2_000..2_050] {
            record.bus_error = true;
        }
        // Two missed and one late.
        records[3_000].hold = 104;
        let slots = SlotImages::both(&parameters_with_accelerometers(PULSE_M_S));
        let result = play(core, &slots, &records);
        assert!(result.bit_equal, "{:?}", result.first_difference);
        assert_eq!((result.missed, result.late), (2, 1));
        assert_eq!(result.health[&BUS_FAULTS], 54);
        assert!(result.accelerometers && result.frames_with_velocity > 0);
    }
}

#[test]
#[ignore = "needs qemu-system-arm; cargo verify runs it"]
fn instruction_counts_repeat_exactly() {
    let samples = noisy_samples(4_000, 220, 2_000_000);
    let mut runs = [(); 2].map(|()| run(TargetCore::F32, &samples));
    // One interrupt of 4000 takes eight instructions more in a quarter of the runs: the wake-up of the processor in the
    // emulator depends on its other threads. The shortest and the longest do not.
    let interrupts = runs.each_mut().map(|run| {
        let whole = run.instructions_per_interrupt.take();
        whole.map(|whole| (whole.min, whole.max))
    });
    assert!(interrupts[0].is_some() && interrupts[0] == interrupts[1]);
    assert_eq!(runs[0], runs[1]);
}

#[test]
#[ignore = "needs qemu-system-arm; cargo verify runs it"]
fn a_wrong_output_of_the_image_is_seen() {
    // The f32 image compared with the fixed-point host: the two round differently, so a comparison that finds no different
    // frame cannot find any.
    let samples = noisy_samples(4_000, 220, 2_000_000);
    let result = on_target::compare(
        &image(TargetCore::F32),
        TargetCore::Fixed,
        &parameters(),
        samples,
        &mut |_| {},
    )
    .expect("the image runs");
    assert!(!result.bit_equal);
    assert!(result.first_difference.is_some());
}

#[test]
#[ignore = "needs qemu-system-arm; cargo verify runs it"]
fn events_arrive_with_their_words() {
    let quiet = run(TargetCore::F32, &noisy_samples(2_000, 20, 50_000));
    assert!(
        quiet.events[0].contains("boot: core f32"),
        "{:?}",
        quiet.events
    );
    let last = quiet.events.last().expect("an event at the end");
    assert!(last.contains("end of stream: 2000 periods"), "{last}");
    assert!(
        !quiet
            .events
            .iter()
            .any(|event| event.contains("first fault")),
        "{:?}",
        quiet.events
    );

    let saturating = run(TargetCore::F32, &noisy_samples(2_000, i32::MAX, i32::MAX));
    assert!(
        saturating
            .events
            .iter()
            .any(|event| event.contains("first fault")),
        "{:?}",
        saturating.events
    );
}

/// True if an event of the image contains `words`.
fn logged(result: &OnTarget, words: &str) -> bool {
    result.events.iter().any(|event| event.contains(words))
}

/// Counters of status bits among the health items.
const VELOCITY_HELD: u8 = 9;
const REPEATED: u8 = 18;
const CHECKSUMS: u8 = 20;
const BUS_FAULTS: u8 = 21;

#[test]
#[ignore = "needs qemu-system-arm; cargo verify runs it"]
fn a_damaged_slot_leaves_the_other_in_force_and_two_leave_nominal_values() {
    let records = records_of(noisy_samples(2_000, 20, 50_000));
    let whole = SlotImages::both(&parameters());
    let mut one_damaged = whole.clone();
    one_damaged.0[0][20] ^= 1;
    let result = play(TargetCore::Fixed, &one_damaged, &records);
    assert!(result.bit_equal, "{:?}", result.first_difference);
    assert!(logged(
        &result,
        "parameter generation 1, default values false"
    ));
    // The emulator's flash cannot be written; the board's behaviour is tested on the host.
    assert!(logged(&result, "cannot be mended"), "{:?}", result.events);

    let result = play(TargetCore::Fixed, &SlotImages::erased(), &records);
    assert!(result.bit_equal, "{:?}", result.first_difference);
    assert!(
        logged(&result, "default values true"),
        "{:?}",
        result.events
    );
}

#[test]
#[ignore = "needs qemu-system-arm; cargo verify runs it"]
fn late_missed_and_overrun_are_counted_as_they_were_asked_for() {
    let mut records = records_of(noisy_samples(4_000, 20, 50_000));
    // 1/4 of a period beyond its end: the next is late. 2 periods and a bit: one is missed, none late.
    // 3 1/4: two missed and one late.
    for (at, hold, missed) in [(500, 40, 0), (1_000, 65, 1), (1_500, 104, 2)] {
        records[at].hold = hold;
        // The bank latches on: these are not read.
        records.drain(at + 1..at + 1 + missed);
    }
    // The link is held for 20 output periods: the queue holds 15 frames.
    let held = 20 * usize::from(parameters().samples_per_output);
    for record in &mut records[2_000..2_000 + held] {
        record.link_held = true;
    }
    let result = play(TargetCore::F32, &SlotImages::both(&parameters()), &records);
    assert!(result.bit_equal, "{:?}", result.first_difference);
    assert_eq!((result.missed, result.late), (3, 2));
    assert_eq!(result.outputs_lost, 5);
    assert!(logged(&result, "first fault"), "{:?}", result.events);
}

#[test]
#[ignore = "needs qemu-system-arm; cargo verify runs it"]
fn the_bus_drivers_faults_are_counted_in_the_image_as_on_the_host() {
    let mut records = records_of(noisy_samples(4_000, 20, 50_000));
    records[700].bus_error = true;
    records[900].frame[5] ^= 0x40;
    records[1_100] = records[1_099];
    let result = play(
        TargetCore::Fixed,
        &SlotImages::both(&parameters()),
        &records,
    );
    assert!(result.bit_equal, "{:?}", result.first_difference);
    for item in [BUS_FAULTS, CHECKSUMS, REPEATED] {
        assert_eq!(result.health[&item], 1, "item {item}: {:?}", result.health);
    }
}

#[test]
#[ignore = "needs qemu-system-arm; cargo verify runs it"]
fn the_boards_image_sends_its_flags_without_crystal_bank_and_parameters() {
    for core in [TargetCore::F32, TargetCore::Fixed] {
        let image = Image::build(Platform::Board, core).expect("the image builds");
        let sent = emulator::first_telemetry(&image.path, &SlotImages::erased(), 100)
            .expect("the image sends");
        let mut decoder = Decoder::new();
        let frames: Vec<_> = sent.iter().filter_map(|byte| decoder.push(*byte)).collect();
        assert!(frames.len() >= 100, "{} frames", frames.len());
        assert_eq!(decoder.statistics().bytes_skipped, 0);
        assert_eq!(decoder.statistics().frames_lost, 0);
        // The emulator has neither a crystal nor a device on SPI1, whose line then reads zeros.
        let flags = Status::CLOCK_FALLBACK
            .union(Status::PARAMETERS_DEFAULT)
            .union(Status::BUS_FAULT);
        for frame in &frames {
            assert!(frame.output.status.contains(flags), "{frame:?}");
            assert_eq!(frame.output.dtheta_codes, [0; 3]);
        }
        // At 16 MHz a period has 4 000 ticks, in the emulator as many instructions: none may be missed.
        let late = Status::INTERRUPT_LATE.bits() | Status::INTERRUPT_MISSED.bits();
        assert!(
            frames
                .iter()
                .all(|frame| frame.output.status.bits() & late == 0),
            "the interrupt does not fit its period"
        );
    }
}

#[test]
#[ignore = "needs qemu-system-arm; cargo verify runs it"]
fn the_boards_image_takes_its_parameters_from_the_slots() {
    let image = Image::build(Platform::Board, TargetCore::F32).expect("the image builds");
    // Every health item has been sent by then.
    let frames = HEALTH_ITEMS.len() as u64 + 1;
    let sent = emulator::first_telemetry(&image.path, &SlotImages::both(&parameters()), frames)
        .expect("the image sends");
    let mut decoder = Decoder::new();
    let frames: Vec<_> = sent.iter().filter_map(|byte| decoder.push(*byte)).collect();
    let shown = |index| {
        let frame = frames.iter().find(|frame| frame.health.index == index);
        frame.map(|frame| frame.health.value)
    };
    assert_eq!(shown(item::GENERATION), Some(1));
    assert!(
        frames
            .iter()
            .all(|frame| !frame.output.status.contains(Status::PARAMETERS_DEFAULT))
    );
}

#[test]
fn each_chain_has_budgets_of_its_own_and_each_budget_a_reason() {
    let budgets = Budgets::of_workspace().expect("the budgets");
    for core in [TargetCore::F32, TargetCore::Fixed] {
        let mean = |accelerometers| &budgets.chain(core, accelerometers).instructions_mean;
        // The budget of the gyros alone is too small for both.
        let found = mean(false).at_most + 1.0;
        assert!(mean(false).exceeded_by("mean", found).is_some());
        assert!(mean(true).exceeded_by("mean", found).is_none());
        assert!(mean(true).exceeded_by("mean", f64::NAN).is_some());
    }

    let workspace = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../firmware-budgets.toml");
    let text = fs::read_to_string(workspace).expect("the budgets' file");
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("budgets.toml");
    let table = "[with_accelerometers.fixed.instructions_mean]\nat_most = ";
    assert!(text.contains(table));
    fs::write(&path, text.replace(table, &format!("{table}-"))).expect("a file");
    let error = Budgets::read(&path).expect_err("a budget below nothing");
    assert!(
        error
            .to_string()
            .contains("with_accelerometers.fixed.instructions_mean"),
        "{error}"
    );
}

#[test]
fn a_file_that_is_no_image_is_refused_by_name() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("firmware");
    fs::write(&path, b"not an ELF file").expect("a file in it");
    let error = Image::read(&path).expect_err("text is no image");
    assert_eq!(error.file, path);
    assert!(
        error.to_string().contains("thumbv7em-none-eabihf"),
        "{error}"
    );

    let error = Image::read(Path::new("no/such/image")).expect_err("nothing is no image");
    assert!(error.to_string().contains("cannot be read"), "{error}");
}

#[test]
fn this_programs_own_binary_is_no_image() {
    let own = std::env::current_exe().expect("a running program has a file");
    assert!(Image::read(&own).is_err());
}

/// Writes a quarter of a second of three dithered gyros at rest, as a folder in the documented form; x and y level, z up if
/// there are accelerometers.
fn recording_at_rest(folder: &Path, accelerometers: bool) {
    const RATE_HZ: f64 = 4000.0;
    const PULSE_RAD: f64 = 2e-6;
    /// 150 arcsec, and three frequencies typical of block dithers.
    const DITHER: [(f64, f64); 3] = [(7.3e-4, 397.0), (7.1e-4, 421.0), (7.4e-4, 443.0)];
    let mut manifest =
        String::from("format = 1\nname = \"rest\"\n[[table]]\nfile = \"samples.csv\"\n");
    manifest += &format!("rate_hz = {RATE_HZ:?}\nstart_s = 0.0\n");
    let mut quantities = vec![("gyro_count", "g"), ("dither_angle", "d")];
    if accelerometers {
        quantities.push(("specific_force", "a"));
    }
    for (quantity, prefix) in &quantities {
        for axis in ["x", "y", "z"] {
            manifest += &format!(
                "[[table.channel]]\ncolumn = \"{prefix}{axis}\"\nquantity = \"{quantity}\"\n\
                 axis = \"{axis}\"\nscale = 1.0\noffset = 0.0\n"
            );
        }
    }
    let angle = |axis: usize, row: f64| {
        let (amplitude_rad, frequency_hz) = DITHER[axis];
        amplitude_rad * (std::f64::consts::TAU * frequency_hz * row / RATE_HZ).sin()
    };
    let header: Vec<String> = quantities
        .iter()
        .flat_map(|(_, prefix)| ["x", "y", "z"].map(|axis| format!("{prefix}{axis}")))
        .collect();
    let mut table = header.join(",") + "\n";
    for row in 0..1000 {
        let (before, after) = (f64::from(row), f64::from(row + 1));
        let mut cells: Vec<String> = (0..3)
            .map(|axis| {
                let pulses = |row| (angle(axis, row) / PULSE_RAD).floor();
                (pulses(after) - pulses(before)).to_string()
            })
            .chain((0..3).map(|axis| format!("{:e}", angle(axis, after))))
            .collect();
        if accelerometers {
            cells.extend(["0.0", "0.0", "9.8"].map(str::to_owned));
        }
        table += &(cells.join(",") + "\n");
    }
    let model = "format = 1\n[motion]\nsource = \"static\"\nearth_rate = false\n[gyro]\n\
                 pulse_weight_rad = [2e-6, 2e-6, 2e-6]\nbias_rad_s = [0.0, 0.0, 0.0]\n\
                 scale_error = [0.0, 0.0, 0.0]\n[dither]\npickoff_gain = [1.0, 1.0, 1.0]\n\
                 pickoff_noise_rad = [2e-7, 2e-7, 2e-7]\n";
    for (name, text) in [
        ("recording.toml", manifest.as_str()),
        ("samples.csv", &table),
        ("model.toml", model),
    ] {
        fs::write(folder.join(name), text).expect("a file of the recording");
    }
}

/// Prepares `rlg on-target` for the recording in `folder`.
fn on_target_command(folder: &Path) -> assert_cmd::Command {
    let mut command = assert_cmd::Command::cargo_bin("rlg").expect("the tool is built");
    command
        .args(["on-target", "--core", "f32", "--json", "--model"])
        .arg(folder.join("model.toml"))
        .arg("--out")
        .arg(folder.join("out"))
        .arg(folder);
    command
}

#[test]
#[ignore = "needs qemu-system-arm; cargo verify runs it"]
fn the_command_writes_what_the_contract_names() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    recording_at_rest(folder.path(), false);
    let printed = on_target_command(folder.path()).assert().success();
    let written = fs::read(folder.path().join("out/on_target.json")).expect("on_target.json");
    assert_eq!(printed.get_output().stdout, written);
    let result: serde_json::Value = serde_json::from_slice(&written).expect("JSON");
    assert_eq!(result["core"], "f32");
    assert_eq!(result["samples"], 1000);
    assert_eq!(result["bit_equal"], true);
    for pointer in [
        "/instructions_per_sample/min",
        "/instructions_per_sample/mean",
        "/instructions_per_sample/max",
        "/flash_bytes",
        "/ram_bytes",
        "/stack_bytes",
        "/stack_painted_bytes",
    ] {
        let figure = result.pointer(pointer).and_then(serde_json::Value::as_f64);
        assert!(figure.is_some_and(|figure| figure > 0.0), "{pointer}");
    }
    let bytes = |pointer: &str| result.pointer(pointer).and_then(serde_json::Value::as_u64);
    assert!(
        bytes("/stack_painted_bytes") <= bytes("/stack_bytes"),
        "a run went deeper than the computed worst case"
    );
    assert!(bytes("/stack_bytes") < bytes("/stack_available_bytes"));
    assert!(
        result["emulator"]
            .as_str()
            .is_some_and(|emulator| emulator.contains("QEMU"))
    );
}

#[test]
#[ignore = "needs qemu-system-arm; cargo verify runs it"]
fn the_command_says_whether_accelerometers_were_played() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    recording_at_rest(folder.path(), true);
    for (asked, sentence) in [
        (true, "accelerometers played: velocity in 100 of 100 frames"),
        (false, "accelerometers not played"),
    ] {
        let mut command = on_target_command(folder.path());
        if asked {
            command.arg("--accelerometers");
        }
        let ended = command.assert().success();
        let output = ended.get_output();
        let words = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(words.contains(sentence), "{words}");
        let result: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
        assert_eq!(result["accelerometers"], asked);
        let frames = if asked { 100 } else { 0 };
        assert_eq!(result["frames_with_velocity"], frames);
        assert_eq!(result["bit_equal"], true);
    }
}

#[test]
fn accelerometers_that_are_not_there_end_the_command_with_code_2() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    recording_at_rest(folder.path(), false);
    let ended = on_target_command(folder.path())
        .arg("--accelerometers")
        .assert()
        .code(2);
    let words = String::from_utf8_lossy(&ended.get_output().stderr).into_owned();
    assert!(words.contains("has no accelerometers to play"), "{words}");
    assert!(!folder.path().join("out").exists());
}

#[test]
#[ignore = "needs the image's target; cargo verify runs it"]
fn a_missing_emulator_is_answered_with_the_command_that_installs_it() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    recording_at_rest(folder.path(), false);
    let image = image(TargetCore::F32);
    let ended = on_target_command(folder.path())
        .arg("--image")
        .arg(&image.path)
        .env("PATH", folder.path())
        .assert()
        .code(2);
    let words = String::from_utf8_lossy(&ended.get_output().stderr).into_owned();
    assert!(words.contains("apt-get install qemu-system-arm"), "{words}");
    assert!(!folder.path().join("out").exists());
}

#[test]
fn an_image_that_is_none_ends_the_command_with_code_2() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    recording_at_rest(folder.path(), false);
    let ended = on_target_command(folder.path())
        .arg("--image")
        .arg(folder.path().join("samples.csv"))
        .assert()
        .code(2);
    let words = String::from_utf8_lossy(&ended.get_output().stderr).into_owned();
    assert!(words.contains("is not a firmware image"), "{words}");
    assert!(!folder.path().join("out").exists());
}
