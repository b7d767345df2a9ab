//! `rlg calibrate` on recordings whose coefficients are known to these tests only, not to the code under test.

mod bench_recordings;
mod closed_form;
mod coverage;
mod planner;
mod refusals;
mod table_three;
mod thresholds;
mod what_is_known;
