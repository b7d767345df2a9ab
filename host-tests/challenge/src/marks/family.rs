//! Families of trials: what each conceals, how its gyros drift, how long it is.

use clap::ValueEnum;
use rand::RngExt as _;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use super::kinds::{BASIC, KindRow, OTHERS};
use super::noise::Drift;
use super::setting::{Limits, one_of};

/// What a trial tests.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, ValueEnum,
)]
#[serde(rename_all = "snake_case")]
pub enum Family {
    /// Nothing concealed, no drift.
    Null,
    /// Nothing concealed, gyros that drift.
    Drift,
    /// Nothing concealed, a random walk of rate that equals the angle random walk at 0.01 Hz, 120 to 200 s.
    WeakDrift,
    /// A bias, a scale error or a delay.
    Basic,
    /// One effect of another kind.
    Single,
    /// Two effects.
    Pair,
    /// A bias, a scale error or a delay of gyros that drift.
    DriftBasic,
    /// Dithered counts at 4 kHz, nothing concealed.
    DitheredNull,
    /// Dithered counts at 4 kHz, one effect.
    Dithered,
    /// An hour, nothing concealed; runs only by name.
    Hour,
    /// All the above but the hour.
    Rates,
    /// Beside attitudes: nothing, an effect or a fault of the reference in turn; runs only by name and alone.
    Attitude,
    /// At rest: nothing, an effect, lines or noise in turn; runs only by name and alone.
    Rest,
    /// With accelerometers beside references of rate: nothing, or an effect of one of the three in turn; runs only by name and
    /// alone.
    Force,
    /// Accelerometers in still positions without a reference: nothing, or errors of theirs in turn; runs only by name and alone.
    Positions,
    /// A recording of others beside attitudes: its own noise without its physics, or an effect more on its gyros, in turn; runs
    /// only by name and alone.
    Recorded,
    /// Gyros of one motion and the reference of another, of rates and of attitudes in turn; runs only by name and alone.
    Unrelated,
}

/// Families by the trial's number, again and again.
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

/// Drifts of the drifting families: corners with the angle random walk \[Hz\].
const DRIFTS: [Drift; 3] = [
    Drift::RateWalk(0.05),
    Drift::RateWalk(0.3),
    Drift::Flicker(0.05),
];

impl Family {
    /// Whether trials of every number are of the family, which names what it plants by the number.
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

    /// Returns where the random streams of its trials begin.
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

    /// Returns the family of a number among the trials beside references of rate.
    pub fn of(number: u64) -> Self {
        CYCLE[(number % CYCLE.len() as u64) as usize]
    }

    /// Whether nothing is concealed.
    pub fn is_null(self) -> bool {
        matches!(
            self,
            Self::Null | Self::Drift | Self::WeakDrift | Self::DitheredNull | Self::Hour
        )
    }

    /// Returns its name as the command line has it.
    pub fn name(self) -> String {
        self.to_possible_value()
            .map(|value| value.get_name().to_owned())
            .unwrap_or_default()
    }

    /// Returns the limits that the family's settings are drawn in.
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

    /// Draws how the gyros drift.
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
