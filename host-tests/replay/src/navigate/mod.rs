//! Navigation: a recording's increments into attitude, velocity and position, before and after the dynamic
//! compensation.
//!
//! Enters: [`Recording`](rlg_recording::Recording) and [`Model`](rlg_model::Model). Leaves: [`Course`]s
//! in north, east, down, and [`figures`] of them.
//!
//! Data flow: recording and model → the chain → increments (`readings`) → alignment and strapdown navigation
//! (`course`) → what people compare (`figures`).
//!
//! "Before" is Eq. (7) with the static installation alone, "after" has the dynamic terms too.
//!
//! Assumed: the unit stays where it is (a table, a shaker), so that its velocity over the Earth is an error,
//! and its height is that of the site. Deliberately not here: a vehicle under way (the `strapdown` package
//! navigates it; a recording of one says nothing of its height), and aids.

pub mod course;
pub mod figures;
pub mod readings;

pub use course::{Course, Place, Start, navigate};
pub use readings::Readings;
