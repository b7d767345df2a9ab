//! From gyros and stamps to rows linearised about an alignment, whitened and in blocks.

pub(crate) mod alignment;

pub(crate) mod conditioned;

pub(crate) mod dither;

pub(crate) mod gyro_motion;

pub(crate) mod increments;

pub(crate) mod earth;

pub(crate) mod linearised_rows;

pub(crate) mod fitting;

pub(crate) mod whitener;

pub(crate) mod blocks;
