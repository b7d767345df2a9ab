//! A recording of others beside attitudes as the ground of trials: its own noise without its physics, or its own gyros with an
//! effect more.
//!
//! the recording and what is said of it as it is (`base`) → the reference's motion on the gyros' rows (`path`) → what is
//! planted (`planted`) → its own residual in blocks, permuted and turned, or an effect on its gyros (`inject`) → the
//! recording of a trial (`record`)
//!
//! The equations are written from the contract; the diagnosis gives the numbers that align the two instruments and the times
//! at which the reference is wrong, and nothing else.

pub mod base;
pub mod inject;
pub mod path;
pub mod planted;
pub mod record;
