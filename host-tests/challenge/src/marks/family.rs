//! Families of trials: concealed kinds, drift of the gyros, length.

use clap::ValueEnum;
use rand::RngExt as _;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use super::kinds::{BASIC, KindRow, OTHERS};
use super::noise::Drift;
use super::setting::{Limits, one_of};

/// Subject of a trial.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, ValueEnum,
)]
#[serde(rename_all = "snake_case")]
pub enum Family {
    /// Nothing concealed, no drift.
    Null,
    /// Nothing concealed, gyros with drift.
    Drift,
    /// Nothing concealed, a rate random walk that equals the angle random walk at 0.01 Hz, 120 to 200 s.
    WeakDrift,
    /// A bias, a scale error or a delay.
    Basic,
    /// One effect of another kind.
    Single,
    /// Two effects.
    Pair,
    /// A bias, a scale error or a delay of gyros with drift.
    DriftBasic,
    /// Dithered counts at 4 kHz, nothing concealed.
    DitheredNull,
    /// Dithered counts at 4 kHz, one effect.
    Dithered,
    /// An hour, nothing concealed; runs only if named.
    Hour,
    /// All of the above except the hour.
    Rates,
    /// With an attitude reference: nothing, an effect or a fault of the reference in turn; runs only if named, and alone.
    Attitude,
    /// At rest: nothing, an effect, lines or noise in turn; runs only if named, and alone.
    Rest,
    /// With accelerometers and a reference of rate: nothing, or an effect of one of the three in turn; runs only if named,
    /// and alone.
    Force,
    /// Accelerometers in still positions without a reference: nothing, or their errors in turn; runs only if named, and
    /// alone.
    Positions,
    /// Others' recording with an attitude reference: its own noise without its physics, or an additional effect on its
    /// gyros, in turn; runs only if named, and alone.
    Recorded,
    /// Gyros of one motion and the reference of another, of rate and of attitude in turn; runs only if named, and alone.
    Unrelated,
}

/// Families by the trial's number, repeated in turn.
pub const CYCLE: [Family; 17] = {
    use Family::{
        Basic, Dithered, DitheredNull, Drift, DriftBasic, Hour, Null, Pair, Single, WeakDrift,
    };
    [
        Null,
        Basic,
        Drift,
        Single,
        Null,
        Basic,
        WeakDrift,
        Pair,
        Null,
        Single,
        DriftBasic,
        Drift,
        Null,
        Basic,
        DitheredNull,
        Dithered,
        Hour,
    ]
};

/// Drifts of the drifting families: corner frequency with the angle random walk \[Hz\].
const DRIFTS: [Drift; 3] = [
    Drift::RateWalk(0.05),
    Drift::RateWalk(0.3),
    Drift::Flicker(0.05),
];

impl Family {
    /// True if trials of every number are of the family, which selects the injected effect by the number.
    pub fn is_alone(self) -> bool {
        matches!(
            self,
            Self::Attitude
                | Self::Rest
                | Self::Force
                | Self::Positions
                | Self::Recorded
                | Self::Unrelated
        )
    }

    /// Returns the first random stream of its trials.
    pub fn first_stream(self) -> u64 {
        match self {
            Self::Attitude => 1 << 40,
            Self::Rest => 2 << 40,
            Self::Recorded => 3 << 40,
            Self::Force => 4 << 40,
            Self::Positions => 5 << 40,
            Self::Unrelated => 6 << 40,
            _ => 0,
        }
    }

    /// Returns the family of a number among the trials with a reference of rate.
    pub fn of(number: u64) -> Self {
        CYCLE[(number % CYCLE.len() as u64) as usize]
    }

    /// True if nothing is concealed.
    pub fn is_null(self) -> bool {
        matches!(
            self,
            Self::Null | Self::Drift | Self::WeakDrift | Self::DitheredNull | Self::Hour
        )
    }

    /// Returns the name on the command line.
    pub fn name(self) -> String {
        self.to_possible_value()
            .map(|value| value.get_name().to_owned())
            .unwrap_or_default()
    }

    /// Returns the limits of the family's settings.
    pub fn limits(self, limits: &Limits) -> Limits {
        let mut own = *limits;
        match self {
            Self::WeakDrift => own.length_s = [120.0, 200.0],
            Self::Hour => {
                own.length_s = [3600.0; 2];
                own.most_rows = f64::INFINITY;
            }
            _ => {}
        }
        own
    }

    /// Draws the drift of the gyros.
    pub fn drift(self, rng: &mut ChaCha8Rng) -> Drift {
        match self {
            Self::Drift | Self::DriftBasic => one_of(rng, &DRIFTS),
            Self::WeakDrift => Drift::RateWalk(0.01),
            _ => Drift::None,
        }
    }

    /// Draws the kinds to conceal.
    pub fn kinds(self, rng: &mut ChaCha8Rng) -> Vec<KindRow> {
        let all: Vec<KindRow> = BASIC.into_iter().chain(OTHERS).collect();
        match self {
            Self::Basic | Self::DriftBasic => vec![one_of(rng, &BASIC)],
            Self::Single => vec![one_of(rng, &OTHERS)],
            Self::Pair => {
                let first = rng.random_range(0..all.len());
                let second = (first + rng.random_range(1..all.len())) % all.len();
                vec![all[first], all[second]]
            }
            _ => Vec::new(),
        }
    }
}
