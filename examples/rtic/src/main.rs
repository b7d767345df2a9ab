//! The chain under RTIC 2 on an STM32F405: the counter bank by DMA, telemetry through a queue to USART1.
//!
//! ```text
//! TIM2, each period ─▶ bank latches (PA0), chip select, DMA of 48 bytes
//! DMA2 stream 0, transfer complete ─▶ BankDecoder ─▶ Processor ─▶ queue ─▶ idle ─▶ USART1
//! ```
#![no_std]
#![no_main]

mod bank_dma;

use panic_halt as _;

#[rtic::app(device = stm32f4::stm32f405, peripherals = true)]
mod app {
    use cortex_m::peripheral::DWT;
    use heapless::spsc::{Consumer, Producer, Queue};
    use stm32f4::stm32f405::{GPIOA, TIM2, USART1};
    use trueaxis::counter_bank::{AccelerometerInput, BankDecoder, BusFault, FRAME_BYTES};
    use trueaxis::{BootReport, F32, Parameters, Processor, TelemetryFrame, Timing};

    use crate::bank_dma::BankDma;

    /// Frequency of the internal oscillator and of every bus \[Hz\].
    const CLOCK_HZ: u32 = 16_000_000;

    /// Length of a sampling period at 4 kHz \[cycles\].
    const PERIOD_CYCLES: u32 = CLOCK_HZ / 4_000;

    /// Delay above which an interrupt counts as late \[cycles\].
    const LATE_CYCLES: u32 = PERIOD_CYCLES / 4;

    /// Telemetry \[bits/s\].
    const BAUD: u32 = 1_000_000;

    /// Frames queued for the serial port, one slot of which stays empty.
    const QUEUE: usize = 16;

    // The library's table of sizes, here on the target.
    const _: () = assert!(size_of::<Processor<F32>>() == 2000 && size_of::<BankDecoder>() == 40);

    #[shared]
    struct Shared {
        sampling: Sampling,
    }

    #[local]
    struct Local {
        timer: TIM2,
        /// End of the period of the next interrupt \[cycles\]; `None` before the first.
        due: Option<u32>,
        queued: Consumer<'static, TelemetryFrame>,
        serial: USART1,
    }

    /// State shared by both interrupts.
    pub struct Sampling {
        bank: BankDma,
        decoder: BankDecoder,
        processor: Processor<F32>,
        frames: Producer<'static, TelemetryFrame>,
        /// Timing of the period whose transfer is under way.
        timing: Timing,
    }

    impl Sampling {
        /// Processes one period in the chain.
        fn advance(&mut self, transfer: Result<&[u8; FRAME_BYTES], BusFault>) {
            let periods = self.timing.missed.saturating_add(1);
            let reading = self.decoder.reading(transfer, periods);
            if let Some(frame) = self.processor.period(reading, self.timing)
                && self.frames.enqueue(frame).is_err()
            {
                self.processor.output_overrun();
            }
        }
    }

    #[init(local = [
        queue: Queue<TelemetryFrame, QUEUE> = Queue::new(),
        buffer: [u8; FRAME_BYTES] = [0; FRAME_BYTES],
    ])]
    fn init(mut context: init::Context) -> (Shared, Local) {
        let device = context.device;
        context.core.DCB.enable_trace();
        context.core.DWT.enable_cycle_counter();
        let rcc = &device.RCC;
        rcc.ahb1enr()
            .modify(|_, w| w.gpioaen().enabled().dma2en().enabled());
        rcc.apb1enr().modify(|_, w| w.tim2en().enabled());
        rcc.apb2enr()
            .modify(|_, w| w.spi1en().enabled().usart1en().enabled());
        // A clock acts two cycles of its bus after its enable: the readings take that time (RM0090 7.2.14).
        let _ = (rcc.ahb1enr().read(), rcc.apb1enr().read());
        let _ = rcc.apb2enr().read();
        set_up_telemetry(&device.GPIOA, &device.USART1);
        set_up_timer(&device.GPIOA, &device.TIM2);

        // Nominal parameters pass their check; a product takes its own from `ParameterSlots`.
        let Ok(processor) = Processor::new(&Parameters::default(), BootReport::default()) else {
            panic!("the nominal parameters are refused");
        };
        let (frames, queued) = context.local.queue.split();
        let bank = BankDma::new(device.SPI1, device.DMA2, device.GPIOA, context.local.buffer);
        // Periods are counted from here.
        device.TIM2.cr1().modify(|_, w| w.cen().enabled());
        (
            Shared {
                sampling: Sampling {
                    bank,
                    decoder: BankDecoder::new(AccelerometerInput::Counters),
                    processor,
                    frames,
                    timing: Timing::default(),
                },
            },
            Local {
                timer: device.TIM2,
                due: None,
                queued,
                serial: device.USART1,
            },
        )
    }

    /// Sets up PA9 for sending: 8 data bits, no parity, 1 stop bit.
    fn set_up_telemetry(gpioa: &GPIOA, serial: &USART1) {
        gpioa.afrh().modify(|_, w| w.afrh9().af7());
        gpioa.moder().modify(|_, w| w.moder9().alternate());
        // SAFETY: the register holds the clock over the rate, 16 here, within its 16 bits.
        serial
            .brr()
            .write(|w| unsafe { w.bits((CLOCK_HZ / BAUD) as u16) });
        serial.cr1().write(|w| w.ue().enabled().te().enabled());
    }

    /// Sets up TIM2: it requests an interrupt each period and signals its beginning to the bank on PA0, for a sixteenth of
    /// it.
    fn set_up_timer(gpioa: &GPIOA, timer: &TIM2) {
        gpioa.afrl().modify(|_, w| w.afrl0().af1());
        gpioa.moder().modify(|_, w| w.moder0().alternate());
        timer.arr().write(|w| w.arr().set(PERIOD_CYCLES - 1));
        timer.ccr1().write(|w| w.ccr().set(PERIOD_CYCLES / 16));
        timer.ccmr1_output().write(|w| w.oc1m().pwm_mode1());
        timer.ccer().write(|w| w.cc1e().set_bit());
        timer.dier().write(|w| w.uie().enabled());
    }

    /// At a period's end, after the bank has latched, starts the transfer of its frame.
    #[task(binds = TIM2, priority = 2, local = [timer, due], shared = [sampling])]
    fn period(mut context: period::Context) {
        let now = DWT::cycle_count();
        context.local.timer.sr().write(|w| w.uif().clear());
        let due = context.local.due.unwrap_or(now);
        // An entry may seem a few cycles early: with half a period added, whole periods are the missed ones.
        let missed = now.wrapping_sub(due).wrapping_add(PERIOD_CYCLES / 2) / PERIOD_CYCLES;
        let ended = due.wrapping_add(missed.wrapping_mul(PERIOD_CYCLES));
        let latency = now.wrapping_sub(ended) as i32;
        *context.local.due = Some(ended.wrapping_add(PERIOD_CYCLES));
        context.shared.sampling.lock(|sampling| {
            if sampling.bank.is_busy() {
                // The previous period's frame has not arrived within a whole one.
                sampling.bank.give_up();
                sampling.advance(Err(BusFault));
            }
            sampling.timing = Timing {
                missed,
                late: latency > LATE_CYCLES as i32,
            };
            sampling.bank.start();
        });
    }

    /// Handles a received frame, or an error reported by the DMA.
    #[task(binds = DMA2_STREAM0, priority = 2, shared = [sampling])]
    fn transferred(mut context: transferred::Context) {
        context.shared.sampling.lock(|sampling| {
            let transfer = sampling.bank.finish();
            sampling.advance(transfer.as_ref().map_err(|fault| *fault));
        });
    }

    /// Sends the queued frames; nothing else depends on it.
    #[idle(local = [queued, serial])]
    fn idle(context: idle::Context) -> ! {
        loop {
            let Some(frame) = context.local.queued.dequeue() else {
                cortex_m::asm::wfi();
                continue;
            };
            for byte in frame.to_bytes() {
                while context.local.serial.sr().read().txe().bit_is_clear() {}
                context.local.serial.dr().write(|w| w.dr().set(byte.into()));
            }
        }
    }
}
