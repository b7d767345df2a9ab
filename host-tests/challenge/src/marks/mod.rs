//! Marks of ordinary recordings: reference increments on the gyros' rows, any engine.
//!
//! settings (`setting`) → motions (`motion`, `courses`) → surroundings (`case`) → effects (`effects`, `kinds`) →
//! noise (`noise`) → trials (`family`, `trial`, `dithered`) → recordings and truths (`record`) → commitments and diagnoses
//! (`run`, `engine`) → judgements (`judge`) → the table (`groups`, `table`), or what other numbers of the analysis plan
//! would give (`curve`)
//!
//! Everything is drawn from one seed; a trial's number fixes its family and its stream, so `seed:number` repeats it
//! alone. The generator shares no code with the diagnosis, and only dithered counts come from the simulator.

pub mod by_effect;
pub mod case;
pub mod courses;
pub mod curve;
pub mod dithered;
pub mod effects;
pub mod engine;
pub mod family;
pub mod grade;
pub mod groups;
pub mod instruments;
pub mod judge;
pub mod kinds;
pub mod motion;
pub mod noise;
pub mod record;
pub mod run;
pub mod setting;
pub mod table;
pub mod trial;
