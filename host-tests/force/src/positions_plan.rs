//! Settings of the analysis of still positions, fixed before the data are seen.

/// Detection of still positions, and the prior of the scatter between them.
#[derive(Debug, Clone, Copy)]
pub struct PositionPlan {
    /// Length of a block \[s\].
    pub block_s: f64,
    /// Least rows of a block; the variance of fewer is too uncertain.
    pub least_block_rows: usize,
    /// Share of the blocks taken as quiet \[1\]: small enough also for a recording that moves most of the time.
    pub quiet_share: f64,
    /// Ratio of variances above which a block is not still.
    pub restless_ratio: f64,
    /// Least blocks of a position.
    pub least_blocks: usize,
    /// Largest number of disturbed blocks within a position.
    pub most_knocked: usize,
    /// Rotation of the force up to which two blocks are one position \[rad\]: half a degree.
    pub same_direction_rad: f64,
    /// Rotation of the force beyond which two positions are different attitudes \[rad\]: a unit that stands in fewer than
    /// `least_attitudes` of them counts as not moved.
    pub other_attitude_rad: f64,
    /// See `other_attitude_rad`.
    pub least_attitudes: usize,
    /// Degrees of freedom of the prior of the scatter between positions, centred on the drift within them. Six positions
    /// for six parameters leave no residual, so without a prior errors of the unit are not distinguishable from scatter.
    pub scatter_known: f64,
    /// Scatter between positions of the best benches \[m/s²\]: 2 µg, of strain and of the placing of the unit.
    pub least_scatter_m_s2: f64,
    /// Number of positions from which every fifth is held out.
    pub least_to_hold_out: usize,
    /// Standard deviation of gravity if no site is given \[m/s²\]: it grows by 0.052 from equator to pole.
    pub gravity_std_m_s2: f64,
    /// Largest relative difference of a position's force from gravity \[1\].
    pub far_from_gravity: f64,
}

impl Default for PositionPlan {
    fn default() -> Self {
        Self {
            block_s: 0.5,
            least_block_rows: 8,
            quiet_share: 0.2,
            restless_ratio: 4.0,
            least_blocks: 4,
            most_knocked: 4,
            same_direction_rad: 0.0087,
            other_attitude_rad: 0.35,
            least_attitudes: 3,
            scatter_known: 2.0,
            least_scatter_m_s2: 2e-5,
            least_to_hold_out: 18,
            gravity_std_m_s2: 0.02,
            far_from_gravity: 0.2,
        }
    }
}
