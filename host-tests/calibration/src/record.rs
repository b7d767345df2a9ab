//! What one recording says of its unknowns, whatever its reference.

use rlg_inference::{Information, NoiseLevels};
use rlg_recording::error::InputError;
use rlg_recording::{MANIFEST, Recording};
use rlg_signal::axes::Triad;

/// Least seconds of usable rows: below this not even the noise is known.
pub const LEAST_S: f64 = 2.0;

/// The information of one recording, and what it rests on.
#[derive(Clone)]
pub struct RecordInformation {
    /// On the unknowns of a single recording, in their order.
    pub information: Information,
    /// Noise of each gyro a row \[rad²\].
    pub levels: [NoiseLevels; 3],
    /// Seconds that were used.
    pub seconds: f64,
    /// Degrees of freedom of the residual, all gyros.
    pub degrees: f64,
    /// Rows per second \[Hz\].
    pub rate_hz: f64,
    /// The greatest angular acceleration about each axis \[rad/s²\].
    pub acceleration_rad_s2: [f64; 3],
}

/// Too little of a recording can be used.
pub fn too_short(recording: &Recording, seconds: f64) -> InputError {
    InputError::new(
        recording.folder.join(MANIFEST),
        "has too few rows with all channels measured",
    )
    .value(format!("{seconds:.2} s"))
    .expected(format!("at least {LEAST_S} s"))
}

/// The greatest absolute value on each axis.
pub fn greatest(triad: &Triad) -> [f64; 3] {
    triad.each_ref().map(|values| {
        let sizes = values.iter().map(|value| value.abs());
        sizes.fold(0.0, f64::max)
    })
}
