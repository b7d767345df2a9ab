//! Trials: family by the number, and draw of the family.
//!
//! A trial's number determines its family and its ChaCha stream, so that `seed:number` repeats a trial alone for any
//! selection of families.

use std::sync::Arc;

use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;

use crate::attitude::trial::Attitudes;
use crate::force::trial::Turned;
use crate::marks::dithered::Dithered;
use crate::marks::family::Family;
use crate::marks::rows::Rows;
use crate::marks::setting::Limits;
use crate::positions::trial::Stood;
use crate::recorded::base::Base;
use crate::recorded::record::Recorded;
use crate::rest::trial::Still;
use rlg_recording::error::InputError;

/// Recorded data, by their generator.
#[derive(Debug, Clone)]
pub enum Source {
    /// Increments in closed form.
    Rows(Box<Rows>),
    /// Dithered counts of the simulator.
    Dithered(Dithered),
    /// Increments or rates with an attitude reference.
    Attitude(Box<Attitudes>),
    /// A unit at rest.
    Rest(Box<Still>),
    /// Rotated unit with accelerometers.
    Force(Box<Turned>),
    /// Accelerometers in still positions.
    Positions(Box<Stood>),
    /// A recording of others.
    Recorded(Box<Recorded>),
}

/// Drawn trial.
#[derive(Debug, Clone)]
pub struct Trial {
    /// Number of the trial.
    pub number: u64,
    /// Family.
    pub family: Family,
    /// Recorded data.
    pub source: Source,
    /// Seed of the noise.
    pub noise_seed: u64,
    /// Random hexadecimal digits that prevent guessing the truth from its hash.
    pub salt: String,
}

impl Trial {
    /// Draws trial `number` of a seed, of a family without a base recording.
    pub fn draw(
        seed: u64,
        (number, family): (u64, Family),
        limits: &Limits,
    ) -> Result<Self, InputError> {
        Self::drawn(seed, (number, family), |rng| match family {
            Family::DitheredNull => Ok(Source::Dithered(Dithered::draw(rng, false)?)),
            Family::Dithered => Ok(Source::Dithered(Dithered::draw(rng, true)?)),
            Family::Attitude => {
                let drawn = Attitudes::draw(number, rng)?;
                Ok(Source::Attitude(Box::new(drawn)))
            }
            Family::Rest => Ok(Source::Rest(Box::new(Still::draw(number, limits, rng)?))),
            Family::Force => Ok(Source::Force(Box::new(Turned::draw(number, limits, rng)?))),
            Family::Positions => {
                let drawn = Stood::draw(number, limits, rng)?;
                Ok(Source::Positions(Box::new(drawn)))
            }
            Family::Unrelated if !number.is_multiple_of(2) => {
                let drawn = Attitudes::of_two_motions(rng)?;
                Ok(Source::Attitude(Box::new(drawn)))
            }
            Family::Recorded => Err(InputError::new("--family", "needs a recording")),
            _ => Ok(Source::Rows(Box::new(Rows::draw(family, limits, rng)))),
        })
    }

    /// Draws trial `number` of a seed from a base recording.
    pub fn of_recording(seed: u64, number: u64, base: &Arc<Base>) -> Result<Self, InputError> {
        Self::drawn(seed, (number, Family::Recorded), |rng| {
            Ok(Source::Recorded(Box::new(Recorded::draw(
                number, base, rng,
            ))))
        })
    }

    fn drawn(
        seed: u64,
        (number, family): (u64, Family),
        source: impl FnOnce(&mut ChaCha8Rng) -> Result<Source, InputError>,
    ) -> Result<Self, InputError> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(number | family.first_stream());
        let noise_seed = rng.random();
        let salt: [u64; 2] = [rng.random(), rng.random()];
        Ok(Self {
            number,
            family,
            source: source(&mut rng)?,
            noise_seed,
            salt: format!("{:016x}{:016x}", salt[0], salt[1]),
        })
    }
}
