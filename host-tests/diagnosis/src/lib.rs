//! Diagnosis against a reference on the gyros' rows: one likelihood, one search, one held-out test.
//!
//! Folders in the order of the data; each imports from those above it:
//!
//! - [`tiles`]: portions of the rows, spectra, tiles in time and frequency, figures on held-out rows, pictures
//! - [`rows`]: channels corrected, the model applied, residual; rows to fit and rows to test
//! - [`alignment`]: gross departures by coarse alignment; motion of the case, independent of the residual
//! - [`iteration`]: point about which a pass is linearised
//! - [`candidates`]: families of columns by score tests, windows of a channel, lock-in, events
//! - [`search`]: linearisation and structure search, pass by pass until set and motion converge
//! - [`confirm`], with [`self_test`]: cross-validation over blocks, parametric bootstrap without an effect, goodness of fit
//! - [`residual`], [`report`]: noise in excess; findings, sentences, experiment that separates a class
//!
//! Kinds of recording on these: [`diagnose`](mod@diagnose) (one, with rates), [`registration`] (two instruments only aligned),
//! [`several`] (recordings of one unit share one search), [`long`] (stretches of a recording longer than memory, and sums
//! over all of it), [`at_rest`] with [`lines_at_rest`] (a unit whose motion is the Earth's).

pub mod tiles;

pub mod rows;

pub mod outcome;

pub mod settings;

pub mod unfit;

pub mod alignment;

pub mod iteration;

pub mod candidates;

pub mod search;

pub mod self_test;

pub mod confirm;

pub mod residual;

pub mod report;

pub mod registration;

pub mod diagnose;

pub mod several;

pub mod long;

pub mod lines_at_rest;

pub mod at_rest;

pub use diagnose::{align, diagnose};
pub use outcome::Outcome;
pub use rlg_inference::work::Work;
pub use settings::Settings;
pub use unfit::Unfit;
