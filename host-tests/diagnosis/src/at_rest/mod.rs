//! A unit at rest on the turning Earth as one more observation model of the one likelihood.
//!
//! The case turns as the Earth does, without noise, but in a direction that is partly unknown (`earth`). Observable are
//! constants, effects of temperature or field, and steps, with drift as their rival (`settle`, `slow_words`); and lines and
//! bands of noise (`lines_at_rest`). Narrow features that are no lines are set aside (`narrowband`). Beside the effects
//! stand the noise of each gyro in the terms of IEEE 952 (`allan_terms`, `noise`), and the kinds that are not
//! distinguishable from a constant (`bias_confounders`). The recorder itself is described by stamps (`row_rate`) and the
//! noise of interpolated rows (`noise_cycle`), joined in `rows`; the same search on shuffled rows is the `control`.
//! `one_rate` analyses rows of one rate, `flow` goes through the rates, and `answer` joins the results.

mod kinds;

mod bias_confounders;

mod earth;

mod narrowband;

mod settle;

mod allan_terms;

mod noise;

mod row_rate;

mod noise_cycle;

pub(crate) mod rows;

mod slow_words;

mod one_rate;

mod control;

mod answer;

mod flow;

pub use kinds::KINDS;

pub use flow::{diagnose, still_forces};
