//! A recording of others beside attitudes as the ground of trials: its own noise without its physics, or its own gyros with an
//! effect more.
//!
//! the attitude by its gyros (`path`) → the recording, what is said of it as it is, and what its reference shows beyond the
//! aligned gyros (`base`) → what is planted (`planted`) → those errors in blocks, permuted and turned, or an effect on its
//! gyros (`inject`) → the recording of a trial (`record`)
//!
//! The equations are written from the contract; the diagnosis gives the numbers that align the two instruments and the times
//! at which the reference is wrong, and nothing else. Errors are laid on the reference: it is the noisier of the two, and
//! columns are made of the gyros.

pub mod base;
pub mod inject;
pub mod path;
pub mod planted;
pub mod record;
