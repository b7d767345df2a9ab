//! The motion that design columns are made of, where it is known from a noisy reference alone.
//!
//! A column made from the reference holds the reference's noise, and so does the residual, with the other sign: a
//! column in which that noise dominates (a derivative of it) would fit the residual by itself. Three steps remove it:
//! [`reference_noise`] measures how much of the declared noise is there; [`conditioned`] makes the motion independent of
//! the residual; [`shrinkage`] keeps it only where it stands out of its noise. [`derivatives`] then differentiates and
//! delays it in the frequency domain. Before any of it, [`channel_check`] says whether gyros and reference mean the same
//! axes, by the [`coherent_map`] between them. [`partition`] says which rows are fitted, confirmed and tested;
//! [`held`], [`stops`] and [`repeated`] say which of them show what was measured.

pub mod partition;

pub mod frames;

pub mod reference_noise;

pub mod conditioned;

pub mod shrinkage;

pub mod derivatives;

pub mod map_plan;

mod cross_spectra;

pub mod coherent_map;

pub mod channel_check;

pub mod held;

pub mod stops;

pub mod repeated;
