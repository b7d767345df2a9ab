//! Trials of marks (acceptance criteria): ordinary recordings drawn from a seed, with references of rate or attitude, and at rest.
//!
//! settings (`setting`, `grade`) → motions (`motion`, `courses`) → surroundings (`case`) → effects (`effects`, `kinds`) →
//! noise (`noise`) → trials (`family`, `rows`, `dithered`; with attitudes, at rest and with accelerometers in separate
//! folders) → files of a trial (`instruments`, `rows_record`)
//!
//! Everything is drawn from one seed; a trial's number determines its family and its stream, so `seed:number` repeats it
//! alone. The generator shares no code with the diagnosis, and only dithered counts come from the simulator.

pub mod case;
pub mod courses;
pub mod dithered;
pub mod effects;
pub mod family;
pub mod grade;
pub mod instruments;
pub mod kinds;
pub mod motion;
pub mod noise;
pub mod rows;
pub mod rows_record;
pub mod setting;
