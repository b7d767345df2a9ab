//! A unit at rest on the turning Earth as one more observation model of the one likelihood.
//!
//! The case turns as the Earth does, without noise, but in a direction that is partly unknown (`earth`). What can show
//! then are constants, what follows temperature or field, and steps; drift is their rival. Steady lines are taken out
//! before (`steady`): at rest they have stages of their own. Beside the effects stands the noise of each gyro in the
//! terms of IEEE 952 (`terms`), and what else a constant can be (`alike`). Of the recorder itself speak stamps (`row_rate`)
//! and the noise of rows that were interpolated (`noise_cycle`), both brought together in `rows`.

mod kinds;

mod alike;

mod earth;

mod steady;

mod settle;

mod terms;

mod noise;

mod row_rate;

mod noise_cycle;

mod rows;

mod flow;

pub use rows::{RowsFound, shuffled};

pub use kinds::KINDS;

pub use flow::{SlowEffects, coarse, diagnose, serves};
