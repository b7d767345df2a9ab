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
        /// Largest share of a number that a second fit, from the model with it, may find again: more is no convergence.
        found_again: f64 = 0.5, "1", [0.0, 10.0];
        /// Least significance of a number and of what a second fit finds of it again.
        found_again_deviations: f64 = 3.0, "σ", [1.0, 100.0];
        /// Largest number of passes of motion, columns and search.
        passes: usize = 8, "1", [1.0, 1000.0];
        /// Largest number of events of a fit that are tried.
        events_tried: usize = 3, "1", [1.0, 1000.0];
        /// Number of impulses of a gyro at which they are no slips: another effect is unexplained.
        most_slips: usize = 32, "1", [2.0, 10000.0];
        /// Lower edge of the lowest tested octave: coefficients enough besides the fitted biases and slow shapes.
        misfit_first: usize = 8, "1", [1.0, 1e6];
        /// Quantisation of gyros without a dither.
        lattice: LatticePlan;
        /// Location of a residual beyond its noise.
        tiles: TilePlan;
        /// Stretches of like motion.
        regimes: RegimePlan;
        /// Figures on held-out rows.
        held_out: HeldOutPlan;
        /// Proposal of a next experiment.
        experiment: ExperimentPlan;
        /// Monte Carlo self-test.
        self_test: SelfTestPlan;
        /// Causes of channels in other units, and of two different motions.
        channels: ChannelCausePlan;
    }
}

section! {
    /// Criteria for the pulses of a gyro without a dither, and for effects masked by them.
    LatticePlan {
        /// Ratio to the declared pulse beyond which a pulse is another instrument's.
        coarser: f64 = 1.5, "1", [1.0, 1000.0];
        /// Largest distance of the values from their lattice, as a share of a pulse.
        off_share: f64 = 1e-3, "1", [1e-9, 0.5];
        /// Largest share of values off the lattice: values bridged over gaps are not multiples.
        bridged_share: f64 = 0.01, "1", [0.0, 1.0];
        /// Largest root mean square of a masked angle: an error of up to one pulse has half a pulse at most.
        hidden_pulses: f64 = 0.6, "pulses", [0.0, 10.0];
        /// Least jump that is a slip: slips are whole pulses, and the error is up to one; nearer to one than to two.
        slip_pulses: f64 = 1.5, "pulses", [0.0, 10.0];
        /// Shortest run of equal values where pulses are rare.
        rare_rows: usize = 20, "rows", [2.0, 1e6];
        /// Inverse of the least share of the rows in such runs.
        rare_one_in: usize = 10, "1", [1.0, 1000.0];
        /// Least share of a pulse's square that is not in the model for a finding.
        unknown_share: f64 = 0.2, "1", [0.0, 1.0];
        /// Share of the angle noise of counting, below which values on multiples of a unit are rounded and not counted.
        counted_share: f64 = 0.25, "1", [0.0, 1.0];
        /// Largest rounding error of a difference of two written values, with a margin.
        written_off_units: f64 = 1.5, "units", [0.5, 100.0];
        /// Least step of written values that is no rounding of equal ones.
        written_step_units: f64 = 2.5, "units", [1.0, 100.0];
        /// Smallest written pulse: a smaller one is not distinguishable from noise written in these units.
        written_pulse_units: f64 = 20.0, "units", [1.0, 1e6];
    }
}

section! {
    /// Tiles of time, band and channel in which the residual is tested.
    TilePlan {
        /// Probability of at least one falsely located tile per recording (family-wise error rate).
        significance: f64 = 1e-4, "1", [1e-12, 0.5];
        /// Longest tile.
        longest_s: f64 = 6.0, "s", [0.01, 1e5];
        /// Edges between the bands, ascending: half decades, with the dither band on its own.
        edges_hz: [f64; 7] = [1.0, 3.0, 10.0, 30.0, 100.0, 300.0, 600.0], "Hz", [1e-6, 1e6];
        /// Shortest tile: fewer rows have no bands.
        least_rows: usize = 64, "rows", [4.0, 1e6];
        /// Shortest run of usable rows: a joint costs about as many rows of information at its free jump.
        least_run_rows: usize = 64, "rows", [4.0, 1e6];
    }
}

section! {
    /// Stretches of like motion, and the size of a finding in each.
    RegimePlan {
        /// Length of a stretch in a recording without named segments.
        unnamed_s: f64 = 5.0, "s", [0.01, 1e5];
        /// Largest number of stretches at rest: few, so that each has many periods of a drift.
        most_at_rest: usize = 16, "1", [1.0, 10000.0];
        /// Smallest size of an effect in a regime that determines its amplitude.
        least_snr: f64 = 3.0, "σ", [0.0, 100.0];
        /// Smallest information on an effect per row of a regime, as a share of the strongest regime's: below it, noise of
        /// the reference dominates its columns.
        least_share: f64 = 1e-2, "1", [0.0, 1.0];
    }
}

section! {
    /// Figures on held-out rows.
    HeldOutPlan {
        /// Least width of an evaluated band: as many bins resolve a tenth of power by four standard deviations.
        least_bins: usize = 1600, "bins", [1.0, 1e9];
        /// Largest number of stretches: each costs a free jump, and the work grows with the square of their number.
        most_stretches: usize = 40, "1", [1.0, 10000.0];
        /// Least number of rows.
        least_rows: usize = 64, "rows", [4.0, 1e6];
    }
}

section! {
    /// Criteria for the next experiment.
    ExperimentPlan {
        /// Longest duration of a repeated experiment: an hour at the table.
        longest_s: f64 = 3600.0, "s", [1.0, 1e6];
        /// Standard deviations of a log ratio allowed for chance.
        chance: f64 = 2.0, "σ", [0.0, 10.0];
        /// Largest ratio of the predicted standard deviations to the present ones: an experiment halves them at least.
        worthwhile: f64 = 0.5, "1", [0.0, 1.0];
    }
}

section! {
    /// Trials of the Monte Carlo self-test.
    SelfTestPlan {
        /// Number of draws of noise: no false name among 200 bounds the rate to 1.5 % with 95 % confidence.
        draws: usize = 200, "1", [1.0, 1e6];
        /// Matched-filter SNR of the injected effects: from seldom to always detected.
        strengths: [f64; 4] = [4.0, 6.0, 8.0, 10.0], "1", [0.0, 1000.0];
        /// Number of injected effects of each kind at each strength.
        each: usize = 2, "1", [1.0, 10000.0];
    }
}

section! {
    /// Criteria for the cause of a gross factor, and for the words on gyros and reference of different motions.
    ChannelCausePlan {
        /// Largest relative difference between a factor and its cause, by scale errors.
        near_cause: f64 = 0.02, "1", [0.0, 0.5];
        /// Factors that are settings of a sensor's range and no other unit.
        settings: [f64; 4] = [2.0, 4.0, 8.0, 16.0], "1", [1.0, 1000.0];
        /// Largest relative difference between factors of one cause.
        one_cause: f64 = 0.05, "1", [0.0, 0.5];
        /// Least share explained at a lag beyond any delay, for another piece of the same motion.
        other_piece: f64 = 0.8, "1", [0.0, 1.0];
        /// Largest share explained without that lag, relative to the share with it, for another piece of the same motion.
        here_over_there: f64 = 0.5, "1", [0.0, 1.0];
    }
}
