//! Does the main loop's work beside sending: logs events and the dither's amplitude.
//!
//! It watches [`WATCH`] and logs by defmt: the first fault when it appears, and once a second the amplitude of each
//! block's dither \[arcsec\] and the longest interrupt so far \[ticks of TIM5\]. It runs at most once a period; events
//! missed here are still in the frames.

use core::sync::atomic::Ordering;

use trueaxis::{DitherMonitor, Parameters, Status};

use super::sampling::WATCH;

/// Events already logged by the main loop.
pub struct Background {
    dither: DitherMonitor,
    pickoff_weight_rad: f32,
    samples_a_second: u32,
    seen: u32,
    reported: u32,
    fault_logged: bool,
}

impl Background {
    /// Starts with nothing logged.
    pub fn new(parameters: &Parameters) -> Self {
        Self {
            dither: DitherMonitor::new(),
            pickoff_weight_rad: parameters.pickoff_weight_rad as f32,
            samples_a_second: parameters.sample_rate_hz as u32,
            seen: 0,
            reported: 0,
            fault_logged: false,
        }
    }

    /// Reads [`WATCH`], which the interrupt writes, and logs it; returns the number of interrupts served so far.
    pub fn poll(&mut self) -> u32 {
        let served = WATCH.served.load(Ordering::Acquire);
        if served == self.seen {
            return served;
        }
        self.seen = served;
        let codes = WATCH.pickoff_codes.each_ref();
        self.dither
            .observe(codes.map(|code| code.load(Ordering::Relaxed)));
        if !self.fault_logged {
            self.log_first_fault();
        }
        if served.wrapping_sub(self.reported) >= self.samples_a_second {
            self.reported = served;
            self.log_second();
        }
        served
    }

    /// Number of interrupts at the last [`Self::poll`].
    #[cfg(feature = "emulator")]
    pub fn seen(&self) -> u32 {
        self.seen
    }

    fn log_first_fault(&mut self) {
        let bits = WATCH.first_fault.load(Ordering::Acquire);
        if bits != 0 {
            self.fault_logged = true;
            defmt::warn!(
                "first fault: {}, in period {=u32}",
                Status::from_bits(bits),
                WATCH.first_fault_period.load(Ordering::Relaxed)
            );
        }
    }

    fn log_second(&mut self) {
        if let Some([x, y, z]) = self.dither.amplitude_arcsec(self.pickoff_weight_rad) {
            defmt::info!(
                "dither {=f32} {=f32} {=f32} arcsec, longest interrupt {=u32} ticks",
                x,
                y,
                z,
                WATCH.longest.load(Ordering::Relaxed)
            );
        }
    }
}
