//! Names the unit that parameters belong to.

use core::fmt;

/// Number of a unit: the 96 bits of a processor's unique number, or a serial number as text, filled up with zeros.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct UnitNumber(pub [u8; 12]);

impl UnitNumber {
    /// The number of a serial number as text; `None` if that has no byte or more than 12.
    pub fn of_text(text: &str) -> Option<Self> {
        let bytes = text.as_bytes();
        let mut number = [0; 12];
        if bytes.is_empty() || bytes.len() > number.len() {
            return None;
        }
        for (place, byte) in number.iter_mut().zip(bytes) {
            *place = *byte;
        }
        Some(Self(number))
    }

    /// The last four bytes before the zeros that fill up, as one word, as an answer over the line has room for.
    pub const fn short(self) -> u32 {
        let mut word = u32::from_be_bytes([self.0[8], self.0[9], self.0[10], self.0[11]]);
        let [rest @ .., _, _, _, _] = &self.0;
        let mut rest: &[u8] = rest;
        while word & 0xFF == 0 && (word != 0 || !rest.is_empty()) {
            word >>= 8;
            if let [before @ .., last] = rest {
                word |= (*last as u32) << 24;
                rest = before;
            }
        }
        word
    }
}

impl fmt::Display for UnitNumber {
    /// Text where it is printable, else hexadecimal.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let used = self
            .0
            .iter()
            .rposition(|byte| *byte != 0)
            .map_or(0, |last| last + 1);
        let text = self.0.iter().take(used);
        if used > 0 && text.clone().all(u8::is_ascii_graphic) {
            for byte in text {
                write!(f, "{}", char::from(*byte))?;
            }
            return Ok(());
        }
        for byte in self.0 {
            write!(f, "{byte:02x}")?;
        }
        Ok(())
    }
}

/// Unit and calibration that parameters belong to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub struct Identity {
    /// The unit.
    pub unit: UnitNumber,
    /// Date of the calibration, year × 10 000 + month × 100 + day; 0 if unknown.
    pub calibrated: u32,
    /// First 8 bytes of the SHA-256 of the model that the parameters were made of; zeros if unknown.
    pub model: [u8; 8],
}

impl Identity {
    /// Parameters of this unit, of unknown calibration and model.
    pub const fn new(unit: UnitNumber) -> Self {
        Self {
            unit,
            calibrated: 0,
            model: [0; 8],
        }
    }

    /// Words of the health items: the number's last bytes, the date, and the model's first bytes.
    pub(crate) const fn words(&self) -> [u32; 3] {
        let [a, b, c, d, ..] = self.model;
        let model = u32::from_be_bytes([a, b, c, d]);
        [self.unit.short(), self.calibrated, model]
    }

    /// Returns this identity after `change`.
    #[must_use]
    pub fn with(mut self, change: impl FnOnce(&mut Self)) -> Self {
        change(&mut self);
        self
    }

    /// True if the date is 0 or has a month and a day.
    pub(crate) const fn has_date(&self) -> bool {
        let (month, day) = (self.calibrated / 100 % 100, self.calibrated % 100);
        self.calibrated == 0 || (month >= 1 && month <= 12 && day >= 1 && day <= 31)
    }
}
