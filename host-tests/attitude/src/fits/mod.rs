//! The fit of a recording: of many attitudes, or of few.

pub(crate) mod report_inputs;

pub(crate) mod sparse_attitudes;

pub(crate) mod sparse_search;

pub(crate) mod sparse_fit;

pub(crate) mod late_gyros;

pub(crate) mod own_lines;

pub(crate) mod many_fit;
