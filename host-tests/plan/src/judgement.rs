//! Decision on what is found, alike for every kind of recording.

use crate::section::section;

section! {
    /// Criteria of a finding. Log posteriors are in nats.
    JudgementPlan {
        /// Least cost in log posterior of omitting a named effect.
        naming: f64 = 4.0, "nat", [0.5, 100.0];
        /// Largest deficit in log posterior of a rival in the effect's class.
        class_within: f64 = 3.0, "nat", [0.0, 100.0];
        /// Residual of the effect after projection on a rival's columns, below which the rival is in the effect's class.
        separation: f64 = 5.0, "σ", [0.0, 100.0];
        /// Largest number of bootstrap draws of the recording without an effect.
        reenactments: usize = 8, "1", [1.0, 10000.0];
        /// Significance level of the bootstrap: an effect is deflated, or no further draws can take its name.
        reenactment_chance: f64 = 1e-3, "1", [1e-12, 0.5];
        /// Share of the residual's power below which an effect has no practical size, if it turns no gyro further than its
        /// noise.
        practical_share: f64 = 0.01, "1", [0.0, 1.0];
        /// Log posterior within which unpriced drift explains an effect, so that it may be drift.
        drift_within: f64 = 6.0, "nat", [0.0, 100.0];
        /// Standard deviation of the logarithm of the reference's noise power about its declaration: 1 is a factor of 1.6 in
        /// the noise itself.
        reference_std: f64 = 1.0, "1", [1e-3, 10.0];
        /// Least number of time–frequency cells above the gate for an axis in motion: some neighbourhoods of nine.
        least_cells: usize = 27, "1", [1.0, 1e6];
        /// Least size of an event that is tried.
        event: f64 = 3.5, "σ", [1.0, 100.0];
        /// Significance level of a band's residual power, all bands counted.
        unexplained: f64 = 1e-4, "1", [1e-12, 0.5];
        /// Least excess of a noise level over the declared and measured noise for a finding.
        excess_noise: f64 = 6.0, "σ", [1.0, 100.0];
        /// Least ratio of powers for the same.
        excess_ratio: f64 = 1.1, "1", [1.0, 100.0];
        /// Largest ratio of powers of two octaves with the same white noise of angle: flat noise differs by four.
        same_angle_ratio: f64 = 1.2, "1", [1.0, 4.0];
        /// Largest number of passes of motion, columns and search.
        passes: usize = 8, "1", [1.0, 1000.0];
    }
}
