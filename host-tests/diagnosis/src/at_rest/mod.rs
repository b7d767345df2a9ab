//! A unit at rest on the turning Earth as one more observation model of the one likelihood.
//!
//! The case turns as the Earth does, without noise, but in a direction that is partly unknown (`earth`). Observable are
//! constants, effects of temperature or field, and steps, with drift as their rival (`settle`, `slow_words`); and lines
//! (`line`, `lines`), their `products` and their entries (`line_words`); bands of noise
//! (`bands`, `band_words`). Narrow features that are no lines are set aside
//! (`steady`). Beside the effects stand the noise of each gyro in the terms of IEEE 952 (`terms`, `noise`), and the kinds
//! that are not distinguishable from a constant (`alike`). The recorder itself is described by stamps (`row_rate`) and the
//! noise of interpolated rows (`noise_cycle`), joined in `rows`; the same search on shuffled rows is the `control`. `look`
//! analyses rows of one rate, `flow` goes through the rates, and `answer` joins the results.

mod kinds;

mod alike;

mod earth;

mod steady;

mod settle;

mod terms;

mod noise;

mod row_rate;

mod noise_cycle;

pub(crate) mod rows;

pub(crate) mod line;

pub(crate) mod products;

mod lines;

mod bands;

mod band_words;

pub(crate) mod line_words;

mod slow_words;

mod look;

mod control;

mod answer;

mod flow;

pub use kinds::KINDS;

pub use flow::{diagnose, still_forces};
