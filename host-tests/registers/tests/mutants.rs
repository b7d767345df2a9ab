//! Mutants of the drivers under `src/hardware` and of the clock's start: each changes one place, and the register models must
//! refuse the image that results, or its behaviour must differ. A mutant costs a build of the image.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use rlg_registers::board::Behaviour;
use rlg_registers::host::{Telemetry, ask, block, upload};
use rlg_registers::image::Image;
use rlg_registers::machine::{Ending, Machine};
use rlg_registers::ticks;
use trueaxis::Status;
use trueaxis::board_state::BoardState;
use trueaxis::health::item;
use trueaxis::service_frame::{Request, RequestKind};

/// Name, file, and the text that another takes the place of.
struct Mutant(&'static str, &'static str, &'static str, &'static str);

const SPI: &str = "src/hardware/board/spi_bus.rs";
const SERIAL: &str = "src/hardware/serial.rs";
const CLOCK: &str = "src/hardware/clock.rs";
const START: &str = "src/unit/clock_start.rs";
const FLASH: &str = "src/hardware/flash.rs";
const TIMER: &str = "src/hardware/sample_timer.rs";
const SUPPLY: &str = "src/hardware/supply.rs";
const WATCHDOG: &str = "src/hardware/board/watchdog.rs";
const LOW_SPEED: &str = "src/hardware/board/low_speed.rs";

const MUTANTS: [Mutant; 30] = [
    Mutant(
        "regulator scale 2",
        CLOCK,
        "w.vos().scale1()",
        "w.vos().scale2()",
    ),
    Mutant(
        "receive pin has another function",
        SERIAL,
        ".afrh10().af7()",
        ".afrh10().af8()",
    ),
    Mutant(
        "receive pin is not pulled up",
        SERIAL,
        "w.pupdr10().pull_up()",
        "w.pupdr10().pull_down()",
    ),
    Mutant(
        "slow pad of the clock",
        SPI,
        ".ospeedr5().high_speed()",
        ".ospeedr5().low_speed()",
    ),
    Mutant(
        "slow pad of the output",
        SPI,
        "w.ospeedr7().high_speed()",
        "w.ospeedr7().low_speed()",
    ),
    Mutant(
        "select rises while the bus is busy",
        SPI,
        ".and_then(|()| self.wait_until_idle())",
        "",
    ),
    Mutant("no instruction cache", CLOCK, ".icen().enabled()", ""),
    Mutant("no data cache", CLOCK, ".dcen().enabled()", ""),
    Mutant("no prefetch", CLOCK, "w.prften().enabled()", "w"),
    Mutant(
        "port's clock not confirmed",
        SERIAL,
        "enable::confirm(|| rcc.ahb1enr().read().gpioaen().is_enabled());",
        "",
    ),
    Mutant(
        "power controller's clock not confirmed",
        CLOCK,
        "enable::confirm(|| rcc.apb1enr().read().pwren().is_enabled());",
        "",
    ),
    Mutant(
        "crystal waited for too shortly",
        START,
        "CRYSTAL_POLLS: u32 = 1_700",
        "CRYSTAL_POLLS: u32 = 1_300",
    ),
    Mutant(
        "PLL too fast on the internal oscillator",
        START,
        "INTERNAL_MULTIPLIER: u16 = 144",
        "INTERNAL_MULTIPLIER: u16 = 168",
    ),
    Mutant(
        "PLL's input too slow",
        START,
        "const INTERNAL_DIVIDER: u8 = 8",
        "const INTERNAL_DIVIDER: u8 = 18",
    ),
    Mutant(
        "too few wait states",
        START,
        "(core_hz.saturating_sub(1) / HZ_PER_WAIT_STATE) as u8",
        "(core_hz.saturating_sub(1) / (HZ_PER_WAIT_STATE + 12_000_000)) as u8",
    ),
    Mutant(
        "APB1 too fast",
        START,
        "Self { apb1: 4, apb2: 2 }",
        "Self { apb1: 2, apb2: 2 }",
    ),
    Mutant(
        "crystal not watched",
        START,
        "registers.watch_crystal(true);",
        "",
    ),
    Mutant("SPI too fast", SPI, "w.br().div8()", "w.br().div4()"),
    Mutant(
        "SPI in another mode",
        SPI,
        "w.mstr().master().ssm()",
        "w.cpha().set_bit().mstr().master().ssm()",
    ),
    Mutant(
        "baud rate",
        SERIAL,
        "BAUD: u32 = 1_000_000",
        "BAUD: u32 = 921_600",
    ),
    Mutant(
        "line's driver on behind the first byte",
        SERIAL,
        "cortex_m::asm::delay(ENABLE_CYCLES);",
        "",
    ),
    Mutant(
        "line's driver off with an empty buffer",
        SERIAL,
        "self.is_driving && self.usart.sr().read().tc().bit()",
        "self.is_driving && self.usart.sr().read().txe().bit()",
    ),
    Mutant(
        "line's driver never off",
        SERIAL,
        "            self.drive(false);",
        "            self.is_driving = false;",
    ),
    Mutant(
        "line's driver on another pin",
        SERIAL,
        "ENABLE: u32 = 1 << 8",
        "ENABLE: u32 = 1 << 11",
    ),
    Mutant(
        "latch pulse without its pin",
        TIMER,
        "w.afrl0().af1()",
        "w.afrl0().af2()",
    ),
    Mutant(
        "flash programmed by bytes",
        FLASH,
        "w.pg().program().psize().psize32()",
        "w.pg().program().psize().psize8()",
    ),
    Mutant(
        "wrong sector",
        FLASH,
        "FIRST_SECTOR: u8 = 10",
        "FIRST_SECTOR: u8 = 9",
    ),
    Mutant("supply not looked at", SUPPLY, "is_on && is_high", "is_on"),
    Mutant(
        "watchdog's reload",
        WATCHDOG,
        "RELOAD: u16 = 512",
        "RELOAD: u16 = 2048",
    ),
    Mutant(
        "captures at every edge",
        LOW_SPEED,
        ".ic4psc().bits(0b11)",
        ".ic4psc().bits(0b00)",
    ),
];

/// Judges an image; a sentence for the first fault that is found.
fn judge(image: &Image) -> Result<(), String> {
    let late_crystal = |ms| {
        let mut behaviour = Behaviour::SOUND;
        behaviour.clocks.crystal_starts = Some(ticks::of_ms(ms));
        behaviour
    };
    let mut dead_crystal = Behaviour::SOUND;
    dead_crystal.clocks.crystal_starts = None;
    let mut fast = dead_crystal;
    fast.clocks.internal_period_per_mille = 957;
    let mut slow = dead_crystal;
    slow.clocks.internal_period_per_mille = 1087;
    let is_fallback =
        |machine: &mut Machine| Telemetry::take(machine).all_have(Status::CLOCK_FALLBACK);
    for (what, behaviour, fallback) in [
        ("sound", Behaviour::SOUND, false),
        ("crystal of 90 ms", late_crystal(90), false),
        ("fast oscillator", fast, true),
        ("slow oscillator", slow, true),
    ] {
        let mut machine = booted(image, behaviour, what)?;
        let board = machine.board();
        let [_, apb2_hz] = board.rcc.apb_hz(board.now);
        let baud = board.usarts[0].baud(apb2_hz);
        let period = board.timers[0].period_ticks();
        let allowed_ms = ticks::to_ms(board.watchdog.allowance());
        let latched = board.spi.bank.transfers.len();
        if !fallback && (baud != 1_000_000 || period != ticks::of_us(250)) {
            return Err(format!("{what}: {baud} baud, period {period} ticks"));
        }
        if !(330.0..=970.0).contains(&allowed_ms) || latched < 100 {
            return Err(format!(
                "{what}: watchdog {allowed_ms} ms, {latched} frames"
            ));
        }
        // Off behind each frame, within a turn of the main loop and the longest interrupt.
        let (turned_off, hold) = (board.line_driver.turned_off, board.line_driver.longest_hold);
        if turned_off < 15 || hold > ticks::of_us(150) {
            return Err(format!(
                "{what}: line's driver off {turned_off} times, at most {} us late",
                ticks::to_ms(hold) * 1e3
            ));
        }
        if board.rcc.watches_crystal() == fallback {
            return Err(format!("{what}: the crystal is watched {}", !fallback));
        }
        if is_fallback(&mut machine) != fallback {
            return Err(format!("{what}: fallback {}", !fallback));
        }
        let told = state(&mut machine)?;
        if told.brown_out_low || told.caches_off || told.enable_unconfirmed {
            return Err(format!("{what}: {told:?}"));
        }
        if !fallback && told.low_speed_hz.abs_diff(32_000) > 40 {
            return Err(format!("{what}: {told:?}"));
        }
    }
    let mut machine = booted(image, Behaviour::SOUND, "sound")?;
    let repeated = Telemetry::take(&mut machine).item(item::STUCK_LINES);
    if repeated > 0 {
        return Err(format!("{repeated} stuck lines"));
    }
    stores(&mut machine)
}

fn state(machine: &mut Machine) -> Result<BoardState, String> {
    let answer = ask(machine, &Request::new(9, RequestKind::State, 0), 1_000, 100);
    match answer {
        Ok(Some(answer)) => Ok(BoardState::from_word(answer.detail)),
        other => Err(format!("no answer: {other:?}")),
    }
}

/// Boots, samples for some 100 ms, and asks for nothing forbidden and sound frames of the bank.
fn booted(image: &Image, behaviour: Behaviour, what: &str) -> Result<Machine, String> {
    let mut machine = Machine::new(image, behaviour, [&[], &block(2, 2)]);
    // The other slot is mended first, in 2 s at most.
    let ending = machine.run_for(ticks::of_ms(2_350));
    if ending != Ending::Time {
        return Err(format!("{what}: {ending:?}"));
    }
    clean(&mut machine, what)?;
    let telemetry = Telemetry::of(&machine.board().usarts[0].sent);
    for index in [18, 19, 20, 21, item::STUCK_LINES] {
        let count = telemetry.health.get(&index).copied();
        if count != Some(0) {
            return Err(format!("{what}: health item {index} is {count:?}"));
        }
    }
    Ok(machine)
}

fn clean(machine: &mut Machine, what: &str) -> Result<(), String> {
    let wrong = machine.board().wrong.iter().next();
    wrong.map_or(Ok(()), |wrong| Err(format!("{what}: {wrong}")))
}

/// Stops a unit, refuses at 2.8 V, stores a block at 3.3 V.
fn stores(machine: &mut Machine) -> Result<(), String> {
    let _ = ask(machine, &Request::new(1, RequestKind::Stop, 0), 1_000, 100);
    let ending = machine.run_for(ticks::of_ms(5));
    if ending != Ending::Software {
        return Err(format!("stopped: {ending:?}"));
    }
    machine.follow(&ending);
    machine.run_for(ticks::of_ms(15));
    for (supply_mv, outcome) in [(2_800, 13), (3_300, 0)] {
        machine.board().power.supply_mv = supply_mv;
        let answer =
            upload(machine, &block(3, 3)).map_err(|ending| format!("upload: {ending:?}"))?;
        if answer.outcome != outcome {
            return Err(format!("outcome {} at {supply_mv} mV", answer.outcome));
        }
    }
    clean(machine, "upload")
}

/// Copies what the image is built from, without what is built.
fn copy(from: &Path, to: &Path) -> std::io::Result<()> {
    fs::create_dir_all(to)?;
    for entry in fs::read_dir(from)? {
        let entry = entry?;
        let name = entry.file_name();
        let target = to.join(&name);
        if entry.file_type()?.is_dir() {
            // One package of the workspace is called target.
            let is_built = name == "target" && !entry.path().join("Cargo.toml").exists();
            if !is_built && name != ".git" {
                copy(&entry.path(), &target)?;
            }
        } else if name != ".git" {
            fs::copy(entry.path(), target)?;
        }
    }
    Ok(())
}

/// Builds the image in a folder; `None` if it does not build.
fn build(folder: &Path) -> Option<Image> {
    let target = folder.join("target");
    let status = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()))
        .current_dir(folder)
        .args(["build", "--release", "--package", "trueaxis", "--quiet"])
        .args([
            "--target",
            "thumbv7em-none-eabihf",
            "--features",
            "board",
            "--bin",
            "firmware",
        ])
        .env("CARGO_INCREMENTAL", "1")
        .arg("--target-dir")
        .arg(&target)
        .status();
    let built: PathBuf = target.join("thumbv7em-none-eabihf/release/firmware");
    status
        .is_ok_and(|status| status.success())
        .then(|| Image::read("firmware", &built))
}

#[test]
#[ignore = "a build of the image for every mutant: some minutes"]
fn every_mutant_of_the_drivers_dies() {
    let package = Path::new(env!("CARGO_MANIFEST_DIR"));
    let workspace = package.ancestors().nth(2).expect("two folders above");
    let folder = workspace.join("target").join("registers-mutants");
    copy(workspace, &folder).expect("a copy of the workspace");
    let sound = build(&folder).expect("the image builds");
    judge(&sound).expect("the image without a mutant passes");
    let (mut dead, mut living) = (0, Vec::new());
    // RLG_MUTANTS=line: those alone whose name has it.
    let chosen = std::env::var("RLG_MUTANTS").unwrap_or_default();
    let mutants = MUTANTS.iter().filter(|mutant| mutant.0.contains(&chosen));
    for Mutant(name, file, from, to) in mutants {
        let path = folder.join(file);
        let source = fs::read_to_string(&path).expect("a source file");
        assert!(source.contains(from), "{name}: {file} has no `{from}`");
        fs::write(&path, source.replace(from, to)).expect("a copy is writable");
        // A unit that does not answer where it must ends the host's side.
        let verdict = build(&folder).map(|image| {
            let judged = std::panic::catch_unwind(|| judge(&image));
            judged.unwrap_or_else(|_| Err("the host's side ended".to_owned()))
        });
        fs::write(&path, source).expect("a copy is writable");
        match verdict {
            Some(Err(fault)) => {
                println!("dead: {name}: {fault}");
                dead += 1;
            }
            Some(Ok(())) => living.push(*name),
            None => panic!("{name} does not build, and is no mutant"),
        }
    }
    println!(
        "mutants of the drivers: {dead} of {} dead, living: {living:?}",
        dead + living.len()
    );
    assert!(living.is_empty(), "{living:?}");
}
