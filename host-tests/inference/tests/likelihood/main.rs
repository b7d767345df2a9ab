//! Likelihoods and the search over them, on data made here.

mod free_constants;
mod gaps;
mod joint;
mod laws;
mod many_columns;
mod own_data;
