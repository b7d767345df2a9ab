//! Runs the image for QEMU (`-M netduinoplus2`, an STM32F405): the board's interrupt, with a bank from a file.
//!
//! It reads `frames.bin` ([`trueaxis::bank_record`]) by semihosting from the emulator's working folder, and the
//! parameter slots, which the emulator loads into flash. It writes telemetry frames to USART1, the raw stream (feature
//! `raw`) to USART6, and events and
//! `report.bin` ([`trueaxis::run_report`]) by semihosting.
//!
//! Virtual time stands still during a semihosting call, so reading ahead delays nothing. Under `-icount shift=0` one
//! instruction is one nanosecond of it, and the emulator's timers count at 1 GHz independent of the clock tree: so TIM5
//! counts instructions, exactly and repeatably, and a period of 250 µs has 250 000 (between interrupts 249 999: the
//! emulator's TIM2 leaves out the tick at 0). The loop sleeps between interrupts; a busy one would cost the emulator
//! all of them.

mod bank_file;

#[cfg(feature = "raw")]
mod raw_port;

mod slot_memory;

mod stack;

use core::sync::atomic::Ordering;

use cortex_m_rt::entry;
use defmt_semihosting as _;
use heapless::spsc::{Consumer, Producer, Queue};
use semihosting::fs::File;
use semihosting::io::{self, Write};
use stm32f4::stm32f405::{FLASH, Peripherals};
use trueaxis::bank_bus::CounterBank;
use trueaxis::bank_record::BankRecord;
use trueaxis::counter_bank::AccelerometerInput;
use trueaxis::parameter_slots::Loaded;
use trueaxis::run_report::{RunOutcome, RunReport};
use trueaxis::{BootReport, TelemetryFrame};

use self::bank_file::{BankFile, LINK_HELD, Records, read_ahead, ticks};
use self::slot_memory::{SLOT_BYTES, SlotBytes, SlotMemory};
use super::background::Background;
use super::boot::{self, boot};
use super::clock;
use super::flash::SlotFlash;
use super::link::Link;
use super::sample_timer::SampleTimer;
use super::sampling::{FRAME_QUEUE, SAMPLING, Sampling, WATCH};
use super::serial::Serial;
use super::service_mode::{self, IdleTimer};
#[cfg(feature = "terms")]
use super::slow_link::{SlowLink, UpdateQueue};
#[cfg(feature = "raw")]
use super::{raw_link::RawLink, raw_tap::RawQueue};

pub use self::bank_file::BankFile as Spi;
#[cfg(feature = "raw")]
pub use self::raw_port::RawPort;

/// The emulator's timer clock \[Hz\].
const TIMER_HZ: u32 = 1_000_000_000;

defmt::timestamp!("period {=u32}", WATCH.served.load(Ordering::Relaxed));

#[entry]
fn main() -> ! {
    // `entry` makes these references that live for ever, and runs once.
    static mut RECORDS: Records = Queue::new();
    static mut FRAMES: Queue<TelemetryFrame, FRAME_QUEUE> = Queue::new();

    #[cfg(feature = "terms")]
    static mut UPDATES: UpdateQueue = Queue::new();
    #[cfg(feature = "raw")]
    static mut RAW_PERIODS: RawQueue = Queue::new();

    let report = match run(
        RECORDS.split(),
        FRAMES.split(),
        #[cfg(feature = "terms")]
        UPDATES,
        #[cfg(feature = "raw")]
        RAW_PERIODS,
    ) {
        Ok(report) => {
            defmt::info!(
                "end of stream: {=u32} periods, {=u32} frames",
                report.periods,
                report.frames
            );
            report
        }
        Err(error) => {
            defmt::error!(
                "file of the run: error {=i32}",
                error.raw_os_error().unwrap_or(0)
            );
            RunReport::empty(RunOutcome::FileFault)
        }
    };
    let written = File::create(c"report.bin").and_then(|mut f| f.write_all(&report.to_bytes()));
    semihosting::process::exit(match (report.outcome, written) {
        (RunOutcome::Complete, Ok(())) => 0,
        _ => 1,
    })
}

/// Producer and consumer of a queue.
type Ends<T> = (Producer<'static, T>, Consumer<'static, T>);

/// Runs from reset to the last frame.
fn run(
    (mut records, record_queue): Ends<BankRecord>,
    (frames, queued): Ends<TelemetryFrame>,
    #[cfg(feature = "terms")] updates: &'static mut UpdateQueue,
    #[cfg(feature = "raw")] raw: &'static mut RawQueue,
) -> io::Result<RunReport> {
    let Some(peripherals) = Peripherals::take() else {
        panic!("the peripherals were taken before main");
    };
    let rcc = peripherals.RCC;
    let clocks = clock::start(&rcc, &peripherals.FLASH, &peripherals.PWR, false);
    // The emulator has no voltage detector; so mending runs until the flash does not take the write.
    let supply_suffices = true;
    let mut loaded = Loaded::none();
    let report_of_boot = boot(
        &mut loaded,
        SlotFlash::new(peripherals.FLASH),
        supply_suffices,
        // It resets for no reason and keeps no failure.
        BootReport::default().with(|report| {
            report.clock_fallback = clocks.is_fallback();
        }),
    );

    let mut input = File::open(c"frames.bin")?;
    let total = (input.metadata()?.len() / BankRecord::BYTES as u64) as u32;
    read_ahead(&mut input, &mut records)?;

    let serial = Serial::new(peripherals.USART1, &peripherals.GPIOA, &rcc, clocks.apb2_hz);
    let mut link = Link::new(queued, serial, loaded.parameters.output);
    #[cfg(feature = "raw")]
    let (raw_tap, mut raw_link) =
        RawLink::new(raw, &loaded, Some(RawPort::new(peripherals.USART6)));
    let mut background = Background::new(&loaded.parameters);
    let mut stop = false;
    let checked = boot::checked(&loaded);
    #[cfg(feature = "terms")]
    let (updates, mut slow_link) = SlowLink::new(updates, &checked, &loaded.parameters);
    if total > 0 {
        SAMPLING.lend(|| {
            // First: it takes more than a period of the board's slowest clock to make.
            let processor = boot::processor(&loaded, &checked, report_of_boot);
            let timer = SampleTimer::new(
                peripherals.TIM2,
                peripherals.TIM5,
                &rcc,
                TIMER_HZ,
                loaded.parameters.sample_rate_hz,
            );
            let bus = BankFile::new(record_queue, timer.period_ticks());
            let bank = CounterBank::new(bus, AccelerometerInput::Counters);
            Sampling::new(
                bank,
                processor,
                frames,
                timer.started(),
                #[cfg(feature = "terms")]
                updates,
                #[cfg(feature = "raw")]
                raw_tap,
            )
        });
    }
    while background.poll() < total && !stop {
        sleep_unless_served(background.seen());
        #[cfg(feature = "terms")]
        slow_link.poll(background.seen());
        read_ahead(&mut input, &mut records)?;
        if !LINK_HELD.load(Ordering::Relaxed) {
            link.poll();
            #[cfg(feature = "raw")]
            raw_link.poll();
        }
        stop = link.serve();
    }
    // The last record must not hold the interrupt beyond its period, or one more would slip in here.
    let mut report = stop_sampling();
    while link.poll() {}
    #[cfg(feature = "raw")]
    while raw_link.poll() {}

    report.frames = link.frames_sent();
    if stop {
        serve(link, clocks.core_hz)?;
    }
    Ok(report)
}

/// Sleeps until the interrupt has come, unless it has since the main loop saw `seen` of them.
#[inline]
fn sleep_unless_served(seen: u32) {
    // Test and sleep with interrupts held: one must not slip in between. A held one ends the sleep.
    cortex_m::interrupt::free(|_| {
        if WATCH.served.load(Ordering::Acquire) == seen {
            // The emulator books executed instructions when a timer is read. Those it has not booked when
            // the processor falls asleep can be added to the sleep, and the interrupt would seem late.
            core::hint::black_box(ticks());
            cortex_m::asm::wfi();
        }
    });
}

/// Serves requests as the board does after its reset, and writes the content of the slots to `slots.bin`.
#[inline(never)]
fn serve(link: Link, core_hz: u32) -> io::Result<()> {
    let mut serial = link.stop();
    let memory = cortex_m::singleton!(: SlotBytes = [0; 2 * SLOT_BYTES]);
    let (Some(core), Some(bytes)) = (cortex_m::Peripherals::take(), memory) else {
        panic!("the unit is stopped twice");
    };
    // SAFETY: the boot, which had the controller, is over, and reading needs no register of it.
    let mut flash = SlotFlash::new(unsafe { FLASH::steal() });
    let memory = SlotMemory::new(bytes, &mut flash);
    let idle = IdleTimer::new(core.SYST, core_hz);
    let (memory, _) = service_mode::serve(
        memory,
        [0, SLOT_BYTES as u32],
        || true,
        &mut serial,
        idle,
        service_mode::Details::default(),
        |_, _| None,
    );
    File::create(c"slots.bin")?.write_all(memory.bytes())
}

/// Masks the interrupt for good and reports its measurements. Not inlined: the value it takes back is large, and would
/// lie on the stack during all of the run.
#[inline(never)]
fn stop_sampling() -> RunReport {
    let mut report = RunReport::empty(RunOutcome::Complete);
    report.periods = WATCH.served.load(Ordering::Relaxed);
    report.stack_used_bytes = stack::used_bytes();
    report.stack_size_bytes = stack::size_bytes();
    if let Some(sampling) = SAMPLING.take_back() {
        report.between_outputs = sampling.costs.chain_between_outputs;
        report.with_output = sampling.costs.chain_with_output;
        report.beginning = sampling.costs.chain_beginning;
        report.processor = sampling.costs.processor;
        report.interrupt = sampling.costs.interrupt;
        report.reading_overhead = sampling.timer.reading_overhead();
        report.health = sampling.processor.health_items();
    }
    report
}
