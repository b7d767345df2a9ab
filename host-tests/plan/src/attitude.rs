//! Gyros with an attitude reference.

use crate::section::section;

section! {
    /// Thresholds of a diagnosis against attitudes.
    AttitudePlan {
        /// Least number of stamps for an estimate of their noise; below, the noise is declared by the model or has a prior.
        least_stamps: usize = 40, "1", [4.0, 1e6];
        /// Median of the white noise of an attitude reference that the model does not declare, for rows too few to estimate
        /// it: optical tracking has 1e-4 to 1e-3, a camera 2e-3, a table or corner by hand up to 1e-2.
        undeclared_attitude_noise_rad: f64 = 1e-3, "rad", [1e-9, 1.0];
        /// Standard deviation of the logarithm of an undeclared noise level, for few rows.
        undeclared_log_std: f64 = 1.15, "1", [1e-3, 10.0];
        /// Share of the stamps, at the end, held out for validation.
        tested_share: f64 = 0.2, "1", [0.01, 0.9];
        /// Least gain in log likelihood, deflated by the design effect of blocks and less the price of the search.
        least_gain: f64 = 4.0, "nat", [0.0, 1000.0];
        /// Least gain in log likelihood of a physical effect in cross-validation over blocks.
        least_predicted: f64 = 4.0, "nat", [0.0, 1000.0];
        /// Largest deficit in log likelihood of a kind not distinguishable from the winner.
        alike_within: f64 = 5.0, "nat", [0.0, 1000.0];
        /// Least share of the best gain at which a registration group is a separate start.
        nearly: f64 = 0.5, "1", [0.0, 1.0];
        /// Most physical effects.
        most_effects: usize = 6, "1", [0.0, 100.0];
        /// Residual power on held-out rows, relative to the noise model, above which the record is not fully explained.
        most_power: f64 = 10.0, "1", [1.0, 1e6];
        /// Longest time between attitudes over which indistinguishable kinds transport gravity alike.
        unwatched_s: f64 = 2.0, "s", [0.0, 1000.0];
        /// Longest interval between the attitudes of a proposed experiment: a tenth of its turns.
        proposed_every_s: f64 = 0.1, "s", [0.01, 10.0];
        /// Initial delay and rotation.
        coarse: CoarseAttitudePlan;
        /// Faulty stamps of the reference.
        reference_faults: ReferenceFaultPlan;
        /// Jumps of the reference.
        reference_jumps: ReferenceJumpPlan;
        /// Failed stretches of the reference.
        failures: FailedReferencePlan;
        /// Frozen attitudes.
        held: FrozenReferencePlan;
        /// Rest of the case between turns.
        rest: RestBetweenPlan;
        /// Errors of single stamps.
        outliers: AttitudeOutlierPlan;
        /// Test of the attitudes' convention.
        conventions: ConventionPlan;
        /// Search for the settling of an attitude filter.
        settling: SettlingPlan;
        /// Search for automatic zeroing.
        zeroing: ZeroingPlan;
    }
}

section! {
    /// Criteria for another convention.
    ConventionPlan {
        /// Residual share of the turns' squares below which the declared convention is accepted.
        fits: f64 = 0.01, "1", [0.0, 1.0];
        /// Largest residual power of a better convention, relative to the declared one's: an attitude filter's own error is
        /// in both.
        better: f64 = 0.5, "1", [0.0, 1.0];
        /// Largest relative residual power of a better convention where the declared one has a plausible mount.
        far_better: f64 = 0.05, "1", [0.0, 1.0];
        /// Least rotation of an implausible mount.
        implausible_rad: f64 = 60.0 * std::f64::consts::PI / 180.0, "rad", [0.0, 4.0];
        /// Largest residual power of an equally good convention, relative to the best one's: another order of the
        /// components is the inverse between other constant rotations. Of these the one of the smallest mount is selected.
        as_well: f64 = 2.0, "1", [1.0, 1000.0];
    }
}

section! {
    /// Thresholds of the search for a settling.
    SettlingPlan {
        /// Shortest time constant in samples.
        least_samples: f64 = 6.0, "1", [1.0, 1000.0];
        /// Least length of the record in time constants.
        least_lengths: f64 = 3.0, "1", [1.0, 1000.0];
        /// Ratio of neighbouring time constants that are tried.
        step: f64 = 1.4, "1", [1.01, 10.0];
        /// Least gain in 2 ln L over no decay.
        least_gain: f64 = 50.0, "nat", [0.0, 1e6];
        /// Gain in 2 ln L that separates it from a decaying bias of the gyros.
        apart: f64 = 10.0, "nat", [0.0, 1e6];
        /// Largest share of the squares of the first two time constants that is left.
        left: f64 = 0.3, "1", [0.0, 1.0];
    }
}

section! {
    /// Thresholds of the search for automatic zeroing.
    ZeroingPlan {
        /// Time over which increments are summed: delays and noise matter less.
        block_s: f64 = 0.1, "s", [1e-4, 10.0];
        /// Largest share of the squares left without a high pass that one leaves.
        left: f64 = 0.3, "1", [0.0, 1.0];
    }
}

section! {
    /// Thresholds of the initial delay and rotation.
    CoarseAttitudePlan {
        /// Half-width of the search for the delay.
        reach_s: f64 = 0.6, "s", [0.01, 60.0];
        /// Least number of turns for an estimate of the delay.
        least_turns: usize = 8, "1", [2.0, 1e6];
        /// Most pieces of the record with a delay of their own: lost rows shift the later ones.
        most_pieces: usize = 8, "1", [1.0, 1000.0];
        /// Least number of turns in a piece with a delay of its own.
        least_turns_of_a_piece: usize = 64, "1", [2.0, 1e6];
        /// Most turns compared, to limit the effort.
        most_turns: usize = 4000, "1", [10.0, 1e7];
        /// Least angle between the fitted and the model's rotation at which the fitted one is used; below, the registration
        /// converges by itself.
        far_rad: f64 = 0.1, "rad", [0.0, 4.0];
        /// Least duration of a turn, to limit the effect of attitude noise.
        shortest_turn_s: f64 = 0.05, "s", [0.0, 10.0];
        /// Longest turn; longer ones span gaps.
        longest_turn_s: f64 = 1.5, "s", [0.01, 1000.0];
        /// Largest residual of the fitted rotation, relative to that of the model's: a motion about one axis does not
        /// determine the rotation about it.
        better_rotation: f64 = 0.5, "1", [0.0, 1.0];
        /// Largest shortfall of the correlation from 1 at another delay, relative to that at the model's: noise alone
        /// improves one delay slightly over another.
        better_delay: f64 = 0.9, "1", [0.0, 1.0];
    }
}

section! {
    /// Criteria for faulty stamps of the reference.
    ReferenceFaultPlan {
        /// Width of the running median.
        median_s: f64 = 0.6, "s", [0.001, 60.0];
        /// Least distance of a spike from the running median, relative to its neighbours'.
        spike: f64 = 12.0, "1", [1.0, 1e6];
        /// Least distance of a stamp adjacent to a spike, relative to its neighbours': a reference recovers gradually from a
        /// fault.
        shoulder: f64 = 4.0, "1", [0.0, 1e6];
        /// Largest distance in time of a stamp adjacent to a spike.
        joined_s: f64 = 0.1, "s", [0.0, 60.0];
        /// Duration of a stretch with a roughness of its own.
        stretch_s: f64 = 4.0, "s", [0.1, 1000.0];
        /// Least roughness of a rejected stretch, relative to the median of all and to that of similar motion.
        rough: f64 = 6.0, "1", [1.0, 1e6];
        /// Largest period of stamps for a running median.
        slow_s: f64 = 0.11, "s", [0.0, 60.0];
        /// Least number of stretches for a median.
        least_stretches: usize = 8, "1", [2.0, 1e6];
        /// Least rate of a stretch of similar motion, relative to that of the compared one: an error that grows with the
        /// rate is no fault.
        similar_rate: f64 = 0.5, "1", [0.0, 1.0];
    }
}

section! {
    /// Criteria for jumps of the reference.
    ReferenceJumpPlan {
        /// Most jumps: a reference with more is unusable.
        most: usize = 12, "1", [0.0, 1000.0];
        /// Least gain in log evidence of a jump over noise, less the price of its position.
        least_gain: f64 = 10.0, "nat", [0.0, 1000.0];
        /// Least ratio of the statistic of a jump to that of the largest row without one.
        apart: f64 = 4.0, "1", [1.0, 1e6];
        /// Half-width of the window of local roughness.
        around_rows: usize = 20, "rows", [1.0, 1e6];
    }
}

section! {
    /// Criteria for stretches in which the reference failed.
    FailedReferencePlan {
        /// Least rate of an impossible step, relative to the fastest that the gyros sensed.
        faster: f64 = 3.0, "1", [1.0, 1e6];
        /// Least rate of an impossible step, relative to the median step of the reference: its noise is no turn.
        unusual: f64 = 10.0, "1", [1.0, 1e6];
        /// Longest time between impossible steps of one stretch.
        joined_s: f64 = 1.0, "s", [0.0, 1000.0];
        /// Least number of impossible steps of a stretch: fewer are spikes or jumps.
        least_steps: usize = 5, "1", [1.0, 1e6];
    }
}

section! {
    /// Criteria for frozen attitudes.
    FrozenReferencePlan {
        /// Least number of consecutive equal attitudes.
        least_equal: usize = 3, "1", [2.0, 1e6];
        /// Least angle between gyros and reference over a frozen span, as a multiple of the 90th percentile of spans
        /// elsewhere.
        apart: f64 = 6.0, "1", [1.0, 1e6];
    }
}

section! {
    /// Criteria for rest of the case between turns.
    RestBetweenPlan {
        /// Duration of a window.
        window_s: f64 = 0.25, "s", [0.001, 60.0];
        /// Least number of rows of a window.
        least_rows: usize = 16, "rows", [2.0, 1e6];
        /// Largest variance about the mean of a window at rest, relative to that between neighbours: white noise has both
        /// alike.
        white: f64 = 2.0, "1", [1.0, 1e6];
        /// Largest variance of a window at rest, relative to that of the quietest windows.
        quiet: f64 = 4.0, "1", [1.0, 1e6];
        /// Tolerance of equal means in standard deviations, the Earth's rate included.
        agree: f64 = 4.0, "1", [0.0, 1000.0];
    }
}

section! {
    /// Criteria for errors of single stamps.
    AttitudeOutlierPlan {
        /// Least size of an outlier in standard deviations; the excess is subtracted.
        beyond: f64 = 4.0, "1", [1.0, 1000.0];
    }
}
