//! Point about which a pass is linearised: path of the reference, effects found before, motion and its columns.

pub(crate) mod path;

pub(crate) mod state;

pub(crate) mod reference_rotation;

pub(crate) mod pass;
