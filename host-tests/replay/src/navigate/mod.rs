//! Navigation of a recording: attitude, velocity and position from its increments, before and after the dynamic
//! compensation.
//!
//! [`Recording`](rlg_recording::Recording) and [`Model`](rlg_model::Model) give [`Trajectory`]s in north, east, down, and
//! [`figures`] of them.
//!
//! Data flow: recording and model → the chain → increments (`readings`) → alignment and strapdown navigation (`trajectory`)
//! → figures (`figures`).
//!
//! "Before" is Eq. (7) with the static installation alone, "after" has the dynamic terms too.
//!
//! # Assumptions
//! The unit does not travel (a table, a shaker), so that its velocity over the Earth is an error and its height is that of
//! the site. Vehicles under way (the `strapdown` package navigates them; a recording of one contains no height) and aids
//! are not handled.

pub mod figures;
pub mod readings;
pub mod trajectory;

pub use readings::Readings;
pub use trajectory::{Place, Start, Trajectory, navigate};
