//! A unit at rest.

use crate::section::section;

section! {
    /// Thresholds of a unit at rest.
    RestPlan {
        /// Lines.
        lines: LinePlan;
        /// Bands of noise.
        bands: BandPlan;
        /// Removal of steady lines before the noise is fitted.
        steady: SteadyPlan;
        /// Cycles of the noise's power.
        cycle: CyclePlan;
        /// Sums of rows for slow effects.
        summing: SummingPlan;
        /// First coefficient above slow effects, from which increments are tested for a bounded angle.
        bounded_first: usize = 32, "1", [1.0, 1e6];
        /// Least deficit of an octave below an even share of power for increments of a bounded angle, as counting makes.
        bounded_deficit: f64 = 4.0, "σ", [0.0, 100.0];
        /// Significance level of a difference of the row rate by the stamps from the nominal one.
        row_rate_chance: f64 = 1e-4, "1", [1e-12, 0.5];
        /// Convergence limit of the Earth's rotation, over the standard deviation of a mean rate.
        settled: f64 = 0.1, "σ", [1e-6, 10.0];
        /// Size up to which an effect of the input explains a constant rate, in standard deviations of the prior on its size:
        /// beyond any unit.
        alike_deviations: f64 = 3.0, "σ", [0.0, 100.0];
    }
}

section! {
    /// Criteria for the removal of steady lines from a residual: coefficients far above their neighbours.
    SteadyPlan {
        /// First coefficient tested: lower ones are those of drift, steps and temperature.
        first: usize = 32, "1", [2.0, 1e6];
        /// Number of neighbours on either side for the median power about a coefficient.
        beside: usize = 24, "1", [1.0, 1e6];
        /// Power over the neighbours' median above which a coefficient is no noise: false-alarm probability 1e-10 a
        /// coefficient.
        far_out: f64 = 90.0, "1", [1.0, 1e6];
    }
}

section! {
    /// Criteria for cycles of the noise's power, the trace of a resampling.
    CyclePlan {
        /// Significance level of a cycle, trials counted.
        cycle_chance: f64 = 1e-4, "1", [1e-12, 0.5];
        /// Longest cycle: rates in use have ratios of small whole numbers.
        longest_rows: usize = 8, "rows", [2.0, 1000.0];
        /// Number of neighbouring frequencies for the chance power.
        neighbours: usize = 24, "1", [2.0, 10000.0];
        /// Limit of a squared value over the median power: normal noise is beyond once in 1500.
        jolt: f64 = 25.0, "1", [1.0, 1e6];
        /// Least power over the mean: no noise falls below it.
        least_power: f64 = 0.05, "1", [1e-6, 1.0];
    }
}

section! {
    /// Sums of rows for slow effects, if the residual deviates from noise.
    SummingPlan {
        /// Number of rows summed to one at a time.
        summed: usize = 4, "rows", [2.0, 1000.0];
        /// Least number of rows that are left: six octaves of noise.
        least_rows: usize = 512, "rows", [16.0, 1e9];
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
        /// Number of lines with products: each dither and a converter or two.
        fundamentals: usize = 5, "1", [0.0, 100.0];
        /// Highest order of a product; each further order adds chance coincidences.
        highest_order: usize = 3, "1", [1.0, 10.0];
    }
}

section! {
    /// Criteria for bands of noise of a unit at rest.
    BandPlan {
        /// False-alarm probability of a band, all places and widths counted.
        chance: f64 = 1e-4, "1", [1e-12, 0.5];
        /// Least half-width of a window in quarters of the record's resolution: narrower features are lines.
        least_half_width: usize = 8, "1", [1.0, 1e6];
        /// Half-width of the neighbourhood of a window in half-widths of the window.
        around: usize = 8, "1", [5.0, 1000.0];
        /// Half-width of the guard between neighbourhood and window in half-widths of the window: the flanks of a band are
        /// not its neighbourhood.
        guard: usize = 2, "1", [1.0, 4.0];
        /// Half-width of the region in which the shape is fitted in half-widths of the window: the level beside the band is
        /// fitted with it.
        reach: usize = 12, "1", [1.0, 1000.0];
        /// Least ratio of frequency to width: broader excess belongs to the noise terms.
        least_quality: f64 = 5.0, "1", [0.1, 1000.0];
        /// Least gain in log likelihood of a band on one gyro.
        naming: f64 = 8.0, "nat", [0.5, 1000.0];
        /// Largest number of bands.
        most: usize = 16, "1", [0.0, 1000.0];
    }
}
