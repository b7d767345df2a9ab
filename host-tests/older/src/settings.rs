//! What a diagnosis is asked to do.

use serde::{Deserialize, Serialize};

use rlg_diagnosis::AnalysisPlan;
use rlg_signal::channel_check::ChannelPlan;

/// Which engine decides; beside attitudes there is one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Engine {
    /// For gyros without a dither one likelihood and one search (rlg-diagnosis) where they serve, the older stages for everything
    /// else. Where there are accelerometers the older stages speak of them, and of gyros whose error gravity may tell from
    /// the reference's.
    #[default]
    Both,
    /// The older stages alone.
    Old,
    /// The new engine alone, where it serves.
    New,
}

impl Engine {
    /// Its name in files and on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Both => "both",
            Self::Old => "old",
            Self::New => "new",
        }
    }
}

/// How a recording is diagnosed.
#[derive(Debug, Clone, Copy, Default)]
pub struct Settings<'a> {
    /// Which engine decides.
    pub engine: Engine,
    /// Kinds that are taken out of the catalogue: what the tool says of physics it does not know.
    pub left_out: &'a [&'a str],
    /// The numbers of the new engine.
    pub plan: AnalysisPlan,
    /// The numbers of the check of axes, signs and units.
    pub channels: ChannelPlan,
    /// Whether channels that are reversed, exchanged or of another unit are put right and reported instead of refused.
    pub anyway: bool,
    /// Seed of the older stages' self-test and control; no finding depends on it.
    pub seed: u64,
}

impl Settings<'_> {
    /// Everything else as a rule.
    pub fn by(engine: Engine) -> Self {
        Self {
            engine,
            ..Self::default()
        }
    }

    /// What the new engine takes of them.
    pub fn of_new_engine(&self) -> rlg_diagnosis::Settings<'_> {
        rlg_diagnosis::Settings {
            left_out: self.left_out,
            plan: self.plan,
            channels: self.channels,
            anyway: self.anyway,
            seed: self.seed,
        }
    }
}
