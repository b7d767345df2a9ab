//! Effects injected at rest, and their frequency.

use serde::{Deserialize, Serialize};

use crate::marks::setting::name_of;

/// Injected effect of a recording.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Planted {
    /// Nothing.
    None,
    /// A bias of 5 to 10 000 standard deviations.
    GyroBias,
    /// One line on one gyro.
    Line,
    /// Two or three lines, each on one gyro or on all.
    Lines,
    /// Two lines and, on a gyro, their product.
    ProductOfLines,
    /// A step of the bias of one gyro or of two.
    GyroBiasStep,
    /// A temperature-dependent bias, during warm-up.
    GyroBiasTemperature,
    /// Pulses coarser than those of the model.
    PulseQuantisation,
    /// More angle random walk than the model declares.
    AngleRandomWalk,
    /// Bias instability that the model does not declare.
    Flicker,
    /// A rate random walk that the model does not declare.
    RateRandomWalk,
}

/// Injected effects by the trial's number, repeated in turn.
pub const CYCLE: [Planted; 15] = {
    use Planted::{
        AngleRandomWalk, Flicker, GyroBias, GyroBiasStep, GyroBiasTemperature, Line, Lines, None,
        ProductOfLines, PulseQuantisation, RateRandomWalk,
    };
    [
        None,
        GyroBias,
        Line,
        None,
        Lines,
        ProductOfLines,
        None,
        GyroBiasStep,
        GyroBiasTemperature,
        None,
        PulseQuantisation,
        AngleRandomWalk,
        None,
        Flicker,
        RateRandomWalk,
    ]
};

impl Planted {
    /// Returns the injected effect of a trial's number.
    pub fn of(number: u64) -> Self {
        CYCLE[(number % CYCLE.len() as u64) as usize]
    }

    /// Returns the name in tables.
    pub fn name(self) -> String {
        name_of(&self)
    }
}
