//! The motion that design columns are made of, where it is known from a noisy reference alone.
//!
//! A column made from the reference holds the reference's noise, and so does the residual, with the other sign: a
//! column in which that noise dominates (a derivative of it) would fit the residual by itself. Three steps remove it:
//! [`reference_noise`] measures how much of the declared noise is there; [`conditioned`] makes the motion independent of
//! the residual; [`shrinkage`] keeps it only where it stands out of its noise. [`derivatives`] then differentiates and
//! delays it in the frequency domain. [`partition`] says which rows are fitted, confirmed and tested.
//!
//! Before it stand the channels themselves: [`streams`] puts a recording on the gyros' rows; [`channel_map`] says whether
//! gyros and reference mean the same axes, by the [`channel_check`] of the [`coherent_map`] between them, after
//! [`same_motion`] says whether they show one motion at all, and [`lost_rows`] whether they do so at one delay; [`own_lines`] are the gyros' alone; [`read_once`]
//! takes one row a reading; [`qualify`] finds faults of the data ([`held`], [`stops`], [`repeated`]) and takes their rows
//! out of use; [`piece`] says what rows are of; [`residual`] takes away what a model predicts. What is left at the end is
//! noise only if it is not [`in_step`] with the motion.

pub mod axes;

pub mod channels;

mod unmeasured;

mod installation;

pub mod still;

pub mod accelerometer_rows;

pub mod known_channels;

pub mod streams;

mod summed;

pub mod own_motion;

pub mod attitude_samples;

pub mod fault;

mod outliers;

mod data_plan;

mod data_faults;

pub mod qualify;

pub mod read_once;

pub mod channel_map;

pub mod same_motion;

pub mod lost_rows;

#[cfg(test)]
mod test_noise;

pub mod own_lines;

pub mod in_step;

pub mod piece;

mod stretch;

pub mod residual;

pub mod partition;

pub mod frames;

pub mod reference_noise;

pub mod conditioned;

pub mod shrinkage;

pub mod derivatives;

pub mod linear_prediction;

pub mod map_plan;

pub mod transforms;

mod cross_spectra;

pub mod coherent_map;

pub mod channel_check;

pub mod held;

pub mod stops;

pub mod repeated;
