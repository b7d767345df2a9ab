//! What a diagnosis is asked to do.

use rlg_diagnosis::AnalysisPlan;
use rlg_signal::channel_check::ChannelPlan;

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
    /// Seed of the self-test and of the control; no finding depends on it.
    pub seed: u64,
}

impl Settings<'_> {
    /// What the likelihoods of gyros take of them.
    pub fn of_diagnosis(&self) -> rlg_diagnosis::Settings<'_> {
        rlg_diagnosis::Settings {
            left_out: self.left_out,
            plan: self.plan,
            channels: self.channels,
            anyway: self.anyway,
            seed: self.seed,
        }
    }

    /// The numbers of the accelerometers' part.
    pub fn of_force(&self) -> rlg_force::ForcePlan {
        rlg_force::ForcePlan {
            shared: self.plan,
            ..Default::default()
        }
    }
}
