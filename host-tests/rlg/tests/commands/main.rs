//! Commands of `rlg` from end to end, a module for each. Their refusals are tested in `files/bad_input`.

mod align;
mod answer;
#[cfg(target_os = "linux")]
mod asked;
mod browser;
mod challenge;
mod close_loop;
mod demo;
mod doctor;
mod golden;
mod interrupted;
mod log;
mod navigate;
mod page_in_a_browser;
mod paper;
mod replay;
mod replay_dither;
mod replay_drift;
mod report;
mod report_beside;
mod shown;
mod summarize;
