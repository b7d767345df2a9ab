//! Reason for a recording without a fit.

pub use rlg_inference::TooFewRows;
use rlg_recording::error::InputError;

/// Reason for a recording without a fit.
#[derive(Debug, PartialEq)]
pub enum Unfit {
    /// Data or model are in error.
    Input(InputError),
    /// Data and model are right, and too few rows can be fitted.
    TooFewRows(TooFewRows),
}

impl From<InputError> for Unfit {
    fn from(error: InputError) -> Self {
        Self::Input(error)
    }
}

impl From<TooFewRows> for Unfit {
    fn from(error: TooFewRows) -> Self {
        Self::TooFewRows(error)
    }
}
