//! Preparation of the recorded channels.

use crate::faults::FaultPlan;
use crate::section::section;

section! {
    /// Thresholds of alignment, data faults, partition and motion.
    SignalPlan {
        /// Channels on the gyros' rows.
        align: AlignPlan;
        /// Samples of an attitude reference.
        attitude_samples: AttitudeSamplePlan;
        /// Faults of single channels and rows.
        faults: FaultPlan;
        /// Rows lost without a gap in the stamps.
        lost_rows: LostRowsPlan;
        /// Comparison of axes, signs and units.
        channels: ChannelPlan;
        /// Test for one motion of gyros and reference.
        same_motion: SameMotionPlan;
        /// Partition of the rows: fitted, tested.
        partition: PartitionPlan;
        /// Measurement of the reference's noise.
        reference_noise: ReferenceNoisePlan;
        /// Gate of the reference's motion.
        gate: GatePlan;
        /// Lines of the gyros alone.
        own_lines: OwnLinesPlan;
        /// Residual in step with the motion.
        in_step: InStepPlan;
        /// Coherence of reading and prediction.
        coherence: CoherencePlan;
    }
}

section! {
    /// Alignment of the channels on the gyros' rows.
    AlignPlan {
        /// Largest share of gaps in a slow quantity: beyond it, masking costs more than the channel explains.
        most_gaps: f64 = 0.3, "1", [0.0, 1.0];
        /// Largest distance between samples of a slow quantity, in its periods, for interpolation: single samples may be lost.
        gap_periods: f64 = 3.5, "1", [1.0, 1000.0];
        /// Longest gap of the reference across which its attitude is continued: the motion within a longer one is unknown,
        /// and linear interpolation across it leaves a permanent attitude error.
        bridged_rows: usize = 2, "rows", [0.0, 1000.0];
        /// Share of the rows of a unit at rest, from the first, for the estimate of the Earth's rotation: rows to be held out
        /// are excluded.
        rest_share: f64 = 0.5, "1", [0.01, 1.0];
        /// Accelerometers on rows of their own.
        accelerometers: AccelerometerRowsPlan;
    }
}

section! {
    /// Rows of the accelerometers.
    AccelerometerRowsPlan {
        /// Highest row rate after summation: gravity in a turning case varies no faster.
        fastest_hz: f64 = 1000.0, "Hz", [1.0, 1e6];
        /// Least number of rows within the gyros' span: noise and errors of fewer are not separable.
        least_rows: usize = 128, "rows", [2.0, 1e6];
    }
}

section! {
    /// Criteria of an attitude sample.
    AttitudeSamplePlan {
        /// Largest deviation of a quaternion's norm from 1: four printed places or single precision keep it below; larger
        /// ones are no attitude.
        norm_error: f64 = 1e-3, "1", [1e-12, 1.0];
        /// Norm below which a quaternion stands for no attitude, as written by some recorders.
        no_attitude: f64 = 1e-6, "1", [0.0, 0.5];
    }
}

section! {
    /// Rows lost without a gap in the stamps.
    LostRowsPlan {
        /// Largest lag of the search.
        reach_s: f64 = 2.5, "s", [0.0, 1000.0];
        /// Length of a stretch.
        stretch_s: f64 = 3.0, "s", [0.01, 1e5];
        /// Least and largest number of stretches.
        stretches: [usize; 2] = [8, 64], "1", [1.0, 100000.0];
        /// Largest number of rows of the coarse search, by averaging.
        most_rows: usize = 1 << 15, "rows", [1000.0, 1e9];
        /// Largest residual variance of a stretch at its best lag, as a share of its variance.
        most_left: f64 = 0.5, "1", [0.0, 1.0];
        /// Residual variance over the least one, up to which a lag is not distinguishable from the best.
        other: f64 = 2.0, "1", [1.0, 1000.0];
        /// Number of agreeing stretches required on either side.
        agreeing: usize = 2, "1", [1.0, 1000.0];
        /// Largest deviation of a lag from those of its side, as a share of the difference of both sides.
        spread: f64 = 0.2, "1", [0.0, 1.0];
        /// Largest number of gyro rows per sample of the reference: with more, lost rows cannot be counted.
        most_rows_a_reading: f64 = 5.0, "rows", [1.0, 1000.0];
        /// Largest number of restored gaps: a recording with more cannot be restored.
        most_gaps: usize = 8, "1", [0.0, 10000.0];
        /// Least number of rows of a stretch: its map has nine coefficients.
        least_rows: usize = 16, "rows", [4.0, 1e6];
    }
}

section! {
    /// Comparison of the gyros' axes, signs and units with the reference's.
    ChannelPlan {
        /// Estimation of the map.
        map: MapPlan;
        /// Largest rotation of an ordinary tilt: installations and misalignments are sought to 0.3 rad.
        tilt_rad: f64 = 0.35, "rad", [0.0, 4.0];
        /// Smallest and largest factor of an ordinary scale error.
        scale: [f64; 2] = [0.5, 2.0], "1", [1e-3, 1000.0];
        /// Relative error by noise and other effects of a factor on a bound.
        allowance: f64 = 0.02, "1", [0.0, 1.0];
        /// Largest variation over frequency of a gyro's gain, as a share of its power, still consistent with one factor: a
        /// tenth of the gain is a hundredth of the power.
        uneven: f64 = 0.05, "1", [0.0, 1.0];
        /// Departure from orthogonality beyond which the map is no rotation.
        shear: f64 = 0.35, "1", [0.0, 1.0];
        /// Largest cosine between a third axis at rest and the reverse of its place in the model: beyond it the axis is
        /// inverted, below it the axis is perpendicular to its place.
        square: f64 = 0.3, "1", [0.0, 1.0];
        /// Largest delay of a pickoff in the search: a dither has one frequency, so only delays below half its period are
        /// distinguishable from a sign.
        pickoff_delay_s: f64 = 1e-3, "s", [0.0, 1.0];
    }
}

section! {
    /// Map between two instruments.
    MapPlan {
        /// Largest delay of the search on either side: the largest seen between two recorders of one experiment.
        most_delay_s: f64 = 0.5, "s", [0.0, 60.0];
        /// Largest delay that is likelier than reversed or exchanged channels: some periods of a slow instrument. At one
        /// frequency a delay of half a period is equivalent to a sign.
        likely_delay_s: f64 = 0.05, "s", [0.0, 60.0];
        /// Largest loss of explained power of an equivalent delay, as a share.
        as_well: f64 = 0.1, "1", [0.0, 1.0];
        /// Share of an axis in its own gyro below which other delays are tried: 0.3 rad of tilt leave more.
        own: f64 = 0.9, "1", [0.0, 1.0];
        /// Relative width of a band, as the noise is binned elsewhere.
        band: f64 = 0.08, "1", [1e-3, 1.0];
        /// Least frequencies in a band: three coefficients are fitted, and the residual needs some degrees of freedom.
        least_bins: usize = 8, "1", [4.0, 1e6];
        /// Largest standard deviation of a judged coefficient, as a share of its axis's column.
        known: f64 = 0.05, "1", [0.0, 1.0];
        /// Least attenuation factor by noise of the reference: below it the coefficient is dominated by noise.
        kept: f64 = 0.8, "1", [0.0, 1.0];
        /// Least squared coherence of a band in the comparison of gains.
        coherent: f64 = 0.9, "1", [0.0, 1.0];
        /// Least rows for a regression.
        least_rows: usize = 100, "rows", [8.0, 1e6];
    }
}

section! {
    /// Test for one motion of gyros and reference.
    SameMotionPlan {
        /// Largest delay of two recorders of one experiment.
        most_delay_s: f64 = 0.5, "s", [0.0, 60.0];
        /// Least lag of the surrogates, in largest delays.
        beyond_delay: f64 = 4.0, "1", [1.0, 1000.0];
        /// Largest angle random walk of any gyro: 5 °/√h, ten times a telephone's.
        most_walk_rad_sqrt_s: f64 = 1.45e-3, "rad/√s", [1e-9, 1.0];
        /// Least power of a motion, over that of such a walk or of the estimated noise.
        over_walk: f64 = 10.0, "1", [1.0, 1e6];
        /// Power of the reference, over that of the gyros, below which it is not amplified to explain them.
        alike: f64 = 0.1, "1", [0.0, 1.0];
        /// Upper limit of the compared frequencies, as a share of the reference's rows a second.
        of_reference_rate: f64 = 0.4, "1", [0.0, 0.5];
        /// Least frequencies of an octave.
        least_bins: usize = 2, "1", [1.0, 1000.0];
        /// Least frequencies of a quarter from which noise is estimated.
        noise_bins: usize = 8, "1", [1.0, 1000.0];
        /// Share accepted as common motion regardless of the surrogates: one tone has it at many lags.
        explained: f64 = 0.9, "1", [0.0, 1.0];
        /// Coherence accepted in the same way: a residual of a third of the motion.
        coherent: f64 = 0.943, "1", [0.0, 1.0];
        /// Least share of a common motion, over that by chance.
        share_over_chance: f64 = 1.1, "1", [1.0, 1000.0];
        /// Least log-likelihood of a common motion, over that by chance.
        likelihood_over_chance: f64 = 1.35, "1", [1.0, 1000.0];
        /// Least residual of an octave for the likelihood: one tone decides no more than that.
        least_left: f64 = 0.01, "1", [1e-12, 1.0];
        /// Time over which rates are averaged for their coherence.
        averaged_s: f64 = 0.02, "s", [0.0, 10.0];
        /// Largest number of rows, by averaging.
        most_rows: usize = 1 << 16, "rows", [1000.0, 1e9];
    }
}

section! {
    /// Partition of the rows.
    PartitionPlan {
        /// Share of the rows to fit; the rest is the test.
        fit: f64 = 0.8, "1", [0.1, 0.95];
        /// Number of stretches where the recording names no segments.
        stretches: usize = 8, "1", [1.0, 10000.0];
        /// Segments shorter than this are joined to their neighbours.
        shortest_s: f64 = 4.0, "s", [0.0, 1e5];
    }
}

section! {
    /// Criteria for a kept cell of time and frequency.
    GatePlan {
        /// Least ratio of power to noise.
        ratio: f64 = 6.0, "1", [1.0, 1000.0];
        /// Largest mean score of a column under the null hypothesis, for a noise off by its standard deviation.
        bias: f64 = 0.2, "σ", [1e-6, 10.0];
        /// Standard deviations of the input's noise in the upper bound of what conditioning leaves of it.
        deviations: f64 = 3.0, "σ", [0.0, 100.0];
        /// Least noise power of a conditioned input, as a share of the residual's: the remainder is a difference of two
        /// nearly equal powers.
        least_noise: f64 = 1e-6, "1", [1e-15, 1.0];
        /// Frames of the cells.
        frames: FramePlan;
    }
}

section! {
    /// Frames of time, for spectra that change.
    FramePlan {
        /// Length of a frame: a compromise between slow motion and bursts.
        length_s: f64 = 2.0, "s", [1e-3, 1000.0];
        /// Shortest and longest frame where the record is long enough.
        length_rows: [f64; 2] = [128.0, 8192.0], "rows", [2.0, 1e7];
        /// Least number of frame lengths in a record: the frames of a short record are shorter.
        least: usize = 4, "1", [1.0, 1000.0];
        /// Least number of rows of a frame: a shorter one does not resolve motion from noise.
        least_rows: usize = 16, "rows", [4.0, 1e6];
    }
}

section! {
    /// Measurement of the reference's noise in the recording.
    ReferenceNoisePlan {
        /// Least power of a declared term, as a share of the declaration: none vanishes.
        least_declared: f64 = 0.02, "1", [1e-9, 1.0];
        /// Number of lowest frequencies that are excluded: the window leaks slow motion into them.
        leaked: usize = 3, "1", [0.0, 1000.0];
        /// Number of neighbours on either side for the median power about a frequency.
        neighbours: usize = 12, "1", [1.0, 10000.0];
        /// Power over that median above which a frequency is a line of motion and has its own power as its variance.
        stands_out: f64 = 4.0, "1", [1.0, 1e6];
    }
}

section! {
    /// Search for lines of the gyros alone.
    OwnLinesPlan {
        /// Bins of a block with one transfer function and one noise.
        block: usize = 64, "bins", [4.0, 1e6];
        /// First bin of the spectrum: a line of fewer periods is a drift.
        first: usize = 16, "bins", [1.0, 1e6];
        /// Peaks stand above the median power of their block by this factor at least.
        peak: f64 = 100.0, "1", [1.0, 1e9];
        /// A reference with a peak above its own median by this factor has the line, too.
        shared: f64 = 10.0, "1", [1.0, 1e9];
        /// Share of the reference's samples a second up to which it shows a line.
        of_reference_rate: f64 = 0.4, "1", [0.0, 0.5];
        /// Least share of a peak's power that one frequency and amplitude explain: a resonance that the motion drives has
        /// less.
        coherent: f64 = 0.9, "1", [0.0, 1.0];
        /// Least amplitude of a line on a gyro.
        least_deviations: f64 = 4.0, "σ", [1.0, 1000.0];
        /// Power over the median of a block above which a bin is excluded from the fit of the transfer function.
        outlying: f64 = 20.0, "1", [1.0, 1e9];
        /// Number of the strongest lines of the motion whose sums and differences are excluded.
        strongest: usize = 12, "1", [0.0, 100.0];
        /// Half width about a line and about a product of the motion's lines.
        about: usize = 3, "bins", [1.0, 1000.0];
        /// Most lines.
        most: usize = 6, "1", [0.0, 1000.0];
    }
}

section! {
    /// Residual in step with the motion.
    InStepPlan {
        /// Least number of blocks of a test.
        least_blocks: usize = 16, "1", [4.0, 100000.0];
        /// Least part of the residual's power in step with the motion: less is the ordinary variation of noise.
        least_part: f64 = 0.5, "1", [0.0, 1.0];
        /// Least share of the motion: a search of the catalogue's effects is more sensitive below it.
        least_share: f64 = 1e-3, "1", [0.0, 1.0];
        /// Significance level: largest share of the shifts with as large a gain.
        chance: f64 = 0.02, "1", [1e-6, 0.5];
        /// Largest number of shifts.
        most_turns: usize = 200, "1", [10.0, 1e6];
        /// Length of the record over the least shift: a shorter shift is nearly none.
        record_over_turn: usize = 20, "1", [3.0, 1000.0];
        /// Time over which rows are summed: the error of single rows is small against their turn.
        summed_s: f64 = 0.1, "s", [1e-4, 100.0];
        /// Length of a block.
        block_s: f64 = 1.0, "s", [1e-3, 1000.0];
        /// Least sums of a block.
        least_sums: usize = 4, "1", [1.0, 1000.0];
        /// Largest number of blocks: a longer record has longer ones.
        most_blocks: usize = 512, "1", [16.0, 1e6];
    }
}

section! {
    /// Coherence of reading and prediction by octave.
    CoherencePlan {
        /// Number of pieces of a record.
        pieces: usize = 8, "1", [1.0, 1000.0];
        /// Least number of rows of a piece.
        least_rows: usize = 8, "rows", [4.0, 1e6];
        /// Largest number of rows of a piece.
        most_rows: usize = 1 << 14, "rows", [16.0, 1e7];
        /// First frequency: lower ones hold the mean through the window.
        first: usize = 2, "1", [1.0, 1000.0];
    }
}
