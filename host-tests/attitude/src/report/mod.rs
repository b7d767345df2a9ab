//! Findings and figures in the types of `diagnosis.json`.

pub(crate) mod mount;

pub(crate) mod parameter_values;

pub(crate) mod line_entry;

pub(crate) mod reference_spans;

pub(crate) mod held_out;

pub(crate) mod promise;

pub(crate) mod case_motion;

pub(crate) mod findings;
