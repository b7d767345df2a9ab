//! The driver of an RS-422 line behind USART1: its enable pin against the bits that leave.

use crate::ticks;

/// Least time from the enable to a start bit \[ticks\]: a bit at 1 Mbaud. Drivers for this rate take a tenth of it.
const LEAD: u64 = ticks::of_us(1);

/// Its enable pin.
#[derive(Debug, Clone, Default)]
pub struct LineDriver {
    on_since: Option<u64>,
    /// Times that it was turned off.
    pub turned_off: usize,
    /// Longest time from the end of a last stop bit until it was off \[ticks\].
    pub longest_hold: u64,
}

impl LineDriver {
    /// The pin is high or low at `now`, the line is free from `line_free_at` on; a sentence on a violation.
    pub fn set(&mut self, is_high: bool, now: u64, line_free_at: u64) -> Option<String> {
        match (self.on_since, is_high) {
            (None, true) => self.on_since = Some(now),
            (Some(_), false) => {
                self.on_since = None;
                self.turned_off += 1;
                if now < line_free_at {
                    return Some("the line's driver is turned off within a byte".to_owned());
                }
                self.longest_hold = self.longest_hold.max(now - line_free_at);
            }
            _ => {}
        }
        None
    }

    /// A byte's start bit begins at `begin`; a sentence on a violation.
    pub fn send(&self, begin: u64) -> Option<String> {
        match self.on_since {
            None => Some("a byte is sent while the line's driver is off".to_owned()),
            Some(since) if begin < since + LEAD => {
                Some("the line's driver is turned on too late for a start bit".to_owned())
            }
            Some(_) => None,
        }
    }
}
