//! Diagnosis against a reference on the gyros' rows: one likelihood, one search, one honest test.
//!
//! In the order of the data: [`data`] (residual, rows) → [`coarse`] (what is far off) → [`case_motion`] (independent of
//! the residual) ⇄ [`search`] (columns and structure search on the rows to fit, by [`scores`] of [`families`], windows and [`lock_in`], over a reference `turned` by no small angle),
//! pass by pass until neither changes ([`settle`]) → [`confirm`] (on
//! rows that were not fitted, and by [`reenact`]ing the recording without an effect; [`goodness`] of what is left) →
//! [`findings`] and [`excess_noise`]. Of a unit at rest, whose motion is the Earth's, the same for what acts slowly
//! ([`at_rest`]); several recordings of one unit share one search ([`several`]), and so do
//! stretches of a recording longer than memory and sums over all of it ([`long`]). Where two instruments are only aligned, the same with physics left out ([`registration`]).
//!
//! Before it: channels in other axes or units ([`put_right`]); what is said of faults of the data ([`data_words`]).
//!
//! What others use too: tiles of the residual ([`locate`]) on a [`noise_spectrum`], figures on held-out time
//! ([`validate`]), what coarse pulses hide ([`lattice`]), what the report draws ([`pictures`]).

pub mod portion;

pub mod regressor;

pub mod least_squares;

pub mod noise_spectrum;

pub mod regimes;

pub mod locate;

pub mod validate;

pub mod lattice;

pub mod pictures;

pub mod outcome;

pub mod data_words;

pub mod entries_of_rows;

pub mod plan;

pub mod settings;

mod channel_words;

pub mod put_right;

pub mod aside;

pub mod data;

pub mod noise_levels;

pub mod coarse;

pub mod case_motion;

mod before;

mod turned;

mod path;

mod step;

mod pass;

mod whitened;

mod by_regime;

pub mod scores;

pub mod lock_in;

pub mod families;

mod windows;

pub mod search;

pub mod settle;

pub mod goodness;

pub mod reenact;

mod told;

pub mod confirm;

pub mod excess_noise;

mod left;

pub mod read_by_gyros;

mod finding;

pub mod entries_of_findings;

pub mod summary;

pub mod experiment_words;

pub mod next_experiment;

pub mod findings;

pub mod own_lines;

pub mod self_test;

pub mod registration;

pub mod diagnose;

pub mod several;

pub mod long;

pub mod at_rest;

pub use diagnose::{align, diagnose};
pub use outcome::Outcome;
pub use plan::AnalysisPlan;
pub use settings::Settings;
