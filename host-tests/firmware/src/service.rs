//! Models the slow channels of a sound unit's bank and its pulse per second, period by period.
//!
//! Temperatures follow a day's course, intensities and drives scatter by some per cent, path-length controls follow the
//! temperature; the bank's clock is 30 ppm fast and wanders by 2 ppm in ten minutes. Time of a latch and of the
//! pulses is known exactly, so that a frame's time can be judged.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use trueaxis::slow_channels::{BankService, CHANNELS, channel};
use trueaxis::{HealthLimits, Parameters};

use crate::unit::{self, RATE_HZ};

/// Deviation of the sampling clock \[1\]: a period is shorter by this.
const SAMPLING_PPM: f64 = 17e-6;

/// Deviation of the bank's clock \[1\], and how far and how fast it wanders.
const BANK_PPM: f64 = 30e-6;
const WANDER: f64 = 2e-6;
const WANDER_S: f64 = 600.0;

/// Ticks of a perfect bank's clock in a second.
const TICKS: f64 = 16e6;

/// Temperature in the middle of the day \[K\], and its swing.
const WARM_K: f64 = 300.0;
const DAY_SWING_K: f64 = 15.0;
const DAY_S: f64 = 86_400.0;

/// The parameters of `unit` with limits.
pub fn parameters() -> Parameters {
    unit::parameters().with(|parameters| {
        parameters.limits = Some(HealthLimits::default().with(|limits| {
            limits.temperature_k = Some([233.0, 358.0]);
            limits.intensity_least = Some([0.7; 3]);
            limits.path_length_step = Some(0.1);
            limits.dither_drive = Some([0.5, 1.5]);
            limits.pulse_silence_s = Some(1.02);
        }));
    })
}

/// Fault of a slow channel or of the pulse.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SlowFault {
    /// The laser goes out with a time constant of 10 ms.
    DyingLaser,
    /// The path-length control jumps to another wavelength.
    ModeHop,
    /// The path-length control was reset.
    ControlReset,
    /// The dither drive is at its end.
    DitherDrive,
    /// A temperature does not come.
    ThermometerSilent,
    /// A thermometer is broken: its reading is far off.
    TemperatureRange,
    /// No pulse comes.
    PulseLost,
}

/// The bank beside its counters.
#[derive(Debug, Clone)]
pub struct SlowBank {
    random: ChaCha8Rng,
    period: u32,
    /// Ticks of the bank's clock at the last pulse; the pulses seen.
    pulse_ticks: f64,
    pulses: u32,
    hopped: [f64; 3],
    resets: [i16; 3],
}

/// Time of the latch that ends a period \[s\], by the pulses' clock; the first pulse comes at 0.
pub fn latch_s(period: u32) -> f64 {
    0.25 + f64::from(period) / RATE_HZ * (1.0 - SAMPLING_PPM)
}

/// Reading of the bank's clock at a time.
fn ticks(time_s: f64) -> f64 {
    let wander = std::f64::consts::TAU / WANDER_S;
    TICKS * (time_s * (1.0 + BANK_PPM) + WANDER / wander * (1.0 - (wander * time_s).cos()))
}

impl SlowBank {
    /// Before the first period.
    pub fn new(seed: u64) -> Self {
        Self {
            random: ChaCha8Rng::seed_from_u64(seed ^ 0x51_0E),
            period: 0,
            pulse_ticks: 0.0,
            pulses: 0,
            hopped: [0.0; 3],
            resets: [0; 3],
        }
    }

    /// The next period's channel and stamp. `fault`: its kind, its axis, and the time since it began \[s\].
    pub fn step(&mut self, fault: Option<(SlowFault, usize, f64)>) -> BankService {
        let time_s = latch_s(self.period);
        let turn = self.period % (CHANNELS as u32 + 1);
        self.period = self.period.wrapping_add(1);
        let lost = matches!(fault, Some((SlowFault::PulseLost, ..)));
        let second = time_s.floor();
        if second as u32 + 1 > self.pulses {
            self.pulses = second as u32 + 1;
            if !lost {
                // The capture is as fine as the clock.
                self.pulse_ticks = ticks(second).floor();
            }
        }
        let since = ticks(time_s).floor() - self.pulse_ticks;
        let (kind, axis) = (turn as u8 / 3 * 3, turn as usize % 3);
        let struck = fault
            .filter(|(_, of, _)| *of == axis)
            .map(|(fault, _, since)| (fault, since));
        let (channel, value) = self.channel(kind, axis, time_s, struck);
        BankService {
            channel,
            value,
            since_pulse: since.min(f64::from(BankService::NO_PULSE)) as u32,
        }
    }

    fn channel(
        &mut self,
        kind: u8,
        axis: usize,
        time_s: f64,
        struck: Option<(SlowFault, f64)>,
    ) -> (u8, i16) {
        let mut scatter = |of: f64| self.random.random_range(-of..of);
        let day = (std::f64::consts::TAU * time_s / DAY_S).sin();
        let number = kind + axis as u8;
        let value = match (kind, struck) {
            (channel::TEMPERATURE, Some((SlowFault::ThermometerSilent, _))) => {
                return (BankService::NO_CHANNEL, 0);
            }
            (channel::TEMPERATURE, Some((SlowFault::TemperatureRange, _))) => 420.0 * 64.0,
            (channel::TEMPERATURE, _) => (WARM_K + DAY_SWING_K * day + scatter(0.05)) * 64.0,
            (channel::INTENSITY, struck) => {
                let left = match struck {
                    Some((SlowFault::DyingLaser, since)) => (-since / 0.01).exp(),
                    _ => 1.0,
                };
                (1.0 + scatter(0.05)) * left * 16384.0
            }
            (channel::PATH_LENGTH, struck) => {
                if matches!(struck, Some((SlowFault::ModeHop, _))) && self.hopped[axis] == 0.0 {
                    self.hopped[axis] = -0.3;
                }
                (0.5 * day + self.hopped[axis] + scatter(0.01)) * 32768.0
            }
            (channel::PATH_LENGTH_RESETS, struck) => {
                if matches!(struck, Some((SlowFault::ControlReset, since)) if since < 0.0045) {
                    self.resets[axis] = self.resets[axis].wrapping_add(1);
                }
                f64::from(self.resets[axis])
            }
            (channel::DITHER_DRIVE, Some((SlowFault::DitherDrive, _))) => 1.9 * 16384.0,
            (channel::DITHER_DRIVE, _) => (1.0 + scatter(0.2)) * 16384.0,
            _ => return (BankService::NO_CHANNEL, 0),
        };
        (number, value as i16)
    }

    /// Ends a mode hop: the drive is where it was before.
    pub fn settle(&mut self) {
        self.hopped = [0.0; 3];
    }
}
