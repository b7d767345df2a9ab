//! Data of a recording, and the alignment of both instruments.

pub(crate) mod settling;

pub(crate) mod observed;

pub mod conventions;

pub(crate) mod gauss_newton;

pub(crate) mod registration_search;
