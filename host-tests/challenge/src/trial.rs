//! Draw of a trial before it is made: its family, its scene, its seeds.
//!
//! From the challenge's seed and the trial's number, a [`TrialDraw`] from the trial's own ChaCha stream, so that any trial
//! can be repeated alone.

use clap::ValueEnum;
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use super::scene::{POOL, RESTING, Setting};

/// Subject of a trial.
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
    /// An effect that is not distinguishable from another one in this motion.
    Confounded,
    /// Physics outside the catalogue.
    Unlisted,
    /// More noise than the model states.
    Noise,
}

/// Order of the families, each as often as its marks need trials: nulls for a limit in a thousand, detections for a curve.
pub const MIX: [Family; 20] = {
    use Family::{Confounded, Detection, Noise, Null, Pair, Single, Unlisted};
    [
        Null, Single, Detection, Unlisted, Null, Single, Pair, Detection, Null, Unlisted, Single,
        Null, Detection, Confounded, Single, Null, Unlisted, Single, Noise, Detection,
    ]
};

/// Confounded pair, by design.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Design {
    /// A gyro's scale and the reference's, without a dither that distinguishes them.
    Scale,
    /// A delay of all gyros, or a lead of the reference.
    Delay,
    /// A misalignment of the reference, or of every gyro.
    Turned,
    /// At rest: a g-dependent bias, or a bias.
    Gravity,
}

impl Design {
    /// Concealed kind, and the kind that is not distinguishable from it.
    pub fn kinds(self) -> (&'static str, &'static str) {
        match self {
            Self::Scale => ("gyro_scale", "reference_scale"),
            Self::Delay => ("reference_delay", "gyro_delay"),
            Self::Turned => ("reference_misalignment", "installation"),
            Self::Gravity => ("gyro_g_bias", "gyro_bias"),
        }
    }
}

/// Drawn trial.
#[derive(Debug, Clone)]
pub struct TrialDraw {
    /// Number of the trial.
    pub trial: u64,
    /// Family.
    pub family: Family,
    /// Number of the scene.
    pub scene: usize,
    /// Confounded pair, if any.
    pub design: Option<Design>,
    /// Seed of the noise.
    pub noise_seed: u64,
    /// Columns of random numbers are recorded too.
    pub dummies: bool,
    /// Samples jump for a row, and rows are lost.
    pub glitches: bool,
    /// Generator for the concealed effects.
    pub rng: ChaCha8Rng,
}

impl TrialDraw {
    /// Draws trial `trial` of a challenge that repeats `families` in turn.
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
