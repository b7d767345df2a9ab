//! Calibration of the flexure coefficients K, and the programme of motion that determines them.

use crate::section::section;

section! {
    /// Thresholds of a calibration. Its channels, noise and columns are those of a diagnosis.
    CalibrationPlan {
        /// Least duration of usable rows: below it not even the noise is estimable.
        least_s: f64 = 2.0, "s", [0.0, 1e5];
        /// K of real blocks (Cheng 2023, Tables 1 to 3: 0.67 to 1.5e-7). Recordings that determine no combination of the six
        /// to this standard deviation are refused.
        typical_s2: f64 = 1e-7, "s²", [1e-12, 1e-3];
        /// Limit of a combination's standard deviation, relative to `typical_s2` or to its own value: seven standard
        /// deviations from zero, so that neither sign nor size is in doubt.
        identifiable_share: f64 = 0.15, "1", [1e-4, 1.0];
        /// Share of the prior's standard deviation above which a parameter or direction counts as not informed by the data.
        uninformed_share: f64 = 0.5, "1", [1e-4, 1.0];
        /// Distance of flexure from zero, in standard deviations, that counts as seen. An elastic rate explains the
        /// recordings as well where flexure alone is seen, and is not beside that rate.
        separate_deviations: f64 = 5.0, "σ", [0.0, 100.0];
        /// Residual power over noise power above which a warning is given: with the 1e4 and more degrees of freedom of a
        /// rate reference a tenth is highly significant.
        most_power: f64 = 1.1, "1", [1.0, 1e6];
        /// Tolerance of that ratio for its own scatter: attitude samples have few degrees of freedom.
        power_deviations: f64 = 5.0, "σ", [0.0, 100.0];
        /// Priors of what is fitted beside K.
        prior: NuisancePlan;
        /// Agreement of the recordings.
        agreement: AgreementPlan;
        /// Proposed programmes.
        programme: ProgrammePlan;
    }
}

section! {
    /// Standard deviation of each recording's own parameters about the model. Wide against instruments, because it remains
    /// in force for unobserved parameters alone: attitude before and after coning shows neither scale nor delay unless the
    /// body also rotates in between.
    NuisancePlan {
        /// Bias: 20 °/h.
        gyro_bias_rad_s: f64 = 1e-4, "rad/s", [1e-12, 10.0];
        /// Scale error: a thousand ppm.
        gyro_scale: f64 = 1e-3, "1", [1e-9, 1.0];
        /// Installation error: half a degree.
        installation_rad: f64 = 1e-2, "rad", [1e-9, 1.0];
        /// Delay of a gyro: gyros of one clock are sampled within a fraction of a row of each other.
        gyro_delay_s: f64 = 1e-4, "s", [1e-12, 1.0];
        /// Error of a pickoff's gain.
        dither_gain: f64 = 1e-2, "1", [1e-9, 1.0];
        /// Rate of the Earth beside a reference that does not contain it: the whole.
        earth_rate_rad_s: f64 = 7.3e-5, "rad/s", [1e-12, 1e-3];
    }
}

section! {
    /// Test of whether all recordings are of one moving instrument.
    AgreementPlan {
        /// Largest difference of an installation error between recordings of one instrument: it stays within some 1e-5,
        /// that of another one differs by 1e-4 and more.
        installation_rad: f64 = 1e-4, "rad", [0.0, 1.0];
        /// The same of a scale error.
        gyro_scale: f64 = 1e-4, "1", [0.0, 1.0];
        /// Significance of one comparison, among the hundred of ten recordings.
        deviations: f64 = 6.0, "σ", [0.0, 100.0];
        /// p-value below which a recording's six K differ from those of all recordings.
        chance: f64 = 1e-9, "1", [1e-300, 0.5];
    }
}

section! {
    /// Grid and durations of a proposed programme.
    ProgrammePlan {
        /// Rates of a spin that are tried, as shares of the table's largest.
        spins: [f64; 6] = [1.0, 0.8, 0.6, 0.45, 0.3, 0.2], "1", [0.01, 1.0];
        /// Frequencies of a cone that are tried, over the one with rate and acceleration both at their limit: higher ones
        /// rectify less, but separate the line at twice their frequency from slow noise.
        cones: [f64; 5] = [1.0, 1.5, 2.0, 3.0, 5.0], "1", [0.1, 100.0];
        /// Number of turns over which a cone opens and closes.
        cone_turns: f64 = 3.0, "1", [0.1, 100.0];
        /// Factor between the table's limits and the motion's peaks, against rounding.
        margin: f64 = 1.02, "1", [1.0, 2.0];
        /// Grid of durations: whole rows at any row rate that is a multiple of 4 Hz.
        grid_s: f64 = 0.25, "s", [1e-3, 10.0];
        /// Rest at the start and at the end, for the bias alone and for an attitude sample.
        rest_s: f64 = 4.0, "s", [0.0, 1e4];
        /// Least duration at full motion of every variant: below it a programme is mostly ramps.
        least_plateau_s: f64 = 2.0, "s", [0.0, 1e4];
        /// Least share of the time: below it a move is not worth its ramps.
        least_share: f64 = 0.02, "1", [0.0, 0.5];
        /// Row rate of the prediction for each hertz of the fastest move: the column has twice its frequency, and is then
        /// flat to a thousandth over a row.
        rows_per_cycle: f64 = 40.0, "rows", [8.0, 1e4];
    }
}
