//! Draws a trial before it is made: its family, its scene, its seeds.
//!
//! From the challenge's seed and the trial's number comes a [`TrialDraw`], drawn from a ChaCha stream of the trial's own,
//! so that any trial can be repeated alone.

use clap::ValueEnum;
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use super::scene::{POOL, RESTING, Setting};

/// What is put to the test.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, ValueEnum,
)]
#[serde(rename_all = "snake_case")]
pub enum Family {
    /// Nothing concealed.
    Null,
    /// One effect of the catalogue, any strength.
    Single,
    /// One effect of six parameters at a strength of the detection marks.
    Detection,
    /// Two effects of the catalogue.
    Pair,
    /// An effect that this motion cannot tell from another one.
    Confounded,
    /// Physics outside the catalogue.
    Unlisted,
    /// More noise than the model has.
    Noise,
}

/// Every family as often as its marks need trials: nulls for a limit in a thousand, detections for a curve.
pub const MIX: [Family; 20] = {
    use Family::{Confounded, Detection, Noise, Null, Pair, Single, Unlisted};
    [
        Null, Single, Detection, Unlisted, Null, Single, Pair, Detection, Null, Unlisted, Single,
        Null, Detection, Confounded, Single, Null, Unlisted, Single, Noise, Detection,
    ]
};

/// How an effect is confounded by design.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Design {
    /// A gyro's scale against the reference's, without a dither that would tell.
    Scale,
    /// All gyros late, or the reference early.
    Delay,
    /// The reference turned, or every gyro.
    Turned,
    /// At rest: a bias by gravity, or a bias.
    Gravity,
}

impl Design {
    /// The kind that is concealed and the one it cannot be told from.
    pub fn kinds(self) -> (&'static str, &'static str) {
        match self {
            Self::Scale => ("gyro_scale", "reference_scale"),
            Self::Delay => ("reference_delay", "gyro_delay"),
            Self::Turned => ("reference_misalignment", "installation"),
            Self::Gravity => ("gyro_g_bias", "gyro_bias"),
        }
    }
}

/// A trial, drawn.
#[derive(Debug, Clone)]
pub struct TrialDraw {
    /// Its number.
    pub trial: u64,
    /// What it tests.
    pub family: Family,
    /// Its scene.
    pub scene: usize,
    /// How it is confounded.
    pub design: Option<Design>,
    /// Seed of its noise.
    pub noise_seed: u64,
    /// Columns of no meaning are recorded too.
    pub dummies: bool,
    /// Readings that jump for a row, and rows that are lost.
    pub glitches: bool,
    /// Draws what is concealed.
    pub rng: ChaCha8Rng,
}

impl TrialDraw {
    /// Draws trial `trial` of a challenge that goes through `families` again and again.
    pub fn draw(seed: u64, trial: u64, families: &[Family]) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(trial);
        let family = families[(trial % families.len() as u64) as usize];
        let design = (family == Family::Confounded).then(|| {
            [
                Design::Scale,
                Design::Delay,
                Design::Turned,
                Design::Gravity,
            ][rng.random_range(0..4)]
        });
        let mut scene = rng.random_range(0..POOL);
        while design == Some(Design::Scale) && Setting::of(scene).is_dithered() {
            scene -= 1;
        }
        if design == Some(Design::Gravity) {
            scene = RESTING;
        }
        Self {
            trial,
            family,
            scene,
            design,
            noise_seed: rng.random(),
            dummies: rng.random_bool(0.3),
            glitches: family == Family::Null && rng.random_bool(1.0 / 7.0),
            rng,
        }
    }
}
