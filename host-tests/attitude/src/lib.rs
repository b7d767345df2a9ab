//! What a model leaves out of gyros beside an attitude reference, at any rate and however stamped.
//!
//! In the order of the data: `conventions` (body to navigation frame, w first) → `channels` (the same axes, signs and
//! units) → `coarse` (delay and rotation far off) →
//! `gyro_motion` (the gyros' own attitude, `dither` taken out) → `increments` (rows of the likelihood, between stamps) →
//! `growth` of the `registration` (what aligns two instruments, always beside; on `equations` with the `noise` at its best, whose
//! level has a `modulation` in each of the `octaves`, columns of `conditioned` motion, without `reference_faults`) → `physics` (effects of the catalogue, carried through the attitude; among them a reference that is pulled to the `vertical`) →
//! `search` (the `choice` by what `blocks` of rows, made white by the `whitener`, agree on, by their `block_sums` alone; `steps` of a bias; a `self_test` of
//! both) → `held_out`, `promise` and `findings`. What is left of the gyros' own motion is handed on (`case_motion`): it carries gravity past accelerometers.
//!
//! A reference that sums up increments is one, too: sums are compared with sums, and nothing is turned.
//!
//! Of attitudes so few that they do not show their own noise, `few` weighs rows and columns over what is declared or believed
//! of it, and `few_search` takes the place of registration and search. Where the registration alone is asked for, `align`
//! leaves the physics out.

pub mod plan;

mod gyro_motion;

mod dither;

mod increments;

mod modulation;

mod octaves;

mod noise;

mod equations;

mod whitener;

mod conditioned;

mod reference_faults;

mod outliers;

mod reference_jumps;

mod alignment;

mod about;

mod fitting;

mod growth;

mod registration;

mod channels;

mod held;

mod observed;

mod vertical;

mod own_lines;

mod coarse;

mod conventions;

mod physics;

mod block_sums;

mod blocks;

mod steps;

mod choice;

mod self_test;

mod search;

mod rest;

mod few;

mod few_search;

mod promise;

mod reference_spans;

mod said;

mod held_out;

mod case_motion;

mod mount;

mod findings;

mod numbers;

mod diagnose;

mod align;

pub use align::align;
pub use channels::beside_gyros;
pub use diagnose::{Diagnosed, Settings, diagnose, serves};
