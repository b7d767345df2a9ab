//! The image: everything that knows which processor it runs on. Exists only for `target_os = "none"`.
//!
//! Enters: `parameters.bin` (the parameter block) and `samples.bin` (samples in their fixed layout), read
//! by semihosting from the emulator's working folder. Leaves, in the same folder: `outputs.bin` (output
//! frames in their fixed layout) and `report.bin` ([`trueaxis::run_report`]); events by defmt on the
//! semihosting console.
//!
//! ```text
//! samples.bin ──main loop──▶ queue ──▶ TIM2 interrupt: source → chain ──▶ queue ──main loop──▶ outputs.bin
//! ```
//!
//! Read in this order: [`run`] (the main loop), [`sampling`] (the interrupt and its deadline),
//! [`sample_timer`], [`instruction_counter`], [`clock`], [`stack`], [`panic`].
//!
//! Deliberately not here: the board's counter bank. Its driver is [`trueaxis::counter_bank`], which needs
//! only an `SpiDevice`; the image for the board is its own step.

mod run;

mod sampling;

mod sample_timer;

mod instruction_counter;

mod clock;

mod stack;

mod panic;
