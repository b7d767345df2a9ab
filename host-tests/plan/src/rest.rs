//! A unit at rest.

use crate::section::section;

section! {
    /// Thresholds of a unit at rest.
    RestPlan {
        /// Lines.
        lines: LinePlan;
        /// Bands of noise.
        bands: BandPlan;
    }
}

section! {
    /// Criteria for lines of a unit at rest.
    LinePlan {
        /// False-alarm probability of a line, all frequencies counted.
        chance: f64 = 1e-4, "1", [1e-12, 0.5];
        /// Least share of a line's power explained by one phase: below a half, its prediction adds power.
        coherence: f64 = 0.5, "1", [0.0, 1.0];
        /// Number of pieces of the record whose phases are compared.
        pieces: usize = 8, "1", [2.0, 1000.0];
        /// Highest degree of the phase polynomial: frequency, its drift, and faster wander.
        most_degrees: usize = 10, "1", [1.0, 100.0];
        /// Half-width of a line in resolutions of the record.
        own_resolutions: f64 = 2.0, "1", [0.5, 100.0];
        /// Largest number of lines: beyond it a spectrum is no set of lines.
        most: usize = 48, "1", [0.0, 1000.0];
    }
}

section! {
    /// Criteria for bands of noise of a unit at rest.
    BandPlan {
        /// False-alarm probability of a band, all places and widths counted.
        chance: f64 = 1e-4, "1", [1e-12, 0.5];
        /// Least half-width of a window in quarters of the record's resolution: narrower features are lines.
        least_half_width: usize = 8, "1", [1.0, 1e6];
        /// Least ratio of frequency to width: broader excess belongs to the noise terms.
        least_quality: f64 = 5.0, "1", [0.1, 1000.0];
        /// Least gain in log likelihood of a band on one gyro.
        naming: f64 = 8.0, "nat", [0.5, 1000.0];
        /// Largest number of bands.
        most: usize = 16, "1", [0.0, 1000.0];
    }
}
