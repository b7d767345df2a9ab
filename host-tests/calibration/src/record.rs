//! Information of one recording on its unknowns, for any type of reference.

use rlg_catalogue::signals::CaseMotion;
use rlg_inference::{Information, NoiseLevels};
use rlg_plan::CalibrationPlan;
use rlg_recording::error::InputError;
use rlg_recording::{MANIFEST, Recording};

/// Information of one recording, with its noise and extent.
#[derive(Clone)]
pub struct RecordInformation {
    /// Information on the unknowns of a single recording, in their order.
    pub information: Information,
    /// Noise of each gyro \[rad² per row\].
    pub levels: [NoiseLevels; 3],
    /// Duration of the used rows \[s\].
    pub seconds: f64,
    /// Degrees of freedom of the residual, all gyros.
    pub degrees: f64,
    /// Rows per second \[Hz\].
    pub rate_hz: f64,
    /// Largest angular acceleration about each axis \[rad/s²\].
    pub acceleration_rad_s2: [f64; 3],
}

/// Error for a recording with too few usable rows.
pub fn too_short(recording: &Recording, seconds: f64, plan: &CalibrationPlan) -> InputError {
    InputError::new(
        recording.folder.join(MANIFEST),
        "has too few rows with all channels measured",
    )
    .value(format!("{seconds:.2} s"))
    .expected(format!("at least {} s", plan.least_s))
}

/// Largest angular acceleration on each axis \[rad/s²\].
pub fn greatest(motion: &CaseMotion) -> [f64; 3] {
    [0, 1, 2].map(|axis| {
        let values = motion.acceleration_rad_s2(axis).iter();
        let sizes = values.map(|value| value.abs());
        sizes.fold(0.0, f64::max)
    })
}
