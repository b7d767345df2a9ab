//! Starts and runs the reference board: STM32F405, counter bank on SPI1, telemetry on USART1, events by RTT.
//!
//! The pins are tabulated in docs/board.md. The main loop sends telemetry frames and, with the feature `raw`, the raw stream on USART6, logs events for a probe and feeds the
//! watchdog; it sleeps while there is nothing to send.

#[cfg(feature = "slotted")]
mod images;

mod float_test;

mod low_speed;

mod ram_test;

mod self_test;

mod spi_bus;

#[cfg(feature = "raw")]
mod raw_port;

mod watchdog;

use core::sync::atomic::Ordering;

use cortex_m::peripheral::SCB;
use cortex_m_rt::entry;
use defmt_rtt as _;
use heapless::spsc::Queue;
use stm32f4::stm32f405::{PWR, Peripherals, RCC, TIM5};
use trueaxis::bank_bus::CounterBank;
use trueaxis::board_state::BoardState;
use trueaxis::clock_start::Clocks;
use trueaxis::counter_bank::AccelerometerInput;
use trueaxis::parameter_slots::Loaded;
use trueaxis::{BootReport, TelemetryFrame};
#[cfg(feature = "slotted")]
use trueaxis::{service::images::is_about_images, service_frame::Request};

#[cfg(feature = "slotted")]
use self::images::Images;
use self::self_test::BuiltInTest;
use self::watchdog::Watchdog;
use super::background::Background;
use super::boot::{self, boot};
use super::clock;
use super::enable;
use super::failure::{self, FailureKind};
use super::flash::{SECTOR_BYTES, SlotFlash};
use super::link::Link;
use super::sample_timer::SampleTimer;
use super::sampling::{FRAME_QUEUE, SAMPLING, Sampling, WATCH};
use super::serial::Serial;
#[cfg(feature = "slotted")]
use super::service_mode::ImageService;
use super::service_mode::{self, Details, IdleTimer};
#[cfg(feature = "terms")]
use super::slow_link::{SlowLink, UpdateQueue};
use super::supply;
#[cfg(feature = "raw")]
use super::{
    raw_link::{BATCH_BYTES, RawLink},
    raw_tap::RawQueue,
};

#[cfg(feature = "raw")]
pub use self::raw_port::RawPort;
pub use self::spi_bus::SpiBus as Spi;

/// The kind of accelerometer words that this board's bank sends.
const ACCELEROMETERS: AccelerometerInput = AccelerometerInput::Counters;

defmt::timestamp!("period {=u32}", WATCH.served.load(Ordering::Relaxed));

#[entry]
fn main() -> ! {
    // `entry` makes this a reference that lives for ever, and runs once.
    static mut FRAMES: Queue<TelemetryFrame, FRAME_QUEUE> = Queue::new();
    #[cfg(feature = "terms")]
    static mut UPDATES: UpdateQueue = Queue::new();
    #[cfg(feature = "raw")]
    static mut RAW_PERIODS: RawQueue = Queue::new();
    #[cfg(feature = "raw")]
    static mut RAW_BATCH: [u8; BATCH_BYTES] = [0; BATCH_BYTES];

    let Some(peripherals) = Peripherals::take() else {
        panic!("the peripherals were taken before main");
    };
    let rcc = peripherals.RCC;
    // Without it a sleeping core is deaf to the probe, and RTT with it (RM0090 38.16.1).
    let debug = peripherals.DBGMCU;
    debug.cr().modify(|_, w| w.dbg_sleep().set_bit());
    let failure = failure::take_report();
    let crystal_was_lost = matches!(failure, Some((FailureKind::ClockLost, _)));
    let (flash, pwr) = (&peripherals.FLASH, &peripherals.PWR);
    let clocks = clock::start(&rcc, flash, pwr, crystal_was_lost);
    let report = report_so_far(&rcc, &clocks, failure);
    let (clocks, mut state) = measured(&rcc, &peripherals.TIM5, clocks);
    state.brown_out_low = !supply::brown_out_suffices(flash);
    state.caches_off = !clock::caches_are_on(flash, clocks.wait_states);
    tell(&state);
    let mut built_in_test = BuiltInTest::start(clocks.core_hz);
    let mut serial = Serial::new(peripherals.USART1, &peripherals.GPIOA, &rcc, clocks.apb2_hz);
    let flash = SlotFlash::new(peripherals.FLASH);
    #[cfg(feature = "slotted")]
    let images = Images::find();
    #[cfg(feature = "slotted")]
    let report = report.with(|report| {
        report.image = images.state().to_word();
        report.revision = images::revision();
    });
    if service_mode::take_request() {
        stopped(
            flash,
            &peripherals.PWR,
            &mut serial,
            clocks.core_hz,
            Details {
                state: state.to_word(),
                self_test: built_in_test.results().to_word(),
            },
            #[cfg(feature = "slotted")]
            images,
        );
    }

    let mut loaded = Loaded::none();
    let report_of_boot = boot(
        &mut loaded,
        flash,
        supply::suffices(&peripherals.PWR),
        report,
    );

    let (frames, queued) = FRAMES.split();
    SampleTimer::show_latch(&peripherals.GPIOA);
    #[cfg(feature = "raw")]
    let (raw_tap, mut raw_link) = {
        let (usart, gpioc) = (&peripherals.USART6, &peripherals.GPIOC);
        let (dma, apb2_hz) = (peripherals.DMA2, clocks.apb2_hz);
        let port = RawPort::new(usart, dma, gpioc, &rcc, apb2_hz, RAW_BATCH);
        RawLink::new(RAW_PERIODS, &loaded, port)
    };
    let bus = Spi::new(peripherals.SPI1, peripherals.GPIOA, &rcc, clocks.apb2_hz);
    let bank = CounterBank::new(bus, ACCELEROMETERS);
    let mut link = Link::new(queued, serial, loaded.parameters.output);
    let mut background = Background::new(&loaded.parameters);
    let mut watchdog = Watchdog::start(peripherals.IWDG, &debug);

    let checked = boot::checked(&loaded);
    #[cfg(feature = "terms")]
    let (updates, mut slow_link) = SlowLink::new(UPDATES, &checked, &loaded.parameters);
    SAMPLING.lend(|| {
        // First: it takes more than a period to make.
        let processor = boot::processor(&loaded, &checked, report_of_boot);
        let timer = SampleTimer::new(
            peripherals.TIM2,
            peripherals.TIM5,
            &rcc,
            clocks.timer_hz,
            loaded.parameters.sample_rate_hz,
        );
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
    state.enable_unconfirmed = enable::has_failed();
    link.tell(state.to_word());
    #[cfg(feature = "slotted")]
    let mut confirmation = {
        link.set_image(images.state());
        images.confirmation(&loaded, clocks.timer_hz)
    };
    if state.enable_unconfirmed {
        defmt::error!("a peripheral's clock enable did not read back");
    }
    loop {
        let served = background.poll();
        watchdog.feed(served);
        let is_testing = built_in_test.poll(served);
        link.set_self_test(built_in_test.results());
        #[cfg(feature = "slotted")]
        if let Some(image) =
            confirmation.poll(served, !built_in_test.results().has_failed(), || {
                supply::suffices(&peripherals.PWR)
            })
        {
            link.set_image(image);
        }
        #[cfg(feature = "terms")]
        slow_link.poll(served);
        #[cfg(feature = "raw")]
        raw_link.poll();
        if link.serve() {
            link.stop();
            service_mode::request();
            // The watchdog, once started, runs until a reset.
            SCB::sys_reset();
        }
        if !link.poll() && !is_testing {
            // A frame that is queued between the look and the sleep waits for the next interrupt, 250 µs.
            cortex_m::asm::wfi();
        }
    }
}

/// Logs how this boot came about and the end of the run before; clears the reset's cause.
fn report_so_far(rcc: &RCC, clocks: &Clocks, failure: Option<(FailureKind, u32)>) -> BootReport {
    let reset = rcc.csr().read();
    defmt::info!(
        "clock {}, reset by watchdog {=bool}, by software {=bool}",
        *clocks,
        reset.wdgrstf().bit(),
        reset.sftrstf().bit()
    );
    rcc.csr().modify(|_, w| w.rmvf().clear());
    let mut report = BootReport::default().with(|report| {
        report.clock_fallback = clocks.is_fallback();
        // BORRSTF to LPWRRSTF, bits 25 to 31, in the order of `health::reset_cause`.
        report.reset_cause = reset.bits() >> 25;
        report.revision = trueaxis::REVISION;
    });
    if let Some((kind, place)) = failure {
        defmt::error!("the previous run ended in {} at {=u32:#x}", kind, place);
        report.last_failure_kind = kind as u32;
        report.last_failure_place = place;
    }
    report
}

/// Measures the low-speed oscillator. On the crystal, keeps it as the reference; without, corrects the clocks by it.
#[inline(never)]
fn measured(rcc: &RCC, time: &TIM5, clocks: Clocks) -> (Clocks, BoardState) {
    let low_speed_hz = low_speed::measure(rcc, time, clocks.timer_hz);
    if !clocks.is_fallback() {
        low_speed::keep(low_speed_hz);
    }
    let reference_hz = low_speed::kept();
    let state = BoardState {
        low_speed_hz,
        reference_hz,
        clock_fallback: clocks.is_fallback(),
        ..BoardState::default()
    };
    (clocks.corrected(reference_hz, low_speed_hz), state)
}

/// Logs clock and supply, as a `state` request is answered.
#[inline(never)]
fn tell(state: &BoardState) {
    defmt::info!("board {}", *state);
    if state.brown_out_low {
        defmt::warn!("the brown-out level is below 3: see docs/board.md, flash and log");
    }
    if state.caches_off {
        defmt::warn!("the flash's caches or wait states are not as set");
    }
}

/// Serves requests, as the run before this one was asked to stop, and starts anew.
#[inline(never)]
fn stopped(
    flash: SlotFlash,
    pwr: &PWR,
    serial: &mut Serial,
    core_hz: u32,
    details: Details,
    #[cfg(feature = "slotted")] images: Images,
) -> ! {
    if let Some(core) = cortex_m::Peripherals::take() {
        defmt::info!("stopped: waiting for requests");
        let slots = [0, SECTOR_BYTES];
        let idle = IdleTimer::new(core.SYST, core_hz);
        let supply_suffices = || supply::suffices(pwr);
        #[cfg(feature = "slotted")]
        let about_images = {
            let mut upload = images.upload();
            move |service: &ImageService<SlotFlash>, request: &Request| {
                let is_one = is_about_images(request);
                is_one.then(|| service.answer_about_images(&mut upload, request, supply_suffices))
            }
        };
        #[cfg(not(feature = "slotted"))]
        let about_images = |_: &_, _: &_| None;
        let (_, wants_test) = service_mode::serve(
            flash,
            slots,
            supply_suffices,
            serial,
            idle,
            details,
            about_images,
        );
        if wants_test {
            ram_test::request();
            service_mode::request();
        }
    }
    SCB::sys_reset()
}
