//! Diagnosis of gyro errors against an attitude reference of any rate and any stamping.
//!
//! In the order of the data, each folder importing from those above it:
//! - `likelihood`: noise with a level in each of the octaves (`modulation`), normal equations, statistics of blocks
//! - `rows`: the attitude integrated from the gyros' increments (`gyro_motion`, `dither` subtracted); `increments` between stamps,
//!   linearised about an `alignment`, with columns from `conditioned` motion; whitened, in `blocks`
//! - `reference`: its faults; `coarse` (global search for delay and rotation); its `vertical`
//! - `gyros`: channels, effects of the catalogue as columns (`physics`), effects of one gyro (`scanned`)
//! - `registration`: `conventions` (body to navigation frame, w first); data of a recording (`observed`); forward selection of the
//!   parameters that align both instruments (`registration_search`), by `gauss_newton` passes
//! - `selection`: effects and groups by blocks of rows, whitened, through their sums alone; scans of the residual for steps, lines and
//!   expressions; the self-test
//! - `fits`: many attitudes; few, whose noise is declared or has a prior (`sparse_attitudes`, in the place of registration and search)
//! - `report`: `held_out`, `promise` and `findings`; the gyros' motion less their errors (`case_motion`), to transport gravity to the
//!   accelerometers
//!
//! A reference of summed increments is accepted, too: sums are compared with sums, without rotation. For the registration alone,
//! `align` omits the physics.

mod likelihood;

mod rows;

mod reference;

mod gyros;

mod registration;

mod selection;

mod fits;

mod report;

mod diagnose;

mod align;

pub use align::align;
pub use diagnose::{Diagnosed, diagnose, serves};
pub use gyros::channels::beside_gyros;
pub use registration::conventions;
