//! Portions of the rows, spectra and tiles in time and frequency: where a residual exceeds its noise, and its figures on held-out rows.

pub mod portion;

pub mod regressor;

pub mod least_squares;

pub mod noise_spectrum;

pub mod regimes;

pub mod locate;

pub mod held_out_figures;

pub mod pictures;
