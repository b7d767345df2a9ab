//! Marks of ordinary recordings: beside references of rate or attitude, and at rest.
//!
//! settings (`setting`, `grade`) → motions (`motion`, `courses`) → surroundings (`case`) → effects (`effects`, `kinds`) →
//! noise (`noise`) → trials (`family`, `rows`, `dithered`, `trial`; beside attitudes, at rest and with accelerometers in folders
//! of their own) → recordings and truths (`instruments`, `rows_record`, `record`) → commitments and diagnoses (`run`, `under_test`, `read_as`) → judgements (`judge`) →
//! the tables (`groups`, `by_effect`, `table`), or what other numbers of the analysis plan would give (`curve`)
//!
//! Everything is drawn from one seed; a trial's number fixes its family and its stream, so `seed:number` repeats it
//! alone. The generator shares no code with the diagnosis, and only dithered counts come from the simulator.

pub mod by_effect;
pub mod case;
pub mod courses;
pub mod curve;
pub mod dithered;
pub mod effects;
pub mod family;
pub mod grade;
pub mod groups;
pub mod instruments;
pub mod judge;
pub mod kinds;
pub mod motion;
pub mod noise;
pub mod read_as;
pub mod record;
pub mod rows;
pub mod rows_record;
pub mod run;
pub mod setting;
pub mod table;
pub mod trial;
pub mod under_test;
