//! Statement of a finding.

use crate::section::section;

section! {
    /// Thresholds of the statement of a finding.
    FindingsPlan {
        /// Estimable combinations of an effect's parameters.
        combinations: CombinationPlan;
        /// Noise of instruments.
        instruments: InstrumentNoisePlan;
        /// Least significance of a value; a smaller one is counted and not listed, a smaller noise level has a bound.
        significant_deviations: f64 = 3.0, "σ", [0.0, 100.0];
        /// Matched-filter SNR at which a six-parameter effect is found with a probability of 0.9.
        needed_snr: f64 = 7.0, "1", [0.0, 1000.0];
        /// Largest difference of a resonance from the frequency implied by the static flexure, for one physics.
        own_mode_deviations: f64 = 3.0, "σ", [0.0, 100.0];
        /// Largest difference of equal values of two sensors: three equal values may have one cause outside them.
        equal_deviations: f64 = 3.0, "σ", [0.0, 100.0];
    }
}

section! {
    /// Criteria for the estimable combinations of an effect's parameters.
    CombinationPlan {
        /// Least anticorrelation of a gyro's two coefficients above which only their combination is estimable.
        anticorrelation: f64 = 0.5, "1", [0.0, 1.0];
        /// Ratio of posterior to prior standard deviation from which on the recording adds no information on a parameter.
        unknown: f64 = 0.5, "1", [0.0, 1.0];
        /// Least difference of a pair from zero that is reported in addition to its sum.
        apart: f64 = 3.0, "σ", [0.0, 1000.0];
    }
}

section! {
    /// Upper bounds of instrument noise; a residual above them is no noise.
    InstrumentNoisePlan {
        /// Largest angle random walk of a gyro, 10 °/√h: a phone's gyro has a fiftieth, the poorest vibrating gyros a third.
        most_walk_rad_sqrt_s: f64 = 2.9e-3, "rad/√s", [1e-9, 10.0];
        /// Largest white noise of an angle or attitude, gyro and reference together: 6°, three times that of a compass.
        most_angle_rad: f64 = 0.1, "rad", [1e-9, 10.0];
    }
}
