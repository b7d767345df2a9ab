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
        /// Least delay of a single gyro, beyond the median of all, for which its rows are moved.
        late_gyro: f64 = 3.0, "σ", [0.0, 100.0];
        /// Wiener filter of the gyros' motion.
        conditioning: ConditioningPlan;
        /// Rows of the likelihood, between stamps.
        rows: AttitudeRowsPlan;
        /// Noise of the rows.
        noise: AttitudeNoisePlan;
        /// Alternatives of the registration.
        registration: RegistrationPlan;
        /// Statistics of the record's blocks.
        blocks: AttitudeBlockPlan;
        /// Rotation of the Earth in the gyros.
        earth: EarthPlan;
        /// Attitudes too few for an estimate of their noise.
        few: FewAttitudesPlan;
        /// Validation on held-out stamps.
        held_out: AttitudeHeldOutPlan;
        /// Rates sampled at instants.
        instants: InstantPlan;
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
        /// Most consecutive stamps of a spike; a longer span is a dropout.
        spike_stamps: usize = 3, "1", [0.0, 1e6];
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

section! {
    /// Thresholds of the Wiener filter of the gyros' motion, and of the estimate of their white noise.
    ConditioningPlan {
        /// Longest segment of the averaged periodogram, and longest extension of the record at its ends.
        piece_rows: usize = 4096, "rows", [64.0, 1e6];
        /// Ratio of the edges of a bin, in which the lines of the periodogram are averaged.
        bin_ratio: f64 = 1.12, "1", [1.001, 10.0];
        /// Duration of the linear predictor that extends the record.
        predicted_by_s: f64 = 0.25, "s", [1e-3, 60.0];
        /// Least and largest order of that predictor.
        predictor_orders: [usize; 2] = [16, 256], "1", [1.0, 10000.0];
        /// Largest relative standard deviation of a bin's power for the estimate of white noise.
        known: f64 = 0.25, "1", [1e-3, 10.0];
        /// Frequency above which white noise of angle is determined: motion masks it below.
        high_per_row: f64 = 0.25, "1/row", [0.0, 0.49];
        /// Allowance for the scatter of a bin of noise about its mean: a bin of few lines lies below it by chance.
        scatter: f64 = 4.0, "σ", [0.0, 100.0];
        /// Factor of the noise above its estimate, as the least of many averaged powers lies below their mean.
        margin: f64 = 1.5, "1", [1.0, 100.0];
    }
}

section! {
    /// Criteria for gaps and ends of the rows between stamps.
    AttitudeRowsPlan {
        /// Least duration of a gap, in typical periods of the stamps.
        gap_periods: f64 = 3.5, "1", [1.0, 1000.0];
        /// Most gaps with free rows, the longest first: each costs three unknowns.
        most_gaps: usize = 24, "1", [0.0, 10000.0];
        /// Gyro rows at each end of the record that lack neighbours; stamps in them are dropped if stamps are many.
        end_rows: usize = 2, "rows", [0.0, 1000.0];
        /// Largest number of stamps, and of rows between them, of which none is dropped.
        short: usize = 128, "1", [2.0, 1e6];
        /// Number of steps between stamps per longest step that is excluded from their mean as a gap.
        gap_among: usize = 50, "1", [2.0, 1e6];
        /// Ratio of median to mean step below which stamps come in bursts, with the mean as typical period.
        burst: f64 = 0.5, "1", [0.0, 1.0];
        /// Most lost gyro rows bridged by linear interpolation; stamps in a longer gap have no motion to compare with.
        bridged_rows: usize = 2, "rows", [0.0, 1000.0];
        /// Least difference between the angles of gyros and reference from one attitude to the next for doubtful rows, as a
        /// multiple of the differences' 90th percentile.
        doubtful: f64 = 6.0, "1", [1.0, 1e6];
    }
}

section! {
    /// Thresholds of the noise of rows.
    AttitudeNoisePlan {
        /// Analysed band.
        band: AttitudeBandPlan;
        /// Width of a bin, relative to its frequency.
        bin: f64 = 0.08, "1", [1e-3, 1.0];
        /// Time constants of the Ornstein-Uhlenbeck terms: half decades, from a filter's to a slow drift's.
        return_times_s: [f64; 6] = [0.1, 0.3, 1.0, 3.0, 10.0, 30.0], "s", [1e-6, 1e5];
        /// Time constant of the single Ornstein-Uhlenbeck term of the reduced model, in the first passes: the middle of
        /// those.
        plain_time_s: f64 = 1.0, "s", [1e-6, 1e5];
        /// Weight of a declared random walk, in coefficients of three records: its level may be half or twice the declared
        /// one.
        declared_weight: f64 = 1.5, "1", [0.0, 1e6];
        /// Modulation of the levels along the record.
        modulation: ModulationPlan;
    }
}

section! {
    /// Limits of the analysed band and of its octaves.
    AttitudeBandPlan {
        /// Highest analysed frequency: hands, vehicles and shakers of attitudes move below.
        highest_hz: f64 = 10.0, "Hz", [0.01, 1e5];
        /// Least number of analysed coefficients, for a record too short for that frequency.
        least: usize = 64, "1", [2.0, 1e6];
        /// Least number of coefficients in the lowest octave.
        least_of_octave: usize = 8, "1", [2.0, 1e6];
        /// Most octaves above the lowest one.
        most_octaves: usize = 12, "1", [0.0, 40.0];
    }
}

section! {
    /// Criteria for a modulation of the noise along the record.
    ModulationPlan {
        /// Least gain in log evidence over a single level: two more parameters, the prior's width and the pieces' length.
        least_gain: f64 = 4.0, "nat", [0.0, 1000.0];
        /// Lengths of a piece that are tried, in shortest ones.
        lengths: [usize; 6] = [1, 2, 4, 8, 16, 32], "1", [1.0, 1e6];
        /// Least number of pieces for an estimate of the prior.
        least_pieces: usize = 6, "1", [2.0, 1e6];
        /// Least number of values in the shortest pieces.
        least_values: usize = 6, "1", [1.0, 1e6];
    }
}

section! {
    /// Criteria for alternatives of the registration.
    RegistrationPlan {
        /// Least delay of the gyros for a low pass, and least smoothing variance of the reference against one.
        low_pass_seen: f64 = 5.0, "σ", [0.0, 100.0];
        /// Largest negative time constant of a possible low pass.
        low_pass_negative: f64 = 3.0, "σ", [0.0, 100.0];
        /// Prior standard deviation of a low pass's time constant about the model's: attitude filters have tens of
        /// milliseconds.
        low_pass_std_s: f64 = 0.05, "s", [1e-6, 100.0];
        /// Time constants of a low pass that are tried, relative to the gyros' lag: rectified vibration is not linear far
        /// from the likeliest one.
        low_pass_shares: [f64; 11] = [0.15, 0.25, 0.4, 0.55, 0.7, 0.85, 1.0, 1.15, 1.3, 1.6, 2.0], "1", [1e-3, 100.0];
        /// Largest step of any parameter at convergence.
        settled: f64 = 0.1, "σ", [1e-6, 10.0];
        /// Largest difference of any parameter between coinciding alignments, to which two starts lead.
        same_alignment: f64 = 3.0, "σ", [0.0, 100.0];
    }
}

section! {
    /// Thresholds of the statistics of a record's blocks.
    AttitudeBlockPlan {
        /// Duration of a block.
        length_s: f64 = 6.0, "s", [1e-3, 1e5];
        /// Least number of blocks, however short.
        least: usize = 15, "1", [2.0, 100000.0];
        /// Least number of whitened rows in a block.
        least_rows: usize = 4, "rows", [1.0, 1e6];
        /// Prior degrees of freedom of a design effect: in the registration of two real recordings (docs/real-recordings.md)
        /// it lies from 1.3 to 2.1, within a factor of 1.4 about the mean, √(2/20) of the logarithm.
        believed_degrees: f64 = 20.0, "1", [0.0, 1e6];
        /// Prior probability of any of the groups or effects of a search, shared equally among them.
        any_chance: f64 = 0.3, "1", [1e-6, 1.0];
        /// Number of instants of the first grid for a step of a bias, which refinements follow.
        step_instants: usize = 40, "1", [2.0, 1e6];
        /// Number of cosine terms over the record of a smooth drift, the rival of a step of a bias.
        drift_waves: usize = 6, "1", [1.0, 1000.0];
    }
}

section! {
    /// Criteria for the Earth's rotation in the gyros.
    EarthPlan {
        /// Largest deviation of a row from the median of its axis for the slow rates: a jump is further off.
        outlier: f64 = 6.0, "σ", [1.0, 1000.0];
        /// Tolerance of a rate longer than the Earth's rotation.
        possible: f64 = 3.0, "σ", [0.0, 100.0];
        /// Largest standard deviation of the rotation, as a share of its length, at which the known length is not used.
        known: f64 = 0.1, "1", [0.0, 10.0];
    }
}

section! {
    /// Thresholds for attitudes too few for an estimate of their noise.
    FewAttitudesPlan {
        /// Least number of sums of gyro rows for the quartile from which the random walk is estimated.
        least_sums: usize = 64, "1", [4.0, 1e6];
        /// Least posterior weight of a noise level that is kept.
        least_weight: f64 = 1e-4, "1", [0.0, 0.1];
        /// Prior standard deviation of a constant rate of the case during the assumed rest, as of a table.
        turning_std_rad_s: f64 = 1.0, "rad/s", [1e-6, 1000.0];
    }
}

section! {
    /// Thresholds of the validation on held-out stamps.
    AttitudeHeldOutPlan {
        /// Least number of held-out rows for a spectrum.
        least_rows: usize = 16, "rows", [4.0, 1e6];
        /// Smallest and largest ratio of held-out to fitted noise power for one level of both.
        same_level: [f64; 2] = [0.5, 2.0], "1", [1e-3, 1000.0];
        /// Smallest and largest ratio of the squared drift after the diagnosis to that before for an unchanged drift.
        same_drift: [f64; 2] = [0.9, 1.1], "1", [1e-3, 1000.0];
    }
}

section! {
    /// Criteria for rates sampled at the end of each row and read as means over it.
    InstantPlan {
        /// Tolerance of the delay about half a row: an instant is half a row late only if the motion is slow.
        delay_rows: f64 = 0.03, "rows", [0.0, 0.5];
        /// Tolerance of the smoothing about that of a row.
        smoothing: f64 = 3.0, "σ", [0.0, 100.0];
    }
}
