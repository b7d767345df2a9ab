//! Noise of the rows, and their normal equations by frequency and by block.

pub(crate) mod modulation;

pub(crate) mod octaves;

pub(crate) mod noise;

pub(crate) mod equations;

pub(crate) mod outliers;

pub(crate) mod block_sums;
