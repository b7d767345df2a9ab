//! Watches the bank's slow channels: temperatures, lasers, path-length controls, dither drives.
//!
//! Each frame of the bank brings one channel ([`BankService`]), the channels take turns. [`SlowWatch`] runs in the
//! interrupt: it compares a reading with its limits as it comes, at the same cost for every channel, and gives
//! [`Status`] bits at the end of an output period. [`SlowMailbox`] carries the readings to the main loop, which may read
//! it at any time.
//!
//! | channel | reading | unit of the code |
//! |---|---|---|
//! | 0 to 2 | temperature of block x, y, z | 1/64 K, from 0 K |
//! | 3 to 5 | laser intensity x, y, z | 1/16384 of nominal |
//! | 6 to 8 | drive of the path-length control x, y, z | 1/32768 of its range |
//! | 9 to 11 | resets of that control since the bank's start, wrap | 1 |
//! | 12 to 14 | dither drive x, y, z | 1/16384 of nominal |
//!
//! The code −32768 is a reading that the bank could not take. Limits come from the parameter block
//! ([`HealthLimits`]); without them nothing here is a fault but a missing thermometer that a term needs.
//!
//! | status bit | raised while |
//! |---|---|
//! | [`Status::INTENSITY_LOW`] | an intensity is below its limit |
//! | [`Status::MODE_HOP`] | in this output period a control's drive stepped by more than its limit, or the control was reset |
//! | [`Status::DITHER_DRIVE`] | a drive is beyond its limits |
//! | [`Status::TEMPERATURE_RANGE`] | a temperature is beyond its limits |
//! | [`Status::TEMPERATURE_ABSENT`] | a temperature that limits or a term need does not come |
//!
//! A watched channel that does not come for [`SILENCE_S`] raises the bit of its limit as a reading beyond it would.

use core::sync::atomic::{AtomicU32, Ordering};

use crate::chain::faults::Status;
use crate::chain::health_limits::HealthLimits;
use crate::chain::parameters::Parameters;
use crate::chain::terms::{SlowReadings, TermKind};

/// A watched channel is silent if a stretch of this length has no reading of it \[s\]: six rounds at 4 kHz. Silence is
/// seen within two stretches.
pub const SILENCE_S: f64 = 0.025;

/// A thermometer of the firmware's own is silent after this time \[s\]: it may be read once a second.
pub const OWN_THERMOMETER_SILENCE_S: f64 = 2.5;

/// Channels of the table above.
pub const CHANNELS: usize = 15;

/// First channels of each kind, axis x; y and z follow.
pub mod channel {
    /// Temperature \[1/64 K\].
    pub const TEMPERATURE: u8 = 0;
    /// Laser intensity \[1/16384 of nominal\].
    pub const INTENSITY: u8 = 3;
    /// Drive of the path-length control \[1/32768 of its range\].
    pub const PATH_LENGTH: u8 = 6;
    /// Resets of that control.
    pub const PATH_LENGTH_RESETS: u8 = 9;
    /// Dither drive \[1/16384 of nominal\].
    pub const DITHER_DRIVE: u8 = 12;
}

/// Code of a reading that the bank could not take.
pub const NOT_MEASURED: i16 = i16::MIN;

/// The part of a frame that does not belong to the sample: a slow channel and the time of the latch.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct BankService {
    /// Slow channel of the table above; [`NO_CHANNEL`](Self::NO_CHANNEL) for none.
    pub channel: u8,
    /// Its code.
    pub value: i16,
    /// Time from the last pulse per second to the latch \[1/16 µs\]; [`NO_PULSE`](Self::NO_PULSE) beyond its range.
    pub since_pulse: u32,
}

impl BankService {
    /// The channel of a frame that brings none.
    pub const NO_CHANNEL: u8 = 255;

    /// The time of a frame that knows no pulse, or one too long ago.
    pub const NO_PULSE: u32 = 0xFF_FFFF;

    /// Neither channel nor time, as of a bank of version 2.
    pub const NONE: Self = Self {
        channel: Self::NO_CHANNEL,
        value: 0,
        since_pulse: Self::NO_PULSE,
    };
}

impl Default for BankService {
    fn default() -> Self {
        Self::NONE
    }
}

/// Limits of one channel, and its last code.
#[derive(Debug, Clone, Copy)]
struct Channel {
    value: i16,
    low: i16,
    high: i16,
    /// Largest change from one reading to the next; `u16::MAX` where none is watched.
    step: u16,
}

/// Bits of three channels from `first` on.
const fn axes(first: u8) -> u16 {
    0b111 << first
}

/// Watches the slow channels against their limits, in the interrupt.
#[derive(Debug, Clone)]
pub struct SlowWatch {
    channels: [Channel; CHANNELS],
    /// Bit n is channel n: its last reading is beyond its limits.
    beyond: u16,
    /// It has stepped in this output period.
    stepped: u16,
    /// It has come since the stretch began.
    came: u16,
    /// It has come at all.
    known: u16,
    /// It did not come in the last whole stretch.
    silent: u16,
    /// Its limits are watched.
    watched: u16,
    needs_temperature: bool,
    stretch_periods: u32,
    stretch_begun: u32,
    own_thermometer_periods: u32,
    /// Period after which the firmware's own thermometer counts as silent; `None` without a reading.
    own_until: Option<u32>,
}

impl SlowWatch {
    pub(crate) fn new(parameters: &Parameters) -> Self {
        let limits = parameters.limits.unwrap_or_default();
        let kinds = parameters.terms.kinds();
        let by_term = [
            TermKind::GyroBiasTemperature,
            TermKind::GyroBiasTemperatureRate,
            TermKind::GyroScaleTemperature,
            TermKind::InstallationTemperature,
        ]
        .into_iter()
        .any(|kind| kinds.contains(kind));
        let (channels, watched) = limit_codes(&limits);
        let stretch = (SILENCE_S * parameters.sample_rate_hz) as u32;
        Self {
            channels,
            beyond: 0,
            stepped: 0,
            came: 0,
            known: 0,
            silent: 0,
            watched,
            needs_temperature: by_term || watched & axes(channel::TEMPERATURE) != 0,
            // A round of the channels, whatever the sample rate.
            stretch_periods: stretch.max(CHANNELS as u32 + 2),
            stretch_begun: 0,
            own_thermometer_periods: (OWN_THERMOMETER_SILENCE_S * parameters.sample_rate_hz) as u32,
            own_until: None,
        }
    }

    /// Takes the channel of one frame. Cannot panic; costs the same for every channel and reading.
    #[inline(always)]
    pub(crate) fn take(&mut self, service: BankService) {
        let Some(channel) = self.channels.get_mut(usize::from(service.channel)) else {
            return;
        };
        let bit = 1u16 << (service.channel & 15);
        let value = service.value;
        let mask = |set: bool| if set { bit } else { 0 };
        let step = i32::from(value).wrapping_sub(i32::from(channel.value));
        let stepped = step.unsigned_abs() > u32::from(channel.step);
        let beyond = value < channel.low || value > channel.high;
        channel.value = value;
        self.stepped |= mask(stepped) & self.known;
        self.beyond = self.beyond & !bit | mask(beyond);
        self.came |= bit;
        self.known |= bit;
    }

    /// Notes a temperature of the firmware's own thermometer in this sampling period.
    pub(crate) fn own_thermometer(&mut self, period: u32) {
        self.own_until = Some(period.wrapping_add(self.own_thermometer_periods));
    }

    /// The status bits at the end of an output period, `period` sampling periods after start.
    #[inline]
    pub(crate) fn conclude(&mut self, period: u32) -> Status {
        let stepped = core::mem::take(&mut self.stepped);
        if period.wrapping_sub(self.stretch_begun) >= self.stretch_periods {
            core::hint::cold_path();
            self.silent = !core::mem::take(&mut self.came);
            self.stretch_begun = period;
        }
        let found = (self.beyond | self.silent) & self.watched;
        let any = |first: u8| found & axes(first) != 0;
        let hops = axes(channel::PATH_LENGTH) | axes(channel::PATH_LENGTH_RESETS);
        let absent = self.silent | self.not_measured();
        let range = self.beyond & !absent & self.watched & axes(channel::TEMPERATURE) != 0;
        Status::INTENSITY_LOW
            .when(any(channel::INTENSITY))
            .union(Status::MODE_HOP.when((stepped | found) & self.watched & hops != 0))
            .union(Status::DITHER_DRIVE.when(any(channel::DITHER_DRIVE)))
            .union(Status::TEMPERATURE_RANGE.when(range))
            .union(
                Status::TEMPERATURE_ABSENT
                    .when(self.needs_temperature && self.lacks_temperature(absent, period)),
            )
    }

    /// Channels of temperature whose last code is [`NOT_MEASURED`].
    #[inline(always)]
    fn not_measured(&self) -> u16 {
        let [x, y, z, ..] = &self.channels;
        let bit = |channel: &Channel, bit: u16| {
            if channel.value == NOT_MEASURED {
                bit
            } else {
                0
            }
        };
        bit(x, 1) | bit(y, 2) | bit(z, 4)
    }

    /// True if neither the bank nor the firmware's own thermometer brings all three temperatures.
    #[inline(always)]
    fn lacks_temperature(&mut self, absent: u16, period: u32) -> bool {
        if absent & axes(channel::TEMPERATURE) == 0 {
            return false;
        }
        // Half the range ahead is before that period.
        match self.own_until {
            Some(until) if until.wrapping_sub(period) as i32 > 0 => false,
            _ => {
                self.own_until = None;
                true
            }
        }
    }

    /// The last code of a channel; [`NOT_MEASURED`] before its first.
    pub fn code(&self, channel: u8) -> i16 {
        let known = self.known.checked_shr(u32::from(channel)).unwrap_or(0) & 1 != 0;
        let channel = self.channels.get(usize::from(channel));
        channel
            .filter(|_| known)
            .map_or(NOT_MEASURED, |channel| channel.value)
    }
}

/// The limits as codes, and the channels that are watched.
fn limit_codes(limits: &HealthLimits) -> ([Channel; CHANNELS], u16) {
    let free = Channel {
        value: NOT_MEASURED,
        low: i16::MIN,
        high: i16::MAX,
        step: u16::MAX,
    };
    let mut channels = [free; CHANNELS];
    let mut watched = 0;
    let mut limit = |first: u8, limits: [[f64; 2]; 3], codes_per_unit: f64| {
        let place = channels.iter_mut().skip(usize::from(first));
        for (axis, (channel, [low, high])) in place.zip(limits).enumerate() {
            // Conversions of a float hold at the ends; a code that was not measured is below every limit.
            channel.low = ((low * codes_per_unit) as i16).max(NOT_MEASURED + 1);
            channel.high = (high * codes_per_unit) as i16;
            watched |= 1 << (usize::from(first) + axis);
        }
    };
    if let Some(range) = limits.temperature_k {
        limit(channel::TEMPERATURE, [range; 3], KELVIN_CODES);
    }
    if let Some(least) = limits.intensity_least {
        // Twice nominal is the code's end.
        limit(
            channel::INTENSITY,
            least.map(|least| [least, 2.0]),
            NOMINAL_CODES,
        );
    }
    if let Some(range) = limits.dither_drive {
        limit(channel::DITHER_DRIVE, [range; 3], NOMINAL_CODES);
    }
    if let Some(step) = limits.path_length_step {
        let step = (step * 32768.0) as u16;
        let (drives, resets) = (channel::PATH_LENGTH, channel::PATH_LENGTH_RESETS);
        for (first, step) in [(drives, step), (resets, 0)] {
            for channel in channels.iter_mut().skip(usize::from(first)).take(3) {
                channel.step = step;
            }
            watched |= axes(first);
        }
        for channel in channels.iter_mut().skip(usize::from(drives)).take(3) {
            channel.low = NOT_MEASURED + 1;
        }
    }
    (channels, watched)
}

/// Codes of a kelvin.
const KELVIN_CODES: f64 = 64.0;

/// Codes of a nominal intensity or drive.
const NOMINAL_CODES: f64 = 16384.0;

/// The slow channels between the interrupt, which puts, and the main loop, which reads at any time. Every word is whole
/// by itself; channels may be a round apart.
#[derive(Debug)]
pub struct SlowMailbox {
    /// Of each channel: its code, and in the upper half a count of its readings that is 0 only before the first.
    words: [AtomicU32; CHANNELS],
}

impl Default for SlowMailbox {
    fn default() -> Self {
        Self::new()
    }
}

impl SlowMailbox {
    /// Nothing put yet.
    pub const fn new() -> Self {
        Self {
            words: [const { AtomicU32::new(0) }; CHANNELS],
        }
    }

    /// Puts the channel of one frame. Called by the interrupt alone.
    #[inline]
    pub fn put(&self, service: BankService) {
        if let Some(word) = self.words.get(usize::from(service.channel)) {
            let count = word.load(Ordering::Relaxed) >> 16;
            let next = if count < 0xFFFF { count + 1 } else { 1 };
            let code = u32::from(service.value.cast_unsigned());
            word.store(next << 16 | code, Ordering::Release);
        }
    }

    /// The last code of a channel, and the count of its readings, which never is 0; `None` before the first.
    pub fn code(&self, channel: u8) -> Option<(i16, u16)> {
        let word = self.words.get(usize::from(channel))?;
        let word = word.load(Ordering::Acquire);
        let count = (word >> 16) as u16;
        (count != 0).then_some(((word as u16).cast_signed(), count))
    }

    /// Temperatures of the blocks \[K\]; NaN where there is none.
    pub fn temperature_k(&self) -> [f32; 3] {
        core::array::from_fn(|axis| {
            let code = self.code(channel::TEMPERATURE + axis as u8);
            match code {
                Some((code, _)) if code != NOT_MEASURED => f32::from(code) / KELVIN_CODES as f32,
                _ => f32::NAN,
            }
        })
    }
}

/// Forms the readings of the terms from temperatures, in the main loop.
///
/// The derivative is that of an exponential average, so that a code's step of 1/64 K does not show as 0.1 K/s.
#[derive(Debug, Clone, Copy)]
pub struct SlowFilter {
    averages_k: [f32; 3],
}

/// Time constant of [`SlowFilter`]'s average \[s\]: blocks take minutes.
pub const SLOW_FILTER_S: f32 = 10.0;

impl Default for SlowFilter {
    fn default() -> Self {
        Self::new()
    }
}

impl SlowFilter {
    /// Before the first temperature.
    pub const fn new() -> Self {
        Self {
            averages_k: [f32::NAN; 3],
        }
    }

    /// Takes temperatures \[K\], `elapsed_s` after the last ones; NaN stays NaN, which terms pass over.
    #[must_use]
    pub fn readings(&mut self, temperature_k: [f32; 3], elapsed_s: f32) -> SlowReadings {
        let mut readings = SlowReadings::default();
        for (axis, average) in self.averages_k.iter_mut().enumerate() {
            let now = temperature_k[axis];
            if !average.is_finite() {
                *average = now;
            }
            let share = elapsed_s / (SLOW_FILTER_S + elapsed_s);
            let before = *average;
            if now.is_finite() {
                *average += share * (now - before);
            }
            readings.temperature_k[axis] = now;
            readings.temperature_rate_k_s[axis] = (now - before) / (SLOW_FILTER_S + elapsed_s);
        }
        readings
    }
}
