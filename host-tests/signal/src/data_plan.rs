//! The numbers by which faults of the data are told from what was measured.

use crate::held::HoldPlan;
use crate::repeated::RepeatPlan;
use crate::stops::StopPlan;

/// All of them.
#[derive(Debug, Clone, Copy)]
pub(super) struct DataPlan {
    /// Channels whose readings stand for several rows.
    pub(super) hold: HoldPlan,
    /// Least share of the rows that are held for the whole recording to be read so \[1\]: recorders start and stop.
    pub(super) held_throughout: f64,
    /// Least share of readings that come in the same rows on all channels that are held \[1\]: one recorder wrote them.
    pub(super) held_together: f64,
    /// What a mean since the last reading leaves, as a share of what the row itself leaves, for readings to be means \[1\].
    pub(super) mean_leaves: f64,
    /// Ends of a range.
    pub(super) stops: StopPlan,
    /// Blocks of rows written twice.
    pub(super) repeats: RepeatPlan,
    /// Rows over which the reference is smoothed before it is said to change \[1\].
    pub(super) smoothed_rows: usize,
    /// Least change of the reference, of a gyro's reading, in rows that show one value \[1\].
    pub(super) turned: f64,
    /// Standard deviations of a row of the reference that are no chance.
    pub(super) clear: f64,
    /// Share of rows that show the value before, below which a channel is fine \[1\].
    pub(super) fine: f64,
    /// Single readings that are off.
    pub(super) spikes: SpikePlan,
}

/// What a spike is.
#[derive(Debug, Clone, Copy)]
pub(super) struct SpikePlan {
    /// Standard deviations that a reading is off its neighbours: a quarter of a million rows reach five.
    pub(super) off: f64,
    /// What its neighbours may differ by from what one reading makes of them, as a share.
    pub(super) near: f64,
    /// Rows over which the scatter is read: a shaken unit scatters more.
    pub(super) around: usize,
    /// Least number on one channel: fewer are jumps of an angle as well.
    pub(super) least: usize,
    /// Largest share of the rows: more are how the readings scatter.
    pub(super) most: f64,
}

impl Default for DataPlan {
    fn default() -> Self {
        Self {
            hold: HoldPlan::default(),
            held_throughout: 0.9,
            held_together: 0.95,
            mean_leaves: 0.7,
            stops: StopPlan::default(),
            repeats: RepeatPlan::default(),
            smoothed_rows: 5,
            turned: 0.02,
            clear: 5.0,
            fine: 0.01,
            spikes: SpikePlan {
                off: 10.0,
                near: 0.25,
                around: 2000,
                least: 3,
                most: 1e-2,
            },
        }
    }
}
