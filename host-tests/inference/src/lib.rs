//! Bayesian selection of linear hypotheses for a set of noisy records, with estimates of their sizes.
//!
//! The observation model is `y = Σ coefficient · column + noise`, for several records (one a sensor) on the same rows. The
//! noise is stationary with the terms of IEEE 952 (angle random walk, white angle, flicker, rate random walk); all four are
//! diagonal in a DCT-II, so that one Whittle likelihood holds down to the lowest frequency. Columns have no physical meaning
//! here.
//!
//! In the order of the data: [`dct`] transforms → [`observations`] selects the seen rows → [`noise`] computes the spectrum
//! of each term → [`transform`] removes the nuisance parameters of gaps → [`normal_equations`] sums columns and records by frequency →
//! [`evaluate`] fits a set of hypotheses with its noise, over any data with a [`likelihood`]; [`information`] holds the
//! normal equations of its parameters → [`search`] finds the set by the steps of [`mod@stepwise`], [`judgement`] compares it with others; [`score_test`] screens long lists of additions, over
//! [`sums`] of rows where there are many; [`events`] scans all rows for steps and impulses, [`change_point`] locates a step, [`lines`] all frequencies for
//! lines, and [`periodogram`] with [`phase_course`] for lines between the coefficients with a wandering phase, and
//! [`line_fit`] with their exact columns; [`block_validation`] cross-validates an effect over blocks of rows. [`laws`] are those that
//! every likelihood keeps, for tests; [`work`] counts transforms, columns and fits.

pub mod work;

pub mod block_validation;

pub mod dct;

pub mod observations;

pub mod noise;

mod noise_fit;

mod noise_estimate;

mod free_rows;

mod gaps;

pub mod transform;

pub mod normal_equations;

pub mod hypothesis;

pub mod likelihood;

pub mod linear;

mod assembled;

pub mod evaluate;

pub mod laws;

pub mod information;

pub mod sums;

pub mod score_test;

pub mod stepwise;

pub mod search;

pub mod judgement;

pub mod events;

pub mod change_point;

pub mod lines;

pub mod periodogram;

pub mod phase_course;

pub mod line_fit;

pub use dct::Dct;
pub use evaluate::{Drift, Fit};
pub use hypothesis::{Bound, Fixed, Hypothesis, Term};
pub use information::Information;
pub use likelihood::{JointLikelihood, Likelihood, ZeroLikelihood};
pub use noise::{NoiseBasis, NoiseLevels};
pub use noise_estimate::NoiseEstimate;
pub use normal_equations::{Columns, NormalEquations};
pub use observations::{Observations, TooFewRows};
pub use search::Search;
pub use stepwise::{Stepwise, stepwise};
