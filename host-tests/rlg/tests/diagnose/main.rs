//! The mismatch tool on recordings whose truth is known to these tests only, not to the code under test.

mod accelerometers;

mod at_rest;

mod attitude;
mod attitude_scans;

mod bench_recordings;
mod channels;
mod concealed_effects;
mod data_faults;
mod families;
mod gross;
mod hidden;
mod independence;
mod laws;
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
mod tumble;
mod turntable;
mod wiring;
