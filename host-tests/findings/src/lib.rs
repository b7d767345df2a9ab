//! Findings of a diagnosis, in the terms of `diagnosis.json`, of the reader and of the updated model.
//!
//! [`result`] holds the types of `diagnosis.json`, [`schema`] makes its JSON Schema of them; [`absolute`] tests if the residual is noise; [`excess`] is noise
//! beyond the model's; [`entries`] forms entries of findings, [`combinations`] the estimable combinations of their
//! parameters; [`own_mode`] identifies rivals of the same physics; [`sentences`] formulates findings, in the [`names`]
//! and [`numbers`] of the report; [`updated_model`] adds them to a model.

pub mod result;

pub mod schema;

pub mod absolute;

pub mod combinations;

pub mod excess;

pub mod entries;

pub mod names;

pub mod numbers;

pub mod own_mode;

pub mod sentences;

pub mod updated_model;
