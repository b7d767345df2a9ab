//! The unit of time: fine enough for every clock of the board to have whole ticks.

/// Ticks in a second: a thousand times the least common multiple of 168, 144 and 16 MHz, so that a period that is longer or
/// shorter by a number of per mille has whole ticks too. 32 kHz, 1 and 3 Mbaud have whole ticks as well.
pub const PER_SECOND: u64 = 1_008_000_000_000;

/// Ticks of a time \[ns\].
pub const fn of_ns(ns: u64) -> u64 {
    ns * (PER_SECOND / 1_000_000_000)
}

/// Ticks of a clock's period. `None` if it has no whole number of them, or does not run.
pub fn of_period(hz: u32) -> Option<u64> {
    let hz = u64::from(hz);
    (hz > 0 && PER_SECOND.is_multiple_of(hz)).then(|| PER_SECOND / hz)
}

/// Ticks of a time \[µs\].
pub const fn of_us(us: u64) -> u64 {
    us * (PER_SECOND / 1_000_000)
}

/// Ticks of a time \[ms\].
pub const fn of_ms(ms: u64) -> u64 {
    of_us(1000 * ms)
}

/// A time \[ms\] of so many ticks.
pub fn to_ms(ticks: u64) -> f64 {
    ticks as f64 * 1e3 / PER_SECOND as f64
}
