//! Statement of a finding.

use crate::section::section;

section! {
    /// Thresholds of the statement of a finding.
    FindingsPlan {
        /// Estimable combinations of an effect's parameters.
        combinations: CombinationPlan;
        /// Noise of instruments.
        instruments: InstrumentNoisePlan;
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
