//! Marks (acceptance criteria) on ordinary recordings: with references of rate or attitude, and at rest.
//!
//! settings (`setting`, `grade`) → motions (`motion`, `courses`) → surroundings (`case`) → effects (`effects`, `kinds`) →
//! noise (`noise`) → trials (`family`, `rows`, `dithered`, `trial`; with attitudes, at rest and with accelerometers in
//! separate folders) → recordings and truths (`instruments`, `rows_record`, `record`) → commitments and diagnoses (`run`,
//! `under_test`, `read_as`) → judgements (`judge`) → tables (`groups`, `by_effect`, `table`), or the sensitivity to a
//! number of the analysis plan (`curve`)
//!
//! Everything is drawn from one seed; a trial's number determines its family and its stream, so `seed:number` repeats it
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
