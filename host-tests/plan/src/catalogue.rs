//! Catalogue of effects.

use crate::section::section;

section! {
    /// Thresholds of the catalogue of effects.
    CataloguePlan {
        /// Prior odds of the forms of an effect.
        odds: OddsPlan;
        /// Variation by which a channel identifies an effect.
        excitation: ExcitationPlan;
        /// Priors of effects that are no row of the catalogue.
        sizes: SizePlan;
        /// Share of an axis sensed by a gyro, times the root of the number of rows, up to which that axis' noise in the
        /// gyro's residual is negligible: the score of an absent effect is biased by some tenths of it.
        negligible_share: f64 = 2.0, "1", [0.0, 1e6];
        /// Upper edge of the band of a block's temperature; faster variation is noise of the converter.
        thermal_edge_hz: f64 = 0.5, "Hz", [1e-4, 1000.0];
    }
}

section! {
    /// Prior odds against the forms of an effect; their logarithms are prices.
    OddsPlan {
        /// One axis alone: one of six forms of a misfit.
        one_axis: f64 = 6.0, "1", [1.0, 1000.0];
        /// All three axes, the nine elements of a matrix, or their diagonal: half of all causes act on all three.
        shared: f64 = 2.0, "1", [1.0, 1000.0];
        /// One value for all three gyros, of a cause in front of all of them.
        common: f64 = 1.1, "1", [1.0, 1000.0];
        /// Error of the reference's rates, its misalignment and the rotation of the Earth excepted.
        of_reference: f64 = 1.2, "1", [1.0, 1000.0];
        /// Everyday errors, three times likelier than others.
        everyday: f64 = 1.0 / 3.0, "1", [1e-3, 1.0];
    }
}

section! {
    /// Least variation of a channel for an effect of its own.
    ExcitationPlan {
        /// Least span of a block's temperature: a smaller one is noise of the converter.
        least_span_k: f64 = 0.05, "K", [0.0, 100.0];
        /// Least root mean square of a rate about its mean: a rate that is the Earth's alone multiplies like a constant.
        least_rate_rad_s: f64 = 3e-5, "rad/s", [0.0, 1.0];
        /// Least span of a table's angle, times the order of a harmonic.
        least_angle_rad: f64 = 1.0, "rad", [0.0, 100.0];
        /// Hysteresis of a channel's sign and direction, relative to its root mean square about the mean: noise stays
        /// below.
        hysteresis: f64 = 0.1, "1", [0.0, 10.0];
    }
}

section! {
    /// Priors of the sizes of effects that are no row of the catalogue.
    SizePlan {
        /// Standard deviation of the prior of a flexure at resonance; a typical flexure is 7e-8 s².
        flexure_std_s2: f64 = 1e-4, "s²", [1e-12, 1.0];
        /// Standard deviation of the prior of an encoder's error of one order: eccentricity of a cheap one is a degree.
        harmonic_std_rad: f64 = 0.02, "rad", [1e-9, 10.0];
        /// Largest error of an encoder of one order: none reaches six degrees.
        harmonic_most_rad: f64 = 0.1, "rad", [1e-9, 10.0];
    }
}
