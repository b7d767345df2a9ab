//! Compares the diagnoses of many recordings and instruments.
//!
//! folders of results → [`run`] → [`statistics`] → [`summary`] → [`table`] (CSV, Parquet) or [`page`] (HTML)

pub mod run;

pub mod statistics;

mod few;

pub mod summary;

pub mod table;

mod pictures;

pub mod page;
