//! Others' recording with an attitude reference as the base of trials: its own noise without its physics, or its own gyros
//! with an additional effect.
//!
//! attitude by its gyros (`path`) → the recording, its diagnosis, and its reference's error against the aligned gyros
//! (`base`) → injected effects (`planted`) → those errors in blocks, permuted and rotated, or an effect on its gyros
//! (`inject`) → recording of a trial (`record`)
//!
//! The equations are written from the contract; the diagnosis provides only the alignment parameters of the two instruments
//! and the times of reference faults. Errors are added to the reference: it is the noisier of the two, and columns are
//! computed from the gyros.

pub mod base;
pub mod inject;
pub mod path;
pub mod planted;
pub mod record;
