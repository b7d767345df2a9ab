//! The numbers of an analysis by still positions, decided before looking.

/// How still positions are found, and what is known of their scatter before.
#[derive(Debug, Clone, Copy)]
pub struct PositionPlan {
    /// Length of a block \[s\].
    pub block_s: f64,
    /// Rows of a block at least: of fewer the variance says nothing.
    pub least_block_rows: usize,
    /// Share of the blocks that are taken for quiet \[1\]: of a recording that is moved most of the time as well.
    pub quiet_share: f64,
    /// Ratio of variances beyond which a block is not still.
    pub restless_ratio: f64,
    /// Blocks of a position at least.
    pub least_blocks: usize,
    /// Blocks within a position that a knock may take.
    pub most_knocked: usize,
    /// Turn of the force up to which a position is the same \[rad\]: half a degree.
    pub same_direction_rad: f64,
    /// Turn of the force beyond which two positions are different attitudes \[rad\]: a unit that stands in less than
    /// `least_attitudes` of them was not moved.
    pub other_attitude_rad: f64,
    /// See `other_attitude_rad`.
    pub least_attitudes: usize,
    /// How many positions' worth is known before of their scatter: that it is about what drifts within them. Of six positions six
    /// numbers are found, and nothing else tells errors of the unit from a scatter as large.
    pub scatter_known: f64,
    /// Scatter between positions that the best of benches has \[m/s²\]: 2 µg, of strain and of how the unit is set down.
    pub least_scatter_m_s2: f64,
    /// Positions from which on every fifth only tests.
    pub least_to_hold_out: usize,
    /// Standard deviation of gravity where no site is named \[m/s²\]: from equator to pole it grows by 0.052.
    pub gravity_std_m_s2: f64,
    /// Share of gravity by which a position's force may differ and still be gravity \[1\].
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
