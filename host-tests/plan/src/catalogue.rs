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
        /// Grids of nonlinear parameters.
        grids: GridPlan;
        /// Experiments that may be proposed.
        table: RateTablePlan;
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

section! {
    /// Grids of nonlinear parameters; the best point is refined from its neighbours.
    GridPlan {
        /// Ratio of neighbouring time constants of a low pass: an octave; its response changes by a sixth at most.
        low_pass_ratio: f64 = 2.0, "1", [1.01, 10.0];
        /// Ratio of neighbouring time constants of a high pass: an octave.
        high_pass_ratio: f64 = 2.0, "1", [1.01, 10.0];
        /// Shortest time constant of a high pass: a shorter one is a differentiator.
        high_pass_least_rows: f64 = 10.0, "rows", [1.0, 1e6];
        /// Longest time constant of a high pass, as a share of the record: a longer one resembles drift.
        high_pass_longest_share: f64 = 0.25, "1", [0.01, 10.0];
        /// Ratio of neighbouring natural frequencies of a resonance: within the width of its response.
        resonance_ratio: f64 = 1.2, "1", [1.001, 10.0];
        /// Damping ratios of a resonance: from steel to rubber mounts, a factor of four apart.
        resonance_dampings: [f64; 4] = [0.01, 0.04, 0.15, 0.5], "1", [1e-4, 1.0];
        /// Ratio of neighbouring lock-in thresholds.
        lock_in_ratio: f64 = 1.25, "1", [1.001, 10.0];
        /// Time constants of lags: from a filter to a thermal mass.
        lags_s: [f64; 4] = [0.1, 0.4, 1.6, 6.4], "s", [1e-6, 1e5];
        /// Time constants of decays since the start: from switching on to a settled laser.
        decays_s: [f64; 6] = [1.0, 2.0, 4.0, 8.0, 16.0, 32.0], "s", [1e-6, 1e5];
        /// Highest order of an encoder's error: few a turn, eccentricity (1, 2), magnet poles and gear teeth up to some
        /// dozens.
        highest_order: usize = 72, "1", [1.0, 10000.0];
    }
}

section! {
    /// Rate table of the experiments that may be proposed.
    RateTablePlan {
        /// Rate of a spin: one turn a second, within reach of common rate tables.
        turn_rad_s: f64 = std::f64::consts::TAU, "rad/s", [0.01, 100.0];
        /// Rates of slews, as shares of that of a spin: three sizes separate a scale error from its dependence on the rate.
        slew_shares: [f64; 3] = [0.25, 0.5, 1.0], "1", [0.01, 1.0];
        /// Rate of the quarter turns of a tumble, as a share of that of a spin.
        tumble_share: f64 = 0.1, "1", [0.001, 1.0];
        /// Frequency of the faster oscillation: with its amplitude a peak acceleration of 49 rad/s².
        fast_hz: f64 = 5.0, "Hz", [0.1, 50.0];
        /// Amplitude of the faster oscillation.
        fast_rad: f64 = 0.05, "rad", [1e-6, 1.0];
        /// Amplitude of the oscillation at one turn a second: 10°, a peak acceleration of 7 rad/s².
        oscillation_rad: f64 = 0.175, "rad", [1e-6, 3.0];
        /// Duration of most moves, ramps included.
        move_s: f64 = 10.0, "s", [2.0, 1e5];
        /// Duration of a ramp: a ramp to one turn a second needs 14 rad/s².
        ramp_s: f64 = 1.0, "s", [1e-3, 1000.0];
        /// Duration of a still attitude.
        rest_s: f64 = 60.0, "s", [1.0, 1e5];
        /// Frequency of coning: with its angle a peak acceleration of 25 rad/s² at 1.6 rad/s.
        cone_hz: f64 = 2.5, "Hz", [0.01, 50.0];
        /// Half-angle of the cone.
        cone_rad: f64 = 0.1, "rad", [1e-6, 1.0];
        /// Temperature rise of the blocks in a cycle: within the range of most units.
        warming_k: f64 = 20.0, "K", [0.1, 200.0];
        /// Duration of a temperature cycle: a block follows within minutes.
        cycle_s: f64 = 3600.0, "s", [60.0, 1e6];
        /// Number of temperature cycles: a bias by time does not repeat in the second.
        cycles: usize = 2, "1", [1.0, 100.0];
    }
}
