//! A unit at rest on the turning Earth as one more observation model of the one likelihood.
//!
//! The case turns as the Earth does, without noise, but in a direction that is partly unknown (`earth`). What can show
//! then are constants, what follows temperature or field, and steps, with drift as their rival (`settle`, `slow_words`);
//! and lines (`line`, `lines`), their `products` and their entries (`line_words`). What is narrow and no line is set aside
//! (`steady`). Beside the effects stands the noise of each gyro in the terms of IEEE 952 (`terms`, `noise`), and what else a
//! constant can be (`alike`). Of the recorder itself speak stamps (`row_rate`) and the noise of rows that were interpolated
//! (`noise_cycle`), both brought together in `rows`; the same scan on shuffled rows is the `control`. `look` goes through
//! all of it for rows of one rate, `flow` through the rates, and `answer` brings them together.

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

pub(crate) mod line_words;

mod slow_words;

mod look;

mod control;

mod answer;

mod flow;

pub use kinds::KINDS;

pub use flow::diagnose;
