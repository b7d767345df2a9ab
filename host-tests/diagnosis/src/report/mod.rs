//! Findings of a confirmed set: values, sentences, sizes by regime, the next experiment.

pub(crate) mod by_regime;

pub(crate) mod finding;

pub mod entries_of_findings;

pub mod summary;

pub mod experiment_words;

pub(crate) mod experiment_question;

pub mod next_experiment;

pub mod own_lines;

pub mod findings;
