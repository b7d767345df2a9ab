//! Firmware images: updates with power cut at every operation, refusals, trials, records, and requests that nobody sends.

mod choice;
mod power;
mod receiver;
mod refused;
