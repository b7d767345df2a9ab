//! Gyros as read, their channels, and their effects as columns.

pub(crate) mod channels;

pub(crate) mod gyro_times;

pub(crate) mod zeroing;

pub(crate) mod physics;

pub(crate) mod scanned;

pub(crate) mod still_intervals;
