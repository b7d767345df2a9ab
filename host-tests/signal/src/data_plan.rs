//! Thresholds for the detection of data faults.

use crate::held::HoldPlan;
use crate::repeated::RepeatPlan;
use crate::stops::StopPlan;

/// Thresholds of all detectors.
#[derive(Debug, Clone, Copy)]
pub(super) struct DataPlan {
    /// Channels whose samples are held over several rows.
    pub(super) hold: HoldPlan,
    /// Least share of held rows for the whole recording to be thinned \[1\]: recorders start and stop.
    pub(super) held_throughout: f64,
    /// Least share of simultaneous samples on all held channels \[1\]: one recorder wrote them.
    pub(super) held_together: f64,
    /// Largest ratio of unexplained variances, for samples to be means: mean since the last sample over the row itself
    /// \[1\].
    pub(super) mean_leaves: f64,
    /// Ends of a range.
    pub(super) stops: StopPlan,
    /// Blocks of rows written twice.
    pub(super) repeats: RepeatPlan,
    /// Moving-average length for the reference before a test of its change \[1\].
    pub(super) smoothed_rows: usize,
    /// Least change of the reference in rows of one constant gyro value, as a share of that value \[1\].
    pub(super) turned: f64,
    /// Threshold of significance in standard deviations of a row of the reference.
    pub(super) clear: f64,
    /// Share of rows equal to the row before, below which a channel is fine \[1\].
    pub(super) fine: f64,
    /// Single outliers.
    pub(super) spikes: SpikePlan,
}

/// Criteria of a spike.
#[derive(Debug, Clone, Copy)]
pub(super) struct SpikePlan {
    /// Threshold of a sample's deviation from its neighbours in standard deviations: a quarter of a million rows reach five.
    pub(super) off: f64,
    /// Tolerance of the neighbours' deviation from that due to one outlier, as a share of the outlier.
    pub(super) near: f64,
    /// Rows of the scale estimate: a shaken unit scatters more.
    pub(super) around: usize,
    /// Least number on one channel: fewer may be jumps of an angle.
    pub(super) least: usize,
    /// Largest share of the rows: more are the tail of the noise distribution.
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
