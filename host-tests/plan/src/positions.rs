//! Still positions without a reference.

use crate::section::section;

section! {
    /// Detection of still positions, and the prior of the scatter between them.
    PositionPlan {
        /// Length of a block.
        block_s: f64 = 0.5, "s", [1e-3, 1000.0];
        /// Least rows of a block; the variance of fewer is too uncertain.
        least_block_rows: usize = 8, "rows", [2.0, 1e6];
        /// Share of the blocks taken as quiet: small enough also for a recording that moves most of the time.
        quiet_share: f64 = 0.2, "1", [0.01, 1.0];
        /// Ratio of variances above which a block is not still.
        restless_ratio: f64 = 4.0, "1", [1.0, 1000.0];
        /// Tolerance of that ratio for the uncertainty of a block's variance, in standard deviations.
        restless_deviations: f64 = 6.0, "σ", [0.0, 100.0];
        /// Least blocks of a position.
        least_blocks: usize = 4, "1", [1.0, 10000.0];
        /// Largest number of disturbed blocks within a position.
        most_knocked: usize = 4, "1", [0.0, 10000.0];
        /// Rotation of the force up to which two blocks are one position: half a degree.
        same_direction_rad: f64 = 0.0087, "rad", [0.0, 4.0];
        /// Blocks left out at either end of a position that keeps `least_blocks`: the hand still touches the unit.
        touched_blocks: usize = 1, "1", [0.0, 1000.0];
        /// Parts of a position of which the first and the last are compared for a rotation.
        turning_parts: usize = 4, "1", [2.0, 1000.0];
        /// Largest rotation from the first to the last part of a position, relative to `same_direction_rad`: a unit that
        /// rotates further is not still.
        turning_share: f64 = 0.5, "1", [0.0, 10.0];
        /// Rotation of the force beyond which two positions are different attitudes: a unit that stands in fewer than
        /// `least_attitudes` of them counts as not moved.
        other_attitude_rad: f64 = 0.35, "rad", [0.0, 4.0];
        /// See `other_attitude_rad`.
        least_attitudes: usize = 3, "1", [1.0, 1000.0];
        /// Degrees of freedom of the prior of the scatter between positions, centred on the drift within them. Six
        /// positions for six parameters leave no residual, so without a prior errors of the unit are not distinguishable
        /// from scatter.
        scatter_known: f64 = 2.0, "1", [0.0, 1000.0];
        /// Scatter between positions of the best benches: 2 µg, of strain and of the placing of the unit.
        least_scatter_m_s2: f64 = 2e-5, "m/s²", [1e-12, 10.0];
        /// Least sum of the blocks' squared deviations from their positions' means, below any accelerometer's: nano-g.
        least_sum_m2_s4: f64 = 1e-16, "m²/s⁴", [1e-30, 1.0];
        /// Least number of positions of which some are held out.
        least_to_hold_out: usize = 18, "1", [7.0, 10000.0];
        /// Number of positions of which the last is held out.
        held_out_every: usize = 5, "1", [2.0, 1000.0];
        /// Least number of positions for each effect of a set.
        of_effect: usize = 2, "1", [1.0, 1000.0];
        /// Everyday kinds with which a second search starts, bias and scale error first: with few positions no error of a new
        /// unit is worth its parameters alone.
        new_unit_kinds: usize = 2, "1", [0.0, 10.0];
        /// Standard deviation, in cross-validation, of a column without a prior: the largest plausible difference from
        /// gravity.
        largest_m_s2: f64 = 1.0, "m/s²", [1e-9, 100.0];
        /// Standard deviation of gravity if no site is given: it grows by 0.052 m/s² from equator to pole.
        gravity_std_m_s2: f64 = 0.02, "m/s²", [1e-9, 10.0];
        /// Convergence limit of a size between passes.
        settled: f64 = 0.1, "σ", [1e-6, 10.0];
        /// Largest relative difference of a position's force from gravity.
        far_from_gravity: f64 = 0.2, "1", [0.0, 10.0];
        /// Least share of a position's rows with all gyros measured for their mean rate.
        measured_share: f64 = 0.5, "1", [0.0, 1.0];
    }
}
