//! Alignment and qualification of a recording's channels, and denoising of a reference's motion for design columns.
//!
//! A column made from the reference holds the reference's noise, and so does the residual, with the other sign: a column
//! dominated by that noise (a derivative of it) would fit the residual by itself (errors in variables). Three steps remove
//! it: [`reference_noise`] estimates the power of the declared noise; [`conditioned`] makes the motion independent of the
//! residual; [`shrinkage`] keeps it only where it exceeds its noise. [`derivatives`] then differentiates and delays it in
//! the frequency domain. [`partition`] assigns the rows to training, confirmation and test.
//!
//! The channels themselves come first: [`streams`] puts a recording on the gyros' rows; [`channel_map`] tests if gyros and
//! reference share axes, signs and unit, by the [`channel_check`] of the [`coherent_map`] between them, after
//! [`same_motion`] has tested for a common motion and [`lost_rows`] for one delay; [`own_lines`] are vibration of the gyros alone; [`read_once`] selects one row per sample
//! of a held channel; [`qualify`] finds faults of the data ([`held`], [`stops`], [`repeated`]) and masks their rows;
//! [`piece`] names the origin of rows; [`residual`] subtracts the model's prediction. The final residual is accepted as
//! noise only if it is not [`in_step`] with the motion; the [`coherence`] of reading and prediction measures the fit without a
//! noise level.

pub mod axes;

pub mod quantiles;

pub mod channels;

mod unmeasured;

mod installation;

pub mod still;

pub mod accelerometer_rows;

pub mod known_channels;

pub mod streams;

mod alignment;

mod summed;

pub mod own_motion;

pub mod attitude_samples;

pub mod fault;

mod extremes;

mod outliers;

mod channel_faults;

mod data_faults;

pub mod qualify;

pub mod read_once;

pub mod channel_map;

pub mod same_motion;

mod lag_scan;

pub mod lost_rows;

#[cfg(test)]
mod test_noise;

mod line_fit;

pub mod own_lines;

pub mod in_step;

pub mod coherence;

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

pub mod transforms;

mod cross_spectra;

pub mod coherent_map;

pub mod channel_check;

pub mod held;

pub mod stops;

pub mod repeated;
