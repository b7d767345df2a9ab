//! Diagnosis against a reference on the gyros' rows: one likelihood, one search, one held-out test.
//!
//! In the order of the data: [`data`] (residual, rows) → [`coarse`] (gross departures) → [`case_motion`] (independent of the
//! residual) ⇄ [`search`] (columns and structure search on the rows to fit, by [`scores`] of [`families`], windows and
//! [`lock_in`], after a large rotation of the reference, `turned`), pass by pass until neither changes ([`settle`]) →
//! [`confirm`] (cross-validation over blocks, and parametric bootstrap without an effect by [`reenact`]; [`goodness`] of fit
//! of the residual) → [`findings`] and [`excess_noise`]. Of a unit at rest, whose motion is the Earth's, the same for slow
//! effects ([`at_rest`]); several recordings of one unit share one search ([`several`]), and so do stretches of a recording
//! longer than memory and sums over all of it ([`long`]). Where two instruments are only aligned, the same without physical
//! effects ([`registration`]).
//!
//! Before it: correction of channels in other axes or units ([`put_right`]); sentences on faults of the data
//! ([`data_words`]).
//!
//! Also used elsewhere: tiles of the residual ([`locate`]) on a [`noise_spectrum`], figures on held-out time ([`validate`]),
//! quantisation by coarse pulses ([`lattice`]), pictures of the report ([`pictures`]).

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

pub mod settings;

mod channel_words;

pub mod put_right;

pub mod aside;

pub mod model_effects;

pub mod data;

pub mod noise_levels;

mod axis_regression;

mod coarse_path;

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

mod filters;

mod resonances;

pub mod families;

mod windows;

mod linearisation;

mod event_search;

pub mod search;

pub mod settle;

pub mod goodness;

pub mod self_test;

mod sharing;

mod together;

mod sums;

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

mod experiment_question;

pub mod next_experiment;

pub mod findings;

pub mod relative_residual;

pub mod own_lines;

pub mod registration;

pub mod diagnose;

pub mod several;

pub mod long;

pub mod at_rest;

pub use diagnose::{align, diagnose};
pub use outcome::Outcome;
pub use rlg_inference::work::Work;
pub use settings::Settings;
