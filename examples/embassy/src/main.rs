//! The chain under Embassy on an STM32F405: asynchronous tasks, the counter bank and telemetry by DMA.
//!
//! ```text
//! TIM2, each period ─▶ bank latches (PA0), PERIODS + 1, wakes `sampling`
//! sampling:  CounterBank::take_async ─▶ Processor ─▶ FRAMES
//! telemetry: FRAMES ─▶ USART1
//! ```
#![no_std]
#![no_main]

use core::sync::atomic::{AtomicU32, Ordering};

use embassy_executor::Spawner;
use embassy_stm32::gpio::{Level, Output, OutputType, Speed};
use embassy_stm32::interrupt::typelevel::{self, Interrupt};
use embassy_stm32::mode::Async;
use embassy_stm32::spi::mode::Master;
use embassy_stm32::spi::{self, Spi};
use embassy_stm32::time::Hertz;
use embassy_stm32::timer::low_level::CountingMode;
use embassy_stm32::timer::simple_pwm::{PwmPin, SimplePwm};
use embassy_stm32::usart::{self, UartTx};
use embassy_stm32::{bind_interrupts, dma, pac, peripherals};
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::channel::Channel;
use embassy_sync::signal::Signal;
use embedded_hal_bus::spi::{ExclusiveDevice, NoDelay};
use panic_halt as _;
use trueaxis::counter_bank::AccelerometerInput;
use trueaxis::{BootReport, CounterBank, F32, Parameters, Processor, TelemetryFrame, Timing};

/// Sampling periods a second.
const SAMPLE_RATE: Hertz = Hertz(4_000);

/// Fastest clock of the bank's bus: half the internal oscillator's 16 MHz.
const BANK_CLOCK: Hertz = Hertz(8_000_000);

/// Telemetry \[bits/s\].
const BAUD: u32 = 1_000_000;

/// Sampling periods since start, wrapping.
static PERIODS: AtomicU32 = AtomicU32::new(0);

/// Wakes the sampling task.
static PERIOD_ENDED: Signal<CriticalSectionRawMutex, ()> = Signal::new();

/// Frames queued for the serial port.
static FRAMES: Channel<CriticalSectionRawMutex, TelemetryFrame, 16> = Channel::new();

bind_interrupts!(struct Irqs {
    TIM2 => PeriodEnd;
    DMA2_STREAM0 => dma::InterruptHandler<peripherals::DMA2_CH0>;
    DMA2_STREAM3 => dma::InterruptHandler<peripherals::DMA2_CH3>;
    DMA2_STREAM7 => dma::InterruptHandler<peripherals::DMA2_CH7>;
});

/// Counts a period and wakes the sampling task.
struct PeriodEnd;

impl typelevel::Handler<typelevel::TIM2> for PeriodEnd {
    unsafe fn on_interrupt() {
        // The flags clear on writing 0.
        pac::TIM2.sr().write(|w| {
            w.0 = u32::MAX;
            w.set_uif(false);
        });
        PERIODS.fetch_add(1, Ordering::Relaxed);
        PERIOD_ENDED.signal(());
    }
}

/// The bank's bus, used by the bank alone.
type Bus = ExclusiveDevice<Spi<'static, Async, Master>, Output<'static>, NoDelay>;

#[embassy_executor::main]
async fn main(spawner: Spawner) {
    let p = embassy_stm32::init(Default::default());

    let mut config = spi::Config::default();
    config.frequency = BANK_CLOCK;
    // As the board's image has them; the default is the fastest.
    config.gpio_speed = Speed::High;
    let spi = Spi::new(
        p.SPI1, p.PA5, p.PA7, p.PA6, p.DMA2_CH3, p.DMA2_CH0, Irqs, config,
    );
    let select = Output::new(p.PA4, Level::High, Speed::High);
    let Ok(bus) = ExclusiveDevice::new_no_delay(spi, select);

    let mut config = usart::Config::default();
    config.baudrate = BAUD;
    let Ok(serial) = UartTx::new(p.USART1, p.PA9, p.DMA2_CH7, Irqs, config) else {
        panic!("USART1 cannot have this rate");
    };

    // High at the beginning of each period, for a sixteenth of it: the bank latches then.
    let latch = PwmPin::new(p.PA0, OutputType::PushPull);
    let mut timer = SimplePwm::new(
        p.TIM2,
        Some(latch),
        None,
        None,
        None,
        SAMPLE_RATE,
        CountingMode::EdgeAlignedUp,
    );
    timer.ch1().set_duty_cycle_fraction(1, 16);
    timer.ch1().enable();

    // Nominal parameters pass their check; a product takes its own from `ParameterSlots`.
    let Ok(processor) = Processor::new(&Parameters::default(), BootReport::default()) else {
        panic!("the nominal parameters are refused");
    };
    let bank = CounterBank::new(bus, AccelerometerInput::Counters);
    let (Ok(telemetry), Ok(sampling)) = (telemetry(serial), sampling(bank, processor)) else {
        panic!("a task is started twice");
    };
    spawner.spawn(telemetry);
    spawner.spawn(sampling);

    pac::TIM2.dier().modify(|w| w.set_uie(true));
    typelevel::TIM2::unpend();
    // SAFETY: nothing holds a critical section that relies on this interrupt being masked.
    unsafe { typelevel::TIM2::enable() };
}

/// Processes each period's frame in the chain.
#[embassy_executor::task]
async fn sampling(mut bank: CounterBank<Bus>, mut processor: Processor<F32>) {
    let mut served = PERIODS.load(Ordering::Relaxed);
    loop {
        PERIOD_ENDED.wait().await;
        let now = PERIODS.load(Ordering::Relaxed);
        // A signal of a period already served: the interrupt came between wait and load.
        let elapsed = now.wrapping_sub(served);
        if elapsed == 0 {
            continue;
        }
        served = now;
        let reading = bank.take_async(elapsed).await;
        let timing = Timing {
            missed: elapsed - 1,
            late: false,
        };
        if let Some(frame) = processor.period(reading, timing)
            && FRAMES.try_send(frame).is_err()
        {
            processor.output_overrun();
        }
    }
}

/// Sends the queued frames.
#[embassy_executor::task]
async fn telemetry(mut serial: UartTx<'static, Async>) {
    loop {
        let frame = FRAMES.receive().await;
        // The line is one way: a receiver detects a gap in the sequence.
        let _ = serial.write(&frame.to_bytes()).await;
    }
}
