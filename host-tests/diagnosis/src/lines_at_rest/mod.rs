//! Spectral lines of a gyro at rest (`line`, found in `lines`), combinations of their frequencies (`products`), bands of
//! noise (`bands`), and their entries in the findings (`line_words`, `band_words`).

pub(crate) mod line;

pub(crate) mod products;

pub(crate) mod lines;

pub(crate) mod line_words;

pub(crate) mod bands;

pub(crate) mod band_words;
