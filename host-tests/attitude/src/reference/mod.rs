//! Faults of the reference, and its initial alignment.

pub(crate) mod cards;

pub(crate) mod coarse;

pub(crate) mod failures;

pub(crate) mod repeated_samples;

pub(crate) mod reference_faults;

pub(crate) mod reference_jumps;

pub(crate) mod vertical;
