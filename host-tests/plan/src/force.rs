//! Accelerometers.

use crate::section::section;

section! {
    /// Thresholds of the accelerometers' diagnosis.
    ForcePlan {
        /// Largest relative difference of the mean force from gravity that a bias and a scale error may explain.
        far_from_gravity: f64 = 0.1, "1", [0.0, 10.0];
        /// Ratio of a band's power to that of the quietest stretch above which a stretch counts as shaken.
        shaken_ratio: f64 = 2.0, "1", [1.0, 1000.0];
        /// Least number of observations of a band for a decision.
        fewest_in_band: f64 = 20.0, "1", [1.0, 1e6];
        /// Least number of coefficients of an octave that bounds the noise of gyros in motion: its power is then known to a
        /// few per cent.
        least_coefficients: usize = 512, "1", [8.0, 1e6];
        /// Least duration of rows to fit; below it not even the noise is estimable.
        least_fitted_s: f64 = 2.0, "s", [0.0, 1e5];
        /// Convergence limit of a vertical or a delay between passes.
        settled: f64 = 0.1, "σ", [1e-6, 10.0];
        /// Share of the motion's power that may lie above the edge of its band: 1e-5 of the angle.
        beyond_edge: f64 = 1e-10, "1", [1e-30, 0.1];
        /// Share of its mean error on held-out rows below which an accelerometer is reported as improved.
        improved: f64 = 0.99, "1", [0.0, 1.0];
    }
}
