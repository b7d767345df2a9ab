//! Fit and noise in `diagnosis.json`: figures by channel and recording, noise terms.

use rlg_plan::FindingsPlan;
use schemars::JsonSchema;
use serde::Serialize;

/// Fit before and after.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct FitEntry {
    /// Fitted times \[s\].
    pub fitted_on: Vec<[f64; 2]>,
    /// Held-out times \[s\].
    pub held_out: Vec<[f64; 2]>,
    /// Addition, with several recordings: the same on the clock of each; `fitted_on` and `held_out` then continue the
    /// clock of the first recording without a gap.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub recordings: Vec<RecordingEntry>,
    /// Addition, for a recording longer than memory: rows and blocks used. Locations and powers are then of the
    /// stretches alone, parameters and drifts of all of it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub whole: Option<WholeEntry>,
    /// Gyros.
    pub channels: Vec<ChannelEntry>,
}

/// Use of a recording longer than memory.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct WholeEntry {
    /// Block rate of the summed rows \[Hz\].
    pub blocks_per_s: f64,
    /// Stretches analysed row by row \[s\]; blocks that contain their rows are left out.
    pub stretches_s: Vec<[f64; 2]>,
    /// Total fitted time in blocks \[s\].
    pub fitted_blocks_s: f64,
    /// Total held-out time in blocks \[s\].
    pub held_out_blocks_s: f64,
    /// Total unusable time \[s\].
    pub unusable_s: f64,
    /// Gyros, on the held-out blocks.
    pub channels: Vec<ChannelEntry>,
}

/// One recording of several.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct RecordingEntry {
    /// Its name.
    pub recording: String,
    /// The recording was held out as a whole.
    pub held_out_whole: bool,
    /// Fitted times \[s\].
    pub fitted_on: Vec<[f64; 2]>,
    /// Held-out times \[s\].
    pub held_out: Vec<[f64; 2]>,
    /// Power of the residual over the shared noise in its held-out rows, x, y, z (1 = noise alone).
    pub normalised_power: [Option<f64>; 3],
}

/// One channel before and after.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct ChannelEntry {
    /// `gyro_x`, `accel_x`, ...
    pub channel: String,
    /// Addition: unit of the drifts if it is not rad/s (accelerometers: m/s^2).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unit: Option<&'static str>,
    /// Addition: tested band \[Hz\].
    pub band_hz: [f64; 2],
    /// Figures without the effects.
    pub held_out_before: FiguresEntry,
    /// Figures with the effects.
    pub held_out_after: FiguresEntry,
}

/// Figures of one gyro.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct FiguresEntry {
    /// Mean rate \[rad/s\].
    pub drift_rad_s: f64,
    /// Addition: standard deviation of the mean rate \[rad/s\].
    pub drift_std_rad_s: f64,
    /// Power over noise in the located bands and times.
    pub normalised_power: f64,
    /// Power over noise in all held-out rows.
    pub normalised_power_all: f64,
    /// p-value of the whiteness test.
    pub white_p_value: f64,
}

/// Noise of one gyro.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct NoiseEntry {
    /// `gyro_x`, ...
    pub channel: String,
    /// Angle random walk \[rad/√s\].
    pub angle_random_walk_rad_sqrt_s: f64,
    /// White angle noise \[rad\].
    pub angle_noise_rad: f64,
    /// Standard deviation of its rate's drift over the record \[rad/s\], if beyond the drift in the model.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub wandering_rad_s: Option<f64>,
    /// Addition: measured noise terms of IEEE 952; for units at rest.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub terms: Option<NoiseTermsEntry>,
}

/// Noise terms of IEEE 952 of one gyro, from a joint fit.
#[derive(Debug, Clone, Copy, Serialize, JsonSchema)]
pub struct NoiseTermsEntry {
    /// Angle random walk N \[rad/√s\].
    pub angle_random_walk_rad_sqrt_s: LevelEntry,
    /// Quantisation Q: white angle noise \[rad\].
    pub quantisation_rad: LevelEntry,
    /// Bias instability B \[rad/s\].
    pub bias_instability_rad_s: LevelEntry,
    /// Rate random walk K \[rad/s/√s\].
    pub rate_random_walk_rad_s_sqrt_s: LevelEntry,
}

/// A level with its standard deviation.
#[derive(Debug, Clone, Copy, Serialize, JsonSchema)]
pub struct LevelEntry {
    /// Value.
    pub value: f64,
    /// Standard deviation; for a smaller value, the root of the standard deviation of its square.
    pub std: f64,
}

impl LevelEntry {
    /// True if the level exceeds zero by the least significance of a value.
    pub fn is_measured(&self, plan: &FindingsPlan) -> bool {
        self.value > plan.significant_deviations * self.std
    }

    /// Upper bound of the level: the root of its square plus as many standard deviations of the square.
    pub fn bound(&self, plan: &FindingsPlan) -> f64 {
        (self.value.powi(2) + plan.significant_deviations * self.std_of_square()).sqrt()
    }

    /// Standard deviation of the square: levels are fitted as squares, which are nearly normal even if the levels are
    /// not.
    fn std_of_square(&self) -> f64 {
        match self.value > self.std {
            true => 2.0 * self.value * self.std,
            false => self.std.powi(2),
        }
    }
}

/// Noise of one accelerometer.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct ForceNoiseEntry {
    /// `accel_x`, ...
    pub channel: String,
    /// White noise of the force, one-sided \[m/s²/√Hz\].
    pub noise_m_s2_sqrt_hz: f64,
    /// White noise of the velocity \[m/s\].
    pub velocity_noise_m_s: f64,
    /// Noise terms of IEEE 952, for a unit at rest.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub terms: Option<ForceTermsEntry>,
}

/// Noise terms of IEEE 952 of one accelerometer at rest.
#[derive(Debug, Clone, Copy, Serialize, JsonSchema)]
pub struct ForceTermsEntry {
    /// Velocity random walk N \[m/s/√s\].
    pub velocity_random_walk_m_s_sqrt_s: LevelEntry,
    /// Quantisation Q: white velocity noise \[m/s\].
    pub quantisation_m_s: LevelEntry,
    /// Bias instability B \[m/s²\].
    pub bias_instability_m_s2: LevelEntry,
    /// Acceleration random walk K \[m/s²/√s\].
    pub acceleration_random_walk_m_s2_sqrt_s: LevelEntry,
}
