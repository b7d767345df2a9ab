//! What a diagnosis is asked to do.

use rlg_signal::channel_check::ChannelPlan;

use super::plan::AnalysisPlan;

/// How a recording is diagnosed.
#[derive(Debug, Clone, Copy, Default)]
pub struct Settings<'a> {
    /// Kinds that are taken out of the catalogue: what the tool says of physics it does not know.
    pub left_out: &'a [&'a str],
    /// The numbers of the analysis.
    pub plan: AnalysisPlan,
    /// The numbers of the check of axes, signs and units.
    pub channels: ChannelPlan,
    /// Whether channels that are reversed, exchanged or of another unit are put right and reported instead of refused.
    pub anyway: bool,
    /// Seed of the self-test and of the control, which `diagnosis.json` names; no finding depends on it.
    pub seed: u64,
}
