//! Faults of single channels and rows.

use crate::section::section;

section! {
    /// Detection of data faults.
    FaultPlan {
        /// Channels whose samples are held over several rows.
        hold: HoldPlan;
        /// Least share of held rows for the whole recording to be thinned: recorders start and stop.
        held_throughout: f64 = 0.9, "1", [0.0, 1.0];
        /// Least share of simultaneous samples on all held channels: one recorder wrote them.
        held_together: f64 = 0.95, "1", [0.0, 1.0];
        /// Largest ratio of unexplained variances, for samples to be means: mean since the last sample over the row itself.
        mean_leaves: f64 = 0.7, "1", [0.0, 1.0];
        /// Ends of a range.
        stops: StopPlan;
        /// Blocks of rows written twice.
        repeats: RepeatPlan;
        /// Moving-average length for the reference before a test of its change.
        smoothed_rows: usize = 5, "rows", [1.0, 1000.0];
        /// Least change of the reference in rows of one constant gyro value, as a share of that value.
        turned: f64 = 0.02, "1", [0.0, 1.0];
        /// Threshold of significance in standard deviations of a row of the reference.
        clear: f64 = 5.0, "σ", [1.0, 100.0];
        /// Share of rows equal to the row before, below which a channel is fine.
        fine: f64 = 0.01, "1", [0.0, 1.0];
        /// Single outliers.
        spikes: SpikePlan;
        /// Probability of a run of repeats anywhere in a channel below which it is a fault (significance level).
        run_chance: f64 = 1e-9, "1", [1e-30, 0.5];
        /// Repeat probability above which a channel is too coarse for the detection of a stuck one.
        most_by_chance: f64 = 0.9, "1", [1e-4, 0.999];
        /// Accumulation of samples at an extreme.
        clipping: ClippingPlan;
        /// Largest deviation of a gyro from a constant reference that it confirms, as a share of its motion: cross-axis
        /// errors and lags of a sound pair.
        confirmed: f64 = 0.1, "1", [0.0, 10.0];
        /// Guard rows on either side of a fault, for its edges.
        guard_rows: usize = 2, "rows", [0.0, 1000.0];
        /// Least share of silent rows among the other rows as slow as a silent run: a gyro in lock-in is silent there
        /// everywhere, a failed one in the run alone.
        silent: f64 = 0.9, "1", [0.0, 1.0];
        /// Largest number of single entries of one kind and channel: more are merged into one with their count.
        many: usize = 100, "1", [0.0, 1e6];
        /// Rows on either side of a run of repeats for the local repeat probability: at rest a coarse channel repeats itself
        /// more often than in motion.
        around_rows: usize = 200, "rows", [1.0, 1e6];
        /// Least repeat probability of a channel: its estimate from few repeats is uncertain.
        least_by_chance: f64 = 1e-4, "1", [1e-12, 0.5];
        /// Largest rate of the rows compared with a silent run, as a share of the fastest in the run: a gyro in lock-in is
        /// silent at all of them.
        slower: f64 = 0.5, "1", [0.0, 1.0];
        /// Time of the average that separates a gyro's motion from its noise, where it confirms a constant reference.
        confirmed_over_s: f64 = 0.1, "s", [0.0, 100.0];
        /// Samples at an extreme, against case and dither.
        extremes: ExtremePlan;
        /// Pulses of a coarse channel.
        pulses: ChannelPulsePlan;
        /// Short runs of repeats.
        short_holds: ShortHoldPlan;
    }
}

section! {
    /// Test of samples at a channel's extreme: those of a clipped gyro fall short of case and dither.
    ExtremePlan {
        /// Threshold of a mean shortfall in its standard errors.
        clear: f64 = 4.0, "σ", [0.0, 100.0];
        /// Largest residual of a usable prediction by case and dither, as a share of the samples.
        predicted: f64 = 0.25, "1", [0.0, 10.0];
        /// Least mean shortfall without a reference, as a share of the sample: beyond the error of a dither's gain.
        shortfall: f64 = 3e-3, "1", [0.0, 1.0];
        /// Rows searched for a neighbour below the extreme: two swings of a slow dither.
        near_rows: usize = 10, "rows", [1.0, 10000.0];
    }
}

section! {
    /// Pulses of a coarse channel.
    ChannelPulsePlan {
        /// Number of rows in which the most frequent value of a coarse channel occurs more than once on average: noise finer
        /// than a pulse repeats no value as often.
        often: usize = 100, "rows", [1.0, 1e6];
        /// Largest difference of a coarse gyro and its reference in agreement: one pulse for rounding, half for the noise of
        /// the other.
        agree: f64 = 1.5, "pulses", [0.0, 100.0];
        /// Upper limit of a single pulse at the ends of a silent stretch: a failed channel enters and leaves it by jumps.
        single: f64 = 1.5, "pulses", [1.0, 100.0];
    }
}

section! {
    /// Runs of repeats too short for rejection by chance alone, while gyro and reference diverge.
    ShortHoldPlan {
        /// Shortest run: two equal samples may be chance.
        least_rows: usize = 3, "rows", [2.0, 1000.0];
        /// Largest probability of such a run at a row that deviates.
        chance: f64 = 1e-4, "1", [1e-30, 0.5];
        /// Threshold of that row's deviation, as a share of that of a single outlier: five standard deviations suffice, as
        /// the run itself is rare.
        share: f64 = 5.0 / 8.0, "1", [0.0, 10.0];
    }
}

section! {
    /// Criteria of a clipped channel.
    ClippingPlan {
        /// Least count of the extreme value: the distribution of an unclipped channel tails off.
        least_rows: usize = 12, "rows", [1.0, 1e6];
        /// Least ratio of the count of the extreme value to that of the value next to it, for the same reason.
        over_next: usize = 6, "1", [1.0, 1000.0];
        /// Least returns to a limit: a channel stuck there returns less often.
        least_returns: usize = 5, "1", [0.0, 1e6];
        /// Largest gap between clipped rows of one stretch, and length of the window of a temporary limit: a dither returns
        /// to its stop within hundredths of it, a slew of the case seldom.
        together_s: f64 = 0.25, "s", [1e-3, 1000.0];
        /// Least cycles that end at a temporary limit within a window: a channel held at a level reaches it once.
        least_cycles: usize = 20, "1", [1.0, 1e6];
        /// Least number of windows with a temporary limit at the same level: extremes of a free channel differ.
        least_windows: usize = 2, "1", [1.0, 1000.0];
    }
}

section! {
    /// Criteria of a channel whose samples are held over several rows.
    HoldPlan {
        /// Least share of the runs between changes with a whole number of sample periods: a sample may be lost.
        regular: f64 = 0.95, "1", [0.0, 1.0];
        /// Least number of samples.
        least_readings: usize = 20, "1", [3.0, 1e6];
        /// Least median change between samples, in the smallest changes of the channel: a staircase takes steps of one.
        least_steps: f64 = 2.0, "1", [1.0, 1000.0];
        /// Largest deviation of a run from the mean: two asynchronous clocks.
        jitter_rows: usize = 1, "rows", [0.0, 100.0];
        /// Tolerance of a run's length beyond that jitter, for each of its samples: the mean period has an error.
        period_error_rows: f64 = 0.1, "rows", [0.0, 100.0];
    }
}

section! {
    /// Ends of a range: samples at a limit, and samples wrapped at one.
    StopPlan {
        /// Least magnitude on both sides of a jump, as a share of the largest sample: a wrap goes from one end to the other.
        near_end: f64 = 0.75, "1", [0.0, 1.0];
        /// Least jump over the 99 % quantile of the steps between rows: smaller ones may be motion.
        over_steps: f64 = 4.0, "1", [1.0, 1000.0];
        /// Least magnitude of a limit, as a share of the largest sample; a wrapped offset moves it inwards.
        limit: f64 = 0.5, "1", [0.0, 1.0];
        /// Least rows at a limit, more than chance repeats of one value of a fine channel.
        least_rows: usize = 12, "rows", [2.0, 1e6];
        /// Least length of a run of one value, against chance.
        least_run: usize = 3, "rows", [2.0, 1000.0];
        /// Largest share of the other rows equal to the row before.
        most_repeats: f64 = 0.1, "1", [0.0, 1.0];
        /// Largest share of wrapped rows: beyond it wrapped and regular rows are not distinguishable.
        most_wrapped: f64 = 0.45, "1", [0.0, 0.5];
    }
}

section! {
    /// Blocks of rows written twice.
    RepeatPlan {
        /// Probability of a block anywhere in the record below which it is a fault (significance level).
        chance: f64 = 1e-9, "1", [1e-30, 0.5];
        /// Least rows of a block.
        least_rows: usize = 8, "rows", [2.0, 1e6];
        /// Largest share of other equal rows at the block's own distance.
        periodic: f64 = 0.05, "1", [0.0, 1.0];
        /// Rows on either side of a block for the local probability of equal rows: a coarse gyro at rest repeats itself.
        around: usize = 200, "rows", [1.0, 1e6];
        /// Largest probability of equal rows: a coarser record repeats itself.
        most_alike: f64 = 0.9, "1", [0.0, 1.0];
        /// Distances of the compared rows for the probability of equal rows anywhere.
        distances: [usize; 8] = [1, 2, 3, 5, 11, 37, 101, 331], "rows", [1.0, 1e6];
        /// Largest distance of compared rows around a block: turns at a steady rate repeat a short pattern of counts.
        nearby: usize = 64, "rows", [1.0, 10000.0];
    }
}

section! {
    /// Criteria of a spike, of a rate or of an angle.
    SpikePlan {
        /// Threshold of a rate's deviation from its neighbours: a quarter of a million rows reach five.
        off: f64 = 10.0, "σ", [1.0, 1000.0];
        /// Threshold of an angle's deviation from its neighbours: a quarter of a million rows reach five.
        angle_off: f64 = 8.0, "σ", [1.0, 1000.0];
        /// Tolerance of the neighbours' deviation from that due to one outlier, as a share of the outlier.
        near: f64 = 0.25, "1", [0.0, 1.0];
        /// Rows of the scale estimate: a shaken unit scatters more.
        around: usize = 2000, "rows", [10.0, 1e7];
        /// Least number on one channel of rates: fewer may be jumps of an angle.
        least: usize = 3, "1", [1.0, 1e6];
        /// Largest share of the rows of a rate: more are the tail of the noise distribution.
        most: f64 = 1e-2, "1", [0.0, 1.0];
        /// Largest number of spikes of all angles as a share of the rows: more are the tail of the noise distribution.
        angle_most: f64 = 1e-3, "1", [0.0, 1.0];
        /// Smallest spike of an angle: in a nearly silent counter a single pulse to and fro is no outlier.
        angle_least: f64 = 2.5, "pulses", [0.0, 1000.0];
    }
}
