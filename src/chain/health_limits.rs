//! Holds the limits of the unit's health, which the parameter block may bring.
//!
//! A limit that is absent is not watched. The readings come from the bank's slow channels and the dither's windows; the
//! status bits are in [`Status`](crate::chain::faults::Status).

use crate::chain::design_parameters as design;
use crate::chain::parameter_error::ParameterError;

/// Limits of the unit's health. Axes x, y, z.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub struct HealthLimits {
    /// Least and largest temperature of a block \[K\], within 150 to 450.
    pub temperature_k: Option<[f64; 2]>,
    /// Least laser intensity over nominal \[1\], 0.01 to 1.
    pub intensity_least: Option<[f64; 3]>,
    /// Largest change of a path-length control's drive from one reading to the next over its range \[1\], 0.001 to 1: a
    /// laser that jumps by a wavelength moves the control by more. A reset of the control counts as one.
    pub path_length_step: Option<f64>,
    /// Least and largest dither drive over nominal \[1\], within 0 to 2.
    pub dither_drive: Option<[f64; 2]>,
    /// Least and largest dither amplitude over nominal \[1\], within 0.2 to 1.9 and about 1.
    pub dither_amplitude: [f64; 2],
    /// Time since a pulse per second after which the next one is lost \[s\], 1.001 to 1.04.
    pub pulse_silence_s: Option<f64>,
}

impl Default for HealthLimits {
    /// Only the amplitude is watched, by [`HEALTHY_AMPLITUDE`](design::HEALTHY_AMPLITUDE).
    fn default() -> Self {
        let (least, largest) = design::HEALTHY_AMPLITUDE;
        Self {
            temperature_k: None,
            intensity_least: None,
            path_length_step: None,
            dither_drive: None,
            dither_amplitude: [f64::from(least), f64::from(largest)],
            pulse_silence_s: None,
        }
    }
}

impl HealthLimits {
    /// Numbers of a record.
    #[cfg(feature = "slots")]
    pub(crate) const NUMBERS: usize = 11;

    /// Returns these limits after `change`.
    #[must_use]
    pub fn with(mut self, change: impl FnOnce(&mut Self)) -> Self {
        change(&mut self);
        self
    }

    /// Checks each limit against its range.
    ///
    /// # Errors
    /// The first limit that is out of it, not finite, or the larger of a pair first.
    pub fn check(&self) -> Result<(), ParameterError> {
        use ParameterError as E;
        // Written so that NaN fails.
        let pair = |[low, high]: [f64; 2], least: f64, largest: f64| {
            least <= low && low < high && high <= largest
        };
        let (coldest, hottest) = design::TEMPERATURE_RANGE_K;
        let (coldest, hottest) = (f64::from(coldest), f64::from(hottest));
        if self
            .temperature_k
            .is_some_and(|range| !pair(range, coldest, hottest))
        {
            return Err(E::TemperatureLimits);
        }
        let dim = |least: [f64; 3]| least.iter().all(|least| (0.01..=1.0).contains(least));
        if self.intensity_least.is_some_and(|least| !dim(least)) {
            return Err(E::IntensityLimit);
        }
        let step = self.path_length_step;
        if step.is_some_and(|step| !(0.001..=1.0).contains(&step)) {
            return Err(E::PathLengthStep);
        }
        if self
            .dither_drive
            .is_some_and(|range| !pair(range, 0.0, 2.0))
        {
            return Err(E::DitherDriveLimits);
        }
        let [least, largest] = self.dither_amplitude;
        if !(pair([least, largest], 0.2, 1.9) && least < 1.0 && largest > 1.0) {
            return Err(E::DitherAmplitudeLimits);
        }
        let silence = self.pulse_silence_s;
        if silence.is_some_and(|silence| !(1.001..=1.04).contains(&silence)) {
            return Err(E::PulseSilence);
        }
        Ok(())
    }

    /// The numbers of the record; 0 for a limit that is absent (a largest value or a step of 0 is none).
    #[cfg(feature = "slots")]
    pub(crate) fn numbers(&self) -> [f64; Self::NUMBERS] {
        let [t0, t1] = self.temperature_k.unwrap_or_default();
        let [i0, i1, i2] = self.intensity_least.unwrap_or_default();
        let [d0, d1] = self.dither_drive.unwrap_or_default();
        let [a0, a1] = self.dither_amplitude;
        let step = self.path_length_step.unwrap_or_default();
        let silence = self.pulse_silence_s.unwrap_or_default();
        [t0, t1, i0, i1, i2, step, d0, d1, a0, a1, silence]
    }

    /// The limits of such numbers.
    #[cfg(feature = "slots")]
    pub(crate) fn of_numbers(numbers: [f64; Self::NUMBERS]) -> Self {
        let [t0, t1, i0, i1, i2, step, d0, d1, a0, a1, silence] = numbers;
        let given = |value: f64| (value != 0.0).then_some(value);
        Self {
            temperature_k: given(t1).map(|_| [t0, t1]),
            intensity_least: (i0 != 0.0 || i1 != 0.0 || i2 != 0.0).then_some([i0, i1, i2]),
            path_length_step: given(step),
            dither_drive: given(d1).map(|_| [d0, d1]),
            dither_amplitude: [a0, a1],
            pulse_silence_s: given(silence),
        }
    }
}
