//! Diagnosis of gyro errors against an attitude reference of any rate and any stamping.
//!
//! In the order of the data: `conventions` (body to navigation frame, w first) → `channels` (axes, signs and units agree) →
//! `coarse` (global search for delay and rotation) → `gyro_motion` (attitude integrated from the gyros' increments, `dither`
//! subtracted) → `increments` (rows of the likelihood, between stamps) → `growth` of the `registration` (forward selection
//! of the parameters that align both instruments, always estimated; by the normal `equations` with estimated `noise`, whose
//! level has a `modulation` in each of the `octaves`; columns from `conditioned` motion; `reference_faults` excluded) →
//! `physics` (effects of the catalogue, transformed by the attitude; among them a reference that is pulled to the
//! `vertical`) → `search` (the `choice` by `blocks` of rows, whitened by the `whitener`, through their `block_sums` alone;
//! `scanned` effects of one gyro by a `residual_scan`: `step_scan`, `line_scan`, `expression_scan`; a `self_test`) → `held_out`, `promise` and `findings`. The gyros' motion less their errors is
//! passed on (`case_motion`), to transport gravity to the accelerometers.
//!
//! A reference of summed increments is accepted, too: sums are compared with sums, without rotation.
//!
//! For attitudes too few to estimate their noise, `few` computes the evidence of rows and columns under declared or prior
//! noise, and `few_search` replaces registration and search (`few_fit`; `many_fit` for all others). For the registration alone, `align` omits the physics.

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

mod failures;

mod observed;

mod vertical;

mod cards;

mod zeroing;

mod gyro_times;

mod own_lines;

mod earth;

mod coarse;

pub mod conventions;

mod settling;

mod physics;

mod block_sums;

mod blocks;

mod scanned;

mod residual_scan;

mod step_scan;

mod line_scan;

mod expression_scan;

mod choice;

mod self_test;

mod search;

mod late_gyros;

mod rest;

mod few;

mod few_search;

mod few_fit;

mod many_fit;

mod promise;

mod reference_spans;

mod said;

mod held_out;

mod case_motion;

mod mount;

mod line_entry;

mod findings;

mod numbers;

mod diagnose;

mod align;

pub use align::align;
pub use channels::beside_gyros;
pub use diagnose::{Diagnosed, diagnose, serves};
