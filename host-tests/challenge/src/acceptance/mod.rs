//! Acceptance of the diagnosis on marks: trials (`trial`) → recordings and truths (`record`) → commitments and diagnoses (`run`, `under_test`, `read_as`) → judgements
//! (`judge`) → tables (`groups`, `by_effect`, `table`), or the sensitivity to a number of the analysis plan (`curve`).

pub mod by_effect;
pub mod curve;
pub mod groups;
pub mod judge;
pub mod read_as;
pub mod record;
pub mod run;
pub mod table;
pub mod trial;
pub mod under_test;
