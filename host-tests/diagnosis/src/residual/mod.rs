//! Residual of a confirmed set: relative to the motion, noise in excess, the reference's own noise, places unexplained.

pub mod relative_residual;

pub mod excess_noise;

pub mod reference_noise_from_gyros;

pub(crate) mod unexplained;
