//! A unit at rest on the turning Earth as one more observation model of the one likelihood.
//!
//! The case turns as the Earth does, without noise, but in a direction that is partly unknown (`earth`). What can show
//! then are constants, what follows temperature or field, and steps; drift is their rival. Steady lines are taken out
//! before (`steady`): at rest they have stages of their own. Beside the effects stands the noise of each gyro in the
//! terms of IEEE 952 (`terms`), and what else a constant can be (`alike`).

mod alike;

mod earth;

mod steady;

mod terms;

mod flow;

pub use flow::{KINDS, SlowEffects, diagnose, serves};
