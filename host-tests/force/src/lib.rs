//! What a model leaves out of accelerometers that are carried through gravity: one likelihood, one search.
//!
//! In the order of the data: [`readings`] (of one recording or several) and [`mod@reference`] (its known errors undone) →
//! [`carried`] (attitude, lever arms) → [`vertical`] →
//! [`prediction`] (what accelerometers should read) → [`residual`] → [`shaken`] (what no gravity explains is left out) →
//! [`search`] (columns, candidates, structure search, beside the vertical) → [`confirm`] (in blocks of rows) → [`findings`].
//! [`diagnose`](mod@diagnose) is the flow; [`whose`] asks gyros and accelerometers together whether an error is the gyros' or
//! their reference's.
//!
//! Predicted is the force of a unit that is turned and not shaken: gravity, carried by the reference, and what lever arms feel
//! of the turning. At rest gravity is one number for three accelerometers: nothing is named there. A unit that stands still in many
//! attitudes without a reference goes another way to the same search: [`positions`].

pub mod positions_plan;

pub mod plan;

pub mod reference;

pub mod readings;

pub mod carried;

pub mod vertical;

pub mod prediction;

pub mod column;

pub mod kinds;

pub mod candidates;

pub mod residual;

pub mod search;

pub mod shaken;

pub mod confirm;

pub mod diagnose;

pub mod findings;

pub mod whose;

pub mod positions;

pub use diagnose::{Asked, Diagnosed, Part, diagnose, why_not_at_rest};
pub use findings::say_why_not;
pub use plan::ForcePlan;
pub use reference::ReferenceNoise;
pub use whose::beside;
