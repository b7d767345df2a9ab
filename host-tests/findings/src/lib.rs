//! What a diagnosis found, in the terms of `diagnosis.json`, of people and of the updated model.
//!
//! [`result`] holds the types of `diagnosis.json`; [`absolute`] whether what is left is noise at all; [`excess`] noise beyond the model's; [`entries`] makes entries of
//! findings, [`combinations`] what of their numbers is fixed; [`own_mode`] which rivals are one physics; [`sentences`] says them, in the [`names`] and [`numbers`] that people read; [`updated_model`] adds them to
//! a model.

pub mod result;

pub mod absolute;

pub mod combinations;

pub mod excess;

pub mod entries;

pub mod names;

pub mod numbers;

pub mod own_mode;

pub mod sentences;

pub mod updated_model;
