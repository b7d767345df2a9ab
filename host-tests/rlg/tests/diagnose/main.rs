//! The mismatch tool against recordings whose truth is known to these tests and to nothing they test.

mod accelerometers;

mod at_rest;

mod attitude;

mod bench_recordings;
mod channels;
mod concealed_effects;
mod data_faults;
mod families;
mod gross;
mod hidden;
mod independence;
mod long;
mod modes;
mod next_experiment;
mod one_likelihood;
mod outside;
mod positions;
mod reference_errors;
mod several;
mod slow_reference;
mod stages;
mod support;
mod wiring;
